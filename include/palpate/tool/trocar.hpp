// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/tool_pose.hpp>

#include <Eigen/Geometry>

#include <cmath>
#include <optional>

namespace palpate {

/// A fixed point that the tool's shaft goes through, as in the wall of the belly. It leaves a tool four freedoms: two tilts, the turn about the shaft,
/// the depth.
///   d = (c − p)/|c − p|,   q′ = r q   with r the smallest rotation that takes q a to d
/// The tip stays where it is commanded, p, and the shaft is turned through the point c: so the commanded position gives tilts and depth, the commanded
/// orientation the turn.
/// Units      m; world frame for the point and the poses, the tool's for the shaft's direction a, from tip to hand.
/// Accuracy   the shaft goes through c to a few ε of |c| and |p|.
/// Limits     There is no such pose where the tip is not inside: nearer to c than `min_depth`, or commanded so that c lies ahead of the tip instead of
///            behind it; nor where the depth is above the shaft's `length`.
template <RealScalar Scalar>
struct TrocarOptions {
  Vector3<Scalar> point = Vector3<Scalar>::Zero();    ///< m, c
  Vector3<Scalar> shaft = Vector3<Scalar>::UnitZ();   ///< a, of any length
  Scalar length = Scalar(0.3);                        ///< m, of the shaft
  Scalar min_depth = Scalar(1e-3);                    ///< m, of the tip below the point
  /// World ← tool, commanded where a device reports none: then the shaft leads out of the hole.
  Eigen::Quaternion<Scalar> orientation = Eigen::Quaternion<Scalar>::Identity();

  template <RealScalar T>
  TrocarOptions<T> cast() const {
    return {point.template cast<T>(), shaft.template cast<T>(), static_cast<T>(length), static_cast<T>(min_depth), orientation.template cast<T>()};
  }
};

template <RealScalar Scalar>
class Trocar {
 public:
  explicit Trocar(TrocarOptions<Scalar> const& options = {}) : options_(options) {
    if (!is_finite(options.point)) throw InvalidArgument("Trocar: .point is not finite; give the place of the hole in m");
    Scalar const size = options.shaft.cwiseAbs().maxCoeff();   // its square may be too large or too small for a number
    if (!is_finite(options.shaft) || !(size > 0))
      throw InvalidArgument("Trocar: .shaft must be finite and not zero; give the direction from the tip to the hand");
    detail::require_positive("Trocar: .min_depth", options.min_depth, "m");
    if (!(options.length > options.min_depth) || !std::isfinite(options.length))
      throw InvalidArgument(
          detail::message("Trocar: .length is ", options.length, " m; it must be finite and above .min_depth, which is ", options.min_depth, " m"));
    if (!is_unit(options.orientation)) throw InvalidArgument("Trocar: .orientation is no unit quaternion; give how a tool is turned that no device turns");
    options_.shaft = Vector3<Scalar>(options.shaft / size).normalized();
  }

  TrocarOptions<Scalar> const& options() const noexcept { return options_; }

  /// The pose that the tool takes for a commanded one, or nothing where there is none. noexcept, no allocation: allowed in the servo tick.
  std::optional<ToolPose<Scalar>> find(ToolPose<Scalar> const& commanded) const noexcept {
    Vector3<Scalar> const up = options_.point - commanded.position, shaft = commanded.orientation * options_.shaft;
    Scalar const depth = up.norm();
    // False for what is not finite. The rotation has an axis, since the shaft is less than a right angle off.
    if (!(depth >= options_.min_depth && depth <= options_.length && shaft.dot(up) > 0 && is_unit(commanded.orientation)))
      return std::nullopt;
    ToolPose<Scalar> pose = commanded;
    pose.orientation = turned(shaft, up / depth, commanded.orientation);
    Vector3<Scalar> const off = pose.orientation * options_.shaft;   // rounding of the first rotation, taken back by a second, smaller one
    pose.orientation = turned(off, up / depth, pose.orientation);
    return pose;
  }

  /// The same, with an error that says why there is no pose.
  ToolPose<Scalar> operator()(ToolPose<Scalar> const& commanded) const {
    if (auto const pose = find(commanded)) return *pose;
    Vector3<Scalar> const up = options_.point - commanded.position;
    if (!is_finite(commanded.position) || !is_unit(commanded.orientation))
      throw InvalidArgument("Trocar: the commanded pose is not finite, or its orientation is no unit quaternion");
    Scalar const depth = up.norm();
    if (depth < options_.min_depth)
      throw InvalidArgument(detail::message("Trocar: the tip is ", depth, " m from the fixed point, which gives the shaft no direction; keep it ",
                                            options_.min_depth, " m or more inside"));
    if (depth > options_.length)
      throw InvalidArgument(detail::message("Trocar: the tip is ", depth, " m from the fixed point, and the shaft is ", options_.length,
                                            " m long; give a longer one, or pull the tool back"));
    throw InvalidArgument("Trocar: the fixed point lies ahead of the tip, a right angle or more off the shaft; move the tip inside, or turn the tool");
  }

 private:
  static bool is_unit(Eigen::Quaternion<Scalar> const& q) noexcept { return std::abs(q.norm() - 1) < Scalar(0.01); }   // false for what is not finite
  /// `before`, and then the smallest rotation that takes one unit vector to another, less than half a turn off.
  static Eigen::Quaternion<Scalar> turned(Vector3<Scalar> const& from, Vector3<Scalar> const& to, Eigen::Quaternion<Scalar> const& before) noexcept {
    Vector3<Scalar> const axis = from.cross(to);
    return (Eigen::Quaternion<Scalar>(1 + from.dot(to), axis.x(), axis.y(), axis.z()).normalized() * before).normalized();
  }

  TrocarOptions<Scalar> options_;
};

}  // namespace palpate
