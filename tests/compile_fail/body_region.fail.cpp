// SPDX-License-Identifier: MIT
// expect: palpate: the third policy is no Region, which has: template <class Graph> void select(Graph const& graph
// A number of rings is not yet a region.
#include <palpate/palpate.hpp>

void step() {
  using namespace palpate;
  SoftBody body(MassSpring<double>(make_grid<double>(3, 3, 0.01), {}), LeapfrogVerlet{}, 2);
  body.step(1e-3);
}
