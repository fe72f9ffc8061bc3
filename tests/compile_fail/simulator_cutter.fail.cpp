// SPDX-License-Identifier: MIT
// expect: Simulator: the cutter needs advance(body, ToolPose<Scalar> const&), contact(), state(), report() and tip_radius() of the body's scalar
// The options of a cutter are not yet a cutter.
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  Simulator simulator(NullDevice<double>{}, SoftBody(MassSpring<double>(make_grid<double>(3, 3, 0.01), {}), LeapfrogVerlet{}, WholeBody{}),
                      ProgressiveCutterOptions<double>{.puncture_depth = 0.006}, CuttingForce(liver_hysteresis<double>()));
  simulator.run(0.1);
}
