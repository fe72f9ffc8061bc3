// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/simulator/recording.hpp>
#include <palpate/training/session.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace palpate {

/// The recording of a session with a tick every 1/rate seconds of the clock: between its own by a line, where some were missed in real time or are missing in
/// their times; the same recording where none is. Times are then the clock's. Phase, cut area and energy are those of the nearer tick.
/// Errors     `InvalidArgument` where more than 99 of 100 ticks are missing.
/// Cost       O(ticks).
inline Recording even_recording(Session const& session) {
  auto const& ticks = session.recording.ticks();
  double const rate = session.device.rate;
  std::vector<std::pair<double, double>> late;   // when, and how many were missed before
  for (SessionEvent const& event : session.events)
    if (std::uint32_t const missed = detail::missed_ticks(event); missed > 0) late.push_back({event.time, static_cast<double>(missed)});
  std::ranges::sort(late);
  std::vector<double> times;   // s, of the clock
  double missed = 0.0;
  auto next = late.begin();
  for (Tick const& tick : ticks) {
    for (; next != late.end() && next->first <= tick.time; ++next) missed += next->second;
    times.push_back(tick.time + missed / rate);
  }
  double const count = ticks.empty() ? 0.0 : std::round((times.back() - times.front()) * rate) + 1.0;
  if (!(count > static_cast<double>(ticks.size()))) return session.recording;
  if (count > 100.0 * static_cast<double>(ticks.size()))
    throw InvalidArgument(detail::message("even_recording: there are ", ticks.size(), " ticks over ", times.back() - times.front(), " s at ", rate,
                                          " Hz; leave out the time in which nothing was recorded"));
  Recording even;
  even.set_saturation(session.recording.saturation());
  if (session.recording.is_of_real_time()) even.set_real_time();
  even.reserve(static_cast<std::size_t>(count));
  std::size_t k = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    double const time = times.front() + static_cast<double>(i) / rate;
    while (k + 2 < ticks.size() && times[k + 1] <= time) ++k;
    Tick const &before = ticks[k], &after = ticks[k + 1];
    double const share = std::clamp((time - times[k]) / std::max(times[k + 1] - times[k], 1e-300), 0.0, 1.0);
    Tick tick = share < 0.5 ? before : after;
    tick.time = time, tick.missed = 0;
    tick.tip = (1.0 - share) * before.tip + share * after.tip;
    tick.force = (1.0 - share) * before.force + share * after.force;
    tick.torque = (1.0 - share) * before.torque + share * after.torque;
    tick.depth = (1.0 - share) * before.depth + share * after.depth;
    even.append(tick);
  }
  return even;
}

}  // namespace palpate
