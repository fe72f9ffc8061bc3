// SPDX-License-Identifier: MIT
// Bodies that are made of the skin: two that fill it their own way, and two that know the force only that they are fitted to.
#include "problem.hpp"

#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/tissue/cubes/cubes.hpp>
#include <palpate/tissue/long_elements/long_elements.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/vertex_rings/vertex_rings.hpp>

#include <array>
#include <optional>

namespace models {

namespace {

/// The problem's skin as cubes carry it: each vertex by the corners of the nearest cube, by trilinear weights.
Matrix3X<double> skin_on(Cubes<double> const& body, Matrix3X<double> skin) {
  double const edge = body.options().edge;
  Matrix3X<double> middles(3, body.cubes());
  for (int c = 0; c < body.cubes(); ++c) middles.col(c) = (body.reference_position(body.corners(c)[0]) + body.reference_position(body.corners(c)[7])) / 2;
  for (Eigen::Index i = 0; i < skin.cols(); ++i) {
    Eigen::Index nearest = 0;
    (middles.colwise() - skin.col(i)).cwiseAbs().colwise().maxCoeff().minCoeff(&nearest);
    Vector const at = (skin.col(i) - middles.col(nearest)) / edge + Vector::Constant(0.5);
    Vector way = Vector::Zero();
    for (int k = 0; k < 8; ++k) {
      Vector const share((k & 1) != 0 ? at[0] : 1 - at[0], (k & 2) != 0 ? at[1] : 1 - at[1], (k & 4) != 0 ? at[2] : 1 - at[2]);
      way += share.prod() * body.displacement(body.corners(static_cast<int>(nearest))[static_cast<std::size_t>(k)]);
    }
    skin.col(i) += way;
  }
  return skin;
}

Row cubes(Problem const& problem, std::string name, CubesOptions<double> const& options) {
  auto const make_body = [&] {
    Cubes<double> body(problem.skin, options);
    for (int i = 0; i < body.size(); ++i)
      if (problem.is_nailed(body.reference_position(i))) body.nail(i);
    return body;
  };
  Row row = press(problem, std::move(name), {"tissue/cubes"}, make_body, [&](auto const& body) { return skin_on(body, problem.skin.points); });
  std::optional<Vector> last;
  Vector const deep(0, 0, -0.01), high(0, 0, 0.01);
  auto const advance = [&](auto& body, Vector const& at) {
    if (last) body.cut(*last + deep, *last + high, at + deep, at + high);
    last = at;
  };
  cut(problem, row, make_body(), advance, [](auto const& body) { return body.opened_faces(); });
  return row;
}

auto skin_springs(Problem const& problem, double scale) {
  MassSpring<double> tissue(problem.skin, {.mass = {.total = problem.mass},
                                           .link = {.stiffness = 20 * scale, .damping = 0.05},
                                           .home = {.stiffness = 2 * scale, .damping = 0.05}});
  return problem.nailed(SoftBody(std::move(tissue), BackwardEuler{}));
}

}  // namespace

std::vector<Row> bodies_of_their_own(Problem const& problem) {
  LongElementsOptions<double> const columns{.spacing = 0.005, .young = young, .density = density, .return_time = 0.02};
  std::vector<Row> rows;
  rows.push_back(surface_row(problem, "long elements", {"tissue/long_elements", "tissue/skin_body.hpp"}, [&] { return problem.nailed(LongElements<double>(problem.skin, columns)); }));
  rows.push_back(cubes(problem, "cubes", {.edge = 0.005, .young = young, .density = density}));
  rows.push_back(cubes(problem, "cubes, split once", {.edge = 0.005, .young = young, .density = density, .levels = 1}));
  return rows;
}

std::vector<Row> fitted_surfaces(Problem const& problem, double force) {
  Headers const of_springs{"tissue/mass_spring.hpp", "tissue/mass_spring_assembly.hpp", "tissue/mass_spring_layout.hpp", "tissue/mass_spring_particles.hpp",
                           "tissue/mass_spring_tangent.hpp", "tissue/mass_spring_surface.hpp"};
  auto [scale, springs] = fitted(force, [&](double s) { return surface_row(problem, "springs on the skin, fitted", of_springs, [&] { return skin_springs(problem, s); }); });
  springs.stable_ms = leapfrog_ms(skin_springs(problem, scale));
  ProgressiveCutter<double> knife({.puncture_depth = 0.001});
  cut(problem, springs, skin_springs(problem, scale), [&](auto& body, Vector const& at) { knife.advance(body, Vector(at - Vector(0, 0, 0.003))); },
      [](auto const& body) { return static_cast<int>(body.triangles().cols()); });
  auto const slopes = [](double s) { return VertexRingsOptions<double>{.slopes = {-0.02 / s, -0.012 / s, -0.006 / s}, .return_time = 0.02}; };
  auto const rings = fitted(force, [&](double s) {
    return surface_row(problem, "vertex rings, fitted", {"tissue/vertex_rings", "tissue/skin_body.hpp"}, [&] { return problem.nailed(VertexRings<double>(problem.skin, slopes(s))); });
  });
  return {springs, rings.second};
}

}  // namespace models
