// SPDX-License-Identifier: MIT
// The same without the mistake.
#include <palpate/palpate.hpp>
#include <palpate/scene.hpp>

void run() {
  using namespace palpate;
  MassSpring<double> tissue(make_grid<double>(3, 3, 0.01), {});
  FiniteElements<double, StableNeoHookean<double>> solid(make_block<double>(3, 3, 3, 0.01), {.density = 1000.0});
  SoftBody body(std::move(tissue));
  SoftBody organ(std::move(solid));
  Scene scene(std::move(body), std::move(organ));
  scene.advance(1e-3);
}
