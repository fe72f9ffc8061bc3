// SPDX-License-Identifier: MIT
#include "reference.hpp"

#include <palpate/core/error.hpp>
#include <palpate/integrator/dormand_prince.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/statics/newton_raphson.hpp>

#include <limits>
#include <utility>

namespace work_precision {

namespace {

constexpr double tolerance = 1e-9;

Reference closed_form(Scene const& scene) {
  Reference reference;
  Vector3<double> const along = scene.velocity.normalized();
  for (int k = 1; k <= scene.samples; ++k)
    reference.displacement.push_back(scene.exact(k * scene.interval()) * along.replicate(1, scene.tissue.size()));
  reference.own_error = std::numeric_limits<double>::epsilon();
  reference.source = "closed form";
  return reference;
}

std::vector<Matrix3X<double>> tight(Scene const& scene, double relative, int steps_an_interval) {
  Path path = run(scene, DormandPrince{.relative = relative, .absolute = 1e-3 * relative}, steps_an_interval);
  if (!path.complete(scene)) throw Error("the reference of scene " + scene.name + " gave up");
  return std::move(path.displacement);
}

Reference integrated(Scene const& scene) {
  // A load that changes within an interval comes in stairs; more of them are closer to it.
  int const steps = scene.smooth_load ? 2000 : 1;
  Reference reference;
  reference.displacement = tight(scene, tolerance / 2, 2 * steps);
  reference.source = "DormandPrince, relative " + detail::message(tolerance / 2);
  return reference;
}

Matrix3X<double> rest_under_load(Scene const& scene) {
  SoftBody body(scene.tissue, LeapfrogVerlet{}, WholeBody{});
  body.apply_force(scene.touched, scene.share(scene.duration) * scene.force);
  body.solve_statics(NewtonRaphson<>{}, 1e-11);
  return body.positions() - scene.tissue.rest_positions();
}

}  // namespace

Reference reference_of(Scene const& scene) {
  Reference reference = scene.exact ? closed_form(scene) : integrated(scene);
  for (auto const& shape : reference.displacement) reference.largest = std::max(reference.largest, shape.colwise().norm().maxCoeff());
  if (!scene.exact) reference.own_error = reference.error_of(tight(scene, tolerance, scene.smooth_load ? 2000 : 1));
  if (scene.smooth_load) reference.balance = rest_under_load(scene);
  return reference;
}

}  // namespace work_precision
