// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/random.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/device/limit.hpp>
#include <palpate/device/trajectory.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <iterator>
#include <tuple>
#include <utility>
#include <vector>

namespace palpate {

/// How wide a gripper is open, and when.
struct TimedOpening {
  double time = 0;      // s
  double opening = 1;   // 0 closed, 1 open
};

/// How the tool is turned, and when: device frame ← tool.
struct TimedOrientation {
  double time = 0;   // s
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
};

struct ScriptedDeviceOptions {
  double max_force = 3.3;           ///< N; the Touch's value
  double rate = 1000.0;             ///< Hz
  bool reports_velocity = true;     ///< false: the host differentiates positions, as with most real devices
  double quantum = 0.0;             ///< m, resolution of the position; the velocity stays that of the path. 0: exact. A Touch has 5.5e-5
  double jitter = 0.0;              ///< s, a sample is taken up to that much early or late, evenly spread, and nobody is told; below half a tick
  double dropouts = 0.0;            ///< share of the ticks, 0 … 1, in which a dropout begins: reads that say `stale` and hold the last sample
  int dropout_ticks = 1;            ///< how long each lasts
  std::vector<TimedOpening> gripper = {};   ///< of a device that reports its gripper: evenly from one to the next; empty: it reports none
  std::vector<TimedOrientation> orientation = {};   ///< of a device that reports how it is turned: the short way from one to the next; one alone: always so; empty: it reports none
  std::uint64_t seed = 0;           ///< of jitter and dropouts; the same seed gives the same run
};

/// A device that follows a trajectory, whatever force is written; for tests, examples and repeated experiments.
///   tick n reads the trajectory at n / rate, n = 0, 1, 2, …; after the end the hand rests at the last point.
/// Quantisation, jitter of the sampling time and dropouts, as real devices have them, are off unless asked for.
/// Invariant  Time counts in reads, not on a clock: the same script gives the same samples on every machine. A real-time loop that skips
///            ticks delays the script, it does not change it. Jitter and dropouts are drawn from sequences of their own, one number a
///            tick: one does not change the other.
/// Errors     `InvalidArgument` for an option outside its range.
/// Cost       `read` is O(log pieces), `write` O(1); noexcept, no allocation.
template <RealScalar Scalar>
class ScriptedDevice {
 public:
  explicit ScriptedDevice(Trajectory<Scalar> trajectory, ScriptedDeviceOptions const& options = {})
      : trajectory_(std::move(trajectory)),
        options_(options),
        capabilities_{.max_force = options.max_force,
                      .rate = options.rate,
                      .reports_velocity = options.reports_velocity,
                      .reports_orientation = !options.orientation.empty(),
                      .reports_gripper = !options.gripper.empty(),
                      .moves_a_hand = false,
                      .resolution = options.quantum > 0.0 ? DeviceValue(options.quantum) : DeviceValue{}} {
    require_valid(capabilities_);
    detail::OptionCheck const require{"ScriptedDevice"};
    require(options.quantum == 0.0 || (options.quantum >= finest_quantum && options.quantum < 1.0), ".quantum", options.quantum,
            "give metres, zero or 1e-12 and more, for example 5.5e-5");
    require(options.jitter >= 0.0 && options.jitter < 0.5 / options.rate, ".jitter", options.jitter, "give seconds, 0 or more, below half a tick");
    require(options.dropouts >= 0.0 && options.dropouts <= 1.0, ".dropouts", options.dropouts, "give a share of the ticks, 0 to 1");
    require(options.dropout_ticks >= 1, ".dropout_ticks", options.dropout_ticks, "give 1 or more");
    for (TimedOpening const& each : options.gripper) require(each.opening >= 0 && each.opening <= 1, ".gripper", each.opening, "give openings from 0 to 1");
    for (TimedOrientation const& each : options.orientation)
      require(std::abs(each.orientation.norm() - 1) < 1e-6, ".orientation's norm", each.orientation.norm(), "give unit quaternions, w first");
    auto const rise = [&](auto const& each, char const* name) {
      for (std::size_t k = 0; k < each.size(); ++k)
        require(std::isfinite(each[k].time) && (k == 0 || each[k].time > each[k - 1].time), name, each[k].time, "give finite times that rise");
    };
    rise(options.gripper, ".gripper's time");
    rise(options.orientation, ".orientation's time");
    rewind();
  }

