// SPDX-License-Identifier: MIT
// Yardsticks: sessions written by hand, of which every difference is known in closed form.
#include "catch.hpp"

#include "device/message.hpp"

#include <palpate/core/random.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/device/trajectory.hpp>
#include <palpate/training/comparison.hpp>
#include <palpate/training/even_recording.hpp>
#include <palpate/training/replay.hpp>
#include <palpate/training/score.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

using namespace palpate;
using palpate_test::message_of;
using palpate_test::unsaid;

namespace {

using Path = Trajectory<double>;

/// Down to 8 mm below z = 0, 4 cm along x, up again; at rest before and after, as smooth as can be.
Path stroke(double pace = 1.0) {
  return Path::start({0, 0, 0.01})
      .hold(0.2 * pace)
      .line({0, 0, -0.008}, 0.8 * pace, Pace::minimum_jerk)
      .line({0.04, 0, -0.008}, 1.2 * pace, Pace::minimum_jerk)
      .line({0.04, 0, 0.01}, 0.6 * pace, Pace::minimum_jerk)
      .hold(0.2 * pace);
}

/// The session of a tip on that path over flat tissue that answers with 100 N/m below z = 0; `change` may alter each tick.
Session session_on(
    Path const& path, std::function<void(Tick&)> const& change = [](Tick&) {}) {
  Session session;
  for (int i = 0; i <= static_cast<int>(std::lround(path.duration() * 1000.0)); ++i) {
    Tick tick{.time = i / 1000.0, .tip = path.at(i / 1000.0).position};
    change(tick);
    tick.depth = std::max(0.0, -tick.tip.z());
    if (tick.depth > 0) tick.phase = tick.depth > 0.006 ? CuttingPhase::moving : CuttingPhase::indenting;
    tick.force += Vector3<double>(0, 0, 100.0 * tick.depth);
    session.recording.append(tick);
  }
  return session;
}

/// A tap from 5 mm above to 1 mm below z = 0 and back.
Path taps(Path path, int count, double x, double pause = 0.2) {
  for (int i = 0; i < count; ++i)
    path.line({x, 0, 0.005}, pause, Pace::minimum_jerk).line({x, 0, -0.001}, 0.2, Pace::minimum_jerk).line({x, 0, 0.005}, 0.2, Pace::minimum_jerk);
  return path;
}

}  // namespace

TEST_CASE("the expert compared with itself differs in nothing and has 100 points, to the bit", "[training][comparison]") {
  Random random(Seed{5});
  Session const expert = session_on(stroke(), [&](Tick& tick) { tick.force.x() = 0.1 * random.normal(); });
  Comparison const same = compare(expert, expert);
  CHECK(same.mean_deviation + same.rms_deviation + same.largest_deviation + same.missed == 0.0);
  CHECK(same.rms_force_difference == 0.0);
  CHECK(same.noticed_force_difference == 0.0);
  CHECK(same.mean_depth_error + same.largest_depth_error + same.overshoot == 0.0);
  CHECK(same.excess_jerk == 0.0);
  CHECK(same.excess_time == 0.0);
  CHECK(same.unintended_contacts == 0);
  Score const points = score(same);
  CHECK(points.total == 100.0);
  for (auto const& line : points.lines) CHECK(line.points == 100.0);
  CHECK(score(same, {.path = {.weight = 0.1, .half = 1e-9}, .time = {.weight = 0.3}}).total == 100.0);
}

TEST_CASE("a session by itself: time of work, way, depth, force, contacts", "[training][comparison]") {
  Performance const expert = compare(session_on(stroke()), session_on(stroke())).expert;
  // 2.6 s between the rests, less what a reach of 18 mm needs for its first and last 0.1 mm: 10 τ³ = 0.1/18 at τ = 0.082 of 0.8 and 0.6 s.
  CHECK(expert.seconds == Approx(2.6 - 0.085 * 0.8 - 0.085 * 0.6).margin(0.01));
  CHECK(expert.path_length == Approx(0.018 + 0.04 + 0.018).epsilon(1e-6));
  CHECK(expert.largest_depth == Approx(0.008).epsilon(1e-9));
  CHECK(expert.largest_force == Approx(0.8).epsilon(1e-9));
  CHECK(expert.contacts == 1);
}

