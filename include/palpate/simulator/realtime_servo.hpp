// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/event_ring.hpp>
#include <palpate/core/tool_pose.hpp>
#include <palpate/core/triple_buffer.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/simulator/pacer.hpp>
#include <palpate/simulator/realtime_thread.hpp>
#include <palpate/simulator/recording.hpp>
#include <palpate/simulator/servo_loop.hpp>
#include <palpate/simulator/simulator_statistics.hpp>
#include <palpate/simulator/tick_statistics.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

namespace palpate::detail {

inline constexpr std::uint64_t live_every = 50;   // ticks between two publications of the statistics: copying them takes some 2 µs

/// The servo of a tool, with what is counted of it and told to other threads.
template <class Device, class Force, RealScalar Scalar>
struct ToolServo {
  ServoLoop<Device, Force, Scalar> loop;
  TickStatistics statistics{};
  std::unique_ptr<LiveStatistics> live = std::make_unique<LiveStatistics>();
  std::unique_ptr<EventRing<Tick, 1024>> ticks = std::make_unique<EventRing<Tick, 1024>>();
  std::uint64_t done = 0;   // ticks of all runs

  double time() const noexcept { return loop.rate() > 0 ? static_cast<double>(done) / loop.rate() : 0.0; }
  void publish() noexcept { live->publish_servo(statistics, loop.counts()); }
};

/// What the threads of a run in real time tell each other.
struct RunFlags {
  std::atomic<bool> stop{false};        // asked for by the user, also in lock-step
  std::atomic<bool> body_runs{true};
};

/// A servo in real time, on a thread of its own or called by the driver of a device with a clock. Between it and the body's thread are a triple buffer for the
/// tool's pose and one for the local model; nothing waits, nothing locks.
template <class Device, class Force, RealScalar Scalar>
class RealtimeServo {
 public:
  struct Pose {
    ToolPose<Scalar> tool{};
    double time = 0.0;    // s of the recording
    double clock = 0.0;   // s since the run began
    std::uint64_t pose_discontinuities = 0;
  };

  /// A run of so many ticks.
  RealtimeServo(ToolServo<Device, Force, Scalar>& servo, RealtimeOptions const& options, std::uint64_t ticks, RunFlags const& flags)
      : servo_(servo),
        options_(options),
        flags_(flags),
        ticks_(ticks),
        started_at_(servo.time()),
        pacer_(servo.loop.rate(), spin()),
        recording_(ticks),
        poses_(Pose{.tool = servo.loop.tool(), .time = started_at_, .pose_discontinuities = servo.loop.pose_discontinuities()}),
        models_(LocalModel<Scalar>{.valid = false}) {}
  RealtimeServo(RealtimeServo const&) = delete;
  RealtimeServo& operator=(RealtimeServo const&) = delete;

  // --- of the thread that runs the body ---------------------------------------------------------------------------------
  void start() {
    with_clock([&](auto& clock) {
      is_driven_ = true;
      servo_.live->publish(RealtimeReport{});   // the thread is the driver's
      servo_.statistics.pause();
      clock.start(&RealtimeServo::tick_of_clock, this);
    });
    if (!is_driven_) thread_ = std::thread([this] { run(); });
    is_started_ = true;
  }
  /// Its last tick was, or will be the next; then it has ended. The body has ended before, or all of its servos.
  void end() {
    if (!std::exchange(is_started_, false)) return;
    if (is_driven_) {
      with_clock([](auto& clock) { clock.stop(); });
      servo_.publish();
    } else {
      thread_.join();
    }
    servo_.done += done_;
  }
  Recording take_recording() {
    recording_.set_saturation(servo_.loop.chain().saturation());
    recording_.set_real_time();
    return std::move(recording_);
  }

  bool runs() const noexcept { return runs_.load(std::memory_order_acquire); }
  /// Throws where a device that has the clock has not ticked for a second, or three of its periods: nobody waits for ever. A run that was asked to stop ends.
  /// `tool`: whose device it is, where there are several.
  void watch(std::optional<std::size_t> tool = {}) {
    if (!is_driven_ || !runs()) return;
    std::uint64_t const beats = beats_.load(std::memory_order_relaxed);
    auto const now = std::chrono::steady_clock::now();
    if (beats != seen_beats_ || !is_watched_) {
      is_watched_ = true, seen_beats_ = beats, seen_at_ = now;
    } else if (double const most = std::max(1.0, 3.0 / servo_.loop.rate()); std::chrono::duration<double>(now - seen_at_).count() > most) {
      if (flags_.stop.load(std::memory_order_acquire)) return runs_.store(false, std::memory_order_release);
      throw Error(message(tool ? message("the clock of the device of tool ", *tool) : std::string("the device's clock"), " has stopped after ", beats, " ticks: no call for ", most, " s; check that it is connected, and that no other program uses it"));
    }
  }

