// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/substeps.hpp>
#include <palpate/simulator/body_tool.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <utility>

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

/// Where a tool is in a tick, once it has been anywhere; how often it was placed anew is the servo's count.
template <RealScalar Scalar>
struct PlacedTool {
  bool is_placed = false;
  ToolPose<Scalar> pose{};
  std::uint64_t pose_discontinuities = 0;
};

/// The body's side of a simulation: contact → cut → step, once a tick, of one tool or of several.
/// A tick is split into the fewest equal steps not above the body's stable step, which is found anew after every cut, and where the body,
/// looked at every eight ticks while it moves, says that it has fallen: a wound that opens under pre-tension grows stiffer. Just after a cut,
/// and while a particle moves faster than 5 % of an edge a tick, springs turn within a tick: then the steps are not above the body's
/// guaranteed one, which holds wherever the body goes. Each tool is coupled to the tissue in each of these steps; see BodyTool.
/// Where that would be more steps than allowed, those allowed are taken, each a stable one: the body then lags behind the hand, it
/// does not diverge.
/// After a step that diverged the local model says so, until every tip is out of the tissue and the body moves again.
/// Tools      touch, cut and push one after the other, in the order of their keys.
template <class BodyType, class... Cutters>
class BodyLoop {
 public:
  using Scalar = typename BodyType::Scalar;
  using Vector = Vector3<Scalar>;
  static constexpr std::size_t tools = sizeof...(Cutters);
  using Order = std::array<std::size_t, tools>;   // places of the tools
  using Models = std::array<LocalModel<Scalar>, tools>;

  /// Tools in their places, and in which order they act.
  BodyLoop(BodyType body, std::tuple<BodyTool<BodyType, Cutters>...> made, Order const& order, int max_steps)
      : body_(std::move(body)), tools_(std::move(made)), order_(order), max_steps_(max_steps) {
    counts_.steps_allowed = max_steps;
    find_stable_step();
  }
  template <class CutterType>
    requires(tools == 1)
  BodyLoop(BodyType body, CutterType cutter, ContactCoupling const& coupling, int max_steps)
      : BodyLoop(std::move(body), std::tuple(BodyTool<BodyType, CutterType>(std::move(cutter), coupling)), {0}, max_steps) {}

  /// Moves the tools through a tick of h seconds and returns what their servos need to know: of those that are placed.
  Models tick(std::array<PlacedTool<Scalar>, tools> const& placed, Scalar h) {
    for_each_tool([&](std::size_t k, auto& tool) {
      if (placed[k].is_placed)
        tool.advance(body_, placed[k].pose, placed[k].pose_discontinuities);
      else
        tool.rest();
    });
    step(h);
    Models models;
    for_each_tool([&](std::size_t k, auto& tool) {
      if (placed[k].is_placed) models[k] = tool.model(body_, diverged_);
    });
    return models;
  }
  /// The same of one tool; see BodyTool::advance.
  LocalModel<Scalar> tick(ToolPose<Scalar> const& tool, Scalar h, std::uint64_t pose_discontinuities = 0)
    requires(tools == 1)
  {
    return tick(std::array{PlacedTool<Scalar>{true, tool, pose_discontinuities}}, h)[0];
  }
  /// A tick without a tool.
  void rest(Scalar h) { tick(std::array<PlacedTool<Scalar>, tools>{}, h); }

  /// use(place, tool) in the order in which they act.
  template <class Use>
  void for_each_tool(Use const& use) {
    for (std::size_t const k : order_)
      [&]<std::size_t... I>(std::index_sequence<I...>) { ((I == k ? use(I, std::get<I>(tools_)) : void()), ...); }(std::index_sequence_for<Cutters...>{});
  }
  template <std::size_t I>
  auto& tool() noexcept {
    return std::get<I>(tools_);
  }
  template <std::size_t I>
  auto const& tool() const noexcept {
    return std::get<I>(tools_);
  }

  /// From now on local models hold the surface too, as a force wants it.
  void sense_surface(SurfaceKind kind)
    requires(tools == 1)
  {
    std::get<0>(tools_).sense_surface(kind);
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
    for_each_tool([](std::size_t, auto& tool) { tool.forget_press(); });
    guarded_ticks_ = 0;
    was_guarded_ = false;
    find_stable_step();
  }

  BodyType& body() noexcept { return body_; }
  BodyType const& body() const noexcept { return body_; }
  auto& cutter() noexcept { return std::get<0>(tools_).cutter(); }
  auto const& cutter() const noexcept { return std::get<0>(tools_).cutter(); }
  BodyCounts const& counts() const noexcept { return counts_; }
  Scalar stable_step() const noexcept { return stable_step_; }

 private:
  static constexpr int ticks_between_checks = 8;
  static constexpr int ticks_between_speeds = 4;
  static constexpr int guarded_at_once = 2;   // ticks

  std::size_t revision() const noexcept { return body_.tissue().revision(); }

  void step(Scalar h) {
    auto const [steps, each, capped, wanted] = split_duration(h, step_for(h), max_steps_);
    if (capped) ++counts_.capped, counts_.max_steps_wanted = std::max(counts_.max_steps_wanted, wanted);
    bool is_free = true;
    for_each_tool([&](std::size_t, auto& tool) { is_free = is_free && tool.cutter().state() == CuttingPhase::no_contact; });
    if (is_free) diverged_ = false;
    int taken = 0;
    double covered = 0;   // s
    while (taken < steps) {
      ++taken;
      for_each_tool([&](std::size_t, auto& tool) { tool.push(body_, taken, steps, each); });
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
  std::tuple<BodyTool<BodyType, Cutters>...> tools_;
  Order order_;
  int max_steps_;
  Scalar stable_step_ = 0;
  std::size_t stable_for_ = 0;
  int ticks_unseen_ = 0;
  int guarded_ticks_ = 0;
  int ticks_to_speed_ = 0;
  bool was_guarded_ = false;
  Scalar guarded_step_ = 0;
  bool moves_ = false;
  bool diverged_ = false;
  BodyCounts counts_;
};

template <class BodyType, class CutterType>
BodyLoop(BodyType, CutterType, ContactCoupling, int) -> BodyLoop<BodyType, CutterType>;

}  // namespace palpate
