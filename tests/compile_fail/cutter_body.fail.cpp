// SPDX-License-Identifier: MIT
// expect: SeparatingCutter: this tissue can not be cut along its edges; it lacks the ability SeparableTissue
// A cutter of springs, for a body that can not be cut, in a simulator.
#include <palpate/models.hpp>
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  Simulator simulator(NullDevice<double>(), VertexRings<double>(make_sphere<double>(0.03, 8), {.slopes = {-8e-3, -4e-3, -1e-3}}), SeparatingCutter<double>(), TissueReaction{});
  simulator.run(0.1);
}
