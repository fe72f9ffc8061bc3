// SPDX-License-Identifier: MIT
// expect: palpate: a Simulator takes a device, a body, a cutter and a force
// There is no cutter.
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  MassSpring<double> tissue(make_grid<double>(3, 3, 0.01), {});
  SoftBody body(std::move(tissue));
  Simulator simulator(NullDevice<double>(), std::move(body), TissueReaction{});
  simulator.run(0.1);
}
