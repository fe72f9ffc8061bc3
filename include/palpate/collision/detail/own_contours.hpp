// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/detail/sided_sets.hpp>
#include <palpate/core/refill.hpp>

#include <algorithm>
#include <array>
#include <compare>
#include <cstddef>
#include <vector>

namespace palpate::detail {

/// The contours along which a surface crosses itself: pairs of triangles that cross, joined where a contour goes from one pair to the next. There an edge crosses a
/// triangle, and both triangles at the edge do; where one of them does not, as at a vertex that both have, the contour ends, and bounds nothing.
/// Cost       O(n log n).
class OwnContours {
 public:
  void clear() noexcept { ends_.clear(); }
  /// In this pair an edge, by its vertices, crosses the other triangle.
  void add(std::array<int, 2> const& edge, int triangle, int pair) { ends_.push_back({edge, triangle, pair}); }

  /// Of so many pairs. True where all are closed.
  bool find(std::size_t pairs) {
    std::sort(ends_.begin(), ends_.end());
    sets_.reset(pairs), refill(is_left_out_, pairs, char{0});
    auto const is_one = [&](std::size_t a, std::size_t b) { return b < ends_.size() && ends_[a].edge == ends_[b].edge && ends_[a].triangle == ends_[b].triangle; };
    for (std::size_t k = 0; k < ends_.size(); ++k)
      if (is_one(k, k + 1)) sets_.unite(ends_[k].pair, ends_[k + 1].pair, false);
    for (std::size_t k = 0; k < ends_.size(); ++k)
      if (!is_one(k, k + 1) && !is_one(k, k - 1)) leave_out(of(ends_[k].pair));
    return left_out() == 0;
  }
  int of(int pair) noexcept { return sets_.of(pair).set; }   ///< its contour, by the lowest of its pairs
  /// Open ones are.
  void leave_out(int contour) noexcept { is_left_out_[static_cast<std::size_t>(contour)] = 1; }
  bool is_left_out(int contour) const noexcept { return is_left_out_[static_cast<std::size_t>(contour)] != 0; }
  int left_out() const noexcept { return static_cast<int>(std::count(is_left_out_.begin(), is_left_out_.end(), 1)); }

 private:
  struct End {
    std::array<int, 2> edge;
    int triangle, pair;
    friend auto operator<=>(End const&, End const&) = default;
  };
  std::vector<End> ends_;
  SidedSets sets_;
  std::vector<char> is_left_out_;   // of each pair that stands for a contour
};

}  // namespace palpate::detail
