// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>
#include <vector>

namespace palpate::detail {

/// Barycentric coordinates of p; not finite where the tetrahedron is flat.
inline Matrix<double, 4, 1> weights_in(std::array<Vector3<double>, 4> const& corners, Vector3<double> const& p) noexcept {
  Vector3<double> const a = corners[1] - corners[0], b = corners[2] - corners[0], c = corners[3] - corners[0], d = p - corners[0];
  double const volume = a.cross(b).dot(c);
  Matrix<double, 4, 1> w;
  w[1] = d.cross(b).dot(c) / volume, w[2] = a.cross(d).dot(c) / volume, w[3] = a.cross(b).dot(d) / volume;
  w[0] = 1 - w[1] - w[2] - w[3];
  return w;
}

/// Finds the tetrahedron that holds a point: cells as long as the longest side of a tetrahedron's box; each knows the tetrahedra that reach into it.
/// Errors     InvalidMesh: vertices that are not finite, tetrahedra that are flat; of the latter the first that is asked.
template <RealScalar Scalar>
class TetrahedronCells {
 public:
  explicit TetrahedronCells(TetrahedralMesh<Scalar> const& volume) : volume_(volume), origin_(bounding_box(volume).min().template cast<double>()) {
    for (int const v : volume.tetrahedra.reshaped())
      if (!is_finite(volume.points.col(v))) throw InvalidMesh(message("vertex ", v, " of the tetrahedra is not finite; repair them first"));
    int const count = static_cast<int>(volume.tetrahedra.cols());
    for (int t = 0; t < count; ++t) cell_ = std::max(cell_, box_of(t).sizes().maxCoeff());
    if (!(cell_ > 0)) throw InvalidMesh("the tetrahedra are flat, so they can carry nothing; `repair` drops them");
    for (int t = 0; t < count; ++t) {
      auto const box = box_of(t);
      auto const low = place(box.min()), high = place(box.max());
      for (long long z = low[2]; z <= high[2]; ++z)
        for (long long y = low[1]; y <= high[1]; ++y)
          for (long long x = low[0]; x <= high[0]; ++x) cells_[name({x, y, z})].push_back(t);
    }
  }

  double size() const noexcept { return cell_; }   // m
  Matrix<double, 4, 1> weights(int t, Vector3<double> const& p) const {
    auto const corner = [&](int k) { return Vector3<double>(volume_.points.col(volume_.tetrahedra(k, t)).template cast<double>()); };
    auto const w = weights_in({corner(0), corner(1), corner(2), corner(3)}, p);
    if (!is_finite(w)) throw InvalidMesh(message("tetrahedron ", t, " is flat; `repair` drops it"));
    return w;
  }
  /// −1: none.
  int find(Vector3<double> const& p) const {
    int best = -1;
    double deepest = -1e-9;
    if (auto const found = cells_.find(name(place(p))); found != cells_.end())
      for (int const t : found->second)
        if (double const inside = weights(t, p).minCoeff(); inside > deepest) best = t, deepest = inside;
    return best;
  }

 private:
  using Place = std::array<long long, 3>;

  Eigen::AlignedBox<double, 3> box_of(int t) const {
    Eigen::AlignedBox<double, 3> box;
    for (int c = 0; c < 4; ++c) box.extend(volume_.points.col(volume_.tetrahedra(c, t)).template cast<double>());
    return box;
  }
  Place place(Vector3<double> const& p) const noexcept {
    auto const at = [&](int k) { return static_cast<long long>(std::floor(std::clamp((p[k] - origin_[k]) / cell_, -1e6, 1e6))) + 1000000; };
    return {at(0), at(1), at(2)};
  }
  static long long name(Place const& at) noexcept { return (at[2] * 2000003 + at[1]) * 2000003 + at[0]; }

  TetrahedralMesh<Scalar> const& volume_;
  Vector3<double> origin_;
  double cell_ = 0;
  std::unordered_map<long long, std::vector<int>> cells_;
};

}  // namespace palpate::detail
