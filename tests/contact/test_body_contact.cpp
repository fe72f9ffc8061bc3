// SPDX-License-Identifier: MIT
// Two bodies on one another. Yardsticks: −k ∂V/∂x from the volume of convex bodies cut by planes here; weight over pressure; a plate on a bed of springs; the angle of friction; a block that slides,
// by hand; momentum and energy. PALPATE_CONTACT_STARTS sets how many random starts (30 if not set), PALPATE_COLLISIONS how many random
// collisions (12).
#include "allocation_trap.hpp"
#include "catch.hpp"
#include "contact/blocks.hpp"
#include "device/message.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/contact/body_contact.hpp>
#include <palpate/contact/obstacle.hpp>
#include <palpate/core/random.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/symplectic_euler.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/capsule.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/repair.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/testing/body.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <type_traits>
#include <utility>
#include <vector>

using namespace palpate;
using namespace palpate_test;

namespace {

/// A block that is bent to an ellipsoid.
TetrahedralMesh<double> egg(int n, Vector3<double> const& half, Vector3<double> const& at) {
  auto mesh = make_block<double>(n, n, n, 2.0 / (n - 1), BlockPattern::alternating);
  for (Eigen::Index i = 0; i < mesh.points.cols(); ++i) {
    Vector3<double> const p = mesh.points.col(i) - Vector3<double>::Ones();
    double const size = p.norm();
    mesh.points.col(i) = at + half.cwiseProduct(size > 0 ? Vector3<double>(p.cwiseAbs().maxCoeff() / size * p) : p);
  }
  return mesh;
}

}  // namespace

TEMPLATE_TEST_CASE("a block on a table rests as deep as its weight says, at any step, explicit and implicit", "[contact]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  double const weight = 1000 * 9.81 * 0.03 * 0.03 * 0.02, stiffness = 1e4 / 3e-3;   // N, Pa/m
  auto const rest_depth = [&](auto integrator, double h) {
    auto body = solid<S>(block<S>(4, 4, 3, 0.01, {0, 0, 0}), integrator);
    body.set_gravity({0, 0, S(-9.81)});
    auto ground = table<S>();
    BodyContact contact(body, ground, {.pressure = S(1e4), .depth = S(3e-3)});
    for (double t = 0; t < 1; t += h) {
      contact.apply(body, ground, S(h));
      REQUIRE(body.step(S(h)));
    }
    CAPTURE(h);
    REQUIRE(contact.regions().size() == 1);
    auto const& region = contact.regions()[0];
    CHECK(double(contact.force()[2]) == Approx(weight).epsilon(0.002));
    CHECK(double(region.normal[2]) == Approx(-1).epsilon(1e-3));
    CHECK(region.volume / double(region.area) == Approx(weight / (stiffness * double(region.area))).epsilon(std::is_same_v<S, float> ? 0.02 : 0.002));
    return region.volume / double(region.area);
  };
  double const first = rest_depth(LeapfrogVerlet{}, 5e-4);
  CHECK(first == Approx(weight / stiffness / 9e-4).epsilon(0.02));
  CHECK(rest_depth(LeapfrogVerlet{}, 2.5e-4) == Approx(first).epsilon(0.02));
  CHECK(rest_depth(SymplecticEuler{}, 5e-4) == Approx(first).epsilon(0.02));
  for (double const h : {1e-3, 2e-3, 5e-3, 1e-2}) CHECK(rest_depth(BackwardEuler{}, h) == Approx(first).epsilon(0.02));
}

TEST_CASE("an ellipsoid on a block comes to rest at the same depth with three steps and two integrators", "[contact]") {
  auto const rest = [](auto integrator, double h) {
    auto const filled = block<double>(5, 5, 3, 0.012, {-0.024, -0.024, -0.024});
    auto lower = solid<double>(filled, integrator, 1e4, 5);
    for (int const i : vertices_where(filled, [](Vector3<double> const& x) { return x[2] < -0.023; })) lower.nail(i);
    auto upper = solid<double>(egg(4, {0.015, 0.013, 0.01}, {0.0013, 0.0007, 0.0105}), integrator, 1e4, 5);
    upper.set_gravity({0, 0, -9.81});
    BodyContact contact(upper, lower, {});
    for (double t = 0; t < 0.6; t += h) {
      contact.apply(upper, lower, h);
      REQUIRE(upper.advance(h));
      REQUIRE(lower.advance(h));
    }
    REQUIRE(contact.regions().size() == 1);
    CHECK(contact.force()[2] == Approx(9.81 * upper.total_mass()).epsilon(0.01));
    return contact.regions()[0].volume / contact.regions()[0].area;
  };
  double const first = rest(LeapfrogVerlet{}, 5e-4);
  CAPTURE(first);
  for (double const h : {1e-3, 2e-3, 4e-3}) CHECK(rest(BackwardEuler{}, h) == Approx(first).epsilon(0.02));
}

