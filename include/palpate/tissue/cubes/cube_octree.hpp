// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/closest_point.hpp>
#include <palpate/collision/surface_tree.hpp>
#include <palpate/core/columns.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/tissue/cubes/cube_grid.hpp>

#include <Eigen/Geometry>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

namespace palpate::detail {

/// Boxes around the skin of the cubes below each node of a grid's octree, and the depth-first search in them.
template <RealScalar Scalar>
class CubeOctree {
 public:
  using Vector = Vector3<Scalar>;

  void forget() noexcept { is_fitted_ = false; }   // the body has moved, or its skin has changed

  /// The nearest point of the skin; fits the boxes first, if they are forgotten. A mesh has grid(), positions(), tissue() and for_each_triangle(cube, visit).
  template <class Mesh>
  SurfacePoint<Scalar> nearest_point(Mesh const& mesh, Vector const& point) {
    if (!is_fitted_) fit(mesh);
    SurfacePoint<Scalar> best;
    if (!is_finite(point)) return best;
    constexpr Scalar slack = 1 + 64 * std::numeric_limits<Scalar>::epsilon();
    Scalar limit = std::numeric_limits<Scalar>::infinity();   // m², of the best
    auto const x = mesh.positions();
    auto const squared_distance = [&](int node) {
      return (point - Vector(boxes_[2 * node])).cwiseMin(Vector(boxes_[2 * node + 1]) - point).cwiseMin(Scalar(0)).squaredNorm();
    };
    auto const look = [&](int triangle) {
      auto const c = mesh.tissue().surface().corners(triangle);
      auto const foot = closest_to_origin<Scalar>(x.col(c[0]) - point, x.col(c[1]) - point, x.col(c[2]) - point);
      if (!(foot.squared_distance < limit)) return;
      limit = foot.squared_distance;
      best = {triangle, foot.barycentric, Vector(point + foot.point), std::sqrt(foot.squared_distance)};
    };
    auto const search = [&](auto const& self, int node) -> void {
      auto const& [child, cube] = mesh.grid().nodes()[static_cast<std::size_t>(node)];
      if (cube >= 0) return mesh.for_each_triangle(cube, look);
      std::array<std::pair<Scalar, int>, 8> near;
      std::size_t n = 0;
      for (int const one : child)
        if (one >= 0) {
          std::pair<Scalar, int> const here{squared_distance(one), one};
          std::size_t place = n++;
          for (; place > 0 && here < near[place - 1]; --place) near[place] = near[place - 1];
          near[place] = here;
        }
      for (std::size_t k = 0; k < n && near[k].first <= limit * slack; ++k) self(self, near[k].second);
    };
    search(search, 0);
    return best;
  }

 private:
  template <class Mesh>
  void fit(Mesh const& mesh) {
    auto const& nodes = mesh.grid().nodes();
    auto const x = mesh.positions();
    boxes_.resize(2 * static_cast<int>(nodes.size()));
    for (std::size_t n = nodes.size(); n-- > 0;) {
      Eigen::AlignedBox<Scalar, 3> box;
      if (int const c = nodes[n].cube; c >= 0) {
        mesh.for_each_triangle(c, [&](int t) {
          for (int const v : mesh.tissue().surface().corners(t)) box.extend(Vector(x.col(v)));
        });
      } else {
        for (int const child : nodes[n].child)   // one without skin has an empty box, which no search enters
          if (child >= 0 && boxes_[2 * child][0] <= boxes_[2 * child + 1][0]) box.extend(Vector(boxes_[2 * child])), box.extend(Vector(boxes_[2 * child + 1]));
      }
      boxes_[2 * static_cast<int>(n)] = box.min(), boxes_[2 * static_cast<int>(n) + 1] = box.max();
    }
    is_fitted_ = true;
  }

  Columns<Scalar, 3> boxes_;   // m, low and high of each node
  bool is_fitted_ = false;
};

}  // namespace palpate::detail
