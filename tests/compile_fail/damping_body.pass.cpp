// SPDX-License-Identifier: MIT
// The same without the mistake.
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  MassSpring<double> tissue(make_grid<double>(3, 3, 0.01), {});
  set_damping(tissue, damping_for(tissue, 0.1));
  SoftBody body(std::move(tissue));
}
