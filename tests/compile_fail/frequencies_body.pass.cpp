// SPDX-License-Identifier: MIT
// The same without the mistake.
#include <palpate/palpate.hpp>
#include <palpate/tissue/lowest_frequencies.hpp>

void run() {
  using namespace palpate;
  FiniteElements<double, StableNeoHookean<double>> tissue(make_block<double>(3, 3, 3, 0.01), {.density = 1000.0});
  SoftBody body(std::move(tissue));
  static_cast<void>(lowest_frequencies(body.tissue(), 3));
}
