// SPDX-License-Identifier: MIT
// expect: ProgressiveCutter: the cutter computes in another scalar than the body
// A cutter in float on a body in double.
#include <palpate/palpate.hpp>

void cut() {
  using namespace palpate;
  SoftBody body(MassSpring<double>(make_grid<double>(3, 3, 0.01), {}));
  ProgressiveCutter<float> scalpel({.puncture_depth = 0.005f});
  Vector3<double> const tip(0.01, 0.01, -0.01);
  scalpel.advance(body, tip);
  body.step(1e-3);
}
