// SPDX-License-Identifier: MIT
// expect: palpate: the cutter computes in another scalar than the body: advance(body, ToolPose<Scalar> const& tool) must take the body's
// A cutter in float for a body in double.
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  Simulator simulator(NullDevice<double>{}, SoftBody(MassSpring<double>(make_grid<double>(3, 3, 0.01), {})), ProgressiveCutter<float>({.puncture_depth = 0.005f}), TissueReaction{});
  simulator.run(0.1);
}
