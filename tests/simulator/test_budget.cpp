// SPDX-License-Identifier: MIT
// Yardstick: statistics made by hand, whose medians, p99 and shares are known.
#include "catch.hpp"

#include <palpate/simulator/budget.hpp>

#include <array>
#include <chrono>
#include <limits>
#include <span>
#include <string>

using namespace palpate;
using namespace std::chrono_literals;
using std::chrono::nanoseconds;

namespace {

/// 98 ticks of one kind and two of another, on the grid of `period`; times that are exact in a histogram.
struct Kind {
  nanoseconds late, compute;
};

TickStatistics ticked(nanoseconds period, Kind often, Kind rare) {
  TickStatistics statistics(period);
  TickTiming::TimePoint due{};
  for (int i = 0; i < 100; ++i) {
    Kind const& kind = i % 50 == 49 ? rare : often;
    due += period;
    statistics.add({due, due + kind.late, due + kind.late + kind.compute});
  }
  return statistics;
}

}  // namespace

TEST_CASE("a budget says how much of each period is used and what comes to its limit first", "[simulator][budget]") {
  SimulatorStatistics statistics;
  statistics.servo = ticked(1ms, {37500ns, 3us}, {37500ns, 5150ns});
  statistics.body = ticked(2ms, {60us, 180us}, {60us, 264us});
  statistics.body_counts.ticks = 100;
  statistics.body_counts.steps = 180;
  Bottleneck const first = bottleneck(statistics);
  CHECK(first.what == "the body's computing");
  CHECK(first.share == Approx(264.0 / 2000.0).epsilon(1e-12));
  CHECK(budget_text(statistics) ==
        "servo: tick 3 µs (p99 5.15 µs) of 1000 µs at 1000 Hz: 0.3 % (p99 0.515 %); 0 overruns, 0 skipped in 100 ticks\n"
        "  period 1000 µs (p99 1000 µs, longest 1000 µs), woken 37.5 µs late (p99 37.5 µs)\n"
        "body: tick 180 µs (p99 264 µs) of 2000 µs at 500 Hz: 9 % (p99 13.2 %), 1.8 steps a tick; 0 overruns, 0 skipped in 100 ticks\n"
        "  period 2000 µs (p99 2000 µs, longest 2000 µs), woken 60 µs late (p99 60 µs)\n"
        "next bottleneck: the body's computing, 13.2 % of its period at p99; it may take 7.58 times as long\n");
}

TEST_CASE("the budget of several tools has a row for each servo, the body once, and names the one that comes to its limit first", "[simulator][budget]") {
  SimulatorStatistics first;
  first.servo = ticked(1ms, {37500ns, 3us}, {37500ns, 5150ns});
  first.body = ticked(2ms, {60us, 180us}, {60us, 264us});
  first.body_counts.ticks = 100, first.body_counts.steps = 180;
  SimulatorStatistics second = first;
  second.servo = ticked(500us, {37500ns, 3us}, {37500ns, 264us});
  second.servo_counts.saturation = {.max_force = 2.0, .device_max_force = 3.0, .ticks = 7, .max_wanted = 4.0};
  std::string const body =
      "body: tick 180 µs (p99 264 µs) of 2000 µs at 500 Hz: 9 % (p99 13.2 %), 1.8 steps a tick; 0 overruns, 0 skipped in 100 ticks\n"
      "  period 2000 µs (p99 2000 µs, longest 2000 µs), woken 60 µs late (p99 60 µs)\n";
  std::string const text = budget_text(std::array{first, second});
  CHECK(text.find("servo of tool 0: tick 3 µs (p99 5.15 µs) of 1000 µs at 1000 Hz: 0.3 % ") == 0);
  CHECK(text.find("\nservo of tool 1: tick 3 µs (p99 264 µs) of 500 µs at 2000 Hz: 0.6 % (p99 52.8 %)") != std::string::npos);
  CHECK(text.find(body) != std::string::npos);
  CHECK(text.find(body) == text.rfind(body));
  CHECK(text.find("next bottleneck: the servo's computing of tool 1, 52.8 % of its period at p99; it may take 1.89 times as long\n") != std::string::npos);
  CHECK(text.find("tool 1, force: at most 2 N is written of the 3 N that the device can; 7 ticks wanted more, up to 4 N") != std::string::npos);
  CHECK(text.find("tool 0, force") == std::string::npos);
  second.servo = first.servo;
  CHECK(budget_text(std::array{first, second}).find("next bottleneck: the body's computing, 13.2 %") != std::string::npos);
  CHECK(budget_text(std::span<SimulatorStatistics const>()).empty());
}

TEST_CASE("a wake-up or the servo itself can be the bottleneck, and more than a period does not fit", "[simulator][budget]") {
  SimulatorStatistics statistics;
  statistics.servo = ticked(1ms, {37us, 3us}, {400us, 3us});
  statistics.body = ticked(2ms, {60us, 180us}, {60us, 264us});
  CHECK(bottleneck(statistics).what == "the servo's wake-up");
  CHECK(bottleneck(statistics).share == Approx(0.4).epsilon(1.0 / 32));
  statistics.servo = ticked(1ms, {37us, 900us}, {37us, 2ms});
  CHECK(bottleneck(statistics).what == "the servo's computing");
  CHECK(bottleneck(statistics).share == Approx(2.0).epsilon(1.0 / 32));
  CHECK(statistics.servo.overruns() == 2);
  CHECK(budget_text(statistics).find(" times what there is\n") != std::string::npos);
  CHECK(budget_text(statistics).find("; 2 overruns, ") != std::string::npos);
}

