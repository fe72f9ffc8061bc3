// SPDX-License-Identifier: MIT
// Yardsticks: a spring and a line by hand, and the slew limit of the safety chain for a device that moves a hand: 0.5 N a tick.
#include <palpate/force/cutting_force.hpp>
#include <palpate/haptics/press_then_cut.hpp>

#include "allocation_trap.hpp"
#include "catch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

using namespace palpate;

namespace {

constexpr double pressed_stiffness = 500.0, cut_stiffness = 100.0;   // N/m

/// The model of a body whose surface is z = 0, that is punctured 3 mm deep and left when the tip comes out.
LocalModel<double> punctured_plane(double z, CuttingPhase before, std::uint64_t sequence) {
  LocalModel<double> local;
  local.phase = before == CuttingPhase::moving ? (z > 0 ? CuttingPhase::no_contact : CuttingPhase::moving)
                : z > 0                        ? CuttingPhase::no_contact
                : z < -0.003                   ? CuttingPhase::moving
                                               : CuttingPhase::indenting;
  local.surface.sequence = sequence;
  if (local.phase != CuttingPhase::moving && z < 0.005) {
    local.surface.patch.stiffness = pressed_stiffness;
    local.surface.planes.try_add({Vector3<double>::UnitZ(), 0.0});
  }
  return local;
}

}  // namespace

TEST_CASE("a force that presses 1.5 N passes over into that of the cut, and out of it, within the slew limit", "[haptics]") {
  for (SurfaceKind const kind : {SurfaceKind::plane, SurfaceKind::ball, SurfaceKind::facets})
    for (int const every : {1, 2, 3, 5, 33}) {
      ProxyForceOptions const options{.surface = kind, .max_stiffness = pressed_stiffness};
      ProxyForce<double> alone(options);
      PressThenCut both(alone, [](double depth) noexcept { return cut_stiffness * depth; });
      alone.begin_session(1000.0, 1000.0 / every);
      both.begin_session(1000.0, 1000.0 / every);
      LocalModel<double> local;
      Vector3<double> felt = Vector3<double>::Zero(), joined = felt;
      double step = 0, joined_step = 0, most = 0;
      CAPTURE(static_cast<int>(kind), every);
      for (int k = 0; k < 600; ++k) {
        double const z = k < 300 ? 0.003 - 5e-5 * std::min(k, 200) : -0.007 + 5e-5 * (k - 300), speed = k < 200 ? -0.05 : k < 300 ? 0.0 : 0.05;   // 7 mm deep, and out
        if (k % every == 0) local = punctured_plane(z, local.phase, static_cast<std::uint64_t>(1 + k / every));
        ToolMotion<double> const motion{.tip = {0, 0, z}, .velocity = {0, 0, speed}, .continues = true};
        Vector3<double> const now = alone.on_surface(local, motion), also = both.on_surface(local, motion);
        step = std::max(step, (now - felt).norm());
        joined_step = std::max(joined_step, (also - joined).norm());
        most = std::max(most, now.norm());
        if (local.phase != CuttingPhase::moving) CHECK(also == now);
        if (k == 115 && every == 1) CHECK(now.z() == Approx(500.0 * 0.00275));
        if (k > 250 && k < 300) {
          CHECK(now.isZero(0));
          CHECK(also.z() == Approx(0.7));
        }
        felt = now;
        joined = also;
      }
      CHECK(most >= 1.45);   // what it would lose at once
      CHECK(step < 0.5);
      CHECK(joined_step < 0.5);
      CHECK(felt.isZero(0));
      CHECK(joined.isZero(0));
    }
}

TEST_CASE("a surface that comes back while its force still fades is not felt twice", "[haptics]") {
  for (auto const kind : {SurfaceKind::plane, SurfaceKind::facets}) {
    ProxyForce<double> force({.surface = kind});
    force.begin_session(1000.0, 1000.0);
    double before = 0.0;
    for (int k = 1; k < 24; ++k) {
      LocalModel<double> model;
      model.phase = CuttingPhase::indenting;
      model.surface.sequence = static_cast<std::uint64_t>(k);
      model.surface.patch.stiffness = k == 10 ? 0.0 : 500.0;
      if (k != 10) model.surface.planes.try_add({});
      double const felt = force.on_surface(model, {.tip = {0, 0, k < 3 ? 0.001 : -0.002}}).z();
      CHECK(felt <= 1.0 + 1e-12);   // 500 N/m · 2 mm
      if (k > 3) CHECK(std::abs(felt - before) <= 0.3);   // 1.5 F Δt/release
      before = felt;
    }
    CHECK(before == Approx(1.0));
  }
}

TEST_CASE("without a release a proxy's force goes with the surface, and the longest step of a longer one is smaller", "[haptics]") {
  auto const step = [](double release) {
    ProxyForce<double> force({.surface = SurfaceKind::plane, .release = release});
    force.begin_session(1000.0, 1000.0);
    ToolMotion<double> const motion{.tip = {0, 0, -0.002}};
    Vector3<double> before = force.on_surface(punctured_plane(-0.002, CuttingPhase::no_contact, 1), motion);
    before = force.on_surface(punctured_plane(-0.002, CuttingPhase::no_contact, 2), motion);
    CHECK(before.z() == Approx(1.0));
    double most = 0;
    for (int k = 0; k < 50; ++k) {
      Vector3<double> const now = force.on_surface(punctured_plane(-0.002, CuttingPhase::moving, static_cast<std::uint64_t>(3 + k)), motion);
      most = std::max(most, (now - before).norm());
      before = now;
    }
    CHECK(before.isZero(0));
    return most;
  };
  CHECK(step(0.0) == Approx(1.0));
  CHECK(step(0.005) == Approx(0.296));   // by hand: s(0.6) − s(0.4), s(t) = t² (3 − 2 t)
  CHECK(step(0.02) < 1.5 * 0.001 / 0.02);
  using Force = ProxyForce<double>;
  CHECK_THROWS_WITH(Force({.release = -1.0}), says(".release is -1 s", "zero or more"));
  CHECK_THROWS_AS(Force({.release = std::numeric_limits<double>::quiet_NaN()}), InvalidArgument);
}

TEST_CASE("a tick of pressing and cutting allocates nothing", "[haptics]") {
  PressThenCut force(ProxyForce<double>({.surface = SurfaceKind::facets}), [](double depth) noexcept { return cut_stiffness * depth; });
  LocalModel<double> local;
  palpate_test::AllocationCount const allocations;
  for (int k = 0; k < 200; ++k) {
    double const z = 0.003 - 5e-5 * k;
    local = punctured_plane(z, local.phase, static_cast<std::uint64_t>(1 + k));
    force.on_surface(local, {.tip = {0, 0, z}});
  }
  long const counted = allocations.count();
  CHECK(counted == 0);
}
