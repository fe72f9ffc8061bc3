// SPDX-License-Identifier: MIT
// A liver of cubes that share vertices: the touched cube is split and joined again, a blade opens the faces between cubes on its two sides,
// pre-tension lets the wound gape.
//   bar      strain = stress/E, across it −1/4 of that
//   order    which order of a relaxation brings a touched block to rest with fewer visits
#include "../album.hpp"

#include <palpate/cutting/no_cutter.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/organ.hpp>
#include <palpate/mesh/repair.hpp>
#include <palpate/models.hpp>
#include <palpate/simulator/body_loop.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <tuple>
#include <utility>

namespace {

using namespace palpate;
using Vector = Vector3<double>;
constexpr double young = 5000.0;   // Pa

Cubes<double> block(int nx, int ny, int nz, CubesOptions<double> options) {
  auto skin = surface(make_block<double>(nx + 1, ny + 1, nz + 1, 0.01, BlockPattern::alternating));
  repair(skin);
  options.edge = 0.01, options.young = young;
  return Cubes<double>(skin, options);
}
void nail_below(Cubes<double>& body, double height) {
  double const low = body.rest_mesh().points.row(2).minCoeff();
  for (int i = 0; i < body.size(); ++i)
    if (body.reference_position(i)[2] < low + height) body.nail(i);
}

void bar() {
  auto body = block(2, 2, 4, {.levels = 1});
  body.split(6);
  double const strain = 1e-5, quarter = strain * young * 1e-4 / 4;   // N: of a face's force
  for (int c = 0; c < body.cubes(); ++c)
    for (int const v : body.corners(c)) {
      double const z = body.reference_position(v)[2];
      if ((c < 4 && z < 1e-6) || (c >= body.cubes() - 4 && z > 0.0399)) body.apply_force(v, {0, 0, z < 1e-6 ? -quarter : quarter});
    }
  body.solve_statics(1e-14);
  int const corner = body.nearest_vertex({0, 0, 0});
  auto const strain_to = [&](Vector const& far) {   // of the line to another corner, however the bar has turned
    int const other = body.nearest_vertex(far);
    return (body.positions().col(other) - body.positions().col(corner)).norm() / far.norm() - 1;
  };
  double const longer = strain_to({0, 0, 0.04}), thinner = -strain_to({0.02, 0, 0});
  std::printf("a bar, one cube split: Young's modulus %.1f of %.1f Pa, Poisson's ratio %.3f\n", young * strain / longer, young, thinner / longer);
}

drawing::Album cubes_example() {
  using namespace drawing;
  Album album;
  bar();

  Picture orders("cubes_orders", "A touched block of 12 x 12 x 6 cubes comes to rest", "visits of vertices, thousands",
                 "largest error, % of the touched vertex's way");
  for (auto const& [order, colour, name] : {std::tuple{VisitOrder::breadth_first, blue, "breadth first from the touch"},
                                            {VisitOrder::index, orange, "as numbered"},
                                            {VisitOrder::random, green, "random"}}) {
    auto body = block(12, 12, 6, {.order = order, .sweeps = 1});
    nail_below(body, 1e-6);
    int const touched = body.nearest_vertex({0.06, 0.06, 1});
    auto rest = body;
    rest.apply_force(touched, {0, 0, -0.2});
    rest.solve_statics(1e-10);
    auto& line = orders.line(colour, name);
    double visits = 0, error = 100, needed = 0;
    while (needed == 0) {
      if (visits < 12e3) add(line, visits / 1e3, error);
      body.apply_force(touched, {0, 0, -0.2});
      visits += body.step(1e-3).visits;
      error = 100 * (body.positions() - rest.positions()).colwise().norm().maxCoeff() / rest.displacement(touched).norm();
      if (error < 1) needed = visits;
    }
    std::printf("%-30s %6.0f visits to 1 %%\n", name, needed);
  }

  auto const skin = make_organ<double>({.vertices = 4000});
  Cubes<double> liver(skin, {.edge = 0.008, .young = young, .pretension = 0.06, .levels = 2, .join_after = 50});
  nail_below(liver, 0.02);
  std::printf("liver: %d cubes, %d vertices, %.3f of the volume in the surface\n", liver.cubes(), liver.size(), liver.volume() / volume(skin));
  for (int k = 0; k < 300; ++k) liver.step(1e-3);
  Vector top = Vector::Zero();   // the middle of a triangle
  for (int const v : liver.tissue().surface().corners(liver.nearest_point({0.0, 0.0, 1.0}).triangle)) top += liver.positions().col(v) / 3;
  BodyLoop loop(std::move(liver), NoCutter<double>(), ContactCoupling{}, 100);
  Vector force = Vector::Zero();
  for (int k = 0; k < 600; ++k) force = loop.tick({Vector(top + Vector(0, 0, 0.002 - 0.005 * std::min(1.0, k / 300.0)))}, 1e-3).tissue_force;
  std::printf("pressed: %d cubes instead of %d, force on the hand %.3f N\n", loop.body().leaves(), loop.body().cubes(), force.norm());
  album.views.push_back({.name = "cubes_pressed", .mesh = loop.body().mesh(), .from = Vector(0.25, -1.0, 0.9), .has_facets = true});
  for (int k = 0; k < 200; ++k) loop.tick({Vector(top + Vector(0, 0, 0.05))}, 1e-3);
  std::printf("left: %d cubes\n", loop.body().leaves());

  auto& body = loop.body();
  int opened = 0;
  for (int k = 0; k < 60; ++k) {   // from one side to the other, as deep as 40 mm
    double const y = top[1] - 0.06 + 0.002 * k, x = top[0] + 0.0005;
    opened += body.cut({x, y, top[2] - 0.04}, {x, y, 1}, {x, y + 0.002, top[2] - 0.04}, {x, y + 0.002, 1});
    body.step(1e-3);
  }
  body.solve_statics(1e-6);
  double gap = 0;   // between what was one vertex
  for (int i = 0; i < body.size(); ++i)
    for (int j = 0; j < i; ++j)
      if (body.reference_position(i) == body.reference_position(j)) gap = std::max(gap, (body.positions().col(i) - body.positions().col(j)).norm());
  std::printf("cut: %d faces opened, the wound gapes %.2f mm\n", opened, 1e3 * gap);
  album.views.push_back({.name = "cubes_cut", .mesh = body.mesh(), .from = Vector(0.1, -0.8, 1.2), .has_facets = true});
  album.charts = {orders};
  return album;
}

}  // namespace

int main(int argc, char** argv) { return drawing::run_example("cubes", argc, argv, cubes_example); }