  /// The same through points in time: ScriptedDevice<double>({{0.0, {0, 0, 0.01}}, {0.5, {0, 0, -0.005}}}); see Trajectory::through.
  explicit ScriptedDevice(std::initializer_list<TimedPoint<Scalar>> points, ScriptedDeviceOptions const& options = {})
      : ScriptedDevice(Trajectory<Scalar>::through({points.begin(), points.size()}), options) {}

  Capabilities capabilities() const noexcept { return capabilities_; }

  DeviceStatus read(DeviceState<Scalar>& state) noexcept {
    double time = this->time();
    ++tick_;
    if (options_.dropouts > 0.0) {
      bool const begins = dropping_.uniform<double>() < options_.dropouts;
      if (missing_ > 0) --missing_;
      if (missing_ == 0 && begins) missing_ = options_.dropout_ticks;
    }
    if (options_.jitter > 0.0) time += options_.jitter * jittering_.uniform(-1.0, 1.0);
    bool const drops = missing_ > 0;
    bool const is_new = !drops || tick_ == 1;   // the first sample is there, whatever comes
    if (is_new) last_ = trajectory_.at(time);
    state.position = quantised(last_.position, options_.quantum);
    if (options_.reports_velocity) state.velocity = last_.velocity;
    if (!options_.gripper.empty()) {
      if (is_new) last_opening_ = opening(time);
      state.gripper = static_cast<Scalar>(last_opening_);
    }
    if (!options_.orientation.empty()) {
      if (is_new) last_orientation_ = orientation(time);
      state.orientation = last_orientation_.template cast<Scalar>();
    }
    return drops ? DeviceStatus::stale : DeviceStatus::ok;
  }
  DeviceStatus write(Wrench<Scalar> const& wrench) noexcept {
    last_wrench_ = wrench;
    return DeviceStatus::ok;
  }

  /// How many samples were read.
  std::uint64_t tick() const noexcept { return tick_; }
  /// s, where in the trajectory the next read will be.
  double time() const noexcept { return static_cast<double>(tick_) / capabilities_.rate; }
  bool finished() const noexcept { return time() >= trajectory_.duration(); }
  /// Starts over; the last wrench is forgotten.
  void rewind() noexcept {
    tick_ = 0;
    missing_ = 0;
    last_wrench_ = {};
    jittering_ = Random(Seed{options_.seed});
    dropping_ = Random(Seed{options_.seed ^ 0x9e3779b97f4a7c15u});
  }

  Wrench<Scalar> const& last_wrench() const noexcept { return last_wrench_; }
  Trajectory<Scalar> const& trajectory() const noexcept { return trajectory_; }
  ScriptedDeviceOptions const& options() const noexcept { return options_; }

 private:
  /// Of what is listed: the last before a time, the next after it, and the share of the way between them that is gone.
  template <class Timed>
  static std::tuple<Timed const&, Timed const&, double> around(std::vector<Timed> const& all, double time) noexcept {
    auto const next = std::find_if(all.begin(), all.end(), [&](Timed const& each) { return each.time > time; });
    if (next == all.begin()) return {all.front(), all.front(), 0.0};
    if (next == all.end()) return {all.back(), all.back(), 0.0};
    Timed const& before = *std::prev(next);
    return {before, *next, (time - before.time) / (next->time - before.time)};
  }
  double opening(double time) const noexcept {
    auto const [from, to, share] = around(options_.gripper, time);
    return from.opening + share * (to.opening - from.opening);
  }
  Eigen::Quaterniond orientation(double time) const noexcept {
    auto const [from, to, share] = around(options_.orientation, time);
    return from.orientation.slerp(share, to.orientation);
  }

  Trajectory<Scalar> trajectory_;
  ScriptedDeviceOptions options_;
  Capabilities capabilities_;
  std::uint64_t tick_ = 0;
  int missing_ = 0;   // ticks of the dropout that are left, this one included
  Motion<Scalar> last_;
  double last_opening_ = 1;
  Eigen::Quaterniond last_orientation_ = Eigen::Quaterniond::Identity();
  Random jittering_, dropping_;
  Wrench<Scalar> last_wrench_;
};

}  // namespace palpate
