// SPDX-License-Identifier: MIT
// Tissue whose force on a particle can be asked at any columns.
#include "beads.hpp"

/// Beads with a force of their own.
class Pulled : public Beads {
 public:
  using Beads::Beads;
  palpate::Vector3<double> internal_force(int i, auto const& x, auto const&) const { return -10.0 * (x.col(i) - rest_position(i)); }
};

void step() {
  using namespace palpate;
  SoftBody body(Pulled(make_grid<double>(3, 3, 0.01)), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 1});
  body.step(1e-3);
}
