// SPDX-License-Identifier: MIT
// A device that says how it is.
#include <palpate/palpate.hpp>

struct Hand {
  palpate::Capabilities capabilities() const { return {.max_force = 3.3, .rate = 1000.0}; }
  palpate::DeviceStatus read(palpate::DeviceState<double>&) noexcept { return palpate::DeviceStatus::ok; }
  palpate::DeviceStatus write(palpate::Wrench<double> const&) noexcept { return palpate::DeviceStatus::ok; }
};

void run() {
  using namespace palpate;
  Simulator simulator(Hand{}, SoftBody(MassSpring<double>(make_grid<double>(3, 3, 0.01), {})), NoCutter<double>{}, TissueReaction{});
  simulator.run(0.1);
}
