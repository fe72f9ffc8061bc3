// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/body/shape_of.hpp>
#include <palpate/core/error.hpp>
#include <palpate/cutting/blade_edge.hpp>
#include <palpate/cutting/concept.hpp>
#include <palpate/cutting/cut_front.hpp>
#include <palpate/cutting/detail/blade.hpp>
#include <palpate/tissue/concept.hpp>

#include <array>
#include <cmath>
#include <concepts>
#include <limits>
#include <optional>
#include <vector>

namespace palpate {

/// When a progressive cutter punctures, and how near to a vertex or edge its path snaps there.
template <RealScalar Scalar>
struct ProgressiveCutterOptions {
  Scalar puncture_depth = Scalar(0.005);                              ///< m below the undisturbed surface
  Scalar puncture_force = std::numeric_limits<Scalar>::infinity();    ///< N, of the tool on the tissue
  std::optional<Scalar> snap = {};                                    ///< m, in the undeformed shape; a fifth of the edge in question if not given
  Scalar tip_radius = 0;                                              ///< m
  int crossings_per_tick = 100;                                       ///< edges that a tick cuts across at most; the rest follows in the next
  std::optional<BladeEdge<Scalar>> edge = {};                         ///< the way the blade cuts; every way if not given
};

/// A scalpel: it presses, punctures, and cuts the surface along the tip's path, triangle by triangle, until it is lifted.
///
///   ProgressiveCutter<double> scalpel({.puncture_depth = 0.006, .snap = 5e-4});
///   scalpel.advance(body, tip);   // once a tick; the body is stepped by the host
///
/// While the tip is inside a triangle, the triangle is divided for the eye around a temporary particle that follows the tip, and the
/// wound is open up to where the tip entered it; when the tip leaves, the path through the triangle becomes permanent, a straight
/// line. The triangle is found by walking in the undeformed shape along the plane through the last and the present touched point and
/// their mean normal: the same path in material coordinates cuts the same way however the body moves.
/// A tick cuts across `crossings_per_tick` edges at most, so that it ends in time however fast the tip is. Where the way has more, the cut is_behind():
/// the ticks that follow bring it to where the tip was, along the same way, and then on to where the tip is. It goes on also when the tip has left
/// the surface: state() is no_contact then, report() and lips() still change, the next puncture waits for its end, and the cutter still belongs to this
/// body. A program that moves the tip in leaps and not in ticks allows more.
/// Once punctured, cutting goes on until the tip leaves the surface. A stroke that comes to a border or an earlier wound opens it there, and goes
/// on from the other side when the tip is on the surface beyond. Masses are evened out after each tick; see MassExchange.
/// A body that is restored under the blade is a new one to it: the cut that was in progress is gone with the state it was in, its report
/// and lips are empty, and the tip has to come from outside again.
/// Units      m, N.
/// Source     \cite zheng2006 ch. 3.
/// Invariant  after every tick: a valid mesh, the mass and the rest area unchanged.
/// Cost       a tick is O(triangles crossed), and wounds on the way cost more; docs/cutting.md has times. It allocates when the body outgrows what was
///            reserved.
/// Limits     only surfaces. Where another blade comes to a triangle beside, what divided the triangle for the eye stays; see docs/cutting.md.
template <RealScalar Scalar>
class ProgressiveCutter {
 public:
  using Vector = Vector3<Scalar>;

  explicit ProgressiveCutter(ProgressiveCutterOptions<Scalar> const& options = {})
      : blade_(options.puncture_depth, options.puncture_force, options.tip_radius, options.edge), snap_(options.snap), crossings_per_tick_(options.crossings_per_tick) {
    if (snap_ && !(*snap_ >= 0 && std::isfinite(*snap_)))
      throw InvalidArgument(detail::message("snap is ", *snap_, " m; it must be finite and not negative"));
    if (crossings_per_tick_ < 1)
      throw InvalidArgument(detail::message("crossings_per_tick is ", crossings_per_tick_, "; it must be at least 1"));
  }

