// SPDX-License-Identifier: MIT
// A scalpel on tissue that has forces but no way to change its surface.
#include "beads.hpp"

void cut() {
  using namespace palpate;
  SoftBody body(Beads(make_grid<double>(3, 3, 0.01)), LeapfrogVerlet{}, WholeBody{});
  NoCutter<double> tool;
  tool.advance(body, {0.01, 0.01, -0.01});
  body.step(1e-3);
}
