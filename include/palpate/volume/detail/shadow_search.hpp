// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/surface_tree.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/tetrahedral_topology.hpp>
#include <palpate/volume/detail/tetrahedron_cells.hpp>

#include <cmath>

namespace palpate::detail {

/// Finds the tetrahedron that carries a point of a skin, and the point's shadow in the tetrahedra: itself where one of them holds it, else a point below it,
/// along the skin's normal, by which the sides of a cut are told.
template <RealScalar Scalar>
class ShadowSearch {
 public:
  using Point = Vector3<double>;
  struct Shadow {
    int tetrahedron;
    Point point;
    Scalar outside = 0;   // m, from the border
  };

  /// Both have to stay.
  ShadowSearch(TetrahedralMesh<Scalar> const& volume, TetrahedralTopology const& topology)
      : volume_(volume), topology_(topology), cells_(volume), border_(volume.points, topology.border().triangles()) {}

  Shadow find(Vector3<Scalar> const& point, Vector3<Scalar> const& normal) {
    Point const p = point.template cast<double>();
    if (int const holder = cells_.find(p); holder >= 0) return {holder, p};
    auto const nearest = border_.nearest(volume_.points, point, hint_);
    hint_ = nearest.triangle;
    Shadow found{topology_.border_face(nearest.triangle).tetrahedron, nearest.point.template cast<double>(), nearest.distance};
    Point const down = found.point - p, n = normal.template cast<double>();
    double const along = n.dot(down);
    Point const way = std::abs(along) > 0.3 * down.norm() ? Point(down.squaredNorm() / along * n) : down;   // along the normal, as far as the border
    for (double const depth : {2.0, 1.1, 3.0})
      if (Point const there = p + depth * way; cells_.find(there) >= 0) {
        found.tetrahedron = cells_.find(there), found.point = there;
        return found;
      }
    Point middle = Point::Zero();   // as good as on the border, inside
    for (int const v : topology_.corners(found.tetrahedron)) middle += volume_.points.col(v).template cast<double>() / 4;
    found.point += 0.01 * (middle - found.point);
    return found;
  }
  Matrix<double, 4, 1> weights(int tetrahedron, Vector3<Scalar> const& p) const { return cells_.weights(tetrahedron, p.template cast<double>()); }

 private:
  TetrahedralMesh<Scalar> const& volume_;
  TetrahedralTopology const& topology_;
  TetrahedronCells<Scalar> cells_;
  SurfaceTree<Scalar> border_;
  int hint_ = -1;
};

}  // namespace palpate::detail
