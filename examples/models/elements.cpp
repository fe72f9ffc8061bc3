// SPDX-License-Identifier: MIT
// Finite elements: the material says which.
#include "problem.hpp"

#include <palpate/material/corotational.hpp>
#include <palpate/material/st_venant_kirchhoff.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/tissue/finite_elements.hpp>

namespace models {

namespace {

template <class Material>
Row elements_of(Problem const& problem, TetrahedralMesh<double> const& mesh, std::string name, std::string const& header, bool is_reference = false) {
  Headers const headers{"tissue/finite_elements.hpp", "tissue/solid_assembly.hpp", "tissue/tetrahedron_packs.hpp", "material/" + header};
  auto const make = [](auto const& of) {
    return FiniteElements<double, Material>(of, {.density = density, .material = {.young = young, .poisson = poisson}, .damping = {.alpha = 20, .beta = 0.005}});
  };
  return solid(problem, mesh, std::move(name), headers, make, is_reference);
}

}  // namespace

Row neo_hooke(Problem const& problem, TetrahedralMesh<double> const& mesh, std::string name, bool is_reference) {
  return elements_of<StableNeoHookean<double>>(problem, mesh, std::move(name), "stable_neo_hookean.hpp", is_reference);
}

std::vector<Row> elements(Problem const& problem) {
  std::vector<Row> rows;
  rows.push_back(neo_hooke(problem, filled(problem, middle_edge), "stable neo-Hooke, finer", false));
  rows.push_back(neo_hooke(problem, problem.coarse, "stable neo-Hooke", false));
  rows.push_back(elements_of<StVenantKirchhoff<double>>(problem, problem.coarse, "St. Venant-Kirchhoff", "st_venant_kirchhoff.hpp"));
  rows.push_back(elements_of<Corotational<double>>(problem, problem.coarse, "corotational", "corotational.hpp"));
  return rows;
}

}  // namespace models
