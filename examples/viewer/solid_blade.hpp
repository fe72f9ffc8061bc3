// SPDX-License-Identifier: MIT
#pragma once

#include "setup.hpp"

#include <palpate/cutting/no_cutter.hpp>
#include <palpate/cutting/volume_cutter.hpp>

#include <Eigen/Geometry>

#include <optional>

namespace viewer {

/// What AnyCutter is for a skin: a blunt tool or a blade through flesh. The blade's edge stands on the skin, along its smooth normal at the touched point, and
/// reaches deeper than the tip: a cut opens where it goes through the edges of tetrahedra, which are some 14 mm long. The tissue resists it with a toughness: 1.6 N
/// where the edge is 26 mm deep, which the hand feels with the tight coupling.
class SolidBlade {
  template <class Function>
  auto with(Function function) const {
    return blade_ == Blade::none ? function(blunt_) : function(knife_);
  }

 public:
  static constexpr double below = 0.015, above = 0.025;   // m, of the tip
  static constexpr double toughness = 60.0;               // J/m²

  SolidBlade(Blade blade, double puncture_depth) : blade_(blade), puncture_depth_(puncture_depth) { sharpen(); }

  template <class Body>
  void advance(Body& body, palpate::ToolPose<double> const& tool, double force = 0.0) {
    if (blade_ == Blade::none) return blunt_.advance(body, tool);
    palpate::ToolPose<double> upright = tool;
    upright.orientation = Eigen::Quaterniond::FromTwoVectors(Vector::UnitZ(), knife_.contact().normal);
    knife_.advance(body, upright, force);
  }

  /// Takes the tool away and gives another one. Returns which it is now: there is none that opens faces of tetrahedra only.
  template <class Body>
  Blade change(Body& body, Blade blade) {
    if (blade_ == Blade::none) blunt_.reset(body);
    else knife_.reset(body);
    blade_ = blade == Blade::separating ? Blade::none : blade;
    cut_before_ += knife_.area();
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
  std::optional<palpate::BladeGrip<double>> grip() const noexcept { return blade_ == Blade::none ? std::nullopt : knife_.grip(); }
  double area() const noexcept { return cut_before_ + knife_.area(); }
  bool is_behind() const noexcept { return blade_ != Blade::none && knife_.is_behind(); }
  palpate::CutReport const& report() const noexcept {
    return *with([](auto const& cutter) { return static_cast<palpate::CutReport const*>(&cutter.report()); });
  }

 private:
  void sharpen() {
    blunt_ = palpate::NoCutter<double>();
    knife_ = palpate::VolumeCutter<double>({.edge = {Vector(0, 0, -below), Vector(0, 0, above)}, .puncture_depth = puncture_depth_, .toughness = toughness});
  }

  Blade blade_;
  double puncture_depth_;
  double cut_before_ = 0.0;   // m², by knives before this one
  palpate::NoCutter<double> blunt_;
  palpate::VolumeCutter<double> knife_;
};

}  // namespace viewer
