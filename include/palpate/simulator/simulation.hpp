// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/for_each_place.hpp>
#include <palpate/device/session.hpp>
#include <palpate/simulator/body_loop.hpp>
#include <palpate/simulator/budget.hpp>
#include <palpate/simulator/pacer.hpp>
#include <palpate/simulator/realtime_servo.hpp>
#include <palpate/simulator/snapshot.hpp>
#include <palpate/simulator/tool.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

namespace palpate {

struct SimulatorOptions {
  ContactCoupling coupling = {};
  int max_body_steps = 100;      ///< a tick is split into no more body steps than this; where it needs more, the body lags behind
  double body_rate = 500.0;       ///< Hz, of the body's thread in real time; in lock-step the body is ticked with the servo
  double snapshot_rate = 60.0;    ///< Hz of simulated time, how often a snapshot is published for drawing
  ServoOptions servo = {};        ///< safety, frames, clutch, trocar
  RealtimeOptions realtime = {};  ///< what a servo's thread asks of the system in real time; by default what needs no rights

  void validate() const {
    coupling.validate();
    realtime.validate();
    if (max_body_steps < 1) throw InvalidArgument(detail::message("max_body_steps is ", max_body_steps, "; a tick needs at least one"));
    for (double const rate : {body_rate, snapshot_rate}) static_cast<void>(Pacer::period_of(rate));   // throws
  }
};

namespace detail {

/// A body and its tools, in lock-step and in real time: what Simulator is made of.
template <class BodyType, class... Tools>
class Simulation {
 public:
  using Body = BodyType;
  using Scalar = typename Body::Scalar;
  static constexpr std::size_t tools = sizeof...(Tools);

  Simulation(Body body, SimulatorOptions const& options, Tools... made)
      : options_((options.validate(), options)),
        servos_(Servo<Tools>{.loop{std::move(made.device), std::move(made.force), servo_of(made.options, options)}}...),
        loop_(std::move(body), std::tuple(BodyTool<Body, typename Tools::Cutter>(std::move(made.cutter), coupling_of(made, options))...),
              order_of({made.options.key...}), options.max_body_steps),
        snapshots_(std::make_unique<SnapshotChannel<Scalar>>()),
        flags_(std::make_unique<RunFlags>()) {
    for_each_servo([&]<std::size_t I>(std::integral_constant<std::size_t, I>, auto& servo) {
      using Force = std::remove_cvref_t<decltype(servo.loop.force())>;
      if constexpr (Validatable<Force>) servo.loop.force().validate();
      if constexpr (SurfaceForce<Force, Scalar>) loop_.template tool<I>().sense_surface(servo.loop.force().surface_kind());
    });
  }

  // --- in lock-step -----------------------------------------------------------------------------------------------------
  /// after_tick(ticks) with that of each tool, once a tick.
  template <class AfterTick>
  std::vector<Recording> run(double seconds, AfterTick const& after_tick) {
    close();
    OpenDevices const devices(servos_);
    begin_lockstep();
    auto const ticks = tick_count(seconds, rate());
    std::vector<Recording> recordings(tools);
    for (Recording& recording : recordings) recording.reserve(ticks);
    tick_in_lockstep(ticks, [&](std::span<Tick const> now) {
      for (std::size_t k = 0; k < tools; ++k) recordings[k].append(now[k]);
      if (recordings[0].ticks().size() == ticks) publish_all(now[0].time);
      after_tick(now);
    });
    if (auto const& last = recordings[0].ticks(); !last.empty() && last.size() < ticks) publish_all(last.back().time);
    for_each_servo([&](auto i, auto& servo) { recordings[i].set_saturation(servo.loop.chain().saturation()); });
    return recordings;
  }
  /// As many whole ticks as there are in these seconds and what was left over before. Opens the devices the first time.
  template <class AfterTick>
  std::uint64_t tick(double seconds, AfterTick const& after_tick) {
    if (running_) throw Error("Simulator: tick after start, while the servos run; finish() or close() ends them");
    if (!(seconds >= 0) || !std::isfinite(seconds)) throw InvalidArgument(message("Simulator: a tick of ", seconds, " s; it must be finite and not negative"));
    if (!devices_) {
      auto devices = std::make_unique<OpenDevices>(servos_);
      begin_lockstep();
      devices_ = std::move(devices), left_over_ = 0;
    }
    try {
      double const all = left_over_ + seconds * rate();
      tick_count(all / rate(), rate());   // throws
      auto const whole = static_cast<std::uint64_t>(std::floor(all + 1e-6));
      left_over_ = all - static_cast<double>(whole);
      auto const made = tick_in_lockstep(whole, after_tick);
      if (made < whole) for_each_servo([](auto, auto& servo) { servo.loop.write_zero_force(); });
      return made;
    } catch (...) {
      close();
      throw;
    }
  }

