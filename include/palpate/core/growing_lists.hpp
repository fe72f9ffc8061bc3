// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace palpate {

/// Lists of items, one after the other in memory, each set as a whole. One that outgrows its place goes to the end; all close up where half is left empty.
/// Cost       set() is O(its length), amortised. For lists of indices that gain and lose single ones see IndexLists.
template <class Item>
class GrowingLists {
 public:
  void clear() noexcept { places_.clear(), items_.clear(), empty_ = 0; }
  /// Room for so many lists with this many items in all.
  void reserve(std::size_t lists, std::size_t items) { places_.reserve(lists), items_.reserve(items), closed_.reserve(items); }
  int size() const noexcept { return static_cast<int>(places_.size()); }
  std::size_t items() const noexcept { return items_.size(); }   ///< in all, with what is left empty
  std::span<Item const> operator[](int i) const noexcept { return std::span(items_).subspan(places_[index(i)].first, index(places_[index(i)].count)); }
  /// List i, one that there is or the next, becomes these.
  void set(int i, std::span<Item const> values) {
    if (i == size()) places_.push_back({items_.size(), 0, 0});
    Place& place = places_[index(i)];
    int const count = static_cast<int>(values.size());
    if (count > place.room) {
      empty_ += index(place.room);
      place.first = items_.size(), place.room = count;
      items_.insert(items_.end(), values.begin(), values.end());
    } else {
      std::copy(values.begin(), values.end(), items_.begin() + static_cast<std::ptrdiff_t>(place.first));
    }
    place.count = count;
    if (2 * empty_ > items_.size()) close_up();
  }

 private:
  static std::size_t index(int i) noexcept { return static_cast<std::size_t>(i); }
  struct Place {
    std::size_t first;
    int count, room;
  };
  void close_up() {
    closed_.clear();
    for (Place& place : places_) {
      std::size_t const first = closed_.size();
      closed_.insert(closed_.end(), items_.begin() + static_cast<std::ptrdiff_t>(place.first), items_.begin() + static_cast<std::ptrdiff_t>(place.first) + place.count);
      place = {first, place.count, place.count};
    }
    items_.swap(closed_), empty_ = 0;
  }
  std::vector<Place> places_;
  std::vector<Item> items_, closed_;   // the other, while they close up
  std::size_t empty_ = 0;
};

}  // namespace palpate
