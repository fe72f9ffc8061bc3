// SPDX-License-Identifier: MIT
// Every model of tissue on one problem: a fingertip of 8 mm presses a liver of 5 kPa by 6 mm, and a blade goes across it. Displacements of the skin and the
// force are compared with stable neo-Hooke on a mesh four times as fine. A model is a line in `rows`.
//   models [FOLDER]
#include "../album.hpp"
#include "problem.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/material/corotational.hpp>
#include <palpate/material/linear_elastic.hpp>
#include <palpate/material/st_venant_kirchhoff.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/models.hpp>
#include <palpate/tissue/finite_elements.hpp>

#include <cstdio>
#include <string>
#include <vector>

namespace {

using namespace models;

template <class Material>
auto elements(TetrahedralMesh<double> const& mesh) {
  return FiniteElements<double, Material>(mesh, {.density = density, .material = {.young = young, .poisson = poisson}, .damping = {.alpha = 10, .beta = 0.005}});
}
template <class Tensors>
auto tensors(TetrahedralMesh<double> const& mesh) {
  return Tensors(mesh, {.density = density, .material = {.young = young, .poisson = poisson}, .damping = {.alpha = 10, .beta = 0.005}});
}
auto springs_of_tetrahedra(Problem const& problem, TetrahedralMesh<double> const& mesh, YoungSprings formula) {
  MassSpring<double> tissue(mesh, {.mass = {.total = problem.mass}, .link = {.stiffness = 1, .damping = 0.2}});
  set_young(tissue, young, formula);
  return tissue;
}
auto springs_of_skin(Problem const& problem, double scale) {
  MassSpring<double> tissue(problem.skin, {.mass = {.total = problem.mass}, .link = {.stiffness = 20 * scale, .damping = 0.2}, .home = {.stiffness = 8 * scale, .damping = 0.2}});
  for (int i = 0; i < tissue.size(); ++i)
    if (problem.is_nailed(problem.skin.points.col(i))) tissue.nail(i);
  return SoftBody(std::move(tissue), BackwardEuler{});
}
auto nailed(Problem const& problem, auto body) {
  for (int i = 0; i < body.size(); ++i)
    if (problem.is_nailed(problem.skin.points.col(i))) body.nail(i);
  return body;
}

Row skin_springs_row(Problem const& problem, double force) {
  double stiffness = 1;
  Row row = fitted(force, [&](double scale) {
    stiffness = scale;
    return skin_row(problem, "springs on the skin (fitted)", {"tissue/mass_spring.hpp", "tissue/mass_spring_surface.hpp"}, [&] { return springs_of_skin(problem, scale); });
  });
  row.stable_ms = 1e3 * leapfrog_step(springs_of_skin(problem, stiffness));
  ProgressiveCutter<double> knife;
  cut(problem, row, springs_of_skin(problem, stiffness), [&](auto& body, Vector const& at) { knife.advance(body, Vector(at - Vector(0, 0, 0.003))); },
      [](auto const& body) { return static_cast<int>(body.triangles().cols()); });
  return row;
}

std::vector<Row> rows(Problem const& problem, Row const& reference) {
  std::string const fem = "tissue/finite_elements.hpp", assembly = "tissue/solid_assembly.hpp", packs = "tissue/tetrahedron_packs.hpp";
  std::vector<Row> all;
  auto const solid = [&](std::string name, std::vector<std::string> const& headers, auto const& make) { all.push_back(solid_row(problem, problem.coarse, std::move(name), headers, true, make)); };
  solid("stable neo-Hooke", {fem, assembly, packs, "material/stable_neo_hookean.hpp"}, [](auto const& mesh) { return elements<StableNeoHookean<double>>(mesh); });
  solid("St. Venant-Kirchhoff", {fem, assembly, packs, "material/st_venant_kirchhoff.hpp"}, [](auto const& mesh) { return elements<StVenantKirchhoff<double>>(mesh); });
  solid("corotational", {fem, assembly, packs, "material/corotational.hpp"}, [](auto const& mesh) { return elements<Corotational<double>>(mesh); });
  solid("linear", {fem, assembly, packs, "material/linear_elastic.hpp"}, [](auto const& mesh) { return elements<LinearElastic<double>>(mesh); });
  solid("tensor mass", {"tissue/tensor_mass/tensor_mass.hpp", "tissue/tensor_mass/tensor_assembly.hpp", "tissue/tensor_mass/tensor_rows.hpp"}, [](auto const& mesh) { return tensors<TensorMass<double>>(mesh); });
  solid("tensor mass, corotated", {"tissue/tensor_mass"}, [](auto const& mesh) { return tensors<CorotatedTensorMass<double>>(mesh); });
  solid("springs, Van Gelder", {"tissue/mass_spring.hpp", "tissue/mass_spring_solid.hpp", "tissue/young_springs.hpp"}, [&](auto const& mesh) { return springs_of_tetrahedra(problem, mesh, YoungSprings::van_gelder); });
  solid("springs, Lloyd", {"tissue/mass_spring.hpp", "tissue/mass_spring_solid.hpp", "tissue/young_springs.hpp"}, [&](auto const& mesh) { return springs_of_tetrahedra(problem, mesh, YoungSprings::lloyd); });
  all.push_back(skin_row(problem, "long elements", {"tissue/long_elements", "body/skin_body.hpp"}, [&] { return nailed(problem, LongElements<double>(problem.skin, {.spacing = 0.01, .young = young, .density = density, .return_time = 0.02})); }));
  all.push_back(skin_springs_row(problem, reference.force));
  all.push_back(fitted(reference.force, [&](double scale) {
    return skin_row(problem, "vertex rings (fitted)", {"tissue/vertex_rings", "body/skin_body.hpp"}, [&] { return nailed(problem, VertexRings<double>(problem.skin, {.slopes = {-0.02 / scale, -0.012 / scale, -0.006 / scale}, .return_time = 0.02})); });
  }));
  return all;
}

drawing::Album models_example() {
  using namespace drawing;
  Problem const problem;
  Row const reference = solid_row(problem, problem.fine, "reference", {}, false, [](auto const& mesh) { return elements<StableNeoHookean<double>>(mesh); });
  std::printf("a liver of %.0f cm3, %td tetrahedra and a skin of %td vertices; reference of %td tetrahedra: %.3f N, %.2f %% of the volume lost, %.1f ms a tick\n\n",
              1e6 * volume(problem.skin), problem.coarse.tetrahedra.cols(), problem.skin.points.cols(), problem.fine.tetrahedra.cols(), reference.force, 100 * reference.volume_lost, reference.tick_ms);
  std::printf("%-30s %8s %8s %8s %8s %8s %8s %9s %8s %7s %7s\n", "model", "off [%]", "most mm", "force N", "off [%]", "vol. [%]", "tick ms", "stable ms", "cut us", "made", "lines");
  Album album;
  Picture chart("models_error", "Error under a finger over the cost of a tick", "processor time of a tick [ms]", "displacement of the skin, off by [%]");
  auto const view = [&](Row const& row, std::string const& name) { album.views.push_back({.name = "models_" + name, .mesh = row.pressed, .from = Vector(0.25, -1.0, 0.45)}); };
  view(reference, "0_reference");
  int k = 0;
  for (Row const& row : rows(problem, reference)) {
    Distance const off = distance(problem, row, reference);
    std::printf("%-30s %8.1f %8.2f %8.3f %8.1f %8.2f %8.3f %9.3f %8.0f %7d %7d\n", row.name.c_str(), 100 * off.relative, 1e3 * off.largest, row.force, 100 * (row.force / reference.force - 1),
                100 * row.volume_lost, row.tick_ms, row.stable_ms, row.cut_us, row.made, row.lines);
    add(chart.dots(k % 2 == 0 ? blue : orange, row.name), row.tick_ms, 100 * off.relative);
    view(row, std::to_string(++k));
  }
  album.charts = {chart};
  return album;
}

}  // namespace

int main(int argc, char** argv) { return drawing::run_example("models", argc, argv, models_example); }