  /// Moves the tool by one tick; `force` is what it presses the tissue with [N], for puncture_force. The blade's edge turns with the tool.
  /// Throws InvalidArgument for a pose that is not finite, or a body that can not be cut; then nothing has changed.
  template <class Body>
  void advance(Body& body, ToolPose<Scalar> const& tool, Scalar force = 0) {
    if constexpr (detail::can_act_on<Body>()) {
      constexpr bool can_be_cut = CuttableTissue<typename detail::TissueOf<Body>::type>, is_of_scalar = std::same_as<Scalar, typename Body::Scalar>;
      static_assert(can_be_cut,
                    "ProgressiveCutter: this tissue can not be cut; it lacks the ability CuttableTissue: int insert_in_triangle(int triangle, Vector3<Scalar> const& weights), int "
                    "split_particle(int particle, std::span<int const> triangles) and the others in palpate/tissue/concept.hpp. MassSpring has it. VolumeCutter cuts solids.");
      static_assert(is_of_scalar, "ProgressiveCutter: the cutter computes in another scalar than the body; advance(body, tool) takes a body of its own.");
      if constexpr (can_be_cut && is_of_scalar) cut(detail::shape_of(body), tool, force);
    }
  }
  /// The same for the tip [m] of a tool that is not turned.
  template <class Body>
  void advance(Body& body, detail::TipPosition<Scalar> const& tip, Scalar force = 0) {
    advance(body, tip.pose(), force);
  }

  /// Takes the tool away: a cut in progress ends where the blade is, or where it has come to if it is behind, and the tip has to come from
  /// outside again.
  template <class Body>
  void reset(Body& body) {
    if constexpr (CuttableTissue<typename Body::Tissue>) blade_.reset(detail::shape_of(body));   // of another body advance() speaks
  }

  /// Turns the blade's edge in the tool: its direction in the tool's frame, of any length. A point gets an edge by that.
  void turn_edge(Vector const& axis) { blade_.turn(axis); }

  CuttingPhase state() const noexcept { return blade_.state(); }
  /// The cut has not yet come to where the tip was, see crossings_per_tick.
  bool is_behind() const noexcept { return blade_.is_behind(); }
  CutReport const& report() const noexcept { return blade_.front().report(); }
  SurfaceContact<Scalar> const& contact() const noexcept { return blade_.contact(); }
  Scalar tip_radius() const noexcept { return blade_.tip_radius(); }
  /// What the blade drags along while it is moved across its edge; nothing while it cuts.
  template <class Body>
  std::optional<BladeHold<Scalar>> held(Body const& body) const noexcept {
    if constexpr (CuttableTissue<typename detail::TissueOf<Body>::type>)
      return blade_.held(detail::shape_of(body));
    else
      return {};   // of such a body advance() speaks
  }
  /// Particles that were one before the current or last cut: the two lips of the wound, pair by pair.
  std::vector<std::array<int, 2>> const& lips() const noexcept { return blade_.front().lips(); }

 private:
  template <class Shape>
  void cut(Shape& body, ToolPose<Scalar> const& tool, Scalar force) {
    using Front = CutFront<Scalar>;
    using Contact = SurfaceContact<Scalar>;
    using Snapping = detail::Snapping<Scalar>;
    auto const start = [&](Front& front, Contact const& contact) {
      front.start(body, contact.triangle, contact.barycentric, snap_ ? Snapping(*snap_) : Snapping(0, Scalar(0.2)), crossings_per_tick_);
      return front.triangle(body);
    };
    auto const go_on = [&](Front& front, Contact const& contact) {
      if (contact.off_surface) return -1;
      front.advance(body, contact.triangle, contact.barycentric);
      return front.triangle(body);
    };
    blade_.advance(body, tool, force, start, go_on);
  }

  detail::Blade<Scalar, CutFront<Scalar>> blade_;
  std::optional<Scalar> snap_;
  int crossings_per_tick_;
};

}  // namespace palpate
