// SPDX-License-Identifier: MIT
// expect: palpate::CuttingForce: a part is neither a force curve
// expect: and mark it noexcept: it runs in the servo tick.
// A force curve that may throw.
#include <palpate/palpate.hpp>

struct Linear {
  double operator()(double depth) const { return 120.0 * depth; }
};

void compose() {
  palpate::CuttingForce force(Linear{});
  force(palpate::ToolContact<double>{});
}
