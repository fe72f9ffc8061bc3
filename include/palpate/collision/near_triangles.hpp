// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace palpate {

/// Pairs of triangles of one surface that may meet, for as long as it moves little: they are looked for anew when it moved farther, or was edited.
///
///   NearTriangles<double> near;
///   near.follow(skin, reach);                       // each tick
///   near.visit(skin, margin, [&](int a, int b) { … });
///
/// Pairs      have no vertex in common, and boxes that are not farther from each other than a margin, much less than the reach. Those that an edge joins are visited
///            where their normals are opposite alone: a surface that is not folded has none.
/// Order      by numbers, whatever was looked for when: what is visited depends on the points alone.
/// Units      m.
/// Cost       O(triangles) a visit; a search now and then, when a vertex moved by half the reach against the others. Allocates until its memory has the size that is needed.
template <RealScalar Scalar>
class NearTriangles {
  using Vector = Vector3<Scalar>;

 public:
  /// What the next follow() finds has to be looked for.
  void forget() noexcept { points_.resize(3, 0); }

  /// `skin` has topology, points and visit_triangles_in_box(low, high, visit).
  template <class Surface>
  void follow(Surface&& skin, Scalar reach) {
    if (points_.cols() == skin.points.cols() && points_.cols() > 0) {
      Vector const way = (skin.points - points_).rowwise().mean();   // a body that flies does not come nearer to itself
      if (((skin.points - points_).colwise() - way).colwise().squaredNorm().maxCoeff() <= Scalar(0.24) * reach * reach) return;
    }
    points_ = skin.points, pairs_.clear(), ring_.assign(static_cast<std::size_t>(points_.cols()), -1);
    for (int a = 0; a < skin.topology.triangle_count(); ++a) {
      auto const c = skin.topology.corners(a);
      Vector const p = points_.col(c[0]), q = points_.col(c[1]), r = points_.col(c[2]), margin = Vector::Constant(reach);
      std::size_t const begin = pairs_.size();
      for (int const vertex : c)
        for (int const t : skin.topology.triangles_at(vertex))
          for (int const other : skin.topology.corners(t)) ring_[static_cast<std::size_t>(other)] = a;
      skin.visit_triangles_in_box(p.cwiseMin(q).cwiseMin(r) - margin, p.cwiseMax(q).cwiseMax(r) + margin, [&](int b) {
        if (b <= a) return;
        bool is_near = false;
        for (int const vertex : skin.topology.corners(b)) {
          if (vertex == c[0] || vertex == c[1] || vertex == c[2]) return;
          is_near = is_near || ring_[static_cast<std::size_t>(vertex)] == a;
        }
        pairs_.push_back({a, b, is_near});
      });
      std::sort(pairs_.begin() + static_cast<std::ptrdiff_t>(begin), pairs_.end(), [](Pair const& one, Pair const& two) { return one.b < two.b; });
    }
  }

  /// visit(a, b), a < b.
  template <class Surface, class Visit>
  void visit(Surface const& skin, Scalar margin, Visit const& visit) {
    boxes_.resize(static_cast<std::size_t>(skin.topology.triangle_count()));
    for (std::size_t t = 0; t < boxes_.size(); ++t) {
      auto const c = skin.topology.corners(static_cast<int>(t));
      Vector const p = skin.points.col(c[0]), q = skin.points.col(c[1]), r = skin.points.col(c[2]);
      Vector const wider = Vector::Constant(margin);
      boxes_[t] = {p.cwiseMin(q).cwiseMin(r), p.cwiseMax(q).cwiseMax(r) + wider, (q - p).cross(r - p)};
    }
    for (auto const& [a, b, is_near] : pairs_) {
      Box const &one = boxes_[static_cast<std::size_t>(a)], &two = boxes_[static_cast<std::size_t>(b)];
      if (is_near && one.normal.dot(two.normal) >= 0) continue;
      if ((one.low.array() <= two.high.array()).all() && (two.low.array() <= one.high.array()).all()) visit(a, b);
    }
  }

  std::size_t size() const noexcept { return pairs_.size(); }   ///< pairs that are watched

 private:
  struct Pair {
    int a, b;
    bool is_near;
  };
  struct Box {
    Vector low, high, normal;
  };
  Matrix3X<Scalar> points_;   // m, where they were looked for
  std::vector<Pair> pairs_;
  std::vector<int> ring_;     // of each vertex the last triangle that it is a neighbour of
  std::vector<Box> boxes_;    // of each triangle
};

}  // namespace palpate
