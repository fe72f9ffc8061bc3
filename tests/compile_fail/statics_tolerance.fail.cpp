// SPDX-License-Identifier: MIT
// expect: palpate: the first argument is no EquilibriumSolver of the body's tissue; DynamicRelaxation{} is one of any
// A tolerance where the solver belongs.
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  FiniteElements<double, StableNeoHookean<double>> tissue(make_block<double>(3, 3, 3, 0.01), {.density = 1000.0});
  SoftBody body(std::move(tissue));
  body.solve_statics(1e-6);
}
