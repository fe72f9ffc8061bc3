// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/tool/tool_shape.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

namespace palpate {

namespace detail {

template <RealScalar Scalar>
ToolShape<Scalar> drawn_shape(std::vector<ToolRod<Scalar>> rods) {
  ToolShape<Scalar> shape{.picture = rods_picture(rods), .rods = std::move(rods)};
  shape.validate();
  return shape;
}

}  // namespace detail

/// A straight blunt rod. Its tip is the centre of the ball at its end.
struct ProbeShape {
  double radius = 0.002;   ///< m
  double length = 0.1;     ///< m
};
template <RealScalar Scalar>
ToolShape<Scalar> make_probe_shape(ProbeShape const& of = {}) {
  detail::require_positive("ProbeShape: .radius", of.radius, "m"), detail::require_positive("ProbeShape: .length", of.length, "m");
  return detail::drawn_shape<Scalar>({{.rod = {.to = {0, 0, Scalar(of.length)}, .radius = Scalar(of.radius)}}});
}

/// A rod whose end is bent. The point goes from the bend down to the tip; the shaft leaves the bend at an angle from the point's own line, in the plane of y
/// and z. As it is it points down, −z; turned by a right angle about y the point lies flat.
struct HookShape {
  double radius = 0.001;                   ///< m
  double point = 0.008;                    ///< m, from the bend to the tip
  double shaft = 0.1;                      ///< m
  double bend = std::numbers::pi / 3;      ///< rad, 0: straight
};
/// Rod 0 is the point, from the tip to the bend, rod 1 the shaft.
template <RealScalar Scalar>
ToolShape<Scalar> make_hook_shape(HookShape const& of = {}) {
  detail::require_positive("HookShape: .radius", of.radius, "m"), detail::require_positive("HookShape: .point", of.point, "m");
  detail::require_positive("HookShape: .shaft", of.shaft, "m");
  if (!(of.bend >= 0 && of.bend < std::numbers::pi)) throw InvalidArgument(detail::message("HookShape: .bend is ", of.bend, " rad; give 0 or more, below pi"));
  Vector3<Scalar> const bend(0, 0, Scalar(of.point)), hand = bend + Scalar(of.shaft) * Vector3<Scalar>(0, Scalar(std::sin(of.bend)), Scalar(std::cos(of.bend)));
  return detail::drawn_shape<Scalar>({{.rod = {.to = bend, .radius = Scalar(of.radius)}}, {.rod = {.from = bend, .to = hand, .radius = Scalar(of.radius)}}});
}

/// A blade whose edge rises from the tip in the plane of x and z, and a blunt handle that begins at the edge's end.
struct ScalpelShape {
  double edge = 0.02;                     ///< m
  double angle = std::numbers::pi / 6;    ///< rad, of the edge over x
  double radius = 0.003;                  ///< m, of the handle
  double length = 0.12;                   ///< m, of the handle
};
/// Rod 0 is the edge, which cuts, rod 1 the handle.
template <RealScalar Scalar>
ToolShape<Scalar> make_scalpel_shape(ScalpelShape const& of = {}) {
  detail::require_positive("ScalpelShape: .edge", of.edge, "m"), detail::require_positive("ScalpelShape: .radius", of.radius, "m");
  detail::require_positive("ScalpelShape: .length", of.length, "m");
  if (!(of.angle > 0 && of.angle <= std::numbers::pi / 2))
    throw InvalidArgument(detail::message("ScalpelShape: .angle is ", of.angle, " rad; give one above 0, at most pi/2"));
  Vector3<Scalar> const heel(Scalar(of.edge * std::cos(of.angle)), 0, Scalar(of.edge * std::sin(of.angle)));
  return detail::drawn_shape<Scalar>({{.rod = {.to = heel}, .use = RodUse::cutting},
                                      {.rod = {.from = heel, .to = heel + Vector3<Scalar>(0, 0, Scalar(of.length)), .radius = Scalar(of.radius)}}});
}

/// Two jaws that part at a joint over the tip, in the plane of x and z, and a shaft above it.
struct ForcepsShape {
  double opening = 0.01;    ///< m, between the axes of the jaws' ends; at most twice their length
  double jaw = 0.02;        ///< m
  double radius = 0.001;    ///< m, of a jaw
  double shaft = 0.1;       ///< m
};
/// Rods 0 and 1 are the jaws, at −x and +x, each from its end to the joint; rod 2 is the shaft. The tip is in the middle between the jaws' ends. Closed, the
/// ends touch.
template <RealScalar Scalar>
ToolShape<Scalar> make_forceps_shape(ForcepsShape const& of = {}) {
  detail::require_positive("ForcepsShape: .jaw", of.jaw, "m"), detail::require_positive("ForcepsShape: .radius", of.radius, "m");
  detail::require_positive("ForcepsShape: .shaft", of.shaft, "m");
  if (!(of.opening >= 0 && of.opening < 2 * of.jaw))
    throw InvalidArgument(detail::message("ForcepsShape: .opening is ", of.opening, " m; give 0 or more, below twice .jaw, which is ", of.jaw));
  double const half = of.opening / 2;
  Scalar const x = Scalar(half), r = Scalar(of.radius);
  Vector3<Scalar> const joint(0, 0, Scalar(std::sqrt(of.jaw * of.jaw - half * half)));
  Vector3<Scalar> const closing(x - std::min(x, r), 0, 0), joint_stays = Vector3<Scalar>::Zero();
  return detail::drawn_shape<Scalar>({{.rod = {.from = {-x, 0, 0}, .to = joint, .radius = r}, .closing = {closing, joint_stays}},
                                      {.rod = {.from = {x, 0, 0}, .to = joint, .radius = r}, .closing = {-closing, joint_stays}},
                                      {.rod = {.from = joint, .to = joint + Vector3<Scalar>(0, 0, Scalar(of.shaft)), .radius = 2 * r}}});
}

}  // namespace palpate
