// SPDX-License-Identifier: MIT
// Options before the tool.
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  Simulator simulator(SoftBody(MassSpring<double>(make_grid<double>(3, 3, 0.01), {}), LeapfrogVerlet{}, WholeBody{}), SimulatorOptions{},
                      Tool(NullDevice<double>{}, NoCutter<double>{}, TissueReaction{}));
  simulator.run(0.1);
}
