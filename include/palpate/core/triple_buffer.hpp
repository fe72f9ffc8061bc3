// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <atomic>
#include <type_traits>

namespace palpate {

/// The newest value, handed from one thread to another without waiting.
/// The writer fills one slot, the reader looks at another, the third is on its way: publishing and fetching exchange a slot
/// index in one atomic operation. Values that the reader did not fetch in time are replaced by newer ones, never queued.
/// Threads    exactly one writer (`back`, `publish`, `write`) and one reader (`fetch`, `front`, `read`).
/// Cost       wait-free on both sides, no allocation beyond what T's own assignment does. Give a first value of the right size
///            and fill `back()` in place, then a T with dynamic storage does not allocate either.
/// Limits     `back()` holds an old value, not the last one written: fill it completely.
template <class T>
class TripleBuffer {
 public:
  TripleBuffer() = default;
  /// All three slots start with this value; `fetch` says nothing new until the first `publish`.
  explicit TripleBuffer(T const& first) : slots_{Slot{first}, Slot{first}, Slot{first}} {}
  TripleBuffer(TripleBuffer const&) = delete;
  TripleBuffer& operator=(TripleBuffer const&) = delete;

  /// Writer: the slot to fill before the next `publish`.
  T& back() noexcept { return slots_[back_].value; }
  /// Writer: hands `back()` over and takes another slot.
  void publish() noexcept { back_ = middle_.exchange(back_ | fresh, std::memory_order_acq_rel) & index; }
  /// Writer: both in one.
  void write(T const& value) noexcept(std::is_nothrow_copy_assignable_v<T>) {
    back() = value;
    publish();
  }

  /// Reader: takes the newest value if one was published since the last call.
  bool fetch() noexcept {
    if ((middle_.load(std::memory_order_relaxed) & fresh) == 0) return false;
    front_ = middle_.exchange(front_, std::memory_order_acq_rel) & index;
    return true;
  }
  /// Reader: the value last fetched; it stays as it is until the next `fetch`.
  T const& front() const noexcept { return slots_[front_].value; }
  /// Reader: both in one.
  T const& read() noexcept {
    fetch();
    return front();
  }

 private:
  static constexpr unsigned index = 3;
  static constexpr unsigned fresh = 4;   // set by the writer, cleared by the reader
  static constexpr std::size_t line = 64;   // bytes; two threads never write to one cache line

  struct alignas(line) Slot {
    T value{};
  };

  std::array<Slot, 3> slots_{};
  alignas(line) unsigned back_ = 0;              // the writer's own
  alignas(line) std::atomic<unsigned> middle_{1};
  alignas(line) unsigned front_ = 2;             // the reader's own
  static_assert(std::atomic<unsigned>::is_always_lock_free);
};

}  // namespace palpate
