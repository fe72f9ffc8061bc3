// SPDX-License-Identifier: MIT
// expect: SeparatingCutter: this tissue can not be cut along its edges; it lacks the ability SeparableTissue: void move_rest(
// A scalpel on tissue that has forces but no way to change its surface.
#include "beads.hpp"

void cut() {
  using namespace palpate;
  SoftBody body(Beads(make_grid<double>(3, 3, 0.01)), LeapfrogVerlet{}, WholeBody{});
  SeparatingCutter<double> tool({.puncture_depth = 0.006});
  tool.advance(body, {0.01, 0.01, -0.01});
  body.step(1e-3);
}
