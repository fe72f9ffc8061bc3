// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "allocation_trap.hpp"

#include <palpate/simulator/tick_statistics.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

using namespace palpate;
using namespace std::chrono_literals;
using std::chrono::nanoseconds;

static_assert(noexcept(std::declval<DurationHistogram&>().add(std::declval<nanoseconds const&>())));
static_assert(noexcept(std::declval<TickStatistics&>().add(std::declval<nanoseconds const&>())));
static_assert(noexcept(std::declval<TickStatistics&>().add(std::declval<TickTiming const&>())));
static_assert(noexcept(std::declval<TickStatistics&>().merge(std::declval<TickStatistics const&>())));

namespace {

/// Entry ⌈q n⌉ of the sorted values.
std::int64_t quantile_of(std::vector<std::int64_t> const& sorted, double q) {
  auto const n = static_cast<double>(sorted.size());
  auto const rank = static_cast<std::size_t>(std::max(1.0, std::ceil(q * n)));
  return sorted[std::min(rank, sorted.size()) - 1];
}

void check_against_sorted(std::vector<std::int64_t> values) {
  DurationHistogram histogram;
  for (std::int64_t const value : values) histogram.add(nanoseconds(value));
  std::sort(values.begin(), values.end());
  CHECK(histogram.count() == values.size());
  CHECK(histogram.min().count() == values.front());
  CHECK(histogram.max().count() == values.back());
  std::int64_t const sum = std::accumulate(values.begin(), values.end(), std::int64_t{0});
  CHECK(histogram.total().count() == sum);
  CHECK(histogram.mean().count() == sum / static_cast<std::int64_t>(values.size()));
  for (double const q : {0.0, 0.001, 0.01, 0.1, 0.25, 0.5, 0.75, 0.9, 0.99, 0.999, 0.9999, 1.0}) {
    double const exact = static_cast<double>(quantile_of(values, q));
    double const found = static_cast<double>(histogram.quantile(q).count());
    INFO("q " << q << " exact " << exact << " found " << found);
    CHECK(std::abs(found - exact) <= exact / 32.0);
  }
}

TickTiming tick_at(nanoseconds due, nanoseconds started, nanoseconds finished) {
  TickTiming::TimePoint const zero{};
  return {.due = zero + due, .started = zero + started, .finished = zero + finished};
}

}  // namespace

