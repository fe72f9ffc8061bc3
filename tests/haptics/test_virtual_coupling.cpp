// SPDX-License-Identifier: MIT
#include <palpate/core/random.hpp>
#include <palpate/device/capabilities.hpp>
#include <palpate/device/sampled_mass.hpp>
#include <palpate/haptics/virtual_coupling.hpp>

#include "allocation_trap.hpp"
#include "catch.hpp"
#include "haptics/spectral_radius.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

using namespace palpate;

namespace {

using Vector = Vector3<double>;
using State = DeviceState<double>;

Vector any_direction(Random& random) { return Vector(random.normal(), random.normal(), random.normal()).normalized(); }

ToolLoad<double> spring_load(double stiffness, State const& tool) {
  ToolLoad<double> load;
  load.wrench.force = -stiffness * tool.position;
  load.stiffness = stiffness * Matrix<double, 3, 3>::Identity();
  return load;
}

/// One tick of device, coupling and a spring to the origin on the tool, as a matrix on (x, v, x_t, v_t): each column is the tick of one unit.
double radius_of_loop(double mass, double damping, CouplingLaw const& law, double environment) {
  SampledMass<double> const plant({.mass = mass, .damping = damping});
  Eigen::Matrix4d loop;
  for (int k = 0; k < 4; ++k) {
    Vector x(k == 0, 0, 0), v(k == 1, 0, 0);
    State tool, device;
    tool.position.x() = k == 2, tool.velocity.x() = k == 3;
    device.position = x, device.velocity = v;
    VirtualCoupling<double> coupling({.position = law});
    coupling.attach(tool);
    Vector const force = coupling(device, spring_load(environment, tool)).force;
    plant.step(x, v, force);
    loop.col(k) << x.x(), v.x(), coupling.tool().position.x(), coupling.tool().velocity.x();
  }
  return palpate_test::spectral_radius(loop);
}

}  // namespace

// Yardstick: by hand, F = K_c · offset and τ = K_θ θ about the axis, for every sign of a quaternion.
TEMPLATE_TEST_CASE("C7-V1: a coupling is a spring between the poses of device and tool", "[haptics]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  VirtualCoupling<S> const coupling({.position = {.stiffness = 400.0}, .rotation = {.stiffness = 0.3}});
  Random random(Seed{2});
  for (int k = 0; k < 100; ++k) {
    DeviceState<S> device, tool;
    Vector const offset = 0.01 * any_direction(random), axis = any_direction(random);
    double const angle = random.uniform(0.0, 3.1);
    device.position = Vector3<S>(S(0.1), S(-0.2), S(0.3));
    device.orientation = Eigen::Quaternion<S>(Eigen::AngleAxis<S>(S(random.uniform(-3.0, 3.0)), any_direction(random).cast<S>()));
    tool.position = device.position + offset.cast<S>();
    tool.orientation = Eigen::Quaternion<S>(Eigen::AngleAxis<S>(S(angle), axis.cast<S>())) * device.orientation;
    if (k % 2 == 0) tool.orientation.coeffs() *= S(-1);
    Wrench<S> const wrench = coupling.between(device, tool);
    CHECK((wrench.force.template cast<double>() - 400.0 * offset).norm() < 4000 * std::numeric_limits<S>::epsilon());
    CHECK((wrench.torque.template cast<double>() - 0.3 * angle * axis).norm() < 64 * std::numeric_limits<S>::epsilon());
  }
}

// Yardstick: Eigen's angle and axis, and v/2 for small rotations.
TEST_CASE("the rotation vector is the shortest arc, down to the smallest angles") {
  Random random(Seed{3});
  for (double const angle : {0.0, 1e-100, 1e-12, 1e-6, 0.3, 2.0, std::numbers::pi - 1e-9}) {
    Vector const axis = any_direction(random);
    Eigen::Quaterniond q(Eigen::AngleAxisd(angle, axis));
    CAPTURE(angle);
    CHECK((rotation_vector(q) - angle * axis).norm() <= 1e-14 + 1e-15 * angle);
    q.coeffs() *= -1;
    CHECK((rotation_vector(q) - angle * axis).norm() <= 1e-14 + 1e-15 * angle);
    CHECK(rotation_of(Vector(angle * axis)).angularDistance(q) < 3e-8);
    if (angle > 0 && angle < 1) CHECK(rotation_vector(q).norm() == Approx(angle).epsilon(1e-12));
  }
  CHECK(rotation_vector(Eigen::Quaterniond(Eigen::AngleAxisd(1.5 * std::numbers::pi, Vector::UnitZ()))).z() == Approx(-0.5 * std::numbers::pi));
}

