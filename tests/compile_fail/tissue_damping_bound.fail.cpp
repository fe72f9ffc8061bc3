// SPDX-License-Identifier: MIT
// expect: palpate: the tissue has no damping_bound(i); declare: Scalar damping_bound(int i) const, in N s/m
// Tissue that states one bound of its damping for all particles.
#include "beads.hpp"

/// Beads with a bound of their own.
class Damped : public Beads {
 public:
  using Beads::Beads;
  double damping_bound() const { return 0.2; }
};

void step() {
  using namespace palpate;
  SoftBody body(Damped(make_grid<double>(3, 3, 0.01)));
  body.apply_force(4, {0, 0, -0.1});
  body.step(1e-3);
}
