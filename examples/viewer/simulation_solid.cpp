// SPDX-License-Identifier: MIT
#include "simulation_of.hpp"
#include "solid_blade.hpp"

#include <palpate/integrator/backward_euler.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/repair.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/volume/fill.hpp>

namespace viewer {

std::shared_ptr<Simulation> make_solid(Setup const& setup, Mesh const& organ, Targets const& targets) {
  constexpr double cells_across = 18.0, body_rate = 250.0;   // Hz: a step of so many tetrahedra takes some 2 ms
  double const diagonal = palpate::bounding_box(organ).diagonal().norm();
  auto const filling = palpate::fill(organ, {.edge = diagonal / cells_across});
  palpate::FiniteElements<double, palpate::StableNeoHookean<double>> tissue(filling.mesh,
                                                                            {.density = 1060.0, .material = {5000.0, 0.45}, .damping = {.alpha = 30.0}, .prestrain = 0.1});
  Mesh const border = palpate::surface(filling.mesh);
  auto const normals = palpate::vertex_normals(border);
  for (int i = 0; i < normals.cols(); ++i)   // its sides hang on to what is around it, so that a wound gapes
    if (normals.col(i).norm() > 0.5 && normals(2, i) < 0.4) tissue.nail(i);
  palpate::SoftBody body(std::move(tissue), palpate::BackwardEuler{.tolerance = 1e-3, .max_iterations = 25});
  Mesh home = body.mesh();   // it has settled under its pre-strain
  palpate::repair(home);     // without the vertices inside
  Setup own = setup;
  if (own.blade == Blade::separating) own.blade = Blade::progressive;
  own.integrator = IntegratorName::backward_euler;
  palpate::SimulatorOptions options;
  options.body_rate = body_rate;
  return std::make_shared<SimulationOf<decltype(body), SolidBlade>>(own, std::move(body), targets, std::move(home), options);
}

}  // namespace viewer
