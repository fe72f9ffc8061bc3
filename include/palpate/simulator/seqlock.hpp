// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <thread>
#include <type_traits>

namespace palpate {

/// The newest value of one writer for any number of readers.
/// The writer makes a counter odd, writes the value, and makes the counter even again; a reader copies the value and takes the copy if the
/// counter was even and the same before and after. Why the copy is whole: each word is stored with release and loaded with acquire, so a
/// reader that saw a word of a later value also sees the odd counter that went before it. So no fence is needed, and no data race is there.
/// Threads    one writer (`write`); any number of readers (`try_read`, `read`) at any time.
/// Cost       `write` and `try_read` copy T once, 8 bytes at a time: some 1 µs for 28 KiB. `write` never waits, neither allocates.
///            `read` tries until it succeeds, and gives way to other threads in between: not for a servo tick.
/// Source     \cite boehm2012, with stores and loads of the words in place of its fences
/// Limits     T is trivially copyable. For one reader and values that are large or have storage of their own, take a TripleBuffer.
template <class T>
class Seqlock {
  static_assert(std::is_trivially_copyable_v<T> && std::is_default_constructible_v<T>,
                "palpate: a Seqlock copies its value while it may change, so the value is a plain struct of numbers; for others take a "
                "TripleBuffer.");

 public:
  /// Readers find this until the first `write`.
  explicit Seqlock(T const& first = T{}) noexcept { store(first); }
  Seqlock(Seqlock const&) = delete;
  Seqlock& operator=(Seqlock const&) = delete;

  void write(T const& value) noexcept {
    std::uint64_t const count = count_.load(std::memory_order_relaxed);
    count_.store(count + 1, std::memory_order_relaxed);
    store(value);
    count_.store(count + 2, std::memory_order_release);
  }

  /// Copies the newest value; false, and `value` is torn, when it was being written meanwhile.
  bool try_read(T& value) const noexcept {
    std::uint64_t const before = count_.load(std::memory_order_acquire);
    if (before % 2 != 0) return false;
    auto* const bytes = reinterpret_cast<unsigned char*>(&value);
    for (std::size_t i = 0; i < words_.size(); ++i) {
      std::uint64_t const word = words_[i].load(std::memory_order_acquire);
      std::memcpy(bytes + i * sizeof word, &word, size_of(i));
    }
    return count_.load(std::memory_order_relaxed) == before;
  }
  T read() const noexcept {
    T value{};
    while (!try_read(value)) std::this_thread::yield();
    return value;
  }

  /// How many values have been written; another thread may change it at any time.
  std::uint64_t written() const noexcept { return count_.load(std::memory_order_acquire) / 2; }

 private:
  using Word = std::atomic<std::uint64_t>;
  static_assert(Word::is_always_lock_free);
  static constexpr std::size_t line = 64;   // bytes

  /// Bytes of the value in word i: eight, less in the last one.
  static constexpr std::size_t size_of(std::size_t i) noexcept {
    return sizeof(T) - i * sizeof(std::uint64_t) < sizeof(std::uint64_t) ? sizeof(T) - i * sizeof(std::uint64_t) : sizeof(std::uint64_t);
  }
  void store(T const& value) noexcept {
    auto const* const bytes = reinterpret_cast<unsigned char const*>(&value);
    for (std::size_t i = 0; i < words_.size(); ++i) {
      std::uint64_t word = 0;
      std::memcpy(&word, bytes + i * sizeof word, size_of(i));
      words_[i].store(word, std::memory_order_release);
    }
  }

  alignas(line) std::atomic<std::uint64_t> count_{0};   // odd while a value is being written
  alignas(line) std::array<Word, (sizeof(T) + sizeof(std::uint64_t) - 1) / sizeof(std::uint64_t)> words_{};
};

}  // namespace palpate
