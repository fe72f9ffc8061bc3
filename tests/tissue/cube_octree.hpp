// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/closest_point.hpp>
#include <palpate/collision/surface_tree.hpp>
#include <palpate/core/columns.hpp>
#include <palpate/core/matrix.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

namespace palpate_test {

/// The source's search for the cube that is hit: an octree above the cubes of a body, a box around the skin of those below each node, and depth first through
/// them, the nearer one first. Beside the box tree that bodies use.
template <class Body>
class CubeOctree {
 public:
  using Scalar = typename Body::Scalar;
  using Vector = palpate::Vector3<Scalar>;

  explicit CubeOctree(Body const& body) {
    std::vector<int> all;
    int width = 1;
    for (int c = 0; c < body.cubes(); ++c)
      all.push_back(c), width = std::max(width, 1 + *std::max_element(body.grid().place(c).begin(), body.grid().place(c).end()));
    divide(body, {0, 0, 0}, static_cast<int>(std::bit_ceil(static_cast<unsigned>(width))), all);
  }

  /// To be called after the body has moved, or its skin has changed.
  void fit(Body const& body) {
    auto const x = body.positions();
    boxes_.resize(2 * static_cast<int>(nodes_.size()));
    for (std::size_t n = nodes_.size(); n-- > 0;) {
      Eigen::AlignedBox<Scalar, 3> box;
      if (int const c = nodes_[n].cube; c >= 0) {
        body.for_each_triangle(c, [&](int t) {
          for (int const v : body.tissue().surface().corners(t)) box.extend(Vector(x.col(v)));
        });
      } else {
        for (int const child : nodes_[n].child)   // one without skin has an empty box, which no search enters
          if (child >= 0 && boxes_[2 * child][0] <= boxes_[2 * child + 1][0]) box.extend(Vector(boxes_[2 * child])), box.extend(Vector(boxes_[2 * child + 1]));
      }
      boxes_[2 * static_cast<int>(n)] = box.min(), boxes_[2 * static_cast<int>(n) + 1] = box.max();
    }
  }

  palpate::SurfacePoint<Scalar> nearest_point(Body const& body, Vector const& point) const {
    constexpr Scalar slack = 1 + 64 * std::numeric_limits<Scalar>::epsilon();
    palpate::SurfacePoint<Scalar> best;
    Scalar limit = std::numeric_limits<Scalar>::infinity();   // m², of the best
    auto const x = body.positions();
    auto const look = [&](int triangle) {
      auto const c = body.tissue().surface().corners(triangle);
      auto const foot = palpate::closest_point_on_triangle<Scalar>(point, x.col(c[0]), x.col(c[1]), x.col(c[2]));
      if (!(foot.squared_distance < limit)) return;
      limit = foot.squared_distance;
      best = {triangle, foot.barycentric, foot.point, std::sqrt(foot.squared_distance)};
    };
    auto const search = [&](auto const& self, int node) -> void {
      auto const& [child, cube] = nodes_[static_cast<std::size_t>(node)];
      if (cube >= 0) return body.for_each_triangle(cube, look);
      std::array<std::pair<Scalar, int>, 8> near;
      std::size_t n = 0;
      for (int const one : child)
        if (one >= 0) {
          Scalar const squared = (point - Vector(boxes_[2 * one])).cwiseMin(Vector(boxes_[2 * one + 1]) - point).cwiseMin(Scalar(0)).squaredNorm();
          std::pair<Scalar, int> const here{squared, one};
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
  struct Node {
    std::array<int, 8> child;   // −1: nothing there
    int cube = -1;              // of a leaf
  };

  int divide(Body const& body, std::array<int, 3> const& low, int width, std::vector<int> const& inside) {
    if (inside.empty()) return -1;
    std::size_t const own = nodes_.size();
    nodes_.push_back({{-1, -1, -1, -1, -1, -1, -1, -1}, width == 1 ? inside[0] : -1});
    if (width == 1) return static_cast<int>(own);
    for (std::size_t k = 0; k < 8; ++k) {
      std::array<int, 3> from = low;
      for (std::size_t a = 0; a < 3; ++a) from[a] += static_cast<int>(k >> a & 1) * width / 2;
      std::vector<int> part;
      for (int const c : inside) {
        auto const& place = body.grid().place(c);
        bool is_in = true;
        for (std::size_t a = 0; a < 3; ++a) is_in = is_in && place[a] >= from[a] && place[a] < from[a] + width / 2;
        if (is_in) part.push_back(c);
      }
      int const child = divide(body, from, width / 2, part);   // before nodes_ is asked: it grows
      nodes_[own].child[k] = child;
    }
    return static_cast<int>(own);
  }

  std::vector<Node> nodes_;                       // parents before children
  palpate::Columns<Scalar, 3> boxes_;   // m, low and high of each node
};

}  // namespace palpate_test
