// SPDX-License-Identifier: MIT
// expect: SoftBody: the fourth policy is no Execution; Serial{} and OnCores(2) are.
// A region in the place of the execution.
#include <palpate/palpate.hpp>

void build() {
  using namespace palpate;
  SoftBody body(MassSpring<double>(make_grid<double>(3, 3, 0.01), {}), LeapfrogVerlet{}, WholeBody{}, ZoneOfInfluence{});
}
