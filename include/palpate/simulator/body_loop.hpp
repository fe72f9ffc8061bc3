// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/body/shape_of.hpp>
#include <palpate/body/substeps.hpp>
#include <palpate/core/tool_pose.hpp>
#include <palpate/cutting/concept.hpp>
#include <palpate/haptics/contact_coupling.hpp>
#include <palpate/haptics/local_model.hpp>
#include <palpate/haptics/surface_sensor.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace palpate {

/// What happened on the body's side.
struct BodyCounts {
  std::uint64_t ticks = 0;
  std::uint64_t steps = 0;           ///< body steps; more than ticks where a tick was split
  std::uint64_t capped = 0;          ///< ticks that wanted more steps than allowed; the rest of the tick is left out
  std::uint64_t stable_steps = 0;    ///< how often the stable step was found anew
  std::uint64_t stability_checks = 0;           ///< how often a body in motion was looked at, whether its stable step had fallen
  std::uint64_t guarded = 0;         ///< ticks in which tissue moved so fast that the guaranteed step was kept
  std::uint64_t diverged = 0;        ///< steps refused because they diverged; the rest of the tick is left out
  int max_steps_a_tick = 0;
  int max_steps_wanted = 0;          ///< of a capped tick; 1e9 where no step is stable
  int steps_allowed = 0;             ///< in a tick: SimulatorOptions::max_body_steps
  double stable_step = 0.0;          ///< s, the last one found; infinite where any step is stable
  double seconds = 0.0;              ///< of simulated time, that the ticks were to cover
  double lag = 0.0;                  ///< s of that, which were left out: the body is so far behind the hand
};

/// The body's side of a simulation: contact → cut → step, once a tick.
/// A tick is split into the fewest equal steps not above the body's stable step, which is found anew after every cut, and where the body,
/// looked at every eight ticks while it moves, says that it has fallen: a wound that opens under pre-tension grows stiffer. Just after a cut,
/// and while a particle moves faster than 5 % of an edge a tick, springs turn within a tick: then the steps are not above the body's
/// guaranteed one, which holds wherever the body goes. While the tool indents, the touched point is coupled to the tip in each of these steps, and so is the point at a blade that is held across its
/// edge, or that a solid resists; the tip moves evenly through the tick.
/// Where that would be more steps than allowed, those allowed are taken, each a stable one: the body then lags behind the hand, it
/// does not diverge.
/// After a step that diverged the local model says so, until the tip is out of the tissue and the body moves again.
template <class BodyType, class CutterType>
class BodyLoop {
  static_assert(SimulatedBody<BodyType> && Cutter<CutterType, BodyType>);

 public:
  using Scalar = typename BodyType::Scalar;
  using Vector = Vector3<Scalar>;

  BodyLoop(BodyType body, CutterType cutter, ContactCoupling const& coupling, int max_steps)
      : body_(std::move(body)), cutter_(std::move(cutter)), coupling_(coupling), max_steps_(max_steps) {
    counts_.steps_allowed = max_steps;
    find_stable_step();
  }

  /// Moves the tool through a tick of h seconds, its tip evenly, and returns what the servo needs to know. Where `pose_discontinuities`, the servo's count, has
  /// changed, the tool was not moved there but placed: nothing is touched or cut on the way, a cut in progress ends where the blade was, and the tip has to
  /// come from outside again. A cutter without `reset(body)` can not be told.
  LocalModel<Scalar> tick(ToolPose<Scalar> const& tool, Scalar h, std::uint64_t pose_discontinuities = 0) {
    Vector const &tip = tool.position, &velocity = tool.velocity;
    if (pose_discontinuities != pose_discontinuities_) {
      pose_discontinuities_ = pose_discontinuities;
      take_tool_away();
    }
    Vector const from = ticked_ ? last_tip_ : tip;
    last_tip_ = tip;
    ticked_ = true;
    if constexpr (FeelsReaction<CutterType, BodyType>)
      cutter_.advance(body_, tool, pressed_);
    else
      cutter_.advance(body_, tool);
    bool const presses = cutter_.state() == CuttingPhase::indenting;
    Vector reaction = Vector::Zero();
    step(h, [&](int i, int steps, Scalar each) {
      Vector const now = from + (tip - from) * (Scalar(i) / Scalar(steps));
      if constexpr (HoldsTissue<CutterType, BodyType>)
        if (auto const held = cutter_.held(body_))
          reaction += coupling_.drag(body_, *held, cutter_.contact().normal, now, velocity, each) / Scalar(steps);
      if constexpr (ResistsBlade<CutterType, BodyType>)
        if (auto const grip = cutter_.grip()) reaction += coupling_.resist(body_, *grip, tip - now, velocity, each) / Scalar(steps);
      if (!presses) return;
      reaction += coupling_.apply(body_, cutter_.contact(), now, velocity, cutter_.tip_radius(), each) / Scalar(steps);
    });
    pressed_ = reaction.norm();

    LocalModel<Scalar> model;
    SurfaceContact<Scalar> const& contact = cutter_.contact();
    model.phase = cutter_.state();
    model.diverged = diverged_;
    model.restorations = body_.restorations();
    if (model.phase != CuttingPhase::no_contact) {
      model.home_point = contact.home_point;
      model.normal = contact.normal;
      model.tip_radius = cutter_.tip_radius();
      model.tissue_force = reaction;
    }
    if constexpr (CountsArea<CutterType>) model.cut_area = cutter_.area();
    if (sensor_.kind() != SurfaceKind::none)
      model.surface = sensor_.look(detail::shape_of(body_), contact, model.phase, tip, cutter_.tip_radius(), static_cast<Scalar>(coupling_.stiffness));
    return model;
  }