TEST_CASE("deep in one another two convex bodies press with -k dV/dx, at the middle of what they share", "[contact]") {
  // The change of the volume in common by differences; what presses is on the line through the middle of the cut.
  Random random(Seed{3});
  double worst = 0, worst_balance = 0, worst_moment = 0;
  int met = 0;
  for (int round = 0; round < 10; ++round) {
    auto const any = [&] { return random.uniform(-1.0, 1.0); };
    auto a = solid<double>(egg(5, {0.02, 0.017, 0.015}, {0, 0, 0}), LeapfrogVerlet{});
    Vector3<double> const way = Vector3<double>(any(), any(), any()).normalized();
    auto b = solid<double>(egg(6, {0.015, 0.02, 0.018}, 0.02 * way), LeapfrogVerlet{});
    BodyContact contact(a, b, {.pressure = 1e4, .depth = 1e-5, .friction = 0.0});
    contact.apply(a, b, 1e-5);
    if (contact.regions().size() != 1) continue;
    ++met;
    auto const& region = contact.regions()[0];
    CHECK(region.pressure == 1e4);
    Vector3<double> force = contact.force(), slope;
    double const step = 1e-6;
    for (int k = 0; k < 3; ++k) {
      SurfaceIntersection<double> common;
      std::array<double, 2> volume{};
      for (int side = 0; side < 2; ++side) {
        auto mesh = a.mesh();
        mesh.points.row(k).array() += side == 0 ? -step : step;
        SurfaceTree<double> tree(mesh), other(b.mesh());
        common.find(MovingSurface<double>{a.tissue().surface(), tree, mesh.points}, MovingSurface<double>{b.tissue().surface(), other, b.positions()});
        volume[std::size_t(side)] = common.volume();
      }
      slope[k] = (volume[1] - volume[0]) / (2 * step);
    }
    worst = std::max(worst, (force + 1e4 * slope).norm() / force.norm());
    // What the next step of each gets.
    auto const gained = [&](auto& body) {
      Vector3<double> sum = Vector3<double>::Zero(), moment = Vector3<double>::Zero();
      for (int i = 0; i < body.size(); ++i) {
        Vector3<double> const f = body.tissue().mass(i) * Vector3<double>(body.predicted_acceleration(i, 1e-5));
        sum += f, moment += Vector3<double>(body.positions().col(i)).cross(f);
      }
      return std::pair(sum, moment);
    };
    auto const on_a = gained(a), on_b = gained(b);
    CHECK((on_a.first - force).norm() < 1e-9 * force.norm());
    worst_balance = std::max(worst_balance, (on_a.first + on_b.first).norm() / force.norm());
    worst_moment = std::max(worst_moment, (on_a.second + on_b.second).norm() / (0.02 * force.norm()));
  }
  CAPTURE(met, worst, worst_balance, worst_moment);
  CHECK(met >= 8);
  CHECK(worst < 1e-5);
  CHECK(worst_balance < 1e-12);
  CHECK(worst_moment < 1e-9);
}

