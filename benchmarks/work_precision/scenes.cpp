// SPDX-License-Identifier: MIT
#include "scene.hpp"

#include <palpate/body/damping.hpp>
#include <palpate/body/stability.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/heart.hpp>

#include <cmath>
#include <numbers>
#include <utility>

namespace work_precision {

namespace {

/// x(t) of x″ + 2ζω x′ + ω² x = 0 from x = 0, x′ = v.
double impulse_response(double ratio, double frequency, double v, double t) {
  double const decay = std::exp(-ratio * frequency * t);
  if (ratio < 1) {
    double const damped = frequency * std::sqrt(1 - ratio * ratio);
    return v / damped * decay * std::sin(damped * t);
  }
  if (ratio == 1) return v * t * decay;
  double const spread = frequency * std::sqrt(ratio * ratio - 1);
  return v / (2 * spread) * (std::exp((spread - ratio * frequency) * t) - std::exp(-(spread + ratio * frequency) * t));
}

double leapfrog_limit(MassSpring<double> const& tissue) {
  return LeapfrogVerlet{}.stable_step(ModalEstimate<MassSpring<double>>{}(tissue, tissue.rest_positions(), [&](int i) { return !tissue.nailed(i); }));
}

std::string two_digits(double x) {
  std::string const text = std::to_string(x);
  return text.substr(0, text.find('.') + 3);
}

}  // namespace

Scene impulse(std::string name, double damping_ratio) {
  constexpr double mass = 0.01, frequency = 4, speed = 1;
  // Four particles that move as one: their links do nothing, and are so weak that they limit no step.
  MassSpring<double> tissue(make_grid<double>(2, 2, 1.0), {.mass = {.total = 4 * mass, .lumping = Lumping::equal},
                                                           .link = {.stiffness = 1e-6},
                                                           .home = {.stiffness = mass * frequency * frequency, .damping = 2 * damping_ratio * frequency * mass}});
  Scene scene{.name = std::move(name), .title = "One particle after an impulse, damping ratio " + two_digits(damping_ratio), .tissue = std::move(tissue)};
  scene.duration = 2;
  scene.samples = 4;
  scene.velocity = {0, 0, speed};
  scene.swings = damping_ratio == 0;   // else its twin is that one
  scene.exact = [=](double t) { return impulse_response(damping_ratio, frequency, speed, t); };
  return scene;
}

Scene thesis_grid(int n) {
  // The thesis's coefficients for its 20 × 20 grid, nailed at its border, at 1 m between particles.
  auto const mesh = make_grid<double>(n, n, 1.0);
  MassSpring<double> tissue(mesh, {.mass = {.total = 1.0, .lumping = Lumping::equal},
                                   .link = {.stiffness = 2.0, .damping = 1.0},
                                   .home = {.stiffness = 1.0, .damping = 0.5}});
  tissue.nail(boundary_vertices(mesh));
  Scene scene{.name = "grid_" + std::to_string(n * n), .title = "Thesis grid of " + std::to_string(n * n) + " particles, pressed and let go", .tissue = std::move(tissue)};
  scene.duration = 2;
  scene.samples = 4;
  scene.touched = n / 2 * n + n / 2;
  scene.force = {0, 0, -7};
  scene.share = [](double t) { return t < 1 ? 1.0 : 0.0; };
  return scene;
}

Scene heart() {
  MassSpring<double> tissue(make_heart<double>(), {.mass = {.total = 0.3, .lumping = Lumping::equal},
                                                   .link = {.stiffness = 100, .damping = 0.02},
                                                   .home = {.stiffness = 10, .damping = 0.05}});
  Scene scene{.name = "heart", .title = "Heart of 961 particles, pressed and let go", .tissue = std::move(tissue)};
  scene.duration = 0.2;
  scene.samples = 8;
  scene.touched = 100;
  scene.force = {0, 0.2, -0.3};
  scene.share = [](double t) { return t < 0.1 ? 1.0 : 0.0; };
  return scene;
}

Scene stiff_block(int n, int layers, int samples) {
  MassSpring<double> tissue(make_block<double>(n, n, layers, 0.01), {.mass = {.total = 9e-4 * n * n * layers, .lumping = Lumping::equal},
                                                                     .link = {.stiffness = 5000, .damping = 0.3},
                                                                     .home = {.stiffness = 1, .damping = 0.02}});
  for (int i = 0; i < n * n; ++i) tissue.nail(i);
  Scene scene{.name = "stiff", .title = "Stiff block, pushed slowly and held", .tissue = std::move(tissue)};
  scene.samples = samples;
  scene.duration = scene.samples * 1000 * leapfrog_limit(scene.tissue);
  scene.touched = (layers - 1) * n * n + n / 2 * n + n / 2;
  scene.force = Vector3<double>(6, 3, -6) * (n * n / 64.0);
  scene.share = [half = scene.duration / 2](double t) { return t < half ? (1 - std::cos(std::numbers::pi * t / half)) / 2 : 1.0; };
  scene.smooth_load = true;
  return scene;
}

std::vector<Scene> all_scenes() {
  std::vector<Scene> scenes;
  scenes.push_back(impulse("impulse_undamped", 0));
  scenes.push_back(impulse("impulse_underdamped", 0.25));
  scenes.push_back(impulse("impulse_critical", 1));
  scenes.push_back(impulse("impulse_overdamped", 2));
  for (int const n : {15, 20, 25}) scenes.push_back(thesis_grid(n));
  scenes.push_back(heart());
  scenes.push_back(stiff_block(8, 5, 16));
  return scenes;
}

std::vector<Scene> quick_scenes() {
  std::vector<Scene> scenes;
  scenes.push_back(impulse("impulse_undamped", 0));
  scenes.push_back(impulse("impulse_underdamped", 0.25));
  Scene small = thesis_grid(6);
  small.duration = 0.5;
  small.share = [](double t) { return t < 0.25 ? 1.0 : 0.0; };
  scenes.push_back(std::move(small));
  scenes.push_back(stiff_block(3, 3, 2));
  scenes.back().name = "slow";
  return scenes;
}

MassSpring<double> undamped(MassSpring<double> tissue) {
  DampingProposal<double> none;
  none.home.assign(static_cast<std::size_t>(tissue.size()), 0.0);
  none.link.assign(static_cast<std::size_t>(tissue.links().size()), 0.0);
  set_damping(tissue, none);
  return tissue;
}

}  // namespace work_precision
