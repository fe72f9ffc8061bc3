// SPDX-License-Identifier: MIT
// expect: palpate: the tissue has no damping_bound(i); declare: Scalar damping_bound(int i) const, in N s/m
// The law battery for tissue that states one bound of its damping for all particles.
#include "beads.hpp"

#include <palpate/testing/tissue.hpp>

/// Beads with a bound of their own.
class Damped : public Beads {
 public:
  using Beads::Beads;
  double damping_bound() const { return 0.2; }
};

bool check() { return palpate::testing::check_tissue(Damped(palpate::make_grid<double>(3, 3, 0.01))).empty(); }
