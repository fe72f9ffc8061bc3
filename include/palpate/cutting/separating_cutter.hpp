// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/touch.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/phase.hpp>
#include <palpate/cutting/concept.hpp>
#include <palpate/cutting/detail/separating_front.hpp>
#include <palpate/tissue/concept.hpp>

#include <array>
#include <limits>
#include <string_view>
#include <vector>

namespace palpate {

/// When a separating cutter punctures.
template <RealScalar Scalar>
struct SeparatingCutterOptions {
  Scalar puncture_depth = Scalar(0.005);                              ///< m below the undisturbed surface
  Scalar puncture_force = std::numeric_limits<Scalar>::infinity();    ///< N, of the tool on the tissue
  Scalar tip_radius = 0;                                              ///< m
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
/// Once punctured, cutting goes on until the tip leaves the surface. A stroke that leaves over the border opens there. When it comes
/// back it goes on from there, or starts anew where it had been farther than an edge from the surface.
/// A body restored under the blade is a new one to it, as for ProgressiveCutter.
/// Units      m, N.
/// Source     \cite meseure1997, spec M8; erratum: copied at full stiffness the edges of the wound are twice as stiff, here they share it.
///            Spec H4: detaching opens across the blade alone.
/// Invariant  after every tick: a valid mesh with the same triangles, none turned over; mass, momentum and the totals of home and link
///            stiffness unchanged. Rest area, centre of mass and rest lengths change with the vertices that move: the report says the area.
/// Cost       a tick in which the nearest vertex changes is O(m log m), m the vertices beside the blade's way, whatever the size of the
///            body; another is O(1). It allocates when the body outgrows what was reserved, or a tick is longer than those before.
/// Limits     where vertices may not move, and at sharp turns, the cut lies up to an edge off the blade's way. A tick that passes two wounds
///            at once leaves the strip between them uncut. While another cutter has a temporary particle in the body, it waits.
template <RealScalar Scalar>
class SeparatingCutter {
 public:
  using Vector = Vector3<Scalar>;

  explicit SeparatingCutter(SeparatingCutterOptions<Scalar> const& options = {}) : options_(options), touch_(options.tip_radius) {
    require_positive("puncture_depth", options.puncture_depth, "m");
    require_positive("puncture_force", options.puncture_force, "N");
  }

  /// Moves the tip [m] by one tick; `force` is what the tool presses the tissue with [N], for puncture_force.
  /// Throws InvalidArgument for a tip that is not finite, or a body that can not be cut; then nothing has changed.
  template <class Body>
  void advance(Body& body, Vector const& tip, Scalar force = 0) {
    static_assert(SeparableTissue<typename Body::Tissue>,
                  "SeparatingCutter: this tissue can not be cut along its edges; it lacks the ability SeparableTissue. MassSpring has it.");
    if (!tip.allFinite())
      throw InvalidArgument(detail::message("the tip is at (", tip[0], ", ", tip[1], ", ", tip[2], "); it must be finite"));
    if (!body.tissue().cuttable())
      throw InvalidArgument("this body is built from a volume; only a body built from a surface can be cut");
    if (touch_.was_restored(body)) reset(body);
    touch_.update(body, tip, state_ == CuttingPhase::moving);
    SurfaceContact<Scalar> const& contact = touch_.contact();
    if (!contact.touching) {
      if (state_ == CuttingPhase::moving) front_.finish(body);
      state_ = CuttingPhase::no_contact;
      return;
    }
    if (state_ != CuttingPhase::moving) {
      state_ = CuttingPhase::indenting;
      if (contact.depth < options_.puncture_depth && !(force >= options_.puncture_force)) return;
      state_ = CuttingPhase::moving;
      is_away_ = false;
      front_.start(body, contact.triangle, contact.barycentric);
    } else if (body.temporary_particle() < 0 && go_on(body, tip)) {
      touch_.restart_from(body, contact.triangle, tip);
    }
  }

  /// Takes the tool away: a cut in progress ends, and the tip has to come from outside again.
  template <class Body>
  void reset(Body& body) {
    if (touch_.was_restored(body))
      front_ = {};   // what it knew of the body does not exist any more
    else if (state_ == CuttingPhase::moving)
      front_.finish(body);
    touch_.reset();
    state_ = CuttingPhase::no_contact;
  }

  CuttingPhase state() const noexcept { return state_; }
  SeparatingReport<Scalar> const& report() const noexcept { return front_.report(); }
  SurfaceContact<Scalar> const& contact() const noexcept { return touch_.contact(); }
  /// Particles that were one before the current or last cut: the two lips of the wound, pair by pair.
  std::vector<std::array<int, 2>> const& lips() const noexcept { return front_.lips(); }

 private:
  static void require_positive(std::string_view what, Scalar value, std::string_view unit) {
    if (!(value > 0)) throw InvalidArgument(detail::message(what, " is ", value, " ", unit, "; it must be positive"));
  }

  /// True when the body was changed.
  template <class Body>
  bool go_on(Body& body, Vector const& tip) {
    SurfaceContact<Scalar> const& contact = touch_.contact();
    if (contact.off_surface) {
      bool const was_away = is_away_;
      Vector const offset = tip - contact.point;
      is_away_ = (offset - offset.dot(contact.normal) * contact.normal).norm() > body.mean_edge();
      return !was_away && front_.leave(body, contact.triangle, contact.barycentric);
    }
    if (is_away_) {
      is_away_ = false;
      return front_.enter(body, contact.triangle, contact.barycentric);
    }
    return front_.advance(body, contact.triangle, contact.barycentric);
  }

  SeparatingCutterOptions<Scalar> options_;
  Touch<Scalar> touch_;
  detail::SeparatingFront<Scalar> front_;
  CuttingPhase state_ = CuttingPhase::no_contact;
  bool is_away_ = false;   // the blade is beside the surface, more than an edge
};

}  // namespace palpate
