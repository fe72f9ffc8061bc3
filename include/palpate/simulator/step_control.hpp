// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/body/step_report.hpp>
#include <palpate/body/substeps.hpp>
#include <palpate/simulator/body_counts.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace palpate {

/// How long a body's steps may be, tick by tick. The stable step is found anew after every edit, and where the body, looked at every eight ticks while it moves,
/// says that it has fallen: a wound that opens under pre-tension grows stiffer. Just after a cut, and while a particle moves faster than 5 % of an edge a tick,
/// springs turn within a tick: then the steps are not above the body's guaranteed one, which holds wherever the body goes, of springs after Hooke.
/// Forces     that were applied before a tick act in each of its steps, of a body that has applied_force(i) [N]; of others in the first.
/// Limits     another body is not put in its place by assignment: its steps would be those of the first.
template <class BodyType>
class StepControl {
 public:
  using Scalar = typename BodyType::Scalar;
  /// What its decisions depend on, besides the body.
  struct State {
    Scalar stable_step = 0, guarded_step = 0;   // s
    std::size_t stable_for = 0;                 // revision
    int ticks_unseen = 0, guarded_ticks = 0, ticks_to_speed = 0;
    bool was_guarded = false, moves = false;
  };

  /// A tick of h seconds in the fewest equal steps that the body stands, at most so many: push(body, k, steps) before step k, from 1 on. False: it diverged.
  template <class Push>
  bool advance(BodyType& body, Scalar h, Push const& push) {
    EqualSteps<Scalar> const steps = split_duration(h, step_for(body, h), counts_.steps_allowed);
    begin_tick(body, steps);
    bool goes_on = true;
    for (int k = 1; k <= steps.count && goes_on; ++k) {
      apply_forces(body, k);
      push(body, k, steps);
      goes_on = took(body.step(steps.each), steps.each);
    }
    end_tick(h, steps);
    return goes_on;
  }

  // --- what advance() is made of --------------------------------------------------------------------------------------
  /// Finds the stable step of now, and what was guarded is so no more.
  void reset(BodyType& body) {
    now_.guarded_ticks = 0, now_.was_guarded = false;
    find_stable_step(body);
  }

  State const& save() const noexcept { return now_; }
  /// As it was, of the body as it was.
  void restore(State const& state) noexcept { now_ = state, counts_.stable_step = static_cast<double>(state.stable_step); }

  /// The largest step for a tick of h seconds.
  Scalar step_for(BodyType& body, Scalar h) {
    taken_ = 0, covered_ = 0;
    if (revision(body) == now_.stable_for && !std::isfinite(now_.stable_step)) {   // nothing can fall, unless what was held was let go
      if (now_.moves && !AnyStepIsStable<BodyType>) find_stable_step(body);
      if (!std::isfinite(now_.stable_step)) return now_.stable_step;
    } else if (revision(body) != now_.stable_for) {
      find_stable_step(body);
      guard(body);
    } else if (now_.was_guarded && now_.guarded_ticks == 0) {   // what moved so fast, or was cut, lies otherwise now
      find_stable_step(body);
      now_.was_guarded = false;
    } else if (now_.moves && ++now_.ticks_unseen >= ticks_between_checks) {
      now_.ticks_unseen = 0;
      ++counts_.stability_checks;
      if (body.stable_step_fell()) find_stable_step(body);
    }
    if (now_.guarded_ticks == 0 && now_.moves && --now_.ticks_to_speed <= 0) {
      now_.ticks_to_speed = ticks_between_speeds;
      if (body.velocities().cwiseAbs().maxCoeff() * h > Scalar(0.05) * body.mean_edge()) guard(body);
    }
    if (now_.guarded_ticks == 0) return now_.stable_step;
    if (--now_.guarded_ticks == 0) now_.ticks_to_speed = 1;
    ++counts_.guarded;
    return std::min(now_.stable_step, now_.guarded_step);
  }

  /// Before the steps of a tick: forces that were applied by now act in each of them.
  void begin_tick(BodyType const& body, EqualSteps<Scalar> const& steps) {
    applied_.clear();
    if constexpr (TellsAppliedForces<BodyType>)
      for (int i = 0; steps.count > 1 && i < body.size(); ++i)
        if (auto const force = body.applied_force(i); !is_zero(force)) applied_.push_back({i, force});
  }
  /// Before step k, from 1 on.
  void apply_forces(BodyType& body, int k) {
    if (k > 1)
      for (auto const& [i, force] : applied_) body.apply_force(i, force);
  }
  /// What came of a step; whether the tick goes on.
  template <class Report>
  bool took(Report const& report, Scalar each) {
    ++taken_;
    now_.moves = report.moving > 0;
    if (report)
      covered_ += static_cast<double>(each);
    else
      ++counts_.diverged;
    if constexpr (TellsInvertedElements<Report>)
      if (report && report.element >= 0) {
        ++counts_.inverted;
        auto const determinant = static_cast<double>(report.determinant);
        if (!(determinant >= counts_.lowest_determinant)) counts_.inverted_element = report.element, counts_.lowest_determinant = determinant;
      }
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
    now_.stable_step = body.stable_step();
    now_.stable_for = revision(body);
    now_.ticks_unseen = 0;
    ++counts_.stable_steps;
    counts_.stable_step = static_cast<double>(now_.stable_step);
  }
  /// Keeps to the guaranteed step for the next ticks.
  void guard(BodyType const& body) {
    now_.guarded_step = body.guaranteed_stable_step();
    now_.guarded_ticks = guarded_at_once;
    now_.was_guarded = true;
  }

  State now_;
  int taken_ = 0;        // steps of the tick so far
  double covered_ = 0;   // s, of these
  std::vector<std::pair<int, typename BodyType::Vector>> applied_;   // N, to particles, before the tick
  BodyCounts counts_;
};

}  // namespace palpate