TEST_CASE("friction holds a block on a slope below the angle of friction, and lets it slide above as by hand", "[contact]") {
  double const friction = 0.4;
  for (bool const is_implicit : {false, true})
    for (double const slope : {0.3, 0.5}) {   // tan of the angle
      double const angle = std::atan(slope), h = is_implicit ? 2e-3 : 5e-4;
      Vector3<double> const gravity = 9.81 * Vector3<double>(std::sin(angle), 0, -std::cos(angle));
      auto const run = [&](auto body) {
        auto ground = table<double>();
        BodyContact contact(body, ground, {.friction = friction});
        body.set_gravity({0, 0, -9.81 * std::cos(angle)});
        auto const advance = [&](double seconds) {
          for (double t = 0; t < seconds; t += h) {
            contact.apply(body, ground, h);
            REQUIRE(body.advance(h));
          }
        };
        advance(0.4);
        body.set_gravity(gravity);
        advance(0.2);
        double const begin = middle(body)[0], speed = momentum(body)[0] / body.total_mass();
        advance(0.3);
        double const gone = middle(body)[0] - begin;
        CAPTURE(is_implicit, slope, begin, speed);
        if (slope < friction) {
          CHECK(std::abs(gone) < 2e-6);
          CHECK_FALSE(contact.regions()[0].slips);
        } else {
          double const acceleration = 9.81 * (std::sin(angle) - friction * std::cos(angle));
          CHECK(gone == Approx(speed * 0.3 + acceleration * 0.3 * 0.3 / 2).epsilon(0.02));
          CHECK(momentum(body)[0] / body.total_mass() - speed == Approx(acceleration * 0.3).epsilon(0.02));
          CHECK(contact.regions()[0].slips);
        }
      };
      auto const mesh = block<double>(4, 4, 2, 0.01, {0, 0, 0});
      is_implicit ? run(solid<double>(mesh, BackwardEuler{}, 5e4, 0)) : run(solid<double>(mesh, LeapfrogVerlet{}, 5e4, 0));
    }
}

TEST_CASE("bodies that collide keep momentum and angular momentum, and contact never makes energy", "[contact][random]") {
  char const* const count = std::getenv("PALPATE_COLLISIONS");
  int const rounds = count != nullptr ? std::atoi(count) : 12;
  Random random(Seed{8});
  double worst_momentum = 0, worst_angular = 0, worst_energy = 0;
  int met = 0;
  for (int round = 0; round < rounds; ++round) {
    auto const any = [&] { return random.uniform(-1.0, 1.0); };
    auto a = solid<double>(egg(4, {0.02, 0.017, 0.015}, {0, 0, 0}), SymplecticEuler{}, 1e4, 0, 0);
    Vector3<double> const way = Vector3<double>(any(), any(), any()).normalized();
    auto b = solid<double>(egg(4, {0.015, 0.02, 0.018}, 0.038 * way), SymplecticEuler{}, 1e4, 0, 0);
    for (int i = 0; i < a.size(); ++i) throw_particle(a, i, 0.3 * way + 2 * way.cross(Vector3<double>(a.positions().col(i))));
    for (int i = 0; i < b.size(); ++i) throw_particle(b, i, -0.2 * way + 0.1 * Vector3<double>(any(), any(), any()));
    auto const angular = [](auto const& body) {
      Vector3<double> sum = Vector3<double>::Zero();
      for (int i = 0; i < body.size(); ++i) sum += body.tissue().mass(i) * Vector3<double>(body.positions().col(i)).cross(Vector3<double>(body.velocities().col(i)));
      return sum;
    };
    auto const energy = [](auto const& body) { return body.kinetic_energy() + body.potential_energy(); };
    double const h = 2e-5, begun = energy(a) + energy(b);
    Vector3<double> const start = momentum(a) + momentum(b), turn = angular(a) + angular(b);
    BodyContact contact(a, b, {.friction = round % 2 == 0 ? 0.0 : 0.5});
    double highest = begun;
    for (int k = 0; k < 3000; ++k) {
      contact.apply(a, b, h);
      REQUIRE(a.step(h));
      REQUIRE(b.step(h));
      if (contact.regions().empty()) highest = std::max(highest, energy(a) + energy(b));
      met += contact.regions().empty() ? 0 : 1;
    }
    worst_momentum = std::max(worst_momentum, (momentum(a) + momentum(b) - start).norm() / (momentum(a).norm() + momentum(b).norm()));
    worst_angular = std::max(worst_angular, (angular(a) + angular(b) - turn).norm() / (angular(a).norm() + angular(b).norm()));
    worst_energy = std::max(worst_energy, (highest - begun) / begun);
  }
  CAPTURE(met, worst_momentum, worst_angular, worst_energy);
  CHECK(met > 80 * rounds);
  CHECK(worst_momentum < 1e-11);
  CHECK(worst_angular < 1e-7);
  CHECK(worst_energy < 1e-3);
}

