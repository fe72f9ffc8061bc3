// SPDX-License-Identifier: MIT
// Finite elements, a line each: the material says which.
#include "problem.hpp"

#include <palpate/material/corotational.hpp>
#include <palpate/material/st_venant_kirchhoff.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/tissue/finite_elements.hpp>

namespace models {

namespace {

template <class Material>
auto elements_of(TetrahedralMesh<double> const& mesh) {
  return FiniteElements<double, Material>(mesh, {.density = density, .material = {.young = young, .poisson = poisson}, .damping = {.alpha = drag}});
}
auto neo_hooke(TetrahedralMesh<double> const& mesh) { return elements_of<StableNeoHookean<double>>(mesh); }

}  // namespace

Row finest(Problem const& problem) { return solid(problem, filled(problem, finest_edge), "reference", {}, neo_hooke, true); }

std::vector<Row> elements(Problem const& problem) {
  auto const headers = [](std::string const& law) {
    return Headers{"tissue/finite_elements.hpp", "tissue/solid_assembly.hpp", "tissue/tetrahedron_packs.hpp", "material/" + law + ".hpp"};
  };
  auto const st_venant_kirchhoff = [](auto const& of) { return elements_of<StVenantKirchhoff<double>>(of); };
  auto const corotational = [](auto const& of) { return elements_of<Corotational<double>>(of); };
  std::vector<Row> rows;
  rows.push_back(solid(problem, filled(problem, fine_edge), "stable neo-Hooke, fine", headers("stable_neo_hookean"), neo_hooke));
  rows.push_back(solid(problem, filled(problem, middle_edge), "stable neo-Hooke, middle", headers("stable_neo_hookean"), neo_hooke));
  rows.push_back(solid(problem, problem.coarse, "stable neo-Hooke", headers("stable_neo_hookean"), neo_hooke));
  rows.push_back(solid(problem, problem.coarse, "St. Venant-Kirchhoff", headers("st_venant_kirchhoff"), st_venant_kirchhoff));
  rows.push_back(solid(problem, problem.coarse, "corotational", headers("corotational"), corotational));
  return rows;
}

}  // namespace models
