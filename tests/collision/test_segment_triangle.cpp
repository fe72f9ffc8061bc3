// SPDX-License-Identifier: MIT
#include "allocation_trap.hpp"
#include "brute_force.hpp"
#include "catch.hpp"

#include <palpate/collision/segment_triangle.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

using namespace palpate;
using namespace palpate_test;

namespace {

/// The law of the nearest pair of two convex sets, in long double: with w = f − g from the triangle's point g to the segment's point f,
/// w·(v − f) ≥ −e for both ends v of the segment, w·(v − g) ≤ e for all corners v, implies |w|² − d² ≤ 4 e for the true distance d. With e = 0 it holds for a
/// nearest pair and for no other. Rounding of f and g, a few ε times the size, makes e as large as that times the size.
template <class Scalar>
void check_pair(Vector3<Scalar> const& from, Vector3<Scalar> const& to, Vector3<Scalar> const& a, Vector3<Scalar> const& b, Vector3<Scalar> const& c) {
  auto const found = closest_points<Scalar>(from, to, a, b, c);
  CAPTURE(from.transpose(), to.transpose(), a.transpose(), b.transpose(), c.transpose(), found.parameter, found.barycentric.transpose(), found.squared_distance);
  Scalar const eps = std::numeric_limits<Scalar>::epsilon();
  Scalar const size = std::max({(a - from).norm(), (b - from).norm(), (c - from).norm(), (to - from).norm()});
  long double const tolerance = 64 * eps * size;
  REQUIRE((found.parameter >= 0 && found.parameter <= 1));
  REQUIRE((found.barycentric.minCoeff() >= 0 && found.barycentric.maxCoeff() <= 1));
  REQUIRE(std::abs(found.barycentric.sum() - 1) <= 4 * eps);
  Long3 const p = from.template cast<long double>(), q = to.template cast<long double>();
  Long3 const corner[] = {a.template cast<long double>(), b.template cast<long double>(), c.template cast<long double>()};
  Long3 const u = found.barycentric.template cast<long double>() / found.barycentric.template cast<long double>().sum();
  Long3 const g = u.x() * corner[0] + u.y() * corner[1] + u.z() * corner[2];
  Long3 const f = p + static_cast<long double>(found.parameter) * (q - p);
  Long3 const w = f - g;
  REQUIRE(std::abs(std::sqrt(static_cast<long double>(found.squared_distance)) - w.norm()) <= tolerance);
  REQUIRE((found.on_segment.template cast<long double>() - f).norm() <= tolerance + 4 * eps * from.norm());
  REQUIRE((found.on_triangle.template cast<long double>() - g).norm() <= tolerance + 4 * eps * from.norm());
  for (Long3 const& v : {p, q}) REQUIRE(w.dot(v - f) >= -tolerance * size);
  for (Long3 const& v : corner) REQUIRE(w.dot(v - g) <= tolerance * size);
}

}  // namespace

TEMPLATE_TEST_CASE("A segment and a triangle: face, edge, corner and through, by hand", "[collision][segment_triangle]", PALPATE_TEST_SCALARS) {
  using V = Vector3<TestType>;
  V const a(0, 0, 0), b(4, 0, 0), c(0, 4, 0);
  struct Place {
    V from, to, on_segment, on_triangle;
    bool crosses;
  };
  Place const places[] = {{V(1, 1, 3), V(1, 1, 8), V(1, 1, 3), V(1, 1, 0), false},          // an end over the face
                          {V(1, 1, 3), V(1, 1, -5), V(1, 1, 0), V(1, 1, 0), true},          // through the face
                          {V(2, -1, -2), V(2, -1, 2), V(2, -1, 0), V(2, 0, 0), false},      // across an edge
                          {V(-1, -3, 1), V(-1, 3, 1), V(-1, 0, 1), V(0, 0, 0), false},      // beside the edge a-c, past its end: parallel to it
                          {V(6, -2, 0), V(6, 2, 0), V(6, 0, 0), V(4, 0, 0), false},         // past a corner
                          {V(3, 3, 0), V(9, 9, 0), V(3, 3, 0), V(2, 2, 0), false}};         // in the plane
  for (Place const& place : places) {
    auto const found = closest_points<TestType>(place.from, place.to, a, b, c);
    CAPTURE(place.from.transpose(), place.to.transpose(), found.on_segment.transpose(), found.on_triangle.transpose());
    CHECK(found.crosses == place.crosses);
    CHECK(std::sqrt(found.squared_distance) == Approx((place.on_segment - place.on_triangle).norm()).margin(1e-6));
    if (place.from.x() == -1) continue;   // parallel: any pair at this distance
    CHECK((found.on_segment - place.on_segment).norm() <= 8 * std::numeric_limits<TestType>::epsilon());
    CHECK((found.on_triangle - place.on_triangle).norm() <= 8 * std::numeric_limits<TestType>::epsilon());
  }
}

