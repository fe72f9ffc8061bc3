// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/repair.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/validation.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

namespace palpate::detail {

/// The volume of a file: tetrahedra that are inside out are turned, vertices of none dropped. Throws `FileError` in one line for any other fault.
inline TetrahedralMesh<double> given_tetrahedra(std::vector<Vector3<double>> const& points, std::vector<std::array<int, 4>> const& tetrahedra, double metres_per_unit,
                                                std::string const& name) {
  if (tetrahedra.empty()) throw FileError(message(name, ": there are no tetrahedra in this file; a surface is read by read_mesh and filled by fill"));
  TetrahedralMesh<double> mesh;
  mesh.points.resize(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) mesh.points.col(static_cast<Eigen::Index>(i)) = metres_per_unit * points[i];
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
  for (auto const& defect : validate(mesh)) throw FileError(message(name, ": ", to_string(defect)));
  return mesh;
}

inline void check_metres_per_unit(double metres_per_unit) {
  require_positive("metres per unit", metres_per_unit, "m");
}

}  // namespace palpate::detail
