// SPDX-License-Identifier: MIT
// expect: palpate: the spring law has no member damping; declare: Scalar damping = 0, in N s/m
// A law that forgot its damper.
#include <palpate/palpate.hpp>

struct Cubic {
  double stiffness = 80.0;
  double cubic = 1e6;
  double tension(double elongation, double) const { return elongation * (stiffness + cubic * elongation * elongation); }
};

void build() {
  using namespace palpate;
  MassSpring<double, Cubic> const tissue(make_grid<double>(3, 3, 0.01), {});
  tissue.total_mass();
}