  // --- in real time -----------------------------------------------------------------------------------------------------
  std::vector<Recording> run_realtime(double seconds) {
    start(seconds, options_.body_rate);
    try {
      constexpr std::uint64_t max_caught_up = 4;   // a body too slow for its rate falls behind rather than taking ever longer steps
      double const period = 1.0 / options_.body_rate;
      Pacer pacer(options_.body_rate);
      while (any_servo_runs()) {
        watch();
        auto const slot = pacer.wait();
        if (slot.skipped > max_caught_up) loop_.leave_out(period * static_cast<double>(slot.skipped - max_caught_up));
        move_body(period * static_cast<double>(1 + std::min(slot.skipped, max_caught_up)), slot);
      }
    } catch (...) {
      close();
      throw;
    }
    return finish();
  }
  /// The servos alone, in real time, on their threads: they run from now on, for so many seconds at most. The host calls tick_body(), at about `body_rate` [Hz].
  void start(double seconds, double body_rate) {
    close();
    auto running = std::make_unique<Running>(*this, body_rate);
    flags_->stop.store(false, std::memory_order_relaxed), flags_->body_runs.store(true, std::memory_order_relaxed);
    aim(statistics_, body_rate);
    for_each_servo([&](auto i, auto& servo) {
      aim(servo.statistics, servo.loop.rate());
      std::get<i>(running->servos).emplace(servo, options_.realtime, tick_count(seconds, servo.loop.rate()), *flags_);
    });
    statistics_.pause();
    running_ = std::move(running);
    try {
      for_each_running([](auto& servo) { servo.start(); });
    } catch (...) {
      close();
      throw;
    }
  }
  /// The body alone: a tick of h seconds. False once no servo runs any more. Throws as run_realtime does; then close(), and the hand is let go.
  bool tick_body(double h) {
    if (!running_) throw Error("Simulator: tick_body before start; start(seconds) lets the servos run");
    if (!(h > 0) || !std::isfinite(h)) throw InvalidArgument(message("Simulator: tick_body takes ", h, " s; it must be finite and positive"));
    watch();
    if (any_servo_runs()) move_body(h, {.due = std::chrono::steady_clock::now(), .skipped = 0});
    return any_servo_runs();
  }
  /// Ends the servos where they run, and the devices are closed.
  std::vector<Recording> finish() {
    if (!running_) throw Error("Simulator: finish before start; start(seconds) lets the servos run");
    running_->end();
    publish_body_statistics();
    publish(time());
    std::vector<Recording> recordings;
    for_each_running([&](auto& servo) { recordings.push_back(servo.take_recording()); });
    close();
    return recordings;
  }
  /// Ends what tick() or start() has begun, without a recording.
  void close() noexcept { running_.reset(), devices_.reset(); }

  /// Ends the run that goes on, from any thread or from `after_tick`: in real time after the servo's tick, with a force of zero as at every end; in lock-step
  /// likewise. The recording ends there. Without a run it does nothing.
  void stop() noexcept { flags_->stop.store(true, std::memory_order_release); }

