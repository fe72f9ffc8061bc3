// SPDX-License-Identifier: MIT
#pragma once

#include "setup.hpp"

#include <palpate/cutting/no_cutter.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/cutting/separating_cutter.hpp>

namespace viewer {

/// One of three cutters, chosen while the program runs: a cutter policy of our own. A simulator is compiled once for all of them, where each by its
/// type would make three. A cutter is asked once a tick, so the choice costs nothing that could be measured.
class AnyCutter {
  template <class Function>
  auto with(Function function) {
    if (blade_ == Blade::none) return function(blunt_);
    return blade_ == Blade::progressive ? function(progressive_) : function(separating_);
  }
  template <class Function>
  auto with(Function function) const {
    if (blade_ == Blade::none) return function(blunt_);
    return blade_ == Blade::progressive ? function(progressive_) : function(separating_);
  }

 public:
  AnyCutter(Blade blade, double puncture_depth) : blade_(blade), puncture_depth_(puncture_depth) { sharpen(); }

  template <class Body>
  void advance(Body& body, palpate::ToolPose<double> const& tool, double force = 0.0) {
    if (blade_ == Blade::none) blunt_.advance(body, tool);
    if (blade_ == Blade::progressive) progressive_.advance(body, tool, force);
    if (blade_ == Blade::separating) separating_.advance(body, tool, force);
  }

  /// Takes the tool away and gives another one: the cut in progress ends, and the tip has to come from outside again. Returns which it is now.
  template <class Body>
  Blade change(Body& body, Blade blade) {
    with([&](auto& cutter) { cutter.reset(body); });
    blade_ = blade;
    sharpen();
    return blade_;
  }

  palpate::SurfaceContact<double> const& contact() const noexcept {
    return *with([](auto const& cutter) { return &cutter.contact(); });
  }
  palpate::CuttingPhase state() const noexcept {
    return with([](auto const& cutter) { return cutter.state(); });
  }
  double tip_radius() const noexcept {
    return with([](auto const& cutter) { return cutter.tip_radius(); });
  }
  bool is_behind() const noexcept {
    return with([](auto const& cutter) {
      if constexpr (requires { cutter.is_behind(); }) return cutter.is_behind();
      return false;
    });
  }
  palpate::CutReport const& report() const noexcept {
    return *with([](auto const& cutter) { return static_cast<palpate::CutReport const*>(&cutter.report()); });
  }

 private:
  /// As good as new.
  void sharpen() {
    blunt_ = palpate::NoCutter<double>();
    progressive_ = palpate::ProgressiveCutter<double>({.puncture_depth = puncture_depth_});
    separating_ = palpate::SeparatingCutter<double>({.puncture_depth = puncture_depth_});
  }

  Blade blade_;
  double puncture_depth_;
  palpate::NoCutter<double> blunt_;
  palpate::ProgressiveCutter<double> progressive_;
  palpate::SeparatingCutter<double> separating_;
};

}  // namespace viewer
