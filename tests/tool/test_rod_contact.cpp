// SPDX-License-Identifier: MIT
// Yardsticks: the distance of rod and triangle as the least of a convex function, in long double; what the body is told, summed up; the tissue's own forces
// at rest.
#include "allocation_trap.hpp"
#include "catch.hpp"
#include "collision/brute_force.hpp"
#include "tool/tool_bodies.hpp"

#include <palpate/integrator/symplectic_euler.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/tool/built_in_shapes.hpp>
#include <palpate/tool/rod_contact.hpp>
#include <palpate/volume/organ_volume.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

using namespace palpate;
using namespace palpate_test;

namespace {

/// A body that keeps what it is told to feel.
template <class Soft>
struct Witness : Soft {
  explicit Witness(Soft body) : Soft(std::move(body)) {}
  void apply_force(int i, Vector3<typename Soft::Scalar> const& force) {
    told.emplace_back(i, force);
    Soft::apply_force(i, force);
  }
  std::vector<std::pair<int, Vector3<typename Soft::Scalar>>> told = {};
};

/// Distance of a segment and a triangle: that of a point of the segment is convex in its place, so thirds find the least.
long double distance(Long3 const& from, Long3 const& to, std::array<Long3, 3> const& corner) {
  auto const at = [&](long double s) { return triangle_distance(from + s * (to - from), corner[0], corner[1], corner[2]); };
  long double low = 0, high = 1;
  for (int k = 0; k < 80; ++k) {
    long double const a = low + (high - low) / 3, b = high - (high - low) / 3;
    (at(a) <= at(b) ? high : low) = at(a) <= at(b) ? b : a;
  }
  return std::min({at((low + high) / 2), at(0), at(1)});
}

template <class Body>
std::array<Long3, 3> corners_of(Body const& body, int t) {
  auto const c = body.tissue().surface().corners(t);
  return {Vector3<double>(body.positions().col(c[0])).template cast<long double>(), Vector3<double>(body.positions().col(c[1])).template cast<long double>(),
          Vector3<double>(body.positions().col(c[2])).template cast<long double>()};
}

/// The least distance of a tool's axes from the body; negative where one goes through.
template <class Body>
double clearance(Body const& body, RodContact<double> const& tool) {
  double least = 1;
  for (auto const& each : tool.shape().rods)
    for (int t = 0; t < body.tissue().surface().triangle_count(); ++t) {
      auto const c = body.tissue().surface().corners(t);
      auto const near = closest_points<double>(tool.placed(tool.pose(), each.rod.from), tool.placed(tool.pose(), each.rod.to), body.positions().col(c[0]),
                                               body.positions().col(c[1]), body.positions().col(c[2]));
      least = std::min(least, near.crosses ? -1 : std::sqrt(near.squared_distance) - each.rod.radius);
    }
  return least;
}

ToolPose<double> random_pose(Random& random, Vector3<double> const& low, Vector3<double> const& high) {
  ToolPose<double> pose;
  for (int k = 0; k < 3; ++k) pose.position[k] = random.uniform(low[k], high[k]);
  pose.orientation =
      Eigen::Quaternion<double>(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)).normalized();
  pose.opening = random.uniform(0.0, 1.0);
  return pose;
}

ToolPose<double> lying(Vector3<double> const& at) {
  return {.position = at, .orientation = Eigen::Quaternion<double>(Eigen::AngleAxis<double>(std::numbers::pi / 2, Vector3<double>::UnitY()))};
}

auto ball() {
  auto const mesh = make_sphere<double>(0.03, 2);
  MassSpring<double> tissue(mesh, {.mass = {.total = 0.05}, .link = {.stiffness = 60, .damping = 0.02}, .home = {.stiffness = 6, .damping = 0.05}});
  return SoftBody(std::move(tissue), LeapfrogVerlet{});
}

auto organ() {
  auto const mesh = make_organ_volume<double>({}, {.edge = 0.03});
  FiniteElements<double, StableNeoHookean<double>> tissue(mesh, {.density = 1060.0, .material = {.young = 5e3, .poisson = 0.4}});
  return SoftBody(std::move(tissue), BackwardEuler{});
}

