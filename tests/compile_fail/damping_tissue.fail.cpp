// SPDX-License-Identifier: MIT
// expect: damping_for: this is no tissue of links and home springs, as MassSpring is;
// A damping ratio for a solid, which has no springs.
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  FiniteElements<double, StableNeoHookean<double>> tissue(make_block<double>(3, 3, 3, 0.01), {.density = 1000.0});
  auto const damping = damping_for(tissue, 0.1);
  static_cast<void>(damping);
}