TEMPLATE_TEST_CASE("Random, parallel, flat and short ones satisfy the law of the nearest pair in long double", "[collision][segment_triangle]", PALPATE_TEST_SCALARS) {
  using V = Vector3<TestType>;
  Random random(Seed{12});
  int crossed = 0;
  for (int i = 0; i < 20000; ++i) {
    V const a = random_in_box<TestType>(random, 1), b = random_in_box<TestType>(random, 1), shift = i % 7 == 0 ? random_in_box<TestType>(random, 100) : V(V::Zero());
    V c = random_in_box<TestType>(random, 1), from = random_in_box<TestType>(random, i % 2 == 0 ? 1 : 3), to = random_in_box<TestType>(random, i % 2 == 0 ? 1 : 3);
    TestType const small = std::pow(TestType(10), -static_cast<TestType>(i % 9));
    if (i % 10 == 1) to = from + (b - a) * TestType(0.7) + small * random_in_box<TestType>(random, 1);   // along an edge
    if (i % 10 == 2) c = a + (b - a) * TestType(0.3) + small * random_in_box<TestType>(random, 1);       // thin
    if (i % 10 == 3) to = from;                                                                          // a point
    if (i % 10 == 4) from = (a + b + c) / 3 + small * random_in_box<TestType>(random, 1), to = from + (b - a) + small * (c - a);   // in its plane
    if (i % 10 == 5) to = a;                                                                             // ends at a corner
    check_pair<TestType>(from + shift, to + shift, a + shift, b + shift, c + shift);
    crossed += closest_points<TestType>(from, to, a, b, c).crosses ? 1 : 0;
  }
  CHECK(crossed > 500);
}

TEST_CASE("Whether a segment goes through a triangle agrees with the signs of five volumes", "[collision][segment_triangle]") {
  Random random(Seed{13});
  auto const volume = [](Vector3<double> const& p, Vector3<double> const& q, Vector3<double> const& r, Vector3<double> const& s) {
    return (q - p).cross(r - p).dot(s - p);
  };
  AllocationCount const allocations;
  int wrong = 0, through = 0;
  for (int i = 0; i < 20000; ++i) {
    auto const from = random_in_box<double>(random, 1), to = random_in_box<double>(random, 1), a = random_in_box<double>(random, 1), b = random_in_box<double>(random, 1),
               c = random_in_box<double>(random, 1);
    double const u = volume(from, to, a, b), v = volume(from, to, b, c), w = volume(from, to, c, a);
    bool const crosses = volume(a, b, c, from) * volume(a, b, c, to) < 0 && ((u > 0 && v > 0 && w > 0) || (u < 0 && v < 0 && w < 0));
    wrong += closest_points<double>(from, to, a, b, c).crosses != crosses ? 1 : 0;
    through += crosses ? 1 : 0;
  }
  long const made = allocations.count();
  CHECK(made == 0);
  CHECK(wrong == 0);
  CHECK(through > 500);
}
