// SPDX-License-Identifier: MIT
// A cutter in double for a body in double.
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  Simulator simulator(NullDevice<double>{}, SoftBody(MassSpring<double>(make_grid<double>(3, 3, 0.01), {})), ProgressiveCutter<double>({.puncture_depth = 0.005}), TissueReaction{});
  simulator.run(0.1);
}
