// SPDX-License-Identifier: MIT
// expect: palpate: the cutter computes in another scalar than the body: advance(body, ToolPose<Scalar> const& tool) must take the body's
// The law battery for a cutter in float on a body in double.
#include <palpate/palpate.hpp>

#include <palpate/extend/cutter.hpp>

bool check() {
  using namespace palpate;
  SoftBody body(MassSpring<double>(make_grid<double>(3, 3, 0.01), {}));
  return testing::check_cutter(NoCutter<float>{}, body, {.way = {{0.01, 0.01, 0.01}, {0.01, 0.01, -0.01}}}).empty();
}
