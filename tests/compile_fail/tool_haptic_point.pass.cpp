// SPDX-License-Identifier: MIT
// A tool that presses, and says where it is.
#include <palpate/palpate.hpp>

struct Fan : palpate::NoCutter<double> {
  template <class Body>
  palpate::Vector3<double> press(Body& body, double, double) {
    body.apply_force(0, {0, 0, -0.01});
    return {0, 0, 0.01};
  }
  palpate::Vector3<double> const& haptic_point() const { return at; }
  palpate::Vector3<double> at = palpate::Vector3<double>::Zero();
};

void run() {
  using namespace palpate;
  Simulator simulator(NullDevice<double>{}, SoftBody(MassSpring<double>(make_grid<double>(3, 3, 0.01), {})), Fan{}, TissueReaction{});
  simulator.run(0.1);
}
