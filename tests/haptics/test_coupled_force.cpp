// SPDX-License-Identifier: MIT
// Yardsticks: springs in series; the closed form of the sampled wall with a mass that moves exactly; energy in time for any way of the hand.
#include <palpate/core/random.hpp>
#include <palpate/device/limit.hpp>
#include <palpate/device/sampled_mass.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/haptics/coupled_force.hpp>
#include <palpate/haptics/press_then_cut.hpp>

#include "allocation_trap.hpp"
#include "catch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

using namespace palpate;

namespace {

using Vector = Vector3<double>;

/// The plane z = 0 with tissue below it, for a force that answers to the surface and for one that answers to depth.
template <class S>
LocalModel<S> coupled_plane(S stiffness) {
  LocalModel<S> local;
  local.phase = CuttingPhase::indenting;
  local.surface.sequence = 1;
  local.surface.patch.stiffness = stiffness;
  return local;
}

template <class S>
ProxyForce<S> stiff_proxy(S stiffness) {
  return ProxyForce<S>({.surface = SurfaceKind::plane, .max_stiffness = stiffness, .handover = 1});
}

/// An estimator that says what it is told.
struct ToldVelocity {
  using Scalar = double;
  Vector told = Vector::Zero();
  Vector operator()(Vector const&) noexcept { return told; }
  void reset() noexcept {}
};

/// F = K d n, of a force model whose stiffness the coupling does not know.
struct PlainSpring {
  double stiffness = 1.0;
  Vector operator()(ToolContact<double> const& contact) const noexcept { return stiffness * contact.depth * contact.normal; }
};

struct Swing {
  double early = 0.0, late = 0.0;   // m, the largest way from equilibrium in the first and in the last 300 ms of six seconds
};

/// A mass pressed 5 mm deep into a stiff plane through the coupling that the record of this device asks for, kicked with 2 mm/s.
template <class Velocity>
Swing swing(Capabilities const& record, CoupledForceOptions const& options, double mass, double damping, double quantum = 0.0) {
  CoupledForce<ProxyForce<double>, Velocity> force(stiff_proxy(1e6), options);
  force.begin_session(record, WorkspaceMapping<double>{}, 1000.0);
  auto const local = coupled_plane(1e6);
  double const depth = 0.005, stiffness = 1 / (1 / force.law().stiffness + 1e-6);
  SampledMass<double> const plant({.mass = mass, .damping = damping});
  Vector x(0, 0, -depth), v(0, 0, 0.002);
  Swing most;
  for (int k = 0; k < 6000; ++k) {
    Vector const felt = force.on_surface(local, {.tip = quantised(x, quantum), .seconds = 0.001, .continues = true});
    plant.step(x, v, felt - Vector(0, 0, stiffness * depth));
    double const way = std::abs(x.z() + depth);
    if (k < 300) most.early = std::max(most.early, way);
    if (k >= 5700) most.late = std::max(most.late, way);
  }
  return most;
}

}  // namespace

TEMPLATE_TEST_CASE("pressed on a plane, a coupled force is two springs in series", "[haptics]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  double const close = 1e3 * std::numeric_limits<S>::epsilon();
  Capabilities const device{.rate = 1000.0, .max_stiffness = 400.0};
  for (double const plane : {50.0, 400.0, 3000.0, 1e5}) {
    CoupledForce force(stiff_proxy<S>(S(plane)));
    force.begin_session(device, WorkspaceMapping<S>{}, 1000.0);
    auto const local = coupled_plane<S>(S(plane));
    Vector3<S> felt;
    for (int k = 0; k <= 400; ++k)
      felt = force.on_surface(local, {.tip = Vector3<S>(0, 0, S(0.001) - S(5e-6) * S(std::min(k, 300))), .seconds = S(0.001), .continues = true});
    double const series = 1 / (1 / 400.0 + 1 / plane);
    CAPTURE(plane);
    CHECK(double(felt.z()) == Approx(series * 5e-4).epsilon(close));
    CHECK(double(force.tool().position.z()) == Approx(-series * 5e-4 / plane).epsilon(close));
    felt = force.on_surface(local, {.tip = Vector3<S>(0, 0, S(0.001)), .seconds = S(0.001), .continues = false});   // after a pause it begins at the device
    CHECK(felt.isZero(0));
    felt = force.on_surface(local, {.tip = Vector3<S>(0, 0, S(-5e-4)), .seconds = S(0.001), .continues = false});   // in the tissue: what is felt at rest
    CHECK(double(felt.z()) == Approx(series * 5e-4).epsilon(close));
  }
}

