// SPDX-License-Identifier: MIT
#include "simulation_of.hpp"

#include <palpate/integrator/backward_euler.hpp>

namespace viewer {

std::shared_ptr<Simulation> make_backward_euler(Setup const& setup, Mesh const& organ, Targets const& targets) {
  return make_with(palpate::BackwardEuler{.tolerance = 1e-3, .max_iterations = 12}, setup, organ, targets);
}

}  // namespace viewer
