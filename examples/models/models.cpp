// SPDX-License-Identifier: MIT
// Every model of tissue on one problem: a thumb of 12 mm presses a liver of 5 kPa by 4 mm, and a blade goes across it. Displacements of the skin and the
// force are compared with stable neo-Hooke on finer tetrahedra. A model is a line in elements.cpp, tensors.cpp, springs.cpp or bodies.cpp:
//   rows.push_back(solid(problem, mesh, "mine", {"tissue/mine.hpp"}, [](auto const& of) { return Mine<double>(of, {...}); }));
//   models [FOLDER]
#include "../album.hpp"
#include "problem.hpp"

#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/sphere.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace models;

/// What is left of a surface where n·x > d. With a `floor` the section is filled between that height and the cut; it looks along −n.
TriangleMesh<double> clipped(TriangleMesh<double> const& mesh, Vector const& n, double d, double const* floor = nullptr) {
  std::vector<Vector> points(static_cast<std::size_t>(mesh.points.cols()));
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = mesh.points.col(static_cast<Eigen::Index>(i));
  std::vector<std::array<int, 3>> triangles;
  auto const add_point = [&](Vector const& x) { return points.push_back(x), static_cast<int>(points.size()) - 1; };
  for (auto const corners : mesh.triangles.colwise()) {
    std::vector<int> kept, cut;
    for (int k = 0; k < 3; ++k) {
      int const i = corners[k], j = corners[(k + 1) % 3];
      double const a = n.dot(mesh.points.col(i)) - d, b = n.dot(mesh.points.col(j)) - d;
      if (a > 0) kept.push_back(i);
      if ((a > 0) == (b > 0)) continue;
      cut.push_back(add_point(mesh.points.col(i) + a / (a - b) * (mesh.points.col(j) - mesh.points.col(i))));
      kept.push_back(cut.back());
    }
    for (std::size_t k = 2; k < kept.size(); ++k) triangles.push_back({kept[0], kept[k - 1], kept[k]});
    if (floor == nullptr || cut.size() != 2) continue;
    std::array<int, 4> wall{};
    for (std::size_t k = 0; k < 2; ++k) {
      Vector x = points[static_cast<std::size_t>(cut[k])];
      wall[k] = add_point(x), x[2] = *floor, wall[3 - k] = add_point(x);
    }
    Vector const first = points[static_cast<std::size_t>(wall[0])];
    Vector const across = points[static_cast<std::size_t>(wall[1])] - first, along = points[static_cast<std::size_t>(wall[2])] - first;
    if (across.cross(along).dot(n) > 0) std::reverse(wall.begin(), wall.end());
    triangles.push_back({wall[0], wall[1], wall[2]}), triangles.push_back({wall[0], wall[2], wall[3]});
  }
  TriangleMesh<double> left;   // with the points that are used
  left.points.resize(3, static_cast<Eigen::Index>(points.size())), left.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
  std::vector<int> number(points.size(), -1);
  int used = 0;
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      auto const i = static_cast<std::size_t>(triangles[t][k]);
      if (number[i] < 0) left.points.col(used) = points[i], number[i] = used++;
      left.triangles(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(t)) = number[i];
    }
  left.points.conservativeResize(3, used);
  return left;
}

/// Both in one.
TriangleMesh<double> together(TriangleMesh<double> const& a, TriangleMesh<double> const& b) {
  TriangleMesh<double> both;
  both.points.resize(3, a.points.cols() + b.points.cols()), both.triangles.resize(3, a.triangles.cols() + b.triangles.cols());
  both.points << a.points, b.points;
  both.triangles << a.triangles, (b.triangles.array() + static_cast<int>(a.points.cols())).matrix();
  return both;
}

/// A section through skin and finger, which is lifted by 6 mm so that the dent is seen.
TriangleMesh<double> sectioned(Problem const& problem, Row const& row) {
  auto const half = clipped(row.skin, Vector::UnitY(), row.finger[1], &problem.nailed_below);
  auto ball = make_sphere<double>(finger_radius, 16);
  Vector const lifted = row.finger + Vector(0, 0, 0.006);
  ball.points.colwise() += lifted;
  auto const all = together(half, clipped(ball, Vector::UnitY(), lifted[1], &lifted[2]));
  double const reach = 0.032;
  return clipped(clipped(all, Vector::UnitX(), row.finger[0] - reach), -Vector::UnitX(), -row.finger[0] - reach);
}

drawing::Album models_example() {
  using namespace drawing;
  Problem const problem;
  Row const reference = finest(problem);
  auto rows = elements(problem);
  for (auto const& more : {tensors(problem), springs(problem, reference.force), bodies(problem, reference.force)})
    rows.insert(rows.end(), more.begin(), more.end());

  std::printf("a liver of %.0f cm3, %td tetrahedra and a skin of %td vertices\n", 1e6 * problem.volume, problem.coarse.tetrahedra.cols(),
              problem.skin.points.cols());
  std::printf("reference: %.4f N, %.2f %% of the volume lost\n\n", reference.force, 100 * (1 - volume(reference.skin) / problem.volume));
  std::printf("%-28s %7s %7s %7s %7s %6s %7s %8s %6s %9s %7s %5s %8s %6s\n", "model", "off [%]", "most mm", "force N", "off [%]", "+- [%]", "vol [%]",
              "tick ms", "MB", "stable ms", "cut us", "made", "us each", "lines");
  Album album;
  Picture skin("models_skin", "Displacement of the skin under a finger: error over cost", "processor time of a tick of 1 ms [ms]", "off by [%]");
  Picture force("models_force", "Force on a finger: error over cost", "processor time of a tick of 1 ms [ms]", "off by [%]");
  for (Picture* chart : {&skin, &force}) chart->x().logarithmic = chart->y().logarithmic = true;
  auto const view = [&](Row const& row, std::string const& name) {
    album.views.push_back({.name = "models_" + name, .mesh = sectioned(problem, row), .from = Vector(0.0, -1.0, 0.2)});
  };
  view(reference, "0");
  int k = 0;
  for (Row const& row : rows) {
    Distance const off = distance(problem, row, reference);
    double const force_off = 100 * (row.force / reference.force - 1);
    std::printf("%-28s %7.1f %7.2f %7.3f %7.1f %6.1f %7.2f %8.3f %6.1f %9.3f %7.0f %5d %8.1f %6d\n", row.name.c_str(), 100 * off.relative, 1e3 * off.largest,
                row.force, force_off, 100 * row.trembling, 100 * (1 - volume(row.skin) / problem.volume), row.tick_ms, row.megabytes, row.stable_ms, row.cut_us,
                row.made, row.each_us, row.lines);
    bool const is_neo_hooke = k < 3;   // on three meshes: a line
    for (auto const& [chart, error] : {std::pair(&skin, 100 * off.relative), std::pair(&force, std::max(1.0, std::abs(force_off)))})
      add(is_neo_hooke ? chart->line(blue, "stable neo-Hooke") : chart->dots(static_cast<Colour>(static_cast<std::size_t>(k - 2) % colours), row.name), row.tick_ms, error);
    view(row, std::to_string(++k));
  }
  album.charts = {skin, force};
  return album;
}

}  // namespace

int main(int argc, char** argv) { return drawing::run_example("models", argc, argv, models_example); }
