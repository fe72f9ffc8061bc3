// SPDX-License-Identifier: MIT
// expect: palpate: the device has no read(state) that answers a DeviceStatus; declare: DeviceStatus read(DeviceState<double>& state) noexcept
// A device that says whether it has read, not how it is.
#include <palpate/palpate.hpp>

struct Hand {
  palpate::Capabilities capabilities() const { return {.max_force = 3.3, .rate = 1000.0}; }
  bool read(palpate::DeviceState<double>&) noexcept { return true; }
  palpate::DeviceStatus write(palpate::Wrench<double> const&) noexcept { return palpate::DeviceStatus::ok; }
};

void run() {
  using namespace palpate;
  Simulator simulator(Hand{}, SoftBody(MassSpring<double>(make_grid<double>(3, 3, 0.01), {})), NoCutter<double>{}, TissueReaction{});
  simulator.run(0.1);
}
