// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/tool_shape.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/units.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace palpate {

/// What a rod of a tool does to the tissue that it meets.
enum class RodUse {
  deforming,   ///< pushes it aside
  cutting      ///< is an edge, for a cutter: it does not push
};

/// One of the rods that a tool collides with: all points within a radius of a segment.
template <RealScalar Scalar>
struct ToolRod {
  Capsule<Scalar> rod = {};   ///< m, in the tool's frame
  RodUse use = RodUse::deforming;
  /// m, of a jaw: the way of its two ends as the jaws close; `rod` is where it is when they are open
  std::array<Vector3<Scalar>, 2> closing = {Vector3<Scalar>::Zero(), Vector3<Scalar>::Zero()};

  /// Where it is with jaws so far open, 0 … 1.
  Capsule<Scalar> at(Scalar opening) const noexcept {
    Scalar const closed = 1 - opening;
    return {.from = rod.from + closed * closing[0], .to = rod.to + closed * closing[1], .radius = rod.radius};
  }
};

/// Which point of a tool stands for all of it where one is asked for: the depth that a force model is told, the recording.
enum class HapticPoint {
  deepest,    ///< of all rods in contact, where one is deepest in the tissue
  averaged,   ///< the mean of all places in contact, weighted by depth
  chosen      ///< the deepest of one rod, ToolShape::chosen, or of all while that one touches nothing; all are felt
};

/// What a tool is, three times: triangles to draw, rods to collide, one haptic point.
/// Frame      the tool's: its origin is the tip, where the device says that the tool is, and the reference point of moments; z points from the tip to the hand.
/// Units      m.
/// Source     \cite bielser2002: graphics, collision (lines, each deforming or cutting), haptics (one point of the colliding lines, chosen or averaged).
/// Invariant  checked by validate(): at least one rod, all of them finite and at most 2 m long, radii of 0 to 0.2 m, above 0 where the rod deforms; triangles of
///            the picture have corners in it; `chosen` is a rod that deforms.
template <RealScalar Scalar>
struct ToolShape {
  TriangleMesh<Scalar> picture = {};            ///< built in, or read from a file; may be empty
  std::vector<ToolRod<Scalar>> rods = {};
  HapticPoint haptic_point = HapticPoint::deepest;
  int chosen = 0;                               ///< the rod that has the haptic point, where that is chosen

  void validate() const {
    auto const refuse = [](auto const&... parts) { throw InvalidArgument(detail::message("ToolShape: ", parts...)); };
    if (rods.empty()) refuse("there is no rod; give at least one, such as {.rod = {.to = {0, 0, 0.05}, .radius = 0.002}}");
    for (std::size_t k = 0; k < rods.size(); ++k) {
      Capsule<Scalar> const& rod = rods[k].rod;
      auto const closed = rods[k].at(0);
      if (!is_finite(rod.from) || !is_finite(rod.to) || !is_finite(closed.from) || !is_finite(closed.to)) refuse("an end of rod ", k, " is not finite; give both in m, in the tool's frame");
      if (!(rod.radius >= 0) || !std::isfinite(rod.radius)) refuse("the radius of rod ", k, " is ", rod.radius, " m; it must be finite and not negative");
      if (double const length = static_cast<double>((rod.to - rod.from).norm()); !tool_length.contains(length))
        refuse("rod ", k, " is ", unlikely_length(length, "m", tool_length), " long; give its ends in m");
      require_length(detail::message("ToolShape: the radius of rod ", k), static_cast<double>(rod.radius), tool_radius);
      if (rods[k].use == RodUse::deforming && !(rod.radius > 0)) refuse("rod ", k, " deforms, and its radius is 0; give it one, or .use = RodUse::cutting");
    }
    for (Eigen::Index t = 0; t < picture.triangles.cols(); ++t)
      for (int k = 0; k < 3; ++k)
        if (int const corner = picture.triangles(k, t); corner < 0 || corner >= picture.points.cols())
          refuse("triangle ", t, " of the picture has corner ", corner, ", but there are ", picture.points.cols(), " points");
    if (!is_finite(picture.points)) refuse("a point of the picture is not finite; repair the mesh first");
    if (haptic_point != HapticPoint::chosen) return;
    if (chosen < 0 || static_cast<std::size_t>(chosen) >= rods.size()) refuse("the haptic point is that of rod ", chosen, ", but there are ", rods.size());
    if (rods[static_cast<std::size_t>(chosen)].use != RodUse::deforming)
      refuse("the haptic point is that of rod ", chosen, ", which cuts; choose one that deforms");
  }
};

/// A closed surface round a rod, to draw: a prism of so many sides, with a pyramid at each end. A rod without radius is drawn 0.2 mm thick.
template <RealScalar Scalar>
TriangleMesh<Scalar> rod_picture(Capsule<Scalar> const& rod, int sides = 12) {
  if (sides < 3) throw InvalidArgument(detail::message("rod_picture: ", sides, " sides; it takes at least 3"));
  using Vector = Vector3<Scalar>;
  Scalar const radius = rod.radius > 0 ? rod.radius : Scalar(1e-4);
  Vector const way = rod.to - rod.from;
  Vector const axis = way.norm() > 0 ? Vector(way.normalized()) : Vector(Vector::UnitZ());
  Vector const u = axis.unitOrthogonal(), v = axis.cross(u);
  TriangleMesh<Scalar> mesh;
  mesh.points.resize(3, 2 * sides + 2);
  mesh.triangles.resize(3, 4 * sides);
  int const bottom = 2 * sides, top = bottom + 1;
  mesh.points.col(bottom) = rod.from - radius * axis, mesh.points.col(top) = rod.to + radius * axis;
  for (int k = 0; k < sides; ++k) {
    Scalar const angle = Scalar(6.28318530717958647692) * Scalar(k) / Scalar(sides);
    Vector const out = radius * (std::cos(angle) * u + std::sin(angle) * v);
    int const next = (k + 1) % sides;
    mesh.points.col(k) = rod.from + out, mesh.points.col(sides + k) = rod.to + out;
    mesh.triangles.col(4 * k) << bottom, next, k;
    mesh.triangles.col(4 * k + 1) << k, next, sides + next;
    mesh.triangles.col(4 * k + 2) << k, sides + next, sides + k;
    mesh.triangles.col(4 * k + 3) << top, sides + k, sides + next;
  }
  return mesh;
}

/// The rods of a tool as one picture, where its jaws are so far open.
template <RealScalar Scalar>
TriangleMesh<Scalar> rods_picture(std::vector<ToolRod<Scalar>> const& rods, int sides = 12, Scalar opening = 1) {
  TriangleMesh<Scalar> all;
  for (auto const& each : rods) {
    TriangleMesh<Scalar> const one = rod_picture(each.at(opening), sides);
    Eigen::Index const points = all.points.cols(), triangles = all.triangles.cols();
    all.points.conservativeResize(3, points + one.points.cols()), all.triangles.conservativeResize(3, triangles + one.triangles.cols());
    all.points.rightCols(one.points.cols()) = one.points;
    all.triangles.rightCols(one.triangles.cols()) = one.triangles.array() + static_cast<int>(points);
  }
  return all;
}

}  // namespace palpate