TEST_CASE("a delayed copy deviates by nothing but its time", "[training][comparison]") {
  Session const expert = session_on(stroke());
  Session const late = session_on(Path::start({0, 0, 0.01}).hold(0.4).then(stroke()));
  Comparison const found = compare(expert, late);
  CHECK(found.largest_deviation < 2e-9);   // chords of 1 ms: |x″| h² / 8 with |x″| below 0.3 m/s²
  CHECK(found.missed < 1e-7);
  CHECK(found.rms_force_difference < 1e-6);
  CHECK(found.largest_depth_error < 1e-7);
  CHECK(found.excess_time == Approx(0.0).margin(1e-12));   // waiting before the work is no work
  CHECK(found.excess_jerk == Approx(0.0).margin(0.05));
  CHECK(score(found).total > 99.0);

  Session const slow = session_on(stroke(1.5));
  Comparison const slower = compare(expert, slow);
  CHECK(slower.excess_time == Approx(0.5).epsilon(0.01));
  CHECK(slower.largest_deviation < 1e-8);
  CHECK(slower.excess_jerk == Approx(0.0).margin(0.06));   // the dimensionless jerk does not depend on pace
  CHECK(score(slower)[ScorePart::time].points == Approx(50.0).epsilon(0.01));   // half of the points at the error called half
  CHECK(compare(slow, expert).excess_time == Approx(-1.0 / 3).epsilon(0.01));
  CHECK(score(compare(slow, expert))[ScorePart::time].points == 100.0);   // faster costs nothing
}

// Yardstick: a reach of minimum jerk has the same jerk at any pace, and rests are no part of it; 204.8 over all of it, of which the time of work is this share.
TEST_CASE("neither pace nor rests make a reach smoother or rougher", "[training][comparison]") {
  auto const reach = [](double seconds, double rest) {
    Path path = Path::start({0, 0, 0.01});
    if (rest > 0) path.hold(rest);
    path.line({0.1, 0, 0.01}, seconds, Pace::minimum_jerk);
    if (rest > 0) path.hold(rest);
    return session_on(path);
  };
  Session const expert = reach(1.0, 0.5);
  for (double const seconds : {0.5, 2.0, 4.0, 8.0}) {
    INFO(seconds << " s");
    Comparison const found = compare(expert, reach(seconds, 0.5));
    CHECK(found.excess_jerk == Approx(0.0).margin(seconds < 1.0 ? 0.15 : 0.05));   // the window rounds where a reach begins, of a quick one more
    double const work = found.trainee.seconds / seconds;
    CHECK(work == Approx(0.907).margin(0.005));   // 10 τ³ = 10⁻³ at either end
    CHECK(found.trainee.smoothness.dimensionless_jerk == Approx(204.8 * std::pow(work, 3)).epsilon(seconds < 1.0 ? 0.2 : 0.06));
  }
  CHECK(compare(expert, reach(1.0, 0.0)).excess_jerk == Approx(0.0).margin(0.06));
}

// Yardstick: the same movement with all of its ticks.
TEST_CASE("ticks that a run in real time missed change neither jerk nor time", "[training][comparison]") {
  Random random(Seed{11});
  Session const expert = session_on(stroke());
  for (double const share : {0.001, 0.01, 0.1}) {
    Recording recording;
    std::uint32_t missed = 0, all = 0;
    for (Tick tick : expert.recording.ticks()) {
      if (recording.ticks().size() > 1 && missed < 4 && random.uniform() < share) {
        ++missed, ++all;
        continue;
      }
      tick.time = static_cast<double>(recording.ticks().size()) / 1000.0;
      tick.missed = std::exchange(missed, 0u);
      recording.append(tick);
    }
    recording.set_real_time();
    Session const late = make_session(recording, ScriptedDevice<double>(stroke()));
    INFO(all << " missed");
    REQUIRE(all > 0);
    Recording const even = even_recording(late);
    CHECK(even.ticks().size() == late.recording.ticks().size() + all - missed);
    CHECK(even.ticks().back().time == Approx(expert.recording.ticks()[even.ticks().size() - 1].time));
    Comparison const found = compare(expert, late);
    CHECK(found.excess_jerk == Approx(0.0).margin(0.01));
    CHECK(found.excess_time == Approx(0.0).margin(0.002));
    CHECK(found.largest_deviation < 1e-5);
    CHECK(score(found).total > 99.0);
    CHECK(unsaid(message_of([&] { replay<double>(late, {}, {}); }), "real time") == "");
  }
  Session gap = expert;   // a second that is missing in the times themselves
  gap.recording.clear();
  for (Tick tick : expert.recording.ticks()) {
    if (tick.tip == expert.recording.ticks().back().tip) tick.time += 1.0;
    gap.recording.append(tick);
  }
  CHECK(even_recording(gap).ticks().size() == expert.recording.ticks().size() + 1000);
  CHECK(compare(expert, gap).excess_time == Approx(0.0).margin(1e-3));   // at rest
  gap.recording.append({.time = 1e6});
  CHECK(unsaid(message_of([&] { even_recording(gap); }), "leave out the time in which nothing was recorded") == "");
}

