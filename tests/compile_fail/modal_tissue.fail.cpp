// SPDX-License-Identifier: MIT
// expect: modal_view: this is no body; of a tissue make one: SoftBody body(std::move(tissue)).
// The modes of a tissue that is in no body.
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  FiniteElements<double, StableNeoHookean<double>> tissue(make_block<double>(3, 3, 3, 0.01), {.density = 1000.0});
  static_cast<void>(modal_view(tissue));
}
