// SPDX-License-Identifier: MIT
// expect: palpate: the tool does not press; declare: template <class Body> Vector3<Scalar> press(Body& body, Scalar share, Scalar h)
// A tool keeps to itself what it presses with.
#include <palpate/palpate.hpp>
#include <palpate/tool.hpp>

/// A blunt tool that counts its steps.
struct Counting : palpate::BluntTool<double> {
  using BluntTool::BluntTool;
  template <class Body>
  void press(Body& body, double share, double h) {
    ++steps;
    BluntTool::press(body, share, h);
  }
  int steps = 0;
};

void run() {
  using namespace palpate;
  Counting const tool(ToolShape<double>{.rods = {{.rod = {.to = {0, 0, 0.1}, .radius = 0.002}}}}, {});
  Simulator simulator(NullDevice<double>{}, SoftBody(MassSpring<double>(make_grid<double>(3, 3, 0.01), {})), tool, TissueReaction{});
  simulator.run(0.1);
}
