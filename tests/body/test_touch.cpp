// SPDX-License-Identifier: MIT
// Yardsticks: closed forms on a plane and on a sphere; every triangle of the deformed surface tried in long double, by a linear solve
// (`hits_along`) or by tests/collision/brute_force.hpp; for random walks a second state machine on a height field.
#include <palpate/body/soft_body.hpp>
#include <palpate/body/touch.hpp>
#include <palpate/core/random.hpp>
#include <palpate/haptics/contact_coupling.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include "catch.hpp"
#include "collision/brute_force.hpp"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

using namespace palpate;
using palpate_test::Long3;

namespace {

template <class S>
auto body_of(TriangleMesh<S> const& mesh, bool nail_border = false) {
  MassSpring<S> tissue(mesh, {.mass = {.total = S(0.1)},
                              .link = {.stiffness = S(80), .damping = S(0.2)},
                              .home = {.stiffness = S(8), .damping = S(0.1)}});
  if (nail_border) tissue.nail(boundary_vertices(mesh));
  return SoftBody(std::move(tissue), LeapfrogVerlet{}, WholeBody{});
}

/// 10 cm × 10 cm in the plane z = 0.
template <class S>
TriangleMesh<S> sheet() {
  return make_grid<S>(21, 21, S(0.005));
}

/// A closed plate of 10 cm × 10 cm, its upper side in the plane z = 0.
template <class S>
TriangleMesh<S> slab(S thickness) {
  auto mesh = surface(make_block<S>(21, 21, 2, S(0.005)));
  mesh.points.row(2) = (mesh.points.row(2).array() / S(0.005) - S(1)) * thickness;
  return mesh;
}

template <class S>
Vector3<S> at(double x, double y, double z) {
  return Vector3<double>(x, y, z).cast<S>();
}

/// What coordinates of 0.1 m are known to, with room for a few operations.
template <class S>
constexpr S rounding = S(0.1) * 64 * std::numeric_limits<S>::epsilon();

template <class S>
Long3 wide(Vector3<S> const& v) {
  return v.template cast<long double>();
}

struct Hit {
  int triangle;
  Long3 weights;
  Long3 point;
  long double height;   // of the hit over the query, along the line
};

/// Where the line through a point along n leaves the surface through a triangle: a + u (b − a) + v (c − a) = p + t n, triangle by triangle.
template <class S>
std::vector<Hit> hits_along(TriangleMesh<S> const& mesh, Vector3<S> const& query, Vector3<S> const& n, long double slack) {
  std::vector<Hit> hits;
  Long3 const p = wide<S>(query);
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    Long3 const a = wide<S>(mesh.points.col(mesh.triangles(0, t))), b = wide<S>(mesh.points.col(mesh.triangles(1, t))),
                c = wide<S>(mesh.points.col(mesh.triangles(2, t)));
    if (!((b - a).cross(c - a).dot(wide<S>(n)) > 0)) continue;
    Eigen::Matrix<long double, 3, 3> system;
    system << b - a, c - a, -wide<S>(n);
    Long3 const uvt = system.fullPivLu().solve(p - a);
    Long3 const w(1 - uvt[0] - uvt[1], uvt[0], uvt[1]);
    if (w.minCoeff() >= -slack) hits.push_back({static_cast<int>(t), w, p + uvt[2] * wide<S>(n), uvt[2]});
  }
  return hits;
}

/// The contact against the only place where the line meets the surface from inside; "" when they agree.
template <class Body, class S = typename Body::Scalar>
std::string unlike_the_hit(Body const& body, SurfaceContact<S> const& contact, Vector3<S> const& tip, Vector3<S> const& n) {
  constexpr long double slack = 2000 * std::numeric_limits<S>::epsilon();
  auto const mesh = body.mesh();
  auto const hits = hits_along<S>(mesh, tip, n, slack);
  if (hits.empty()) return "the line meets no triangle";
  Long3 recomposed = Long3::Zero(), home = Long3::Zero(), normal = Long3::Zero();
  for (int k = 0; k < 3; ++k) {
    int const i = mesh.triangles(k, contact.triangle);
    auto const w = static_cast<long double>(contact.barycentric[k]);
    recomposed += w * wide<S>(mesh.points.col(i));
    home += w * wide<S>(body.reference_position(i));
    normal += w * wide<S>(body.reference_normal(i));
  }
  auto const close = static_cast<long double>(20 * rounding<S>);
  if ((recomposed - wide<S>(contact.point)).norm() > close) return "the weights do not give the point";
  if ((home - wide<S>(contact.home_point)).norm() > close) return "the weights do not give the home point";
  if ((normal.normalized() - wide<S>(contact.normal)).norm() > 100 * std::numeric_limits<S>::epsilon()) return "the normal is another";
  if (std::abs(contact.barycentric.sum() - 1) > 16 * std::numeric_limits<S>::epsilon() || contact.barycentric.minCoeff() < 0)
    return "the weights are no weights";
  bool same_place = false, same_triangle = false;
  for (Hit const& hit : hits) {
    if ((hit.point - wide<S>(contact.point)).norm() > close) return "the line meets another place of the surface";
    same_place = true;
    same_triangle = same_triangle || hit.triangle == contact.triangle;
  }
  if (!same_place) return "the line meets the surface elsewhere";
  return same_triangle ? "" : "the triangle does not hold the point";
}