// Yardstick: Newton's law for the tool: what its momentum gains is what the load gives less what the hand gets.
TEST_CASE("C7-V2: what the hand gets is taken from the tool, force and torque") {
  Random random(Seed{4});
  VirtualCoupling<double> coupling({.position = {.stiffness = 800.0, .damping = 0.4, .mass = 0.02},
                                     .rotation = {.stiffness = 0.2, .damping = 1e-4, .mass = 2e-5}});
  State device;
  coupling(device);
  double angle = 0;
  for (int k = 0; k < 500; ++k) {
    device.velocity = 0.1 * any_direction(random);
    device.position += 1e-3 * device.velocity;
    device.angular_velocity = Vector(0, 0, random.normal());   // about one axis: finite rotations add
    angle += 1e-3 * device.angular_velocity.z();
    device.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(angle, Vector::UnitZ()));
    ToolLoad<double> load;
    load.wrench = {.force = random.normal() * any_direction(random), .torque = {0, 0, 0.01 * random.normal()}};
    State const before = coupling.tool();
    Wrench<double> const hand = coupling(device, load);
    Vector const gained = 0.02 * (coupling.tool().velocity - before.velocity) / 1e-3;
    CHECK((gained - (load.wrench.force - hand.force)).norm() < 1e-11);
    Vector const spun = 2e-5 * (coupling.tool().angular_velocity - before.angular_velocity) / 1e-3;
    CHECK((spun - (load.wrench.torque - hand.torque)).norm() < 1e-12);
    CHECK((coupling.tool().position - before.position - 1e-3 * coupling.tool().velocity).norm() < 1e-15);
  }
  for (int k = 0; k < 20000; ++k) {   // at rest the hand carries the load
    device.velocity.setZero(), device.angular_velocity.setZero();
    ToolLoad<double> load;
    load.wrench.force = {0.4, 0, -0.8};
    load.wrench.torque = {0.02, 0, 0.04};
    Wrench<double> const hand = coupling(device, load);
    if (k == 19999) {
      CHECK((hand.force - load.wrench.force).norm() < 1e-9);
      CHECK((coupling.tool().position - device.position - load.wrench.force / 800.0).norm() < 1e-12);
      CHECK((hand.torque - load.wrench.torque).norm() < 1e-9);
    }
  }
}

// Yardstick: the closed form of the sampled wall; the plant moves exactly.
TEST_CASE("C7-V3: with the tool held, the coupled device stays stable up to the stiffest sampled wall") {
  double const mass = 0.075, damping = 0.5;
  SampledMass<double> const plant({.mass = mass, .damping = damping});
  auto const radius = [&](double stiffness) {
    VirtualCoupling<double> const coupling({.position = {.stiffness = stiffness}});
    Eigen::Matrix2d loop;
    for (int k = 0; k < 2; ++k) {
      Vector x(k == 0, 0, 0), v(k == 1, 0, 0);
      State device;
      device.position = x, device.velocity = v;
      plant.step(x, v, coupling.between(device, State{}).force);
      loop.col(k) << x.x(), v.x();
    }
    return palpate_test::spectral_radius(loop);
  };
  double low = 1, high = 10000;
  for (int k = 0; k < 60; ++k) {
    double const middle = (low + high) / 2;
    (radius(middle) < 1 ? low : high) = middle;
  }
  CHECK(low == Approx(stable_wall(mass, damping, 0.001)).epsilon(1e-9));
  CHECK(low == Approx(1001.11).epsilon(1e-5));
}

