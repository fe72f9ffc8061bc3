// SPDX-License-Identifier: MIT
// expect: palpate: a tool changes the body that it acts on, and this one is const; give the body itself.
// A cutter is given a body that it may not change.
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  MassSpring<double> tissue(make_grid<double>(3, 3, 0.01), {});
  SoftBody const body(std::move(tissue));
  ProgressiveCutter<double> knife;
  knife.advance(body, ToolPose<double>{});
}
