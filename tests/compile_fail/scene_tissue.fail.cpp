// SPDX-License-Identifier: MIT
// expect: Scene: one of its parts is no body; of a tissue make one, SoftBody body(std::move(tissue)), of a rigid surface an Obstacle
// A scene of a body and a tissue.
#include <palpate/palpate.hpp>
#include <palpate/scene.hpp>

void run() {
  using namespace palpate;
  MassSpring<double> tissue(make_grid<double>(3, 3, 0.01), {});
  FiniteElements<double, StableNeoHookean<double>> solid(make_block<double>(3, 3, 3, 0.01), {.density = 1000.0});
  Scene scene(SoftBody<MassSpring<double>, LeapfrogVerlet, WholeBody>(std::move(tissue), LeapfrogVerlet{}, WholeBody{}), std::move(solid));
  scene.advance(1e-3);
}
