// SPDX-License-Identifier: MIT
// A tool keeps to itself what it presses with.
#include <palpate/palpate.hpp>
#include <palpate/tool.hpp>

/// A blunt tool that counts its steps.
struct Counting : palpate::BluntTool<double> {
  using BluntTool::BluntTool;
  template <class Body>
  palpate::Vector3<double> press(Body& body, double share, double h) {
    ++steps;
    return BluntTool::press(body, share, h);
  }
  int steps = 0;
};

void run() {
  using namespace palpate;
  Counting const tool(ToolShape<double>{.rods = {{.rod = {.to = {0, 0, 0.1}, .radius = 0.002}}}}, {});
  Simulator simulator(NullDevice<double>{}, SoftBody(MassSpring<double>(make_grid<double>(3, 3, 0.01), {})), tool, TissueReaction{});
  simulator.run(0.1);
}
