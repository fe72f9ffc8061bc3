// SPDX-License-Identifier: MIT
// A member of a body takes an argument that nobody gives.
#include <palpate/palpate.hpp>

/// A body that adds nothing to a SoftBody but a member of its own.
using Soft = palpate::SoftBody<palpate::MassSpring<double>, palpate::LeapfrogVerlet, palpate::WholeBody>;
struct Own : Soft {
  using Soft::SoftBody;
  double mean_edge() const { return 0.01; }
};

void run() {
  using namespace palpate;
  Simulator simulator(NullDevice<double>{}, Own(MassSpring<double>(make_grid<double>(3, 3, 0.01), {}), LeapfrogVerlet{}, WholeBody{}), NoCutter<double>{}, TissueReaction{});
  simulator.run(0.1);
}