/// Poses for which the triangles at the rods are compared with all triangles, and then motions through the body.
template <class Body>
void check_at_random(Body const& start, std::vector<ToolShape<double>> const& shapes, int poses, double h) {
  Random random(Seed{31});
  Witness<Body> body(start);
  auto const [low, high] = low_and_high(body.positions());
  Vector3<double> const margin = Vector3<double>::Constant(0.01);
  int found = 0;
  for (auto const& shape : shapes) {
    RodContact<double> tool(shape);
    for (int k = 0; k < poses; ++k) {
      tool.reset();
      auto const pose = random_pose(random, low - margin, high + margin);
      tool.advance(body, pose);
      std::size_t next = 0;
      auto const touches = tool.touches();
      for (std::size_t r = 0; r < shape.rods.size(); ++r) {
        auto const rod = shape.rods[r].at(pose.opening);
        auto const use = shape.rods[r].use;
        Vector3<double> const from = tool.placed(pose, rod.from), to = tool.placed(pose, rod.to);
        for (int t = 0; t < body.tissue().surface().triangle_count(); ++t) {
          auto const corner = corners_of(body, t);
          Vector3<double> const middle = ((corner[0] + corner[1] + corner[2]) / 3).template cast<double>();
          double const around = static_cast<double>(std::max({(corner[0] - corner[1]).norm(), (corner[1] - corner[2]).norm(), (corner[2] - corner[0]).norm()}));
          bool near = use == RodUse::deforming && std::sqrt(closest_point_on_segment<double>(middle, from, to).squared_distance) < 1.02 * rod.radius + around;
          long double const d = near ? distance(from.cast<long double>(), to.cast<long double>(), corner) : 1.0L;
          near = d < 1.01L * rod.radius;
          bool const listed = next < touches.size() && touches[next].rod == static_cast<int>(r) && touches[next].triangle == t;
          if (listed) {
            REQUIRE(std::abs(static_cast<double>(d) - touches[next].distance) < 1e-12);
            ++next, ++found;
          }
          if (std::abs(d - 1.01L * rod.radius) > 1e-12L) REQUIRE(listed == near);
        }
      }
      REQUIRE(next == touches.size());
    }
    // Motions: from one random place to the next, through the tissue or past it.
    tool.reset();
    Vector3<double> at = high + margin;
    for (int stroke = 0; stroke < poses / 50; ++stroke) {
      auto const to = random_pose(random, low - margin, high + margin);
      for (int k = 1; k <= 10; ++k) {
        auto pose = to;
        pose.position = at + (to.position - at) * k / 10;
        tool.advance(body, pose);
        body.told.clear();
        Matrix3X<double> const x = body.positions();
        Vector3<double> const force = tool.press(body, 1.0, h);
        Vector3<double> sum = force, moment = tool.moment();
        double size = force.norm(), arm = tool.moment().norm();
        for (auto const& [i, f] : body.told)
          sum += f, moment += (x.col(i) - pose.position).cross(f), size += f.norm(), arm += (x.col(i) - pose.position).norm() * f.norm();
        REQUIRE(sum.norm() <= 1e-12 * size);
        REQUIRE(moment.norm() <= 1e-12 * arm);
        for (auto const& touch : tool.touches()) REQUIRE(touch.rubbed <= 0.3 * touch.pressed * (1 + 1e-10) + 1e-15);
        body.step(h);   // which reports where it diverges
        REQUIRE(is_finite(body.positions()));
      }
      at = to.position;
    }
    body.reset();
  }
  CHECK(found > poses);
}

std::vector<ToolShape<double>> shapes() {
  return {make_probe_shape<double>({.radius = 0.003, .length = 0.05}), make_hook_shape<double>({.point = 0.01, .shaft = 0.04}),
          make_forceps_shape<double>({.shaft = 0.03}), make_scalpel_shape<double>({.length = 0.05})};
}

}  // namespace

TEST_CASE("The triangles at rods of random poses are those that brute force finds, and motions keep forces finite and balanced", "[tool][rod_contact]") {
  SECTION("a ball of springs") { check_at_random(ball(), shapes(), 250, 1e-3); }
  SECTION("an organ of finite elements") { check_at_random(organ(), shapes(), 250, 1e-3); }
  SECTION("a block of finite elements") { check_at_random(block<double>(), shapes(), 250, 1e-3); }
  SECTION("a sheet of springs") { check_at_random(skin<double>(), shapes(), 250, 5e-4); }
}