// Yardstick: eigenvalues of the whole loop. With the coupling's choice nothing that the tool touches matters; above the bound something hard does.
TEST_CASE("C7-V4: a coupling below its bound keeps the device stable whatever the tool touches") {
  for (double const mass : {0.045, 0.075, 0.15})
    for (double const damping : {0.1, 0.5, 3.0})
      for (double const environment : {0.0, 1.0, 30.0, 1e2, 1e3, 1e4, 1e5, 1e6})
        for (double const tool : {0.0, 1e-6, 1e-3, 0.02, 0.5}) {
          CouplingLaw law = coupling_for({.mass = mass, .damping = damping});
          if (tool > 0) law.mass = tool;
          CAPTURE(mass, damping, environment, tool, law.stiffness);
          double const radius = radius_of_loop(mass, damping, law, environment);
          CHECK(radius < (environment > 0 ? 1.0 : 1.0 + 1e-9));   // without an environment it may be anywhere: 1
          law.damping = 0, law.stiffness = 1.05 * stable_wall(mass, damping, 1e-3);
          if (environment >= 1e6 && tool <= 1e-3) CHECK(radius_of_loop(mass, damping, law, environment) > 1.0);
        }
}

// Yardstick: passivity in time, for any way of the hand: what it has put in, with what a damper b = K_c T/2 + B_c has taken, is
// never below zero.
TEST_CASE("with a damper of the bound the device's side never gives energy, and with half of it, it does") {
  Random random(Seed{9});
  auto const least = [&](double share) {
    double smallest = 0;
    for (int set = 0; set < 60; ++set) {
      CouplingLaw const law{.stiffness = random.uniform(100.0, 3000.0),
                            .damping = random.uniform(0.0, 1.0) * (set % 2),
                            .mass = set % 3 == 0 ? 0.0 : std::exp(random.uniform(-12.0, -2.0))};
      double const environment = set % 4 == 0 ? 0.0 : std::exp(random.uniform(2.0, 14.0)), bound = share * (law.stiffness * 1e-3 / 2 + law.damping);
      VirtualCoupling<double> coupling({.position = law});
      State device;
      coupling(device);
      Vector force = Vector::Zero(), drift = Vector::Zero();
      double energy = 0;
      for (int k = 0; k < 1000; ++k) {
        if (k % 20 == 0) drift = 2e-5 * any_direction(random);
        Vector const way = k % 100 < 50    ? Vector(1e-4 * any_direction(random))
                           : k % 200 < 100 ? drift
                                           : Vector((k % 2 ? 1e-4 : -1e-4) * Vector::UnitX());
        energy += bound / 1e-3 * way.squaredNorm() - force.dot(way);
        smallest = std::min(smallest, energy);
        device.position += way;
        device.velocity = way / 1e-3;
        force = coupling(device, spring_load(environment, coupling.tool())).force;
      }
    }
    return smallest;
  };
  CHECK(least(1.0) > -1e-12);
  CHECK(least(0.5) < -1e-6);
}

// Yardstick: a hand that pulls 20 mm into it comes to rest, at a wall of any stiffness; rendered directly one of 10 kN/m makes it vibrate by 3 mm.
TEST_CASE("a hand that presses a coupled tool on a one-sided wall comes to rest") {
  for (double const environment : {1e2, 1e3, 1e4, 1e5, 1e6})
    for (double const tool : {0.0, 0.005}) {
      CouplingLaw law = coupling_for({.mass = 0.075, .damping = 0.5});
      if (tool > 0) law.mass = tool;
      SampledMass<double> const plant({.mass = 0.225, .damping = 2.5, .stiffness = 100.0});
      VirtualCoupling<double> coupling({.position = law});
      State device;
      device.position.x() = 0.02;
      double low = 1, high = -1;
      for (int k = 0; k < 3000; ++k) {
        ToolLoad<double> load;
        if (coupling.attached() && coupling.tool().position.x() < 0) {
          load.wrench.force.x() = -environment * coupling.tool().position.x();
          load.stiffness(0, 0) = environment;
        }
        Vector const force = coupling(device, load).force;
        if (k >= 2500) low = std::min(low, device.position.x()), high = std::max(high, device.position.x());
        plant.step(device.position, device.velocity, force, {-0.02, 0, 0});
      }
      double const series = 1 / (1 / law.stiffness + 1 / environment);
      CAPTURE(environment, tool);
      CHECK(high - low < 1e-6);
      CHECK(low == Approx(-0.02 * 100 / (100 + series)).epsilon(1e-3));
    }
}

