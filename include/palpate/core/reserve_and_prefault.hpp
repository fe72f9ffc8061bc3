// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace palpate {

/// Room for `count` elements in a list, of which the next `growth` are touched now: a system hands out memory page by page at the first touch,
/// a microsecond or so for each 4 KiB, and clears it, which the tick that grows the list would pay for.
template <class T, class Allocator>
void reserve_and_prefault(std::vector<T, Allocator>& list, std::size_t count, std::size_t growth) {
  list.reserve(count);
  std::size_t const size = list.size();
  list.resize(std::min(list.capacity(), size + growth));
  list.resize(size);
}
/// The same where the list is to grow up to `count`.
template <class T, class Allocator>
void reserve_and_prefault(std::vector<T, Allocator>& list, std::size_t count) {
  reserve_and_prefault(list, count, count - std::min(count, list.size()));
}

}  // namespace palpate
