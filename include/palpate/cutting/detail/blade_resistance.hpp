// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/cutting/blade_grip.hpp>
#include <palpate/cutting/detail/traced_blade.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace palpate::detail {

/// What it takes to move a blade through a solid: fracture and the friction of the lips, as a spring that gives way.
///   F = K lag,   up to F_s = min(Gc L⊥ u + owed/ℓ, 2 Gc L) + φ L,   ℓ half a mean edge
/// L is the blade's length in tissue and L⊥ its part across the way, so that Gc L⊥ is toughness times new area per way. The blade stays behind the tool by F_s/K,
/// and cuts where it is, not where the tool is: what it cuts has been paid for. u ends at 0 where the blade has been paid for two edges of way that made
/// no area: it moves in a cut that was there. Area beyond the way, as where the cut bends to vertices, is owed, and paid over the next half edge of
/// way, or a longer one where that would take more than twice the toughness.
/// F acts on the particles of the tetrahedra that the blade goes through, by their masses: crumbs of tissue beside an old cut are not torn about.
/// Paid is what the hand has really done: the force that was felt times the way of the tool through the tissue, less friction's share and what the spring would
/// give back, F²/2K. A coupling that is slower than the spring, as in stiff tissue, resists with less than F_s, and gives back more where the hand turns round.
/// Source     elastic up to the toughness, then plastic, as in \cite mahvash2001.
/// Cost       O(tetrahedra on the blade); memory is kept.
template <RealScalar Scalar>
class BladeResistance {
 public:
  struct Options {
    double toughness, friction, stiffness;   // J/m², N/m, N/m
  };
  explicit BladeResistance(Options const& options) noexcept : options_(options) {}

  bool resists() const noexcept { return options_.toughness > 0 || options_.friction > 0; }

  /// By how much the blade stays behind its targets, so that the tissue is not pulled with more than it stands; with so much area [m²] cut so far.
  Vector3<double> stays_behind(std::span<BladeSample const> samples, std::span<Vector3<double> const> from, std::span<Vector3<double> const> to, double area, double edge) noexcept {
    double const owed = options_.toughness * (area - std::exchange(area_, area)), work = felt_.dot(lag_of(from, to) - lag_);
    credit_ += (std::isfinite(work) ? work : 0) - owed;
    double const credit = credit_ - felt_.squaredNorm() / (2 * options_.stiffness);
    double length = 0;
    Vector3<double> lag = Vector3<double>::Zero();
    for_each_piece(samples, from, [&](std::size_t i, double piece) { length += piece, lag += piece / 2 * (to[i] - from[i] + to[i + 1] - from[i + 1]); });
    slip_force_ = rubbed_ = 0;
    if (!(length > 0)) return Vector3<double>::Zero();
    lag /= length;
    double const size = lag.norm();
    double across = 0;
    for_each_piece(samples, from, [&](std::size_t i, double piece) { across += size > 0 ? (from[i + 1] - from[i]).cross(lag).norm() / size : piece; });
    double const fracture = options_.toughness * across, unit = fracture * edge, friction = options_.friction * length;
    double const debt = options_.toughness > 0 ? std::max(0.0, -credit) : 0;
    double const due = (unit > 0 ? fracture * std::clamp(2 - credit / unit, 0.0, 1.0) : 0) + 2 * debt / edge;
    slip_force_ = std::min(due, 2 * options_.toughness * length) + friction;
    double const stays = options_.stiffness * size > slip_force_ ? slip_force_ / (options_.stiffness * size) : 1;
    rubbed_ = stays < 1 && friction > 0 ? (1 - stays) * size * friction * std::min(1.0, felt_.norm() / slip_force_) : 0;
    return stays * lag;
  }
  /// It has been moved there.
  void moved() noexcept { credit_ -= rubbed_; }

