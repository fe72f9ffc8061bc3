// SPDX-License-Identifier: MIT
// The problem that all models get, and what is measured of each: a fingertip presses an organ and is held there, and a blade goes across another one.
#pragma once

#include <palpate/body/soft_body.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/tool/blunt_tool.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace models {

using namespace palpate;
using Vector = Vector3<double>;
using Headers = std::vector<std::string>;   // or folders, below include/palpate

constexpr double young = 5000, poisson = 0.45, density = 1060, drag = 50;   // Pa, kg/m³, 1/s: brings a solid to rest soon
constexpr double finger_radius = 0.012, deepest = 0.004;         // m
constexpr double coarse_edge = 0.006, middle_edge = 0.0045, fine_edge = 0.0035, finest_edge = 0.003;   // m, of tetrahedra

/// A liver of 10 cm. It lies on its back, which is nailed.
struct Problem {
  TriangleMesh<double> skin;
  TetrahedralMesh<double> coarse;
  double volume, mass, nailed_below;   // m³, kg, m
  Vector top;                          // the highest vertex

  Problem();
  bool is_nailed(Vector const& rest) const { return rest[2] < nailed_below; }
  auto nailed(auto body) const {
    for (int i = 0; i < body.size(); ++i)
      if (is_nailed(body.reference_position(i))) body.nail(i);
    return body;
  }
};

/// What is measured of a model. Times are of one core.
struct Row {
  std::string name;
  TriangleMesh<double> skin;     // under the finger
  Vector finger;                 // the middle of its ball, then [m]
  double force = 0;              // on the hand, at rest: mean of the last ticks [N]
  double trembling = 0;          // its standard deviation, over it
  double tick_ms = 0;            // of a millisecond, while the finger comes; mean
  double megabytes = 0;          // that the body, its search and its solver take
  double stable_ms = std::numeric_limits<double>::infinity();   // the largest step that leapfrog stands, if it is leapfrog's
  int made = 0;                  // by the cut: tetrahedra or triangles more, or faces between cubes that opened; 0: it can not be cut
  double cut_us = 0, each_us = 0;   // of a tick that cuts, median, without its step; of the cut, over what it made
  int lines = 0;                 // of code, of the model's own headers
};

double processor_time();     // s
double megabytes_in_use();
int code_lines(Headers const& headers);
TetrahedralMesh<double> filled(Problem const& problem, double edge);

/// The problem's skin, carried by tetrahedra.
class CarriedSkin {
 public:
  CarriedSkin(Problem const& problem, TetrahedralMesh<double> const& mesh);
  ~CarriedSkin();
  Matrix3X<double> at(Matrix3X<double> const& positions);

 private:
  struct Surface;
  std::unique_ptr<Surface> surface_;
};

/// How far a row's skin is from another's, over how far that one has moved: root mean squares; and the largest distance [m].
struct Distance {
  double relative = 0, largest = 0;
};
Distance distance(Problem const& problem, Row const& row, Row const& reference);

/// Rows of the table, a line each. Those that are fitted get the force that the finger should feel [N].
Row finest(Problem const& problem);   // the reference: stable neo-Hooke
std::vector<Row> elements(Problem const& problem);
std::vector<Row> tensors(Problem const& problem);
std::vector<Row> springs(Problem const& problem, double force);
std::vector<Row> bodies(Problem const& problem, double force);