template <class S>
double depth_from(SurfaceContact<S> const& contact, Vector3<S> const& tip, S radius) {
  return static_cast<double>(static_cast<long double>(radius) - (wide<S>(tip) - wide<S>(contact.home_point)).dot(wide<S>(contact.normal)));
}

/// Waves on a sheet of 10 cm: heights up to `amplitude` and, when the sheet is held, sideways a little, without folds.
template <class Body>
void wave(Body& body, double amplitude, double phase) {
  using S = typename Body::Scalar;
  for (int i = 0; i < body.size(); ++i) {
    Vector3<double> const home = body.reference_position(i).template cast<double>();
    double const z = std::sin(70 * home.x() + phase) * std::cos(55 * home.y() - 0.7 * phase);
    double const aside = std::sin(45 * home.x() + 60 * home.y() + 2 * phase);
    body.drag(i, at<S>(home.x() + 0.3 * amplitude * aside, home.y() - 0.2 * amplitude * aside, amplitude * z));
  }
}

}  // namespace

TEMPLATE_TEST_CASE("contact begins only from outside", "[body][touch]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto body = body_of(sheet<S>());
  Touch<S> touch;
  auto const touches = [&](double x, double z) { return touch.update(body, at<S>(x, 0.0533, z)).touching; };

  SECTION("a tip that starts behind the sheet has to come in front of it") {
    CHECK_FALSE(touches(0.0312, -0.010));
    CHECK_FALSE(touches(0.0312, -0.0001));
    CHECK_FALSE(touches(0.0512, -0.003));
    CHECK_FALSE(touches(0.0512, 0.004));    // through it from behind
    CHECK_FALSE(touches(0.0512, 0.0001));
    CHECK(touches(0.0512, -0.0001));
    CHECK(touches(0.0512, -0.020));
    CHECK_FALSE(touches(0.0512, 0.0001));
    CHECK(touches(0.0512, -0.0001));        // and again
  }
  SECTION("a tip that was not finite changes nothing") {
    S const nan = std::numeric_limits<S>::quiet_NaN();
    CHECK_FALSE(touches(0.0312, 0.001));
    CHECK_FALSE(touch.update(body, Vector3<S>(nan, 0, 0)).touching);
    CHECK(touches(0.0312, -0.001));
    auto const& contact = touch.update(body, Vector3<S>(S(0.03), nan, S(0.02)));
    CHECK(contact.touching);
    CHECK(contact.depth == Approx(0.001));
    CHECK_FALSE(touches(0.0312, 0.001));
  }
  SECTION("reset forgets where the tip was") {
    touches(0.0312, 0.001);
    touch.reset();
    CHECK_FALSE(touches(0.0312, -0.001));
    touches(0.0312, 0.001);
    CHECK(touches(0.0312, -0.001));
    touch.reset();
    CHECK_FALSE(touch.contact().touching);
    CHECK_FALSE(touches(0.0312, -0.002));
  }
  SECTION("the surface that counts is the one of now") {
    for (int i = 0; i < body.size(); ++i) body.drag(i, body.reference_position(i) - at<S>(0, 0, 0.004));
    CHECK_FALSE(touches(0.0312, 0.001));
    CHECK_FALSE(touches(0.0312, -0.0039));   // below the undisturbed surface, not yet on the tissue
    CHECK(touches(0.0312, -0.0041));
    CHECK(touch.contact().depth == Approx(0.0041));
    CHECK(touches(0.0312, -0.0039));         // it ends only above both
    CHECK(touches(0.0312, -0.0001));
    CHECK_FALSE(touches(0.0312, 0.0001));
    for (int i = 0; i < body.size(); ++i) body.drag(i, body.reference_position(i) + at<S>(0, 0, 0.004));
    CHECK_FALSE(touches(0.0312, 0.0041));
    CHECK(touches(0.0312, 0.0039));
    CHECK(touch.contact().depth == Approx(-0.0039));
    CHECK(touch.contact().point.z() == Approx(0.004));
    CHECK_FALSE(touches(0.0312, 0.0041));
  }
}

