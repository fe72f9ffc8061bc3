// SPDX-License-Identifier: MIT
// Every model of tissue on one problem: a thumb of 12 mm presses a liver of 5 kPa by 4 mm, and a blade goes across it. Displacements of the skin and the
// force are compared with stable neo-Hooke, extrapolated from two finer meshes. A model is a line in elements.cpp, tensors.cpp, springs.cpp or bodies.cpp:
//   rows.push_back(solid(problem, mesh, "mine", {"tissue/mine.hpp"}, [](auto const& of) { return Mine<double>(of, {...}); }));
//   models [FOLDER]
#include "../album.hpp"
#include "problem.hpp"

#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/sphere.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

namespace {

using namespace models;

/// The skin, and the ball of the finger in it.
TriangleMesh<double> with_finger(Row const& row) {
  auto const ball = make_sphere<double>(finger_radius, 8);
  auto const vertices = row.skin.points.cols();
  TriangleMesh<double> both;
  both.points.resize(3, vertices + ball.points.cols()), both.triangles.resize(3, row.skin.triangles.cols() + ball.triangles.cols());
  both.points << row.skin.points, ball.points.colwise() + row.finger;
  both.triangles << row.skin.triangles, (ball.triangles.array() + static_cast<int>(vertices)).matrix();
  return both;
}

drawing::Album models_example() {
  using namespace drawing;
  Problem const problem;
  auto rows = elements(problem);
  Row const reference = extrapolated(rows[1], middle_edge, rows[0], fine_edge);
  for (auto& more : {tensors(problem), springs(problem, reference.force), bodies(problem, reference.force)}) rows.insert(rows.end(), more.begin(), more.end());

  std::printf("a liver of %.0f cm3, %td tetrahedra and a skin of %td vertices; reference: %.4f N, %.2f %% of the volume lost\n\n", 1e6 * problem.volume,
              problem.coarse.tetrahedra.cols(), problem.skin.points.cols(), reference.force, 100 * (1 - volume(reference.skin) / problem.volume));
  std::printf("%-28s %7s %7s %7s %7s %6s %7s %8s %6s %9s %7s %5s %8s %6s\n", "model", "off [%]", "most mm", "force N", "off [%]", "+- [%]", "vol [%]", "tick ms", "MB", "stable ms",
              "cut us", "made", "us each", "lines");
  Album album;
  Picture skin("models_skin", "Displacement of the skin under a finger: error over cost", "processor time of a tick of 1 ms [ms]", "off by [%]");
  Picture force("models_force", "Force on a finger: error over cost", "processor time of a tick of 1 ms [ms]", "off by [%]");
  for (Picture* chart : {&skin, &force}) chart->x().logarithmic = chart->y().logarithmic = true;
  auto const view = [&](Row const& row, std::string const& name) { album.views.push_back({.name = "models_" + name, .mesh = with_finger(row), .from = Vector(0.25, -1.0, 0.45)}); };
  view(reference, "0");
  int k = 0;
  for (Row const& row : rows) {
    Distance const off = distance(problem, row, reference);
    double const force_off = 100 * (row.force / reference.force - 1);
    std::printf("%-28s %7.1f %7.2f %7.3f %7.1f %6.1f %7.2f %8.3f %6.2f %9.3f %7.0f %5d %8.1f %6d\n", row.name.c_str(), 100 * off.relative, 1e3 * off.largest, row.force, force_off,
                100 * row.trembling, 100 * (1 - volume(row.skin) / problem.volume), row.tick_ms, row.megabytes, row.stable_ms, row.cut_us, row.made, row.each_us, row.lines);
    bool const is_neo_hooke = k < 3;   // on three meshes: a line
    for (auto const& [chart, error] : {std::pair(&skin, 100 * off.relative), std::pair(&force, std::max(1.0, std::abs(force_off)))})
      add(is_neo_hooke ? chart->line(blue, "stable neo-Hooke, three meshes") : chart->dots(static_cast<Colour>(k - 2), row.name), row.tick_ms, error);
    view(row, std::to_string(++k));
  }
  album.charts = {skin, force};
  return album;
}

}  // namespace

int main(int argc, char** argv) { return drawing::run_example("models", argc, argv, models_example); }
