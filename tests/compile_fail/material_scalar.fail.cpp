// SPDX-License-Identifier: MIT
// expect: palpate: the material computes in another scalar than the tissue; write both for double or both for float: FiniteElements<float, StableNeoHookean<float>>.
// A material in double, for tissue in float.
#include <palpate/palpate.hpp>

void build() {
  using namespace palpate;
  SoftBody body(FiniteElements<float, StableNeoHookean<double>>(make_block<float>(3, 3, 3, 0.01f), {.density = 1000.0f, .material = {.young = 5e3, .poisson = 0.4}}), BackwardEuler{});
}
