// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/haptics/local_model.hpp>
#include <palpate/network/messages.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace palpate {

struct RemoteTissueOptions {
  double max_latency = 0.5;       ///< s, from a sample of the hand to the answer to it; what is later counts as that much older
  double max_stiffness = 5000.0;  ///< N/m; a server that says more is not believed
  double max_force = 50.0;        ///< N, of the tissue on the tool, likewise; what is more is shortened
};

/// What became of the answers.
struct RemoteCounts {
  std::uint64_t surfaces = 0, tissues = 0;   ///< used
  std::uint64_t repeated = 0;                ///< not newer than the last
  std::uint64_t other_revision = 0;          ///< surfaces of another topology than the body's
  std::uint64_t other_placement = 0;         ///< answers to where the tool was before it was placed anew
  std::uint64_t clamped = 0;                 ///< stiffnesses and forces above the limits
};

/// The tissue as the hand's side knows it: puts the answers of a server together to the local model that a servo wants.
/// Of answers that come late, in bursts or twice the newest alone counts. The model's time is when its last answer came, on the hand's clock, and earlier where
/// that answers a sample older than `max_latency`: so a servo's `stale_after` measures silence, not the way there and back.
/// A surface of another topology than that of the last tissue answer is not used, and no answer to a sample of before the tool was placed anew. Where the topology
/// changes, the surface of before stays until one of the new topology comes, for 0.1 s at most.
/// Invariant  no surface is stiffer than `max_stiffness`, no force of the tissue above `max_force`; what a deep tip makes of that is limited by the safety chain.
/// Cost       O(1), noexcept, no allocation.
class RemoteTissue {
 public:
  explicit RemoteTissue(RemoteTissueOptions const& options = {}) : options_(options) {
    detail::OptionCheck const require{"RemoteTissue"};
    require.positive(".max_latency", options.max_latency, " s");
    require.positive(".max_stiffness", options.max_stiffness, " N/m");
    require.positive(".max_force", options.max_force, " N");
    model_.valid = false;
  }

  /// True where it is used.
  bool take(SurfaceAnswer const& answer, double now) noexcept {
    if (!is_new(answer.stamp, surface_)) return false;
    if (answer.stamp.revision != revision_ || !model_.valid) {
      ++counts_.other_revision;
      return false;
    }
    surface_ = answer.stamp.sequence;
    surface_revision_ = revision_, surface_time_ = now;
    model_.surface.patch = answer.patch;
    model_.surface.patch.stiffness = limited_to(answer.patch.stiffness, options_.max_stiffness);
    ++model_.surface.sequence;
    ++counts_.surfaces;
    heard(answer.stamp, now);
    return true;
  }
  bool take(TissueAnswer const& answer, double now) noexcept {
    if (!is_new(answer.stamp, tissue_)) return false;
    tissue_ = answer.stamp.sequence;
    revision_ = answer.stamp.revision;
    model_.phase = answer.phase;
    model_.diverged = answer.diverged;
    model_.valid = true;
    model_.restorations = static_cast<std::size_t>(answer.restorations) + reconnections_;
    model_.home_point = answer.home_point;
    model_.normal = answer.normal;
    model_.tip_radius = answer.tip_radius;
    double const force = answer.force.norm(), least = limited_to(force, options_.max_force);
    double const share = force > least ? least / force : 1.0;
    model_.tissue_force = share * answer.force;
    model_.tissue_moment = share * answer.moment;
    model_.cut_area = answer.cut_area;
    if (model_.surface.patch.stiffness > 0.0 && surface_revision_ != revision_ && now - surface_time_ > 0.1) take_surface_away();
    ++counts_.tissues;
    heard(answer.stamp, now);
    return true;
  }

  /// The tool is placed anew for the n-th time: answers to samples from before say nothing of where it is.
  void placed(std::uint64_t pose_discontinuities) noexcept { pose_discontinuities_ = pose_discontinuities; }
  /// Another connection begins, with sequences of its own, and perhaps another body: it counts as restored, and what was touched is gone.
  void reconnected() noexcept {
    surface_ = tissue_ = 0, revision_ = none;
    ++reconnections_, ++model_.restorations;
    model_.phase = CuttingPhase::no_contact;
    model_.tissue_force.setZero(), model_.tissue_moment.setZero();
    take_surface_away();
  }
  /// A session of the hand begins: nothing is known.
  void begin_session() noexcept {
    surface_ = tissue_ = 0, revision_ = none, pose_discontinuities_ = 0, reconnections_ = 0;
    latency_ = 0.0;
    auto const sequence = model_.surface.sequence;
    model_ = {};
    model_.valid = false;
    model_.surface.sequence = sequence + 1;
  }

  /// As of now; `valid` from the first tissue answer on.
  LocalModel<double> const& model() const noexcept { return model_; }
  /// s, from the sample of the hand to the last answer; 0 before the first.
  double latency() const noexcept { return latency_; }
  RemoteCounts const& counts() const noexcept { return counts_; }

  /// A tip as it is to be drawn: outside the tissue, on the surface where it is behind it.
  Vector3<double> shown(Vector3<double> const& tip) const noexcept { return outside(model_.surface.patch, tip); }

  /// The point itself, or the nearest one on the surface where it is behind that.
  template <RealScalar S>
  static Vector3<S> outside(SurfacePatch<S> const& patch, Vector3<S> const& tip) noexcept {
    if (!(patch.stiffness > S(0))) return tip;
    S const height = patch.distance(tip);
    return height < S(0) ? Vector3<S>(tip - height * patch.normal_at(tip)) : tip;
  }

 private:
  static constexpr std::uint64_t none = std::numeric_limits<std::uint64_t>::max();

  bool is_new(AnswerStamp const& stamp, std::uint64_t last) noexcept {
    if (stamp.sequence <= last) {
      ++counts_.repeated;
      return false;
    }
    if (stamp.hand > 0 && stamp.pose_discontinuities != pose_discontinuities_) {
      ++counts_.other_placement;
      return false;
    }
    return true;
  }
  void take_surface_away() noexcept { model_.surface.patch.stiffness = 0.0, ++model_.surface.sequence; }
  double limited_to(double value, double most) noexcept {
    if (value > most) ++counts_.clamped;
    return std::min(value, most);
  }
  void heard(AnswerStamp const& stamp, double now) noexcept {
    latency_ = stamp.hand > 0 ? std::max(0.0, now - stamp.hand_time) : 0.0;
    model_.time = now - std::max(0.0, latency_ - options_.max_latency);
  }

  RemoteTissueOptions options_;
  LocalModel<double> model_{};
  RemoteCounts counts_{};
  std::uint64_t surface_ = 0, tissue_ = 0;   // sequences
  std::uint64_t revision_ = none, pose_discontinuities_ = 0, surface_revision_ = none;
  std::size_t reconnections_ = 0;
  double latency_ = 0.0, surface_time_ = 0.0;   // s
};

}  // namespace palpate
