// SPDX-License-Identifier: MIT
#include "simulation_of.hpp"

#include <palpate/integrator/leapfrog_verlet.hpp>

namespace viewer {

std::shared_ptr<Simulation> make_leapfrog(Setup const& setup, Mesh const& organ, Targets const& targets) {
  return make_with(palpate::LeapfrogVerlet{}, setup, organ, targets);
}

}  // namespace viewer
