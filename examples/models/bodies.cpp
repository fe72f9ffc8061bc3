// SPDX-License-Identifier: MIT
// Bodies of their own, a line each: made of the problem's skin, and at rest after each step.
#include "problem.hpp"

#include <palpate/cutting/cube_cutter.hpp>
#include <palpate/tissue/cubes/cubes.hpp>
#include <palpate/tissue/long_elements/long_elements.hpp>
#include <palpate/tissue/vertex_rings/vertex_rings.hpp>

#include <array>
#include <cstddef>

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
  auto const make_body = [&] { return problem.nailed(Cubes<double>(problem.skin, options)); };
  Row row = press(problem, std::move(name), {"tissue/cubes", "tissue/skin_body.hpp", "cutting/cube_cutter.hpp"}, make_body, [&](auto const& body) { return skin_on(body, problem.skin.points); });
  CubeCutter<double> knife({.edge = {{0, 0, 0}, {0, 0, 0.02}}});
  auto const advance = [&](auto& body, Vector const& at) {
    if (knife.state() == CuttingPhase::no_contact) knife.advance(body, Vector(at + Vector(0, 0, 0.01)));   // it comes from outside
    knife.advance(body, Vector(at - Vector(0, 0, 0.01)));
  };
  cut(problem, row, make_body(), advance, [](auto const& body) { return body.opened_faces(); });
  return row;
}

}  // namespace

std::vector<Row> bodies(Problem const& problem, double force) {
  auto const& skin = problem.skin;
  LongElementsOptions<double> const columns{.spacing = 0.005, .young = young, .density = density, .return_time = 0.02};
  auto const long_elements = [&] { return problem.nailed(LongElements<double>(skin, columns)); };
  auto const rings = [&](double scale) {
    VertexRingsOptions<double> const slopes{.slopes = {-0.02 / scale, -0.012 / scale, -0.006 / scale}, .return_time = 0.02};
    auto const make = [&] { return problem.nailed(VertexRings<double>(skin, slopes)); };
    return surface(problem, "vertex rings, fitted", {"tissue/vertex_rings", "tissue/skin_body.hpp"}, make);
  };
  std::vector<Row> rows;
  rows.push_back(surface(problem, "long elements", {"tissue/long_elements", "tissue/skin_body.hpp"}, long_elements));
  rows.push_back(cubes(problem, "cubes", {.edge = 0.006, .young = young, .density = density}));
  rows.push_back(cubes(problem, "cubes, split once", {.edge = 0.006, .young = young, .density = density, .levels = 1}));
  rows.push_back(fitted(force, rings).second);
  return rows;
}

}  // namespace models
