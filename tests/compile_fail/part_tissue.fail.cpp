// SPDX-License-Identifier: MIT
// expect: part_of: this is no body of tissue that makes tissue of its pieces, see DivisibleTissue;
// A piece of a body whose tissue can not be divided.
#include <palpate/palpate.hpp>
#include "beads.hpp"

void run() {
  using namespace palpate;
  SoftBody body(Beads(make_grid<double>(3, 3, 0.01)), LeapfrogVerlet{}, WholeBody{});
  static_cast<void>(part_of(body, pieces_of(body)[0]));
}
