// SPDX-License-Identifier: MIT
// expect: set_damping: this is no tissue of links and home springs, as MassSpring is, or it is const, as that of a body; set the damping before
// Damping for tissue that a body has already.
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  MassSpring<double> tissue(make_grid<double>(3, 3, 0.01), {});
  SoftBody body(std::move(tissue));
  set_damping(body.tissue(), damping_for(body.tissue(), 0.1));
}