TEMPLATE_TEST_CASE("on a ball contact begins only from outside", "[body][touch]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto body = body_of(make_sphere<S>(S(0.05), 8));
  Vector3<S> const way = at<S>(0.3, -0.5, 0.8).normalized();
  Touch<S> touch;
  auto const touches = [&](double r) { return touch.update(body, Vector3<S>(S(r) * way)).touching; };
  for (double const r : {0.0, 0.01, 0.03, 0.045, 0.049}) CHECK_FALSE(touches(r));   // from the middle outwards
  CHECK_FALSE(touches(0.0501));
  CHECK(touches(0.0490));
  CHECK(touches(0.020));
  CHECK(touches(0.0490));
  CHECK_FALSE(touches(0.0502));
}

TEMPLATE_TEST_CASE("on a plane the depth is minus z, whatever the tissue does", "[body][touch]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto body = body_of(sheet<S>(), true);
  for (double const radius : {0.0, 0.0023}) {
    body.reset();
    Touch<S> touch{S(radius)};
    ContactCoupling const coupling;
    S const h = std::min(S(1e-3), S(0.9) * body.stable_step());
    double off = 0, share = 0, last = -1;
    int ticks = 0;
    for (double depth = -0.001; depth < 0.012; depth += 2e-5) {
      Vector3<S> const tip = at<S>(0.0312, 0.0533, radius - depth);
      auto const& contact = touch.update(body, tip);
      if (std::abs(depth) < 1e-6) continue;
      CHECK(contact.touching == (depth > 0));
      if (!contact.touching) continue;
      off = std::max(off, std::abs(double(contact.depth) - depth));
      CHECK(double(contact.depth) > last);
      last = double(contact.depth);
      CHECK(contact.normal.isApprox(Vector3<S>::UnitZ()));
      CHECK((contact.point - tip).template head<2>().norm() <= 10 * rounding<S>);
      share = -double(contact.point.z()) / depth;
      coupling.apply(body, contact, tip, at<S>(0, 0, -2e-5 / double(h)), S(radius), h);
      REQUIRE(body.step(h));
      ++ticks;
    }
    CHECK(ticks > 590);
    CHECK(off < 10 * double(rounding<S>));
    CHECK(share > 0.3);   // the tissue did follow
  }
}

// A geodesic ball whose vertices lie on the sphere: its facets are up to a²/(2R) inside, a < edge/√3 their circumradius, so the depth
// is R − |tip| less at most that, and a normal off by up to a/R changes it to second order only.
TEMPLATE_TEST_CASE("on a sphere the depth is radius minus distance from the centre", "[body][touch]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  double const R = 0.05;
  double worst[2] = {0, 0};
  int const frequencies[2] = {6, 12};
  for (int which = 0; which < 2; ++which) {
    auto const mesh = make_sphere<S>(S(R), frequencies[which]);
    auto body = body_of(mesh);
    double edge = 0;
    for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t)
      for (int k = 0; k < 3; ++k)
        edge = std::max(edge, double((mesh.points.col(mesh.triangles(k, t)) - mesh.points.col(mesh.triangles((k + 1) % 3, t))).norm()));
    double const bound = edge * edge / 3 / (2 * R);
    Random random(Seed{3});
    for (double const radius : {0.0, 0.004})
      for (int k = 0; k < 60; ++k) {
        Vector3<S> way = palpate_test::random_in_box<S>(random, 1);
        if (way.norm() < S(0.1)) way = Vector3<S>::UnitX();
        way.normalize();
        Touch<S> touch{S(radius)};
        touch.update(body, Vector3<S>(S(R + radius + 0.001) * way));
        for (double const depth : {0.002, 0.006, 0.012}) {
          auto const& contact = touch.update(body, Vector3<S>(S(R + radius - depth) * way));
          REQUIRE(contact.touching);
          double const off = double(contact.depth) - depth;
          worst[which] = std::max(worst[which], std::abs(off));
          CHECK(off < 0.1 * bound);
          CHECK(off > -1.1 * bound);
          CHECK((contact.normal - way).norm() < S(0.5 * edge / R));
        }
      }
    // At a corner of the icosahedron, all symmetric, the depth is exact once the touched point has come there from the first facet.
    Vector3<S> const corner = mesh.points.col(3).normalized();
    Touch<S> touch;
    touch.update(body, Vector3<S>(S(R + 0.001) * corner));
    for (int k = 0; k < 40; ++k) touch.update(body, Vector3<S>(S(R - 0.007) * corner));
    CHECK(touch.contact().depth == Approx(0.007).epsilon(0).margin(double(20 * rounding<S>)));
  }
  CHECK(worst[0] / worst[1] > 3.0);   // second order: a quarter with half the edge
}

