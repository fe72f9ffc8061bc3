// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/body/shape_of.hpp>
#include <palpate/core/error.hpp>
#include <palpate/cutting/blade_edge.hpp>
#include <palpate/cutting/concept.hpp>
#include <palpate/cutting/detail/blade.hpp>
#include <palpate/cutting/detail/separating_front.hpp>
#include <palpate/tissue/concept.hpp>

#include <array>
#include <concepts>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

namespace palpate {

/// When a separating cutter punctures.
template <RealScalar Scalar>
struct SeparatingCutterOptions {
  Scalar puncture_depth = Scalar(0.005);                              ///< m below the undisturbed surface
  Scalar puncture_force = std::numeric_limits<Scalar>::infinity();    ///< N, of the tool on the tissue
  Scalar tip_radius = 0;                                              ///< m
  int edges_per_tick = 50;                                            ///< that a tick goes over at most; the rest follows in the next
  std::optional<BladeEdge<Scalar>> edge = {};                         ///< the way the blade cuts; every way if not given
};

/// A scalpel that adds no triangles: it opens edges of the mesh that is there, those nearest to the blade.
///
///   SeparatingCutter<double> scalpel({.puncture_depth = 0.006});
///   scalpel.advance(body, tip);   // once a tick; the body is stepped by the host
///   double const change = scalpel.report().area_change;   // m²
///
/// The cut goes from the vertex nearest to the puncture to the vertex nearest to the blade, over the edges nearest to the blade's way. Its
/// vertices are moved onto that way, in the undeformed shape, at home and now; then each gets one copy per fan of triangles, and mass,
/// home spring and links are shared by area. So a wound opens only along the blade.
/// While the blade is in the tissue the wound ends one edge before the vertex nearest to it. One edge between two inner vertices can not
/// open: it waits for the next, and a stroke that ends before changes nothing.
/// A vertex moves at most once, within the triangles at it, and not so far that a triangle's quality q = 4√3 A/Σ side² falls below 0.4,
/// or further below that, or that a triangle turns by more than 30°. Borders, lips, nailed and held particles are not moved.
/// A tick goes over `edges_per_tick` edges at most, so that it ends in time however fast the tip is. Where the way has more, the cut is is_behind():
/// the ticks that follow bring it straight to where the tip was, as a slower tip would, and then on to where the tip is; as for ProgressiveCutter, it
/// goes on when the tip has left the surface, and the next puncture waits.
/// Once punctured, cutting goes on until the tip leaves the surface. A stroke that leaves over the border opens there. When it comes
/// back it goes on from there, or starts anew where it had been farther than an edge from the surface.
/// A body restored under the blade is a new one to it, as for ProgressiveCutter.
/// Units      m, N.
/// Source     \cite deformable_survey; errata: copied at full stiffness the edges of the wound are twice as stiff, here they share it. With the rest
///            lengths set to the actual ones, as there, a cut through stretched tissue takes energy away, and the tissue does not go back to its shape: here
///            they are those of the rest shape. Detaching opens across the blade alone.
/// Invariant  after every tick: a valid mesh with the same triangles, none turned over; mass, momentum and the totals of home and link
///            stiffness unchanged. Rest area, centre of mass and rest lengths change with the vertices that move: the report says the area.
/// Cost       a tick in which the nearest vertex changes is O(m log m), m the vertices beside the blade's way, whatever the size of the
///            body; another is O(1). `edges_per_tick` bounds m. It allocates when the body outgrows what was reserved, or a tick is longer than those
///            before. Only finding the touched point takes as long as the tip's way; a way that leads off the surface and back takes that again.
/// Limits     where vertices may not move, and at sharp turns, the cut lies up to an edge off the blade's way. A tick that is not behind and
///            passes two wounds at once leaves the strip between them uncut. One whose path has to go round a wound may open more than `edges_per_tick`.
template <RealScalar Scalar>
class SeparatingCutter {
 public:
  using Vector = Vector3<Scalar>;

  explicit SeparatingCutter(SeparatingCutterOptions<Scalar> const& options = {})
      : blade_(options.puncture_depth, options.puncture_force, options.tip_radius, options.edge),
        edges_per_tick_(options.edges_per_tick) {
    if (edges_per_tick_ < 1)
      throw InvalidArgument(detail::message("edges_per_tick is ", edges_per_tick_, "; it must be at least 1"));
  }