TEST_CASE("a force model behind a coupling is a spring in series too, where it is far stiffer than the coupling as well", "[haptics]") {
  for (double const stiffness : {50.0, 2000.0, 1e6}) {
    CoupledForce force(PlainSpring{stiffness}, {.stiffness = 400.0});
    force.begin_session(1000.0, 500.0);
    CHECK(force.surface_kind() == SurfaceKind::none);
    auto const local = coupled_plane(0.0);
    Vector felt;
    for (int k = 0; k < 500; ++k) felt = force.on_surface(local, {.tip = {0, 0, 1e-3 - 1e-5 * std::min(k, 300)}, .seconds = 0.001, .continues = true});
    CAPTURE(stiffness);
    CHECK(felt.z() == Approx(0.002 / (1 / 400.0 + 1 / stiffness)).epsilon(1e-9));
    CoupledForce cutting(CuttingForce(IndentationSpring<double>{.stiffness = stiffness}), {.stiffness = 400.0}, WindowedVelocity<double, 8>{});
    cutting.begin_session(1000.0, 500.0);
    for (int k = 0; k < 500; ++k) felt = cutting.on_surface(local, {.tip = {0, 0, 1e-3 - 1e-5 * std::min(k, 300)}, .seconds = 0.001, .continues = true});
    CHECK(felt.z() == Approx(0.002 / (1 / 400.0 + 1 / stiffness)).epsilon(1e-9));
  }
}

TEST_CASE("a coupled tool that cuts along a curve steeper than the coupling is still, and springs in series", "[haptics]") {
  CoupledForce force(PressThenCut(stiff_proxy(500.0), [](double depth) noexcept { return 5000.0 * depth; }), {.stiffness = 400.0});
  force.begin_session(1000.0, 1000.0);
  LocalModel<double> local = coupled_plane(500.0);
  Vector felt;
  for (int k = 0; k < 1000; ++k) {
    if (k == 300) local.phase = CuttingPhase::moving, local.surface.patch.stiffness = 0.0, local.surface.sequence = 2;
    felt = force.on_surface(local, {.tip = {0, 0, -1e-4 * std::min(k, 300)}, .seconds = 0.001, .continues = true});
    if (k == 299) CHECK(felt.z() == Approx(0.0299 / (1 / 400.0 + 1 / 500.0)).epsilon(1e-6));
  }
  CHECK(felt.z() == Approx(0.03 / (1 / 400.0 + 1 / 5000.0)).epsilon(1e-6));
}

// By hand: the tool rests where K (x_d − x) + B u = k x, and the hand feels k x.
TEST_CASE("the coupling's damper goes by the velocity that its estimator says", "[haptics]") {
  Capabilities const device{.rate = 1000.0, .max_stiffness = 400.0, .max_damping = 2.0, .mass = 0.045};
  for (double const told : {0.0, -0.01, -0.05}) {
    CoupledForce force(stiff_proxy(1000.0), {}, ToldVelocity{{0, 0, told}});
    force.begin_session(device, WorkspaceMapping<double>{}, 1000.0);
    REQUIRE(force.law().damping == 2.0);
    Vector felt;
    for (int k = 0; k < 2000; ++k) felt = force.on_surface(coupled_plane(1000.0), {.tip = {0, 0, -0.002}, .seconds = 0.001, .continues = true});
    CHECK(felt.z() == Approx(1000.0 * (400.0 * 0.002 - 2.0 * told) / 1400.0).epsilon(1e-9));
  }
}

