// SPDX-License-Identifier: MIT
// A force model that answers how much, not in which direction.
#include <palpate/palpate.hpp>

struct Push {
  palpate::Vector3<double> operator()(palpate::ToolContact<double> const& contact) noexcept {
    return 100.0 * contact.depth * contact.normal;
  }
};

void run() {
  using namespace palpate;
  Simulator simulator(NullDevice<double>{}, SoftBody(MassSpring<double>(make_grid<double>(3, 3, 0.01), {}), LeapfrogVerlet{}, WholeBody{}),
                      NoCutter<double>{}, Push{});
  simulator.run(0.1);
}