  /// Moves the tool by one tick; `force` is what it presses the tissue with [N], for puncture_force. The blade's edge turns with the tool.
  /// Throws InvalidArgument for a pose that is not finite, or a body that can not be cut; then nothing has changed.
  template <class Body>
  void advance(Body& body, ToolPose<Scalar> const& tool, Scalar force = 0) {
    if constexpr (detail::can_act_on<Body>()) {
      constexpr bool can_be_cut = SeparableTissue<typename detail::TissueOf<Body>::type>, is_of_scalar = std::same_as<Scalar, typename Body::Scalar>;
      static_assert(can_be_cut,
                    "SeparatingCutter: this tissue can not be cut along its edges; it lacks the ability SeparableTissue: void move_rest(int particle, Vector3<Scalar> const& rest) and "
                    "what CuttableTissue names in palpate/tissue/concept.hpp. MassSpring has it. VolumeCutter cuts solids.");
      static_assert(is_of_scalar, "SeparatingCutter: the cutter computes in another scalar than the body; advance(body, tool) takes a body of its own.");
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
    if constexpr (SeparableTissue<typename Body::Tissue>) blade_.reset(detail::shape_of(body));   // of another body advance() speaks
  }

  /// Turns the blade's edge in the tool: its direction in the tool's frame, of any length. A point gets an edge by that.
  void turn_edge(Vector const& axis) { blade_.turn(axis); }

  CuttingPhase state() const noexcept { return blade_.state(); }
  /// The cut has not yet come to where the tip was, see edges_per_tick.
  bool is_behind() const noexcept { return blade_.is_behind(); }
  SeparatingReport<Scalar> const& report() const noexcept { return blade_.front().report(); }
  SurfaceContact<Scalar> const& contact() const noexcept { return blade_.contact(); }
  Scalar tip_radius() const noexcept { return blade_.tip_radius(); }
  /// What the blade drags along while it is moved across its edge; nothing while it cuts.
  template <class Body>
  std::optional<BladeHold<Scalar>> held(Body const& body) const noexcept {
    if constexpr (SeparableTissue<typename detail::TissueOf<Body>::type>)
      return blade_.held(detail::shape_of(body));
    else
      return {};   // of such a body advance() speaks
  }
  /// Particles that were one before the current or last cut: the two lips of the wound, pair by pair.
  std::vector<std::array<int, 2>> const& lips() const noexcept { return blade_.front().lips(); }

 private:
  using Front = detail::SeparatingFront<Scalar>;
  using Contact = SurfaceContact<Scalar>;

  template <class Shape>
  void cut(Shape& body, ToolPose<Scalar> const& tool, Scalar force) {
    auto const start = [&](Front& front, Contact const& contact) {
      is_away_ = false;
      front.start(body, contact.triangle, contact.barycentric, edges_per_tick_);
      body.advance_cut_epoch();
      return -1;
    };
    auto const go_on = [&](Front& front, Contact const& contact) {
      body.make_permanent_in(contact.triangle);   // another blade's
      bool const changed = move(body, front, contact, tool.position);
      body.advance_cut_epoch();
      return changed ? contact.triangle : -1;
    };
    bool const was_behind = blade_.is_behind();
    blade_.advance(body, tool, force, start, go_on);
    if (was_behind && blade_.contact().off_surface)
      is_away_ = is_far_beside(body, blade_.contact(), tool.position);   // for when it has caught up
  }

  /// Moves the blade in the tissue. True when that changed the body.
  template <class Body>
  bool move(Body& body, Front& front, Contact const& contact, Vector const& tip) {
    if (contact.off_surface) {
      bool const was_away = std::exchange(is_away_, is_far_beside(body, contact, tip));
      return !(was_away && front.is_outside()) && front.leave(body, contact.triangle, contact.barycentric);
    }
    if (std::exchange(is_away_, false)) return front.enter(body, contact.triangle, contact.barycentric);
    return front.advance(body, contact.triangle, contact.barycentric);
  }

  template <class Body>
  static bool is_far_beside(Body const& body, Contact const& contact, Vector const& tip) {
    Vector const offset = tip - contact.point;
    return (offset - offset.dot(contact.normal) * contact.normal).norm() > body.mean_edge();
  }

  detail::Blade<Scalar, Front> blade_;
  int edges_per_tick_;
  bool is_away_ = false;   // the blade is beside the surface, more than an edge
};

}  // namespace palpate
