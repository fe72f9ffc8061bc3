// SPDX-License-Identifier: MIT
// Springs: on tetrahedra, with stiffnesses from Young's modulus, and on the skin, fitted to the force that the finger should feel. A line each.
#include "problem.hpp"

#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/two_layers.hpp>
#include <palpate/tissue/young_springs.hpp>

namespace models {

namespace {

auto springs_of(TetrahedralMesh<double> const& mesh, double mass, YoungSprings formula) {
  MassSpring<double> tissue(mesh, {.mass = {.total = mass}, .link = {.stiffness = 1, .damping = 0.002}});
  set_young(tissue, young, formula);
  return tissue;
}
auto skin_springs(Problem const& problem, double scale) {
  MassSpring<double>::Options const options{.mass = {.total = problem.mass},
                                            .link = {.stiffness = 20 * scale, .damping = 0.01},
                                            .home = {.stiffness = 2 * scale, .damping = 0.01}};
  return problem.nailed(SoftBody(MassSpring<double>(problem.skin, options), BackwardEuler{}));
}

Row fitted_skin(Problem const& problem, double force, std::string const& name, Headers const& headers) {
  auto [scale, row] = fitted(force, [&](double s) { return surface(problem, name, headers, [&] { return skin_springs(problem, s); }); });
  row.stable_ms = leapfrog_ms(skin_springs(problem, scale));
  ProgressiveCutter<double> knife({.puncture_depth = 0.001});
  auto const advance = [&](auto& body, Vector const& at) {
    if (knife.state() == CuttingPhase::no_contact) knife.advance(body, Vector(at + Vector(0, 0, 0.01)));   // it comes from outside
    knife.advance(body, Vector(at - Vector(0, 0, 0.003)));
  };
  cut(problem, row, skin_springs(problem, scale), advance, [](auto const& body) { return static_cast<int>(body.triangles().cols()); });
  return row;
}

}  // namespace

std::vector<Row> springs(Problem const& problem, double force) {
  Headers const of_all{"tissue/mass_spring.hpp", "tissue/mass_spring_assembly.hpp", "tissue/mass_spring_layout.hpp", "tissue/mass_spring_particles.hpp",
                       "tissue/mass_spring_tangent.hpp"};
  auto const headers = [&](std::string const& more) {
    Headers all = of_all;
    all.push_back(more);
    return all;
  };
  auto const van_gelder = [&](auto const& of) { return springs_of(of, problem.mass, YoungSprings::van_gelder); };
  auto const lloyd = [&](auto const& of) { return springs_of(of, problem.mass, YoungSprings::lloyd); };
  // As stiff as the first on the mean; inside they pull with no more than 3 mm of that, and lock.
  auto const layers = [&](auto const& of) {
    auto const even = van_gelder(of);
    double k = 0;
    for (int link = 0; link < even.links().size(); ++link) k += even.links()[link].law.stiffness / even.links().size();
    return two_layers(of, LinearSpring<double>{.stiffness = k, .damping = 0.002}, LockingSpring<double>{.stiffness = k, .largest_tension = 0.003 * k, .damping = 0.002},
                      {.mass = {.total = problem.mass}});
  };
  std::vector<Row> rows;
  rows.push_back(solid(problem, problem.coarse, "springs, E by Van Gelder", headers("tissue/mass_spring_solid.hpp"), van_gelder));
  rows.push_back(solid(problem, problem.coarse, "springs, E by Lloyd", headers("tissue/mass_spring_solid.hpp"), lloyd));
  rows.push_back(solid(problem, problem.coarse, "springs in two layers", headers("tissue/two_layers.hpp"), layers));
  rows.push_back(fitted_skin(problem, force, "springs on the skin, fitted", headers("tissue/mass_spring_surface.hpp")));
  return rows;
}

}  // namespace models
