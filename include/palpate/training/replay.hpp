// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/random.hpp>
#include <palpate/core/version.hpp>
#include <palpate/device/replay_device.hpp>
#include <palpate/training/detail/session_binary.hpp>
#include <palpate/training/session.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace palpate {

/// Why a session would not be repeated to the byte by a simulator of this version, configuration and seed: one line each, none when it would.
inline std::vector<std::string> replay_obstacles(Session const& session, Configuration const& configuration, Seed seed) {
  std::vector<std::string> obstacles;
  auto const add = [&](auto const&... parts) { obstacles.push_back(detail::message(parts...)); };
  if (session.version != PALPATE_VERSION_STRING) add("it was recorded by version ", session.version, ", this is " PALPATE_VERSION_STRING);
  if (session.seed.value != seed.value) add("its seed was ", session.seed.value, ", now it is ", seed.value);
  for (auto const& [key, value] : session.configuration.values()) {
    std::string const* const now = configuration.find(key);
    if (now == nullptr)
      add(key, " was ", value, ", now it is not set");
    else if (*now != value)
      add(key, " was ", value, ", now it is ", *now);
  }
  for (auto const& [key, value] : configuration.values())
    if (session.configuration.find(key) == nullptr) add(key, " was not set, now it is ", value);
  if (session.hand.empty() && session.device.reports_velocity)
    add("its device reported velocities, and they were not kept; record it with RecordedDevice");
  else if (session.hand.empty())
    add("the hand's samples were not kept, so it is not known whether a read failed; record it with RecordedDevice");
  auto const& ticks = session.recording.ticks();
  for (std::size_t k = 0; k < ticks.size(); ++k)
    if (double const time = static_cast<double>(k) / session.device.rate; !(std::abs(ticks[k].time - ticks[0].time - time) <= 1e-3 / session.device.rate)) {
      add("tick ", k, " is at ", ticks[k].time - ticks[0].time, " s after the first, a run in lock-step has it at ", time, " s: ticks are missing");
      break;
    }
  if (session.recording.is_of_real_time() || std::ranges::any_of(session.events, [](auto const& event) { return event.name == real_time_event; }))
    add("it ran in real time, where each answer of the body comes when it comes");
  return obstacles;
}

/// The hand of a session, for a simulator of the scalar that the device was recorded in (double, or float for a device of floats).
/// A session without the hand's samples gives the tips alone, as a device that reports no velocity: exact where the device was one, and no
/// read failed.
/// Errors     `InvalidArgument` for an empty session.
template <RealScalar Scalar = double>
ReplayDevice<Scalar> replay_whatever(Session const& session) {
  Capabilities device = session.device;
  std::vector<HandSample> samples = session.hand;
  if (samples.empty()) {
    device.reports_velocity = false;
    samples.reserve(session.recording.ticks().size());
    for (Tick const& tick : session.recording.ticks()) samples.push_back({.position = tick.tip});
  }
  return ReplayDevice<Scalar>(std::move(samples), device);
}

/// The same where the session will be repeated to the byte, for `Simulator(replay(session, configuration, seed), …).run(…)`.
/// Errors     `InvalidArgument` that names all obstacles; `replay_whatever` plays the hand for all that.
/// Limits     `Simulator::restore` and several runs are not in a session: repeat them. Bytes are equal on one processor with one compiler.
template <RealScalar Scalar = double>
ReplayDevice<Scalar> replay(Session const& session, Configuration const& configuration, Seed seed) {
  std::string all;
  for (std::string const& obstacle : replay_obstacles(session, configuration, seed)) all += "; " + obstacle;
  if (!all.empty())
    throw InvalidArgument("the session can not be repeated as it was" + all + ". Set the simulator up as then, or take replay_whatever(session)");
  return replay_whatever<Scalar>(session);
}

/// The first tick in which two recordings differ in any bit, or where one ends; none when they are the same.
inline std::optional<std::size_t> first_difference(Recording const& a, Recording const& b) noexcept {
  std::size_t const both = std::min(a.ticks().size(), b.ticks().size());
  for (std::size_t i = 0; i < both; ++i) {
    Tick const &one = a.ticks()[i], &other = b.ticks()[i];
    bool const same = one.phase == other.phase && detail::same_bits(one.time, other.time) && detail::same_bits(one.depth, other.depth) &&
                      detail::same_bits(one.tip, other.tip) && detail::same_bits(one.force, other.force) && detail::same_bits(one.energy, other.energy) &&
                      detail::same_bits(one.cut_area, other.cut_area) && detail::same_bits(one.torque, other.torque);
    if (!same) return i;
  }
  if (a.ticks().size() != b.ticks().size()) return both;
  return std::nullopt;
}

}  // namespace palpate
