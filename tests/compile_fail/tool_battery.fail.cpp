// SPDX-License-Identifier: MIT
// expect: palpate: the tool does not press; declare: template <class Body> Vector3<Scalar> press(Body& body, Scalar share, Scalar h)
// The law battery of tools for what is a cutter and does not press.
#include <palpate/palpate.hpp>

#include <palpate/extend/tool.hpp>

bool check() {
  using namespace palpate;
  SoftBody body(MassSpring<double>(make_grid<double>(3, 3, 0.01), {}));
  return testing::check_tool(NoCutter<double>{}, body).empty();
}
