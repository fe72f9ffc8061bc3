// SPDX-License-Identifier: MIT
// One body, moved by every integrator: nothing but the type changes. A square of 10 × 10 particles is pulled down at its middle with a force
// that grows to 10 N in 7 s (the thesis's first scene). The table shows, for each, its stable step, the steps taken here, their cost (the median of
// seven runs, with the fastest and the slowest), and how far the pulled particle ends from where an adaptive eighth-order method puts it.
#include <palpate/palpate.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdio>

namespace {

using namespace palpate;

constexpr double seconds = 7.0, reference = -2.13427;   // m
constexpr std::size_t runs = 7;

MassSpring<double> square() {
  auto const mesh = make_grid<double>(10, 10, 1.0);
  MassSpring<double> tissue(mesh, {.mass = {.total = 1.0, .lumping = Lumping::equal},
                                   .link = {.stiffness = 1.0, .damping = 1.0},
                                   .home = {.stiffness = 2.0, .damping = 1.0}});
  tissue.nail(boundary_vertices(mesh));
  return tissue;
}

template <class Integrator>
void run(char const* name, Integrator integrator, double longest_step) {
  std::array<double, runs> cost{};   // ms
  double stable = 0.0, error = 0.0;
  int steps = 0;
  for (double& milliseconds : cost) {
    SoftBody body(square(), integrator, WholeBody{});
    stable = body.stable_step();
    steps = static_cast<int>(std::ceil(seconds / std::min(longest_step, 0.9 * stable)));
    double const h = seconds / steps;
    auto const start = std::chrono::steady_clock::now();
    for (int k = 0; k < steps; ++k) {
      body.apply_force(44, {0.0, 0.0, -10.0 * (k + 0.5) / steps});   // constant over a step: its value in the middle
      if (!body.step(h)) {
        std::printf("%-16s diverged\n", name);
        return;
      }
    }
    milliseconds = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    error = std::abs(body.displacement(44).z() - reference);
  }
  std::sort(cost.begin(), cost.end());
  std::printf("%-16s %10.3g %7d %11.2f %8.2f ... %-8.2f %9.1e\n", name, stable, steps, cost[runs / 2], cost.front(), cost.back(), error);
}

}  // namespace

int main() {
  std::printf("%-16s %10s %7s %11s %21s %9s\n", "integrator", "stable [s]", "steps", "median [ms]", "least ... most [ms]", "error [m]");
  run("ExplicitEuler", ExplicitEuler{}, 2e-3);
  run("SymplecticEuler", SymplecticEuler{}, 2e-3);
  run("StoermerVerlet", StoermerVerlet{}, 2e-3);
  run("LeapfrogVerlet", LeapfrogVerlet{}, 2e-3);
  run("VelocityVerlet", VelocityVerlet{}, 2e-3);
  run("ExplicitMidpoint", ExplicitMidpoint{}, 2e-3);
  run("RungeKutta4", RungeKutta4{}, 2e-3);
  run("DormandPrince", DormandPrince{}, 0.02);   // chooses its own steps within these
  run("BackwardEuler", BackwardEuler{}, 0.02);
  run("CrankNicolson", CrankNicolson{}, 0.02);
  return 0;
}
