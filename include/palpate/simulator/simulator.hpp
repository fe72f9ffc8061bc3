// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/soft_body.hpp>
#include <palpate/core/event_ring.hpp>
#include <palpate/core/triple_buffer.hpp>
#include <palpate/device/session.hpp>
#include <palpate/simulator/body_loop.hpp>
#include <palpate/simulator/budget.hpp>
#include <palpate/simulator/pacer.hpp>
#include <palpate/simulator/realtime_thread.hpp>
#include <palpate/simulator/recording.hpp>
#include <palpate/simulator/servo_loop.hpp>
#include <palpate/simulator/simulator_statistics.hpp>
#include <palpate/simulator/snapshot.hpp>
#include <palpate/simulator/tick_statistics.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <exception>
#include <memory>
#include <string>
#include <thread>
#include <utility>

namespace palpate {

struct SimulatorOptions {
  ContactCoupling coupling = {};
  int max_body_steps = 100;      ///< a tick is split into no more body steps than this; where it needs more, the body lags behind
  double body_rate = 500.0;       ///< Hz, of the body's thread in real time; in lock-step the body is ticked with the servo
  double snapshot_rate = 60.0;    ///< Hz of simulated time, how often a snapshot is published for drawing
  ServoOptions servo = {};        ///< safety, frames and clutch
  RealtimeOptions realtime = {};  ///< what the servo's thread asks of the system in real time; by default what needs no rights
};

namespace detail {

/// What makes a simulator together.
template <class Device, class Body, class C, class Force>
concept MakeSimulator = SimulatedBody<Body> && HapticDevice<Device, typename DeviceScalarOf<Device, typename Body::Scalar>::type> && Cutter<C, Body> &&
                        RendersForce<Force, typename Body::Scalar>;

/// Says, where it is instantiated, what keeps these from it.
template <class Device, class Body, class C, class Force, bool is_refused = IsRefused<Body>>
struct SimulatorSentences {};
template <class Device, class Body, class C, class Force>
struct SimulatorSentences<Device, Body, C, Force, false>
    : DeviceSentences<Device, typename DeviceScalarOf<Device, typename Body::Scalar>::type>, CutterSentences<C, Body>, ForceSentences<Force, typename Body::Scalar> {
  static_assert(SimulatedBody<Body>, "Simulator: the second argument is no SimulatedBody; see palpate/body/concept.hpp, or use a SoftBody.");
};

}  // namespace detail

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
/// Threads        run and run_realtime from one thread at a time; snapshots() may be read from another one meanwhile.
template <class Device, class Body, class CutterType, class Force>
class Simulator {
 public:
  using Scalar = typename Body::Scalar;

  Simulator(Device device, Body body, CutterType cutter, Force force, SimulatorOptions const& options = {})
      : options_(checked(options)),
        servo_(std::move(device), std::move(force), options.servo),
        loop_(std::move(body), std::move(cutter), options.coupling, options.max_body_steps),
        snapshots_(std::make_unique<SnapshotChannel<Scalar>>()),
        live_(std::make_unique<LiveStatistics>()),
        told_(std::make_unique<Told>()) {
    if constexpr (Validatable<Force>) servo_.force().validate();
    if constexpr (SurfaceForce<Force, Scalar>) loop_.sense_surface(servo_.force().surface_kind());
  }

