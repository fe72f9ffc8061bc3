// SPDX-License-Identifier: MIT
// The same without the mistake.
#include <palpate/palpate.hpp>

void run() {
  using namespace palpate;
  MassSpring<double> tissue(make_grid<double>(3, 3, 0.01), {});
  SoftBody body(std::move(tissue));
  Touch<double> touch(0.002);
  touch.update(body, {0, 0, 0});
}
