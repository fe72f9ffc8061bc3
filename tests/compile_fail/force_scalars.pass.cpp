// SPDX-License-Identifier: MIT
// Parts of a force in float and in double.
#include <palpate/palpate.hpp>

void compose() {
  using namespace palpate;
  CuttingForce const force(liver_hysteresis<double>(), OrganForce<double>{.coefficient = 1.0, .wall_normal = {1, 0, 0}});
  static_cast<void>(force);
}
