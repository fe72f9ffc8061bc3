// SPDX-License-Identifier: MIT
// expect: palpate: the tissue has no internal_force(i, x, v) for every kind of columns; declare: template <class X, class V> Vector3<Scalar> internal_force(int i, X const& x, V const& v) const
// Tissue whose force on a particle can be asked at matrices alone: a body asks at its own columns, and at rest.
#include "beads.hpp"

/// Beads with a force of their own.
class Pulled : public Beads {
 public:
  using Beads::Beads;
  palpate::Vector3<double> internal_force(int i, palpate::Matrix3X<double> const& x, palpate::Matrix3X<double> const&) const { return -10.0 * (x.col(i) - rest_position(i)); }
};

void step() {
  using namespace palpate;
  SoftBody body(Pulled(make_grid<double>(3, 3, 0.01)), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 1});
  body.step(1e-3);
}
