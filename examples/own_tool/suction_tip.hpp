// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/extend/tool.hpp>

#include <cstddef>
#include <limits>
#include <numbers>

/// A suction tip: a tube whose opening is pressed on tissue and then holds it, until it is drawn off with more than the vacuum bears,
///   F = Δp π r²
/// While it is turned on; `.vacuum = 0` makes a blunt tube of it.
template <palpate::RealScalar Scalar>
class SuctionTip {
 public:
  using Vector = palpate::Vector3<Scalar>;

  struct Options {
    Scalar radius = Scalar(0.003);   // m, of the opening
    Scalar length = Scalar(0.1);     // m
    Scalar vacuum = Scalar(2e4);     // Pa, below the pressure of the air
  };

  explicit SuctionTip(Options const& options = {})
      : tool_(palpate::make_probe_shape<Scalar>({.radius = static_cast<double>(options.radius), .length = static_cast<double>(options.length)})),
        bears_(options.vacuum * std::numbers::pi_v<Scalar> * options.radius * options.radius) {}

  template <class Body>
  void advance(Body& body, palpate::ToolPose<Scalar> const& tool) {
    if (revision_ != body.topology_revision()) holds_ = false;   // cut, or restored: it sucks itself fast again
    revision_ = body.topology_revision();
    tool_.advance(body, tool);
    Vector const into = tool_.rods().pose().orientation * Vector(-Vector::UnitZ());
    if (holds_ && tool_.force().dot(into) > bears_) holds_ = false, is_torn_off_ = true;   // the tissue draws with more
    if (is_torn_off_ && !tool_.contact().touching) is_torn_off_ = false;   // then it may hold again
    if (!holds_ && !is_torn_off_ && bears_ > 0) suck(body);
    if (holds_ && !tool_.contact().touching) tool_.show(body, 0, pin_.triangle, pin_.barycentric, tool_.rods().pose().position);
  }
  template <class Body>
  Vector press(Body& body, Scalar share, Scalar h) {
    return tool_.press(body, share, h, holds_ ? &pin_ : nullptr);
  }
  template <class Body>
  void reset(Body& body) noexcept {
    holds_ = is_torn_off_ = false;
    tool_.reset(body);
  }

  bool holds() const noexcept { return holds_; }
  palpate::SurfaceContact<Scalar> const& contact() const noexcept { return tool_.contact(); }
  palpate::CuttingPhase state() const noexcept { return holds_ ? palpate::CuttingPhase::indenting : tool_.state(); }
  palpate::CutReport const& report() const noexcept { return tool_.report(); }
  Scalar tip_radius() const noexcept { return tool_.tip_radius(); }
  Vector const& haptic_point() const noexcept { return tool_.haptic_point(); }
  Vector const& moment() const noexcept { return tool_.moment(); }

 private:
  /// Takes hold where the opening, the end of the tube, touches.
  template <class Body>
  void suck(Body const&) {
    for (auto const& touch : tool_.rods().touches()) {
      if (!touch.acts || touch.parameter > 0) continue;
      auto const& pose = tool_.rods().pose();
      pin_ = {.triangle = touch.triangle,
              .barycentric = touch.barycentric,
              .offset = pose.orientation.conjugate() * (touch.on_axis - tool_.tip_radius() * touch.normal - pose.position),
              .limit = std::numeric_limits<Scalar>::max()};
      holds_ = true;
      return;
    }
  }

  palpate::BluntTool<Scalar> tool_;
  palpate::PinnedPoint<Scalar> pin_;
  Scalar bears_;   // N
  std::size_t revision_ = 0;
  bool holds_ = false, is_torn_off_ = false;
};
