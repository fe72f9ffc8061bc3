// SPDX-License-Identifier: MIT
// The same without the mistake.
#include <palpate/palpate.hpp>
#include "beads.hpp"

void run() {
  using namespace palpate;
  SoftBody body(Beads(make_grid<double>(3, 3, 0.01)), LeapfrogVerlet{}, WholeBody{});
  body.solve_statics(DynamicRelaxation{});
}