TEST_CASE("two solids that begin deep in one another, anyhow turned, end apart or at rest", "[contact][random]") {
  Random random(Seed{11});
  char const* const asked = std::getenv("PALPATE_CONTACT_STARTS");
  int const starts = asked != nullptr ? std::atoi(asked) : 30;
  int met = 0;
  for (int round = 0; round < starts; ++round) {
    auto const any = [&] { return random.uniform(-1.0, 1.0); };
    auto const turned = [&](Vector3<double> const& at) {
      auto mesh = egg(4, {0.02 + 0.005 * any(), 0.017, 0.015}, Vector3<double>::Zero());
      mesh.points = Eigen::Quaterniond(Eigen::Vector4d(any(), any(), any(), any()).normalized()).toRotationMatrix() * mesh.points;
      mesh.points.colwise() += at;
      return solid<double>(mesh, BackwardEuler{}, 1e4, 1);
    };
    auto a = turned(Vector3<double>::Zero()), b = turned(random.uniform(0.002, 0.03) * Vector3<double>(any(), any(), any()).normalized());
    BodyContact contact(a, b, {.friction = 0.3});
    bool has_met = false;
    for (int k = 0; k < 300; ++k) {
      contact.apply(a, b, 2e-3);
      has_met = has_met || !contact.regions().empty();
      REQUIRE(a.step(2e-3));
      REQUIRE(b.step(2e-3));
    }
    REQUIRE((is_finite(a.positions()) && is_finite(b.positions())));
    double const parting = (momentum(a) / a.total_mass() - momentum(b) / b.total_mass()).dot(middle(a) - middle(b));
    if (!has_met) continue;
    ++met;
    CHECK((contact.regions().empty() ? parting > 0 : contact.force().norm() < 0.05));
  }
  CHECK(met > 0.9 * starts);
}

// Yardstick: a stiff plate on a bed of springs of k/δ per area leans by M/(k/δ J), J = a⁴/12; and by less of the bed where d/δ of it is spent.
TEST_CASE("a slab that is loaded at one side leans as on a bed of springs, and stays", "[contact]") {
  double const side = 0.03, gravity = 4 * 9.81, moment = 6e-4;
  BodyContactOptions<double> const options{.pressure = 1e4, .depth = 5e-3, .friction = 0.4};
  auto body = solid<double>(block<double>(4, 4, 2, 0.01, {-side / 2, -side / 2, 0}), BackwardEuler{}, 3e5, 20.0);
  body.set_gravity({0, 0, -gravity});
  auto ground = table<double>();
  BodyContact contact(body, ground, options);
  double squares = 0;
  for (int i = 0; i < body.size(); ++i) squares += body.reference_position(i)[2] > 0 ? std::pow(body.reference_position(i)[0], 2) : 0.0;
  for (int k = 0; k < 600; ++k) {
    for (int i = 0; i < body.size(); ++i)
      if (Vector3<double> const x = body.reference_position(i); x[2] > 0) body.apply_force(i, {0, 0, -moment / squares * x[0]});
    contact.apply(body, ground, 1e-3);
    REQUIRE(body.step(1e-3));
  }
  REQUIRE(contact.regions().size() == 1);
  auto const& region = contact.regions()[0];
  double const spent = region.volume / region.area / options.depth;
  CHECK(region.moment[1] == Approx(-moment).epsilon(0.02));
  CHECK(std::abs(region.moment[0]) < 0.01 * moment);
  double lean = 0, weights = 0;
  for (int i = 0; i < body.size(); ++i)
    if (Vector3<double> const x = body.reference_position(i); x[2] == 0) lean -= x[0] * body.positions()(2, i), weights += x[0] * x[0];
  CHECK(lean / weights == Approx(moment / (options.pressure / options.depth * (1 - spent) * std::pow(side, 4) / 12)).epsilon(0.05));
}

