// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/substeps.hpp>
#include <palpate/core/for_each_place.hpp>
#include <palpate/simulator/body_tool.hpp>
#include <palpate/simulator/step_control.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <utility>

namespace palpate {

/// Where a tool is in a tick, once it has been anywhere; how often it was placed anew is the servo's count.
template <RealScalar Scalar>
struct PlacedTool {
  bool is_placed = false;
  ToolPose<Scalar> pose{};
  std::uint64_t pose_discontinuities = 0;
};

/// The body's side of a simulation: contact → cut → step, once a tick, of one tool or of several.
/// A tick is split into the fewest equal steps that the body stands; see StepControl. Each tool is coupled to the tissue in each of these steps; see BodyTool.
/// Where that would be more steps than allowed, those allowed are taken, each a stable one: the body then lags behind the hand, it
/// does not diverge; but see docs/simulator.md for tissue that hardens.
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
      : body_(std::move(body)), tools_(std::move(made)), order_(order) {
    control_.allow(max_steps);
    control_.reset(body_);
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
      detail::for_each_place<tools>([&](auto i) {
        if (i == k) use(i, std::get<i>(tools_));
      });
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
  void sense_surface(SurfaceKind kind, SurfaceSensorOptions const& options = {})
    requires(tools == 1)
  {
    std::get<0>(tools_).sense_surface(kind, options);
  }

  /// So many seconds will have no tick: the body's thread came too late for them.
  void leave_out(double seconds) noexcept { control_.leave_out(body_, seconds); }

  /// Brings the body back to a state it was in. The tool has to come from outside again.
  template <class State>
  void restore(State const& state) {
    body_.restore(state);
    for_each_tool([](std::size_t, auto& tool) { tool.forget_press(); });
    control_.reset(body_);
  }

  BodyType& body() noexcept { return body_; }
  BodyType const& body() const noexcept { return body_; }
  auto& cutter() noexcept { return std::get<0>(tools_).cutter(); }
  auto const& cutter() const noexcept { return std::get<0>(tools_).cutter(); }
  decltype(auto) counts() const noexcept { return control_.counts(body_); }
  Scalar stable_step() const noexcept { return static_cast<Scalar>(counts().stable_step); }

 private:
  void step(Scalar h) {
    bool is_free = true;
    for_each_tool([&](std::size_t, auto& tool) { is_free = is_free && tool.cutter().state() == CuttingPhase::no_contact; });
    if (is_free) diverged_ = false;
    bool const goes_on = control_.advance(body_, h, [&](auto& body, int k, EqualSteps<Scalar> const& steps) {
      for_each_tool([&](std::size_t, auto& tool) { tool.push(body, k, steps.count, steps.each); });
    });
    if (!goes_on) diverged_ = true;
  }

  BodyType body_;
  std::tuple<BodyTool<BodyType, Cutters>...> tools_;
  Order order_;
  StepControl<BodyType> control_;
  bool diverged_ = false;
};

template <class BodyType, class CutterType>
BodyLoop(BodyType, CutterType, ContactCoupling, int) -> BodyLoop<BodyType, CutterType>;

}  // namespace palpate
