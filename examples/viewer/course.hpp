// SPDX-License-Identifier: MIT
#pragma once

#include "live.hpp"

#include <deque>

namespace viewer {

/// What the window shows of the ticks: the last one and the chart, over all runs.
class Course {
 public:
  /// The next ticks are of a run that begins when its simulator's time is `time` [s].
  void begin_run(double time) noexcept { offset_ = time_ - time; }
  void take(palpate::Tick const& tick, Vector const& way_out) {
    time_ = offset_ + tick.time + 1e-3;
    now_ = moment_of(tick, way_out, tick.energy - forgotten_);
    if (chart_.empty() || time_ > chart_.back().time + chart_period - 5e-4) chart_.push_back({time_, tick.force.norm(), now_.energy});
    while (!chart_.empty() && chart_.front().time < time_ - chart_seconds) chart_.pop_front();
  }
  void take_hook(palpate::Tick const& tick) noexcept { hook_ = tick; }
  /// Counts the energy from here on; from nothing, where the next tick is a new simulator's.
  void forget_energy(bool is_new) noexcept { forgotten_ = is_new ? 0.0 : now_.tick.energy; }

  double time() const noexcept { return time_; }   // s, of all runs
  Moment const& now() const noexcept { return now_; }
  palpate::Tick const& hook() const noexcept { return hook_; }
  std::deque<ChartSample> const& chart() const noexcept { return chart_; }

 private:
  static constexpr double chart_period = 0.01;   // s

  double time_ = 0.0, offset_ = 0.0;   // s
  double forgotten_ = 0.0;             // J
  Moment now_{};
  palpate::Tick hook_ = HookMoment{}.tick;
  std::deque<ChartSample> chart_;
};

}  // namespace viewer
