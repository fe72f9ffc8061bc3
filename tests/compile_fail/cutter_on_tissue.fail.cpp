// SPDX-License-Identifier: MIT
// expect: palpate: a tool acts on a body, and this is none; of a tissue make one: SoftBody body(std::move(tissue)).
// A cutter is given the tissue instead of the body.
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  FiniteElements<double, StableNeoHookean<double>> tissue(make_block<double>(3, 3, 3, 0.01), {.density = 1000.0});
  VolumeCutter<double> knife;
  knife.advance(tissue, ToolPose<double>{});
}