TEMPLATE_TEST_CASE("contact begins where the tip's ball meets the surface", "[body][touch]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto body = body_of(sheet<S>());
  S const radius = S(0.003);
  Touch<S> touch{radius};
  CHECK_FALSE(touch.update(body, at<S>(0.042, 0.051, 0.00301)).touching);
  CHECK(touch.update(body, at<S>(0.042, 0.051, 0.00299)).touching);
  CHECK(touch.contact().depth == Approx(1e-5).margin(double(10 * rounding<S>)));
  CHECK(touch.update(body, at<S>(0.042, 0.051, -0.002)).depth == Approx(0.005));
  CHECK_FALSE(touch.update(body, at<S>(0.042, 0.051, 0.00301)).touching);
  // Beside the crest of a ridge the ball meets the flank before its centre is over it by the radius.
  for (int i = 0; i < body.size(); ++i) {
    Vector3<S> x = body.reference_position(i);
    x.z() = std::max(S(0), S(0.01) - std::abs(x.x() - S(0.05)));   // two planes at 45°
    body.drag(i, x);
  }
  double const over = 0.003 * std::sqrt(2.0);
  touch.reset();
  CHECK_FALSE(touch.update(body, at<S>(0.0449, 0.051, 0.0049 + over + 1e-5)).touching);
  CHECK(touch.update(body, at<S>(0.0449, 0.051, 0.0049 + over - 1e-5)).touching);
  CHECK_THROWS_AS(Touch<S>(S(-0.001)), InvalidArgument);
  CHECK_THROWS_AS(Touch<S>(std::numeric_limits<S>::quiet_NaN()), InvalidArgument);
  CHECK_THROWS_WITH(Touch<S>(S(2)), Catch::Contains("the tip radius is 2 m") && Catch::Contains("in mm it would be 0.002 m"));
}

TEMPLATE_TEST_CASE("on a deformed sheet the contact is the one that all triangles agree on", "[body][touch]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Random random(Seed{11});
  auto body = body_of(sheet<S>());
  for (int shape = 0; shape < 4; ++shape) {
    wave(body, 0.004, shape * 1.3);
    for (int k = 0; k < 40; ++k) {
      double const x = random.uniform(0.012, 0.088), y = random.uniform(0.012, 0.088), z = random.uniform(-0.02, 0.003);
      Touch<S> touch;
      Vector3<S> const tip = at<S>(x, y, z);
      touch.update(body, at<S>(x, y, 0.02));
      auto const& contact = touch.update(body, tip);
      auto const above = hits_along<S>(body.mesh(), tip, Vector3<S>::UnitZ(), 0);
      REQUIRE_FALSE(above.empty());
      CAPTURE(shape, k, x, y, z);
      if (std::abs(double(above.front().height)) < 1e-6) continue;
      REQUIRE(contact.touching == (above.front().height > 0));
      if (!contact.touching) continue;
      REQUIRE(double(contact.depth) == Approx(depth_from<S>(contact, tip, 0)).margin(double(rounding<S>)));
      if (contact.depth > 0) {
        REQUIRE(unlike_the_hit(body, contact, tip, Vector3<S>(Vector3<S>::UnitZ())) == "");
      } else {   // raised tissue touched above the undisturbed plane: the nearest point
        auto const distance = double(palpate_test::surface_distance(body.mesh(), tip));
        REQUIRE(double((contact.point - tip).norm()) == Approx(distance).margin(double(20 * rounding<S>)));
      }
    }
  }
}

