// SPDX-License-Identifier: MIT
// expect: VolumeCutter: this tissue is no solid that can be cut; FiniteElements is.
// A cutter of solids, for a body that can not be cut, in a simulator.
#include <palpate/models.hpp>
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  VertexRings<double> body(make_sphere<double>(0.03, 8), {.slopes = {-8e-3, -4e-3, -1e-3}});
  Simulator simulator(NullDevice<double>(), std::move(body), VolumeCutter<double>(), TissueReaction{});
  simulator.run(0.1);
}
