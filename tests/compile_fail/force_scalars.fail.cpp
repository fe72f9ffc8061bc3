// SPDX-License-Identifier: MIT
// expect: palpate::CuttingForce: the parts compute in different scalars.
// Parts of a force in float and in double.
#include <palpate/palpate.hpp>

void compose() {
  using namespace palpate;
  CuttingForce const force(liver_hysteresis<float>(), OrganForce<double>{.coefficient = 1.0, .wall_normal = {1, 0, 0}});
  static_cast<void>(force);
}
