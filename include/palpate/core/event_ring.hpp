// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <type_traits>
#include <utility>

namespace palpate {

/// Events handed from one thread to another in order: clicks, faults, phase changes. A slow reader misses none as long as
/// there is room; when there is none, the newest event is dropped and counted.
/// Threads    exactly one writer (`push`) and one reader (`pop`); `dropped` and `size` from any.
/// Cost       wait-free, no allocation beyond what moving T does.
/// Invariant  Capacity is a power of two; all of it can be used.
template <class T, std::size_t Capacity>
class EventRing {
  static_assert(Capacity >= 2 && (Capacity & (Capacity - 1)) == 0,
                "palpate: the capacity of an EventRing is a power of two: 2, 4, 8, ... ; round it up.");
  static_assert(std::is_nothrow_move_assignable_v<T> && std::is_nothrow_move_constructible_v<T>,
                "palpate: events in an EventRing are moved inside the servo tick, so moving must not throw; "
                "use a plain struct of numbers.");

 public:
  EventRing() = default;
  EventRing(EventRing const&) = delete;
  EventRing& operator=(EventRing const&) = delete;

  /// Writer: false, and one more in `dropped()`, when the ring is full.
  bool push(T event) noexcept {
    std::uint64_t const written = written_.load(std::memory_order_relaxed);
    if (written - read_.load(std::memory_order_acquire) == Capacity) {
      dropped_.store(dropped_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
      return false;
    }
    events_[written & (Capacity - 1)] = std::move(event);
    written_.store(written + 1, std::memory_order_release);
    return true;
  }

  /// Reader: the oldest event, or nothing.
  std::optional<T> pop() noexcept {
    std::uint64_t const read = read_.load(std::memory_order_relaxed);
    if (read == written_.load(std::memory_order_acquire)) return std::nullopt;
    std::optional<T> event(std::move(events_[read & (Capacity - 1)]));
    read_.store(read + 1, std::memory_order_release);
    return event;
  }

  /// Events that found no room since the start.
  std::uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }
  /// How many events wait; another thread may change it at any time.
  std::size_t size() const noexcept {
    std::uint64_t const read = read_.load(std::memory_order_acquire);   // first: it never overtakes `written_`
    return static_cast<std::size_t>(written_.load(std::memory_order_acquire) - read);
  }
  static constexpr std::size_t capacity() noexcept { return Capacity; }

 private:
  static constexpr std::size_t line = 64;   // bytes; two threads never write to one cache line

  alignas(line) std::atomic<std::uint64_t> written_{0};
  std::atomic<std::uint64_t> dropped_{0};
  alignas(line) std::atomic<std::uint64_t> read_{0};
  alignas(line) std::array<T, Capacity> events_{};
};

}  // namespace palpate
