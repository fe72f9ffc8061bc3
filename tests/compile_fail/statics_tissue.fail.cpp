// SPDX-License-Identifier: MIT
// expect: palpate: the first argument is no EquilibriumSolver of the body's tissue; DynamicRelaxation{} is one of any
// Newton's method on tissue that has no tangent.
#include <palpate/palpate.hpp>
#include "beads.hpp"

void run() {
  using namespace palpate;
  SoftBody body(Beads(make_grid<double>(3, 3, 0.01)), LeapfrogVerlet{}, WholeBody{});
  body.solve_statics(NewtonRaphson{});
}
