// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>

#include <chrono>
#include <cmath>
#include <cstdint>
#include <thread>

#if defined(__linux__)
#include <cerrno>
#include <ctime>
#endif

namespace palpate {

/// Where ticks are due: start, start + period, start + 2 period, … Pure arithmetic, so that it can be tested without a clock.
class Schedule {
 public:
  using Clock = std::chrono::steady_clock;
  using TimePoint = Clock::time_point;
  using Duration = std::chrono::nanoseconds;

  /// A tick's time, and how many ticks before it were given up.
  struct Slot {
    TimePoint due;
    std::uint64_t skipped;
  };

  /// The first tick is due one period after `start`.
  Schedule(TimePoint start, Duration period) noexcept : last_(start), period_(period) {}

  /// The tick after the last one; if its time has passed at `now`, the first one whose time has not. Late ticks are skipped,
  /// never made up for in a burst, and the grid of times stays where it was.
  Slot next(TimePoint now) noexcept {
    TimePoint due = last_ + period_;
    std::uint64_t skipped = 0;
    if (now > due) {
      auto const late = std::chrono::duration_cast<Duration>(now - due).count();
      auto const missed = (late + period_.count() - 1) / period_.count();
      due += missed * period_;
      skipped = static_cast<std::uint64_t>(missed);
    }
    last_ = due;
    return {due, skipped};
  }

  Duration period() const noexcept { return period_; }

 private:
  TimePoint last_;
  Duration period_;
};

/// Sleeps from tick to tick at a steady rate, measured against absolute times: a late wake-up does not delay the next one.
/// Units      Hz.
/// Cost       `wait` sleeps in the operating system and neither allocates nor throws. Precision is the system's: some 50 µs on a
///            quiet Linux, milliseconds on a busy one. With `spin` it wakes so much earlier and looks at the clock until the time has
///            come: less late, for so much of a core's time in every tick.
class Pacer {
 public:
  using Clock = Schedule::Clock;
  using Slot = Schedule::Slot;

  /// Starts the grid of times now. `spin` is at most 50 µs and half a period.
  explicit Pacer(double rate, Schedule::Duration spin = {}) : schedule_(Clock::now(), period_of(rate)), spin_(checked_spin(spin)) {
    if (spin_ > schedule_.period() / 2)
      throw InvalidArgument(detail::message("a spin of ", spin_.count(), " ns is more than half of a period at ", rate,
                                            " Hz; a thread that hardly ever sleeps is stopped by the system"));
  }

  /// Sleeps until the next tick is due and returns it.
  Slot wait() noexcept {
    Slot const slot = schedule_.next(Clock::now());
    sleep_until(slot.due - spin_);
    if (spin_ > Schedule::Duration::zero())
      while (Clock::now() < slot.due) relax();
    return slot;
  }
  /// Starts the grid of times again, now.
  void restart() noexcept { schedule_ = Schedule(Clock::now(), schedule_.period()); }

  Schedule::Duration period() const noexcept { return schedule_.period(); }

  static Schedule::Duration period_of(double rate) {
    if (!(rate >= 0.001) || !(rate <= 1e6))
      throw InvalidArgument(detail::message("a pace of ", rate, " Hz can not be kept; choose between 0.001 and 1000000 Hz"));
    return Schedule::Duration(std::llround(1e9 / rate));
  }
  static Schedule::Duration checked_spin(Schedule::Duration spin) {
    constexpr Schedule::Duration most = std::chrono::microseconds(50);
    if (spin < Schedule::Duration::zero() || spin > most)
      throw InvalidArgument(
          detail::message("a spin of ", spin.count(), " ns; choose 0 to ", most.count(), " ns: spinning takes the core from all others"));
    return spin;
  }

 private:
  static void sleep_until(Schedule::TimePoint due) noexcept {
#if defined(__linux__)
    // steady_clock is CLOCK_MONOTONIC here; an absolute time survives signals and preemption before the call.
    auto const since = std::chrono::duration_cast<std::chrono::nanoseconds>(due.time_since_epoch()).count();
    ::timespec const time{.tv_sec = static_cast<std::time_t>(since / 1'000'000'000), .tv_nsec = since % 1'000'000'000};
    while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, nullptr) == EINTR) {
    }
#else
    std::this_thread::sleep_until(due);
#endif
  }

  /// Tells the core that this thread only waits.
  static void relax() noexcept {
#if defined(__GNUC__) && (defined(__x86_64__) || defined(__i386__))
    __builtin_ia32_pause();
#elif defined(__GNUC__) && defined(__aarch64__)
    asm volatile("yield");
#endif
  }

  Schedule schedule_;
  Schedule::Duration spin_ = {};
};

}  // namespace palpate
