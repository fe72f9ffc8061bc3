// SPDX-License-Identifier: MIT
// One body, moved by every integrator: nothing but the type changes. A square of 10 × 10 particles is pulled down at its middle with a force
// that grows to 10 N in 7 s (the thesis's first scene). The table shows, for each, its stable step, the steps taken here, their cost, and
// how far the pulled particle ends from where an adaptive eighth-order method puts it.
#include <palpate/palpate.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <utility>

namespace {

using namespace palpate;

constexpr double seconds = 7.0, reference = -2.13427;   // m

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
  SoftBody body(square(), std::move(integrator), WholeBody{});
  double const stable = body.stable_step();
  int const steps = static_cast<int>(std::ceil(seconds / std::min(longest_step, 0.9 * stable)));
  double const h = seconds / steps;
  auto const start = std::chrono::steady_clock::now();
  for (int k = 0; k < steps; ++k) {
    body.apply_force(44, {0.0, 0.0, -10.0 * (k + 0.5) / steps});   // constant over a step: its value in the middle
    if (!body.step(h)) {
      std::printf("%-18s diverged\n", name);
      return;
    }
  }
  std::chrono::duration<double, std::milli> const cost = std::chrono::steady_clock::now() - start;
  std::printf("%-18s %12.3g %8d %10.2f %14.1e\n", name, stable, steps, cost.count(), std::abs(body.displacement(44).z() - reference));
}

}  // namespace

int main() {
  std::printf("%-18s %12s %8s %10s %14s\n", "integrator", "stable [s]", "steps", "cost [ms]", "error [m]");
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
}
