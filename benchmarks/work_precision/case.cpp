// SPDX-License-Identifier: MIT
#include "case.hpp"

#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/statics/newton_raphson.hpp>

#include <utility>

namespace work_precision {

Case prepare(Scene scene) {
  Reference reference = reference_of(scene);
  SoftBody body(scene.tissue, LeapfrogVerlet{}, WholeBody{});
  double const limit = body.stable_step();
  Scene swing = scene;
  swing.tissue = undamped(scene.tissue);
  SoftBody free(swing.tissue, LeapfrogVerlet{}, WholeBody{});
  if (!scene.force.isZero()) {
    free.apply_force(scene.touched, scene.force);
    free.solve_statics(NewtonRaphson<>{});
  }
  double const step = free.stable_step() / 2;
  return {std::move(scene), std::move(reference), limit, std::move(swing), free.positions(), step};
}

}  // namespace work_precision