TEMPLATE_TEST_CASE("on a deformed ball the contact is the one that all triangles agree on", "[body][touch]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Random random(Seed{12});
  auto body = body_of(make_sphere<S>(S(0.05), 8));
  auto mesh = body.rest_mesh();
  palpate_test::deform<S>(mesh, random, S(0.002), S(60));
  for (int i = 0; i < body.size(); ++i) body.drag(i, Vector3<S>(mesh.points.col(i)));
  for (int k = 0; k < 100; ++k) {
    CAPTURE(k);
    Vector3<S> way = palpate_test::random_in_box<S>(random, 1);
    if (way.norm() < S(0.1)) way = Vector3<S>::UnitZ();
    way.normalize();
    Touch<S> touch;
    touch.update(body, Vector3<S>(S(0.07) * way));
    Vector3<S> const tip = S(random.uniform(0.03, 0.04)) * way;
    touch.update(body, tip);
    for (int again = 0; again < 3; ++again) {   // the line turns with the normal of the touched point
      Vector3<S> const n = touch.contact().normal;
      auto const& contact = touch.update(body, tip);
      REQUIRE(contact.touching);
      REQUIRE(unlike_the_hit(body, contact, tip, n) == "");
      REQUIRE(double(contact.depth) == Approx(depth_from<S>(contact, tip, 0)).margin(double(rounding<S>)));
    }
  }
}

TEMPLATE_TEST_CASE("a tip over the border of an open sheet", "[body][touch]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto body = body_of(sheet<S>());
  Touch<S> touch;
  touch.update(body, at<S>(0.0912, 0.0533, 0.002));
  REQUIRE(touch.update(body, at<S>(0.0912, 0.0533, -0.004)).touching);
  REQUIRE(touch.update(body, at<S>(0.0999, 0.0533, -0.004)).touching);

  SECTION("it comes off, and under the sheet it touches nothing") {
    CHECK_FALSE(touch.update(body, at<S>(0.1004, 0.0533, -0.004)).touching);
    CHECK_FALSE(touch.update(body, at<S>(0.0991, 0.0533, -0.004)).touching);
    CHECK_FALSE(touch.update(body, at<S>(0.0512, 0.0533, -0.001)).touching);
    CHECK_FALSE(touch.update(body, at<S>(0.0512, 0.0533, 0.001)).touching);
    CHECK(touch.update(body, at<S>(0.0512, 0.0533, -0.001)).touching);
  }
  SECTION("kept beside, it stays on the edge it left over, as near as it can, and comes back onto the sheet") {
    for (double const x : {0.1004, 0.101, 0.13, 0.102}) {
      double const y = 0.0533 + (x - 0.1);
      auto const& contact = touch.update(body, at<S>(x, y, -0.004), true);
      CHECK(contact.touching);
      CHECK(contact.off_surface);
      CHECK((contact.point - at<S>(0.1, std::min(y, 0.055), 0)).norm() < 20 * rounding<S>);
      CHECK(contact.depth == Approx(0.004));
    }
    auto const& contact = touch.update(body, at<S>(0.0973, 0.0533, -0.005), true);
    CHECK(contact.touching);
    CHECK_FALSE(contact.off_surface);
    CHECK(unlike_the_hit(body, contact, at<S>(0.0973, 0.0533, -0.005), Vector3<S>(Vector3<S>::UnitZ())) == "");
  }
  SECTION("beyond a corner the corner is nearest") {
    touch.update(body, at<S>(0.0991, 0.0993, -0.004), true);
    auto const& contact = touch.update(body, at<S>(0.104, 0.107, -0.004), true);
    CHECK(contact.off_surface);
    CHECK((contact.point - at<S>(0.1, 0.1, 0)).norm() < 20 * rounding<S>);
  }
  SECTION("down beside the sheet and sideways under it: no contact") {
    touch.reset();
    for (double const z : {0.010, 0.001, -0.001, -0.006}) CHECK_FALSE(touch.update(body, at<S>(0.104, 0.0533, z)).touching);
    for (double const x : {0.1001, 0.0999, 0.095, 0.05}) CHECK_FALSE(touch.update(body, at<S>(x, 0.0533, -0.006)).touching);
  }
  SECTION("from beside, above, onto the sheet: contact") {
    touch.reset();
    CHECK_FALSE(touch.update(body, at<S>(0.104, 0.0533, 0.0005)).touching);
    CHECK_FALSE(touch.update(body, at<S>(0.0992, 0.0533, 0.0005)).touching);
    CHECK(touch.update(body, at<S>(0.0983, 0.0533, -0.0005)).touching);
  }
}

