// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include <palpate/core/random.hpp>
#include <palpate/core/similarity.hpp>

#include <limits>
#include <numbers>

using namespace palpate;

namespace {

template <class S>
Vector3<S> any_vector(Random& random) {
  return {random.normal<S>(), random.normal<S>(), random.normal<S>()};
}

template <class S>
Similarity<S> any_similarity(Random& random) {
  Eigen::Quaternion<S> const turn(random.normal<S>(), random.normal<S>(), random.normal<S>(), random.normal<S>());
  return Similarity<S>::make(std::exp(random.normal<S>()), turn, any_vector<S>(random));
}

template <class S>
Matrix<S, 4, 4> homogeneous(Similarity<S> const& frame) {
  Matrix<S, 4, 4> m = Matrix<S, 4, 4>::Identity();
  m.template topLeftCorner<3, 3>() = frame.scale() * frame.rotation();
  m.template topRightCorner<3, 1>() = frame.translation();
  return m;
}

}  // namespace

// The yardstick is the product of 4 × 4 matrices of homogeneous coordinates.
TEMPLATE_TEST_CASE("C10-M1: similarities multiply and invert as their matrices do", "[core][similarity]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Random random(Seed{4});
  S const tolerance = std::numeric_limits<S>::epsilon() * S(400);
  for (int trial = 0; trial < 200; ++trial) {
    auto const a = any_similarity<S>(random), b = any_similarity<S>(random);
    Vector3<S> const p = any_vector<S>(random);
    Matrix<S, 4, 4> const product = homogeneous(a) * homogeneous(b);
    Vector3<S> const expected = (product * p.homogeneous()).template head<3>();
    S const size = S(1) + expected.norm() + a.scale() * b.scale() * p.norm();
    CHECK(((a * b).point(p) - expected).norm() <= tolerance * size);
    CHECK((a.inverse().point(a.point(p)) - p).norm() <= tolerance * (S(1) + p.norm() + a.translation().norm() / a.scale()));
    CHECK(((a.point(p) - a.point(Vector3<S>::Zero())) - a.vector(p)).norm() <= tolerance * size * (S(1) + a.translation().norm()));
    CHECK(std::abs(a.direction(p).norm() - p.norm()) <= tolerance * p.norm());
    CHECK(std::abs(a.rotation().determinant() - S(1)) <= tolerance);
    CHECK((homogeneous(Similarity<S>::from_matrix(homogeneous(a))) - homogeneous(a)).norm() <= tolerance * (S(1) + homogeneous(a).norm()));
  }
}

TEST_CASE("a similarity that says nothing changes nothing", "[core][similarity]") {
  Vector3<double> const p{0.1, -1e-300, 3e7};
  CHECK(Similarity<double>{}.point(p) == p);
  CHECK(Similarity<double>{}.vector(p) == p);
}

TEST_CASE("C10-M3: the axes of a device on a desk, in a world whose z is up", "[core][similarity]") {
  // x to the right stays, y up becomes z, z towards the user becomes −y: a quarter turn about x.
  auto const world_from_desk = Similarity<double>::make(1.0, Eigen::Quaternion<double>(Eigen::AngleAxis<double>(std::numbers::pi / 2, Vector3<double>::UnitX())), {0, 0, 0});
  CHECK((world_from_desk.point({1, 2, 3}) - Vector3<double>(1, -3, 2)).norm() < 1e-15 * 10);
}

TEST_CASE("C10-M4: what can not carry forces is refused with what was found", "[core][similarity]") {
  auto const with = [](auto change) {
    Matrix<double, 4, 4> m = Matrix<double, 4, 4>::Identity();
    change(m);
    return Similarity<double>::from_matrix(m);
  };
  CHECK_THROWS_WITH(with([](auto& m) { m(0, 0) = -1; }), says("determinant is -1", "mirror", "swap or negate an axis"));
  CHECK_THROWS_WITH(with([](auto& m) { m(0, 0) = 2; }), says("away from a rotation", "scale all axes alike"));
  CHECK_THROWS_WITH(with([](auto& m) { m(0, 1) = 0.1; }), says("away from a rotation", "do not shear"));
  CHECK_THROWS_WITH(with([](auto& m) { m(3, 2) = -1; }), says("last row", "without the projection"));
  CHECK_THROWS_WITH(with([](auto& m) { m(1, 1) = NAN; }), says("nan in row 1, column 1", "finite"));
  CHECK_THROWS_WITH(Similarity<double>::make(0.0, Eigen::Quaterniond::Identity(), {0, 0, 0}), says("scale is 0", "above zero"));
  CHECK_THROWS_WITH(Similarity<double>::make(1.0, Eigen::Quaterniond(0, 0, 0, 0), {0, 0, 0}), says("without direction", "not zero"));
  CHECK_THROWS_WITH(Similarity<double>::make(1.0, Eigen::Quaterniond::Identity(), {0, INFINITY, 0}), says("translation is (0, inf, 0) m", "finite"));
}
