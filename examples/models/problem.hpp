// SPDX-License-Identifier: MIT
// The problem that all models get: a liver that a fingertip presses, held there, and a blade that goes across it. And what is measured.
#pragma once

#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/organ.hpp>
#include <palpate/tool.hpp>
#include <palpate/volume.hpp>

#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

namespace models {

using namespace palpate;
using Vector = Vector3<double>;

constexpr double young = 5000, poisson = 0.45, density = 1060;   // Pa, kg/m³
constexpr double finger_radius = 0.008, deepest = 0.006;         // m

struct Problem {
  TriangleMesh<double> skin = make_organ<double>({.vertices = 1200});
  TetrahedralMesh<double> coarse = fill(skin, {.edge = 0.011}).mesh, fine = fill(skin, {.edge = 0.0065}).mesh;
  double lowest = skin.points.row(2).minCoeff(), mass = density * volume(skin);
  int touched = 0;

  Problem() {
    for (int i = 1; i < skin.points.cols(); ++i)
      if (skin.points(2, i) > skin.points(2, touched)) touched = i;
  }
  Vector top() const { return skin.points.col(touched); }
  bool is_nailed(Vector const& rest) const { return rest[2] < lowest + 0.012; }   // it lies on its back
};

/// What is measured of a model. Times are of one core.
struct Row {
  std::string name;
  TriangleMesh<double> pressed;       // the skin, under the finger
  double force = 0;                   // on the hand, at rest [N]
  double volume_lost = 0;             // of one
  double tick_ms = 0;                 // of a millisecond, touched, mean
  double megabytes = 0;               // that the body, its simulator and its solver take
  double stable_ms = 0;               // the largest stable step of leapfrog; infinite where any step is stable
  double cut_us = 0;                  // of a tick that cuts, without its step, median; 0: nothing is cut
  int made = 0;                       // tetrahedra or triangles more, after the cut
  int lines = 0;                      // of code, of the model's own headers
};

inline double processor_time() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }   // s
inline double megabytes_in_use() {
  auto const now = mallinfo2();
  return 1e-6 * static_cast<double>(now.uordblks + now.hblkhd);
}

/// Lines of code, neither blank nor comment, of headers or folders below include/palpate.
inline int code_lines(std::vector<std::string> const& headers) {
  int lines = 0;
  auto const add = [&](std::filesystem::path const& file) {
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);) {
      auto const first = line.find_first_not_of(" \t");
      lines += first != std::string::npos && line.compare(first, 2, "//") != 0 ? 1 : 0;
    }
  };
  for (std::string const& header : headers) {
    std::filesystem::path const path = std::filesystem::path(PALPATE_HEADERS) / header;
    if (std::filesystem::is_directory(path))
      for (auto const& file : std::filesystem::directory_iterator(path)) add(file.path());
    else
      add(path);
  }
  return lines;
}

/// Presses with a rod that ends in a fingertip, 500 ticks of 1 ms, and fills in the row. `skin_of(body)` is the problem's skin, where it is now.
template <class MakeBody, class SkinOf>
void press(Problem const& problem, Row& row, MakeBody const& make_body, SkinOf const& skin_of) {
  double const before = megabytes_in_use();
  auto body = make_body();
  Vector const touching = problem.top() + Vector(0, 0, finger_radius), deep = touching - Vector(0, 0, deepest);
  BluntTool<double> finger(make_probe_shape<double>({.radius = finger_radius}));
  constexpr int ticks = 500, down = 250, counted = 100;
  double start = 0;
  row.force = 0;
  for (int tick = 0; tick < ticks; ++tick) {
    if (tick == ticks - counted) start = processor_time();
    finger.advance(body, {deep + (1 - std::min(1.0, static_cast<double>(tick) / down)) * Vector(touching + Vector(0, 0, 0.002) - deep)});
    Vector const on_hand = finger.press(body, 1.0, 1e-3);
    if (tick >= ticks - counted) row.force += on_hand[2] / counted;
    body.step(1e-3);
  }
  row.tick_ms = 1e3 * (processor_time() - start) / counted;
  row.megabytes = megabytes_in_use() - before;
  row.pressed = TriangleMesh<double>{skin_of(body), problem.skin.triangles};
  row.volume_lost = 1 - volume(row.pressed) / volume(problem.skin);
}

