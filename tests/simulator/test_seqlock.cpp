// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "allocation_trap.hpp"
#include "exchanges.hpp"

#include <palpate/simulator/seqlock.hpp>

#include <array>
#include <atomic>
#include <cstdint>
#include <thread>
#include <utility>
#include <vector>

using namespace palpate;
using palpate_test::exchanges;
using palpate_test::pause_of;

namespace {

/// 13 bytes: the last word of the store is not full.
struct Odd {
  std::array<unsigned char, 13> bytes{};
};

/// Every word follows from the number, so a copy of two values shows.
struct Numbered {
  std::uint64_t number = 0;
  std::array<std::uint64_t, 30> words{};

  static Numbered of(std::uint64_t number) {
    Numbered value{number, {}};
    for (std::size_t i = 0; i < value.words.size(); ++i) value.words[i] = (number + i) * 0x9E3779B97F4A7C15u;
    return value;
  }
  bool whole() const { return words == of(number).words; }
};

static_assert(noexcept(std::declval<Seqlock<Numbered>&>().write(std::declval<Numbered const&>())));
static_assert(noexcept(std::declval<Seqlock<Numbered> const&>().try_read(std::declval<Numbered&>())));

}  // namespace

TEST_CASE("a reader finds the first value, then the newest", "[seqlock]") {
  Seqlock<int> value(-1);
  CHECK(value.read() == -1);
  CHECK(value.written() == 0);
  for (int i = 1; i <= 5; ++i) value.write(i);
  CHECK(value.read() == 5);
  CHECK(value.read() == 5);   // it stays, for any number of readers
  CHECK(value.written() == 5);
  int copy = 0;
  CHECK(value.try_read(copy));
  CHECK(copy == 5);
}

TEST_CASE("a value of any size comes out as it went in", "[seqlock]") {
  Odd odd;
  for (unsigned i = 0; i < 13; ++i) odd.bytes[i] = static_cast<unsigned char>(200 + i);
  Seqlock<Odd> value;
  CHECK(value.read().bytes == Odd{}.bytes);
  value.write(odd);
  CHECK(value.read().bytes == odd.bytes);
  Seqlock<char> letter('a');
  CHECK(letter.read() == 'a');
}

TEST_CASE("writing and reading a shared value does not allocate", "[seqlock][realtime]") {
  REQUIRE(palpate_test::trap_works());
  Seqlock<Numbered> value;
  std::uint64_t sum = 0;
  palpate_test::AllocationCount const allocations;
  for (std::uint64_t i = 0; i < 100; ++i) {
    value.write(Numbered::of(i));
    sum += value.read().number;
  }
  long const count = allocations.count();
  CHECK(count == 0);
  CHECK(sum == 4950);
}

TEST_CASE("no reader of several sees a value that was never written, or an older one than before", "[seqlock][threads][exchanges]") {
  // Yardstick: every payload matches its number; a number that was announced after its write is there; numbers only grow. How many values:
  // PALPATE_EXCHANGES.
  std::uint64_t const last = exchanges(60000), pause = pause_of(last);
  Seqlock<Numbered> value(Numbered::of(0));
  std::atomic<std::uint64_t> announced{0};
  struct Seen {
    std::uint64_t torn = 0, backwards = 0, stale = 0, ahead = 0, reads = 0, failed = 0;
  };
  std::array<Seen, 3> seen;
  std::vector<std::thread> readers;
  for (Seen& mine : seen)
    readers.emplace_back([&] {
      std::uint64_t previous = 0;
      Numbered copy;
      while (previous < last) {
        std::uint64_t const least = announced.load(std::memory_order_acquire);
        if (!value.try_read(copy)) {
          ++mine.failed;
          std::this_thread::yield();
          continue;
        }
        std::uint64_t const most = announced.load(std::memory_order_acquire) + 1;   // at most one is written and not announced
        ++mine.reads;
        if (!copy.whole()) ++mine.torn;
        if (copy.number < previous) ++mine.backwards;
        if (copy.number < least) ++mine.stale;
        if (copy.number > most) ++mine.ahead;
        if (copy.number == previous) std::this_thread::yield();
        previous = copy.number;
      }
    });
  for (std::uint64_t number = 1; number <= last; ++number) {
    value.write(Numbered::of(number));
    announced.store(number, std::memory_order_release);
    if (number % pause == 0) std::this_thread::yield();
  }
  for (std::thread& reader : readers) reader.join();
  for (Seen const& reader : seen) {
    CHECK(reader.torn == 0);
    CHECK(reader.backwards == 0);
    CHECK(reader.stale == 0);
    CHECK(reader.ahead == 0);
    CHECK(reader.reads > 0);
  }
  CHECK(value.written() == last);
}