TEMPLATE_TEST_CASE("a tip that went into a thin plate from the top does not come out at the bottom", "[body][touch]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  S const thickness = S(0.001);
  auto body = body_of(slab<S>(thickness));
  auto const on_top = [&](SurfaceContact<S> const& contact) {
    return contact.touching && contact.normal.z() > S(0.999) && contact.home_point.z() > -rounding<S>;
  };

  SECTION("slowly, through the undisturbed plate and far beyond it") {
    Touch<S> touch;
    touch.update(body, at<S>(0.0312, 0.0533, 0.001));
    for (double z = -0.0001; z > -0.02; z -= 0.0002) {
      auto const& contact = touch.update(body, at<S>(0.0312, 0.0533, z));
      REQUIRE(on_top(contact));
      REQUIRE(contact.depth == Approx(-z).margin(double(10 * rounding<S>)));
    }
    for (double x = 0.0312; x < 0.08; x += 0.0013) {   // along below it
      auto const& contact = touch.update(body, at<S>(x, 0.0533, -0.02));
      REQUIRE(on_top(contact));
      REQUIRE(contact.point.x() == Approx(x).margin(double(10 * rounding<S>)));
    }
    CHECK_FALSE(touch.update(body, at<S>(0.078, 0.0533, 0.0001)).touching);
  }
  SECTION("with one tick of two thirds of the thickness") {
    Touch<S> touch;
    touch.update(body, at<S>(0.0312, 0.0533, 0.0001));
    auto const& contact = touch.update(body, at<S>(0.0312, 0.0533, -0.00066));
    REQUIRE(on_top(contact));
    CHECK(contact.depth == Approx(0.00066));
    CHECK(on_top(touch.update(body, at<S>(0.0312, 0.0533, -0.005))));
  }
  SECTION("with one tick through it and out again") {
    Touch<S> touch;
    touch.update(body, at<S>(0.0312, 0.0533, 0.0002));
    auto const& contact = touch.update(body, at<S>(0.0317, 0.0541, -0.0013));
    REQUIRE(on_top(contact));
    CHECK(contact.depth == Approx(0.0013));
    CHECK(unlike_the_hit(body, contact, at<S>(0.0317, 0.0541, -0.0013), Vector3<S>(Vector3<S>::UnitZ())) == "");
  }
  SECTION("around the rim in the air it touches nothing") {
    Touch<S> touch;
    for (double turn = 0; turn < 3.1; turn += 0.1)
      CHECK_FALSE(touch.update(body, at<S>(0.1 + 0.01 * std::sin(turn), 0.0533, 0.01 * std::cos(turn) - 0.0005)).touching);
    CHECK_FALSE(touch.update(body, at<S>(0.05, 0.0533, -0.003)).touching);
    CHECK(touch.update(body, at<S>(0.05, 0.0533, -0.0008)).touching);
    CHECK(touch.contact().normal.z() < S(-0.999));
  }
  SECTION("while the plate follows") {
    Touch<S> touch;
    ContactCoupling const coupling;
    S const h = std::min(S(5e-4), S(0.9) * body.stable_step());
    double z = 0.0005;
    for (; z > -0.006; z -= 2e-5) {
      Vector3<S> const tip = at<S>(0.0512, 0.0533, z);
      auto const& contact = touch.update(body, tip);
      if (z < -1e-6) {
        REQUIRE(on_top(contact));
        REQUIRE(contact.depth == Approx(-z).margin(double(10 * rounding<S>)));
      }
      coupling.apply(body, contact, tip, at<S>(0, 0, -2e-5 / double(h)), S(0), h);
      REQUIRE(body.step(h));
    }
    for (; z < 0.004; z += 2e-5) {
      Vector3<S> const tip = at<S>(0.0512, 0.0533, z);
      auto const& contact = touch.update(body, tip);
      if (contact.touching) REQUIRE(on_top(contact));
      coupling.apply(body, contact, tip, at<S>(0, 0, 2e-5 / double(h)), S(0), h);
      REQUIRE(body.step(h));
    }
    CHECK_FALSE(touch.contact().touching);
  }
  SECTION("from below it is the lower side that is touched") {
    Touch<S> touch;
    touch.update(body, at<S>(0.0312, 0.0533, -0.002));
    for (double z = -0.0009; z < 0.01; z += 0.0003) {
      auto const& contact = touch.update(body, at<S>(0.0312, 0.0533, z));
      REQUIRE(contact.touching);
      REQUIRE(contact.normal.z() < S(-0.999));
      REQUIRE(contact.depth == Approx(z + 0.001).margin(double(10 * rounding<S>)));
    }
  }
}

