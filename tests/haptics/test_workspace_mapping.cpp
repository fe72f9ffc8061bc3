// SPDX-License-Identifier: MIT
#include "allocation_trap.hpp"
#include "catch.hpp"

#include <palpate/core/random.hpp>
#include <palpate/haptics/workspace_mapping.hpp>

#include <cmath>
#include <limits>

using namespace palpate;

namespace {

template <class S>
WorkspaceMapping<S> any_mapping(Random& random) {
  Eigen::Quaternion<S> const turn(random.normal<S>(), random.normal<S>(), random.normal<S>(), random.normal<S>());
  return WorkspaceMapping<S>(Similarity<S>::make(std::exp(random.normal<S>()), turn, {random.normal<S>(), random.normal<S>(), random.normal<S>()}));
}

template <class S>
Vector3<S> any_arrow(Random& random) {
  return {random.normal<S>(), random.normal<S>(), random.normal<S>()};
}

}  // namespace

// Closed forms: power on both sides, and the stiffness that the hand feels from a spring fixed in the scene.
TEMPLATE_TEST_CASE("C10-M2: the hand does the work that the scene takes, and feels its stiffness times the square of the scale", "[haptics][workspace_mapping]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Random random(Seed{11});
  S const tolerance = std::numeric_limits<S>::epsilon() * S(100);
  for (int trial = 0; trial < 200; ++trial) {
    auto const exact = any_mapping<S>(random);
    S const kappa = std::exp(random.normal<S>());
    WorkspaceMapping<S> const scaled(exact.world_from_device(), kappa);
    Vector3<S> const v = any_arrow<S>(random), force = any_arrow<S>(random);
    S const s = exact.world_from_device().scale(), power = force.dot(exact.velocity_to_world(v)), size = s * force.norm() * v.norm();
    CHECK(std::abs(exact.force_to_device(force).dot(v) - power) <= tolerance * size);
    CHECK(std::abs(scaled.force_to_device(force).dot(v) - kappa / s * power) <= tolerance * kappa / s * size);
    CHECK((scaled.force_to_world(scaled.force_to_device(force)) - force).norm() <= tolerance * force.norm());
    S const k = S(300);   // N/m, a spring in the scene
    Vector3<S> const moved = v * S(0.1);
    Vector3<S> const felt = scaled.force_to_device(k * scaled.velocity_to_world(moved));
    CHECK(std::abs(felt.norm() - scaled.felt_stiffness(k) * moved.norm()) <= tolerance * felt.norm());
    CHECK(std::abs(scaled.scene_stiffness(scaled.felt_stiffness(k)) - k) <= tolerance * k);
  }
}

// Yardsticks: the torque of the mapped force on the mapped lever arm, and the power of a screw motion on both sides. Each s and κ by itself, and s = 10, κ = 1,
// where lengths and forces scale differently.
TEMPLATE_TEST_CASE("C10-M7: a torque is scaled by κ/s: by lever arm and by power", "[haptics][workspace_mapping]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Random random(Seed{15});
  S const tolerance = std::numeric_limits<S>::epsilon() * S(100);
  for (int trial = 0; trial < 200; ++trial) {
    bool const enlarged = trial < 100;
    auto const turned = any_mapping<S>(random).world_from_device();
    auto const frame = enlarged ? Similarity<S>::make(S(10), Eigen::Quaternion<S>(turned.rotation()), turned.translation()) : turned;
    S const kappa = enlarged ? S(1) : std::exp(random.normal<S>()), s = frame.scale();
    WorkspaceMapping<S> const mapping(frame, kappa);
    CAPTURE(trial, s, kappa);
    Vector3<S> const arm = any_arrow<S>(random), force = any_arrow<S>(random), v = any_arrow<S>(random), omega = any_arrow<S>(random);
    Vector3<S> const torque = mapping.velocity_to_world(arm).cross(force);   // arm in the device's frame, s R arm in the scene
    Vector3<S> const felt = mapping.torque_to_device(torque);
    CHECK((felt - arm.cross(mapping.force_to_device(force))).norm() <= tolerance * kappa * arm.norm() * force.norm());
    CHECK((mapping.torque_to_world(felt) - torque).norm() <= tolerance * torque.norm());
    S const power = force.dot(mapping.velocity_to_world(v)) + torque.dot(frame.rotation() * omega);
    S const size = s * force.norm() * (v.norm() + arm.norm() * omega.norm());
    CHECK(std::abs(mapping.force_to_device(force).dot(v) + felt.dot(omega) - kappa / s * power) <= tolerance * kappa / s * size);
  }
  // By hand: a force of 2 N on 0.05 m of a scene ten times as large as the hand's: 0.1 N m there, 2 N on 5 mm for the hand.
  WorkspaceMapping<S> const tenfold(Similarity<S>::make(S(10), Eigen::Quaternion<S>::Identity(), Vector3<S>::Zero()), S(1));
  CHECK(double(tenfold.torque_to_device({S(0), S(0), S(0.1)}).z()) == Approx(0.01));
}

