// SPDX-License-Identifier: MIT
// The same without the mistake.
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  FiniteElements<double, StableNeoHookean<double>> tissue(make_block<double>(3, 3, 3, 0.01), {.density = 1000.0});
  SoftBody body(std::move(tissue));
  Simulator simulator(NullDevice<double>(), std::move(body), NoCutter<double>(), TissueReaction{});
  simulator.run(0.1);
}
