// SPDX-License-Identifier: MIT
// expect: a Simulator takes the body, then SimulatorOptions if there are any, then its tools
// Options behind the tool.
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  Simulator simulator(SoftBody(MassSpring<double>(make_grid<double>(3, 3, 0.01), {}), LeapfrogVerlet{}, WholeBody{}), Tool(NullDevice<double>{}, NoCutter<double>{}, TissueReaction{}),
                      SimulatorOptions{});
  simulator.run(0.1);
}
