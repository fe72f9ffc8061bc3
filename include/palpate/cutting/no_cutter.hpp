// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/shape_of.hpp>
#include <palpate/cutting/concept.hpp>

namespace palpate {

/// A blunt tool: it touches and palpates, and never cuts.
template <RealScalar Scalar>
class NoCutter {
 public:
  explicit NoCutter(Scalar tip_radius = 0) : touch_(tip_radius) {}

  template <class Body>
  void advance(Body& body, Vector3<Scalar> const& tip) {
    touch_.update(detail::shape_of(body), tip);
  }

  /// Forgets the contact: the tip has to come from outside again.
  template <class Body>
  void reset(Body&) noexcept {
    touch_.reset();
  }

  SurfaceContact<Scalar> const& contact() const noexcept { return touch_.contact(); }
  CuttingPhase state() const noexcept { return contact().touching ? CuttingPhase::indenting : CuttingPhase::no_contact; }
  CutReport const& report() const noexcept { return report_; }

 private:
  Touch<Scalar> touch_;
  CutReport report_;
};

}  // namespace palpate
