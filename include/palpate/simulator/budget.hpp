// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/substeps.hpp>
#include <palpate/core/error.hpp>
#include <palpate/simulator/simulator_statistics.hpp>

#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <span>
#include <string>
#include <string_view>

namespace palpate {

/// What comes to its limit first when everything takes longer, in proportion.
struct Bottleneck {
  std::string_view what = {};   ///< empty: nothing was counted against a period
  double share = 0.0;           ///< of its period, at p99
  bool is_body = false;         ///< not a servo
};

namespace detail {

inline double microseconds(std::chrono::nanoseconds duration) noexcept { return 1e-3 * static_cast<double>(duration.count()); }

/// Three digits: "3.12", "1040", "0.312".
inline std::string rounded(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, value >= 1000.0 ? "%.0f" : "%.3g", value);
  return buffer;
}
inline std::string microseconds_text(std::chrono::nanoseconds duration) { return rounded(microseconds(duration)) + " µs"; }

/// duration / period; 0 where there is no period.
inline double share_of(std::chrono::nanoseconds duration, std::chrono::nanoseconds period) noexcept {
  return period.count() > 0 ? static_cast<double>(duration.count()) / static_cast<double>(period.count()) : 0.0;
}

inline void append_loop(std::string& text, std::string_view name, TickStatistics const& loop, std::string const& more) {
  if (loop.ticks() == 0) {
    text += message(name, ": no tick yet\n");
    return;
  }
  auto const& compute = loop.compute();
  text += message(name, ": tick ", microseconds_text(compute.p50()), " (p99 ", microseconds_text(compute.p99()), ")");
  if (auto const target = loop.target(); target.count() > 0)
    text += message(" of ", microseconds_text(target), " at ", rounded(1e9 / static_cast<double>(target.count())), " Hz: ",
                    rounded(100.0 * share_of(compute.p50(), target)), " % (p99 ", rounded(100.0 * share_of(compute.p99(), target)), " %)");
  text += more + "; " + message(loop.overruns(), " overruns, ", loop.skipped(), " skipped in ", loop.ticks(), " ticks\n");
  if (loop.period().count() == 0) return;
  text += message("  period ", microseconds_text(loop.period().p50()), " (p99 ", microseconds_text(loop.period().p99()), ", longest ",
                  microseconds_text(loop.period().max()), "), woken ", microseconds_text(loop.latency().p50()), " late (p99 ",
                  microseconds_text(loop.latency().p99()), ")\n");
}

}  // namespace detail

/// The largest of
///   servo's computing   p99 of its computing time / its period
///   servo's wake-up     p99 of how late it begins / its period          (in real time)
///   body's computing    p99 of its computing time / its period
/// each against the period that its loop aims at. In lock-step servo and body share one thread and one period: there it is the larger of the two.
inline Bottleneck bottleneck(SimulatorStatistics const& statistics) noexcept {
  Bottleneck first;
  auto const consider = [&](std::string_view what, DurationHistogram const& times, std::chrono::nanoseconds period, bool is_body = false) {
    double const share = detail::share_of(times.p99(), period);
    if (share > first.share) first = {what, share, is_body};
  };
  consider("the servo's computing", statistics.servo.compute(), statistics.servo.target());
  consider("the servo's wake-up", statistics.servo.latency(), statistics.servo.target());
  consider("the body's computing", statistics.body.compute(), statistics.body.target(), true);
  return first;
}

/// What the limit of force did, in one line; empty where it is the device's own and cut nothing off.
inline std::string to_text(ForceSaturation const& force) {
  bool const lowered = force.max_force < force.device_max_force;
  if (!lowered && force.ticks == 0) return {};
  std::string text = detail::message("force: at most ", detail::rounded(force.max_force), " N is written");
  if (lowered) text += detail::message(" of the ", detail::rounded(force.device_max_force), " N that the device can");
  text += force.ticks == 0 ? std::string("; no more was wanted")
                           : detail::message("; ", force.ticks, " ticks wanted more, up to ", detail::rounded(force.max_wanted), " N");
  text += !lowered                ? "; the device can no more, see Capabilities::max_force\n"
          : force.protects_a_hand ? "; a hand is protected: raise SafetyOptions::max_force, or say moves_a_hand = false in the device's Capabilities if nobody holds it\n"
                                  : "; SafetyOptions::max_force says so\n";
  return text;
}