// The yardstick is the undisturbed plate and sheet: which side and which place the tip came to is known before they are folded.
TEMPLATE_TEST_CASE("tissue turned over under the tip does not hand the contact to another part", "[body][touch]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  SECTION("a plate turned over: the underside now lies on top and looks up") {
    auto body = body_of(slab<S>(S(0.002)));
    Touch<S> touch;
    touch.update(body, at<S>(0.0512, 0.0533, 0.001));
    REQUIRE(touch.update(body, at<S>(0.0512, 0.0533, -0.0005)).touching);
    for (int i = 0; i < body.size(); ++i) {
      Vector3<S> const home = body.reference_position(i);
      body.drag(i, Vector3<S>(S(0.1024) - home.x(), home.y(), S(-0.002) - home.z()));
    }
    for (int tick = 0; tick < 20; ++tick) {
      auto const& contact = touch.update(body, at<S>(0.0512, 0.0533, -0.0005));
      REQUIRE(contact.touching);
      REQUIRE(contact.normal.z() > S(0.999));
      REQUIRE(contact.home_point.z() > -rounding<S>);
      REQUIRE(contact.depth == Approx(0.0005).margin(double(10 * rounding<S>)));
    }
    for (int i = 0; i < body.size(); ++i) body.drag(i, body.reference_position(i));
    CHECK_FALSE(touch.update(body, at<S>(0.0512, 0.0533, 0.0001)).touching);
  }
  SECTION("a sheet whose far end is folded over the touched place, which looks down") {
    auto body = body_of(sheet<S>());
    Touch<S> touch;
    touch.update(body, at<S>(0.0212, 0.0533, 0.001));
    REQUIRE(touch.update(body, at<S>(0.0212, 0.0533, -0.001)).touching);
    for (int i = 0; i < body.size(); ++i) {
      Vector3<S> x = body.reference_position(i);
      if (x.x() < S(0.046))
        x = at<S>(0.0424 - double(x.x()), double(x.y()), -0.002);   // turned about the tip's line
      else
        x.x() -= S(0.05);                                           // moved, the right way up
      body.drag(i, x);
    }
    auto const& contact = touch.update(body, at<S>(0.0212, 0.0533, -0.001));
    if (contact.touching) CHECK(contact.home_point.x() < S(0.046));
  }
}

TEMPLATE_TEST_CASE("in a gap between two walls the tip touches the one it goes into", "[body][touch]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const lower = sheet<S>();
  Eigen::Index const points = lower.points.cols(), triangles = lower.triangles.cols();
  TriangleMesh<S> both{Matrix3X<S>(3, 2 * points), Matrix<int, 3, Dynamic>(3, 2 * triangles)};
  both.points << lower.points, lower.points.colwise() + at<S>(0, 0, 0.004);
  both.triangles.leftCols(triangles) = lower.triangles;
  for (Eigen::Index t = 0; t < triangles; ++t)   // looks down
    both.triangles.col(triangles + t) = Matrix<int, 3, 1>(lower.triangles(0, t), lower.triangles(2, t), lower.triangles(1, t)).array() +
                                        static_cast<int>(points);
  auto body = body_of(both);
  for (double const z : {-0.001, -0.01, 0.0041, 0.009}) {
    Touch<S> touch;
    CHECK_FALSE(touch.update(body, at<S>(0.0512, 0.0533, 0.001)).touching);
    auto const& contact = touch.update(body, at<S>(0.0523, 0.0541, z));
    REQUIRE(contact.touching);
    CHECK(contact.normal.z() == Approx(z < 0 ? 1.0 : -1.0));
    CHECK(contact.depth == Approx(z < 0 ? -z : z - 0.004).margin(double(20 * rounding<S>)));
  }
}

