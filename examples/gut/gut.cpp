// SPDX-License-Identifier: MIT
// A loop of gut, 16 mm thick, is let go over a table. It falls, folds on itself, and comes to rest.
//   at rest   the table bears its weight; part of that goes through the place where it lies on itself
#include "../album.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/repair.hpp>
#include <palpate/scene.hpp>
#include <palpate/tissue/finite_elements.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <utility>

namespace {

using namespace palpate;
using Vector = Vector3<double>;
using Mesh = TriangleMesh<double>;

constexpr double g = 9.81, pi = std::numbers::pi;                   // m/s²
constexpr double thick = 0.016, step = 4e-3, end = 2.0;             // m, s
constexpr double stiff = 5e3, deep = 4e-3;                          // Pa, m: less than 2 E/edge, so that it comes to rest
constexpr int across = 3, along = 60;                               // cells

/// Its middle line, an eight that rises; s from 0 to 1.
Vector middle_line(double s) {
  double const turn = pi * (1.6 * s - 0.3);
  return {0.050 * std::sin(turn), 0.030 * std::sin(2 * turn), 0.012 + 0.120 * s};
}
TetrahedralMesh<double> loop() {
  auto mesh = make_block<double>(along + 1, across + 1, across + 1, 1.0, BlockPattern::alternating);
  for (auto p : mesh.points.colwise()) {
    double const s = p.x() / along;
    Vector const ahead = (middle_line(s + 1e-4) - middle_line(s - 1e-4)).normalized();
    Vector const up = (Vector::UnitZ() - ahead.z() * ahead).normalized(), side = up.cross(ahead);
    Eigen::Vector2d out(2 * p.y() / across - 1, 2 * p.z() / across - 1);   // a square, bent to a circle
    out *= out.cwiseAbs().maxCoeff() / out.norm();
    p = middle_line(s) + thick / 2 * (out.x() * side + out.y() * up);
  }
  return mesh;
}
Mesh table(double side, double high) {
  auto slab = make_block<double>(2, 2, 2, 1.0, BlockPattern::alternating);
  for (auto p : slab.points.colwise()) p = Vector(side * (p.x() - 0.5), side * (p.y() - 0.5), high * (p.z() - 1));
  auto skin = surface(slab);
  repair(skin);
  return skin;
}

drawing::Album example() {
  SoftBody gut(FiniteElements<double, StableNeoHookean<double>>(
                   loop(), {.density = 1000.0, .material = {.young = 5e3, .poisson = 0.3}, .damping = {.alpha = 4.0, .beta = 2e-3}}),
               BackwardEuler{});
  gut.set_gravity({0, 0, -g});
  double const weight = gut.total_mass() * g;
  std::printf("a loop of %td tetrahedra that weighs %.4f N\n\n", loop().tetrahedra.cols(), weight);

  Scene scene(std::move(gut), Obstacle<double>(table(0.4, 0.1)));
  scene.touch<0, 1>({.pressure = stiff, .depth = deep, .friction = 0.2});
  scene.touch<0, 0>({.pressure = stiff, .depth = deep, .friction = 0.2});

  drawing::Picture chart("gut_forces", "A loop of gut falls on a table, and on itself", "time [s]", "force [N]");
  auto &on_table = chart.line(drawing::orange, "table"), &on_itself = chart.line(drawing::blue, "where it lies on itself");
  auto& all = chart.dashes(drawing::black, "weight");
  drawing::Album album;
  auto const draw = [&](char const* name) {
    album.views.push_back({.name = name,
                           .mesh = scene.body<0>().mesh(),
                           .from = Vector(0.5, -1.0, 0.75).normalized(),
                           .colour = {0.80, 0.48, 0.42},
                           .parts = {{table(0.14, 0.004), {0.50, 0.56, 0.60}}}});
  };
  std::printf("%8s %10s %12s %10s %10s %14s\n", "time [s]", "top [mm]", "moves [uJ]", "table [N]", "itself [N]", "in itself [mm3]");
  int const ticks = static_cast<int>(std::lround(end / step));
  for (int tick = 0; tick <= ticks; ++tick) {
    double const t = tick * step;
    auto const& body = scene.body<0>();
    auto const& own = scene.contact<0, 0>();
    double itself = 0;
    for (auto const& region : own.regions()) itself += std::abs(region.force().z());
    double const borne = scene.contact<0, 1>().force().z();
    drawing::add(on_table, t, std::min(borne, 3 * weight)), drawing::add(on_itself, t, itself), drawing::add(all, t, weight);
    if (tick == 0) draw("gut_before");
    if (tick == 22) draw("gut_falls");
    if (tick % 50 == 0)
      std::printf("%8.1f %10.2f %12.2f %10.4f %10.4f %14.2f\n", t, 1e3 * body.positions().row(2).maxCoeff(), 1e6 * body.kinetic_energy(), borne, itself,
                  1e9 * own.intersection().volume());
    scene.advance(step);
  }
  draw("gut_rests");
  auto const& own = scene.contact<0, 0>();
  double deepest = 0;
  for (auto const& region : own.regions()) deepest = std::max(deepest, region.volume / region.area);
  std::printf("\nit lies %.3f mm in itself, in %zu place%s\n", 1e3 * deepest, own.regions().size(), own.regions().size() == 1 ? "" : "s");
  album.charts.push_back(std::move(chart));
  return album;
}

}  // namespace

int main(int argc, char** argv) { return drawing::run_example("gut", argc, argv, example); }
