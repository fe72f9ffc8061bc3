// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/phase.hpp>
#include <palpate/force/concept.hpp>
#include <palpate/training/alignment.hpp>
#include <palpate/training/even_recording.hpp>
#include <palpate/training/session.hpp>
#include <palpate/training/smoothness.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

namespace palpate {

struct ComparisonOptions {
  AlignmentOptions alignment{};
  SmoothnessOptions smoothness{};
  double still = 1e-4;         ///< m, work begins when the tip is this far from where it began, and ends when it stays as near to where it ends
  double region = 0.005;       ///< m, a contact that begins farther than this from all contacts of the expert is not meant
  double contact_gap = 0.05;   ///< s, contacts with no more than that between them are one
};

/// What one session is by itself.
/// Units      s, m, N.
struct Performance {
  double seconds = 0.0;   ///< of work; see `ComparisonOptions::still`
  Smoothness smoothness{};   ///< over these seconds: a single reach of minimum jerk, of which `still` cuts off a twentieth at either end, has 153, at any pace
  double path_length = 0.0;
  double largest_depth = 0.0;
  double largest_force = 0.0;
  int contacts = 0;
};

/// What sets a trainee's session apart from an expert's. Every number is zero for a session and itself.
/// Units      m, N, s.
struct Comparison {
  Performance expert{}, trainee{};

  double mean_deviation = 0.0;      ///< of the trainee's tip from the expert's path, aligned in time; over the trainee's ticks
  double rms_deviation = 0.0;
  double largest_deviation = 0.0;
  double missed = 0.0;              ///< largest distance of the expert's path from the trainee's: what was left out
  double rms_force_difference = 0.0;   ///< along the aligned path, of the force as a vector
  double noticed_force_difference = 0.0;   ///< share of the ticks in contact in which the force differs by more than `force_just_noticeable_difference` of the expert's
  double mean_depth_error = 0.0;    ///< magnitude, over the ticks in which the trainee or the expert is in contact
  double largest_depth_error = 0.0;
  double overshoot = 0.0;           ///< how much deeper than the expert the trainee ever was
  double excess_jerk = 0.0;         ///< ln of the trainee's T⁵ ∫ |x‴|² dt over the expert's; below zero where the trainee is smoother
  double excess_time = 0.0;         ///< seconds of work more than the expert's, as a share of those; below zero where the trainee is faster
  int unintended_contacts = 0;      ///< contacts outside the expert's region, and those in it that are more than the expert's
  bool did_nothing = false;         ///< the expert touched tissue, and the trainee none of that region

