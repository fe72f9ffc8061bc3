// SPDX-License-Identifier: MIT
// Yardsticks: the angle, by hand; the same stroke by a point tool; the balance of forces at rest: springs between particles add up to nothing,
// so the hand holds what all home springs pull.
#include "drawn_strokes.hpp"

#include "catch.hpp"

#include <palpate/cutting/separating_cutter.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/simulator/body_loop.hpp>

#include <cmath>
#include <limits>
#include <numbers>

using namespace palpate;

namespace {

using Sheet = SoftBody<MassSpring<double>, LeapfrogVerlet, WholeBody>;
constexpr double degree = std::numbers::pi / 180;

Sheet sheet() { return Sheet(make_tissue(make_grid<double>(9, 9, 0.01))); }
Vector3<double> at(double x, double y, double depth = 0.003) { return {x, y, -depth}; }

/// Punctures at (x, y).
template <class Cutter>
void puncture(Sheet& body, Cutter& cutter, double x, double y) {
  for (double const depth : {-0.004, 0.0, 0.003}) cutter.advance(body, at(x, y, depth));
  REQUIRE(cutter.state() == CuttingPhase::moving);
}

}  // namespace

TEST_CASE("an edge cuts ways within its angle, to and fro, and no others", "[cutting]") {
  BladeEdge<double> const edge{.axis = {0, 2, 5}, .angle = 25 * degree};   // its part along a sheet is y
  Vector3<double> const up(0, 0, 1);
  auto const way = [](double angle, double rise) { return Vector3<double>(std::sin(angle * degree), std::cos(angle * degree), rise); };
  for (double const rise : {0.0, -3.0, 1.0})
    for (double const side : {1.0, -1.0}) {
      for (double const angle : {0.0, 10.0, 24.9, 155.1, 180.0}) CHECK(edge.cuts(way(side * angle, rise), up));
      for (double const angle : {25.1, 60.0, 90.0, 154.9}) CHECK_FALSE(edge.cuts(way(side * angle, rise), up));
    }
  CHECK_FALSE(BladeEdge<double>{.axis = up}.cuts(way(0, 0), up));   // on end
  CHECK_THROWS_WITH(ProgressiveCutter<double>({.edge = BladeEdge<double>{.angle = 2.0}}), says("2 rad", "between 0 and pi/2"));
  CHECK_THROWS_AS(ProgressiveCutter<double>({.edge = BladeEdge<double>{.axis = {0, 0, 0}}}), InvalidArgument);
  CHECK_THROWS_AS(SeparatingCutter<double>({.edge = BladeEdge<double>{.slip_force = -1.0}}), InvalidArgument);
  ProgressiveCutter<double> cutter;
  CHECK_THROWS_AS(cutter.turn_edge({0, std::numeric_limits<double>::quiet_NaN(), 1}), InvalidArgument);
}

TEMPLATE_TEST_CASE("a blade with an edge cuts along it like a point, and nothing across it", "[cutting]", ProgressiveCutter<double>, SeparatingCutter<double>) {
  auto body = sheet(), twin = sheet();
  BladeEdge<double> const edge{.axis = {1, 0, 0}, .angle = 30 * degree};
  TestType cutter({.puncture_depth = 0.002, .edge = edge}), point({.puncture_depth = 0.002});
  puncture(body, cutter, 0.0113, 0.0337);
  puncture(twin, point, 0.0113, 0.0337);
  for (int k = 1; k <= 80; ++k)
    for (auto* side : {&body, &twin}) (side == &body ? cutter : point).advance(*side, at(0.0113 + 5e-4 * k, 0.0337 + 2e-4 * k));   // 22 degrees
  REQUIRE(body.size() > 81);
  CHECK(body.triangles() == twin.triangles());
  CHECK_FALSE(cutter.held(body));

  auto const before = body.topology_revision();
  for (int k = 1; k <= 40; ++k) {   // 2 cm across
    cutter.advance(body, at(0.0513, 0.0497 + 5e-4 * k));
    CHECK(cutter.held(body));
    CHECK(cutter.state() == CuttingPhase::moving);
  }
  CHECK(body.topology_revision() == before);
  cutter.turn_edge({0, 1, 0});   // the hand turns the blade
  cutter.advance(body, at(0.0513, 0.0702));
  CHECK_FALSE(cutter.held(body));
  CHECK(body.topology_revision() > before);
  cutter.advance(body, at(0.0513, 0.0702, -0.004));
  CHECK(cutter.state() == CuttingPhase::no_contact);
  CHECK_FALSE(cutter.held(body));
}

