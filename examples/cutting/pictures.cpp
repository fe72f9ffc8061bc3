// SPDX-License-Identifier: MIT
#include "pictures.hpp"

#include <palpate/mesh/edges.hpp>
#include <palpate/vtk/picture.hpp>

#include <array>
#include <cmath>

namespace cutting {

namespace {

constexpr double bar_radius = 0.00022;   // m

/// The mesh with a thin three-sided bar along each edge. The bars are turned inside out: a picture shows the inside of a surface in a
/// colour of its own, and so the lines are told from the tissue.
Mesh with_bars(Mesh const& mesh) {
  auto const edges = palpate::edges(mesh);
  auto const bars = static_cast<Eigen::Index>(edges.size());
  Mesh result;
  result.points.resize(3, mesh.points.cols() + 6 * bars);
  result.triangles.resize(3, mesh.triangles.cols() + 8 * bars);
  result.points.leftCols(mesh.points.cols()) = mesh.points;
  result.triangles.leftCols(mesh.triangles.cols()) = mesh.triangles;
  Eigen::Index p = mesh.points.cols(), t = mesh.triangles.cols();
  for (auto const& [a, b] : edges) {
    Vector const from = mesh.points.col(a), to = mesh.points.col(b);
    Vector const across = (to - from).unitOrthogonal();
    Vector const over = across.cross((to - from).normalized());
    auto const first = static_cast<int>(p);
    for (Vector const& end : {from, to})
      for (int k = 0; k < 3; ++k) {
        double const turn = 2.0 * 3.14159265358979323846 / 3.0 * k;
        result.points.col(p++) = end + bar_radius * (std::cos(turn) * across + std::sin(turn) * over);
      }
    for (int k = 0; k < 3; ++k) {
      int const next = (k + 1) % 3;
      result.triangles.col(t++) << first + k, first + next, first + 3 + next;
      result.triangles.col(t++) << first + k, first + 3 + next, first + 3 + k;
    }
    result.triangles.col(t++) << first, first + 2, first + 1;
    result.triangles.col(t++) << first + 3, first + 4, first + 5;
  }
  return result;
}

}  // namespace

void write_pictures(std::filesystem::path const& folder, std::string const& name, Mesh const& mesh, Vector const& seen_from, bool is_solid) {
  palpate::PictureStyle style;
  style.wound_depth = is_solid ? 0.0 : 0.008;
  style.interior = is_solid ? style.wound : std::array{0.24, 0.02, 0.03};
  palpate::Camera const camera = palpate::framing(mesh, seen_from, Vector::UnitZ());
  palpate::write_picture(folder / (name + "_shaded.png"), mesh, camera, {}, style);

  style.tissue = {0.93, 0.86, 0.80};   // pale, so that the lines are seen
  style.interior = is_solid ? std::array{0.62, 0.30, 0.28} : std::array{0.10, 0.12, 0.20};
  style.wound = {0.80, 0.08, 0.08};
  palpate::write_picture(folder / (name + "_wireframe.png"), with_bars(mesh), camera, {}, style);
}

}  // namespace cutting
