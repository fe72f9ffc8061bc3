// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/simulator/body_loop.hpp>
#include <palpate/simulator/realtime_options.hpp>
#include <palpate/simulator/seqlock.hpp>
#include <palpate/simulator/servo_loop.hpp>
#include <palpate/simulator/tick_statistics.hpp>

namespace palpate {

/// How a simulation ran.
struct SimulatorStatistics {
  TickStatistics servo;     ///< in lock-step: computing times only
  TickStatistics body;
  ServoCounts servo_counts;
  BodyCounts body_counts;
};

/// The statistics of a simulator for other threads, while its own go on counting.
/// Threads    `publish_servo` and `publish` of a report: the servo's; `publish_body`: the body's; `statistics`, `report`: any, any number.
/// Cost       publishing copies 28 KiB, some 1 µs; noexcept, no allocation.
class LiveStatistics {
 public:
  void publish_servo(TickStatistics const& ticks, ServoCounts const& counts) noexcept {
    servo_.write(ticks);
    servo_counts_.write(counts);
  }
  void publish_body(TickStatistics const& ticks, BodyCounts const& counts) noexcept {
    body_.write(ticks);
    body_counts_.write(counts);
  }
  void publish(RealtimeReport const& report) noexcept { report_.write(report); }

  /// Each part is whole; the four may be a publication apart.
  SimulatorStatistics statistics() const noexcept {
    return {.servo = servo_.read(), .body = body_.read(), .servo_counts = servo_counts_.read(), .body_counts = body_counts_.read()};
  }
  RealtimeReport report() const noexcept { return report_.read(); }

 private:
  Seqlock<TickStatistics> servo_, body_;
  Seqlock<ServoCounts> servo_counts_;
  Seqlock<BodyCounts> body_counts_;
  Seqlock<RealtimeReport> report_;
};

}  // namespace palpate
