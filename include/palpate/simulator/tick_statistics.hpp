// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace palpate {

/// How often which duration occurred, in buckets that grow with the duration.
///   32 buckets per power of two, 1 ns to 36 minutes; below 32 ns every nanosecond has its own.
/// Accuracy   `quantile` is within 1/32 of the true value; count, mean, smallest and largest are exact.
/// Cost       `add` is O(1), noexcept, no allocation: allowed in the servo tick. 9 KiB.
class DurationHistogram {
 public:
  using Duration = std::chrono::nanoseconds;

  void add(Duration duration) noexcept {
    std::uint64_t const value = static_cast<std::uint64_t>(std::max<Duration::rep>(duration.count(), 0));
    ++buckets_[bucket_of(value)];
    ++count_;
    sum_ += value;
    smallest_ = std::min(smallest_, value);
    largest_ = std::max(largest_, value);
  }

  void merge(DurationHistogram const& other) noexcept {
    for (std::size_t i = 0; i < buckets_.size(); ++i) buckets_[i] += other.buckets_[i];
    count_ += other.count_;
    sum_ += other.sum_;
    smallest_ = std::min(smallest_, other.smallest_);
    largest_ = std::max(largest_, other.largest_);
  }

  std::uint64_t count() const noexcept { return count_; }
  /// All of these are zero while nothing was added.
  Duration min() const noexcept { return duration(count_ == 0 ? 0 : smallest_); }
  Duration max() const noexcept { return duration(largest_); }
  Duration mean() const noexcept { return duration(count_ == 0 ? 0 : sum_ / count_); }
  Duration total() const noexcept { return duration(sum_); }

  /// The duration that a share `q` in [0, 1] of the entries does not exceed: entry number ⌈q count⌉ in sorted order.
  Duration quantile(double q) const noexcept {
    if (count_ == 0) return Duration::zero();
    if (!(q > 0.0)) return min();
    if (q >= 1.0) return max();
    double const exact = q * static_cast<double>(count_);
    std::uint64_t rank = static_cast<std::uint64_t>(exact);
    if (static_cast<double>(rank) < exact) ++rank;
    std::uint64_t seen = 0;
    for (std::size_t i = 0; i < buckets_.size(); ++i) {
      seen += buckets_[i];
      if (seen >= rank) return duration(std::clamp(middle_of(i), smallest_, largest_));
    }
    return max();
  }
  Duration p50() const noexcept { return quantile(0.50); }
  Duration p99() const noexcept { return quantile(0.99); }

 private:
  static constexpr int sub_bits = 5;
  static constexpr std::uint64_t sub_count = 1u << sub_bits;   // buckets per power of two
  static constexpr int top_bit = 40;                           // 2^41 ns is 36 minutes; longer ones share the last bucket
  static constexpr std::size_t bucket_count = (top_bit - sub_bits + 2) * sub_count;

  static constexpr Duration duration(std::uint64_t value) noexcept { return Duration(static_cast<Duration::rep>(value)); }

  static constexpr std::size_t bucket_of(std::uint64_t value) noexcept {
    if (value < sub_count) return static_cast<std::size_t>(value);
    int const exponent = static_cast<int>(std::bit_width(value)) - 1;
    if (exponent > top_bit) return bucket_count - 1;
    int const shift = exponent - sub_bits;
    return static_cast<std::size_t>(static_cast<std::uint64_t>(shift) * sub_count + (value >> shift));
  }
  static constexpr std::uint64_t middle_of(std::size_t bucket) noexcept {
    if (bucket < 2 * sub_count) return bucket;
    std::uint64_t const shift = bucket / sub_count - 1;
    std::uint64_t const lower = (bucket % sub_count + sub_count) << shift;
    return lower + (std::uint64_t{1} << (shift - 1));
  }

  std::array<std::uint64_t, bucket_count> buckets_{};
  std::uint64_t count_ = 0;
  std::uint64_t sum_ = 0;
  std::uint64_t smallest_ = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t largest_ = 0;
};

/// When one tick was due, began and ended, on one clock that never goes back.
struct TickTiming {
  using TimePoint = std::chrono::steady_clock::time_point;

  TimePoint due;
  TimePoint started;
  TimePoint finished;
};

/// What a servo loop's ticks were like: period from start to start, latency from due to start, computing time from start to end.
/// Overrun    a tick that ended after its successor was due. Skipped: a tick that never ran because an earlier one took so long.
/// Threads    one writer; copy it through a `TripleBuffer` to read it while the loop runs.
/// Cost       `add` is O(1), noexcept, no allocation. 28 KiB.
class TickStatistics {
 public:
  using Duration = std::chrono::nanoseconds;

  TickStatistics() = default;
  /// `target` is the period the loop aims at; zero if it has none, and then nothing is an overrun.
  explicit TickStatistics(Duration target) noexcept : target_(target) {}

  void add(TickTiming const& tick) noexcept {
    if (running_) period_.add(std::chrono::duration_cast<Duration>(tick.started - last_start_));
    running_ = true;
    last_start_ = tick.started;
    latency_.add(std::chrono::duration_cast<Duration>(tick.started - tick.due));
    compute_.add(std::chrono::duration_cast<Duration>(tick.finished - tick.started));
    if (target_ > Duration::zero() && tick.finished > tick.due + target_) ++overruns_;
  }
  /// A tick of a loop that no clock drives (lock-step): it has a computing time and no more.
  void add(Duration compute) noexcept {
    compute_.add(compute);
    if (target_ > Duration::zero() && compute > target_) ++overruns_;
  }
  void add_skipped(std::uint64_t ticks) noexcept { skipped_ += ticks; }
  /// The next tick starts a new series: no period is counted across the gap.
  void pause() noexcept { running_ = false; }

  /// Adds what another loop, or an earlier run of this one, counted. The target stays.
  void merge(TickStatistics const& other) noexcept {
    period_.merge(other.period_);
    latency_.merge(other.latency_);
    compute_.merge(other.compute_);
    overruns_ += other.overruns_;
    skipped_ += other.skipped_;
  }

  std::uint64_t ticks() const noexcept { return compute_.count(); }
  std::uint64_t overruns() const noexcept { return overruns_; }
  std::uint64_t skipped() const noexcept { return skipped_; }
  Duration target() const noexcept { return target_; }
  /// Its largest value is the longest gap.
  DurationHistogram const& period() const noexcept { return period_; }
  DurationHistogram const& latency() const noexcept { return latency_; }
  DurationHistogram const& compute() const noexcept { return compute_; }
  /// Hz, the rate reached: 1 / mean period; 0 while there is no period.
  double rate() const noexcept {
    double const total = std::chrono::duration<double>(period_.total()).count();
    return total > 0.0 ? static_cast<double>(period_.count()) / total : 0.0;
  }

 private:
  Duration target_ = Duration::zero();
  DurationHistogram period_;
  DurationHistogram latency_;
  DurationHistogram compute_;
  std::uint64_t overruns_ = 0;
  std::uint64_t skipped_ = 0;
  TickTiming::TimePoint last_start_{};
  bool running_ = false;
};

}  // namespace palpate
