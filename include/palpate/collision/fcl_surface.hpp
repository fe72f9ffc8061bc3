// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/tool_shape.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <Eigen/Geometry>
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/math/bv/OBBRSS.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include <cstddef>
#include <limits>
#include <vector>

namespace palpate {

/// How far something is from a surface, and where both are nearest.
struct FclDistance {
  double distance = std::numeric_limits<double>::infinity();   // m
  int triangle = -1;         // of the surface asked; among equally near ones any
  Vector3<double> point = Vector3<double>::Zero();   // on that triangle
  int other_triangle = -1;   // of the other surface; −1 for a tool
  Vector3<double> other_point = Vector3<double>::Zero();
};

/// Two triangles that cut or touch each other: of the surface asked, and of the other one.
struct TrianglePair {
  int triangle;
  int other_triangle;
};

/// A triangle surface in the collision library FCL: distance and overlap with tools and with other surfaces.
///
/// For the contact of one tip per servo tick use `SurfaceTree`; this is for what FCL does beyond it, such as surface against surface,
/// and for hosts that have FCL scenes of their own (`model()`).
/// Units      m; poses map the other's coordinates to this surface's.
/// Source     FCL 0.7, bounding volumes OBBRSS. FCL is compiled for double only.
/// Accuracy   distances to rounding. FCL's own mesh-against-sphere and mesh-against-capsule queries leave the distance of overlapping pairs
///            unset; here a ball is asked as a point and a rod as a segment, and the radius is subtracted afterwards.
/// Limits     a surface is a sheet, not a solid: what lies inside a closed surface without touching it has a positive distance.
///            Queries allocate and may throw: not for the servo tick. Topology is fixed; after a cut, build a new one.
class FclSurface {
 public:
  using Model = fcl::BVHModel<fcl::OBBRSSd>;
  using Points = Eigen::Ref<Matrix3X<double> const, 0, Eigen::OuterStride<>>;

  /// Throws `InvalidMesh` when there is no triangle, a corner is not a vertex, or one is not finite.
  explicit FclSurface(TriangleMesh<double> const& mesh) {
    if (mesh.triangles.cols() == 0) throw InvalidMesh("a surface without triangles can not be searched; give at least one");
    std::vector<fcl::Triangle> triangles;
    triangles.reserve(static_cast<std::size_t>(mesh.triangles.cols()));
    for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
      for (int k = 0; k < 3; ++k) {
        int const corner = mesh.triangles(k, t);
        if (corner < 0 || corner >= mesh.points.cols())
          throw InvalidMesh(detail::message("triangle ", t, " has corner ", corner, ", but there are ", mesh.points.cols(),
                                            " points; renumber the triangles or pass all points"));
        if (!is_finite(mesh.points.col(corner)))
          throw InvalidMesh(detail::message("triangle ", t, " has corner ", corner,
                                            ", whose coordinates are not finite; repair the mesh first"));
      }
      triangles.emplace_back(static_cast<std::size_t>(mesh.triangles(0, t)), static_cast<std::size_t>(mesh.triangles(1, t)),
                             static_cast<std::size_t>(mesh.triangles(2, t)));
    }
    check(model_.beginModel(static_cast<int>(mesh.triangles.cols()), static_cast<int>(mesh.points.cols())));
    check(model_.addSubModel(columns(mesh.points), triangles));
    check(model_.endModel());
  }

  int triangles() const noexcept { return model_.num_tris; }
  int vertices() const noexcept { return model_.num_vertices; }
  Model const& model() const noexcept { return model_; }

  /// Moves the vertices and fits the bounding volumes; the tree stays. O(n log n): from the root down, since FCL 0.7's refit from the
  /// leaves up leaves volumes too small, and distances then come out too large.
  /// Throws `InvalidArgument` when the number of points is another, or one is not finite.
  void refit(Points const& points) {
    if (points.cols() != vertices())
      throw InvalidArgument(detail::message("refit with ", points.cols(), " points, but the surface has ", vertices(),
                                            "; after a change of topology build a new surface"));
    if (!is_finite(points)) throw InvalidArgument("refit with coordinates that are not finite; the surface keeps its old ones");
    check(model_.beginReplaceModel());
    check(model_.replaceSubModel(columns(points)));
    check(model_.endReplaceModel(true, false));
  }

