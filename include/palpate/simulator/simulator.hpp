// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/soft_body.hpp>
#include <palpate/device/session.hpp>
#include <palpate/simulator/body_loop.hpp>
#include <palpate/simulator/pacer.hpp>
#include <palpate/simulator/recording.hpp>
#include <palpate/simulator/servo_loop.hpp>
#include <palpate/simulator/snapshot.hpp>
#include <palpate/simulator/tick_statistics.hpp>
#include <palpate/simulator/triple_buffer.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <exception>
#include <memory>
#include <thread>
#include <utility>

namespace palpate {

struct SimulatorOptions {
  ContactCoupling coupling = {};
  int most_body_steps = 100;      ///< a tick is split into no more body steps than this; where it needs more, the body lags behind
  double body_rate = 500.0;       ///< Hz, of the body's thread in real time; in lock-step the body is ticked with the servo
  double snapshot_rate = 60.0;    ///< Hz of simulated time, how often a snapshot is published for drawing
};

/// How a simulation ran.
struct SimulatorStatistics {
  TickStatistics servo;     ///< in lock-step: computing times only
  TickStatistics body;
  ServoCounts servo_counts;
  BodyCounts body_counts;
};

/// A whole simulator: hand → device → contact → tissue → cut → force → hand.
///
///   Simulator simulator(Stroke{}, std::move(body), ProgressiveCutter<double>({.puncture_depth = 0.006}), force);
///   Recording const session = simulator.run(3.6);
///
/// run            lock-step on a virtual clock: every servo tick reads the device, ticks the body, answers. The same inputs and
///                seeds give the same bytes.
/// run_realtime   the same parts on two threads: the servo at the device's rate on a local model, the body at its own rate.
///                Between them are a triple buffer for the tool's pose and one for the local model; nothing waits, nothing locks.
///                Ticks are counted, not the clock: where the servo came too late for some, the run ends that much later.
/// Units          s, Hz, m, N.
/// Errors         InvalidArgument for a duration or rate that makes no sense. An exception in the body's thread ends the run with
///                a force of zero and is thrown again by run_realtime.
/// Threads        run and run_realtime from one thread at a time; snapshots() may be read from another one meanwhile.
template <class Device, class Body, class CutterType, class Force>
class Simulator {
 public:
  using Scalar = typename Body::Scalar;

  Simulator(Device device, Body body, CutterType cutter, Force force, SimulatorOptions const& options = {})
      : options_(checked(options)),
        servo_(std::move(device), std::move(force)),
        loop_(std::move(body), std::move(cutter), options.coupling, options.most_body_steps),
        snapshots_(std::make_unique<SnapshotChannel<Scalar>>()) {
    if constexpr (requires { servo_.force().validate(); }) servo_.force().validate();
  }

  /// Runs `seconds` of simulated time in lock-step, after what was run before. `after_tick(tick)` is called once a tick, if given.
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
    for (std::uint64_t k = 0; k < ticks; ++k) {
      auto const started = std::chrono::steady_clock::now();
      servo_.read(h);
      auto const body_started = std::chrono::steady_clock::now();
      LocalModel<Scalar> model;
      if (servo_.placed())
        model = loop_.tick(servo_.tip(), servo_.velocity(), h);
      else
        loop_.rest(h);
      auto const body_ended = std::chrono::steady_clock::now();
      Tick const tick = servo_.respond(model, static_cast<double>(tick_) / rate);
      auto const ended = std::chrono::steady_clock::now();
      statistics_.body.add(body_ended - body_started);
      statistics_.servo.add((body_started - started) + (ended - body_ended));
      recording.append(tick);
      if (tick_ % snapshot_every == 0 || k + 1 == ticks) publish(tick.time, servo_.tip());
      ++tick_;
      after_tick(tick);
    }
    return recording;
  }
  Recording run(double seconds) {
    return run(seconds, [](Tick const&) {});
  }

  /// Runs `seconds` of real time on two threads: this one becomes the body's, a new one the servo.
  Recording run_realtime(double seconds) {
    DeviceSession<Device, DeviceScalar> const session(servo_.device());
    servo_.begin_session();
    double const rate = servo_.rate();
    auto const ticks = tick_count(seconds, rate);
    double const started_at = static_cast<double>(tick_) / rate;
    Exchange between{.started_at = started_at,
                     .ticks = ticks,
                     .pacer = Pacer(rate),
                     .poses = TripleBuffer<Pose>(Pose{servo_.tip(), Vector3<Scalar>::Zero(), started_at})};
    Recording recording(ticks);
    aim(statistics_.servo, rate);
    aim(statistics_.body, options_.body_rate);

    std::thread servo([&] { servo_thread(between, recording); });
    std::exception_ptr failure;
    try {
      body_thread(between);
    } catch (...) {
      failure = std::current_exception();
    }
    between.body_runs.store(false, std::memory_order_release);
    servo.join();
    tick_ += between.done;
    if (failure) std::rethrow_exception(failure);
    publish(time(), servo_.tip());
    return recording;
  }