  /// Takes the newest pose. Whether there has been any.
  bool fetch_pose() noexcept { return is_placed_ = poses_.fetch() || is_placed_; }
  Pose const& pose() const noexcept { return poses_.front(); }
  /// What the body answers to that pose.
  void publish(LocalModel<Scalar> const& model) noexcept { publish(model, pose().clock); }
  /// The same as of another time [s] on the clock of the poses: of a body that is far away.
  void publish(LocalModel<Scalar> const& model, double time) noexcept {
    models_.back() = model;
    models_.back().time = time;
    models_.publish();
  }

 private:
  /// use(clock) where the device has one.
  template <class Use>
  void with_clock([[maybe_unused]] Use const& use) {
    if constexpr (SelfClocked<Device>)
      use(servo_.loop.device());
    else if constexpr (HasOptionalClock<Device>)   // known while the program runs: AnyDevice
      if (auto* const clock = servo_.loop.device().clock()) use(*clock);
  }

  /// Who waits for the clock of a device does not spin.
  Schedule::Duration spin() {
    auto spin = options_.spin;
    with_clock([&](auto const&) { spin = {}; });
    return spin;
  }
  bool goes_on() const noexcept {
    return done_ < ticks_ && flags_.body_runs.load(std::memory_order_acquire) && !flags_.stop.load(std::memory_order_acquire);
  }

  void run() noexcept {
    RealtimeThread const realtime(options_);
    servo_.live->publish(realtime.report());
    servo_.statistics.pause();
    pacer_.restart();
    for (; goes_on(); ++done_) tick(pacer_.wait());
    servo_.loop.write_zero_force();   // the body's thread may take long to notice
    servo_.publish();
    runs_.store(false, std::memory_order_release);
  }

  static void tick_of_clock(void* context) noexcept { static_cast<RealtimeServo*>(context)->tick_of_clock(); }
  void tick_of_clock() noexcept {
    beats_.fetch_add(1, std::memory_order_relaxed);
    if (!goes_on()) {
      servo_.loop.write_zero_force();
      runs_.store(false, std::memory_order_release);
      return;
    }
    tick({.due = std::chrono::steady_clock::now(), .skipped = 0});
    if (++done_ == ticks_) runs_.store(false, std::memory_order_release);
  }

  void tick(Pacer::Slot const& slot) noexcept {
    // How long a tick was is measured from start to start: a wake-up may be late by any time. Whole periods, so that a velocity has no jitter of the clock.
    auto& loop = servo_.loop;
    double const rate = loop.rate();
    auto const started = std::chrono::steady_clock::now();
    if (done_ == 0) begun_ = last_ = started;
    double const elapsed = done_ == 0 ? 1.0 / rate : std::chrono::duration<double>(started - last_).count(), periods = std::max(1.0, std::round(elapsed * rate));
    last_ = started;
    double const time = started_at_ + static_cast<double>(done_) / rate, now = std::chrono::duration<double>(started - begun_).count();
    std::uint64_t const clock = static_cast<std::uint64_t>(now * rate) + lead_, due = std::max(slot_ + (done_ == 0 ? 0 : 1), clock);   // a burst is no gap before the next
    if (due > clock + max_lead) lead_ += due - clock - max_lead;   // a clock that is too fast
    std::uint64_t const missed = done_ == 0 ? 0 : due - slot_ - 1;
    slot_ = due;
    loop.read(static_cast<Scalar>(periods / rate), elapsed);
    if (loop.placed()) {
      poses_.back() = {loop.tool(), time, now, loop.pose_discontinuities()};
      poses_.publish();
    }
    Tick tick = loop.respond(models_.read(), time, now);
    tick.missed = static_cast<std::uint32_t>(std::min<std::uint64_t>(missed, std::numeric_limits<std::uint32_t>::max()));
    recording_.try_append(tick);
    static_cast<void>(servo_.ticks->push(tick));
    servo_.statistics.add(TickTiming{slot.due, started, std::chrono::steady_clock::now()});
    servo_.statistics.add_skipped(missed);
    if (done_ % live_every == 0) servo_.publish();
  }

  ToolServo<Device, Force, Scalar>& servo_;
  RealtimeOptions const& options_;
  RunFlags const& flags_;
  std::uint64_t ticks_;
  double started_at_;       // s
  Pacer pacer_;
  std::uint64_t done_ = 0;   // ticks; the servo's until it has ended
  static constexpr std::uint64_t max_lead = 32;   // ticks of a burst
  std::uint64_t slot_ = 0, lead_ = 0;              // the last one's number on the clock, had none been missed; what is added to the clock's own
  std::chrono::steady_clock::time_point begun_{}, last_{};   // when its first and its last tick started
  Recording recording_;
  TripleBuffer<Pose> poses_;
  TripleBuffer<LocalModel<Scalar>> models_;
  std::atomic<bool> runs_{true};
  std::atomic<std::uint64_t> beats_{0};   // of the device's clock
  bool is_driven_ = false, is_started_ = false, is_placed_ = false, is_watched_ = false;
  std::uint64_t seen_beats_ = 0;
  std::chrono::steady_clock::time_point seen_at_{};
  std::thread thread_;
};

}  // namespace palpate::detail
