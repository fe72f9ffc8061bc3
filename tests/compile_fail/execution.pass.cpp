// SPDX-License-Identifier: MIT
// Each policy in its place.
#include <palpate/palpate.hpp>

void build() {
  using namespace palpate;
  SoftBody body(MassSpring<double>(make_grid<double>(3, 3, 0.01), {}), LeapfrogVerlet{}, ZoneOfInfluence{}, Serial{});
}
