// SPDX-License-Identifier: MIT
// expect: scale_masses: this is no tissue that hands out its stiffness, see HasStiffnessBlocks, or it is const, as that of a body; scale before
// The masses of tissue that a body has already.
#include <palpate/palpate.hpp>
#include <palpate/tissue/mass_scaling.hpp>

void run() {
  using namespace palpate;
  FiniteElements<double, StableNeoHookean<double>> tissue(make_block<double>(3, 3, 3, 0.01), {.density = 1000.0});
  SoftBody body(std::move(tissue));
  scale_masses(body.tissue(), 1e-4);
}