TEMPLATE_TEST_CASE("C10-M5: the clutch moves neither tip nor force", "[haptics][workspace_mapping]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Random random(Seed{12});
  auto mapping = any_mapping<S>(random);
  S const scale = mapping.world_from_device().scale();
  Vector3<S> hand = any_arrow<S>(random), force = any_arrow<S>(random);
  for (int again = 0; again < 20; ++again) {
    Vector3<S> const tip = mapping.to_world(hand), felt = mapping.force_to_device(force);
    mapping.open_clutch(hand);
    CHECK(mapping.clutch_open());
    CHECK(mapping.held() == tip);
    hand += any_arrow<S>(random);
    mapping.open_clutch(hand);   // again: it is open already
    CHECK(mapping.held() == tip);
    mapping.close_clutch(hand);
    CHECK_FALSE(mapping.clutch_open());
    S const size = tip.norm() + scale * hand.norm() + mapping.world_from_device().translation().norm();
    CHECK((mapping.to_world(hand) - tip).norm() <= S(8) * std::numeric_limits<S>::epsilon() * size);
    CHECK(mapping.force_to_device(force) == felt);
  }
}

TEST_CASE("the whole of a scene's box can be reached, and one of its sides takes all of the workspace", "[haptics][workspace_mapping]") {
  DeviceWorkspace const touch{.lower = {-0.08, -0.06, -0.035}, .upper = {0.08, 0.06, 0.035}, .provenance = Provenance::datasheet};
  Vector3<double> const lower{-0.1, 0.2, 0.0}, upper{0.1, 0.5, 0.1};
  Eigen::Quaterniond const turn(Eigen::AngleAxisd(1.5707963267948966, Eigen::Vector3d::UnitX()));   // the device's y is the world's z
  auto const mapping = WorkspaceMapping<double>::fit_box(touch, lower, upper, turn);
  // By hand: reach 0.16 × 0.07 × 0.12 m, wanted 0.2 × 0.3 × 0.1: 1.25, 4.2857, 0.8333.
  CHECK(mapping.world_from_device().scale() == Approx(0.3 / 0.07).epsilon(1e-12));
  CHECK((mapping.to_world(touch.centre()) - (lower + upper) / 2).norm() < 1e-15);
  CHECK(mapping.to_world({0, 0, 0.035}).y() == Approx(0.2).epsilon(1e-12));
  for (int corner = 0; corner < 8; ++corner) {
    Vector3<double> const wanted{corner & 1 ? upper.x() : lower.x(), corner & 2 ? upper.y() : lower.y(), corner & 4 ? upper.z() : lower.z()};
    Vector3<double> const at = mapping.world_from_device().inverse().point(wanted);
    CHECK(((at - touch.lower).array() >= -1e-12).all());
    CHECK(((touch.upper - at).array() >= -1e-12).all());
  }
  // However the device is turned, and as long as the quaternion may be; some corner of the scene is on the edge of what can be reached.
  Random random(Seed{15});
  for (int k = 0; k < 200; ++k) {
    Eigen::Quaterniond any(random.normal<double>(), random.normal<double>(), random.normal<double>(), random.normal<double>());
    any.coeffs() *= random.uniform(0.2, 5.0);
    auto const fitted = WorkspaceMapping<double>::fit_box(touch, lower, upper, any).world_from_device().inverse();
    double farthest = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
      Vector3<double> const wanted{corner & 1 ? upper.x() : lower.x(), corner & 2 ? upper.y() : lower.y(), corner & 4 ? upper.z() : lower.z()};
      farthest = std::max(farthest, ((fitted.point(wanted) - touch.centre()).cwiseAbs().array() / (touch.size() / 2).array()).maxCoeff());
    }
    REQUIRE(farthest == Approx(1.0).epsilon(1e-9));
  }
  CHECK_THROWS_WITH(WorkspaceMapping<double>::fit_box(touch, lower, upper, Eigen::Quaterniond(0, 0, 0, 0)), says("fit_box", "the turn is (0; 0, 0, 0)"));
  CHECK_THROWS_AS(WorkspaceMapping<double>::fit_box({}, lower, upper), InvalidArgument);
  CHECK_THROWS_AS(WorkspaceMapping<double>::fit_box(touch, upper, lower), InvalidArgument);
  CHECK_THROWS_AS(WorkspaceMapping<double>({}, 0.0), InvalidArgument);
}

TEST_CASE("frames between device and world multiply in their order", "[haptics][workspace_mapping]") {
  Random random(Seed{13});
  FrameChain<double> const chain{any_mapping<double>(random).world_from_device(), any_mapping<double>(random).world_from_device(), any_mapping<double>(random).world_from_device()};
  Vector3<double> const p = any_arrow<double>(random);
  Vector3<double> const step_by_step = chain.world_from_view.point(chain.view_from_touch.point(chain.touch_from_workspace.point(p)));
  CHECK((chain.world_from_workspace().point(p) - step_by_step).norm() < 1e-13 * (1 + step_by_step.norm()));
}

TEST_CASE("mapping a tick allocates nothing", "[haptics][workspace_mapping]") {
  REQUIRE(palpate_test::trap_works());
  Random random(Seed{14});
  auto mapping = any_mapping<double>(random);
  Vector3<double> p = any_arrow<double>(random), sum = Vector3<double>::Zero();
  palpate_test::AllocationCount const allocations;
  for (int k = 0; k < 100; ++k) {
    mapping.open_clutch(p);
    p *= 0.99;
    mapping.close_clutch(p);
    sum += mapping.force_to_device(mapping.to_world(p));
  }
  long const count = allocations.count();
  CHECK(count == 0);
  CHECK(sum.allFinite());
}
