// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/text.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/random.hpp>
#include <palpate/core/version.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/device/hand_sample.hpp>
#include <palpate/simulator/recording.hpp>
#include <palpate/training/configuration.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

namespace palpate {

namespace detail {

/// What a device says of itself, by name; a session's formats have a place for all but the first `extra_values`, and take them for guessed.
struct StatedValue {
  std::string_view name;
  DeviceValue Capabilities::* value;
};
inline constexpr std::array<StatedValue, 10> stated_values{{{"max_stiffness", &Capabilities::max_stiffness}, {"damping", &Capabilities::damping}, {"friction", &Capabilities::friction},
                                                            {"resolution", &Capabilities::resolution}, {"max_force", &Capabilities::max_force}, {"rate", &Capabilities::rate},
                                                            {"max_torque", &Capabilities::max_torque}, {"continuous_force", &Capabilities::continuous_force},
                                                            {"max_damping", &Capabilities::max_damping}, {"mass", &Capabilities::mass}}};
inline constexpr std::size_t extra_values = 4;
/// Whether there is more to keep of one than its number.
inline bool states_more(Capabilities const& device, std::size_t k) noexcept {
  DeviceValue const& value = device.*stated_values[k].value;
  bool const has_place = k >= extra_values && (stated_values[k].name != "max_torque" || value > 0);
  return value.known() && !(has_place && value.provenance == Provenance::guessed);
}
inline bool states_more(Capabilities const& device) noexcept {
  for (std::size_t k = 0; k < stated_values.size(); ++k)
    if (states_more(device, k)) return true;
  return false;
}

}  // namespace detail

/// Something that happened at a time [s]: "touch", "puncture", "lift", "real time", "missed 3", or a word of the host's.
struct SessionEvent {
  double time = 0.0;
  std::string name{};

  friend bool operator==(SessionEvent const&, SessionEvent const&) = default;
};

/// What the phases of a recording tell: "touch" where a contact begins, "puncture" where the tool begins to cut, "lift" where the contact ends.
/// A tool that is through the surface with its first tick of contact gives a touch and a puncture at that time.
inline std::vector<SessionEvent> phase_events(Recording const& recording) {
  std::vector<SessionEvent> events;
  CuttingPhase before = CuttingPhase::no_contact;
  for (Tick const& tick : recording.ticks()) {
    if (tick.phase == before) continue;
    if (before == CuttingPhase::no_contact) events.push_back({tick.time, "touch"});
    if (tick.phase == CuttingPhase::moving) events.push_back({tick.time, "puncture"});
    if (tick.phase == CuttingPhase::no_contact) events.push_back({tick.time, "lift"});
    before = tick.phase;
  }
  return events;
}

/// A recording with all that is needed to know it again and to repeat it: who made it (version), with what (configuration, seed, device),
/// what the device said (hand, may be left out) and what happened (events).
///   Session const session = make_session(simulator.run(60.0), simulator.device(), configuration, Seed{7});
///   session_io.hpp writes and reads it, replay.hpp repeats it, comparison.hpp compares two.
/// Units      s, m, m/s, N, Hz.
/// Invariant  `hand` is empty or has one sample a tick; checked by `validate`, which writing calls.
/// Limits     whether the device lost its calibration meanwhile is not kept: then a replay goes on where the session felt nothing.
struct Session {
  std::string version = PALPATE_VERSION_STRING;   ///< of the library that recorded it
  Seed seed{};
  Configuration configuration{};
  Capabilities device{.max_force = std::numeric_limits<double>::infinity(), .rate = 1000.0};   ///< what its `safety` depends on, and what it reports, are kept
  Recording recording{};
  std::vector<HandSample> hand{};
  std::vector<SessionEvent> events{};

  /// Throws `InvalidArgument` for what could not be written and read back.
  void validate() const {
    require_valid(device);
    if (!detail::is_word(version))
      throw InvalidArgument(detail::message("Session: the version is \"", detail::legible(version), "\"; give one word, for example " PALPATE_VERSION_STRING));
    if (!hand.empty() && hand.size() != recording.ticks().size())
      throw InvalidArgument(detail::message("Session: there are ", hand.size(), " samples of the hand for ", recording.ticks().size(),
                                            " ticks; give one a tick, or none"));
    if (!(device.max_torque > 0))
      for (Tick const& tick : recording.ticks())
        if (!is_zero(tick.torque))
          throw InvalidArgument(detail::message("Session: there is torque at ", tick.time, " s, and the device has none; give .device.max_torque"));
    for (SessionEvent const& event : events) {
      if (!std::isfinite(event.time))
        throw InvalidArgument(detail::message("Session: the event \"", detail::legible(event.name), "\" is at ", event.time, " s; give a finite time"));
      if (event.name.empty() || !detail::is_line(event.name))
        throw InvalidArgument(detail::message("Session: an event is called \"", detail::legible(event.name),
                                              "\"; give one line without control characters, without blanks at its ends"));
    }
  }
};

/// The event that says of a session that its run was in real time: no run in lock-step is the same to the byte.
inline constexpr std::string_view real_time_event = "real time";

namespace detail {

/// Of an event "missed 3": how many ticks of real time there should have been before the one at that time. Of others 0.
inline std::uint32_t missed_ticks(SessionEvent const& event) noexcept {
  std::string_view name = event.name;
  std::uint32_t count = 0;
  if (!name.starts_with("missed ")) return 0;
  name.remove_prefix(7);
  auto const [end, error] = std::from_chars(name.data(), name.data() + name.size(), count);
  return error == std::errc{} && end == name.data() + name.size() ? count : 0;
}

}  // namespace detail

/// The session of a recording, its events those of the phases, before them `real_time_event` where it was in real time, and "missed 3" at a tick before which
/// three were missed: even_recording() reads that. A `RecordedDevice` that was
/// recorded from its first tick on adds the hand's samples; any other device tells its capabilities alone.
template <class Device>
Session make_session(Recording recording, Device const& device, Configuration configuration = {}, Seed seed = {}) {
  Session session{.seed = seed, .configuration = std::move(configuration), .device = device.capabilities()};
  session.events = phase_events(recording);
  if (recording.is_of_real_time())
    session.events.insert(session.events.begin(), {recording.ticks().empty() ? 0.0 : recording.ticks().front().time, std::string(real_time_event)});
  for (Tick const& tick : recording.ticks())
    if (tick.missed > 0) session.events.push_back({tick.time, detail::message("missed ", tick.missed)});
  std::ranges::stable_sort(session.events, {}, &SessionEvent::time);
  if constexpr (RecordsSamples<Device>) {
    if (device.samples().size() != recording.ticks().size())
      throw InvalidArgument(detail::message("make_session: the device kept ", device.samples().size(), " samples of the hand for ", recording.ticks().size(),
                                            " ticks; give RecordedDevice room for all of them, and record one run"));
    session.hand = device.samples();
  }
  session.recording = std::move(recording);
  return session;
}

}  // namespace palpate
