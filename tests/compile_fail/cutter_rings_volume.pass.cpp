// SPDX-License-Identifier: MIT
// The same without the mistake.
#include <palpate/models.hpp>
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  VertexRings<double> body(make_sphere<double>(0.03, 8), {.slopes = {-8e-3, -4e-3, -1e-3}});
  Simulator simulator(NullDevice<double>(), std::move(body), NoCutter<double>({.tip_radius = 0.002}), TissueReaction{});
  simulator.run(0.1);
}
