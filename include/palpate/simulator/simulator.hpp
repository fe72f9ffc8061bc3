// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/soft_body.hpp>
#include <palpate/core/event_ring.hpp>
#include <palpate/simulator/simulation.hpp>
#include <palpate/simulator/tool_recordings.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>
#include <utility>

namespace palpate {

namespace detail {

/// What makes a simulator together.
template <class Device, class Body, class C, class Force>
concept MakeSimulator = CutterFor<C, Body> && HapticDevice<Device, typename DeviceScalarOf<Device, typename Body::Scalar>::type> && RendersForce<Force, typename Body::Scalar>;

template <class Tool, class Body>
concept ToolOf = MakeSimulator<typename Tool::Device, Body, typename Tool::Cutter, typename Tool::Force>;
template <class... Tools>
inline constexpr bool are_tools = sizeof...(Tools) > 0 && (is_tool<Tools> && ...);

struct NothingToSay {};
enum class Order { right, swapped, said };   // of the parts; said: the body's own sentence
template <class Device, class Body>
inline constexpr Order order_of = IsRefused<Body> ? Order::said : SimulatedBody<Device> || HoldsBodies<Device> || !HasRealScalar<Body> ? Order::swapped : Order::right;
/// Says, where it is instantiated, what keeps these from it.
template <class Device, class Body, class C, class Force, Order order = order_of<Device, Body>>
struct SimulatorSentences {};
template <class Device, class Body, class C, class Force>
struct SimulatorSentences<Device, Body, C, Force, Order::swapped> {
  static_assert(order_of<Device, Body> != Order::swapped, "Simulator: there is no body where one belongs: Simulator simulator(device, body, cutter, force), or with tools Simulator simulator(body, Tool(device, cutter, force)).");
};
template <class Device, class Body, class C, class Force>
struct SimulatorSentences<Device, Body, C, Force, Order::right>
    : DeviceSentences<Device, typename DeviceScalarOf<Device, typename Body::Scalar>::type>, CutterSentences<C, Body>, ForceSentences<Force, typename Body::Scalar>,
      std::conditional_t<SimulatedBody<Body> || HoldsBodies<Body>, NothingToSay, BodySentences<Body>> {
  static_assert(SimulatedBody<Body> || HoldsBodies<Body>, "Simulator: the second argument is no SimulatedBody; see palpate/body/concept.hpp, or use a SoftBody.");
};

}  // namespace detail

/// Parts of which not even the number is right.
template <class... Parts>
class Simulator {
  static_assert(sizeof...(Parts) == 0, "palpate: a Simulator takes a device, a body, a cutter and a force, and SimulatorOptions if there are any; or a body, SimulatorOptions if there are any, and Tools.");

 public:
  using Refused = void;

  explicit Simulator(Parts const&...) {}
};

/// A whole simulator: hand → device → contact → tissue → cut → force → hand.
///
///   Simulator simulator(Stroke{}, std::move(body), ProgressiveCutter<double>({.puncture_depth = 0.006}), force);
///   Recording const session = simulator.run(3.6);
///
/// run            lock-step on a virtual clock: every servo tick reads the device, ticks the body, answers. The same inputs and
///                seeds give the same bytes. It goes as fast as it can and no clock is looked at: gaps between ticks are not seen, and what is
///                limited per second is limited per so many ticks. So a real device, one that moves a hand, belongs in run_realtime.
/// run_realtime   the same parts on two threads: the servo at the device's rate on a local model, the body at its own rate.
///                Between them are a triple buffer for the tool's pose and one for the local model; nothing waits, nothing locks.
///                Ticks are counted, not the clock: where the servo came too late for some, the run ends that much later.
///                A device with a clock of its own calls the servo from its driver's thread.
/// Units          s, Hz, m, N.
/// Errors         InvalidArgument for a duration or rate that makes no sense. An exception in the body's thread ends the run with
///                a force of zero and is thrown again by run_realtime. Error where a device's own clock stands still for a second.
/// Threads        runs, and what a host's loop calls, from one thread at a time; snapshots() may be read from another one meanwhile.
template <class Device, class Body, class CutterType, class Force>
  requires(!detail::is_tool<Body> && detail::MakeSimulator<Device, Body, CutterType, Force>)
class Simulator<Device, Body, CutterType, Force> : detail::Simulation<Body, Tool<Device, CutterType, Force>> {
  using All = detail::Simulation<Body, Tool<Device, CutterType, Force>>;

 public:
  using Scalar = typename Body::Scalar;

  Simulator(Device device, Body its_body, CutterType cutter, Force force, SimulatorOptions const& options = {})
      : All(std::move(its_body), options, Tool(std::move(device), std::move(cutter), std::move(force))) {}