TEST_CASE("a slab on two bars loads them as a lever does", "[contact]") {
  auto body = solid<double>(block<double>(9, 4, 3, 0.01, {-0.04, -0.015, 0}), BackwardEuler{}, 1e5, 20.0);
  body.set_gravity({0, 0, -9.81});
  Obstacle<double> left(make_capsule<double>({-0.03, -0.05, -0.005}, {-0.03, 0.05, -0.005}, 0.005)), right(make_capsule<double>({0.01, -0.05, -0.005}, {0.01, 0.05, -0.005}, 0.005));
  BodyContact on_left(body, left, {.pressure = 2e4}), on_right(body, right, {.pressure = 2e4});
  for (int k = 0; k < 500; ++k) {
    on_left.apply(body, left, 2e-3), on_right.apply(body, right, 2e-3);
    REQUIRE(body.step(2e-3));
  }
  double const weight = 1000 * 9.81 * 0.08 * 0.03 * 0.02;
  CHECK(on_left.force()[2] == Approx(weight / 4).epsilon(0.02));
  CHECK(on_right.force()[2] == Approx(weight * 3 / 4).epsilon(0.02));
}

TEST_CASE("a disc that spins on a table is stopped by torsion, and a table that turns takes it along", "[contact]") {
  auto body = solid<double>(block<double>(4, 4, 2, 0.01, {-0.015, -0.015, 0}), LeapfrogVerlet{}, 2e4, 0);
  body.set_gravity({0, 0, -9.81});
  auto ground = table<double>();
  BodyContact contact(body, ground, {.friction = 0.4});
  auto const spin = [&] {
    double sum = 0;
    for (int i = 0; i < body.size(); ++i) sum += body.tissue().mass(i) * Vector3<double>(body.positions().col(i)).cross(Vector3<double>(body.velocities().col(i)))[2];
    return sum;
  };
  double turned = 0;
  auto const advance = [&](double seconds, double speed) {
    for (double t = 0; t < seconds; t += 5e-4) {
      turned += speed * 5e-4;
      ground.move_to({.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(turned, Eigen::Vector3d::UnitZ()))}, 5e-4);
      contact.apply(body, ground, 5e-4);
      REQUIRE(body.advance(5e-4));
      ground.step(5e-4);
    }
  };
  advance(0.3, 0);
  for (int i = 0; i < body.size(); ++i) throw_particle(body, i, Vector3<double>(0, 0, 10).cross(Vector3<double>(body.positions().col(i))));
  double const begun = spin();
  advance(0.01, 0);
  CHECK(spin() < 0.95 * begun);
  CHECK(contact.regions()[0].torsion < 0);
  advance(0.5, 0);
  CHECK(std::abs(spin()) < 1e-3 * begun);
  advance(0.5, 1);   // rad/s
  CHECK(spin() == Approx(begun / 10).epsilon(0.02));
}

TEMPLATE_TEST_CASE("a contact goes on as it did after both bodies and its anchors are restored, and allocates nothing", "[contact]", LeapfrogVerlet, BackwardEuler) {
  REQUIRE(trap_works());
  auto upper = solid<double>(egg(5, {0.02, 0.02, 0.012}, {0.001, 0.002, 0.0115}), TestType{}, 1e4);
  auto lower = solid<double>(block<double>(6, 6, 3, 0.01, {-0.025, -0.025, -0.02}), TestType{}, 1e4);
  for (int i = 0; i < lower.size(); ++i)
    if (lower.positions()(2, i) < -0.019) lower.nail(i);
  upper.set_gravity({3, 0, -9});
  BodyContact contact(upper, lower, {.friction = 0.4});
  constexpr bool is_implicit = std::is_same_v<TestType, BackwardEuler>;
  double const h = is_implicit ? 2e-3 : 1e-4;
  auto const advance = [&](int steps) {
    for (int k = 0; k < steps; ++k) contact.apply(upper, lower, h), upper.advance(h), lower.advance(h);
  };
  advance(is_implicit ? 100 : 800);
  REQUIRE(contact.regions().size() == 1);
  auto const saved = upper.save(), other = lower.save();
  auto const anchors = contact.save();
  advance(100);
  Matrix3X<double> const once = upper.positions();
  upper.restore(saved), lower.restore(other), contact.restore(anchors, upper, lower);
  advance(1);   // finds again what the bodies are made of
  AllocationCount const allocations;
  advance(99);
  CHECK(allocations.count() == 0);
  CHECK((upper.positions() - once).cwiseAbs().maxCoeff() == 0);
  // Forgotten, it begins as a new contact does: nothing is left of the old one.
  upper.restore(saved), lower.restore(other);
  contact.apply(upper, lower, h);
  CHECK(is_finite(contact.force()));
  Matrix3X<double> far = upper.positions();
  for (int i = 0; i < upper.size(); ++i) throw_particle(upper, i, {0, 0, 1000});
  upper.step(5e-5);
  for (int k = 0; k < 3; ++k) contact.apply(upper, lower, 1e-4);
  CHECK(contact.regions().empty());
  CHECK(contact.force().norm() == 0);
}