TEST_CASE("an offset aside is the deviation; one in depth is a depth error and an overshoot, with its force", "[training][comparison]") {
  Session const expert = session_on(stroke());
  Comparison const aside = compare(expert, session_on(stroke(), [](Tick& tick) { tick.tip.y() += 0.003; }));
  CHECK(aside.mean_deviation == Approx(0.003).epsilon(1e-9));
  CHECK(aside.rms_deviation == Approx(0.003).epsilon(1e-9));
  CHECK(aside.largest_deviation == Approx(0.003).epsilon(1e-9));
  CHECK(aside.missed == Approx(0.003).epsilon(1e-9));
  CHECK(aside.rms_force_difference < 1e-6);
  CHECK(aside.largest_depth_error < 1e-6);
  CHECK(aside.unintended_contacts == 0);   // within the region of 5 mm
  CHECK(score(aside)[ScorePart::path].points == Approx(100.0 * std::exp2(-1.5)).epsilon(1e-6));

  // Along the bottom 2 mm deeper: 0.2 N more. On the ways down and up the path is the same, later.
  Comparison const deep = compare(expert, session_on(stroke(), [](Tick& tick) {
                                    if (tick.tip.z() == -0.008) tick.tip.z() = -0.010;
                                  }));
  CHECK(deep.overshoot == Approx(0.002).epsilon(1e-9));
  CHECK(deep.largest_depth_error == Approx(0.002).epsilon(0.01));
  CHECK(deep.mean_depth_error > 0.0005);
  CHECK(deep.mean_depth_error < 0.002);
  CHECK(deep.largest_deviation > 0.00199);
  CHECK(deep.largest_deviation < 0.0025);   // the jumps at both ends are a little aside in time
  Comparison const shallow = compare(session_on(stroke(), [](Tick& tick) { tick.tip.z() -= 0.001; }), expert);
  CHECK(shallow.overshoot == 0.0);
}

TEST_CASE("a force that differs by a constant vector differs by its length", "[training][comparison]") {
  Session const expert = session_on(stroke());
  Comparison const found = compare(expert, session_on(stroke(), [](Tick& tick) { tick.force = {0.3, 0, -0.4}; }));
  CHECK(found.rms_force_difference == Approx(0.5).epsilon(1e-9));
  CHECK(score(found)[ScorePart::force].points == Approx(100.0 * std::exp2(-2.5)).epsilon(1e-6));
  // A force that trembles by a: a / √2.
  Comparison const trembling =
      compare(expert, session_on(stroke(), [](Tick& tick) { tick.force.y() = 0.2 * std::sin(2 * std::numbers::pi * 10 * tick.time); }));
  CHECK(trembling.rms_force_difference == Approx(0.2 / std::numbers::sqrt2).epsilon(1e-3));
}

// Yardstick: 7 % of the expert's force, tick by tick.
TEST_CASE("a force is noticed as another one from seven hundredths on", "[training][comparison]") {
  Session const expert = session_on(stroke());
  auto const noticed = [&](double share, double until = 1e9) {
    return compare(expert, session_on(stroke(), [&](Tick& tick) {
                     if (tick.time < until && tick.tip.z() < 0) tick.force = {0, share * -100.0 * tick.tip.z(), 0};
                   }))
        .noticed_force_difference;
  };
  CHECK(noticed(0.0) == 0.0);
  CHECK(noticed(0.069) == 0.0);
  CHECK(noticed(0.071) == 1.0);
  int before = 0, all = 0;
  for (Tick const& tick : expert.recording.ticks())
    if (tick.phase != CuttingPhase::no_contact) ++all, before += tick.time < 1.6;
  CHECK(noticed(0.5, 1.6) == Approx(double(before) / all).epsilon(1e-12));
}