  /// Runs `seconds` of simulated time in lock-step, after what was run before; not for a device in somebody's hand. `after_tick(tick)` is called once a tick,
  /// if given.
  template <class AfterTick>
  Recording run(double seconds, AfterTick after_tick) {
    return std::move(All::run(seconds, [&](std::span<Tick const> ticks) { after_tick(ticks[0]); })[0]);
  }
  Recording run(double seconds) {
    return run(seconds, [](Tick const&) {});
  }
  /// Runs `seconds` of real time on two threads: this one becomes the body's, a new one the servo.
  Recording run_realtime(double seconds) { return std::move(All::run_realtime(seconds)[0]); }
  using All::stop;

  // --- for a host that owns the loop ------------------------------------------------------------------------------------
  /// Both halves, in lock-step: as many whole servo ticks as there are in h seconds and what was left over before, and after_tick(tick) after each. Returns their
  /// number. The device is opened the first time, and stays open until close(), a run or the end of the simulator, which is not to be moved meanwhile.
  template <class AfterTick>
  std::uint64_t tick(double h, AfterTick after_tick) {
    return All::tick(h, [&](std::span<Tick const> ticks) { after_tick(ticks[0]); });
  }
  std::uint64_t tick(double h) {
    return tick(h, [](Tick const&) {});
  }
  using All::start, All::tick_body, All::close;
  /// Ends the servo, if it still runs, and closes the device.
  Recording finish() { return std::move(All::finish()[0]); }

  /// The ticks of a run in real time as they happen, for one other thread: pop() them; what finds no room, more than a second's, is not kept there, but in the recording.
  EventRing<Tick, 1024>& live_ticks() noexcept { return *servo().ticks; }

  using All::body, All::mark, All::restore, All::time, All::snapshots, All::forecast;
  CutterType& cutter() noexcept { return All::loop().cutter(); }
  CutterType const& cutter() const noexcept { return All::loop().cutter(); }
  Force& force() noexcept { return servo().loop.force(); }
  Device& device() noexcept { return servo().loop.device(); }

  /// What the safety chain does, told as it happens: pop() them from one thread, this one or another. 256 are kept.
  ServoEvents& events() noexcept { return servo().loop.events(); }
  /// The last stage of the servo: what it is about, how warm the motors are, the energy. Between runs, or from `after_tick`.
  SafetyChain<Scalar> const& safety() const noexcept { return servo().loop.chain(); }
  WorkspaceMapping<Scalar> const& mapping() const noexcept { return servo().loop.mapping(); }

  /// What was counted so far: between runs, or from `after_tick`.
  SimulatorStatistics statistics() const { return All::template statistics<0>(); }
  /// statistics() while a run goes on, from any number of other threads: at most 50 ticks old.
  SimulatorStatistics live_statistics() const noexcept { return servo().live->statistics(); }
  /// What the servo's thread of the last real-time run, or of the one that goes on, was granted of `SimulatorOptions::realtime`.
  RealtimeReport realtime_report() const noexcept { return servo().live->report(); }

 private:
  auto& servo() noexcept { return All::template servo<0>(); }
  auto const& servo() const noexcept { return All::template servo<0>(); }
};

/// The same with any number of tools, each with its own device, force and safety chain.
///
///   Simulator simulator(std::move(body), Tool(left, ProgressiveCutter<double>(), force), Tool(right, NoCutter<double>(), TissueReaction{}));
///   ToolRecordings const session = simulator.run(3.6);
///
/// run            lock-step: every tick reads all devices, ticks the body once with all tools, and answers each. Tools touch, cut and push in the order of their
///                keys, so that the same tools in other places with the same keys give the same bytes. Their devices have one rate.
/// run_realtime   a servo thread, or driver, for each device, each at its own rate; this thread becomes the body's. A device that fails stops its own tool's force
///                alone; but one whose own clock stands still for a second ends the run, as above. Else it ends when the last servo has.
/// Members        as above; what belongs to one tool has its place as an argument: force<1>(). tool<1>() is its cutter.
template <class Body, class... Tools>
  requires(detail::are_tools<Tools...> && (detail::ToolOf<Tools, Body> && ...))
class Simulator<Body, Tools...> : detail::Simulation<Body, Tools...> {
  using All = detail::Simulation<Body, Tools...>;

 public:
  using Scalar = typename Body::Scalar;

  explicit Simulator(Body its_body, Tools... tools) : Simulator(std::move(its_body), SimulatorOptions{}, std::move(tools)...) {}
  Simulator(Body its_body, SimulatorOptions const& options, Tools... tools) : All(std::move(its_body), options, std::move(tools)...) {}

  /// after_tick(ticks), if given: a std::span<Tick const> with that of each tool.
  template <class AfterTick>
  ToolRecordings run(double seconds, AfterTick after_tick) {
    return ToolRecordings(All::run(seconds, after_tick));
  }
  ToolRecordings run(double seconds) {
    return run(seconds, [](std::span<Tick const>) {});
  }
  ToolRecordings run_realtime(double seconds) { return ToolRecordings(All::run_realtime(seconds)); }
  template <class AfterTick>
  std::uint64_t tick(double h, AfterTick after_tick) {
    return All::tick(h, after_tick);
  }
  std::uint64_t tick(double h) {
    return tick(h, [](std::span<Tick const>) {});
  }
  ToolRecordings finish() { return ToolRecordings(All::finish()); }
  using All::body, All::mark, All::restore, All::time, All::snapshots, All::forecast, All::statistics, All::stop, All::start, All::tick_body, All::close;