  /// What hangs on to the blade where it is; `end(share)` is where a point of the blade would be on the tool.
  template <class Body, class End>
  void hold(Body const& body, std::span<BladeSample const> samples, End const& end) {
    entries_.clear(), particles_.clear(), weights_.clear(), points_.clear();
    for (BladeSample const& sample : samples) points_.push_back(TracedBlade<Scalar>::now(body, sample));
    double length = 0;
    shares_.assign(samples.size(), 0.0);
    for_each_piece(samples, points_, [&](std::size_t i, double piece) { length += piece, shares_[i] += piece / 2, shares_[i + 1] += piece / 2; });
    target_.setZero(), lag_.setZero(), felt_.setZero();
    for (double& share : shares_) share = length > 0 ? share / length : 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (!(shares_[i] > 0)) continue;
      Vector3<double> const on_tool = end(samples[i].share);
      target_ += shares_[i] * on_tool, lag_ += shares_[i] * (on_tool - points_[i]);
      auto const c = body.tissue().topology().corners(samples[i].tetrahedron);
      double mass = 0;
      for (int const v : c) mass += static_cast<double>(body.tissue().mass(v));
      Vector3<double> carried = Vector3<double>::Zero();
      for (int const v : c) {
        double const w = static_cast<double>(body.tissue().mass(v)) / mass;
        carried += w * body.positions().col(v).template cast<double>();
        entries_.emplace_back(v, shares_[i] * w);
      }
      target_ += shares_[i] * (carried - points_[i]);
    }
    std::sort(entries_.begin(), entries_.end());
    for (auto const& [particle, weight] : entries_) {
      if (particles_.empty() || particles_.back() != particle) particles_.push_back(particle), weights_.push_back(0);
      weights_.back() += static_cast<Scalar>(weight);
    }
    if (double const force = options_.stiffness * lag_.norm(); force > 0) felt_ = std::min(1.0, slip_force_ / force) * options_.stiffness * lag_;
  }
  /// What the hand has pulled the tissue with since it was held so [N]; without this it is what the spring says.
  void felt(Vector3<double> const& force) noexcept { felt_ = force; }
  /// The stroke ends: what has been paid for nothing is lost.
  void let_go() noexcept {
    particles_.clear(), shares_.clear();
    felt_.setZero();
    credit_ = std::min(credit_, 0.0);
  }

  bool holds() const noexcept { return !particles_.empty() && slip_force_ > 0; }
  BladeGrip<Scalar> grip() const noexcept {
    return {.particles = particles_, .weights = weights_, .target = target_.cast<Scalar>(), .stiffness = static_cast<Scalar>(options_.stiffness), .slip_force = static_cast<Scalar>(slip_force_)};
  }

 private:
  /// How far what hangs on to the blade, where it is now, is behind its places on the tool.
  Vector3<double> lag_of(std::span<Vector3<double> const> from, std::span<Vector3<double> const> to) const noexcept {
    Vector3<double> lag = Vector3<double>::Zero();
    for (std::size_t i = 0; i < std::min(shares_.size(), from.size()); ++i) lag += shares_[i] * (to[i] - from[i]);
    return lag;
  }
  template <class Visit>
  static void for_each_piece(std::span<BladeSample const> samples, std::span<Vector3<double> const> at, Visit const& visit) {
    for (std::size_t i = 0; i + 1 < samples.size(); ++i)
      if (samples[i].is_inside() && !samples[i].leaves && samples[i + 1].is_inside())
        if (double const piece = (at[i + 1] - at[i]).norm(); piece > 0) visit(i, piece);
  }

  Options options_;
  double credit_ = 0, area_ = 0;         // J paid beyond the area made; m² that were counted
  double slip_force_ = 0, rubbed_ = 0;   // N, of the last tick; J of friction on the way beyond the lag
  Vector3<double> target_ = Vector3<double>::Zero();
  Vector3<double> lag_ = Vector3<double>::Zero(), felt_ = Vector3<double>::Zero();   // m, of the target before what hangs on to it; N, since then
  std::vector<std::pair<int, double>> entries_;
  std::vector<double> shares_;   // of the samples in what hangs on to the blade; the sum is 1, or 0
  std::vector<Vector3<double>> points_;
  std::vector<int> particles_;
  std::vector<Scalar> weights_;
};

}  // namespace palpate::detail
