// SPDX-License-Identifier: MIT
// A force curve that may throw.
#include <palpate/palpate.hpp>

struct Linear {
  double operator()(double depth) const noexcept { return 120.0 * depth; }
};

void compose() {
  palpate::CuttingForce force(Linear{});
  force(palpate::ToolContact<double>{});
}
