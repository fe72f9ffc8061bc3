// SPDX-License-Identifier: MIT
#include "simulation.hpp"

#include <palpate/mesh/organ.hpp>

#include <utility>

namespace viewer {

std::shared_ptr<Simulation> make_simulation(Setup const& setup, std::shared_ptr<HandTargets> targets) {
  Mesh const organ = palpate::make_organ<double>({.vertices = setup.vertices});
  if (setup.integrator == IntegratorName::backward_euler) return make_backward_euler(setup, organ, std::move(targets));
  return make_leapfrog(setup, organ, std::move(targets));
}

}  // namespace viewer