/// What the body's next ticks will take, if a step costs what one has cost so far: known before the body falls behind, and anew as soon as a tick has found
/// the stable step that an edit left. The contact's coupling is solved with each step and lets any stable step be, see ContactCoupling.
struct StepForecast {
  double stable_step = 0.0;   ///< s; infinite where any step is stable
  int steps = 0;              ///< that a tick needs; 1e9 where none is stable
  int allowed = 0;
  double step_cost = 0.0;     ///< s, contact and cutting included, at the median; 0: not known
  double period = 0.0;        ///< s, of a tick

  /// Of its period, that a tick will take.
  double share() const noexcept { return period > 0.0 ? steps * step_cost / period : 0.0; }
  /// More steps than allowed, or more than four fifths of the period: what comes besides, a cut or a late wake-up, does not fit any more.
  bool falls_behind() const noexcept { return steps > allowed || share() > 0.8; }
};

/// From what was counted so far; steps are 0 where nothing was.
inline StepForecast step_forecast(SimulatorStatistics const& statistics) noexcept {
  BodyCounts const& body = statistics.body_counts;
  StepForecast forecast{.stable_step = body.stable_step, .allowed = body.steps_allowed, .period = std::chrono::duration<double>(statistics.body.target()).count()};
  if (body.steps > 0) forecast.step_cost = std::chrono::duration<double>(statistics.body.compute().p50()).count() * static_cast<double>(body.ticks) / static_cast<double>(body.steps);
  if (body.steps_allowed > 0 && forecast.period > 0.0) forecast.steps = split_duration(forecast.period, body.stable_step, body.steps_allowed).wanted;
  return forecast;
}

/// One line; empty where nothing is known.
inline std::string to_text(StepForecast const& forecast) {
  if (forecast.steps == 0) return {};
  if (!(forecast.stable_step > 0.0)) return "forecast: no step of the body is stable: give it damping, or another integrator\n";
  auto const in_microseconds = [](double seconds) { return detail::rounded(1e6 * seconds) + " µs"; };
  std::string text = "forecast: " + (std::isfinite(forecast.stable_step) ? "steps up to " + in_microseconds(forecast.stable_step) + " are stable" : std::string("any step is stable"));
  text += detail::message(", ", forecast.steps, forecast.steps == 1 ? " step" : " steps", " a tick of ", in_microseconds(forecast.period));
  if (forecast.steps > forecast.allowed) text += detail::message(" where ", forecast.allowed, " are allowed");
  if (forecast.step_cost > 0.0) text += detail::message(", ", in_microseconds(forecast.step_cost), " each: ", detail::rounded(100.0 * forecast.share()), " % of it");
  if (forecast.falls_behind())
    text += forecast.steps > 1 ? "; the body will fall behind: a coarser mesh, more mass, softer tissue or less damping make the stable step longer, BackwardEuler takes any"
                               : "; the body will fall behind: compute fewer particles, allow an implicit step fewer iterations, or lower SimulatorOptions::body_rate";
  return text + "\n";
}

/// How far the body is behind the hand, why, and what to do, in one line; empty where it is not, and some step is stable. A body that lags moves in
/// slow motion.
inline std::string lag_text(BodyCounts const& body) {
  if (!(body.lag > 0.0))
    return body.capped == 0 ? std::string()
                            : detail::message("no step of the body is stable in ", body.capped, " of ", body.ticks, " ticks: give it damping, or another integrator\n");
  std::string text = detail::message("the body lags ", detail::rounded(body.lag), " s behind the hand, ", detail::rounded(100.0 * body.lag / body.seconds), " % of ",
                                     detail::rounded(body.seconds), " s");
  if (body.capped > 0)
    text += detail::message("; ", body.capped, " of ", body.ticks, " ticks wanted up to ", body.max_steps_wanted, " steps where ", body.max_steps_a_tick,
                            " are allowed: raise SimulatorOptions::max_body_steps, or make the stable step longer with softer links, less damping, more mass or a coarser mesh");
  if (body.diverged > 0) text += detail::message("; ", body.diverged, " steps diverged: see the stable step");
  if (body.capped == 0 && body.diverged == 0) text += "; its ticks came too late: compute fewer particles, lower SimulatorOptions::body_rate, or leave its thread a core";
  return text + "\n";
}