  Alignment alignment{};            ///< of the trainee's ticks with the expert's; of those of even_recording(), where some were missed
};

namespace detail {

inline Matrix3X<double> tips_of(Recording const& recording) {
  Matrix3X<double> tips(3, static_cast<Eigen::Index>(recording.ticks().size()));
  for (Eigen::Index i = 0; i < tips.cols(); ++i) tips.col(i) = recording.ticks()[static_cast<std::size_t>(i)].tip;
  return tips;
}

/// The ticks of work, first and last.
inline std::pair<Eigen::Index, Eigen::Index> work_of(Matrix3X<double> const& tips, double still) {
  Eigen::Index first = 0, last = tips.cols() - 1;
  while (first < last && (tips.col(first + 1) - tips.col(0)).norm() <= still) ++first;
  while (last > first && (tips.col(last - 1) - tips.col(tips.cols() - 1)).norm() <= still) --last;
  return {first, last};
}

/// The first tick of every contact; those with at most `gap` ticks between them are one.
inline std::vector<std::size_t> contacts_of(Recording const& recording, double gap) {
  std::vector<std::size_t> starts;
  double ended = -std::numeric_limits<double>::infinity();   // the last tick of contact so far
  auto const& ticks = recording.ticks();
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    if (ticks[i].phase == CuttingPhase::no_contact) continue;
    if (static_cast<double>(i) - ended - 1.0 > gap) starts.push_back(i);
    ended = static_cast<double>(i);
  }
  return starts;
}

inline Performance performance_of(Session const& session, Matrix3X<double> const& tips, ComparisonOptions const& options) {
  Performance performance;
  auto const [first, last] = work_of(tips, options.still);
  double const rate = session.device.rate;
  performance.seconds = static_cast<double>(last - first) / rate;
  double const ends = std::ceil(std::max(options.smoothness.window * rate, 0.1 * static_cast<double>(last - first)));   // of a reach, which are a part of it
  auto const margin = static_cast<Eigen::Index>(std::min(ends, static_cast<double>(tips.cols())));
  Eigen::Index const from = std::max(Eigen::Index(0), first - margin), to = std::min(tips.cols() - 1, last + margin);
  if (to - from + 1 >= 7) performance.smoothness = smoothness(tips.middleCols(from, to - from + 1), rate, options.smoothness);
  double const measured = std::exchange(performance.smoothness.seconds, performance.seconds);   // rests beside the work are no part of its pace
  if (measured > 0.0) performance.smoothness.dimensionless_jerk *= std::pow(performance.seconds / measured, 3);
  for (Eigen::Index i = 1; i < tips.cols(); ++i) performance.path_length += (tips.col(i) - tips.col(i - 1)).norm();
  for (Tick const& tick : session.recording.ticks())
    if (tick.phase != CuttingPhase::no_contact) performance.largest_depth = std::max(performance.largest_depth, tick.depth);
  performance.largest_force = session.recording.largest_force();
  performance.contacts = static_cast<int>(contacts_of(session.recording, options.contact_gap * rate).size());
  return performance;
}

/// Between two ticks, for a tick with a fraction.
template <class Value>
auto between(std::vector<Tick> const& ticks, double tick, Value value) {
  auto const before = std::min(static_cast<std::size_t>(tick), ticks.size() - 1), after = std::min(before + 1, ticks.size() - 1);
  double const share = tick - static_cast<double>(before);
  return share == 0.0 ? value(ticks[before]) : decltype(value(ticks[0]))((1.0 - share) * value(ticks[before]) + share * value(ticks[after]));
}

}  // namespace detail

