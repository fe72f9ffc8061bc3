// SPDX-License-Identifier: MIT
// expect: palpate: the tool does not press; declare: template <class Body> Vector3<Scalar> press(Body& body, Scalar share, Scalar h)
// expect: and Vector3<Scalar> const& haptic_point() const.
// A tool that presses, and does not say where it is: it would be a tip, and its press would never be called.
#include <palpate/palpate.hpp>

struct Fan : palpate::NoCutter<double> {
  template <class Body>
  palpate::Vector3<double> press(Body& body, double, double) {
    body.apply_force(0, {0, 0, -0.01});
    return {0, 0, 0.01};
  }
};

void run() {
  using namespace palpate;
  Simulator simulator(NullDevice<double>{}, SoftBody(MassSpring<double>(make_grid<double>(3, 3, 0.01), {})), Fan{}, TissueReaction{});
  simulator.run(0.1);
}
