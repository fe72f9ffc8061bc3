// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/closest_point.hpp>
#include <palpate/collision/detail/box_tree.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

namespace palpate {

/// A point on a surface: where a tool touches, or the nearest place to a query.
///   point = Σ barycentric[k] · corner k of the triangle
/// Invariant  triangle < 0 means "nothing found": then the distance is infinite and the rest is zero.
template <RealScalar Scalar>
struct SurfacePoint {
  int triangle = -1;
  Vector3<Scalar> barycentric = Vector3<Scalar>::Zero();
  Vector3<Scalar> point = Vector3<Scalar>::Zero();
  Scalar distance = std::numeric_limits<Scalar>::infinity();   // m, from the query, never negative

  bool found() const noexcept { return triangle >= 0; }
};

/// Finds the nearest point and the nearest vertex of a triangle surface that deforms and is cut, and where two surfaces may meet.
///
/// A tree of axis-aligned boxes over the triangles, four children a node. It is built once, for the rest shape. When the surface
/// deforms, the boxes are fitted again from the leaves up while the tree stays: `refit`. When a cutter edits triangles the tree is
/// patched: `add`, `replace`, `divide`, `relabel`, `remove`. Points are not stored: every call is given the current ones.
///
///   SurfaceTree<double> tree(skin.points, skin.triangles);
///   body.step(h);
///   tree.refit(body.positions());
///   SurfacePoint<double> const touched = tree.nearest(body.positions(), tip);
///
/// Units      any one length unit (m).
/// Shapes     points 3 × n, one column per vertex: a Matrix, a Map or a Block, with an outer stride if need be. Another expression is
///            accepted and evaluated into a temporary matrix, which allocates.
/// Exact      the triangle, or vertex, with the smallest distance as computed in `Scalar`; the lowest index among equals. The
///            answer does not depend on the hint, on the order of edits, nor on how far the surface has moved since the build.
/// Invariant  triangles are numbered 0 … size() − 1 without gaps. Queries are right when each triangle whose corners moved was
///            refitted, or edited, with the same points since.
/// Cost       build O(m log m); refit O(m), or O(moved · log m); nearest about O(log m), also for large deformation as long as the
///            surface keeps its neighbourhoods; edits O(log m). Queries and refits are noexcept and do not allocate: allowed in the
///            servo tick. Edits allocate only beyond what was reserved.
/// Limits     the depth is at most `depth_limit`, so the traversal's stack has a fixed size; an edit that would go deeper builds the tree anew,
///            O(m log m); it takes hundreds of edits in one place. A query that is not finite finds nothing. Triangles with a corner that is
///            not finite are never found. Points must have a column for each corner: not checked in queries and refits (Eigen asserts in debug builds).
/// Threads    any number of queries at once, while no refit and no edit runs.
template <RealScalar Scalar>
class SurfaceTree {
  using Tree = detail::BoxTree<Scalar>;

 public:
  using Points = typename Tree::Points;
  using Corners = std::array<int, 3>;
  static constexpr int depth_limit = Tree::depth_limit;

  /// No triangles yet.
  SurfaceTree() = default;

  /// Builds the tree for the points as they are, normally the rest shape.
  /// Throws `InvalidMesh` when a corner is not a column of `points`, or not finite.
  SurfaceTree(Points const& points, Eigen::Ref<Matrix<int, 3, Dynamic> const> const& triangles) {
    for (Eigen::Index t = 0; t < triangles.cols(); ++t)
      for (int k = 0; k < 3; ++k) check_corner<InvalidMesh>(points, static_cast<int>(t), triangles(k, t));
    tree_.build(points, triangles);
  }

  explicit SurfaceTree(TriangleMesh<Scalar> const& mesh) : SurfaceTree(mesh.points, mesh.triangles) {}

  int size() const noexcept { return tree_.size(); }
  bool empty() const noexcept { return size() == 0; }

  /// The vertices of a triangle as the tree knows them. Throws `OutOfRange`.
  Corners corners(int triangle) const {
    detail::check_index("triangle", triangle, size());
    return tree_.corners(triangle);
  }

