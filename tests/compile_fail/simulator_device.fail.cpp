// SPDX-License-Identifier: MIT
// expect: palpate: the device's read and write run in the servo tick, where nobody catches; declare both noexcept
// A device that may throw in the servo tick.
#include <palpate/palpate.hpp>

struct Hand {
  palpate::Capabilities capabilities() const { return {.max_force = 3.3, .rate = 1000.0}; }
  palpate::DeviceStatus read(palpate::DeviceState<double>&) { return palpate::DeviceStatus::ok; }
  palpate::DeviceStatus write(palpate::Wrench<double> const&) noexcept { return palpate::DeviceStatus::ok; }
};

void run() {
  using namespace palpate;
  Simulator simulator(Hand{}, SoftBody(MassSpring<double>(make_grid<double>(3, 3, 0.01), {}), LeapfrogVerlet{}, WholeBody{}),
                      NoCutter<double>{}, CuttingForce(liver_hysteresis<double>()));
  simulator.run(0.1);
}
