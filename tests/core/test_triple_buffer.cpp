// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "allocation_trap.hpp"
#include "exchanges.hpp"

#include <palpate/core/matrix.hpp>
#include <palpate/core/triple_buffer.hpp>

#include <array>
#include <atomic>
#include <cstdint>
#include <thread>
#include <utility>

using namespace palpate;
using palpate_test::exchanges;   // of the tests with threads, PALPATE_EXCHANGES
using palpate_test::pause_of;

namespace {

/// A payload that shows when it was torn: every word follows from the number.
struct Message {
  std::uint64_t number = 0;
  std::array<std::uint64_t, 24> words = words_of(0);

  static std::array<std::uint64_t, 24> words_of(std::uint64_t number) {
    std::array<std::uint64_t, 24> words{};
    std::uint64_t value = number;
    for (auto& word : words) word = value = value * 6364136223846793005u + 1442695040888963407u;
    return words;
  }
  static Message of(std::uint64_t number) { return {number, words_of(number)}; }
  bool whole() const { return words == words_of(number); }
};

static_assert(noexcept(std::declval<TripleBuffer<Message>&>().write(std::declval<Message const&>())));
static_assert(noexcept(std::declval<TripleBuffer<Message>&>().publish()));
static_assert(noexcept(std::declval<TripleBuffer<Message>&>().fetch()));
static_assert(noexcept(std::declval<TripleBuffer<Message>&>().read()));

}  // namespace

TEST_CASE("the reader sees the newest value, once as new", "[triple_buffer]") {
  TripleBuffer<int> buffer(-1);
  CHECK_FALSE(buffer.fetch());
  CHECK(buffer.front() == -1);
  buffer.write(1);
  CHECK(buffer.front() == -1);   // nothing moves under the reader
  CHECK(buffer.fetch());
  CHECK(buffer.front() == 1);
  CHECK_FALSE(buffer.fetch());
  CHECK(buffer.front() == 1);
  for (int i = 2; i <= 7; ++i) buffer.write(i);   // five of them are never seen
  CHECK(buffer.read() == 7);
  CHECK_FALSE(buffer.fetch());
}

TEST_CASE("any order of writing and reading gives the newest value", "[triple_buffer]") {
  // Yardstick: a plain variable. All orders of 14 steps.
  for (unsigned order = 0; order < (1u << 14); ++order) {
    TripleBuffer<int> buffer(0);
    int newest = 0, seen = 0;
    for (int step = 0; step < 14; ++step)
      if ((order >> step) & 1u) {
        buffer.write(++newest);
      } else {
        bool const fresh = buffer.fetch();
        if (fresh != (newest != seen) || buffer.front() != newest) FAIL("order " << order << " step " << step);
        seen = newest;
      }
  }
  SUCCEED();
}

TEST_CASE("values with storage of their own are filled in place, without allocating", "[triple_buffer][realtime]") {
  REQUIRE(palpate_test::trap_works());
  TripleBuffer<Matrix3X<double>> buffer(Matrix3X<double>::Zero(3, 500));
  Matrix3X<double> const source = Matrix3X<double>::Constant(3, 500, 2.5);
  bool right = true;
  palpate_test::AllocationCount const allocations;
  for (int i = 0; i < 100; ++i) {
    buffer.back() = source * i;
    buffer.publish();
    right = right && buffer.read()(2, 499) == 2.5 * i;
  }
  long const count = allocations.count();
  CHECK(count == 0);
  CHECK(right);
}

TEST_CASE("between two threads no value is torn, old, or lost at the end", "[triple_buffer][threads][exchanges]") {
  // Yardstick: numbers only grow, every payload matches its number, and the last one arrives.
  std::uint64_t const last = exchanges(60000), pause = pause_of(last);
  TripleBuffer<Message> buffer(Message::of(0));
  std::thread writer([&] {
    for (std::uint64_t number = 1; number <= last; ++number) {
      Message& back = buffer.back();   // in place
      back.number = number;
      back.words = Message::words_of(number);
      buffer.publish();
      if (number % pause == 0) std::this_thread::yield();
    }
  });
  std::uint64_t previous = 0, torn = 0, backwards = 0, not_new = 0, fetched = 0;
  while (previous < last) {
    bool const fresh = buffer.fetch();
    Message const& message = buffer.front();
    if (!message.whole()) ++torn;
    if (message.number < previous) ++backwards;
    if (fresh != (message.number > previous)) ++not_new;
    previous = message.number;
    if (fresh) ++fetched;
    else std::this_thread::yield();
  }
  writer.join();
  CHECK(torn == 0);
  CHECK(backwards == 0);
  CHECK(not_new == 0);
  CHECK(fetched > 0);
  CHECK_FALSE(buffer.fetch());
}

TEST_CASE("what is fetched is at least as new as what was published before", "[triple_buffer][threads][exchanges]") {
  // Freshness: the writer announces a number after publishing it; a fetch after seeing the announcement must not be older, nor more than
  // one ahead of what is announced after it: the generation that is published and not yet announced.
  std::uint64_t const last = exchanges(60000), pause = pause_of(last);
  TripleBuffer<Message> buffer(Message::of(0));
  std::atomic<std::uint64_t> announced{0};
  std::thread writer([&] {
    for (std::uint64_t number = 1; number <= last; ++number) {
      buffer.write(Message::of(number));
      announced.store(number, std::memory_order_release);
      if (number % pause == 0) std::this_thread::yield();
    }
  });
  std::uint64_t stale = 0, ahead = 0, torn = 0, backwards = 0, seen = 0;
  while (seen < last) {
    std::uint64_t const least = announced.load(std::memory_order_acquire);
    Message const& message = buffer.read();
    std::uint64_t const most = announced.load(std::memory_order_acquire) + 1;
    if (message.number < least) ++stale;
    if (message.number > most) ++ahead;
    if (message.number < seen) ++backwards;
    if (!message.whole()) ++torn;
    seen = message.number;
    if (seen == least) std::this_thread::yield();
  }
  writer.join();
  CHECK(stale == 0);
  CHECK(ahead == 0);
  CHECK(backwards == 0);
  CHECK(torn == 0);
}
