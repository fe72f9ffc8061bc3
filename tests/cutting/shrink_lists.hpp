// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>

/// Drops stretches of a list in a case, half of it first, then ever shorter ones, as long as still(smaller), which puts `smaller` in its place. Whether any went.
template <class Case, class ListOf, class Still>
bool drop_stretches(Case const& all, ListOf const& list_of, Still const& still) {
  auto const size = [&] {
    auto copy = all;
    return list_of(copy).size();
  };
  bool any = false;
  for (std::size_t length = std::max<std::size_t>(1, size() / 2); length > 0; length /= 2)
    for (std::size_t at = 0; at < size();) {
      auto smaller = all;
      auto& list = list_of(smaller);
      auto const from = list.begin() + static_cast<std::ptrdiff_t>(at);
      list.erase(from, from + static_cast<std::ptrdiff_t>(std::min(length, list.size() - at)));
      if (still(smaller))
        any = true;
      else
        at += length;
    }
  return any;
}

/// Makes a case that is lists of ticks alone, its `strokes`, smaller while it still fails(case), which is asked `most` times at most.
template <class Case, class Fails>
Case with_fewer_ticks(Case all, Fails fails, int most = 300) {
  auto const still = [&](Case const& smaller) {
    if (most-- <= 0 || !fails(smaller)) return false;
    all = smaller;
    return true;
  };
  for (bool again = true; again && most > 0;) {
    again = drop_stretches(all, [](Case& c) -> auto& { return c.strokes; }, still);
    for (std::size_t k = 0; k < all.strokes.size(); ++k)
      if (drop_stretches(all, [k](Case& c) -> auto& { return c.strokes[k]; }, still)) again = true;
  }
  return all;
}