  /// Runs `seconds` of simulated time in lock-step, after what was run before; not for a device in somebody's hand. `after_tick(tick)` is called once a tick,
  /// if given.
  template <class AfterTick>
  Recording run(double seconds, AfterTick after_tick) {
    DeviceSession<Device, DeviceScalar> const session(servo_.device());
    servo_.begin_session();
    double const rate = servo_.rate();
    auto const ticks = tick_count(seconds, rate);
    Scalar const h = static_cast<Scalar>(1.0 / rate);
    auto const snapshot_every = std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::llround(rate / options_.snapshot_rate)));
    aim(statistics_.servo, rate);
    aim(statistics_.body, rate);
    Recording recording(ticks);
    told_->stop.store(false, std::memory_order_relaxed);
    for (std::uint64_t k = 0; k < ticks && !told_->stop.load(std::memory_order_acquire); ++k) {
      auto const started = std::chrono::steady_clock::now();
      servo_.read(h);
      auto const body_started = std::chrono::steady_clock::now();
      LocalModel<Scalar> model;
      if (servo_.placed())
        model = loop_.tick(servo_.tool(), h, servo_.pose_discontinuities());
      else
        loop_.rest(h);
      auto const body_ended = std::chrono::steady_clock::now();
      Tick const tick = servo_.respond(model, static_cast<double>(tick_) / rate);
      auto const ended = std::chrono::steady_clock::now();
      statistics_.body.add(body_ended - body_started);
      statistics_.servo.add((body_started - started) + (ended - body_ended));
      recording.append(tick);
      if (tick_ % snapshot_every == 0 || k + 1 == ticks) publish(tick.time, servo_.tip());
      if (tick_ % live_every == 0 || k + 1 == ticks) {
        live_->publish_servo(statistics_.servo, servo_.counts());
        live_->publish_body(statistics_.body, loop_.counts());
      }
      ++tick_;
      after_tick(tick);
    }
    recording.set_saturation(servo_.chain().saturation());
    return recording;
  }
  Recording run(double seconds) {
    return run(seconds, [](Tick const&) {});
  }

  /// Runs `seconds` of real time on two threads: this one becomes the body's, a new one the servo.
  Recording run_realtime(double seconds) {
    DeviceSession<Device, DeviceScalar> const session(servo_.device());
    servo_.begin_session(options_.body_rate);
    double const rate = servo_.rate();
    auto const ticks = tick_count(seconds, rate);
    double const started_at = static_cast<double>(tick_) / rate;
    Exchange between{.started_at = started_at,
                     .ticks = ticks,
                     .pacer = Pacer(rate, options_.realtime.spin),
                     .poses = TripleBuffer<Pose>(Pose{.tool = servo_.tool(), .time = started_at, .pose_discontinuities = servo_.pose_discontinuities()}),
                     .models = TripleBuffer<LocalModel<Scalar>>(LocalModel<Scalar>{.valid = false})};
    Recording recording(ticks);
    aim(statistics_.servo, rate);
    aim(statistics_.body, options_.body_rate);

    told_->stop.store(false, std::memory_order_relaxed);
    std::exception_ptr failure;
    auto const run_body = [&] {
      try {
        body_thread(between);
      } catch (...) {
        failure = std::current_exception();
      }
      between.body_runs.store(false, std::memory_order_release);
    };
    auto const on_clock_of = [&](auto& clock) {
      ServoTask task{*this, between, recording};
      live_->publish(RealtimeReport{});   // the thread is the driver's
      statistics_.servo.pause();
      between.driven = true;
      clock.start(&ServoTask::tick, &task);
      run_body();
      clock.stop();
      live_->publish_servo(statistics_.servo, servo_.counts());
    };
    auto const on_own_thread = [&] {
      std::thread servo([&] { servo_thread(between, recording); });
      run_body();
      servo.join();
    };
    if constexpr (SelfClocked<Device>) {
      on_clock_of(servo_.device());
    } else if constexpr (HasOptionalClock<Device>) {   // known while the program runs: AnyDevice
      if (auto* const clock = servo_.device().clock())
        on_clock_of(*clock);
      else
        on_own_thread();
    } else {
      on_own_thread();
    }
    tick_ += between.done;
    if (failure) std::rethrow_exception(failure);
    publish(time(), servo_.tip());
    recording.set_saturation(servo_.chain().saturation());
    return recording;
  }

  /// Ends the run that goes on, from any thread or from `after_tick`: in real time after the servo's tick, with a force of zero as at every end; in lock-step
  /// likewise. The recording ends there. Without a run it does nothing.
  void stop() noexcept { told_->stop.store(true, std::memory_order_release); }
  /// The ticks of a run in real time as they happen, for one other thread: pop() them; what finds no room, more than a second's, is not kept there, but in the recording.
  EventRing<Tick, 1024>& live_ticks() noexcept { return told_->ticks; }

  /// The body as it is now, cuts included, also while the tool is in it: for restore(), as often as wanted.
  auto mark() const { return loop_.body().save(); }
  /// Undoes all that has happened to the body since mark(). A tool that is in contact feels its force fade to zero over 50 ms, and has to touch
  /// the tissue anew. Between runs, or from `after_tick`.
  template <class Mark>
  void restore(Mark const& mark) {
    loop_.restore(mark);
  }

  Body& body() noexcept { return loop_.body(); }
  Body const& body() const noexcept { return loop_.body(); }
  CutterType& cutter() noexcept { return loop_.cutter(); }
  CutterType const& cutter() const noexcept { return loop_.cutter(); }
  Force& force() noexcept { return servo_.force(); }
  Device& device() noexcept { return servo_.device(); }
  /// Simulated time so far [s].
  double time() const noexcept { return servo_.rate() > 0 ? static_cast<double>(tick_) / servo_.rate() : 0.0; }

  /// The body as drawn by another thread: call fetch() there, then latest().
  SnapshotChannel<Scalar>& snapshots() noexcept { return *snapshots_; }

  /// What the safety chain does, told as it happens: pop() them from one thread, this one or another. 256 are kept.
  ServoEvents& events() noexcept { return servo_.events(); }
  /// The last stage of the servo: what it is about, how warm the motors are, the energy. Between runs, or from `after_tick`.
  SafetyChain<Scalar> const& safety() const noexcept { return servo_.chain(); }
  WorkspaceMapping<Scalar> const& mapping() const noexcept { return servo_.mapping(); }

  /// What was counted so far: between runs, or from `after_tick`.
  SimulatorStatistics statistics() const {
    SimulatorStatistics all = statistics_;
    all.servo_counts = servo_.counts();
    all.body_counts = loop_.counts();
    return all;
  }
  /// Whether the body will keep up with its ticks, also before the first: then a copy of it takes two steps, whose second is timed, and a tick is one of
  /// run_realtime. Between runs, or from `after_tick`; it changes nothing.
  StepForecast forecast() const {
    SimulatorStatistics all = statistics();
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
  /// statistics() while a run goes on, from any number of other threads: at most 50 ticks old.
  SimulatorStatistics live_statistics() const noexcept { return live_->statistics(); }
  /// What the servo's thread of the last real-time run, or of the one that goes on, was granted of `SimulatorOptions::realtime`.
  RealtimeReport realtime_report() const noexcept { return live_->report(); }

 private:
  using DeviceScalar = typename ServoLoop<Device, Force, Scalar>::DeviceScalar;

  /// What other threads ask and are told.
  struct Told {
    std::atomic<bool> stop{false};
    EventRing<Tick, 1024> ticks{};
  };

  struct Pose {
    ToolPose<Scalar> tool{};
    double time = 0.0;    // s of the recording
    double clock = 0.0;   // s since the run began
    std::uint64_t pose_discontinuities = 0;
  };

  /// What the two threads of a real-time run share.
  struct Exchange {
    double started_at;
    std::uint64_t ticks;
    Pacer pacer;   // the servo's
    std::uint64_t done = 0;   // ticks; the servo's until it has ended
    std::chrono::steady_clock::time_point begun{}, last{};   // when the first and the last tick of the servo started
    TripleBuffer<Pose> poses = {};
    TripleBuffer<LocalModel<Scalar>> models = {};
    std::atomic<bool> servo_runs{true};
    std::atomic<bool> body_runs{true};
    bool driven = false;                   // by a device with a clock of its own
    std::atomic<std::uint64_t> beats{0};   // of that
  };

  /// The servo's side for a device that calls it once a period from its driver's thread.
  struct ServoTask {
    Simulator& simulator;
    Exchange& between;
    Recording& recording;

    static void tick(void* context) noexcept { static_cast<ServoTask*>(context)->tick(); }
    void tick() noexcept {
      between.beats.fetch_add(1, std::memory_order_relaxed);
      if (!simulator.goes_on(between)) {
        simulator.servo_.write_zero_force();
        between.servo_runs.store(false, std::memory_order_release);
        return;
      }
      simulator.servo_tick(between, recording, {.due = std::chrono::steady_clock::now(), .skipped = 0});
      if (++between.done == between.ticks) between.servo_runs.store(false, std::memory_order_release);
    }
  };

  static constexpr std::uint64_t live_every = 50;   // ticks between two publications of the statistics: copying them takes some 2 µs

  static SimulatorOptions const& checked(SimulatorOptions const& options) {
    options.coupling.validate();
    options.realtime.validate();
    if (options.max_body_steps < 1)
      throw InvalidArgument(detail::message("max_body_steps is ", options.max_body_steps, "; a tick needs at least one"));
    for (double const rate : {options.body_rate, options.snapshot_rate}) static_cast<void>(Pacer::period_of(rate));   // throws
    return options;
  }

  static std::uint64_t tick_count(double seconds, double rate) {
    if (!(seconds >= 0) || !(seconds * rate < 1e9))
      throw InvalidArgument(detail::message("a run of ", seconds, " s at ", rate, " Hz; it must not be negative nor above 1e9 ticks"));
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

  void publish(double time, Vector3<Scalar> const& tip) { snapshots_->publish(loop_.body(), time, tip, loop_.cutter().state()); }

  void servo_thread(Exchange& between, Recording& recording) noexcept {
    RealtimeThread const realtime(options_.realtime);
    live_->publish(realtime.report());
    statistics_.servo.pause();
    between.pacer.restart();
    for (; goes_on(between); ++between.done)
      servo_tick(between, recording, between.pacer.wait());
    servo_.write_zero_force();   // the body's thread may take long to notice
    live_->publish_servo(statistics_.servo, servo_.counts());
    between.servo_runs.store(false, std::memory_order_release);
  }

  bool goes_on(Exchange const& between) const noexcept {
    return between.done < between.ticks && between.body_runs.load(std::memory_order_acquire) && !told_->stop.load(std::memory_order_acquire);
  }

  void servo_tick(Exchange& between, Recording& recording, Pacer::Slot const& slot) noexcept {
    // How long a tick was is measured from start to start: a wake-up may be late by any time. Whole periods, so that a velocity has no jitter of the clock.
    double const rate = servo_.rate();
    auto const started = std::chrono::steady_clock::now();
    if (between.done == 0) between.begun = between.last = started;
    double const periods = std::max(1.0, std::round(std::chrono::duration<double>(started - between.last).count() * rate));
    between.last = started;
    double const time = between.started_at + static_cast<double>(between.done) / rate, now = std::chrono::duration<double>(started - between.begun).count();
    if constexpr (SelfClocked<Device>) statistics_.servo.add_skipped(static_cast<std::uint64_t>(periods) - 1);
    servo_.read(static_cast<Scalar>(periods / rate));
    if (servo_.placed()) {
      between.poses.back() = {servo_.tool(), time, now, servo_.pose_discontinuities()};
      between.poses.publish();
    }
    Tick const tick = servo_.respond(between.models.read(), time, now);
    recording.try_append(tick);
    static_cast<void>(told_->ticks.push(tick));
    statistics_.servo.add(TickTiming{slot.due, started, std::chrono::steady_clock::now()});
    statistics_.servo.add_skipped(slot.skipped);
    if (between.done % live_every == 0) live_->publish_servo(statistics_.servo, servo_.counts());
  }

  /// Throws where a device that has the clock has not ticked for a second: nobody waits for ever.
  class ClockWatch {
   public:
    void look(std::uint64_t beats) {
      auto const now = std::chrono::steady_clock::now();
      if (beats != beats_ || !begun_) {
        begun_ = true, beats_ = beats, since_ = now;
      } else if (now - since_ > std::chrono::seconds(1)) {
        throw Error(message(beats));
      }
    }

   private:
    static std::string message(std::uint64_t beats) {
      return detail::message("the device's clock has stopped after ", beats, " ticks: no call for 1 s; check that it is connected, and that no other program uses it");
    }
    bool begun_ = false;
    std::uint64_t beats_ = 0;
    std::chrono::steady_clock::time_point since_{};
  };

  void body_thread(Exchange& between) {
    constexpr std::uint64_t max_caught_up = 4;   // a body too slow for its rate falls behind rather than taking ever longer steps
    double const period = 1.0 / options_.body_rate;
    double since_snapshot = 0.0;
    std::uint64_t since_live = 0;   // ticks
    double stable_step = 0.0;       // s, of the last one
    bool placed = false;
    statistics_.body.pause();
    Pacer pacer(options_.body_rate);
    ClockWatch watch;
    while (between.servo_runs.load(std::memory_order_acquire)) {
      if (between.driven) watch.look(between.beats.load(std::memory_order_relaxed));
      auto const slot = pacer.wait();
      auto const started = std::chrono::steady_clock::now();
      double const h = period * static_cast<double>(1 + std::min(slot.skipped, max_caught_up));
      if (slot.skipped > max_caught_up) loop_.leave_out(period * static_cast<double>(slot.skipped - max_caught_up));
      placed = between.poses.fetch() || placed;
      Pose const& pose = between.poses.front();
      if (placed) {
        between.models.back() = loop_.tick(pose.tool, static_cast<Scalar>(h), pose.pose_discontinuities);
        between.models.back().time = pose.clock;
        between.models.publish();
      } else {
        loop_.rest(static_cast<Scalar>(h));
      }
      since_snapshot += h;
      if (since_snapshot * options_.snapshot_rate >= 1.0) {
        since_snapshot = 0.0;
        publish(pose.time, pose.tool.position);
      }
      statistics_.body.add(TickTiming{slot.due, started, std::chrono::steady_clock::now()});
      statistics_.body.add_skipped(slot.skipped);
      bool const is_other = loop_.counts().stable_step != stable_step;   // what forecasts follow from is told at once
      stable_step = loop_.counts().stable_step;
      if (since_live++ % live_every == 0 || is_other) live_->publish_body(statistics_.body, loop_.counts());
    }
    live_->publish_body(statistics_.body, loop_.counts());
  }

  SimulatorOptions options_;
  ServoLoop<Device, Force, Scalar> servo_;
  BodyLoop<Body, CutterType> loop_;
  std::unique_ptr<SnapshotChannel<Scalar>> snapshots_;
  std::unique_ptr<LiveStatistics> live_;
  std::unique_ptr<Told> told_;
  SimulatorStatistics statistics_;
  std::uint64_t tick_ = 0;
};

/// Parts that make no simulator: what is wrong, in a sentence each, and nothing that could fail besides.
template <class Device, class Body, class CutterType, class Force>
  requires(!detail::MakeSimulator<Device, Body, CutterType, Force>)
class Simulator<Device, Body, CutterType, Force> : detail::SimulatorSentences<Device, Body, CutterType, Force> {
 public:
  using Refused = void;

  Simulator(Device const&, Body const&, CutterType const&, Force const&, SimulatorOptions const& = {}) {}
};

}  // namespace palpate
