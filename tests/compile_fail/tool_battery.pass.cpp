// SPDX-License-Identifier: MIT
// The law battery of tools for one that presses.
#include <palpate/palpate.hpp>

#include <palpate/extend/tool.hpp>

bool check() {
  using namespace palpate;
  SoftBody body(MassSpring<double>(make_grid<double>(3, 3, 0.01), {}));
  return testing::check_tool(BluntTool<double>{}, body).empty();
}
