// SPDX-License-Identifier: MIT
// expect: palpate: pieces are those of a body whose tissue has for_each_neighbour
// The pieces of a tissue that is in no body.
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  FiniteElements<double, StableNeoHookean<double>> tissue(make_block<double>(3, 3, 3, 0.01), {.density = 1000.0});
  static_cast<void>(hold_free_pieces(tissue));
}
