// SPDX-License-Identifier: MIT
// The law battery for tissue that states a bound of its damping for each particle.
#include "beads.hpp"

#include <palpate/testing/tissue.hpp>

/// Beads with a bound of their own.
class Damped : public Beads {
 public:
  using Beads::Beads;
  double damping_bound(int) const { return 0.2; }
};

bool check() { return palpate::testing::check_tissue(Damped(palpate::make_grid<double>(3, 3, 0.01))).empty(); }
