// SPDX-License-Identifier: MIT
// A SparseTable against std::map.
#include <palpate/core/sparse_table.hpp>

#include "catch.hpp"

#include <map>
#include <random>

using palpate::SparseTable;

TEST_CASE("a sparse table holds what a map holds", "[sparse_table]") {
  std::mt19937 random(7);
  SparseTable<double> table;
  REQUIRE(table.find(0) == nullptr);
  for (int round = 0; round < 20; ++round) {
    std::map<int, double> map;
    int const range = round % 2 == 0 ? 50 : 2000000000;
    int wrong = 0;
    for (int k = 0; k < 500; ++k) {
      int const index = std::uniform_int_distribution(0, range)(random);
      if (k % 3 == 0) {
        double const value = std::uniform_real_distribution()(random);
        wrong += table[index] == map[index] ? 0 : 1;   // zero where it is new
        table[index] = map[index] = value;
      } else {
        auto const found = map.find(index);
        double const* const value = table.find(index);
        wrong += found == map.end() ? value != nullptr : value == nullptr || *value != found->second;
      }
    }
    for (auto const& [index, value] : map) wrong += table.find(index) == nullptr || *table.find(index) != value ? 1 : 0;
    CHECK(wrong == 0);
    table.clear();
    CHECK(table.find(map.begin()->first) == nullptr);
  }
}