TEST_CASE("After an explicit step nothing is inside a rod that presses, and nothing is pushed away from it", "[tool][rod_contact]") {
  auto const press = [](auto body, double top, bool lies, double h) {
    RodContact<double> tool(make_probe_shape<double>({.radius = 0.002, .length = 0.02}));
    double deepest = 0, farthest = 0;
    int touched = 0;
    for (int k = 0; k < 500; ++k) {
      Vector3<double> const at(lies ? 0.0211 : 0.0313, 0.0237, top + 0.0025 - 0.05 * h * k);
      tool.advance(body, lies ? lying(at) : ToolPose<double>{.position = at});
      tool.press(body, 1.0, h);
      body.step(h);
      if (at.z() > top + 0.002) continue;
      double const clear = clearance(body, tool);
      deepest = std::min(deepest, clear), farthest = std::max(farthest, clear);
      ++touched;
    }
    CAPTURE(deepest, farthest, lies, tool.force().transpose());
    CHECK(touched > 200);
    CHECK(tool.force().z() > 0.05);
    // The linear constraint leaves what rotation makes in one step: of second order in the step's way.
    CHECK(deepest > -1e-6);
    CHECK(farthest < 1e-5);
  };
  double const h = 2e-4;
  press(block<double, SymplecticEuler>(), 0.018, false, h);
  press(block<double, LeapfrogVerlet>(), 0.018, false, h);
  press(block<double, SymplecticEuler>(), 0.018, true, h);
  press(skin<double>(), 0.0, false, h);
  press(skin<double>(), 0.0, true, h);
}

TEST_CASE("At rest the force on the tool is that of the springs it has stretched, whatever the step", "[tool][rod_contact]") {
  auto const mesh = make_grid<double>(9, 9, 0.005);
  double first = 0;
  for (double const h : {5e-4, 1e-3, 2e-3}) {
    MassSpring<double> tissue(mesh, {.mass = {.total = 0.05}, .link = {.stiffness = 30, .damping = 0.1}, .home = {.stiffness = 20, .damping = 0.5}});
    SoftBody body(std::move(tissue), BackwardEuler{});
    RodContact<double> tool(make_probe_shape<double>({.radius = 0.003, .length = 0.02}), {.friction = 0});
    for (double t = 0; t < 1.5; t += h) {
      tool.advance(body, lying({0.0113, 0.0207, 0.003 - std::min(0.002, 0.01 * t)}));
      tool.press(body, 1.0, h);
      body.step(h);
    }
    double springs = 0;   // links pull between particles, homes on the whole: without nails the tool carries their sum
    for (int i = 0; i < body.size(); ++i) springs += 20 * (mesh.points(2, i) - body.positions()(2, i));
    CAPTURE(h, springs, tool.force().transpose());
    CHECK(tool.force().z() == Approx(springs).epsilon(2e-4));
    if (first == 0) first = tool.force().z();
    CHECK(tool.force().z() == Approx(first).epsilon(1e-3));
  }
}

TEST_CASE("Nailed tissue pushes as its spring says, at any depth and step", "[tool][rod_contact]") {
  TriangleMesh<double> mesh;
  mesh.points.resize(3, 3), mesh.triangles.resize(3, 1);
  mesh.points << -0.05, 0.05, 0, -0.03, -0.03, 0.06, 0, 0, 0;
  mesh.triangles << 0, 1, 2;
  for (double const h : {5e-4, 1e-3, 2e-3})
    for (double const depth : {1e-4, 1e-3, 3e-3}) {
      MassSpring<double> tissue(mesh, {.mass = {.total = 0.01}, .link = {.stiffness = 10}});
      tissue.nail({0, 1, 2});
      SoftBody body(std::move(tissue), LeapfrogVerlet{});
      RodContact<double> tool(make_probe_shape<double>({.radius = 0.004}), {.stiffness = 2000});
      Vector3<double> force = Vector3<double>::Zero();
      for (int k = 0; k < 100; ++k) {
        tool.advance(body, {.position = {0, 0, 0.005 - (0.001 + depth) * std::min(1.0, k / 50.0)}});
        force = tool.press(body, 1.0, h);
        body.step(h);
      }
      CAPTURE(h, depth);
      CHECK((force - Vector3<double>(0, 0, 2000 * depth)).norm() < 1e-9);
    }
}