  /// The body as it is now, cuts included, also while a tool is in it: for restore(), as often as wanted.
  auto mark() const { return loop_.body().save(); }
  /// Undoes all that has happened to the body since mark(). A tool that is in contact feels its force fade to zero over 50 ms, and has to touch
  /// the tissue anew. Between runs, or from `after_tick`.
  template <class Mark>
  void restore(Mark const& mark) {
    loop_.restore(mark);
  }
  Body& body() noexcept { return loop_.body(); }
  Body const& body() const noexcept { return loop_.body(); }

  template <std::size_t I>
  auto& servo() noexcept {
    return std::get<I>(servos_);
  }
  template <std::size_t I>
  auto const& servo() const noexcept {
    return std::get<I>(servos_);
  }
  auto& loop() noexcept { return loop_; }
  auto const& loop() const noexcept { return loop_; }
  /// Simulated time so far [s].
  double time() const noexcept { return servo<0>().time(); }
  /// The body as drawn by another thread: call fetch() there, then latest().
  SnapshotChannel<Scalar>& snapshots() noexcept { return *snapshots_; }

  template <std::size_t I>
  SimulatorStatistics statistics() const {
    return {.servo = servo<I>().statistics, .body = statistics_, .servo_counts = servo<I>().loop.counts(), .body_counts = loop_.counts()};
  }
  /// Whether the body will keep up with its ticks, also before the first: then a copy of it takes two steps, whose second is timed, and a tick is one of
  /// run_realtime. Between runs, or from `after_tick`; it changes nothing.
  StepForecast forecast() const {
    SimulatorStatistics all = statistics<0>();
    if (all.body.target().count() == 0) aim(all.body, options_.body_rate);
    StepForecast forecast = step_forecast(all);
    if constexpr (std::copyable<Body>) {
      if (forecast.step_cost > 0.0 || !(forecast.stable_step > 0.0)) return forecast;
      Body copy(loop_.body());
      Scalar const h = static_cast<Scalar>(std::min(forecast.period, forecast.stable_step));
      copy.step(h);   // gathers
      auto const started = std::chrono::steady_clock::now();
      copy.step(h);
      forecast.step_cost = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    }
    return forecast;
  }

 private:
  template <class Tool>
  using Servo = ToolServo<typename Tool::Device, typename Tool::Force, Scalar>;
  using Loop = BodyLoop<Body, typename Tools::Cutter...>;

  template <class T>
  static T const& given(std::optional<T> const& own, T const& all) noexcept {
    return own.has_value() ? *own : all;
  }
  static ServoOptions servo_of(ToolOptions const& tool, SimulatorOptions const& options) {
    ServoOptions servo = given(tool.servo, options.servo);
    if (tool.trocar) servo.trocar = tool.trocar;
    return servo;
  }
  template <class Tool>
  static ContactCoupling const& coupling_of(Tool const& tool, SimulatorOptions const& options) {
    if constexpr (BodyTool<Body, typename Tool::Cutter>::presses_itself)
      if (tool.options.coupling.has_value()) throw InvalidArgument("ToolOptions: .coupling of a tool that presses the tissue itself; its own options say how stiff it is");
    ContactCoupling const& coupling = given(tool.options.coupling, options.coupling);
    coupling.validate();
    return coupling;
  }
  /// Places in the order of keys.
  static typename Loop::Order order_of(std::array<std::optional<int>, tools> const& keys) {
    std::array<int, tools> key;
    for (std::size_t k = 0; k < tools; ++k) key[k] = keys[k].value_or(static_cast<int>(k));
    typename Loop::Order order;
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return key[a] < key[b]; });
    for (std::size_t k = 1; k < tools; ++k)
      if (key[order[k]] == key[order[k - 1]])
        throw InvalidArgument(message("Simulator: tools ", order[k - 1], " and ", order[k], " both have the key ", key[order[k]], "; each needs its own"));
    return order;
  }
  static std::uint64_t tick_count(double seconds, double rate) {
    constexpr double most = 1e8;   // ticks
    if (!(seconds >= 0) || !(seconds * rate < most))
      throw InvalidArgument(message("a run of ", seconds, " s at ", rate, " Hz; it must not be negative nor of ", most, " ticks and more, of which each is recorded in ", sizeof(Tick),
                                    " bytes: run again for what follows"));
    return static_cast<std::uint64_t>(std::llround(seconds * rate));
  }
  /// Sets the period that a loop aims at; what it counted before stays.
  static void aim(TickStatistics& statistics, double rate) {
    auto const period = Pacer::period_of(rate);
    if (statistics.target() == period) return;
    TickStatistics aimed(period);
    aimed.merge(statistics);
    statistics = aimed;
  }

