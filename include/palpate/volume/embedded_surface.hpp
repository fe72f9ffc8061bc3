// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/surface_tree.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace palpate {

/// A fine skin that coarse tetrahedra carry: for pictures, picking and touch.
///   skin point = Σ_k w_k x_k,   w the barycentric coordinates at rest in the tetrahedron that holds it, else in that of the nearest face of the border
///
///   auto const scan = read_mesh("liver.stl", metres_per("mm"));
///   auto const solid = fill(scan, {.edge = 0.01});
///   EmbeddedSurface skin(scan, solid.mesh);
///   SoftBody body(FiniteElements(solid.mesh, …));
///   body.step(0.01), skin.update(body.positions());
///   auto const touched = skin.nearest(tip);
///   skin.for_each_weight(touched, [&](int particle, double weight) { body.apply_force(particle, weight * force); });
///
/// Units      m.
/// Invariant  weights of a point sum to 1, so a force that is spread by them keeps its sum, and its moment about any point; at rest, and after any affine
///            motion, the skin is exact.
/// Errors     InvalidMesh: a skin without triangles, corners that are no points; tetrahedra that are flat or none. InvalidArgument: another number of positions.
/// Cost       O(skin) an update with its normals; neither update nor nearest nor for_each_weight allocates, all are noexcept.
/// Limits     the skin follows the tetrahedra as they are made: it is not cut with them. Where it lies outside of them, by up to `farthest_outside`, it is carried on
///            past their border, and a turn of the border there is magnified.
template <RealScalar Scalar>
class EmbeddedSurface {
 public:
  using Vector = Vector3<Scalar>;

  EmbeddedSurface(TriangleMesh<Scalar> const& skin, TetrahedralMesh<Scalar> const& volume)
      : mesh_(skin), particles_(static_cast<int>(volume.points.cols())) {
    detail::check_corners(skin);
    detail::check_corners(volume);
    if (skin.triangles.cols() == 0) throw InvalidMesh("the skin has no triangles, so there is nothing to carry");
    if (volume.tetrahedra.cols() == 0) throw InvalidMesh("there are no tetrahedra to carry a skin");
    embed(volume);
    normals_ = vertex_normals(mesh_, NormalWeight::area);
    tree_ = SurfaceTree<Scalar>(mesh_);
  }

  /// The skin as it is now.
  TriangleMesh<Scalar> const& mesh() const noexcept { return mesh_; }
  /// Unit normals of its vertices, a column each, weighted by area.
  Matrix3X<Scalar> const& normals() const noexcept { return normals_; }
  /// How far it lies outside of the tetrahedra at rest, at most [m]: what of its shape they do not have.
  Scalar farthest_outside() const noexcept { return farthest_outside_; }

  /// Follows the particles, in the order of the tetrahedral mesh, to x (3 × particles); more columns than it had, those of later cuts, do not matter.
  template <class X>
  void update(X const& x) noexcept {
    eigen_assert(x.cols() >= particles_);
    for (Eigen::Index i = 0; i < mesh_.points.cols(); ++i) {
      Carrier const& carrier = carriers_[static_cast<std::size_t>(i)];
      Vector sum = Vector::Zero();
      for (std::size_t k = 0; k < 4; ++k) sum += carrier.weight[k] * x.col(carrier.particle[k]);
      mesh_.points.col(i) = sum;
    }
    normals_.setZero();
    for (Eigen::Index t = 0; t < mesh_.triangles.cols(); ++t) {
      Vector const a = mesh_.points.col(mesh_.triangles(0, t)), b = mesh_.points.col(mesh_.triangles(1, t)), c = mesh_.points.col(mesh_.triangles(2, t));
      Vector const n = triangle_area_vector(a, b, c);
      for (int k = 0; k < 3; ++k) normals_.col(mesh_.triangles(k, t)) += n;
    }
    for (Eigen::Index i = 0; i < normals_.cols(); ++i) {
      Vector sum = normals_.col(i);
      if (Scalar const largest = sum.cwiseAbs().maxCoeff(); largest > 0) sum /= largest, normals_.col(i) = sum.normalized();
    }
    tree_.refit(mesh_.points);
  }

  /// The nearest point of the skin as it is now; see SurfaceTree.
  SurfacePoint<Scalar> nearest(Vector const& query, int hint = -1) const noexcept { return tree_.nearest(mesh_.points, query, hint); }
  /// visit(particle, weight) for what carries a point of the skin, as nearest() gives it: up to twelve, a particle may come again. Of no point nothing.
  template <class Visit>
  void for_each_weight(SurfacePoint<Scalar> const& point, Visit&& visit) const noexcept {
    if (point.triangle < 0 || point.triangle >= mesh_.triangles.cols()) return;
    for (int c = 0; c < 3; ++c) {
      Carrier const& carrier = carriers_[static_cast<std::size_t>(mesh_.triangles(c, point.triangle))];
      for (std::size_t k = 0; k < 4; ++k) visit(carrier.particle[k], point.barycentric[c] * carrier.weight[k]);
    }
  }

