// SPDX-License-Identifier: MIT
// expect: palpate: this is a tissue where a body is wanted; make one of it: SoftBody body(std::move(tissue)).
// A tissue where the body belongs.
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  FiniteElements<double, StableNeoHookean<double>> tissue(make_block<double>(3, 3, 3, 0.01), {.density = 1000.0});
  Simulator simulator(NullDevice<double>(), std::move(tissue), NoCutter<double>(), TissueReaction{});
  simulator.run(0.1);
}
