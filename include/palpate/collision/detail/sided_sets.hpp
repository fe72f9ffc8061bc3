// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace palpate::detail {

/// Numbers from 0 on, put together into sets, each on one of two sides of its set: union-find. A set is named by its lowest number, which is on the first side.
/// Cost       nearly O(1) a question.
class SidedSets {
 public:
  struct Place {
    int set;
    bool is_second;
  };

  /// Each number in a set of its own.
  void reset(std::size_t count) {
    places_.resize(count);
    for (std::size_t k = 0; k < count; ++k) places_[k] = {static_cast<int>(k), false};
  }
  std::size_t size() const noexcept { return places_.size(); }

  Place of(int number) noexcept {
    bool is_second = false;
    while (at(number).set != number) {
      Place& place = at(number);
      Place const next = at(place.set);
      place = {next.set, place.is_second != next.is_second};
      is_second = is_second != place.is_second, number = place.set;
    }
    return {number, is_second};
  }
  /// a and b are in one set, on opposite sides or on the same one. False where that contradicts what was said before.
  bool unite(int a, int b, bool are_opposite) noexcept {
    Place const one = of(a), two = of(b);
    bool const is_turned = (one.is_second != two.is_second) != are_opposite;
    if (one.set == two.set) return !is_turned;
    at(std::max(one.set, two.set)) = {std::min(one.set, two.set), is_turned};
    return true;
  }

 private:
  Place& at(int number) noexcept { return places_[static_cast<std::size_t>(number)]; }

  std::vector<Place> places_;
};

}  // namespace palpate::detail