  /// From now on local models hold the surface too, as a force wants it.
  void sense_surface(SurfaceKind kind) { sensor_ = SurfaceSensor<Scalar>(kind); }

  /// A tick without a tool.
  void rest(Scalar h) {
    step(h, [](int, int, Scalar) {});
  }
  /// So many seconds will have no tick: the body's thread came too late for them.
  void leave_out(double seconds) noexcept {
    counts_.seconds += seconds;
    counts_.lag += seconds;
  }

  /// Brings the body back to a state it was in. The tool has to come from outside again.
  template <class State>
  void restore(State const& state) {
    body_.restore(state);
    pressed_ = 0;
    guarded_ticks_ = 0;
    was_guarded_ = false;
    find_stable_step();
  }

  BodyType& body() noexcept { return body_; }
  BodyType const& body() const noexcept { return body_; }
  CutterType& cutter() noexcept { return cutter_; }
  CutterType const& cutter() const noexcept { return cutter_; }
  BodyCounts const& counts() const noexcept { return counts_; }
  Scalar stable_step() const noexcept { return stable_step_; }

 private:
  static constexpr int ticks_between_checks = 8;
  static constexpr int ticks_between_speeds = 4;
  static constexpr int guarded_at_once = 2;   // ticks

  void take_tool_away() {
    if constexpr (ResettableCutter<CutterType, BodyType>) cutter_.reset(body_);
    ticked_ = false;
    pressed_ = 0;
  }

  std::size_t revision() const noexcept { return body_.tissue().revision(); }

  /// The steps of one tick; `before(i, steps, each)` is called before each of them, i from 1 to steps, each so many seconds.
  template <class Before>
  void step(Scalar h, Before before) {
    auto const [steps, each, capped, wanted] = split_duration(h, step_for(h), max_steps_);
    if (capped) ++counts_.capped, counts_.max_steps_wanted = std::max(counts_.max_steps_wanted, wanted);
    if (cutter_.state() == CuttingPhase::no_contact) diverged_ = false;
    int taken = 0;
    double covered = 0;   // s
    while (taken < steps) {
      before(++taken, steps, each);
      auto const report = body_.step(each);
      moves_ = report.moving > 0;
      if (report) {
        covered += static_cast<double>(each);
        continue;
      }
      ++counts_.diverged;
      diverged_ = true;
      break;
    }
    ++counts_.ticks;
    counts_.seconds += static_cast<double>(h);
    if (double const left_out = static_cast<double>(h) - covered; left_out > 1e-5 * static_cast<double>(h)) counts_.lag += left_out;   // not rounding
    counts_.steps += static_cast<std::uint64_t>(taken);
    counts_.max_steps_a_tick = std::max(counts_.max_steps_a_tick, taken);
  }

  void find_stable_step() {
    stable_step_ = body_.stable_step();
    stable_for_ = revision();
    ticks_unseen_ = 0;
    ++counts_.stable_steps;
    counts_.stable_step = static_cast<double>(stable_step_);
  }

  /// The largest step for a tick of h seconds.
  Scalar step_for(Scalar h) {
    if (revision() == stable_for_ && !std::isfinite(stable_step_)) return stable_step_;   // nothing can fall
    if (revision() != stable_for_) {
      find_stable_step();
      guard();
    } else if (was_guarded_ && guarded_ticks_ == 0) {   // what moved so fast, or was cut, lies otherwise now
      find_stable_step();
      was_guarded_ = false;
    } else if (moves_ && ++ticks_unseen_ >= ticks_between_checks) {
      look_at_stable_step();
    }
    if (guarded_ticks_ == 0 && moves_ && --ticks_to_speed_ <= 0) {
      ticks_to_speed_ = ticks_between_speeds;
      if (body_.velocities().cwiseAbs().maxCoeff() * h > Scalar(0.05) * body_.mean_edge()) guard();
    }
    if (guarded_ticks_ == 0) return stable_step_;
    if (--guarded_ticks_ == 0) ticks_to_speed_ = 1;
    ++counts_.guarded;
    return std::min(stable_step_, guarded_step_);
  }

  /// Keeps to the guaranteed step for the next ticks.
  void guard() {
    guarded_step_ = body_.guaranteed_stable_step();
    guarded_ticks_ = guarded_at_once;
    was_guarded_ = true;
  }

  void look_at_stable_step() {
    ticks_unseen_ = 0;
    ++counts_.stability_checks;
    if (body_.stable_step_fell()) find_stable_step();
  }

  BodyType body_;
  CutterType cutter_;
  ContactCoupling coupling_;
  SurfaceSensor<Scalar> sensor_;
  int max_steps_;
  Scalar stable_step_ = 0;
  std::size_t stable_for_ = 0;
  int ticks_unseen_ = 0;
  int guarded_ticks_ = 0;
  int ticks_to_speed_ = 0;
  bool was_guarded_ = false;
  Scalar guarded_step_ = 0;
  bool moves_ = false;
  Vector last_tip_ = Vector::Zero();
  bool ticked_ = false;
  std::uint64_t pose_discontinuities_ = 0;
  bool diverged_ = false;
  Scalar pressed_ = 0;   // N, of the last tick
  BodyCounts counts_;
};

}  // namespace palpate
