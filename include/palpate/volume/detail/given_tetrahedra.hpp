// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/units.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/repair.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/validation.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace palpate::detail {

/// What is wrong in a file, with its numbers of vertices and tetrahedra, and what to do where it was made: its reader has no mesh that `repair` could take.
inline std::string defect_of_file(MeshDefect defect, std::vector<int> const& new_index, std::vector<Vector3<double>> const& points,
                                  std::vector<std::array<int, 4>> const& tetrahedra) {
  using Kind = MeshDefectKind;
  auto const in_file = [&](int v) { return static_cast<int>(std::find(new_index.begin(), new_index.end(), v) - new_index.begin()); };
  if (defect.kind == Kind::not_finite || defect.kind == Kind::duplicate_vertex) defect.index = in_file(defect.index);
  if (defect.kind == Kind::repeated_corner || defect.kind == Kind::duplicate_vertex) defect.other = in_file(defect.other);
  std::string text = to_string(defect);
  text.resize(std::min(text.size(), text.find("; `repair`")));
  if (defect.kind == Kind::no_volume || defect.kind == Kind::duplicate_element || defect.kind == Kind::non_manifold_face || defect.kind == Kind::overlap) {
    text += message("; the vertices of tetrahedron ", defect.index, " are");
    for (char const* separator = " "; int const v : tetrahedra[static_cast<std::size_t>(defect.index)]) {
      auto const& p = points[static_cast<std::size_t>(v)];
      text += message(separator, v);
      if (defect.kind == Kind::no_volume) text += message(" (", p.x(), ", ", p.y(), ", ", p.z(), ")");   // one may be far off
      separator = ", ";
    }
  }
  if (defect.kind == Kind::no_volume) text += "; mesh anew there (in Gmsh: Mesh.Optimize = 1), or correct the vertex";
  if (defect.kind == Kind::repeated_corner) text += "; take it out of the file, or mesh anew";
  if (defect.kind == Kind::duplicate_vertex) text += "; merge such vertices (in Gmsh: Coherence Mesh)";
  if (defect.kind == Kind::duplicate_element)
    text += "; leave one of them (in version 2 Gmsh writes those of two physical groups twice: give each volume one group, or save as 4.1)";
  return text + "; all is counted from 0 in the order of the file";
}

/// The volume of a file: tetrahedra that are inside out are turned, vertices of none dropped. Throws `FileError` in one line for any other fault.
inline TetrahedralMesh<double> given_tetrahedra(std::vector<Vector3<double>> const& points, std::vector<std::array<int, 4>> const& tetrahedra,
                                                std::optional<double> metres_per_unit, std::string const& name) {
  double const metres = stated_or_metres(metres_per_unit);
  if (tetrahedra.empty()) throw FileError(message(name, ": there are no tetrahedra in this file; a surface is read by read_mesh and filled by fill"));
  TetrahedralMesh<double> mesh;
  mesh.points.resize(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) mesh.points.col(static_cast<Eigen::Index>(i)) = metres * points[i];
  mesh.tetrahedra.resize(4, static_cast<Eigen::Index>(tetrahedra.size()));
  for (std::size_t t = 0; t < tetrahedra.size(); ++t) {
    for (std::size_t c = 0; c < 4; ++c) {
      int const v = tetrahedra[t][c];
      if (v < 0 || v >= static_cast<int>(points.size()))
        throw FileError(message(name, ": tetrahedron ", t, " (counted from 0) names vertex ", v, ", the file has vertices 0 … ", points.size() - 1, "; was it cut short?"));
      mesh.tetrahedra(static_cast<Eigen::Index>(c), static_cast<Eigen::Index>(t)) = v;
    }
    if (content(corners_of(mesh.points, mesh.tetrahedra, static_cast<Eigen::Index>(t))) < 0)
      std::swap(mesh.tetrahedra(2, static_cast<Eigen::Index>(t)), mesh.tetrahedra(3, static_cast<Eigen::Index>(t)));
  }
  RepairReport report;
  report.new_index.resize(points.size());
  std::iota(report.new_index.begin(), report.new_index.end(), 0);
  drop_unused(mesh, true, report);
  if (auto const defects = validate(mesh); !defects.empty())
    throw FileError(message(name, ": ", defect_of_file(defects.front(), report.new_index, points, tetrahedra)));
  auto const [low, high] = low_and_high(mesh.points);
  require_stated_unit(name, (high - low).maxCoeff(), metres_per_unit);
  return mesh;
}

}  // namespace palpate::detail
