// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "allocation_trap.hpp"
#include "device/message.hpp"

#include <palpate/simulator/pacer.hpp>

#include <chrono>
#include <cstdint>
#include <limits>
#include <random>
#include <utility>

using namespace palpate;
using namespace std::chrono_literals;
using std::chrono::nanoseconds;

static_assert(noexcept(std::declval<Schedule&>().next(std::declval<Schedule::TimePoint const&>())));
static_assert(noexcept(std::declval<Pacer&>().wait()));

namespace {

constexpr Schedule::TimePoint at(nanoseconds time) { return Schedule::TimePoint{} + time; }

}  // namespace

TEST_CASE("a loop that keeps up gets every tick", "[pacer]") {
  Schedule schedule(at(0ns), 1ms);
  for (int i = 1; i <= 1000; ++i) {
    auto const slot = schedule.next(at(i * 1ms - 300us));
    REQUIRE(slot.due == at(i * 1ms));
    REQUIRE(slot.skipped == 0);
  }
}

TEST_CASE("a late loop skips what it missed and keeps to the grid", "[pacer]") {
  Schedule schedule(at(0ns), 1ms);
  CHECK(schedule.next(at(200us)).due == at(1ms));
  CHECK(schedule.next(at(2ms)).due == at(2ms));   // exactly in time: it runs at once
  auto slot = schedule.next(at(3ms + 1ns));       // a nanosecond late: that tick is given up
  CHECK(slot.due == at(4ms));
  CHECK(slot.skipped == 1);
  slot = schedule.next(at(9ms + 500us));
  CHECK(slot.due == at(10ms));
  CHECK(slot.skipped == 5);   // 5, 6, 7, 8, 9
  CHECK(schedule.next(at(10ms + 100us)).due == at(11ms));
}

TEST_CASE("ticks never burst, whatever the load", "[pacer]") {
  // Yardstick: on a virtual clock with seeded random work, ticks are on the grid, never before now, never two in one period,
  // and run + skipped = all of them.
  std::mt19937 generator(31);
  nanoseconds const period = 1ms;
  nanoseconds now = 0ns, previous = 0ns;
  Schedule schedule(at(now), period);
  std::uint64_t ran = 0, skipped = 0;
  for (int i = 0; i < 100000; ++i) {
    now += nanoseconds(generator() % (generator() % 8 == 0 ? 5'000'000 : 900'000));   // the work
    auto const slot = schedule.next(at(now));
    nanoseconds const due = slot.due.time_since_epoch();
    REQUIRE(due >= now);
    REQUIRE(due - now <= period);
    REQUIRE(due % period == 0ns);
    REQUIRE(due - previous >= period);
    now = previous = due;
    ++ran;
    skipped += slot.skipped;
  }
  CHECK(skipped > 0);
  CHECK(nanoseconds(static_cast<std::int64_t>(ran + skipped) * period.count()) == now);
}

TEST_CASE("a pacer never wakes before its time, and does not allocate", "[pacer][realtime]") {
  // Only what holds on every machine: how late it wakes is not checked.
  REQUIRE(palpate_test::trap_works());
  Pacer pacer(2000.0);
  CHECK(pacer.period() == 500us);
  int early = 0, off_grid = 0;
  auto first = pacer.wait().due;
  palpate_test::AllocationCount const allocations;
  for (int i = 0; i < 20; ++i) {
    auto const slot = pacer.wait();
    if (Pacer::Clock::now() < slot.due) ++early;
    if ((slot.due - first) % pacer.period() != 0ns) ++off_grid;
  }
  long const count = allocations.count();
  CHECK(early == 0);
  CHECK(off_grid == 0);
  CHECK(count == 0);
  auto const before = Pacer::Clock::now();
  pacer.restart();
  CHECK(pacer.wait().due >= before + pacer.period());
}

TEST_CASE("a pacer that spins at the end does not wake before its time either", "[pacer][realtime]") {
  Pacer pacer(2000.0, 50us);
  int early = 0;
  for (int i = 0; i < 40; ++i) {
    auto const slot = pacer.wait();
    if (Pacer::Clock::now() < slot.due) ++early;
  }
  CHECK(early == 0);
  CHECK_THROWS_AS(Pacer(1000.0, 51us), InvalidArgument);
  CHECK_THROWS_AS(Pacer(1000.0, -1ns), InvalidArgument);
  CHECK_THROWS_AS(Pacer(20000.0, 26us), InvalidArgument);   // more than half of the period: it would hardly ever sleep
  CHECK(Pacer(20000.0, 25us).period() == 50us);
  CHECK(palpate_test::unsaid(palpate_test::message_of([] { Pacer(1000.0, 1ms); }), "1000000 ns", "50000 ns") == "");
}

TEST_CASE("a pace that no clock can keep is refused", "[pacer]") {
  for (double const rate : {0.0, -1.0, 1e9, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    CHECK_THROWS_AS(Pacer(rate), InvalidArgument);
  CHECK(palpate_test::unsaid(palpate_test::message_of([] { Pacer(0.0); }), "a pace of 0 Hz can not be kept") == "");
  CHECK(Pacer(1000.0).period() == 1ms);
  CHECK(Pacer(30.0).period() == 33'333'333ns);
}