// The second state machine: the sheet stays a height field, so outside is above it, and in contact the touched point is straight above
// or below the tip.
TEMPLATE_TEST_CASE("random walks over a sheet that moves do what the rules say", "[body][touch]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  for (double const radius : {0.0, 0.002})
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
      CAPTURE(seed, radius);
      Random random(Seed{seed});
      auto body = body_of(sheet<S>());
      Touch<S> touch{S(radius)};
      Vector3<double> tip(0.05, 0.05, seed % 2 == 0 ? 0.02 : -0.02);
      bool touching = false, was_outside = false;
      int begun = 0, in_contact = 0;
      for (int tick = 0; tick < 400; ++tick) {
        CAPTURE(tick);
        wave(body, 0.003, 0.02 * tick);
        double const jump = tick % 50 == 49 ? 0.02 : 0.002;
        for (int k = 0; k < 3; ++k) tip[k] += jump * random.uniform(-1.0, 1.0);
        tip.z() -= 0.05 * (tip.z() - radius);   // drawn back to the surface
        tip = tip.cwiseMax(Vector3<double>(0.02, 0.02, -0.015)).cwiseMin(Vector3<double>(0.08, 0.08, 0.015));
        Vector3<S> const p = tip.cast<S>();
        auto const mesh = body.mesh();
        auto const over = hits_along<S>(mesh, p, Vector3<S>::UnitZ(), 0);
        REQUIRE_FALSE(over.empty());
        double const height = -double(over.front().height);   // of the tip over the sheet
        bool const began = !touching;
        if (touching) {
          touching = !(double(p.z()) - radius >= 0 && height > radius);
          was_outside = was_outside || !touching;
        } else {
          double const distance = double(palpate_test::surface_distance(mesh, p));
          bool const outside = (height > 0 ? distance : -distance) > radius;
          touching = !outside && was_outside;
          was_outside = outside || was_outside;
          if (touching) ++begun, was_outside = false;
        }
        auto const& contact = touch.update(body, p);
        REQUIRE(contact.touching == touching);
        if (!touching) continue;
        ++in_contact;
        REQUIRE(double(contact.depth) == Approx(radius - double(p.z())).margin(double(10 * rounding<S>)));
        if (began && contact.depth <= 0) {
          REQUIRE(double((contact.point - p).norm()) ==
                  Approx(double(palpate_test::surface_distance(mesh, p))).margin(double(20 * rounding<S>)));
        } else {
          REQUIRE(unlike_the_hit(body, contact, p, Vector3<S>(Vector3<S>::UnitZ())) == "");
        }
      }
      CHECK(begun > 3);
      CHECK(in_contact > 50);
    }
}

TEMPLATE_TEST_CASE("random walks around and in a ball that moves do what the rules say", "[body][touch]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    CAPTURE(seed);
    Random random(Seed{seed});
    auto body = body_of(make_sphere<S>(S(0.05), 6));
    auto const rest = body.rest_mesh();
    Touch<S> touch;
    Vector3<double> tip(0, 0, seed % 2 == 0 ? 0.06 : 0.045);
    bool was_outside = false;
    int begun = 0, in_contact = 0;
    for (int tick = 0; tick < 300; ++tick) {
      CAPTURE(tick);
      for (int i = 0; i < body.size(); ++i) {   // star-shaped at all times: outside is farther from the centre
        Vector3<S> const x = rest.points.col(i);
        body.drag(i, Vector3<S>(x * (1 + S(0.03) * std::sin(S(0.05) * S(tick) + 40 * x.x() - 50 * x.z()))));
      }
      for (int k = 0; k < 3; ++k) tip[k] += 0.002 * random.uniform(-1.0, 1.0);
      tip *= std::clamp(tip.norm(), 0.042, 0.056) / tip.norm();
      Vector3<S> const p = tip.cast<S>();
      auto const mesh = body.mesh();
      auto const out = hits_along<S>(mesh, p, Vector3<S>(p.normalized()), 0);
      bool inside = false;
      for (Hit const& hit : out) inside = inside || hit.height > 0;
      SurfaceContact<S> const before = touch.contact();
      auto const& contact = touch.update(body, p);
      if (!before.touching) {
        REQUIRE(contact.touching == (inside && was_outside));
        was_outside = was_outside || !inside;
        if (contact.touching) ++begun;
      } else {
        if (!contact.touching) was_outside = true;
      }
      if (!contact.touching) {
        continue;
      }
      ++in_contact;
      if (before.touching) REQUIRE(unlike_the_hit(body, contact, p, before.normal) == "");
      REQUIRE((contact.point - p).norm() < S(0.012));   // never on another part of the ball
      REQUIRE(double(contact.depth) == Approx(depth_from<S>(contact, p, 0)).margin(double(rounding<S>)));
      REQUIRE((inside || contact.depth > 0));
    }
    CHECK(begun > 1);
    CHECK(in_contact > 50);
  }
}
