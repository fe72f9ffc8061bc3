// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/touch.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/phase.hpp>

#include <string_view>

namespace palpate::detail {

/// What all scalpels do: touch, press, puncture, move and leave. How the mesh changes is the front's part.
///
///   no contact → indenting → moving → no contact
///
/// Invariant  state() is moving from the puncture until the tip leaves the surface, the tool is taken away or the body is restored.
template <RealScalar Scalar, class Front>
class Blade {
 public:
  using Vector = Vector3<Scalar>;

  /// `puncture_depth` and `tip_radius` in m, `puncture_force` in N.
  Blade(Scalar puncture_depth, Scalar puncture_force, Scalar tip_radius)
      : puncture_depth_(puncture_depth), puncture_force_(puncture_force), touch_(tip_radius) {
    require_positive("puncture_depth", puncture_depth, "m");
    require_positive("puncture_force", puncture_force, "N");
  }

  /// Moves the tip by one tick. `start(front, contact)` punctures, `go_on(front, contact)` moves the blade in the tissue. Each returns the
  /// triangle that the tip is to be followed from, as the mesh has changed under it, or −1.
  /// Throws InvalidArgument for a tip that is not finite, or a body that can not be cut; then nothing has changed.
  template <class Body, class Start, class GoOn>
  void advance(Body& body, Vector const& tip, Scalar force, Start const& start, GoOn const& go_on) {
    if (!tip.allFinite())
      throw InvalidArgument(message("the tip is at (", tip[0], ", ", tip[1], ", ", tip[2], "); it must be finite"));
    if (!body.tissue().cuttable())
      throw InvalidArgument("this body is built from a volume; only a body built from a surface can be cut");
    if (touch_.was_restored(body)) reset(body);
    SurfaceContact<Scalar> const& contact = touch_.update(body, tip, state_ == CuttingPhase::moving);
    if (!contact.touching) {
      if (state_ == CuttingPhase::moving) front_.finish(body), body.even_masses();
      state_ = CuttingPhase::no_contact;
      return;
    }
    int restart = -1;
    if (state_ == CuttingPhase::moving) {
      restart = go_on(front_, contact);
    } else {
      state_ = CuttingPhase::indenting;
      if (contact.depth < puncture_depth_ && !(force >= puncture_force_)) return;
      state_ = CuttingPhase::moving;
      restart = start(front_, contact);
    }
    body.even_masses();
    if (restart >= 0) touch_.restart_from(body, restart, tip);
  }

  /// A cut in progress ends, and the tip has to come from outside again.
  template <class Body>
  void reset(Body& body) {
    if (touch_.was_restored(body))
      front_ = {};   // what it knew of the body does not exist any more
    else if (state_ == CuttingPhase::moving)
      front_.finish(body), body.even_masses();
    touch_.reset();
    state_ = CuttingPhase::no_contact;
  }

  CuttingPhase state() const noexcept { return state_; }
  SurfaceContact<Scalar> const& contact() const noexcept { return touch_.contact(); }
  Front const& front() const noexcept { return front_; }

 private:
  static void require_positive(std::string_view what, Scalar value, std::string_view unit) {
    if (!(value > 0)) throw InvalidArgument(message(what, " is ", value, " ", unit, "; it must be positive"));
  }

  Scalar puncture_depth_, puncture_force_;
  Touch<Scalar> touch_;
  Front front_;
  CuttingPhase state_ = CuttingPhase::no_contact;
};

}  // namespace palpate::detail
