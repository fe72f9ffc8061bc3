// SPDX-License-Identifier: MIT
// expect: SoftBody: this integrator is implicit and needs the tangent stiffness of the tissue
// An implicit integrator with a law that does not state its stiffness.
#include <palpate/palpate.hpp>

struct Stiffening {
  double stiffness = 80.0;
  double damping = 0.1;
  double tension(double elongation, double) const { return elongation * (stiffness + 1e6 * elongation * elongation); }
};

void step() {
  using namespace palpate;
  SoftBody body(MassSpring<double, Stiffening>(make_grid<double>(3, 3, 0.01), {}), BackwardEuler{}, WholeBody{});
  body.step(1e-3);
}
