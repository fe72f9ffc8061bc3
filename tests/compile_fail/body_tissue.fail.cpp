// SPDX-License-Identifier: MIT
// expect: palpate: this is no TissueModel, which begins with: using Scalar = double; see palpate/tissue/concept.hpp, or use MassSpring<double>.
// A mesh is a shape; what it is made of is missing.
#include <palpate/palpate.hpp>

void step() {
  using namespace palpate;
  auto const skin = make_grid<double>(3, 3, 0.01);
  SoftBody body(skin, LeapfrogVerlet{}, WholeBody{});
  body.step(1e-3);
}