  /// From the ball's surface to this one; negative when they overlap, −radius with the centre on the surface.
  FclDistance distance(SphereTip<double> const& tip, Vector3<double> const& centre) const {
    return tool_distance(centre, centre, tip.radius);
  }

  /// From the rod to the surface; negative when they overlap, −radius when the rod's axis meets the surface.
  FclDistance distance(Capsule<double> const& rod) const { return tool_distance(rod.from, rod.to, rod.radius); }

  /// From this surface to another one, zero when they cut each other.
  FclDistance distance(FclSurface const& other, Eigen::Isometry3d const& pose = Eigen::Isometry3d::Identity()) const {
    return model_distance(other.model_, pose);
  }

  bool touches(SphereTip<double> const& tip, Vector3<double> const& centre) const { return distance(tip, centre).distance <= 0; }
  bool touches(Capsule<double> const& rod) const { return distance(rod).distance <= 0; }

  /// The pairs of triangles where two surfaces cut each other, `at_most` so many; none when they are apart.
  std::vector<TrianglePair> collide(FclSurface const& other, Eigen::Isometry3d const& pose = Eigen::Isometry3d::Identity(),
                                    std::size_t at_most = std::numeric_limits<std::size_t>::max()) const {
    std::vector<TrianglePair> pairs;
    if (at_most == 0) return pairs;
    fcl::CollisionRequestd const request(at_most, false);
    fcl::CollisionResultd result;
    fcl::collide(&model_, Eigen::Isometry3d::Identity(), &other.model_, pose, request, result);
    pairs.reserve(result.numContacts());
    for (std::size_t i = 0; i < result.numContacts(); ++i) {
      auto const& contact = result.getContact(i);
      pairs.push_back({static_cast<int>(contact.b1), static_cast<int>(contact.b2)});
    }
    return pairs;
  }

 private:
  static std::vector<fcl::Vector3d> columns(Points const& points) {
    std::vector<fcl::Vector3d> list;
    list.reserve(static_cast<std::size_t>(points.cols()));
    for (Eigen::Index i = 0; i < points.cols(); ++i) list.emplace_back(points.col(i));
    return list;
  }

  static void check(int code) {
    if (code != fcl::BVH_OK)
      throw Error(detail::message("FCL refused to build or refit a surface: its code is ", code,
                                  "; −1 stands for memory, the others for a call out of order"));
  }

  FclDistance tool_distance(Vector3<double> const& from, Vector3<double> const& to, double radius) const {
    if (!is_finite(from) || !is_finite(to) || !(radius >= 0))
      throw InvalidArgument(detail::message("a tool of radius ", radius, " m, or its place, is not a finite shape; ",
                                            "give finite coordinates and radius ≥ 0"));
    Model tool;   // a triangle shrunk to a segment or a point
    check(tool.beginModel(1, 3));
    check(tool.addTriangle(from, to, to));
    check(tool.endModel());
    FclDistance found = model_distance(tool, Eigen::Isometry3d::Identity());
    found.distance -= radius;
    found.other_triangle = -1;
    return found;
  }

  FclDistance model_distance(Model const& other, Eigen::Isometry3d const& pose) const {
    fcl::DistanceRequestd const request(true);
    fcl::DistanceResultd result;
    fcl::distance(&model_, Eigen::Isometry3d::Identity(), &other, pose, request, result);
    FclDistance found;
    found.distance = result.min_distance;
    found.triangle = static_cast<int>(result.b1);
    found.point = result.nearest_points[0];
    found.other_triangle = static_cast<int>(result.b2);
    found.other_point = result.nearest_points[1];
    return found;
  }

  Model model_;
};

}  // namespace palpate
