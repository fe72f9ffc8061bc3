// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/body_view.hpp>
#include <palpate/body/particle_order.hpp>
#include <palpate/core/error.hpp>
#include <palpate/statics/concept.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string_view>
#include <vector>

namespace palpate {

/// Asks a solver where the free particles of a body come to rest under gravity and what is held, and `with_forces` also under the forces
/// applied. `x` is where the search starts and ends [m].
/// `tolerance` in mean edges; 0: 1e-8, and at most a ten-thousandth of what the loads alone would be (a solid near ν = ½ resists volume so much that small
/// loads look balanced before it bends), but not below what the digits allow at a distance `offset` [m] from the origin.
template <TissueModel Tissue, class Solver>
Equilibrium<typename Tissue::Scalar> find_balance(Solver const& solver, BodyView<Tissue> const& body, detail::ParticleOrder const& order,
                                                  typename Tissue::Scalar tolerance, typename Tissue::Scalar mean_edge, typename Tissue::Scalar offset, bool with_forces,
                                                  Matrix3X<typename Tissue::Scalar>& x) {
  using Scalar = typename Tissue::Scalar;
  detail::require_non_negative("the tolerance", tolerance, "mean edges");
  bool const is_given = tolerance > 0;
  std::vector<int> free, touched;
  auto const touch = [&](std::span<int const> particles) {
    for (int const i : particles)
      if (i < body.size()) touched.push_back(i);   // an edit since the last step may have taken it away
  };
  touch(body.held);
  for (int i = 0; i < body.size(); ++i)
    if (body.is_free(i)) free.push_back(i);
  order.sort(free);
  StaticProblem<Tissue> problem{body.tissue, free, body.gravity, Matrix3X<Scalar>(3, 0), (is_given ? tolerance : Scalar(1e-8)) * mean_edge, {}};
  if (with_forces) {
    problem.applied = body.state.applied.view();
    touch(body.forced);
  }
  problem.touched = touched;
  if (!is_given) {
    Scalar most = 0;
    for (int const i : free)
      if (Scalar const stiffness = body.tissue.stiffness_bound(i); stiffness > 0) most = std::max(most, problem.load(i).norm() / stiffness);
    if (most > 0) problem.tolerance = std::min(problem.tolerance, Scalar(1e-4) * most);
    problem.tolerance = std::max(problem.tolerance, 2 * std::numeric_limits<Scalar>::epsilon() * offset);
  }
  return solver.solve(problem, x);
}

/// Throws Error unless balance was found.
template <RealScalar Scalar>
void require_balance(Equilibrium<Scalar> const& found, Scalar mean_edge, std::string_view what, std::string_view remedy) {
  if (found.converged) return;
  throw Error(detail::message(what, ": the largest imbalance is ", found.imbalance / mean_edge, " of a mean edge after ", found.iterations,
                              " iterations; ", remedy));
}

}  // namespace palpate
