// SPDX-License-Identifier: MIT
// Lists of indices in one pool. Yardstick: a vector of vectors that makes the same moves.
#include "allocation_trap.hpp"
#include "catch.hpp"

#include <palpate/core/index_lists.hpp>
#include <palpate/core/random.hpp>

#include <algorithm>
#include <utility>
#include <vector>

using namespace palpate;

TEST_CASE("lists that come, go, grow and shrink hold what a vector of vectors holds") {
  IndexLists lists;
  std::vector<std::vector<std::pair<int, int>>> plain;   // index, key
  Random random(Seed{3});
  for (int step = 0; step < 20000; ++step) {
    auto const of = [&](std::size_t count) { return static_cast<std::size_t>(random.below(count)); };
    if (auto const what = random.below(20); plain.empty() || (what == 0 && plain.size() < 40)) {
      lists.add_list(), plain.emplace_back();
    } else if (what == 1) {
      lists.pop_list(), plain.pop_back();
    } else if (std::size_t const l = of(plain.size()); what < 12 || plain[l].empty()) {
      lists.add(static_cast<int>(l), step, step / 2), plain[l].emplace_back(step, step / 2);
    } else if (std::size_t const k = of(plain[l].size()); what < 18) {
      lists.remove(static_cast<int>(l), plain[l][k].first);
      plain[l][k] = plain[l].back(), plain[l].pop_back();
    } else if (what == 18) {
      lists.rename(static_cast<int>(l), plain[l][k].first, step), plain[l][k].first = step;
    } else {
      lists.set_key(static_cast<int>(l), plain[l][k].first, -step), plain[l][k].second = -step;
    }
    REQUIRE(lists.size() == static_cast<int>(plain.size()));
    bool same = true;
    for (std::size_t l = 0; l < plain.size(); ++l) {
      auto const indices = lists[static_cast<int>(l)], keys = lists.keys(static_cast<int>(l));
      same = same && indices.size() == plain[l].size();
      for (std::size_t k = 0; same && k < plain[l].size(); ++k) same = indices[k] == plain[l][k].first && keys[k] == plain[l][k].second;
    }
    REQUIRE(same);
  }
}

TEST_CASE("lists that come and go take no more memory than they took at once") {
  REQUIRE(palpate_test::trap_works());
  IndexLists lists;
  auto const fill_and_empty = [&] {
    for (int l = 0; l < 20; ++l) {
      lists.add_list();
      for (int k = 0; k < 5 * l; ++k) lists.add(l, k, 0);
    }
    while (lists.size() > 0) lists.pop_list();
  };
  fill_and_empty();
  palpate_test::AllocationCount const allocations;
  for (int round = 0; round < 1000; ++round) fill_and_empty();
  CHECK(allocations.count() == 0);
}
