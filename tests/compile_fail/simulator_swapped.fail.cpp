// SPDX-License-Identifier: MIT
// expect: Simulator: there is no body where one belongs: Simulator simulator(device, body, cutter, force)
// Body and device have changed places.
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  MassSpring<double> tissue(make_grid<double>(3, 3, 0.01), {});
  SoftBody body(std::move(tissue));
  Simulator simulator(std::move(body), NullDevice<double>(), NoCutter<double>(), TissueReaction{});
  simulator.run(0.1);
}
