// SPDX-License-Identifier: MIT
#include "simulation_of.hpp"

#include <palpate/integrator/leapfrog_verlet.hpp>

namespace viewer {

std::shared_ptr<Simulation> make_leapfrog(Setup const& setup, Mesh const& organ, std::shared_ptr<HandTargets> targets) {
  return make_with(palpate::LeapfrogVerlet{}, setup, organ, std::move(targets));
}

}  // namespace viewer