TEST_CASE("after a cut is undone and another one made, a contact presses what is there, as one that is made then", "[contact]") {
  auto lower = solid<double>(block<double>(5, 5, 3, 0.01, {-0.02, -0.02, -0.02}), BackwardEuler{});
  for (int i = 0; i < lower.size(); ++i)
    if (lower.positions()(2, i) < -0.019) lower.nail(i);
  auto upper = solid<double>(block<double>(4, 4, 2, 0.01, {-0.0137, -0.0161, -0.0005}), BackwardEuler{});
  BodyContact contact(upper, lower);
  auto const saved = lower.save();
  auto const edge_at = [&](Vector3<double> const& p) {   // an edge along x from the vertex nearest to p
    int const a = lower.nearest_vertex(p);
    int found = -1;
    lower.tissue().for_each_joined(a, [&](int b) { found = found < 0 || b < found ? b : found; });
    return std::pair(a, found);
  };
  auto const divide = [&](Vector3<double> const& p) {
    auto const [a, b] = edge_at(p);
    lower.insert_on_edge(a, b, 0.5);
  };
  divide({-0.02, -0.02, 0});
  contact.apply(upper, lower, 2e-3), upper.step(2e-3), lower.step(2e-3);
  lower.restore(saved);
  divide({0.0, 0.0, 0});
  auto other_upper = upper, other_lower = lower;
  BodyContact fresh(other_upper, other_lower);
  contact.apply(upper, lower, 2e-3), fresh.apply(other_upper, other_lower, 2e-3);
  REQUIRE(fresh.force().norm() > 0.01);
  CHECK((contact.force() - fresh.force()).norm() == 0);
}

TEST_CASE("an obstacle holds what a body has to", "[contact]") {
  auto probe = table<double>();
  CHECK(testing::to_text(testing::check_body(probe)) == "");
}

TEST_CASE("what a contact and an obstacle refuse", "[contact]") {
  auto body = solid<double>(block<double>(3, 3, 3, 0.01, {0, 0, 0}), LeapfrogVerlet{});
  auto ground = table<double>();
  auto const refused = [&](BodyContactOptions<double> const& options) { return message_of([&] { BodyContact(body, ground, options); }); };
  CHECK(unsaid(refused({.pressure = 0}), ".pressure is 0 Pa") == "");
  CHECK(unsaid(refused({.depth = -1}), ".depth is -1 m") == "");
  CHECK(unsaid(refused({.settling = -1}), ".settling is -1 s") == "");
  CHECK(unsaid(refused({.friction = std::nan("")}), ".friction is nan") == "");
  BodyContact contact(body, ground);
  CHECK(unsaid(message_of([&] { contact.apply(body, ground, 0); }), "step is 0 s", "positive") == "");
  CHECK(unsaid(message_of([&] { ground.move_to({.position = {0, std::nan(""), 0}}, 1e-3); }), "Obstacle", "finite") == "");
  CHECK(unsaid(message_of([&] { BodyContact(body, body).apply(body, body, 1e-3); }), "one body") == "");
  SoftBody sheet(MassSpring<double>(make_grid<double>(3, 3, 0.01), {.mass = {.total = 0.01}, .link = {.stiffness = 1.0}}), LeapfrogVerlet{});
  CHECK(unsaid(message_of([&] { BodyContact(body, sheet); }), "second body is open at the edge of vertices") == "");
  // A body that is all nailed, in implicit steps.
  auto stiff = solid<double>(block<double>(3, 3, 3, 0.01, {0, 0, 0.0195}), BackwardEuler{});
  for (int i = 0; i < stiff.size(); ++i) stiff.nail(i);
  BodyContact held(body, stiff);
  held.apply(body, stiff, 1e-4);
  CHECK(held.force()[2] < 0);
  auto open = skin_of(block<double>(3, 3, 3, 0.01, {0, 0, 0}));
  open.triangles.conservativeResize(3, open.triangles.cols() - 1);
  CHECK_THROWS_AS(Obstacle<double>(open), InvalidMesh);
}