// By hand: an edge along x of a tool that is turned by a right angle about z lies along y.
TEMPLATE_TEST_CASE("the edge turns with the tool", "[cutting]", ProgressiveCutter<double>, SeparatingCutter<double>) {
  Eigen::Quaternion<double> const right_angle(Eigen::AngleAxis<double>(90 * degree, Vector3<double>::UnitZ()));
  auto body = sheet(), twin = sheet();
  TestType turned({.puncture_depth = 0.002, .edge = BladeEdge<double>{.axis = {1, 0, 0}, .angle = 30 * degree}});
  TestType along_y({.puncture_depth = 0.002, .edge = BladeEdge<double>{.axis = {0, 1, 0}, .angle = 30 * degree}});
  auto const go = [&](Vector3<double> const& tip) {
    turned.advance(body, {.position = tip, .orientation = right_angle});
    along_y.advance(twin, tip + Vector3<double>::Zero());   // an expression is a tip too
    REQUIRE(turned.held(body).has_value() == along_y.held(twin).has_value());
  };
  for (double const depth : {-0.004, 0.0, 0.003}) go(at(0.0213, 0.0237, depth));
  for (int k = 1; k <= 80; ++k) go(at(0.0213, 0.0237 + 5e-4 * k));
  CHECK(turned.report().particles_added == along_y.report().particles_added);
  CHECK(turned.report().particles_added > 0);
  for (int k = 1; k <= 20; ++k) go(at(0.0213 + 5e-4 * k, 0.0637));
  CHECK(turned.held(body));
  CHECK(body.triangles() == twin.triangles());
  CHECK(body.positions() == twin.positions());
  Eigen::Quaternion<double> const none(0.0, 0.0, 0.0, 0.0);
  CHECK_THROWS_WITH(turned.advance(body, {.position = at(0.0213, 0.0637), .orientation = none}), Catch::Contains("length 0") && Catch::Contains("unit quaternion"));
}

TEST_CASE("a blade that is held across its edge drags the tissue, which pulls at the hand, up to the slip force", "[cutting]") {
  double const slip = GENERATE(0.02, 100.0);   // N
  BladeEdge<double> const edge{.axis = {1, 0, 0}, .slip_force = slip};
  BodyLoop loop(sheet(), ProgressiveCutter<double>({.puncture_depth = 0.002, .edge = edge}), ContactCoupling{}, 100);
  for (double const depth : {-0.004, 0.0, 0.003}) loop.tick({.position = at(0.0313, 0.0337, depth)}, 1e-3);
  for (int k = 1; k <= 20; ++k) loop.tick({.position = at(0.0313 + 2e-4 * k, 0.0337), .velocity = Vector3<double>(0.2, 0, 0)}, 1e-3);
  int const size = loop.body().size();
  LocalModel<double> model;
  for (int k = 1; k <= 40; ++k) model = loop.tick({.position = at(0.0353, 0.0337 + 2e-4 * k), .velocity = Vector3<double>(0, 0.2, 0)}, 1e-3);
  for (int k = 0; k < 3000; ++k) model = loop.tick({.position = at(0.0353, 0.0417)}, 1e-3);
  auto const held = loop.cutter().held(loop.body());
  REQUIRE(held);
  CHECK(loop.body().size() == size);
  Vector3<double> homes = Vector3<double>::Zero();
  for (int i = 0; i < loop.body().size(); ++i)
    homes += loop.body().tissue().home(i).stiffness * (loop.body().tissue().rest_position(i) - loop.body().positions().col(i));
  CHECK((model.tissue_force - homes).norm() < 1e-6);
  CHECK(model.tissue_force[1] < -0.01);
  CHECK(model.tissue_force.norm() <= slip * (1 + 1e-9));
  double followed = 0.0;
  auto const corners = loop.body().tissue().surface().corners(held->triangle);
  for (std::size_t k = 0; k < 3; ++k) followed += held->barycentric[static_cast<int>(k)] * loop.body().displacement(corners[k])[1];
  if (slip < 1)
    CHECK(model.tissue_force.norm() == Approx(slip));
  else
    CHECK(followed == Approx(0.008).epsilon(0.05));   // the spring of the contact gives a little
}
