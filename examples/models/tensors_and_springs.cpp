// SPDX-License-Identifier: MIT
// Other tissues of tetrahedra, a line each.
#include "problem.hpp"

#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/tensor_mass/corotated_tensor_mass.hpp>
#include <palpate/tissue/tensor_mass/tensor_mass.hpp>
#include <palpate/tissue/young_springs.hpp>

namespace models {

namespace {

template <class Tensors>
auto tensors(TetrahedralMesh<double> const& mesh) {
  return Tensors(mesh, {.density = density, .material = {.young = young, .poisson = poisson}, .damping = {.alpha = 20, .beta = 0.005}});
}
auto springs(Problem const& problem, TetrahedralMesh<double> const& mesh, YoungSprings formula) {
  MassSpring<double> tissue(mesh, {.mass = {.total = problem.mass}, .link = {.stiffness = 1, .damping = 0.02}});
  set_young(tissue, young, formula);
  return tissue;
}

}  // namespace

std::vector<Row> tensors_and_springs(Problem const& problem) {
  Headers const of_tensors{"tissue/tensor_mass/tensor_mass.hpp", "tissue/tensor_mass/tensor_assembly.hpp", "tissue/tensor_mass/tensor_rows.hpp"};
  Headers const of_springs{"tissue/mass_spring.hpp", "tissue/mass_spring_assembly.hpp", "tissue/mass_spring_layout.hpp", "tissue/mass_spring_particles.hpp",
                           "tissue/mass_spring_tangent.hpp", "tissue/mass_spring_solid.hpp", "tissue/young_springs.hpp"};
  auto const& mesh = problem.coarse;
  std::vector<Row> rows;
  rows.push_back(solid(problem, mesh, "tensor mass", of_tensors, [](auto const& of) { return tensors<TensorMass<double>>(of); }));
  rows.push_back(solid(problem, mesh, "tensor mass, corotated", {"tissue/tensor_mass"}, [](auto const& of) { return tensors<CorotatedTensorMass<double>>(of); }));
  auto const van_gelder = [&](auto const& of) { return springs(problem, of, YoungSprings::van_gelder); };
  rows.push_back(solid(problem, mesh, "springs, E by Van Gelder", of_springs, van_gelder));
  auto const lloyd = [&](auto const& of) { return springs(problem, of, YoungSprings::lloyd); };
  rows.push_back(solid(problem, mesh, "springs, E by Lloyd", of_springs, lloyd));
  return rows;
}

}  // namespace models
