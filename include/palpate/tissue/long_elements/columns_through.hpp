// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace palpate::detail {

/// Where a line through a surface goes in or out.
struct LineCrossing {
  double place = 0;   // along the line [m]
  int triangle = -1;
  bool leaves = false;
};

/// The part of a line that is inside a closed surface.
struct SurfaceColumn {
  int line = -1;
  LineCrossing low, high;
  double length() const noexcept { return high.place - low.place; }
};

/// Parallel lines through a closed surface in cells that divide its bounding box evenly, and the columns that the surface cuts out of them.
/// Lines      along axis d, in the middle of cells[0] × cells[1] cells along the axes (d + 1) % 3 and (d + 2) % 3, about `spacing` wide.
/// Exact      a line that meets an edge or a vertex passes it on one side, the same for all triangles there: which one, the order of indices says.
struct SurfaceColumns {
  int axis = 0;
  std::array<int, 2> cells{};
  std::array<double, 2> low{}, width{};   // m
  std::vector<SurfaceColumn> columns;     // by line, then by place
  std::vector<int> first;                 // of each line, and of the one after the last

  int across(int k) const noexcept { return (axis + 1 + k) % 3; }
  std::span<SurfaceColumn const> of_line(int line) const noexcept {
    auto const l = static_cast<std::size_t>(line);
    return std::span(columns).subspan(static_cast<std::size_t>(first[l]), static_cast<std::size_t>(first[l + 1] - first[l]));
  }

  /// visit(line, weight) for the up to four lines round a point, whose weights add up to 1: each by how near it is.
  template <class Visit>
  void for_lines_round(Vector3<double> const& point, Visit const& visit) const {
    std::array<int, 2> cell{};
    std::array<double, 2> share{};
    for (int k = 0; k < 2; ++k) {
      auto const s = static_cast<std::size_t>(k);
      double const place = std::clamp((point[across(k)] - low[s]) / width[s] - 0.5, 0.0, cells[s] - 1.0);
      cell[s] = std::min(static_cast<int>(place), std::max(0, cells[s] - 2)), share[s] = place - cell[s];
    }
    for (int b = 0; b < 2; ++b)
      for (int a = 0; a < 2; ++a) {
        double const weight = (a == 1 ? share[0] : 1 - share[0]) * (b == 1 ? share[1] : 1 - share[1]);
        if (weight > 0) visit((cell[1] + b) * cells[0] + cell[0] + a, weight);
      }
  }
};

/// Which side of u → v a point is on, in a plane: +1 or −1, the other one for v → u, never 0.
inline int side_of(Matrix<double, 2, 1> const& u, int u_name, Matrix<double, 2, 1> const& v, int v_name, Matrix<double, 2, 1> const& point) {
  if (u_name > v_name) return -side_of(v, v_name, u, u_name, point);
  Matrix<double, 2, 1> const along = v - u, to = point - u;
  return along[0] * to[1] - along[1] * to[0] >= 0 ? 1 : -1;
}

