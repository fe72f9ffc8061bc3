// SPDX-License-Identifier: MIT
// expect: palpate: the cutter has no advance(body, tool); declare: template <class Body> void advance(Body& body, ToolPose<typename Body::Scalar> const& tool)
// The options of a cutter are not yet a cutter.
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  Simulator simulator(NullDevice<double>{}, SoftBody(MassSpring<double>(make_grid<double>(3, 3, 0.01), {}), LeapfrogVerlet{}, WholeBody{}),
                      ProgressiveCutterOptions<double>{.puncture_depth = 0.006}, CuttingForce(liver_hysteresis<double>()));
  simulator.run(0.1);
}