TEST_CASE("A thin rod that jumps through a sheet in one tick still pushes it; one that is placed behind it does not", "[tool][rod_contact]") {
  auto body = skin<double>();
  RodContact<double> tool(make_probe_shape<double>({.radius = 0.001, .length = 0.004}));
  Vector3<double> const above(0.0313, 0.0287, 0.008), below(0.0313, 0.0287, -0.008);
  tool.advance(body, {.position = below});
  CHECK(tool.press(body, 1.0, 5e-4).norm() == 0);
  tool.advance(body, {.position = below + Vector3<double>(0, 0, 0.005)});   // from behind, through
  CHECK(tool.touches().size() > 0);
  CHECK(tool.press(body, 1.0, 5e-4).norm() == 0);
  tool.reset();
  tool.advance(body, {.position = above});
  tool.advance(body, {.position = below});
  int acting = 0;
  for (auto const& touch : tool.touches()) acting += touch.acts ? 1 : 0;
  CHECK(acting > 0);
  CHECK(tool.press(body, 1.0, 5e-4).z() > 0);
}

TEST_CASE("A tool in contact that is said to be farther away than squares can tell does not touch, and touches again afterwards", "[tool][rod_contact]") {
  for (double const far : {1e155, 1e200, 1e300})
    for (Vector3<double> const& there : {Vector3<double>(-far, 0.01 * far, far), Vector3<double>(0.03, 0.02, far), Vector3<double>(-far, far, -far)}) {
      auto body = block<double>();
      RodContact<double> tool(make_probe_shape<double>());
      auto const at = [&](Vector3<double> const& place) {
        tool.advance(body, ToolPose<double>{.position = place});
        for (double const share : {0.5, 1.0}) {
          CHECK(tool.press(body, share, 5e-4).allFinite());
          body.step(5e-4);
        }
      };
      auto const press = [&] {
        for (int tick = 0; tick < 40; ++tick) at({0.03, 0.02, 0.024 - 2e-4 * tick});
      };
      press();
      REQUIRE(tool.touches().size() > 0);
      at(there);
      tool.reset();
      press();
      CHECK(tool.touches().size() > 0);
      CHECK(body.positions().allFinite());
    }
}

TEST_CASE("A tool's tick allocates nothing once it has touched", "[tool][rod_contact]") {
  auto body = block<double>();
  RodContact<double> tool(make_hook_shape<double>());
  auto const go = [&](int from, int to) {
    for (int k = from; k < to; ++k) {
      double const t = 0.02 * k;
      tool.advance(body, lying({0.03 + 0.005 * std::sin(t), 0.02 + 0.005 * std::cos(t), 0.018}));
      tool.press(body, 0.5, 5e-4), body.step(5e-4);
      tool.press(body, 1.0, 5e-4), body.step(5e-4);
    }
  };
  go(0, 320);
  AllocationCount const allocations;
  go(320, 640);
  long const made = allocations.count();
  CHECK(made == 0);
  CHECK(tool.touches().size() > 5);
}

TEST_CASE("Contact options are checked", "[tool][rod_contact]") {
  auto const with = [](ContactOptions<double> const& options) { RodContact<double> const tool(make_probe_shape<double>(), options); };
  CHECK_THROWS_WITH(with({.friction = -0.1}), says(".friction is -0.1"));
  CHECK_THROWS_WITH(with({.stiffness = 0}), says(".stiffness is 0 N/m"));
  CHECK_THROWS_WITH(with({.damping = -1}), says(".damping is -1 N s/m"));
  CHECK_THROWS_WITH(with({.recovery = 0}), says(".recovery is 0 m/s"));
  CHECK_THROWS_WITH(RodContact<double>(ToolShape<double>{}), says("there is no rod"));
}
