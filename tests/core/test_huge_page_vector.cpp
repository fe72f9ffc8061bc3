// SPDX-License-Identifier: MIT
// Yardstick: arithmetic of addresses. Whether the system grants large pages is its own affair.
#include <palpate/core/huge_page_vector.hpp>

#include "catch.hpp"

#include <array>
#include <cstdint>
#include <numeric>

using namespace palpate;

namespace {

template <class T>
std::uintptr_t beginning_of(HugePageVector<T> const& list) {
  return reinterpret_cast<std::uintptr_t>(list.data());
}

}  // namespace

TEST_CASE("A list is aligned for any register, and a large one begins a page of 2 MiB", "[core][large_vector]") {
  CHECK(beginning_of(HugePageVector<char>(1)) % 64 == 0);
  CHECK(beginning_of(HugePageVector<std::array<double, 3>>(1000)) % 64 == 0);
  CHECK(beginning_of(HugePageVector<double>(1 << 19)) % (1 << 21) == 0);   // 4 MiB
}

TEST_CASE("A list that grows to many megabytes keeps what it holds", "[core][large_vector]") {
  HugePageVector<int> list;
  for (int k = 0; k < 3000000; ++k) list.push_back(k);
  HugePageVector<int> const copy = list;
  list.resize(1000);
  list.shrink_to_fit();
  CHECK(std::accumulate(copy.begin(), copy.end(), 0LL) == 2999999LL * 3000000 / 2);
  CHECK(std::accumulate(list.begin(), list.end(), 0LL) == 999LL * 1000 / 2);
}