/// Compares a trainee's session with an expert's.
///   Both paths are aligned in time first (see `align`); force and depth are then compared with the expert's at the place that belongs to a tick.
///   Jerk is compared as T⁵/A² ∫ |x‴|² dt (\cite hogan2009) with one amplitude A for both: it does not depend on pace, and a stronger tremor always
///   counts for more, while the log dimensionless jerk saturates where a tremor is faster than the movement.
///   Of a run in real time that missed ticks the recordings are made even first (see `even_recording`).
/// Errors     `InvalidArgument` for sessions of other rates, of fewer than two ticks, or with values that are not finite, and for options
///            out of their meaning; those of `even_recording`.
/// Cost       that of `align` and `smoothness`: two sessions of 60 s at 1 kHz take well under a second (release).
/// Limits     It says what differs, not what matters: a trainee who does well by another path is called deviating.
inline Comparison compare(Session const& recorded_expert, Session const& recorded_trainee, ComparisonOptions const& options = {}) {
  if (recorded_expert.device.rate != recorded_trainee.device.rate)
    throw InvalidArgument(detail::message("compare: the expert's rate is ", recorded_expert.device.rate.value, " Hz, the trainee's ", recorded_trainee.device.rate.value,
                                          " Hz; record both at one rate"));
  for (auto const& [name, value] : {std::pair(".still", options.still), {".region", options.region}, {".contact_gap", options.contact_gap}})
    if (!(value >= 0.0) || !std::isfinite(value))
      throw InvalidArgument(detail::message("compare: ", name, " is ", value, "; give a finite number, zero or more"));
  detail::OptionCheck{"compare", true}(options.smoothness.window > 0.0, ".smoothness.window", options.smoothness.window, " s", "give a positive time, for example 0.1");
  for (Session const* const session : {&recorded_expert, &recorded_trainee})
    for (Tick const& tick : session->recording.ticks())
      if (!std::isfinite(tick.depth) || !is_finite(tick.force))
        throw InvalidArgument(detail::message("compare: depth or force at ", tick.time, " s is not finite; leave such ticks out"));

  auto const even = [](Session const& session) { return Session{.device = session.device, .recording = even_recording(session)}; };
  Session const expert = even(recorded_expert), trainee = even(recorded_trainee);
  Comparison result;
  Matrix3X<double> const path = detail::tips_of(trainee.recording), model = detail::tips_of(expert.recording);
  result.alignment = align(path, model, options.alignment);
  result.expert = detail::performance_of(expert, model, options);
  result.trainee = detail::performance_of(trainee, path, options);
  result.missed = result.alignment.missed;

  auto const &ticks = trainee.recording.ticks(), &others = expert.recording.ticks();
  double squares = 0.0, force_squares = 0.0, depth_sum = 0.0;
  std::size_t in_contact = 0, noticed = 0;
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    double const distance = result.alignment.distance[i], partner = result.alignment.partner[i];
    result.mean_deviation += distance / static_cast<double>(ticks.size());
    squares += distance * distance;
    result.largest_deviation = std::max(result.largest_deviation, distance);
    Vector3<double> const force = detail::between(others, partner, [](Tick const& tick) -> Vector3<double> { return tick.force; });
    double const difference = (ticks[i].force - force).norm();
    force_squares += difference * difference;
    auto const& nearest = others[std::min(static_cast<std::size_t>(std::lround(partner)), others.size() - 1)];
    if (ticks[i].phase == CuttingPhase::no_contact && nearest.phase == CuttingPhase::no_contact) continue;
    double const error = std::abs(ticks[i].depth - detail::between(others, partner, [](Tick const& tick) { return tick.depth; }));
    depth_sum += error;
    ++in_contact;
    if (difference > force_just_noticeable_difference * force.norm()) ++noticed;
    result.largest_depth_error = std::max(result.largest_depth_error, error);
  }
  result.rms_deviation = std::sqrt(squares / static_cast<double>(ticks.size()));
  result.rms_force_difference = std::sqrt(force_squares / static_cast<double>(ticks.size()));
  if (in_contact > 0) {
    result.mean_depth_error = depth_sum / static_cast<double>(in_contact);
    result.noticed_force_difference = static_cast<double>(noticed) / static_cast<double>(in_contact);
  }
  result.overshoot = std::max(0.0, result.trainee.largest_depth - result.expert.largest_depth);
  auto const jerk = [](Smoothness const& movement) { return std::pow(movement.seconds, 5) * movement.jerk_integral; };
  if (jerk(result.expert.smoothness) > 0.0 && jerk(result.trainee.smoothness) > 0.0)
    result.excess_jerk = std::log(jerk(result.trainee.smoothness) / jerk(result.expert.smoothness));
  if (result.expert.seconds > 0.0) result.excess_time = result.trainee.seconds / result.expert.seconds - 1.0;

  std::vector<Vector3<double>> meant;   // where the expert touched, as fine as the alignment
  detail::Samples const every(others.size(), options.alignment.samples);
  for (std::size_t k = 0; k < every.count(); ++k)
    if (others[every.at(k)].phase != CuttingPhase::no_contact) meant.push_back(others[every.at(k)].tip);
  for (std::size_t const start : detail::contacts_of(expert.recording, options.contact_gap * expert.device.rate)) meant.push_back(others[start].tip);
  auto const is_meant = [&](Tick const& tick) {
    return std::any_of(meant.begin(), meant.end(), [&](auto const& tip) { return (tip - tick.tip).norm() <= options.region; });
  };
  int inside = 0;
  for (std::size_t const start : detail::contacts_of(trainee.recording, options.contact_gap * trainee.device.rate)) {
    ++(is_meant(ticks[start]) ? inside : result.unintended_contacts);
  }
  result.unintended_contacts += std::max(0, inside - result.expert.contacts);
  result.did_nothing = result.expert.contacts > 0 && inside == 0;   // unless a contact that began elsewhere comes there
  detail::Samples const each(ticks.size(), options.alignment.samples);
  for (std::size_t k = 0; result.did_nothing && k < each.count(); ++k) {
    Tick const& tick = ticks[each.at(k)];
    result.did_nothing = tick.phase == CuttingPhase::no_contact || !is_meant(tick);
  }
  return result;
}

}  // namespace palpate
