// SPDX-License-Identifier: MIT
// A material in float, for tissue in float; also one that fades.
#include <palpate/palpate.hpp>

void build() {
  using namespace palpate;
  SoftBody body(FiniteElements<float, StableNeoHookean<float>>(make_block<float>(3, 3, 3, 0.01f), {.density = 1000.0f, .material = {.young = 5e3f, .poisson = 0.4f}}), BackwardEuler{});
  static_assert(Material<Viscoelastic<StableNeoHookean<float>>, float>);
}
