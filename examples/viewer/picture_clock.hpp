// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>

namespace viewer {

/// When the next picture is due, and what it may cost. A graphics card draws each picture whole, 60 a second. A processor that draws has the
/// simulation's threads to serve too: its first pictures are timed, and if they are slow, pictures become plain: 33 a second, the panel is drawn ten
/// times a second, and edges are not smoothed.
class PictureClock {
 public:
  using Clock = std::chrono::steady_clock;

  /// Says that there is no graphics card.
  void begin_by_processor() noexcept { by_processor_ = true; }

  bool is_due(Clock::time_point now) const noexcept { return now >= next_; }
  bool is_panel_due(Clock::time_point now) const noexcept { return !is_plain_ || now >= next_panel_; }
  bool is_plain() const noexcept { return is_plain_; }

  /// A picture was drawn from one moment to another.
  void drew(Clock::time_point from, Clock::time_point to, bool with_panel) noexcept {
    next_ = std::max(next_ + (is_plain_ ? plain_period : full_period), from);   // catches up with a late picture, not with more
    if (with_panel) next_panel_ = from + panel_period;
    if (by_processor_ && !is_plain_ && drawn_ > 0 && drawn_ <= timed) costs_[drawn_ - 1] = to - from;   // but the first, which prepares
    if (drawn_++ == 0) first_ = to;
    last_ = to;
    if (to - second_ >= std::chrono::seconds(1)) {
      recent_ = second_ == Clock::time_point() ? 0.0 : static_cast<double>(drawn_ - drawn_before_) / std::chrono::duration<double>(to - second_).count();
      second_ = to;
      drawn_before_ = drawn_;
    }
    if (!by_processor_ || is_plain_ || drawn_ != timed + 1) return;
    std::sort(costs_.begin(), costs_.end());
    if (costs_[timed / 2] <= full_period) return;
    is_plain_ = true;
    drawn_ = drawn_before_ = 0;
    second_ = {};
  }

  /// Pictures since they are drawn like this.
  std::size_t count() const noexcept { return drawn_; }
  /// Pictures a second: of all these, and of the last second or so; 0 before.
  double mean_rate() const noexcept { return drawn_ > 1 ? static_cast<double>(drawn_ - 1) / std::chrono::duration<double>(last_ - first_).count() : 0.0; }
  double rate() const noexcept { return recent_; }

 private:
  static constexpr std::chrono::milliseconds full_period{16}, plain_period{30}, panel_period{90};
  static constexpr std::size_t timed = 3;

  bool by_processor_ = false, is_plain_ = false;
  Clock::time_point next_{}, next_panel_{}, first_{}, last_{}, second_{};
  std::array<Clock::duration, timed> costs_{};
  std::size_t drawn_ = 0, drawn_before_ = 0;
  double recent_ = 0.0;   // 1/s
};

}  // namespace viewer