TEST_CASE("quantiles agree with those of a sorted array within 1/32", "[tick_statistics]") {
  // Yardstick: the values themselves, sorted. Shapes: a servo's latencies (log-normal), uniform, small, constant, huge.
  std::mt19937_64 generator(23);
  std::vector<std::int64_t> values(20000);
  SECTION("log-normal around 40 µs with a long tail") {
    std::lognormal_distribution<double> distribution(std::log(40e3), 1.5);
    for (auto& value : values) value = static_cast<std::int64_t>(distribution(generator));
    check_against_sorted(values);
  }
  SECTION("uniform up to 2 ms") {
    for (auto& value : values) value = static_cast<std::int64_t>(generator() % 2'000'000);
    check_against_sorted(values);
  }
  SECTION("a few nanoseconds: exact") {
    for (auto& value : values) value = static_cast<std::int64_t>(generator() % 32);
    check_against_sorted(values);
  }
  SECTION("all equal: exact, because quantiles stay between the smallest and the largest") {
    std::fill(values.begin(), values.end(), 999'999);
    DurationHistogram histogram;
    for (auto const value : values) histogram.add(nanoseconds(value));
    CHECK(histogram.p50().count() == 999'999);
    CHECK(histogram.p99().count() == 999'999);
  }
  SECTION("every power of two and its neighbours") {
    values.clear();
    for (int bit = 0; bit <= 40; ++bit)
      for (std::int64_t offset = -1; offset <= 1; ++offset) values.push_back((std::int64_t{1} << bit) + offset);
    check_against_sorted(values);
  }
  SECTION("one value") { check_against_sorted({123'456}); }
}

TEST_CASE("an empty histogram is zero; odd values do no harm", "[tick_statistics]") {
  DurationHistogram histogram;
  CHECK(histogram.p50() == 0ns);
  CHECK(histogram.min() == 0ns);
  CHECK(histogram.max() == 0ns);
  CHECK(histogram.mean() == 0ns);
  histogram.add(-5ns);   // a clock that went back counts as nothing passed
  CHECK(histogram.max() == 0ns);
  histogram.add(nanoseconds::max());
  CHECK(histogram.max() == nanoseconds::max());
  CHECK(histogram.quantile(std::nan("")) == 0ns);
  CHECK(histogram.quantile(2.0) == nanoseconds::max());
  CHECK(histogram.count() == 2);
}

TEST_CASE("merging two histograms is the same as counting everything in one", "[tick_statistics]") {
  std::mt19937_64 generator(29);
  DurationHistogram all, first, second, empty;
  for (int i = 0; i < 10000; ++i) {
    nanoseconds const value(static_cast<std::int64_t>(generator() % 3'000'000));
    all.add(value);
    (i % 3 == 0 ? first : second).add(value);
  }
  first.merge(second);
  first.merge(empty);
  CHECK(first.count() == all.count());
  CHECK(first.min() == all.min());
  CHECK(first.max() == all.max());
  CHECK(first.mean() == all.mean());
  for (double const q : {0.01, 0.5, 0.99, 0.999}) CHECK(first.quantile(q) == all.quantile(q));
}

TEST_CASE("period, latency, computing time and overruns of a servo loop", "[tick_statistics]") {
  // Yardstick: three ticks of a 1 ms loop by hand; the second ends after the third was due, so one tick is skipped.
  TickStatistics statistics(1ms);
  statistics.add(tick_at(1000us, 1010us, 1110us));
  statistics.add(tick_at(2000us, 2030us, 3230us));
  statistics.add_skipped(1);
  statistics.add(tick_at(4000us, 4020us, 4420us));
  CHECK(statistics.ticks() == 3);
  CHECK(statistics.overruns() == 1);
  CHECK(statistics.skipped() == 1);
  CHECK(statistics.target() == 1ms);
  CHECK(statistics.period().count() == 2);
  CHECK(statistics.period().min() == 1020us);
  CHECK(statistics.period().max() == 1990us);
  CHECK(statistics.latency().max() == 30us);
  CHECK(statistics.compute().min() == 100us);
  CHECK(statistics.compute().max() == 1200us);
  CHECK(std::abs(statistics.rate() - 2.0 / 3.01e-3) <= 1e-9);

  statistics.pause();   // the loop stops for a second: no period, no gap
  statistics.add(tick_at(1s, 1s, 1s + 1us));
  CHECK(statistics.period().max() == 1990us);
  CHECK(statistics.ticks() == 4);
}

TEST_CASE("a lock-step loop has computing times only", "[tick_statistics]") {
  TickStatistics statistics(1ms);
  statistics.add(400us);
  statistics.add(1600us);
  CHECK(statistics.ticks() == 2);
  CHECK(statistics.overruns() == 1);
  CHECK(statistics.period().count() == 0);
  CHECK(statistics.rate() == 0.0);

  TickStatistics without_target;
  without_target.add(1h);
  CHECK(without_target.overruns() == 0);
  without_target.merge(statistics);
  CHECK(without_target.ticks() == 3);
  CHECK(without_target.overruns() == 1);
}

TEST_CASE("counting does not allocate", "[tick_statistics][realtime]") {
  REQUIRE(palpate_test::trap_works());
  TickStatistics statistics(1ms), total(1ms);
  palpate_test::AllocationCount const allocations;
  for (int i = 0; i < 1000; ++i) statistics.add(tick_at(i * 1ms, i * 1ms + 20us, i * 1ms + 70us));
  total.merge(statistics);
  nanoseconds const median = total.compute().p50();
  long const count = allocations.count();
  CHECK(count == 0);
  CHECK(std::abs((median - 50us).count()) <= 50'000 / 32);
}
