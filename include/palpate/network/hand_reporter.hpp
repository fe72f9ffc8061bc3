// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/tool_pose.hpp>
#include <palpate/network/messages.hpp>
#include <palpate/network/remote_tissue.hpp>
#include <palpate/network/weber_deadband.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

namespace palpate {

/// Makes the samples that the hand's side sends: every pose, or with a deadband those that would change the force by more than a hand notices.
/// In front of the surface counts what the way would be there: the change of the way against the height.
/// Cost       noexcept, no allocation.
class HandReporter {
 public:
  explicit HandReporter(WeberDeadbandOptions const& deadband = {}) : deadband_(deadband) {}

  /// The sample of this pose, if it is to be sent; `now` [s] on the hand's clock.
  std::optional<HandReport> operator()(ToolPose<double> const& tool, std::uint64_t pose_discontinuities, RemoteTissue const& tissue, double now) noexcept {
    HandReport sample{.sequence = sent_.sequence + 1,
                      .time = now,
                      .pose_discontinuities = pose_discontinuities,
                      .position = tool.position,
                      .velocity = tool.velocity,
                      .orientation = tool.orientation,
                      .opening = tool.opening};
    if (!sample.valid()) return std::nullopt;
    SurfacePatch<double> const& surface = tissue.model().surface.patch;
    double const stiffness = surface.stiffness, way = (sample.position - sent_.position).norm();
    double const force = std::max(tissue.model().tissue_force.norm(), stiffness * std::abs(surface.distance(sample.position)));
    bool const anyway = sent_.sequence == 0 || pose_discontinuities != sent_.pose_discontinuities || tool.opening != sent_.opening ||
                        std::abs(tool.orientation.dot(sent_.orientation)) < 0.99999;   // half a degree
    if (!deadband_(stiffness * way, force, now, anyway)) return std::nullopt;
    return sent_ = sample;
  }
  /// Another connection begins.
  void reconnected() noexcept {
    sent_ = {};
    deadband_.reset();
  }

  HandReport const& last() const noexcept { return sent_; }
  WeberDeadband const& deadband() const noexcept { return deadband_; }

 private:
  WeberDeadband deadband_;
  HandReport sent_{};
};

}  // namespace palpate