TEST_CASE("what the hand feels of a coupling is what its device stands, whatever the mapping and the host's wish", "[haptics]") {
  Capabilities const device{.rate = 2000.0, .mass = 0.075, .damping = datasheet(0.5)};
  auto const law = [&](CoupledForceOptions const& options, WorkspaceMapping<double> const& mapping) {
    CoupledForce force(ProxyForce<double>{}, options);
    force.begin_session(device, mapping, 1000.0);
    return force.law();
  };
  CouplingLaw const plain = coupling_for(coupling_limits(device)), own = law({}, {});
  CHECK(own.stiffness == plain.stiffness);
  CHECK(own.damping == plain.damping);
  CHECK(law({.stiffness = 300.0, .damping = 0.01}, {}).stiffness == 300.0);
  CHECK(law({.stiffness = 300.0, .damping = 0.01}, {}).damping == 0.01);
  CHECK(law({.stiffness = 1e9}, {}).stiffness == plain.stiffness);
  WorkspaceMapping<double> const tenfold(Similarity<double>::make(10.0, Eigen::Quaterniond::Identity(), Vector::Zero()), 2.0);
  CHECK(tenfold.felt_stiffness(law({}, tenfold).stiffness) == Approx(plain.stiffness));
  CHECK(tenfold.felt_stiffness(law({}, tenfold).damping) == Approx(plain.damping));
  CoupledForce unknown(ProxyForce<double>{});
  CHECK_THROWS_WITH(unknown.begin_session(1000.0, 500.0), says("neither its damping", "CoupledForceOptions::stiffness"));
  CHECK_THROWS_AS(CoupledForce(ProxyForce<double>{}, {.stiffness = 0.0}), InvalidArgument);
  CHECK_THROWS_AS(CoupledForce(ProxyForce<double>{}, {.damping = -1.0}), InvalidArgument);
}

// Closed form: K* of the sampled wall. The record says b, K_c is 0.9 · 2 b/T (without damper); the device has its stated damping, or so little that K_c is
// half a percent below or above its K*.
TEST_CASE("a device on a hard plane is stable with the coupling of its record, and half a percent on either side of the bound shows", "[haptics]") {
  for (double const mass : {0.045, 0.075, 0.15})
    for (double const said : {0.3, 0.5, 2.0}) {
      Capabilities const record{.rate = 1000.0, .damping = datasheet(said)};
      double const stiffness = 1 / (1 / (0.9 * 2 * said / 0.001) + 1e-6);
      auto const damping_for = [&](double limit) {
        double low = 0, high = said;
        for (int k = 0; k < 60; ++k) {
          double const middle = (low + high) / 2;
          (stable_wall(mass, middle, 0.001) < limit ? low : high) = middle;
        }
        return low;
      };
      CAPTURE(mass, said);
      auto const growth = [&](double damping) {
        Swing const s = swing<BackwardDifference<double>>(record, {.damping = 0.0}, mass, damping);
        return s.late / s.early;
      };
      CHECK(growth(said) < 0.9);
      CHECK(growth(damping_for(stiffness * 1.005)) < 1.0);
      CHECK(growth(damping_for(stiffness / 1.005)) > 1.0);
    }
}

TEST_CASE("with the damper of its record a device comes to rest, whichever estimator feeds it, through steps of the position too", "[haptics]") {
  Capabilities const known{.rate = 1000.0, .mass = 0.075, .damping = datasheet(0.5), .resolution = 55e-6}, driver{.rate = 1000.0, .max_stiffness = 500.0, .max_damping = 3.0, .mass = 0.045};
  for (Capabilities const& record : {known, driver}) {
    CAPTURE(record.max_stiffness.value);
    double const mass = record.mass, damping = 0.5;
    CHECK(swing<BackwardDifference<double>>(record, {}, mass, damping).late < 1e-6);
    CHECK(swing<WindowedVelocity<double, 8>>(record, {}, mass, damping).late < 1e-6);
    CHECK(swing<AdaptiveWindowVelocity<double>>(record, {}, mass, damping).late < 1e-6);
    CHECK(swing<BackwardDifference<double>>(record, {}, mass, damping, 55e-6).late < 110e-6);   // nothing holds it within a step of the position
    CHECK(swing<WindowedVelocity<double, 8>>(record, {}, mass, damping, 55e-6).late < 110e-6);
    CHECK(swing<AdaptiveWindowVelocity<double>>(record, {}, mass, damping, 55e-6).late < 110e-6);
  }
}