// Yardstick: the textbook's critically damped return, (1 + ω t) e^(−ω t), in position and about an axis.
TEST_CASE("the tool's own mass is the one that the coupling damps critically") {
  CouplingLaw const law = coupling_for({.mass = 0.075, .damping = 0.5});
  double const omega = std::sqrt(law.stiffness / law.mass), h = 2e-4 / omega;
  VirtualCoupling<double> coupling({.position = law, .rotation = law, .period = h});
  State tool, device;
  tool.position.x() = 0.01;
  tool.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Vector::UnitY()));
  coupling.attach(tool);
  for (int k = 1; k <= 25000; ++k) {
    coupling(device);
    if (k % 5000 == 0) {
      double const t = omega * k * h;
      CHECK(coupling.tool().position.x() == Approx(0.01 * (1 + t) * std::exp(-t)).epsilon(2e-3));
      CHECK(rotation_vector(coupling.tool().orientation).y() == Approx(0.5 * (1 + t) * std::exp(-t)).epsilon(2e-3));
    }
  }
}

// Yardstick: by hand.
TEST_CASE("the choice for a device follows what is known of it") {
  CouplingLaw const known = coupling_for({.mass = 0.075, .damping = 0.5});
  CHECK(known.damping == Approx(0.05));
  CHECK(known.stiffness == Approx(0.9 * 2 * 0.45 / 0.001));
  CHECK(known.mass == Approx(0.05 * 0.05 / (4 * 810)));
  CHECK(coupling_for({.damping = 0.5, .max_stiffness = 300.0}).stiffness == 300.0);
  CHECK(coupling_for({.damping = 0.5, .max_damping = 0.01}).damping == 0.01);
  CHECK(coupling_for({.damping = 0.5, .rate = 2000.0}).stiffness == Approx(2 * 810.0));
  CouplingLaw const driver = coupling_for({.mass = 0.045, .max_stiffness = 400.0, .max_damping = 4.0});
  CHECK(driver.stiffness == 400.0);
  CHECK(driver.damping == 4.0);
  CHECK(coupling_for({.mass = 0.0045, .max_stiffness = 400.0, .max_damping = 4.0}).damping == Approx(1.125));   // m/(4 T)
  CHECK(coupling_for({.max_stiffness = 400.0}).damping == 0.0);
  CHECK(coupling_for({.max_stiffness = 400.0}).mass == 0.0);
  CouplingLaw const said = coupling_for(coupling_limits(
      {.max_force = 3.3, .rate = 2000.0, .max_damping = datasheet(0.01), .mass = guessed(0.045), .damping = datasheet(0.3)}));
  CHECK(said.damping == 0.01);
  CHECK(said.stiffness == Approx(0.9 * 2 * 0.29 * 2000));
  // 2 f/Δ of an Omni, a Desktop and a Premium 1.5, as published: 9455, 5217 and 2667 N/m.
  for (auto const& [friction, quantum, stiffest] : {std::array{0.26, 55e-6, 9455.0}, std::array{0.06, 23e-6, 5217.0}, std::array{0.04, 30e-6, 2667.0}})
    CHECK(coupling_for(coupling_limits({.rate = 1000.0, .damping = datasheet(10.0), .friction = friction, .resolution = quantum})).stiffness == Approx(stiffest).epsilon(2e-4));
  CHECK(coupling_for({.damping = 10.0, .quantum = 55e-6}).stiffness == Approx(0.9 * 2 * 9.0 / 0.001));   // its friction is not known
  CHECK_THROWS_AS(coupling_for({.damping = 0.5, .quantum = -1.0}), InvalidArgument);
  CHECK(coupling_for(coupling_limits({.rate = 1000.0, .max_stiffness = 400.0})).stiffness == 400.0);   // nobody knows its damping
  CHECK_THROWS_AS(coupling_for(coupling_limits({.max_force = 3.3, .rate = 1000.0})), InvalidArgument);
  CHECK_THROWS_AS(coupling_for(coupling_limits({.rate = 1000.0, .damping = guessed(5.0)})), InvalidArgument);   // a hand is not protected by a guess
  CHECK(coupling_for(coupling_limits({.rate = 1000.0, .moves_a_hand = false, .damping = guessed(5.0)})).stiffness == Approx(0.9 * 2 * 4.5 * 1000));
  CHECK_THROWS_WITH(coupling_for({.mass = 0.1}), says(".max_stiffness is inf", ".damping"));
  CHECK_THROWS_AS(coupling_for({.mass = -0.1, .damping = 0.5}), InvalidArgument);
  CHECK_THROWS_AS(coupling_for({.damping = std::numeric_limits<double>::quiet_NaN()}), InvalidArgument);
  CHECK_THROWS_AS(coupling_for({.damping = 0.5, .rate = 0.0}), InvalidArgument);
}

