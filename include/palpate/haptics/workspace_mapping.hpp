// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/similarity.hpp>
#include <palpate/device/capabilities.hpp>

#include <cmath>

namespace palpate {

/// The way from a device to the scene through the frames between, each one similarity: where the camera is, where in the picture the hand works, how the
/// device's workspace lies in that.
///   world ← view ← touch ← workspace
/// Source     \cite zheng2006; the names are those of the OpenHaptics toolkit.
template <RealScalar S>
struct FrameChain {
  Similarity<S> world_from_view{};       ///< where the camera stands
  Similarity<S> view_from_touch{};       ///< where in the picture the hand works
  Similarity<S> touch_from_workspace{};  ///< the device's frame in that

  Similarity<S> world_from_workspace() const noexcept { return world_from_view * view_from_touch * touch_from_workspace; }
};

/// Carries the hand from the device's frame into the scene, and forces back.
///   p_w = s R p_d + t,   v_w = s R v_d,   ω_w = R ω_d,   F_d = κ Rᵀ F_w,   τ_d = (κ/s) Rᵀ τ_w
/// so F_d·v_d + τ_d·ω_d = (κ/s) (F_w·v_w + τ_w·ω_w). Lever arms are s times as long in the scene, hence the torque's factor κ/s.
/// With κ = s, the default, the hand does the work that the tissue takes, to the last digit. The hand feels a stiffness K of the scene as κ s K: a scene
/// enlarged tenfold is felt a hundred times as stiff, so `felt_stiffness` is what has to be within the device's limits.
/// Clutch     while it is open the tip stays where it is and the hand moves freely; closing it moves the offset, so neither tip nor
///            force jumps. The servo loop fades the force out around it.
/// Units      m, N, N·m; κ a number.
/// Cost       noexcept, no allocation: allowed in the servo tick; set-up checks and throws.
template <RealScalar S>
class WorkspaceMapping {
 public:
  using Scalar = S;

  /// The device's frame is the world's.
  WorkspaceMapping() = default;
  explicit WorkspaceMapping(Similarity<S> const& world_from_device) : world_from_device_(world_from_device), force_scale_(world_from_device.scale()) {}
  /// With a force scale κ of its own: the hand's work and the tissue's then differ by κ/s.
  WorkspaceMapping(Similarity<S> const& world_from_device, S force_scale) : world_from_device_(world_from_device), force_scale_(force_scale) {
    if (!(force_scale > S(0)) || !std::isfinite(force_scale))
      throw InvalidArgument(detail::message("WorkspaceMapping: the force scale is ", force_scale, "; give a finite number above zero, or none for the scale of lengths"));
  }

  /// The device's box around a box of the scene, centre on centre, scaled alike on all axes so that the whole of the scene's box can be
  /// reached; `turn` says how the device is turned in the world.
  /// Throws `InvalidArgument` for an unknown workspace, a box without size, or a turn that is none.
  static WorkspaceMapping fit_box(DeviceWorkspace const& workspace, Vector3<S> const& lower, Vector3<S> const& upper,
                                  Eigen::Quaternion<S> const& turn = Eigen::Quaternion<S>::Identity()) {
    Vector3<S> const size = upper - lower;
    if (!workspace.known()) throw InvalidArgument("WorkspaceMapping::fit_box: the device does not know its workspace; give capabilities().workspace a box");
    if (!is_finite(size) || !(size.array() > S(0)).all())
      throw InvalidArgument(detail::message("WorkspaceMapping::fit_box: the scene's box is (", size.x(), ", ", size.y(), ", ", size.z(), ") m large; give a lower and an upper corner"));
    if (!is_finite(Vector3<S>(turn.vec())) || !std::isfinite(turn.w()) || !(turn.norm() > S(0)))
      throw InvalidArgument(detail::message("WorkspaceMapping::fit_box: the turn is (", turn.w(), "; ", turn.x(), ", ", turn.y(), ", ", turn.z(), "); give a quaternion of some length"));
    Matrix<S, 3, 3> const back = turn.normalized().toRotationMatrix().transpose().cwiseAbs();   // a box of the world fills one of the device's axes of this size
    S const scale = ((back * size).array() / workspace.size().template cast<S>().array()).maxCoeff();
    Similarity<S> const centred = Similarity<S>::make(scale, turn, Vector3<S>::Zero());
    Vector3<S> const offset = (lower + upper) / S(2) - centred.point(workspace.centre().template cast<S>());
    return WorkspaceMapping(centred.moved(offset));
  }

  Vector3<S> to_world(Vector3<S> const& device_point) const noexcept { return world_from_device_.point(device_point); }
  Vector3<S> velocity_to_world(Vector3<S> const& device_velocity) const noexcept { return world_from_device_.vector(device_velocity); }
  Eigen::Quaternion<S> orientation_to_world(Eigen::Quaternion<S> const& device_from_tool) const noexcept { return world_from_device_.orientation(device_from_tool); }
  Vector3<S> force_to_device(Vector3<S> const& world_force) const noexcept { return force_scale_ * world_from_device_.direction_back(world_force); }
  /// N·m, about the tip in both frames.
  Vector3<S> torque_to_device(Vector3<S> const& world_torque) const noexcept {
    return force_scale_ / world_from_device_.scale() * world_from_device_.direction_back(world_torque);
  }
  Vector3<S> force_to_world(Vector3<S> const& device_force) const noexcept { return world_from_device_.direction(device_force) / force_scale_; }
  Vector3<S> torque_to_world(Vector3<S> const& device_torque) const noexcept {
    return world_from_device_.scale() / force_scale_ * world_from_device_.direction(device_torque);
  }

  /// N/m, what the hand feels of a stiffness in the scene.
  S felt_stiffness(S scene_stiffness) const noexcept { return force_scale_ * world_from_device_.scale() * scene_stiffness; }
  /// N/m, the stiffest that the scene may be for a device that holds so much.
  S scene_stiffness(S felt) const noexcept { return felt / (force_scale_ * world_from_device_.scale()); }

  /// Opens the clutch at this position of the device: the tip stays.
  void open_clutch(Vector3<S> const& device_point) noexcept {
    if (!clutch_open_) held_ = to_world(device_point);
    clutch_open_ = true;
  }
  /// Closes it: from here the tip moves on with the hand.
  void close_clutch(Vector3<S> const& device_point) noexcept {
    if (!clutch_open_) return;
    world_from_device_ = world_from_device_.moved(held_ - to_world(device_point));
    clutch_open_ = false;
  }
  bool clutch_open() const noexcept { return clutch_open_; }
  /// Where the tip is while the clutch is open.
  Vector3<S> const& held() const noexcept { return held_; }

  /// The same in another scalar, its clutch closed.
  template <RealScalar T>
  WorkspaceMapping<T> cast() const {
    return WorkspaceMapping<T>(world_from_device_.template cast<T>(), static_cast<T>(force_scale_));
  }

  Similarity<S> const& world_from_device() const noexcept { return world_from_device_; }
  S force_scale() const noexcept { return force_scale_; }

 private:
  Similarity<S> world_from_device_{};
  S force_scale_ = S(1);
  bool clutch_open_ = false;
  Vector3<S> held_ = Vector3<S>::Zero();
};

}  // namespace palpate