/// Throws InvalidMesh where the surface is not closed, or passes through itself so that a line leaves it before it enters; InvalidArgument for a spacing wider
/// than the surface, or so small that there are more than 10⁶ lines.
template <RealScalar Scalar>
SurfaceColumns columns_through(TriangleMesh<Scalar> const& mesh, int axis, double spacing) {
  using Flat = Matrix<double, 2, 1>;
  SurfaceColumns made;
  made.axis = axis;
  auto const [lowest, highest] = low_and_high(mesh.points);
  Vector3<double> const size = (highest - lowest).template cast<double>();
  constexpr double most = 1e6;   // lines
  if (!(spacing <= size.maxCoeff()))
    throw InvalidArgument(message("LongElements: a spacing of ", spacing, " m is wider than the surface, which is ", size.maxCoeff(), " m; give a smaller one, in metres"));
  if (double const area = size[made.across(0)] * size[made.across(1)]; !(area <= most * spacing * spacing))
    throw InvalidArgument(message("LongElements: a spacing of ", spacing, " m makes more than ", most, " columns; give one above ", std::sqrt(area / most),
                                  " m, or the surface in metres (it may be in millimetres)"));
  for (int k = 0; k < 2; ++k) {
    auto const s = static_cast<std::size_t>(k);
    made.low[s] = static_cast<double>(lowest[made.across(k)]);
    double const extent = size[made.across(k)];
    made.cells[s] = std::max(1, static_cast<int>(std::lround(extent / spacing)));
    made.width[s] = extent / made.cells[s];
  }
  std::vector<std::vector<LineCrossing>> crossings(static_cast<std::size_t>(made.cells[0]) * static_cast<std::size_t>(made.cells[1]));
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    std::array<Flat, 3> corner;
    std::array<double, 3> height{};
    std::array<int, 4> range{};   // first and last cell each way
    for (std::size_t k = 0; k < 3; ++k) {
      Vector3<double> const p = mesh.points.col(mesh.triangles(static_cast<int>(k), t)).template cast<double>();
      corner[k] = {p[made.across(0)], p[made.across(1)]}, height[k] = p[axis];
    }
    for (std::size_t s = 0; s < 2; ++s) {
      auto const cell = [&](double place) { return (place - made.low[s]) / made.width[s] - 0.5; };
      auto const i = static_cast<int>(s);
      range[2 * s] = std::max(0, static_cast<int>(std::floor(cell(std::min({corner[0][i], corner[1][i], corner[2][i]})))));
      range[2 * s + 1] = std::min(made.cells[s] - 1, static_cast<int>(std::ceil(cell(std::max({corner[0][i], corner[1][i], corner[2][i]})))));
    }
    auto const name = [&](std::size_t k) { return mesh.triangles(static_cast<int>(k), t); };
    for (int b = range[2]; b <= range[3]; ++b)
      for (int a = range[0]; a <= range[1]; ++a) {
        Flat const line(made.low[0] + (a + 0.5) * made.width[0], made.low[1] + (b + 0.5) * made.width[1]);
        int const side = side_of(corner[0], name(0), corner[1], name(1), line);
        if (side != side_of(corner[1], name(1), corner[2], name(2), line) || side != side_of(corner[2], name(2), corner[0], name(0), line)) continue;
        auto const area = [&](std::size_t u, std::size_t v) {
          Flat const x = corner[u] - line, y = corner[v] - line;
          return std::abs(x[0] * y[1] - x[1] * y[0]);
        };
        double const w0 = area(1, 2), w1 = area(2, 0), w2 = area(0, 1), all = w0 + w1 + w2;
        double const place = all > 0 ? (w0 * height[0] + w1 * height[1] + w2 * height[2]) / all : height[0];
        crossings[static_cast<std::size_t>(b * made.cells[0] + a)].push_back({place, static_cast<int>(t), side > 0});
      }
  }
  for (std::size_t line = 0; line < crossings.size(); ++line) {
    made.first.push_back(static_cast<int>(made.columns.size()));
    auto& on_line = crossings[line];
    std::sort(on_line.begin(), on_line.end(), [](auto const& a, auto const& b) { return std::pair(a.place, a.triangle) < std::pair(b.place, b.triangle); });
    int inside = 0;
    SurfaceColumn column;
    column.line = static_cast<int>(line);
    for (LineCrossing const& one : on_line) {
      inside += one.leaves ? -1 : 1;
      if (inside == 1 && !one.leaves) column.low = one;
      if (inside == 0 && one.leaves) column.high = one, made.columns.push_back(column);
    }
    if (inside != 0)
      throw InvalidMesh(message("a line along axis ", axis, " enters the surface ", on_line.size(), " times in and out and ends inside, near triangle ",
                                on_line.back().triangle, "; give a closed surface that faces outward, `repair` mends most"));
  }
  made.first.push_back(static_cast<int>(made.columns.size()));
  return made;
}

}  // namespace palpate::detail
