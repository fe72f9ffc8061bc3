// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/huge_page_vector.hpp>
#include <palpate/core/reserve_and_prefault.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>
#include <span>

namespace palpate {

/// One short list of indices per particle, all in one pool: which triangles, or which springs, meet there. Each index has a key beside
/// it, such as the particle at the spring's other end: it is found without a look at the spring.
/// Order      as added, except that a removal moves the last entry into the gap.
/// Cost       add is amortised O(1): a list that outgrows its place moves to one with twice the room. Places that were left are used again,
///            so lists that come and go, grow and shrink take no more room than they took at once.
class IndexLists {
 public:
  int size() const noexcept { return static_cast<int>(lists_.size()); }

  std::span<int const> operator[](int list) const noexcept {
    List const& l = lists_[static_cast<std::size_t>(list)];
    return {pool_.data() + l.first, static_cast<std::size_t>(l.count)};
  }

  /// The keys of a list's indices, in the same order.
  std::span<int const> keys(int list) const noexcept {
    List const& l = lists_[static_cast<std::size_t>(list)];
    return {pool_.data() + l.first + l.capacity, static_cast<std::size_t>(l.count)};
  }

  /// The first index with this key, or −1.
  int find(int list, int key) const noexcept {
    List const& l = lists_[static_cast<std::size_t>(list)];
    int const* const indices = pool_.data() + l.first;
    int const* const keys = indices + l.capacity;
    for (int i = 0; i < l.count; ++i)
      if (keys[i] == key) return indices[i];
    return -1;
  }

  void add_list() { lists_.push_back({}); }
  void pop_list() noexcept {
    leave(lists_.back());
    lists_.pop_back();
  }

  void add(int list, int index, int key) {
    List& l = lists_[static_cast<std::size_t>(list)];
    if (l.count == l.capacity) grow(l);
    int* const at = pool_.data() + l.first + l.count++;
    at[0] = index;
    at[l.capacity] = key;
  }

  /// Takes `index` out of the list; it must be there.
  void remove(int list, int index) noexcept {
    List& l = lists_[static_cast<std::size_t>(list)];
    int* const at = place(l, index);
    int const* const last = pool_.data() + l.first + --l.count;
    at[0] = last[0];
    at[l.capacity] = last[l.capacity];
  }

  void clear_list(int list) noexcept { lists_[static_cast<std::size_t>(list)].count = 0; }

  /// Writes `now` where the list holds `before`; it must be there.
  void rename(int list, int before, int now) noexcept {
    *place(lists_[static_cast<std::size_t>(list)], before) = now;
  }

  /// Gives an index of the list another key; it must be there.
  void set_key(int list, int index, int key) noexcept {
    List const& l = lists_[static_cast<std::size_t>(list)];
    place(l, index)[l.capacity] = key;
  }

  /// Takes `index` out of the list and adds it again; it must be there.
  void move_last(int list, int index, int key) noexcept {
    List const& l = lists_[static_cast<std::size_t>(list)];
    int *const at = place(l, index), *const last = pool_.data() + l.first + (l.count - 1);
    at[0] = last[0], at[l.capacity] = last[l.capacity];
    last[0] = index, last[l.capacity] = key;
  }

  /// Room for so many lists with this many entries in all; what new lists grow into is touched, see reserve_and_prefault.
  void reserve(int lists, int entries) {
    std::size_t const added = static_cast<std::size_t>(lists) - std::min(lists_.size(), static_cast<std::size_t>(lists));
    reserve_and_prefault(lists_, static_cast<std::size_t>(lists));
    reserve_and_prefault(pool_, heads + 2 * static_cast<std::size_t>(entries), heads + 3 * 2 * min_capacity * added);   // new ones, and old that outgrow theirs
  }
  /// Room for so many lists, where new ones and the old ones beside them grow as those of a mesh do that is divided: by some 64 entries for each new one.
  void reserve_for_growth(int lists) {
    std::size_t const added = static_cast<std::size_t>(lists) - std::min(lists_.size(), static_cast<std::size_t>(lists));
    reserve_and_prefault(lists_, static_cast<std::size_t>(lists));
    reserve_and_prefault(pool_, std::max(heads, pool_.size()) + 2 * 64 * added);
  }

 private:
  static constexpr int min_capacity = 8;
  static constexpr std::size_t heads = 64;   // room for one place, two ints, for each capacity

  struct List {   // from `first` on: room for `capacity` indices, then for as many keys
    std::size_t first = 0;
    int count = 0;
    int capacity = 0;
  };

  int* place(List const& l, int index) noexcept {
    int* const first = pool_.data() + l.first;
    return std::find(first, first + l.count, index);
  }

  void grow(List& l) {
    int const capacity = std::max(min_capacity, 2 * l.capacity);
    std::size_t const first = take(capacity);
    int const* const from = pool_.data() + l.first;
    int* const to = pool_.data() + first;
    std::copy_n(from, l.count, to);
    std::copy_n(from + l.capacity, l.count, to + capacity);
    leave(l);
    l.first = first;
    l.capacity = capacity;
  }

  /// A place in the pool: the one of this capacity that was left last, or a new one at the end.
  std::size_t take(int capacity) {
    if (pool_.empty()) pool_.resize(heads);
    std::size_t const head = head_of(capacity);
    std::size_t first = 0;
    std::memcpy(&first, &pool_[head], sizeof first);
    if (first != 0) {
      std::memcpy(&pool_[head], &pool_[first], sizeof first);
      return first;
    }
    first = pool_.size();
    pool_.resize(first + 2 * static_cast<std::size_t>(capacity));
    return first;
  }
  void leave(List const& l) noexcept {
    if (l.capacity == 0) return;
    std::size_t const head = head_of(l.capacity);
    std::memcpy(&pool_[l.first], &pool_[head], sizeof l.first);
    std::memcpy(&pool_[head], &l.first, sizeof l.first);
  }
  static std::size_t head_of(int capacity) noexcept {
    return 2 * static_cast<std::size_t>(std::countr_zero(static_cast<unsigned>(capacity / min_capacity)));
  }

  HugePageVector<List> lists_;
  HugePageVector<int> pool_;   // begins, for each capacity, with the place that was left last, which begins with the one before it; 0: none
};

}  // namespace palpate