/// Which tetrahedron was turned over, how far, and what to do, in one line; empty where none was found.
inline std::string inverted_text(BodyCounts const& body) {
  if (body.inverted == 0) return {};
  return detail::message("a tetrahedron was found flat or turned over after ", body.inverted, " of ", body.steps, " steps, most of all number ", body.inverted_element, ", to det F = ",
                         detail::rounded(body.lowest_determinant), ": there the force is not a tissue's; press less, or with a larger tip, or make the mesh finer\n");
}

/// Where the time of a tick goes, as text: for a log or a window beside the simulation.
///   servo: tick 3.12 µs (p99 5.2 µs) of 1000 µs at 1000 Hz: 0.312 % (p99 0.52 %); 0 overruns, 0 skipped in 1500 ticks
///     period 1000 µs (p99 1040 µs, longest 1130 µs), woken 37 µs late (p99 82 µs)
///   body: tick 180 µs (p99 260 µs) of 2000 µs at 500 Hz: 9 % (p99 13 %), 1.8 steps a tick; 0 overruns, 0 skipped in 750 ticks
///     period 2000 µs (p99 2050 µs, longest 2200 µs), woken 60 µs late (p99 110 µs)
///   next bottleneck: the body's computing, 13 % of its period at p99; it may take 7.69 times as long
///   forecast: steps up to 1140 µs are stable, 2 steps a tick of 2000 µs, 100 µs each: 10 % of it
/// After it, where there is reason to, how far the body lags, `lag_text`, what was turned over, `inverted_text`, and what the limit of force did,
/// `to_text(ForceSaturation)`.
/// Share      computing time / period aimed at, at the median and at p99. Steps a tick are a mean. Times of a quantile are within 1/32.
/// For        `simulator.statistics()` after a run, `simulator.live_statistics()` during one; of several tools an array of theirs,
///              std::array{simulator.statistics<0>(), simulator.statistics<1>()}
///            which has a row "servo of tool 0: …" for each, and the body they share once. Not for the servo: it allocates.
inline std::string budget_text(std::span<SimulatorStatistics const> tools) {
  std::string text;
  if (tools.empty()) return text;
  auto const of_tool = [&](std::size_t k) { return tools.size() > 1 ? detail::message(" of tool ", k) : std::string(); };
  std::size_t narrowest = 0;
  for (std::size_t k = 0; k < tools.size(); ++k) {
    detail::append_loop(text, "servo" + of_tool(k), tools[k].servo, "");
    if (bottleneck(tools[k]).share > bottleneck(tools[narrowest]).share) narrowest = k;
  }
  BodyCounts const& body = tools[0].body_counts;
  detail::append_loop(text, "body", tools[0].body,
                      body.ticks == 0 ? ""
                                      : detail::message(", ", detail::rounded(static_cast<double>(body.steps) / static_cast<double>(body.ticks)),
                                                        " steps a tick"));
  if (Bottleneck const first = bottleneck(tools[narrowest]); !first.what.empty()) {
    text += detail::message("next bottleneck: ", first.what, first.is_body ? std::string() : of_tool(narrowest), ", ", detail::rounded(100.0 * first.share),
                            " % of its period at p99; ");
    text += first.share <= 1.0 ? detail::message("it may take ", detail::rounded(1.0 / first.share), " times as long\n")
                               : detail::message("that is ", detail::rounded(first.share), " times what there is\n");
  }
  text += to_text(step_forecast(tools[0])) + lag_text(body) + inverted_text(body);
  for (std::size_t k = 0; k < tools.size(); ++k)
    if (std::string const force = to_text(tools[k].servo_counts.saturation); !force.empty()) text += (tools.size() > 1 ? detail::message("tool ", k, ", ") : std::string()) + force;
  return text;
}
inline std::string budget_text(SimulatorStatistics const& statistics) { return budget_text(std::span(&statistics, 1)); }

}  // namespace palpate
