// SPDX-License-Identifier: MIT
// expect: Simulator: the force model must be callable, noexcept, with a ToolContact of the body's scalar and return a Vector3 of it in N
// One of two tools answers with a number instead of a force.
#include <palpate/palpate.hpp>

struct Push {
  double operator()(palpate::ToolContact<double> const& contact) const noexcept { return 100.0 * contact.depth; }
};

void run() {
  using namespace palpate;
  Simulator simulator(SoftBody(MassSpring<double>(make_grid<double>(3, 3, 0.01), {}), LeapfrogVerlet{}, WholeBody{}),
                      Tool(NullDevice<double>{}, NoCutter<double>{}, TissueReaction{}), Tool(NullDevice<double>{}, NoCutter<double>{}, Push{}));
  simulator.run(0.1);
}
