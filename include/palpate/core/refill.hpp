// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace palpate::detail {

/// Makes a vector so many values, or these. Unlike assign(), it doubles what it holds where that is too little: one that needs a little more each time seldom allocates.
template <class T>
void refill(std::vector<T>& to, std::size_t count, T const& value) {
  if (count > to.capacity()) to.reserve(std::max(count, 2 * to.capacity()));
  to.assign(count, value);
}

template <class T>
void refill(std::vector<T>& to, std::span<T const> values) {
  if (values.size() > to.capacity()) to.reserve(std::max(values.size(), 2 * to.capacity()));
  to.assign(values.begin(), values.end());
}

}  // namespace palpate::detail
