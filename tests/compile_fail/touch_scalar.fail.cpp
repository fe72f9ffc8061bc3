// SPDX-License-Identifier: MIT
// expect: Touch: it computes in another scalar than the body; take Touch<float> for a body in float.
// A tip in float on a body in double.
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  MassSpring<double> tissue(make_grid<double>(3, 3, 0.01), {});
  SoftBody body(std::move(tissue));
  Touch<float> touch(0.002f);
  touch.update(body, {0, 0, 0});
}
