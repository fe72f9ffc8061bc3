// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace palpate {

/// One short list of indices per particle, all in one pool: which triangles, or which springs, meet there.
/// Order      as added, except that a removal moves the last entry into the gap.
/// Cost       add is amortised O(1): a list that outgrows its place moves to the end of the pool with twice the room.
class IndexLists {
 public:
  int size() const noexcept { return static_cast<int>(lists_.size()); }

  std::span<int const> operator[](int list) const noexcept {
    List const& l = lists_[static_cast<std::size_t>(list)];
    return {pool_.data() + l.first, static_cast<std::size_t>(l.count)};
  }

  void add_list() { lists_.push_back({}); }
  void pop_list() noexcept { lists_.pop_back(); }

  void add(int list, int index) {
    List& l = lists_[static_cast<std::size_t>(list)];
    if (l.count == l.capacity) grow(l);
    pool_[l.first + static_cast<std::size_t>(l.count++)] = index;
  }

  /// Takes `index` out of the list; it must be there.
  void remove(int list, int index) noexcept {
    List& l = lists_[static_cast<std::size_t>(list)];
    auto const first = pool_.begin() + static_cast<std::ptrdiff_t>(l.first);
    *std::find(first, first + l.count, index) = *(first + l.count - 1);
    --l.count;
  }

  /// Writes `now` where the list holds `before`; it must be there.
  void rename(int list, int before, int now) noexcept {
    List const& l = lists_[static_cast<std::size_t>(list)];
    auto const first = pool_.begin() + static_cast<std::ptrdiff_t>(l.first);
    *std::find(first, first + l.count, before) = now;
  }

  void reserve(int lists, int entries) {
    lists_.reserve(static_cast<std::size_t>(lists));
    pool_.reserve(static_cast<std::size_t>(entries));
  }

 private:
  struct List {
    std::size_t first = 0;
    int count = 0;
    int capacity = 0;
  };

  void grow(List& l) {
    int const capacity = std::max(8, 2 * l.capacity);
    std::size_t const first = pool_.size();
    pool_.resize(first + static_cast<std::size_t>(capacity));
    std::copy_n(pool_.begin() + static_cast<std::ptrdiff_t>(l.first), l.count, pool_.begin() + static_cast<std::ptrdiff_t>(first));
    l.first = first;
    l.capacity = capacity;
  }

  std::vector<List> lists_;
  std::vector<int> pool_;
};

}  // namespace palpate
