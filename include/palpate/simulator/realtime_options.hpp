// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/simulator/pacer.hpp>

#include <array>
#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace palpate {

/// What a servo thread asks of the operating system. By default only what needs no rights and concerns no other thread, exact timers: a library
/// must not change how a host's process or machine runs unless it is told to. `recommended()` asks for all that helps on a machine that is
/// there for this; what is not granted is reported and does not stop the run.
struct RealtimeOptions {
  bool fifo = false;                 ///< SCHED_FIFO: nothing of lower priority interrupts the servo. A tick that hangs then stops its core
  int priority = 75;                 ///< of SCHED_FIFO, 1 to 98: above most drivers' threads (50), below the kernel's own (99)
  bool lock_memory = false;          ///< mlockall: no page of the process, all threads', is swapped out or loaded late; all of it takes up memory
  std::optional<int> core = {};      ///< the servo runs on this core alone; sensible where the core is kept free for it
  std::size_t prefault_stack = 0;    ///< bytes of stack touched before the first tick, so that none is mapped within one
  bool no_deep_sleep = false;        ///< /dev/cpu_dma_latency = 0: no core of the machine sleeps so deeply that it wakes late; costs power
  bool exact_timers = true;          ///< a timer slack of 1 ns in place of 50 µs, by which Linux may wake ordinary threads late
  bool flush_denormals = false;      ///< numbers too small for a normal exponent count as zero in the servo thread; see FlushDenormals
  std::chrono::nanoseconds spin = {};   ///< the servo wakes so much too early and looks at the clock until its time; at most 50 µs

  /// All but the core and the spinning, which depend on the machine.
  static RealtimeOptions recommended() {
    return {.fifo = true, .lock_memory = true, .prefault_stack = 256 * 1024, .no_deep_sleep = true, .flush_denormals = true};
  }

  void validate() const {
    if (priority < 1 || priority > 98)
      throw InvalidArgument(detail::message("a real-time priority of ", priority,
                                            "; choose 1 to 98, for instance 75: 99 is the kernel's own, and whoever shares it can stop the machine"));
    if (core && (*core < 0 || *core >= 1024))
      throw InvalidArgument(detail::message("the servo's core is ", *core, "; cores are numbered from 0 to at most 1023"));
    if (prefault_stack > max_stack)
      throw InvalidArgument(detail::message("prefault_stack is ", prefault_stack, " bytes; a servo tick needs far less than ", max_stack));
    static_cast<void>(Pacer::checked_spin(spin));
  }

  static constexpr std::size_t max_stack = 4 * 1024 * 1024;   // bytes
};

/// One request and what became of it.
struct RealtimeItem {
  std::string_view name = {};
  std::string_view unit = {};     ///< of `found`
  bool asked = false;
  bool granted = false;           ///< read back from the system after it had agreed, not assumed
  long long found = -1;           ///< what was read back; negative where there is no number
  std::string_view reason = {};   ///< why it was not granted and what would help, or what there is to know; a text that does not end
};

/// What a thread asked for and what it was granted.
struct RealtimeReport {
  RealtimeItem priority{.name = "SCHED_FIFO priority"};
  RealtimeItem memory{.name = "memory locked", .unit = "KiB"};
  RealtimeItem core{.name = "core"};
  RealtimeItem stack{.name = "stack touched", .unit = "KiB"};
  RealtimeItem sleep{.name = "wake-up from sleep", .unit = "µs"};
  RealtimeItem timers{.name = "timer slack", .unit = "ns"};
  RealtimeItem denormals{.name = "denormals are zero"};

  std::array<RealtimeItem, 7> items() const noexcept { return {priority, memory, core, stack, sleep, timers, denormals}; }
  /// Was all granted that was asked for?
  bool complete() const noexcept {
    for (RealtimeItem const& item : items())
      if (item.asked && !item.granted) return false;
    return true;
  }
};

/// One line an item.
inline std::string to_text(RealtimeReport const& report) {
  std::string text;
  for (RealtimeItem const& item : report.items()) {
    text += detail::message(item.name, ": ");
    if (!item.asked) {
      text += "not asked for\n";
      continue;
    }
    text += item.granted ? "granted" : "not granted";
    if (item.granted && item.found >= 0) text += detail::message(", ", item.found, item.unit.empty() ? "" : " ", item.unit);
    if (!item.reason.empty()) text += detail::message("; ", item.reason);
    text += '\n';
  }
  return text;
}

}  // namespace palpate
