// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <type_traits>
#include <utility>

namespace palpate::detail {

/// use(place) for places from 0 to N − 1, each a constant.
template <std::size_t N, class Use>
constexpr void for_each_place(Use const& use) {
  [&]<std::size_t... I>(std::index_sequence<I...>) { (use(std::integral_constant<std::size_t, I>{}), ...); }(std::make_index_sequence<N>{});
}

}  // namespace palpate::detail