/// Draws a blade 4 cm across the top, 12 mm deep, 1 mm a tick, with a step of 1 ms after each.
template <class Body, class Advance, class Count>
void cut(Problem const& problem, Row& row, Body body, Advance const& advance, Count const& count) {
  std::vector<double> each;
  int const uncut = count(body);
  for (int tick = 0; tick <= 40; ++tick) {
    Vector const at = problem.top() + Vector(1e-3 * (tick - 20), 0.0007, 0);
    int const had = count(body);
    body.nearest_vertex(at);   // fits the search tree
    double const start = processor_time();
    advance(body, at);
    double const took = processor_time() - start;
    if (count(body) > had) each.push_back(1e6 * took);
    body.step(1e-3);
  }
  row.made = count(body) - uncut;
  if (each.empty()) return;
  std::nth_element(each.begin(), each.begin() + static_cast<std::ptrdiff_t>(each.size() / 2), each.end());
  row.cut_us = each[each.size() / 2];
}

/// A tissue of tetrahedra in a soft body of implicit steps.
template <class Tissue>
auto solid_body(Problem const& problem, TetrahedralMesh<double> const& mesh, Tissue tissue) {
  for (int i = 0; i < tissue.size(); ++i)
    if (problem.is_nailed(mesh.points.col(i))) tissue.nail(i);
  return SoftBody(std::move(tissue), BackwardEuler{});
}

/// The largest step that leapfrog stands [s].
double leapfrog_step(auto body) { return stable_step(LeapfrogVerlet{}, body.modal_bounds()); }

/// All of a model of tetrahedra: `make(mesh)` makes its tissue.
template <class Make>
Row solid_row(Problem const& problem, TetrahedralMesh<double> const& mesh, std::string name, std::vector<std::string> const& headers, bool is_cut,
              Make const& make) {
  Row row{.name = std::move(name), .pressed = {}, .lines = code_lines(headers)};
  EmbeddedSurface<double> skin(problem.skin, mesh);
  press(problem, row, [&] { return solid_body(problem, mesh, make(mesh)); }, [&](auto const& body) {
    skin.update(body.positions());
    return Matrix3X<double>(skin.points());
  });
  row.stable_ms = 1e3 * leapfrog_step(solid_body(problem, mesh, make(mesh)));
  if (is_cut) {
    VolumeCutter<double> knife;
    cut(problem, row, solid_body(problem, mesh, make(mesh)),
        [&](auto& body, Vector const& at) { knife.advance(body, {at - Vector(0, 0, 0.012), at + Vector(0, 0, 0.01)}); },
        [](auto const& body) { return body.tissue().topology().tetrahedron_count(); });
  }
  return row;
}

/// Of a model of the skin alone.
template <class MakeBody>
Row skin_row(Problem const& problem, std::string name, std::vector<std::string> const& headers, MakeBody const& make_body) {
  Row row{.name = std::move(name), .pressed = {}, .lines = code_lines(headers)};
  press(problem, row, make_body, [](auto const& body) { return Matrix3X<double>(body.positions()); });
  row.stable_ms = 1e3 * make_body().stable_step();
  return row;
}

/// The scale of a model's stiffness with which the finger feels so much [N]; `row_of(scale)` measures.
template <class RowOf>
Row fitted(double force, RowOf const& row_of) {
  double scale = 1;
  Row row = row_of(scale);
  for (int k = 0; k < 6 && std::abs(row.force - force) > 1e-3 * force && row.force > 0; ++k) {
    scale *= force / row.force;
    row = row_of(scale);
  }
  return row;
}

/// How far the skin is from another, over how far that one has moved: root mean squares, and the largest distance [m].
struct Distance {
  double relative = 0, largest = 0;
};
inline Distance distance(Problem const& problem, Row const& row, Row const& reference) {
  Matrix3X<double> const off = row.pressed.points - reference.pressed.points;
  return {off.norm() / (reference.pressed.points - problem.skin.points).norm(), off.colwise().norm().maxCoeff()};
}

}  // namespace models