// Yardstick: a tool without mass is where the device is in free space; nothing is felt at first, wherever and however fast it begins.
TEST_CASE("C7-V5: the tool begins at the device, and nothing is felt in free space") {
  for (double const mass : {0.0, 0.003}) {
    VirtualCoupling<double> coupling({.position = {.stiffness = 800.0, .damping = 0.05, .mass = mass},
                                       .rotation = {.stiffness = 0.1, .damping = 1e-5}});
    State device;
    device.position = {0.3, -0.2, 0.1}, device.velocity = {0.2, 0, 0.1}, device.angular_velocity = {0, 0.5, 0};
    device.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(2.0, Vector::UnitX()));
    CHECK_FALSE(coupling.attached());
    Wrench<double> wrench = coupling(device);
    CHECK(wrench.force == Vector::Zero());
    CHECK(wrench.torque == Vector::Zero());
    CHECK(coupling.tool().position == device.position);
    for (int k = 0; k < 200; ++k) {
      device.position += 1e-3 * device.velocity;
      device.orientation = rotation_of(Vector(1e-3 * device.angular_velocity)) * device.orientation;
      wrench = coupling(device);
      CHECK(wrench.force.norm() < 1e-10);
      CHECK(wrench.torque.norm() < 1e-10);
    }
  }
}

TEST_CASE("without a stiffness of rotation the tool has the device's orientation") {
  VirtualCoupling<double> coupling;
  State device;
  coupling(device);
  device.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Vector::UnitX()));
  device.buttons = 3;
  CHECK(coupling(device).torque == Vector::Zero());
  CHECK(coupling.tool().orientation.coeffs() == device.orientation.coeffs());
  CHECK(coupling.tool().buttons == 3);
}

TEST_CASE("what is no number lets the tool go, malformed couplings are refused, and a tick allocates nothing") {
  double const nan = std::numeric_limits<double>::quiet_NaN();
  VirtualCoupling<double> coupling({.rotation = {.stiffness = 0.1}});
  State device, lost;
  lost.position.x() = nan;
  ToolLoad<double> load, broken;
  load.wrench.force.x() = 1.0;
  broken.wrench.torque.x() = nan;
  coupling(device);
  CHECK(coupling(device, load).force.x() == Approx(1.0));
  CHECK(coupling(lost, load).force == Vector::Zero());
  CHECK_FALSE(coupling.attached());
  CHECK(coupling(device, load).force == Vector::Zero());
  CHECK(coupling(device, load).force.x() == Approx(1.0));
  CHECK(coupling(device, broken).force == Vector::Zero());
  CHECK(coupling(device, load).force == Vector::Zero());   // it begins anew
  using Coupling = VirtualCoupling<double>;
  CHECK_THROWS_WITH(Coupling({.position = {.stiffness = 0.0}}), says(".position.stiffness is 0 N/m", "above zero"));
  CHECK_THROWS_AS(Coupling({.position = {.damping = -1.0}}), InvalidArgument);
  CHECK_THROWS_AS(Coupling({.position = {.mass = nan}}), InvalidArgument);
  CHECK_THROWS_AS(Coupling({.rotation = {.stiffness = -1.0}}), InvalidArgument);
  CHECK_THROWS_AS(Coupling({.period = 0.0}), InvalidArgument);
  palpate_test::AllocationCount const allocations;
  for (int k = 0; k < 100; ++k) {
    device.position.x() = 1e-4 * k;
    coupling(device, load);
  }
  long const counted = allocations.count();
  CHECK(counted == 0);
}