  /// Fits all boxes to the points.
  void refit(Points const& points) noexcept { tree_.refit(points); }

  /// Fits the boxes of the triangles that moved, and those above them until one does not change. Indices outside the tree are ignored.
  void refit(Points const& points, std::span<int const> moved) noexcept {
    for (int const triangle : moved)
      if (has(triangle)) tree_.refit_leaf_of(points, triangle);
  }

  /// The nearest point of the surface. `hint` is a triangle that is likely near, such as the last answer: it saves time, and
  /// changes nothing else; any other value is ignored.
  SurfacePoint<Scalar> nearest(Points const& points, Vector3<Scalar> const& query, int hint = -1) const noexcept {
    SurfacePoint<Scalar> nearest;
    if (empty() || !is_finite(query)) return nearest;
    // A computed foot point may leave its box by the rounding of coordinates as large as the farthest corner's.
    Scalar const rounding = 16 * std::numeric_limits<Scalar>::epsilon() * tree_.farthest(query);
    auto const widened = [&](Scalar squared) {
      Scalar const distance = std::sqrt(squared) + rounding;
      return distance * distance * relative_slack;
    };
    Scalar best = std::numeric_limits<Scalar>::infinity();
    Scalar limit = best;
    auto const consider = [&](int const* corner, int triangle) {
      auto const foot = detail::closest_to_origin<Scalar>(points.col(corner[0]) - query, points.col(corner[1]) - query,
                                                          points.col(corner[2]) - query);
      if (foot.squared_distance < best ||
          (foot.squared_distance == best && (nearest.triangle < 0 || triangle < nearest.triangle))) {
        best = foot.squared_distance;
        limit = widened(best);
        nearest.triangle = triangle;
        nearest.barycentric = foot.barycentric;
        nearest.point = foot.point;
      }
    };
    if (has(hint)) consider(tree_.corners(hint).data(), hint);
    tree_.search(query, limit, consider);
    if (nearest.found()) {
      Corners const corner = tree_.corners(nearest.triangle);
      nearest.point = detail::foot_point<Scalar>(query, nearest.barycentric, nearest.point, points.col(corner[0]),
                                                 points.col(corner[1]), points.col(corner[2]));
      nearest.distance = std::sqrt(best);
    }
    return nearest;
  }

  /// The nearest of the vertices that triangles use, the lowest index among equals; −1 when there is none or the query is not finite.
  int nearest_vertex(Points const& points, Vector3<Scalar> const& query, int hint = -1) const noexcept {
    if (empty() || !is_finite(query)) return -1;
    int vertex = -1;
    Scalar best = std::numeric_limits<Scalar>::infinity();
    Scalar limit = best;
    auto const consider = [&](int const* corner) {
      for (int k = 0; k < 3; ++k) {
        Scalar const squared = (points.col(corner[k]) - query).squaredNorm();
        if (squared < best || (squared == best && (vertex < 0 || corner[k] < vertex))) {
          best = squared;
          vertex = corner[k];
          limit = best * relative_slack;
        }
      }
    };
    if (has(hint)) consider(tree_.corners(hint).data());
    tree_.search(query, limit, [&](int const* corner, int /*triangle*/) { consider(corner); });
    return vertex;
  }

  /// Calls visit(triangle) for all triangles that may meet a box, or the straight way between two points: those in whose boxes that is, and some beside them.
  template <class Visit>
  void visit_in_box(Vector3<Scalar> const& low, Vector3<Scalar> const& high, Visit&& visit) const {
    detail::Box<Scalar> const box{low, high};
    tree_.visit_where([&](auto const& other) { return box.overlaps(other); }, [&](int const* /*corner*/, int triangle) { visit(triangle); });
  }
  template <class Visit>
  void visit_along(Vector3<Scalar> const& from, Vector3<Scalar> const& to, Visit&& visit) const {
    tree_.visit_where([&](auto const& box) { return box.may_meet(from, to); }, [&](int const* /*corner*/, int triangle) { visit(triangle); });
  }