  /// use(place, servo), the place a constant.
  template <class Use>
  void for_each_servo(Use const& use) {
    for_each_place<tools>([&](auto i) { use(i, std::get<i>(servos_)); });
  }
  template <class Use>
  void for_each_servo(Use const& use) const {
    for_each_place<tools>([&](auto i) { use(i, std::get<i>(servos_)); });
  }

  void begin_lockstep() {
    for_each_servo([](auto, auto& servo) { servo.loop.begin_session(); });
    for_each_servo([&](auto i, auto& servo) {
      if (servo.loop.rate() != rate())
        throw InvalidArgument(message("Simulator: the device of tool ", i(), " ticks at ", servo.loop.rate(), " Hz, that of tool 0 at ", rate(),
                                      "; in lock-step all need one rate, run_realtime takes any"));
    });
    for_each_servo([&](auto, auto& servo) { aim(servo.statistics, rate()); });
    aim(statistics_, rate());
    flags_->stop.store(false, std::memory_order_relaxed);
  }
  double rate() const noexcept { return servo<0>().loop.rate(); }   // Hz
  /// Returns how many it has taken: fewer where it was stopped.
  template <class AfterTick>
  std::uint64_t tick_in_lockstep(std::uint64_t ticks, AfterTick const& after_tick) {
    Scalar const h = static_cast<Scalar>(1.0 / rate());
    auto const snapshot_every = std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::llround(rate() / options_.snapshot_rate)));
    std::array<std::chrono::nanoseconds, tools> spent;
    std::array<PlacedTool<Scalar>, tools> placed;
    std::array<Tick, tools> now;
    std::uint64_t k = 0;
    for (; k < ticks && !flags_->stop.load(std::memory_order_acquire); ++k) {
      std::uint64_t const tick = servo<0>().done;
      auto last = std::chrono::steady_clock::now();
      auto const lap = [&last] {
        auto const before = std::exchange(last, std::chrono::steady_clock::now());
        return last - before;
      };
      for_each_servo([&](auto i, auto& servo) {
        servo.loop.read(h);
        placed[i] = {servo.loop.placed(), servo.loop.tool(), servo.loop.pose_discontinuities()};
        spent[i] = lap();
      });
      auto const models = loop_.tick(placed, h);
      statistics_.add(lap());
      for_each_servo([&](auto i, auto& servo) {
        now[i] = servo.loop.respond(models[i], static_cast<double>(tick) / rate());
        servo.statistics.add(spent[i] + lap());
        ++servo.done;
      });
      if (tick % snapshot_every == 0) publish(now[0].time);
      if (tick % live_every == 0) publish_statistics();
      after_tick(std::span<Tick const>(now));
    }
    return k;
  }

  void publish_all(double time) {
    publish(time);
    publish_statistics();
  }
  void publish_statistics() noexcept {
    for_each_servo([](auto, auto& servo) { servo.publish(); });
    publish_body_statistics();
  }
  void publish_body_statistics() noexcept {
    for_each_servo([&](auto, auto& servo) { servo.live->publish_body(statistics_, loop_.counts()); });
  }
  void publish(double time) {
    std::array<ToolSnapshot<Scalar>, tools> all;
    for_each_servo([&](auto i, auto& servo) { all[i].pose = servo.loop.tool(); });
    publish(time, all);
  }
  void publish(double time, std::array<ToolSnapshot<Scalar>, tools>& all) {
    loop_.for_each_tool([&](std::size_t k, auto& tool) { all[k].phase = tool.cutter().state(); });
    snapshots_->publish(loop_.body(), time, all[0].pose.position, all[0].phase, std::span<ToolSnapshot<Scalar> const>(all.data(), tools > 1 ? tools : 0));
  }

  /// Opened one after the other, closed the other way round.
  struct OpenDevices {
    explicit OpenDevices(std::tuple<Servo<Tools>...>& servos) {
      for_each_place<tools>([&](auto i) { std::get<i>(sessions).emplace(std::get<i>(servos).loop.device()); });
    }
    ~OpenDevices() {
      for_each_place<tools>([&](auto i) { std::get<tools - 1 - i>(sessions).reset(); });
    }
    std::tuple<std::optional<DeviceSession<typename Tools::Device, typename decltype(Servo<Tools>::loop)::DeviceScalar>>...> sessions;
  };
  /// What there is while the servos run.
  struct Running {
    Running(Simulation& simulation, double body_rate) : devices(simulation.servos_), flags(*simulation.flags_) {
      simulation.for_each_servo([&](auto, auto& servo) { servo.loop.begin_session(body_rate); });
    }
    ~Running() { end(); }
    void end() {
      flags.body_runs.store(false, std::memory_order_release);
      std::apply([](auto&... servo) { ((servo ? servo->end() : void()), ...); }, servos);
    }

    OpenDevices devices;
    RunFlags& flags;
    std::tuple<std::optional<RealtimeServo<typename Tools::Device, typename Tools::Force, Scalar>>...> servos;
    double since_snapshot = 0.0;
    std::uint64_t since_live = 0;   // ticks
    double stable_step = 0.0;       // s, of the last one
  };
  template <class Use>
  void for_each_running(Use const& use) {
    std::apply([&](auto&... servo) { (use(*servo), ...); }, running_->servos);
  }
  void watch() {
    std::size_t k = 0;
    for_each_running([&](auto& servo) { servo.watch(tools > 1 ? std::optional(k) : std::nullopt), ++k; });
  }
  bool any_servo_runs() const noexcept {
    return std::apply([](auto const&... servo) { return (servo->runs() || ...); }, running_->servos);
  }
  void move_body(double h, Pacer::Slot const& slot) {
    auto const started = std::chrono::steady_clock::now();
    std::array<PlacedTool<Scalar>, tools> placed;
    std::array<ToolSnapshot<Scalar>, tools> shown;
    double time = 0;
    std::size_t k = 0;
    for_each_running([&](auto& servo) {
      bool const is_placed = servo.fetch_pose();
      auto const& pose = servo.pose();
      placed[k] = {is_placed, pose.tool, pose.pose_discontinuities};
      shown[k++].pose = pose.tool;
      time = std::max(time, pose.time);
    });
    auto const models = loop_.tick(placed, static_cast<Scalar>(h));
    k = 0;
    for_each_running([&](auto& servo) {
      if (placed[k].is_placed) servo.publish(models[k]);
      ++k;
    });
    running_->since_snapshot += h;
    if (running_->since_snapshot * options_.snapshot_rate >= 1.0) {
      running_->since_snapshot = 0.0;
      publish(time, shown);
    }
    statistics_.add(TickTiming{slot.due, started, std::chrono::steady_clock::now()});
    statistics_.add_skipped(slot.skipped);
    bool const is_other = loop_.counts().stable_step != running_->stable_step;   // what forecasts follow from is told at once
    running_->stable_step = loop_.counts().stable_step;
    if (running_->since_live++ % live_every == 0 || is_other) publish_body_statistics();
  }

  SimulatorOptions options_;
  std::tuple<Servo<Tools>...> servos_;
  Loop loop_;
  std::unique_ptr<SnapshotChannel<Scalar>> snapshots_;
  std::unique_ptr<RunFlags> flags_;
  TickStatistics statistics_;   // of the body's ticks
  double left_over_ = 0;        // ticks that the host's loop has asked for, less than one
  std::unique_ptr<OpenDevices> devices_;   // while the host ticks in lock-step
  std::unique_ptr<Running> running_;       // while the servos run; closes first
};

}  // namespace detail

}  // namespace palpate
