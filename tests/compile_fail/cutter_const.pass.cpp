// SPDX-License-Identifier: MIT
// The same without the mistake.
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  MassSpring<double> tissue(make_grid<double>(3, 3, 0.01), {});
  SoftBody body(std::move(tissue));
  ProgressiveCutter<double> knife;
  knife.advance(body, ToolPose<double>{});
}
