// SPDX-License-Identifier: MIT
// The same without the mistake.
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  MassSpring<double> tissue(make_grid<double>(3, 3, 0.01), {});
  SoftBody body(std::move(tissue));
  Simulator simulator(NullDevice<double>(), std::move(body), NoCutter<double>(), TissueReaction{});
  simulator.run(0.1);
}