  /// Calls visit(triangle, triangle of the other) once for each pair of triangles whose boxes overlap or touch: those that may meet. Both
  /// trees have to fit points in one frame. A tree and itself give each pair both ways, and each triangle with itself.
  template <class Visit>
  void visit_overlaps(Points const& points, SurfaceTree const& other, Points const& others_points, Visit&& visit) const {
    tree_.overlaps(points, other.tree_, others_points, visit);
  }

  /// Room for so many triangles: edits up to there do not allocate. Worth it before a cut in a running simulation.
  void reserve(int triangles) { tree_.reserve(triangles); }

  /// Adds a triangle with index size(), which is returned. `sibling` is a triangle beside or around it, as the one that a cutter
  /// splits: the new one shares its leaf. Without sibling it is the triangle nearest to the first corner.
  /// Throws `OutOfRange`, or `InvalidArgument` for a corner that is not finite; then nothing changed.
  int add(Points const& points, Corners const& corners, int sibling = -1) {
    check_corners(points, size(), corners);
    if (sibling != -1) detail::check_index("sibling triangle", sibling, size());
    if (sibling < 0) sibling = std::max(nearest(points, points.col(corners[0])).triangle, 0);
    return tree_.add(points, corners, sibling);
  }

  /// Gives a triangle other corners. Throws as `add`.
  void replace(Points const& points, int triangle, Corners const& corners) {
    detail::check_index("triangle", triangle, size());
    check_corners(points, triangle, corners);
    tree_.relabel(triangle, corners);
    tree_.refit_leaf_of(points, triangle);
  }

  /// Gives a triangle other corners that lie where those before did: the boxes stay. Throws as `add`.
  void relabel(Points const& points, int triangle, Corners const& corners) {
    detail::check_index("triangle", triangle, size());
    check_corners(points, triangle, corners);
    tree_.relabel(triangle, corners);
  }

  /// Removes a triangle; the last one takes its index, as in a mesh that stays dense. Throws `OutOfRange`.
  void remove(Points const& points, int triangle) {
    detail::check_index("triangle", triangle, size());
    tree_.remove(points, triangle);
  }

  /// The number of levels of boxes between the root and the deepest leaf, 0 when empty.
  int depth() const noexcept { return tree_.depth(); }

  /// True when the tree holds exactly these triangles and its boxes fit these points: for tests of those who edit it. O(m).
  bool matches(Points const& points, Eigen::Ref<Matrix<int, 3, Dynamic> const> const& triangles) const {
    return tree_.matches(points, triangles);
  }

 private:
  // Bounds and distances are rounded differently: a box is skipped only when it is farther by more than the rounding.
  static constexpr Scalar relative_slack = 1 + 16 * std::numeric_limits<Scalar>::epsilon();

  bool has(int triangle) const noexcept { return triangle >= 0 && triangle < size(); }

  template <class Exception>
  static void check_corner(Points const& points, int triangle, int corner) {
    if (corner < 0 || corner >= points.cols())
      throw Exception(detail::message("triangle ", triangle, " has corner ", corner, ", but there are ", points.cols(),
                                      " points; renumber the triangles or pass all points"));
    if (auto const point = points.col(corner); !std::isfinite(0 * point[0] + 0 * point[1] + 0 * point[2]))   // one test for three
      throw Exception(detail::message("triangle ", triangle, " has corner ", corner,
                                      ", whose coordinates are not finite; repair the mesh first"));
  }

  /// The same for three corners, with one look where nothing is wrong.
  static void check_corners(Points const& points, int triangle, Corners const& corners) {
    auto const is_column = [&](int corner) { return corner >= 0 && corner < points.cols(); };
    if (is_column(corners[0]) && is_column(corners[1]) && is_column(corners[2])) {
      Vector3<Scalar> const sum = points.col(corners[0]) + points.col(corners[1]) + points.col(corners[2]);
      if (0 * (sum[0] + sum[1] + sum[2]) == 0) return;
    }
    for (int const corner : corners) check_corner<InvalidArgument>(points, triangle, corner);
  }

  Tree tree_;
};

}  // namespace palpate