// Energy in time: the hand takes any way; a damper of the bound, b = K T/2 + B, pays for what the held spring and the estimated damper leak, one of half
// of it does not.
TEMPLATE_TEST_CASE("late estimates of the velocity need no more damping of the device than prompt ones", "[haptics]", BackwardDifference<double>,
                   (BackwardDifference<double, 8>), (WindowedVelocity<double, 2>), (WindowedVelocity<double, 8>)) {
  double const stiffness = 800.0, damping = 0.4;
  VirtualCoupling<double> const coupling({.position = {.stiffness = stiffness, .damping = damping}});
  auto const least = [&](double share) {
    Random random(Seed{5});
    double smallest = 0;
    for (int round = 0; round < 60; ++round) {
      TestType velocity;
      DeviceState<double> device;
      velocity(device.position);
      Vector force = Vector::Zero();
      double const bound = share * (stiffness * 1e-3 / 2 + damping), turn = random.uniform(0.01, 3.1);
      double energy = 0;
      for (int k = 0; k < 600; ++k) {
        double const way = 1e-4 * (round % 3 == 0 ? random.normal() : round % 3 == 1 ? std::cos(turn * k) : (k % 2 ? 1.0 : -1.0));
        energy += bound / 1e-3 * way * way - force.x() * way;
        smallest = std::min(smallest, energy);
        device.position.x() += way;
        device.velocity = velocity(device.position);
        force = coupling.between(device, {}).force;
      }
    }
    return smallest;
  };
  CHECK(least(1.0) > -1e-12);
  CHECK(least(0.25) < -1e-6);
}

// Yardstick: free space, through which a tool without weight is led at an even speed by no force. A coupling that took every call for a period pulled with 8 N where
// ticks are five late.
TEST_CASE("late ticks, late samples and early ticks do not shake a coupled tool", "[haptics]") {
  enum class Late { tick, sample, early };
  auto const largest = [](Late what, int n) {   // N, in the second half of two seconds
    CoupledForce<ProxyForce<double>> force(stiff_proxy(400.0));
    force.begin_session(Capabilities{.max_force = 3.3, .rate = 1000.0, .max_stiffness = 500.0, .max_damping = 3.0, .mass = 0.045}, WorkspaceMapping<double>{}, 1000.0);
    auto const local = coupled_plane(400.0);
    Vector told(0, 0, 0.01);
    double most = 0.0, last = 0.0;
    int ticks = 0;
    for (int k = 0; k < 20000; ++k) {   // steps of 0.1 ms
      double const now = 1e-4 * k;
      bool const calls = what == Late::early ? k % (10 / n) == 0 : what == Late::sample ? k % 10 == 0 : k % 200 == 0 || (k % 200 >= 10 * n && k % 10 == 0);   // late once in 20 ms
      if (!calls) continue;
      bool const fresh = what != Late::sample || ticks++ % n == 0;
      if (fresh) told.x() = 0.2 * now;
      Vector const felt = force.on_surface(local, {.tip = told, .seconds = k == 0 ? 1e-3 : now - last, .continues = true, .fresh = fresh});
      last = now;
      if (k > 10000) most = std::max(most, felt.norm());
    }
    return most;
  };
  double const even = largest(Late::tick, 1);
  CHECK(even < 0.01);
  for (Late const what : {Late::tick, Late::sample, Late::early})
    for (int const n : {2, 5}) {
      CAPTURE(static_cast<int>(what), n);
      CHECK(largest(what, n) < even + 0.02);
    }
}

TEST_CASE("a tick of a coupled force allocates nothing, and a tip that is no number is let go", "[haptics]") {
  CoupledForce force(stiff_proxy(1000.0), {.stiffness = 400.0});
  force.begin_session(1000.0, 500.0);
  auto const local = coupled_plane(1000.0);
  palpate_test::AllocationCount const allocations;
  for (int k = 0; k < 100; ++k) force.on_surface(local, {.tip = {0, 0, -1e-5 * k}, .continues = true});
  long const counted = allocations.count();
  CHECK(counted == 0);
  double const nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(force.on_surface(local, {.tip = {0, nan, 0}, .continues = true}).isZero(0));
  CHECK(force.on_surface(local, {.tip = {0, 0, 0.01}, .continues = true}).isZero(0));
}
