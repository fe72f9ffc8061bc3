// SPDX-License-Identifier: MIT
// The law battery for a cutter of the body's scalar.
#include <palpate/palpate.hpp>

#include <palpate/extend/cutter.hpp>

bool check() {
  using namespace palpate;
  SoftBody body(MassSpring<double>(make_grid<double>(3, 3, 0.01), {}));
  return testing::check_cutter(NoCutter<double>{}, body, {.way = {{0.01, 0.01, 0.01}, {0.01, 0.01, -0.01}}}).empty();
}
