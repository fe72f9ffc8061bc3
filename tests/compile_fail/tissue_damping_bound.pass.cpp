// SPDX-License-Identifier: MIT
// Tissue that states a bound of its damping for each particle.
#include "beads.hpp"

/// Beads with a bound of their own.
class Damped : public Beads {
 public:
  using Beads::Beads;
  double damping_bound(int) const { return 0.2; }
};

void step() {
  using namespace palpate;
  SoftBody body(Damped(make_grid<double>(3, 3, 0.01)));
  body.apply_force(4, {0, 0, -0.1});
  body.step(1e-3);
}
