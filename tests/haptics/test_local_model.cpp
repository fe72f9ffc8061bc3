// SPDX-License-Identifier: MIT
// Yardstick: the distance of a point below a plane.
#include "catch.hpp"

#include <palpate/haptics/local_model.hpp>

#include <limits>
#include <type_traits>
#include <utility>

using namespace palpate;

static_assert(std::is_trivially_destructible_v<LocalModel<double>> && std::is_trivially_destructible_v<LocalModel<float>>,
              "it holds no memory of its own");
static_assert(noexcept(std::declval<LocalModel<double> const&>().depth(std::declval<Vector3<double> const&>())));

TEMPLATE_TEST_CASE("a fresh local model knows of no contact", "[haptics][local_model]", PALPATE_TEST_SCALARS) {
  LocalModel<TestType> const model;
  CHECK_FALSE(model.diverged);
  CHECK(model.phase == CuttingPhase::no_contact);
  CHECK(model.depth(Vector3<TestType>(0, 0, -1)) == 0);
  CHECK(model.tissue_force.isZero(0));
}

TEMPLATE_TEST_CASE("depth is the distance below the plane, and zero above it", "[haptics][local_model]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  LocalModel<S> model;
  model.phase = CuttingPhase::indenting;
  model.home_point = {S(0.1), S(0.2), S(0.3)};
  model.normal = Vector3<S>(S(0.6), 0, S(0.8));
  double const close = 10 * std::numeric_limits<S>::epsilon();
  for (S const d : {S(0.001), S(0.05)})
    for (S const along : {S(-0.3), S(0), S(0.02)}) {
      Vector3<S> const tangent(S(0.8), 0, S(-0.6));
      Vector3<S> const tip = model.home_point - d * model.normal + along * tangent;
      CHECK(model.depth(tip) == Approx(double(d)).margin(close));
      CHECK(model.depth(Vector3<S>(tip + 2 * d * model.normal)) == 0);
    }
  model.tip_radius = S(0.004);   // a sphere touches with its lowest point
  CHECK(model.depth(model.home_point) == Approx(0.004).margin(close));
  CHECK(model.depth(Vector3<S>(model.home_point + S(0.005) * model.normal)) == 0);
}