/// A finger without friction comes down at 40 mm/s from where it touches this body first, 4 mm deep, and stays: 100 ticks of 1 ms,
/// which are timed, then of 2 ms. The force is the mean of the last 40.
/// `skin_of(body)` is where the problem's skin is.
template <class MakeBody, class SkinOf>
Row press(Problem const& problem, std::string name, Headers const& headers, MakeBody const& make_body, SkinOf const& skin_of, int timed = 100) {
  Row row{.name = std::move(name), .skin = {}, .finger = problem.top, .lines = code_lines(headers)};
  double const before = megabytes_in_use();
  auto body = make_body();
  double above = problem.top[2] + 2 * finger_radius, gap = finger_radius;
  while (gap > 1e-7) above -= gap = body.nearest_point({problem.top[0], problem.top[1], above}).distance - finger_radius;
  BluntTool<double> finger(make_probe_shape<double>({.radius = finger_radius}), {.friction = 0});
  double depth = -0.0005;
  auto const tick = [&](double h) {
    depth = std::min(deepest, depth + 0.04 * h);
    row.finger[2] = above - depth;
    finger.advance(body, {row.finger});
    double const force = finger.press(body, 1.0, h)[2];
    body.step(h);
    return force;
  };
  constexpr int settling = 50, at_rest = 40;
  double const start = processor_time();
  for (int k = 0; k < timed; ++k) tick(1e-3);
  row.tick_ms = 1e3 * (processor_time() - start) / std::max(1, timed);
  while (depth < deepest) tick(0.002);
  for (int k = 0; k < settling; ++k) tick(0.002);
  std::array<double, at_rest> forces{};
  for (double& force : forces) row.force += (force = tick(0.002)) / at_rest;
  for (double const force : forces) row.trembling += (force - row.force) * (force - row.force) / at_rest;
  row.trembling = row.force != 0 ? std::sqrt(row.trembling) / std::abs(row.force) : 0;
  row.megabytes = megabytes_in_use() - before;
  row.skin = {skin_of(body), problem.skin.triangles};
  return row;
}

/// A blade goes 3 cm across the top, as deep as 10 mm, 1 mm a tick, with a step of 1 ms after each. `advance(body, at)` moves it, `count(body)` is what grows.
template <class Body>
void cut(Problem const& problem, Row& row, Body body, auto const& advance, auto const& count) {
  std::vector<double> each;
  double all = 0;
  int const uncut = count(body);
  for (int tick = 0; tick <= 30; ++tick) {
    Vector const at = problem.top + Vector(1e-3 * (tick - 15), 0.0007, 0);
    int const had = count(body);
    body.nearest_vertex(at);   // fits the search tree
    double const start = processor_time();
    advance(body, at);
    double const took = 1e6 * (processor_time() - start);
    if (count(body) > had) each.push_back(took);
    all += took;
    body.step(1e-3);
  }
  row.made = count(body) - uncut;
  if (each.empty()) return;
  auto const middle = each.begin() + static_cast<std::ptrdiff_t>(each.size() / 2);
  std::nth_element(each.begin(), middle, each.end());
  row.cut_us = *middle, row.each_us = all / row.made;
}

/// The largest step that leapfrog stands [ms].
double leapfrog_ms(auto body) { return 1e3 * stable_step(LeapfrogVerlet{}, body.modal_bounds()); }

/// A model of tetrahedra, in implicit steps: `make(mesh)` makes its tissue.
template <class Make>
Row solid(Problem const& problem, TetrahedralMesh<double> const& mesh, std::string name, Headers const& headers, Make const& make, bool is_reference = false) {
  auto const make_body = [&] { return problem.nailed(SoftBody(make(mesh), BackwardEuler{})); };
  CarriedSkin skin(problem, mesh);
  Row row = press(problem, std::move(name), headers, make_body, [&](auto const& body) { return skin.at(body.positions()); }, is_reference ? 0 : 100);
  if (is_reference) return row;
  row.stable_ms = leapfrog_ms(make_body());
  VolumeCutter<double> knife;
  cut(problem, row, make_body(), [&](auto& body, Vector const& at) { knife.advance(body, {at - Vector(0, 0, 0.01), at + Vector(0, 0, 0.01)}); },
      [](auto const& body) { return body.tissue().topology().tetrahedron_count(); });
  return row;
}

/// A model whose vertices are those of the problem's skin.
template <class MakeBody>
Row surface(Problem const& problem, std::string name, Headers const& headers, MakeBody const& make_body) {
  return press(problem, std::move(name), headers, make_body, [](auto const& body) { return Matrix3X<double>(body.positions()); });
}

/// The scale of a model's stiffness with which the finger feels so much [N]; `row_of(scale)` measures.
template <class RowOf>
std::pair<double, Row> fitted(double force, RowOf const& row_of) {
  double scale = 1;
  Row row = row_of(scale);
  for (int k = 0; k < 6 && (row.force < 0.999 * force || row.force > 1.001 * force) && row.force > 0; ++k) row = row_of(scale *= force / row.force);
  return {scale, row};
}

}  // namespace models
