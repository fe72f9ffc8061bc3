// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/body/shape_of.hpp>
#include <palpate/cutting/concept.hpp>

#include <concepts>

namespace palpate {

template <RealScalar Scalar>
struct NoCutterOptions {
  Scalar tip_radius = 0;   ///< m, of the ball that the tip is; 0: a point
};

/// A blunt tool: it touches and palpates, and never cuts.
///   NoCutter<double> probe({.tip_radius = 0.004});
template <RealScalar Scalar>
class NoCutter {
 public:
  NoCutter() : NoCutter(NoCutterOptions<Scalar>{}) {}
  explicit NoCutter(NoCutterOptions<Scalar> const& options) : touch_(options.tip_radius) {}

  template <class Body>
  void advance(Body& body, ToolPose<Scalar> const& tool) {
    if constexpr (detail::can_act_on<Body>()) {
      static_assert(std::same_as<Scalar, typename Body::Scalar>, "NoCutter: the cutter computes in another scalar than the body; advance(body, tool) takes a body of its own.");
      if constexpr (std::same_as<Scalar, typename Body::Scalar>) touch_.update(detail::shape_of(body), tool.position);
    }
  }
  /// The same for the tip [m] of a tool that is not turned.
  template <class Body>
  void advance(Body& body, detail::TipPosition<Scalar> const& tip) {
    advance(body, tip.pose());
  }

  /// Forgets the contact: the tip has to come from outside again.
  template <class Body>
  void reset(Body&) noexcept {
    touch_.reset();
  }

  SurfaceContact<Scalar> const& contact() const noexcept { return touch_.contact(); }
  CuttingPhase state() const noexcept { return contact().touching ? CuttingPhase::indenting : CuttingPhase::no_contact; }
  CutReport const& report() const noexcept { return report_; }
  Scalar tip_radius() const noexcept { return touch_.tip_radius(); }

 private:
  Touch<Scalar> touch_;
  CutReport report_;
};

}  // namespace palpate
