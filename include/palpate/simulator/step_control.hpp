// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/body/substeps.hpp>
#include <palpate/simulator/body_counts.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace palpate {

/// How long a body's steps may be, tick by tick. The stable step is found anew after every edit, and where the body, looked at every eight ticks while it moves,
/// says that it has fallen: a wound that opens under pre-tension grows stiffer. Just after a cut, and while a particle moves faster than 5 % of an edge a tick,
/// springs turn within a tick: then the steps are not above the body's guaranteed one, which holds wherever the body goes.
template <class BodyType>
class StepControl {
 public:
  using Scalar = typename BodyType::Scalar;

  /// A tick of h seconds in the fewest equal steps that the body stands, at most so many: push(body, k, steps) before step k, from 1 on. False: it diverged.
  template <class Push>
  bool advance(BodyType& body, Scalar h, Push const& push) {
    EqualSteps<Scalar> const steps = split_duration(h, step_for(body, h), counts_.steps_allowed);
    bool goes_on = true;
    for (int k = 1; k <= steps.count && goes_on; ++k) {
      push(body, k, steps);
      goes_on = took(body.step(steps.each), steps.each);
    }
    end_tick(h, steps);
    return goes_on;
  }

  // --- what advance() is made of --------------------------------------------------------------------------------------
  /// Finds the stable step of now, and what was guarded is so no more.
  void reset(BodyType& body) {
    guarded_ticks_ = 0, was_guarded_ = false;
    find_stable_step(body);
  }

  /// The largest step for a tick of h seconds.
  Scalar step_for(BodyType& body, Scalar h) {
    taken_ = 0, covered_ = 0;
    if (revision(body) == stable_for_ && !std::isfinite(stable_step_)) {   // nothing can fall, unless what was held was let go
      if (moves_ && !AnyStepIsStable<BodyType>) find_stable_step(body);
      if (!std::isfinite(stable_step_)) return stable_step_;
    } else if (revision(body) != stable_for_) {
      find_stable_step(body);
      guard(body);
    } else if (was_guarded_ && guarded_ticks_ == 0) {   // what moved so fast, or was cut, lies otherwise now
      find_stable_step(body);
      was_guarded_ = false;
    } else if (moves_ && ++ticks_unseen_ >= ticks_between_checks) {
      ticks_unseen_ = 0;
      ++counts_.stability_checks;
      if (body.stable_step_fell()) find_stable_step(body);
    }
    if (guarded_ticks_ == 0 && moves_ && --ticks_to_speed_ <= 0) {
      ticks_to_speed_ = ticks_between_speeds;
      if (body.velocities().cwiseAbs().maxCoeff() * h > Scalar(0.05) * body.mean_edge()) guard(body);
    }
    if (guarded_ticks_ == 0) return stable_step_;
    if (--guarded_ticks_ == 0) ticks_to_speed_ = 1;
    ++counts_.guarded;
    return std::min(stable_step_, guarded_step_);
  }

  /// What came of a step; whether the tick goes on.
  template <class Report>
  bool took(Report const& report, Scalar each) {
    ++taken_;
    moves_ = report.moving > 0;
    if (report)
      covered_ += static_cast<double>(each);
    else
      ++counts_.diverged;
    return static_cast<bool>(report);
  }
  /// After the steps of a tick of h seconds that was split so.
  void end_tick(Scalar h, EqualSteps<Scalar> const& steps) {
    if (steps.capped) ++counts_.capped, counts_.max_steps_wanted = std::max(counts_.max_steps_wanted, steps.wanted);
    ++counts_.ticks;
    counts_.seconds += static_cast<double>(h);
    if (double const left_out = static_cast<double>(h) - covered_; left_out > 1e-5 * static_cast<double>(h)) counts_.lag += left_out;   // not rounding
    counts_.steps += static_cast<std::uint64_t>(taken_);
    counts_.max_steps_a_tick = std::max(counts_.max_steps_a_tick, taken_);
  }
  /// So many seconds will have no tick.
  void leave_out(BodyType&, double seconds) noexcept { counts_.seconds += seconds, counts_.lag += seconds; }
  void allow(int steps) noexcept { counts_.steps_allowed = steps; }

  BodyCounts const& counts(BodyType const&) const noexcept { return counts_; }

 private:
  static constexpr int ticks_between_checks = 8;
  static constexpr int ticks_between_speeds = 4;
  static constexpr int guarded_at_once = 2;   // ticks

  static std::size_t revision(BodyType const& body) noexcept { return body.tissue().revision(); }

  void find_stable_step(BodyType& body) {
    stable_step_ = body.stable_step();
    stable_for_ = revision(body);
    ticks_unseen_ = 0;
    ++counts_.stable_steps;
    counts_.stable_step = static_cast<double>(stable_step_);
  }
  /// Keeps to the guaranteed step for the next ticks.
  void guard(BodyType const& body) {
    guarded_step_ = body.guaranteed_stable_step();
    guarded_ticks_ = guarded_at_once;
    was_guarded_ = true;
  }

  Scalar stable_step_ = 0, guarded_step_ = 0;   // s
  std::size_t stable_for_ = 0;                  // revision
  int ticks_unseen_ = 0, guarded_ticks_ = 0, ticks_to_speed_ = 0;
  bool was_guarded_ = false, moves_ = false;
  int taken_ = 0;        // steps of the tick so far
  double covered_ = 0;   // s, of these
  BodyCounts counts_;
};

}  // namespace palpate