  template <std::size_t I>
  auto& tool() noexcept {
    return All::loop().template tool<I>().cutter();
  }
  template <std::size_t I>
  auto const& tool() const noexcept {
    return All::loop().template tool<I>().cutter();
  }
  template <std::size_t I>
  auto& force() noexcept {
    return All::template servo<I>().loop.force();
  }
  template <std::size_t I>
  auto& device() noexcept {
    return All::template servo<I>().loop.device();
  }
  template <std::size_t I>
  EventRing<Tick, 1024>& live_ticks() noexcept {
    return *All::template servo<I>().ticks;
  }
  template <std::size_t I>
  ServoEvents& events() noexcept {
    return All::template servo<I>().loop.events();
  }
  template <std::size_t I>
  SafetyChain<Scalar> const& safety() const noexcept {
    return All::template servo<I>().loop.chain();
  }
  template <std::size_t I>
  WorkspaceMapping<Scalar> const& mapping() const noexcept {
    return All::template servo<I>().loop.mapping();
  }
  template <std::size_t I>
  SimulatorStatistics live_statistics() const noexcept {
    return All::template servo<I>().live->statistics();
  }
  template <std::size_t I>
  RealtimeReport realtime_report() const noexcept {
    return All::template servo<I>().live->report();
  }
};

/// Parts that make no simulator: what is wrong, in a sentence each, and nothing that could fail besides.
template <class Device, class Body, class CutterType, class Force>
  requires(!detail::is_tool<Device> && !detail::is_tool<Body> && !detail::MakeSimulator<Device, Body, CutterType, Force>)
class Simulator<Device, Body, CutterType, Force> : detail::SimulatorSentences<Device, Body, CutterType, Force> {
 public:
  using Refused = void;

  Simulator(Device const&, Body const&, CutterType const&, Force const&, SimulatorOptions const& = {}) {}
};

template <class Body, class... Tools>
  requires(!detail::is_tool<Body> && detail::are_tools<Tools...> && !(detail::ToolOf<Tools, Body> && ...))
class Simulator<Body, Tools...> {
 public:
  using Refused = void;

  explicit Simulator(Body const&, Tools const&...) {}
  Simulator(Body const&, SimulatorOptions const&, Tools const&...) {}

 private:
  std::tuple<detail::SimulatorSentences<typename Tools::Device, Body, typename Tools::Cutter, typename Tools::Force>...> sentences_;
};

template <class First, class... Others>
  requires(detail::is_tool<First>)
class Simulator<First, Others...> {
  static_assert(!detail::is_tool<First>, "palpate: a Simulator takes the body first, then its tools: Simulator simulator(std::move(body), Tool(device, cutter, force), Tool(...)).");

 public:
  using Refused = void;

  explicit Simulator(First const&, Others const&...) {}
};

template <class Body, class First, class... Others>
  requires(!detail::is_tool<Body> && detail::is_tool<First> && !detail::are_tools<First, Others...>)
class Simulator<Body, First, Others...> {
  static_assert(detail::are_tools<First, Others...>,
                "palpate: a Simulator takes the body, then SimulatorOptions if there are any, then its tools: Simulator simulator(std::move(body), options, Tool(device, cutter, force), Tool(...)).");

 public:
  using Refused = void;

  Simulator(Body const&, First const&, Others const&...) {}
};

template <class... Parts>
Simulator(Parts...) -> Simulator<Parts...>;
template <class Device, class Body, class CutterType, class Force>
  requires(!detail::is_tool<Device> && !detail::is_tool<Body> && !detail::is_tool<CutterType>)
Simulator(Device, Body, CutterType, Force) -> Simulator<Device, Body, CutterType, Force>;
template <class Device, class Body, class CutterType, class Force>
  requires(!detail::is_tool<Device> && !detail::is_tool<Body>)
Simulator(Device, Body, CutterType, Force, SimulatorOptions) -> Simulator<Device, Body, CutterType, Force>;
template <class First, class... Others>
  requires(detail::is_tool<First>)
Simulator(First, Others...) -> Simulator<First, Others...>;
template <class Body, class First, class... Others>
  requires(!detail::is_tool<Body> && detail::is_tool<First> && !detail::are_tools<First, Others...>)
Simulator(Body, First, Others...) -> Simulator<Body, First, Others...>;
template <class Body, class... Tools>
  requires(detail::are_tools<Tools...> && !detail::is_tool<Body>)
Simulator(Body, Tools...) -> Simulator<Body, Tools...>;
template <class Body, class... Tools>
  requires(detail::are_tools<Tools...> && !detail::is_tool<Body>)
Simulator(Body, SimulatorOptions, Tools...) -> Simulator<Body, Tools...>;

}  // namespace palpate