  /// The body as it is now, cuts included, also while the tool is in it: for restore(), as often as wanted.
  auto mark() const
    requires requires(Body const& body) { body.save(); }
  {
    return loop_.body().save();
  }
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

  SimulatorStatistics statistics() const {
    SimulatorStatistics all = statistics_;
    all.servo_counts = servo_.counts();
    all.body_counts = loop_.counts();
    return all;
  }

 private:
  using DeviceScalar = typename ServoLoop<Device, Force, Scalar>::DeviceScalar;

  struct Pose {
    Vector3<Scalar> tip = Vector3<Scalar>::Zero();
    Vector3<Scalar> velocity = Vector3<Scalar>::Zero();
    double time = 0.0;
  };

  /// What the two threads of a real-time run share.
  struct Exchange {
    double started_at;
    std::uint64_t ticks;
    Pacer pacer;   // the servo's
    std::uint64_t done = 0;   // ticks; the servo's until it has ended
    TripleBuffer<Pose> poses = {};
    TripleBuffer<LocalModel<Scalar>> models = {};
    std::atomic<bool> servo_runs{true};
    std::atomic<bool> body_runs{true};
  };

  static SimulatorOptions const& checked(SimulatorOptions const& options) {
    options.coupling.validate();
    if (options.most_body_steps < 1)
      throw InvalidArgument(detail::message("most_body_steps is ", options.most_body_steps, "; a tick needs at least one"));
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
    double const rate = servo_.rate();
    Scalar const h = static_cast<Scalar>(1.0 / rate);
    statistics_.servo.pause();
    between.pacer.restart();
    for (; between.done < between.ticks && between.body_runs.load(std::memory_order_acquire); ++between.done) {
      auto const slot = between.pacer.wait();
      auto const started = std::chrono::steady_clock::now();
      double const time = between.started_at + static_cast<double>(between.done) / rate;
      servo_.read(h * static_cast<Scalar>(1 + slot.skipped));
      if (servo_.placed()) {
        between.poses.back() = {servo_.tip(), servo_.velocity(), time};
        between.poses.publish();
      }
      recording.try_append(servo_.respond(between.models.read(), time));
      statistics_.servo.add(TickTiming{slot.due, started, std::chrono::steady_clock::now()});
      statistics_.servo.add_skipped(slot.skipped);
    }
    between.servo_runs.store(false, std::memory_order_release);
  }

  void body_thread(Exchange& between) {
    constexpr std::uint64_t most_caught_up = 4;   // a body too slow for its rate falls behind rather than taking ever longer steps
    double const period = 1.0 / options_.body_rate;
    double since_snapshot = 0.0;
    bool placed = false;
    statistics_.body.pause();
    Pacer pacer(options_.body_rate);
    while (between.servo_runs.load(std::memory_order_acquire)) {
      auto const slot = pacer.wait();
      auto const started = std::chrono::steady_clock::now();
      double const h = period * static_cast<double>(1 + std::min(slot.skipped, most_caught_up));
      placed = between.poses.fetch() || placed;
      Pose const& pose = between.poses.front();
      if (placed) {
        between.models.back() = loop_.tick(pose.tip, pose.velocity, static_cast<Scalar>(h));
        between.models.publish();
      } else {
        loop_.rest(static_cast<Scalar>(h));
      }
      since_snapshot += h;
      if (since_snapshot * options_.snapshot_rate >= 1.0) {
        since_snapshot = 0.0;
        publish(pose.time, pose.tip);
      }
      statistics_.body.add(TickTiming{slot.due, started, std::chrono::steady_clock::now()});
      statistics_.body.add_skipped(slot.skipped);
    }
  }

  SimulatorOptions options_;
  ServoLoop<Device, Force, Scalar> servo_;
  BodyLoop<Body, CutterType> loop_;
  std::unique_ptr<SnapshotChannel<Scalar>> snapshots_;
  SimulatorStatistics statistics_;
  std::uint64_t tick_ = 0;
};

}  // namespace palpate
