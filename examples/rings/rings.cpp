// SPDX-License-Identifier: MIT
// A liver of vertex rings under a fingertip: the touched vertex and its two rings give way, each on its own spring, and nothing else moves.
//   at rest    u_r = s_r F                      F the force on the hand
//   a tip d deep over a vertex, coupled by K:   F = d/(1/k + 1/K),  k = −1/s_0
//   that goes deeper evenly, v = d′:            F = k u + k τ u′,  (K + k) u = K d + C (v − u′) − k τ u′,  u′ = v K/(K + k)
//   let go     u fades as e^(−t/τ)
#include "../album.hpp"

#include <palpate/cutting/no_cutter.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/mesh/organ.hpp>
#include <palpate/mesh/rings.hpp>
#include <palpate/models.hpp>
#include <palpate/simulator/simulator.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>

namespace {

using namespace palpate;
using Vector = Vector3<double>;

constexpr std::array<double, 3> slopes{-8e-3, -4e-3, -1.5e-3};   // m/N
constexpr double return_time = 0.04, coupling = 2000.0, deepest = 0.010;   // s, N/m, m

VertexRings<double> liver() { return VertexRings(make_organ<double>({.vertices = 4000}), {.slopes = slopes, .return_time = return_time}); }

drawing::Album rings_example() {
  using namespace drawing;
  auto body = liver();
  int const touched = body.nearest_vertex({0.0, 0.0, 1.0});
  Vector const home = body.reference_position(touched), out = body.reference_normal(touched);

  body.apply_force(touched, -out);   // 1 N
  body.solve_statics();
  std::printf("%-6s %9s %10s %12s\n", "ring", "vertices", "moved [mm]", "s_r F [mm]");
  auto const rings = vertex_rings(body.rest_mesh(), touched, 3);
  for (std::size_t r = 0; r < rings.size(); ++r) {
    double mean = 0;
    for (int const i : rings[r]) mean += body.displacement(i).norm() / double(rings[r].size());
    std::printf("%-6zu %9zu %10.4f %12.4f\n", r, rings[r].size(), 1e3 * mean, r < 3 ? -1e3 * slopes[r] : 0.0);
  }
  std::printf("the touched vertex's spring renders %.4f N\n", body.home_force(touched).dot(out));

  Picture release("rings_return", "Let go: dots computed, line the closed form", "time [ms]", "displacement of the touched vertex [mm]");
  auto &line = release.line(blue, "exponential, 40 ms"), &dots = release.dots(orange, "steps of 1 to 20 ms");
  double const pressed = body.displacement(touched).norm();
  sample(line, 0.0, 0.2, 1e3, [&](double t) { return 1e3 * pressed * std::exp(-t / return_time); });
  double off = 0, t = 0;
  for (int step = 0; t < 0.19; ++step) {
    add(dots, 1e3 * t, 1e3 * body.displacement(touched).norm());
    double const h = step < 10 ? 1e-3 : step < 20 ? 5e-3 : 2e-2;
    body.step(h), t += h;
    off = std::max(off, std::abs(body.displacement(touched).norm() - pressed * std::exp(-t / return_time)));
  }
  std::printf("let go, largest difference from the closed form %.1e m\n", off);

  ScriptedDevice<double> const finger({{0.0, home + 0.002 * out}, {1.2, home - deepest * out}, {1.6, home - deepest * out}, {2.2, home + 0.02 * out}});
  Simulator simulator(finger, liver(), NoCutter<double>(), TissueReaction{}, SimulatorOptions{.coupling = {.stiffness = coupling}});
  Picture force("rings_force", "A fingertip on a liver of vertex rings: dots computed, lines the closed forms", "depth [mm]", "force on the hand [N]");
  auto &law = force.line(blue, "at rest: two springs in series"), &moving = force.dashes(green, "at 10 mm/s: and their dampers");
  auto &felt = force.dots(orange, "felt while going deeper"), &rested = force.dots(pink, "felt at rest");
  double const stiffness = 1 / (1 / coupling - slopes[0]), k = -1 / slopes[0], speed = 0.010, share = coupling / (coupling + k);
  double const damper = ContactCoupling{}.damping;
  auto const pressing = [&](double d) {
    return k * (coupling * d + (damper * (1 - share) - k * return_time * share) * speed) / (coupling + k) + k * return_time * share * speed;
  };
  sample(law, 0.0, 1.1 * deepest, 1e3, [&](double d) { return stiffness * d; });
  sample(moving, 0.0, 1.1 * deepest, 1e3, pressing);
  double apart = 0;
  Album album;
  double held = 0;
  int count = 0;
  simulator.run(2.2, [&](Tick const& tick) {
    if (++count % 100 == 0 && tick.time < 1.2 && tick.depth > 0.0015) {   // the dampers have settled
      add(felt, 1e3 * tick.depth, tick.force.dot(out));
      apart = std::max(apart, std::abs(tick.force.dot(out) - pressing(tick.depth)));
    }
    if (std::abs(tick.time - 1.55) < 5e-4) {
      held = tick.force.dot(out);
      add(rested, 1e3 * tick.depth, held);
      album.views.push_back({.name = "rings_liver", .mesh = simulator.body().mesh(), .from = Vector(0.25, -1.0, 0.7)});
    }
  });
  std::printf("%.0f mm deep the hand feels %.4f N, closed form %.4f N\n", 1e3 * deepest, held, stiffness * deepest);
  std::printf("on the way there at most %.4f N from the closed form with dampers\n", apart);
  std::printf("drawn off, %zu vertices are still on their way home\n", simulator.body().away().size());
  album.charts = {force, release};
  return album;
}

}  // namespace

int main(int argc, char** argv) { return drawing::run_example("rings", argc, argv, rings_example); }