TEST_CASE("a tremor aside has its mean square and is not smooth", "[training][comparison]") {
  Session const expert = session_on(stroke());
  double last = 0.0, last_total = 100.0;
  for (double const a : {0.0005, 0.001, 0.002}) {
    Session const trainee = session_on(stroke(), [&](Tick& tick) { tick.tip.y() += a * std::sin(2 * std::numbers::pi * 10 * tick.time); });
    Comparison const found = compare(expert, trainee);
    CHECK(found.rms_deviation == Approx(a / std::numbers::sqrt2).epsilon(0.015));
    CHECK(found.excess_jerk > last);
    CHECK(score(found).total < last_total);
    last = found.excess_jerk;
    last_total = score(found).total;
  }
  CHECK(last > 2.0);
}

TEST_CASE("contacts elsewhere and contacts too many are unintended", "[training][comparison]") {
  Session const expert = session_on(stroke());
  auto const with_taps = [&](int count, double x, double pause = 0.2) {
    Path path = Path::start({0, 0, 0.01});
    path.then(stroke());
    return compare(expert, session_on(taps(path, count, x, pause))).unintended_contacts;
  };
  CHECK(with_taps(0, 0.0) == 0);
  CHECK(with_taps(1, 0.02) == 1);    // where the expert cuts, but once more
  CHECK(with_taps(3, 0.02) == 3);
  CHECK(with_taps(2, 0.08) == 2);    // 4 cm from all of the expert's contacts
  CHECK(with_taps(2, 0.047) == 2);
  Session const elsewhere = session_on(stroke(), [](Tick& tick) { tick.tip.y() += 0.0051; });
  CHECK(compare(expert, elsewhere).unintended_contacts == 1);   // in number like the expert's, but not there
  CHECK(compare(expert, elsewhere, {.region = 0.006}).unintended_contacts == 0);
  // A tool that leaves the surface for less than the gap is still in contact.
  Session const skipping = session_on(stroke(), [](Tick& tick) {
    if (tick.time > 1.5 && tick.time < 1.53) tick.tip.z() = 0.001;
  });
  CHECK(compare(expert, skipping).unintended_contacts == 0);
  CHECK(compare(expert, skipping, {.contact_gap = 0.0}).unintended_contacts == 1);
}

TEST_CASE("no part of a score and not the total grows when an error does", "[training][score]") {
  double Comparison::*const errors[] = {&Comparison::mean_deviation, &Comparison::missed,      &Comparison::rms_force_difference,
                                        &Comparison::excess_jerk,    &Comparison::excess_time, &Comparison::mean_depth_error,
                                        &Comparison::overshoot};
  for (std::size_t k = 0; k < score_parts; ++k) {
    double part = 101.0, total = 101.0;
    for (int step = 0; step < 40; ++step) {
      Comparison comparison;
      comparison.mean_deviation = 0.001;
      if (k < 7)
        comparison.*errors[k] = 1e-4 * std::exp2(0.5 * step);
      else
        comparison.unintended_contacts = step;
      Score const points = score(comparison);
      CHECK(points.lines[k].points <= part);
      CHECK(points.total <= total);
      if (step < 8) CHECK(points.total < total);
      CHECK(points.total >= 0.0);
      CHECK(points.lines[k].part == static_cast<ScorePart>(k));
      CHECK(std::string(to_string(points.lines[k].part)) != "unknown");
      part = points.lines[k].points;
      total = points.total;
    }
  }
}

TEST_CASE("who never touched what the expert touched has no points, and nobody has fewer", "[training][score]") {
  Comparison nothing_done;
  nothing_done.expert.contacts = 1;
  Comparison all_wrong = nothing_done;
  all_wrong.trainee.contacts = 1000000;
  all_wrong.mean_deviation = all_wrong.missed = all_wrong.rms_force_difference = all_wrong.excess_jerk = all_wrong.excess_time = all_wrong.mean_depth_error =
      all_wrong.overshoot = 1e9;
  all_wrong.unintended_contacts = 1000000;
  for (double const weight : {2.0, 1.0, 3.0, 0.1, 7.0, 1e-3}) {
    CHECK(score(nothing_done, {.path = {.weight = weight}}).total == 0.0);
    CHECK(score(all_wrong, {.path = {.weight = weight}}).total >= 0.0);
    CHECK(score(all_wrong, {.path = {.weight = weight}}).total < 1e-12);
  }
}

