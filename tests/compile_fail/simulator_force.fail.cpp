// SPDX-License-Identifier: MIT
// expect: Simulator: the force model must be callable, noexcept, with a ToolContact of the body's scalar and return a Vector3 of it in N
// A force model that answers how much, not in which direction.
#include <palpate/palpate.hpp>

struct Push {
  double operator()(palpate::ToolContact<double> const& contact) noexcept { return 100.0 * contact.depth; }
};

void run() {
  using namespace palpate;
  Simulator simulator(NullDevice<double>{}, SoftBody(MassSpring<double>(make_grid<double>(3, 3, 0.01), {}), LeapfrogVerlet{}, WholeBody{}),
                      NoCutter<double>{}, Push{});
  simulator.run(0.1);
}
