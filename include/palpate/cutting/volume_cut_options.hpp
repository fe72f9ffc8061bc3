// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/units.hpp>

#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <string_view>
#include <vector>

namespace palpate {

/// A straight cutting edge of a blade, from one end to the other [m, world].
template <RealScalar Scalar>
struct BladeSegment {
  Vector3<Scalar> from = Vector3<Scalar>::Zero(), to = Vector3<Scalar>::Zero();
};

namespace detail {

/// Throws InvalidArgument where a piece of a blade has no length.
template <RealScalar Scalar>
void require_pieces(std::string_view blade, std::span<Vector3<Scalar> const> points, std::string_view unit) {
  for (std::size_t k = 1; k < points.size(); ++k)
    if (Vector3<Scalar> const& p = points[k]; p == points[k - 1])
      throw InvalidArgument(message("VolumeCutter: ", blade, " has no length from point ", k - 1, " to point ", k, ": both are (", p[0], ", ", p[1], ", ", p[2], ") ",
                                    unit, "; give it two different ends, or leave one of the points out"));
}

}  // namespace detail

/// How a VolumeCutter cuts.
template <RealScalar Scalar>
struct VolumeCutOptions {
  /// m, the cutting edge in the tool's frame, from point to point; the tool's tip is the origin.
  std::vector<Vector3<Scalar>> edge = {Vector3<Scalar>::Zero(), Vector3<Scalar>(0, 0, Scalar(0.03))};
  Scalar puncture_depth = 0;     ///< m: how deep below the skin the blade has to be before it cuts
  Scalar puncture_force = std::numeric_limits<Scalar>::infinity();   ///< N, of the tool on the tissue: it cuts from there, too
  Scalar toughness = 0;          ///< Gc [J/m²]: what a new area costs the hand, in tight coupling. Bovine liver: 164 \cite gokgol2012
  Scalar lip_friction = 0;       ///< N per m of blade in the tissue: of the lips, whether it cuts or not
  Scalar blade_stiffness = 1000; ///< N/m, of the tissue that hangs on to the blade; the blade stays behind the tool by force over stiffness
  Scalar tip_radius = 0;         ///< m, of the ball that the tip is while it presses
  Scalar snap = Scalar(0.15);    ///< a crossing of an edge goes to the edge's end where that is nearer than this share of it,
  Scalar min_snap = Scalar(0.05);      ///< or than this share of the mesh's mean edge
  Scalar min_height = Scalar(0.02);    ///< of a tetrahedron that a cut makes, in mean edges; a crossing that would make a lower one goes to an end
  int max_tetrahedra = 1000;            ///< that a tick may make, about; the blade follows in the next ones
  int debris = 0;                        ///< where a stroke ends, cut-off pieces of fewer tetrahedra than that go, if nothing holds them; 0: none does

  void validate() const {
    if (edge.size() < 2) throw InvalidArgument(detail::message("VolumeCutter: an edge of ", edge.size(), " points; it takes at least two"));
    for (std::size_t k = 0; k < edge.size(); ++k)
      if (!is_finite(edge[k])) detail::require_finite(detail::message("VolumeCutter: point ", k, " of the edge"), edge[k], "m in the tool's frame");
    detail::require_pieces("the edge", std::span<Vector3<Scalar> const>(edge), "m in the tool's frame");
    detail::require_non_negative("VolumeCutter: the puncture depth", puncture_depth, "m");
    require_length("VolumeCutter: the puncture depth", static_cast<double>(puncture_depth), puncture_depth_range);
    if (!(puncture_force > 0)) throw InvalidArgument(detail::message("VolumeCutter: the puncture force is ", puncture_force, " N; it must be positive"));
    detail::require_non_negative("VolumeCutter: the toughness", toughness, "J/m2");
    detail::require_non_negative("VolumeCutter: the friction of the lips", lip_friction, "N/m");
    detail::require_positive("VolumeCutter: the blade stiffness", blade_stiffness, "N/m");
    if (!(snap >= 0 && snap < Scalar(0.5))) throw InvalidArgument(detail::message("VolumeCutter: snap is ", snap, "; it must be from 0 to below 0.5 of an edge"));
    if (!(min_snap >= 0 && min_snap < Scalar(0.5)))
      throw InvalidArgument(detail::message("VolumeCutter: min_snap is ", min_snap, "; it must be from 0 to below 0.5 mean edges"));
    if (!(min_height >= 0 && min_height < Scalar(0.5)))
      throw InvalidArgument(detail::message("VolumeCutter: min_height is ", min_height, "; it must be from 0 to below 0.5 mean edges"));
    if (max_tetrahedra < 1) throw InvalidArgument(detail::message("VolumeCutter: max_tetrahedra is ", max_tetrahedra, "; it must be at least 1"));
    if (debris < 0) throw InvalidArgument(detail::message("VolumeCutter: debris is ", debris, "; it must not be negative"));
  }
};

}  // namespace palpate
