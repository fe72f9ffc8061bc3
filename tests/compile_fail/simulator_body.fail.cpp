// SPDX-License-Identifier: MIT
// expect: palpate: the body has no mean_edge() const; declare: Scalar mean_edge() const, in m.
// A member of a body takes an argument that nobody gives.
#include <palpate/palpate.hpp>

/// A body that adds nothing to a SoftBody but one mistake.
using Soft = palpate::SoftBody<palpate::MassSpring<double>, palpate::LeapfrogVerlet, palpate::WholeBody>;
struct Own : Soft {
  using Soft::SoftBody;
  double mean_edge(int) const { return 0.01; }
};

void run() {
  using namespace palpate;
  Simulator simulator(NullDevice<double>{}, Own(MassSpring<double>(make_grid<double>(3, 3, 0.01), {}), LeapfrogVerlet{}, WholeBody{}), NoCutter<double>{}, TissueReaction{});
  simulator.run(0.1);
}
