// SPDX-License-Identifier: MIT
// expect: a Simulator takes the body first, then its tools: Simulator simulator(std::move(body), Tool(device, cutter, force), Tool(...))
// A tool before the body.
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  Simulator simulator(Tool(NullDevice<double>{}, NoCutter<double>{}, TissueReaction{}), SoftBody(MassSpring<double>(make_grid<double>(3, 3, 0.01), {}), LeapfrogVerlet{}, WholeBody{}));
  simulator.run(0.1);
}
