// SPDX-License-Identifier: MIT
// A blunt tool for a body that can not be cut, in a simulator.
#include <palpate/models.hpp>
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  Simulator simulator(NullDevice<double>(), VertexRings<double>(make_sphere<double>(0.03, 8), {.slopes = {-8e-3, -4e-3, -1e-3}}), NoCutter<double>(), TissueReaction{});
  simulator.run(0.1);
}
