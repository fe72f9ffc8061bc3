// SPDX-License-Identifier: MIT
// expect: lowest_frequencies: this is no tissue that hands out its stiffness, see HasStiffnessBlocks; of a body give body.tissue().
// The frequencies of a body instead of its tissue.
#include <palpate/palpate.hpp>
#include <palpate/tissue/lowest_frequencies.hpp>

void run() {
  using namespace palpate;
  FiniteElements<double, StableNeoHookean<double>> tissue(make_block<double>(3, 3, 3, 0.01), {.density = 1000.0});
  SoftBody body(std::move(tissue));
  static_cast<void>(lowest_frequencies(body, 3));
}