 private:
  struct Carrier {
    std::array<int, 4> particle;
    std::array<Scalar, 4> weight;
  };

  static Matrix<double, 4, 1> coordinates(TetrahedralMesh<Scalar> const& volume, int t, Vector3<double> const& p) {
    Matrix<double, 3, 4> corner;
    for (int c = 0; c < 4; ++c) corner.col(c) = volume.points.col(volume.tetrahedra(c, t)).template cast<double>();
    Matrix<double, 3, 3> edges;
    for (int c = 0; c < 3; ++c) edges.col(c) = corner.col(c + 1) - corner.col(0);
    Vector3<double> const rest = edges.inverse() * (p - corner.col(0));
    if (!is_finite(rest)) throw InvalidMesh(detail::message("tetrahedron ", t, " is flat; `repair` drops it"));
    return {1 - rest.sum(), rest[0], rest[1], rest[2]};
  }

  void embed(TetrahedralMesh<Scalar> const& volume) {
    // Cells as long as the longest side of a tetrahedron's box; each knows the tetrahedra that reach into it.
    int const count = static_cast<int>(volume.tetrahedra.cols());
    auto const box_of = [&](int t) {
      Eigen::AlignedBox<double, 3> box;
      for (int c = 0; c < 4; ++c) box.extend(volume.points.col(volume.tetrahedra(c, t)).template cast<double>());
      return box;
    };
    for (int const v : volume.tetrahedra.reshaped())
      if (!is_finite(volume.points.col(v))) throw InvalidMesh(detail::message("vertex ", v, " of the tetrahedra is not finite; repair them first"));
    double cell = 0;
    for (int t = 0; t < count; ++t) cell = std::max(cell, box_of(t).sizes().maxCoeff());
    if (!(cell > 0)) throw InvalidMesh("the tetrahedra are flat, so they can carry nothing; `repair` drops them");
    Vector3<double> const origin = bounding_box(volume).min().template cast<double>();
    auto const place = [&](Vector3<double> const& p) {
      std::array<long long, 3> at;
      for (int k = 0; k < 3; ++k) at[static_cast<std::size_t>(k)] = static_cast<long long>(std::floor(std::clamp((p[k] - origin[k]) / cell, -1e6, 1e6))) + 1000000;
      return at;
    };
    auto const name = [](std::array<long long, 3> const& at) { return (at[2] * 2000003 + at[1]) * 2000003 + at[0]; };
    std::unordered_map<long long, std::vector<int>> cells;
    for (int t = 0; t < count; ++t) {
      auto const box = box_of(t);
      auto const low = place(box.min()), high = place(box.max());
      for (long long z = low[2]; z <= high[2]; ++z)
        for (long long y = low[1]; y <= high[1]; ++y)
          for (long long x = low[0]; x <= high[0]; ++x) cells[name({x, y, z})].push_back(t);
    }

    auto const border = surface(volume);
    SurfaceTree<Scalar> const outside(border);
    std::unordered_map<std::uint64_t, std::vector<int>> behind;   // tetrahedra at two corners of a face of the border
    for (int t = 0; t < count; ++t)
      for (int a = 0; a < 4; ++a)
        for (int b = a + 1; b < 4; ++b) behind[detail::edge_key(volume.tetrahedra(a, t), volume.tetrahedra(b, t))].push_back(t);

    carriers_.reserve(static_cast<std::size_t>(mesh_.points.cols()));
    int hint = -1;
    for (Eigen::Index i = 0; i < mesh_.points.cols(); ++i) {
      Vector3<double> const p = mesh_.points.col(i).template cast<double>();
      if (!is_finite(p)) throw InvalidMesh(detail::message("vertex ", i, " of the skin is not finite; repair it first"));
      int best = -1;
      double deepest = -1e-9;
      if (auto const found = cells.find(name(place(p))); found != cells.end())
        for (int const t : found->second)
          if (double const inside = coordinates(volume, t, p).minCoeff(); inside > deepest) best = t, deepest = inside;
      if (best < 0) {
        auto const nearest = outside.nearest(border.points, mesh_.points.col(i), hint);
        hint = nearest.triangle;
        farthest_outside_ = std::max(farthest_outside_, nearest.distance);
        auto const face = border.triangles.col(nearest.triangle);
        for (int const t : behind.at(detail::edge_key(face[0], face[1])))
          if ((volume.tetrahedra.col(t).array() == face[2]).any()) best = t;
      }
      Matrix<double, 4, 1> const weights = coordinates(volume, best, p);
      Carrier carrier;
      for (int k = 0; k < 4; ++k) {
        carrier.particle[static_cast<std::size_t>(k)] = volume.tetrahedra(k, best);
        carrier.weight[static_cast<std::size_t>(k)] = static_cast<Scalar>(weights[k]);
      }
      carriers_.push_back(carrier);
    }
  }

  TriangleMesh<Scalar> mesh_;
  int particles_;
  std::vector<Carrier> carriers_;
  Matrix3X<Scalar> normals_;
  SurfaceTree<Scalar> tree_;
  Scalar farthest_outside_ = 0;
};

}  // namespace palpate
