// SPDX-License-Identifier: MIT
// expect: SoftBody: the third policy is no Region; WholeBody{} and ZoneOfInfluence{.rings = 2} are.
// A number of rings is not yet a region.
#include <palpate/palpate.hpp>

void step() {
  using namespace palpate;
  SoftBody body(MassSpring<double>(make_grid<double>(3, 3, 0.01), {}), LeapfrogVerlet{}, 2);
  body.step(1e-3);
}