TEST_CASE("who touches something else alone has no points either, who comes to the place from elsewhere has some", "[training][score]") {
  Session const expert = session_on(stroke());
  auto const aside = [&](double begin, double end) {   // in y, from one to the other
    return compare(expert, session_on(stroke(), [=](Tick& tick) { tick.tip.y() += begin + (end - begin) * tick.time / 3.0; }));
  };
  Comparison const elsewhere = aside(0.1, 0.1);
  CHECK(elsewhere.trainee.contacts == 1);
  CHECK(elsewhere.did_nothing);
  CHECK(score(elsewhere).total == 0.0);
  Comparison const slides_in = aside(0.02, 0.0);
  CHECK(slides_in.unintended_contacts == 1);
  CHECK_FALSE(slides_in.did_nothing);
  CHECK(score(slides_in).total > 0.0);
  CHECK_FALSE(aside(0.004, 0.004).did_nothing);
  CHECK_FALSE(compare(expert, expert).did_nothing);
  Session const hovering = session_on(stroke(), [](Tick& tick) { tick.tip.z() += 0.02; });
  CHECK(compare(expert, hovering).did_nothing);
  CHECK_FALSE(compare(hovering, expert).did_nothing);   // the expert touched nothing
}

TEST_CASE("weights and halves do what they say", "[training][score]") {
  Comparison comparison;
  comparison.mean_deviation = 0.004;       // two halves: 25 points
  comparison.unintended_contacts = 1;      // one: 50
  ScoreOptions options;
  CHECK(score(comparison, options).total == Approx((2 * 25 + 6 * 100 + 50) / 9.0));
  options.contacts.weight = 0.0;
  options.path = {.weight = 3.0, .half = 0.004};
  CHECK(score(comparison, options).total == Approx((3 * 50 + 6 * 100) / 9.0));
  CHECK(unsaid(message_of([&] { score(comparison, {.force = {.weight = -1.0}}); }), "the weight of force is -1") == "");
  CHECK(unsaid(message_of([&] { score(comparison, {.depth = {.half = 0.0}}); }), ".half of depth is 0") == "");
  ScoreScale const none{.weight = 0.0};
  CHECK(unsaid(message_of([&] { score(comparison, {none, none, none, none, none, none, none, none}); }), "all weights are 0") == "");
}

TEST_CASE("sessions that can not be compared are refused", "[training][comparison]") {
  Session const expert = session_on(stroke());
  Session other = expert;
  other.device.rate = 500.0;
  CHECK(unsaid(message_of([&] { compare(expert, other); }), "the expert's rate is 1000 Hz, the trainee's 500 Hz") == "");
  CHECK(unsaid(message_of([&] { compare(expert, Session{}); }), "align: a path has 0 points") == "");
  other = expert;
  other.recording.append({.time = 9.0, .force = {std::numeric_limits<double>::quiet_NaN(), 0, 0}});
  CHECK(unsaid(message_of([&] { compare(expert, other); }), "depth or force at 9 s is not finite") == "");
  CHECK(unsaid(message_of([&] { compare(expert, expert, {.region = -1.0}); }), "compare: .region is -1") == "");
  for (double const window : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
    CHECK(unsaid(message_of([&] { compare(expert, expert, {.smoothness = {.window = window}}); }), "compare: .smoothness.window is") == "");
  Smoothness const whole = compare(expert, expert, {.smoothness = {.window = 1000.0}}).expert.smoothness;   // longer than the path: the path
  CHECK(whole.jerk_integral > 0.0);
  CHECK(compare(expert, expert, {.smoothness = {.window = 1e17}}).expert.smoothness.jerk_integral == whole.jerk_integral);
  Session still = expert;
  still.recording.clear();
  for (int i = 0; i < 20; ++i) still.recording.append({.time = i / 1000.0});
  CHECK(score(compare(still, still)).total == 100.0);   // nothing moved, nothing divides by zero
}
