// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "allocation_trap.hpp"
#include "exchanges.hpp"

#include <palpate/core/event_ring.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <deque>
#include <random>
#include <thread>
#include <utility>

using namespace palpate;
using palpate_test::exchanges;   // of the tests with threads, PALPATE_EXCHANGES
using palpate_test::pause_of;

static_assert(noexcept(std::declval<EventRing<int, 8>&>().push(1)));
static_assert(noexcept(std::declval<EventRing<int, 8>&>().pop()));

TEST_CASE("events come out in order; a full ring drops the newest and counts it", "[event_ring]") {
  EventRing<int, 4> ring;
  CHECK(ring.capacity() == 4);
  CHECK_FALSE(ring.pop().has_value());
  for (int i = 1; i <= 6; ++i) CHECK(ring.push(i) == (i <= 4));
  CHECK(ring.size() == 4);
  CHECK(ring.dropped() == 2);
  for (int i = 1; i <= 4; ++i) CHECK(ring.pop() == i);
  CHECK_FALSE(ring.pop().has_value());
  CHECK(ring.push(7));
  CHECK(ring.pop() == 7);
  CHECK(ring.dropped() == 2);
}

TEST_CASE("a ring behaves like a bounded queue", "[event_ring]") {
  // Yardstick: std::deque, over a seeded random sequence of pushes and pops.
  EventRing<int, 8> ring;
  std::deque<int> queue;
  std::mt19937 generator(17);
  std::uint64_t dropped = 0;
  for (int i = 0; i < 100000; ++i) {
    if (generator() % 2 == 0) {
      bool const room = queue.size() < 8;
      if (room) queue.push_back(i);
      else ++dropped;
      REQUIRE(ring.push(i) == room);
    } else {
      auto const event = ring.pop();
      REQUIRE(event.has_value() == !queue.empty());
      if (!queue.empty()) {
        REQUIRE(*event == queue.front());
        queue.pop_front();
      }
    }
    REQUIRE(ring.size() == queue.size());
  }
  CHECK(ring.dropped() == dropped);
  CHECK(dropped > 0);
}

TEST_CASE("pushing and popping do not allocate", "[event_ring][realtime]") {
  REQUIRE(palpate_test::trap_works());
  EventRing<std::pair<double, int>, 16> ring;
  double sum = 0.0;
  palpate_test::AllocationCount const allocations;
  for (int i = 0; i < 1000; ++i) {
    ring.push({0.5, i});
    if (auto const event = ring.pop()) sum += event->first;
  }
  long const count = allocations.count();
  CHECK(count == 0);
  CHECK(sum == 500.0);
}

TEST_CASE("between two threads every event arrives once, in order, or is counted as dropped", "[event_ring][threads][exchanges]") {
  struct Event {
    std::uint64_t number = 0;
    std::uint64_t check = 0;
  };
  std::uint64_t const last = exchanges(200000), pause = pause_of(last);
  EventRing<Event, 64> ring;
  std::uint64_t retries = 0;   // the writer's until it is joined
  std::thread writer([&] {
    for (std::uint64_t number = 1; number < last; ++number) {
      ring.push({number, ~number * 3});
      if (number % pause == 0) std::this_thread::yield();
    }
    while (!ring.push({last, ~last * 3})) {   // the last one has to arrive, so that the test ends
      ++retries;
      std::this_thread::yield();
    }
  });
  std::uint64_t received = 0, previous = 0, wrong = 0;
  while (previous < last) {
    auto const event = ring.pop();
    if (!event) {
      std::this_thread::yield();
      continue;
    }
    ++received;
    if (event->check != ~event->number * 3 || event->number <= previous) ++wrong;
    previous = event->number;
  }
  writer.join();
  CHECK(wrong == 0);
  CHECK(received + ring.dropped() - retries == last);
  CHECK_FALSE(ring.pop().has_value());
}

TEST_CASE("a writer that waits for room loses nothing", "[event_ring][threads][exchanges]") {
  // Yardstick: each event against its place in the sequence, all of its words.
  std::uint64_t const last = exchanges(100000);
  auto const payload = [](std::uint64_t number) { return std::array<std::uint64_t, 4>{number, ~number, number * number, number ^ (number << 21)}; };
  EventRing<std::array<std::uint64_t, 4>, 64> ring;
  std::uint64_t retries = 0;   // the writer's until it is joined
  std::thread writer([&] {
    for (std::uint64_t number = 1; number <= last; ++number)
      for (; !ring.push(payload(number)); ++retries) std::this_thread::yield();
  });
  std::uint64_t expected = 1, wrong = 0, max_waiting = 0;
  while (expected <= last) {
    auto const event = ring.pop();
    if (!event) {
      std::this_thread::yield();
      continue;
    }
    if (*event != payload(expected)) ++wrong;
    ++expected;
    max_waiting = std::max<std::uint64_t>(max_waiting, ring.size());
  }
  writer.join();
  CHECK(wrong == 0);
  CHECK(max_waiting <= ring.capacity());
  CHECK(ring.dropped() == retries);   // each push that found no room
  CHECK(ring.size() == 0);
}
