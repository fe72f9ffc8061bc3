// SPDX-License-Identifier: MIT
// Yardstick: by hand, a force over a depth.
#include "catch.hpp"

#include <palpate/haptics/secant_stiffness.hpp>

#include <limits>

using namespace palpate;

TEMPLATE_TEST_CASE("the spring is as stiff as the tissue answers, within bounds, and keeps its stiffness near the surface", "[haptics]",
    PALPATE_TEST_SCALARS) {
  using S = TestType;
  SecantStiffness<S> spring(50, 800, S(0.0005));
  Vector3<S> const n(S(0.6), 0, S(0.8));
  CHECK(spring(S(1) * n, n, S(0.0001)) == S(50));   // nothing known yet
  CHECK(double(spring(S(1) * n, n, S(0.004))) == Approx(250.0).epsilon(1e-5));
  // of a reaction along the surface its part along the normal
  CHECK(double(spring(Vector3<S>(1, 0, 0), n, S(0.004))) == Approx(150.0).epsilon(1e-5));
  CHECK(double(spring(S(1) * n, n, S(0.0001))) == Approx(150.0).epsilon(1e-5));
  CHECK(spring(S(9) * n, n, S(0.004)) == S(800));
  CHECK(spring(S(-1) * n, n, S(0.004)) == S(50));
  CHECK(spring(Vector3<S>(std::numeric_limits<S>::quiet_NaN(), 0, 0), n, S(0.004)) == S(50));
  CHECK(spring(n, n, std::numeric_limits<S>::quiet_NaN()) == S(50));
  CHECK_THROWS_WITH(SecantStiffness<S>(0, 800), says("the least is 0 N/m", "above zero"));
  CHECK_THROWS_WITH(SecantStiffness<S>(100, 80), says("the most is 80 N/m", "not below the least"));
  CHECK_THROWS_AS(SecantStiffness<S>(1, 2, 0), InvalidArgument);
  static_assert(noexcept(spring(n, n, S(0))));
}