TEST_CASE("in lock-step there are no periods and no wake-ups, before the first tick there is nothing", "[simulator][budget]") {
  SimulatorStatistics statistics;
  CHECK(bottleneck(statistics).what.empty());
  CHECK(budget_text(statistics) == "servo: no tick yet\nbody: no tick yet\n");
  statistics.servo = TickStatistics(1ms);
  statistics.body = TickStatistics(1ms);
  for (int i = 0; i < 10; ++i) {
    statistics.servo.add(2us);
    statistics.body.add(40us);
  }
  CHECK(budget_text(statistics) ==
        "servo: tick 2 µs (p99 2 µs) of 1000 µs at 1000 Hz: 0.2 % (p99 0.2 %); 0 overruns, 0 skipped in 10 ticks\n"
        "body: tick 40 µs (p99 40 µs) of 1000 µs at 1000 Hz: 4 % (p99 4 %); 0 overruns, 0 skipped in 10 ticks\n"
        "next bottleneck: the body's computing, 4 % of its period at p99; it may take 25 times as long\n");
  TickStatistics untimed;   // a loop without a period aimed at
  untimed.add(40us);
  statistics.servo = statistics.body = untimed;
  CHECK(bottleneck(statistics).what.empty());
  CHECK(budget_text(statistics).find("of 0") == std::string::npos);
}

TEST_CASE("a forecast compares the stable step times its cost with the tick", "[simulator][budget]") {
  SimulatorStatistics statistics;
  CHECK(to_text(step_forecast(statistics)).empty());
  statistics.body = ticked(2ms, {60us, 180us}, {60us, 264us});
  BodyCounts& body = statistics.body_counts;
  body.ticks = 100, body.steps = 200, body.steps_allowed = 100, body.stable_step = 1.14e-3;
  StepForecast const two = step_forecast(statistics);
  CHECK(two.steps == 2);
  CHECK(two.step_cost == Approx(90e-6).epsilon(1.0 / 32));
  CHECK(two.share() == Approx(0.09).epsilon(1.0 / 32));
  CHECK(!two.falls_behind());
  CHECK(to_text(two) == "forecast: steps up to 1140 µs are stable, 2 steps a tick of 2000 µs, 90 µs each: 9 % of it\n");
  body.stable_step = 1.05e-4;   // after an edit: 20 steps of 90 µs
  CHECK(step_forecast(statistics).steps == 20);
  CHECK(step_forecast(statistics).share() == Approx(0.9).epsilon(1.0 / 32));
  CHECK(step_forecast(statistics).falls_behind());
  CHECK(budget_text(statistics).find("20 steps a tick of 2000 µs, 90 µs each: 90 % of it; the body will fall behind: a coarser mesh, ") != std::string::npos);
  body.stable_step = 1e-5;
  CHECK(step_forecast(statistics).falls_behind());
  CHECK(to_text(step_forecast(statistics)).find("200 steps a tick of 2000 µs where 100 are allowed, ") != std::string::npos);
  body.stable_step = std::numeric_limits<double>::infinity(), body.steps = 100;
  CHECK(to_text(step_forecast(statistics)) == "forecast: any step is stable, 1 step a tick of 2000 µs, 180 µs each: 9 % of it\n");
  statistics.body = ticked(2ms, {60us, 1900us}, {60us, 1900us});
  CHECK(to_text(step_forecast(statistics)).find("the body will fall behind: compute fewer particles") != std::string::npos);
  body.stable_step = 0.0;
  CHECK(to_text(step_forecast(statistics)) == "forecast: no step of the body is stable: give it damping, or another integrator\n");
}

TEST_CASE("a body that lags is told, with how far, why, and what to do", "[simulator][budget]") {
  SimulatorStatistics statistics;
  BodyCounts& body = statistics.body_counts;
  body.ticks = 400, body.steps = 30000, body.seconds = 0.4;
  CHECK(lag_text(body).empty());
  body.capped = 250, body.max_steps_a_tick = 100, body.max_steps_wanted = 431, body.lag = 0.123;
  CHECK(lag_text(body) ==
        "the body lags 0.123 s behind the hand, 30.8 % of 0.4 s; 250 of 400 ticks wanted up to 431 steps where 100 are allowed: raise "
        "SimulatorOptions::max_body_steps, or make the stable step longer with softer links, less damping, more mass or a coarser mesh\n");
  CHECK(budget_text(statistics) == "servo: no tick yet\nbody: no tick yet\n" + lag_text(body));
  body.capped = 0;
  CHECK(lag_text(body).find("; its ticks came too late: compute fewer particles, lower SimulatorOptions::body_rate, or leave its thread a core\n") != std::string::npos);
  body.diverged = 3;
  CHECK(lag_text(body).find("; 3 steps diverged: ") != std::string::npos);
  body = {.ticks = 400, .capped = 250, .seconds = 0.4};
  CHECK(lag_text(body) == "no step of the body is stable in 250 of 400 ticks: give it damping, or another integrator\n");
}

TEST_CASE("tetrahedra that were turned over are told, with the one that was most", "[simulator][budget]") {
  SimulatorStatistics statistics;
  CHECK(inverted_text(statistics.body_counts).empty());
  statistics.body_counts = {.steps = 800, .inverted = 12, .inverted_element = 41, .lowest_determinant = -0.312};
  CHECK(inverted_text(statistics.body_counts) ==
        "a tetrahedron was found flat or turned over after 12 of 800 steps, most of all number 41, to det F = -0.312: there the force is not a tissue's; press less, or with a "
        "larger tip, or make the mesh finer\n");
  CHECK(budget_text(statistics) == "servo: no tick yet\nbody: no tick yet\n" + inverted_text(statistics.body_counts));
}
