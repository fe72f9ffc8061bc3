// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/mesh/surface_topology.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

namespace palpate_test {

/// As little of a body as what looks at a surface needs: points that can be moved by hand, and the triangles between them.
template <palpate::RealScalar S>
class Skin {
 public:
  using Scalar = S;
  struct Matter {
    palpate::SurfaceTopology triangles;
    palpate::SurfaceTopology const& surface() const noexcept { return triangles; }
  };

  explicit Skin(palpate::TriangleMesh<S> const& mesh)
      : points(mesh.points), rates(palpate::Matrix3X<S>::Zero(3, mesh.points.cols())),
        matter_{{static_cast<int>(mesh.points.cols()), mesh.triangles}} {}

  auto positions() const noexcept { return Eigen::Map<palpate::Matrix3X<S> const>(points.data(), 3, points.cols()); }
  auto velocities() const noexcept { return Eigen::Map<palpate::Matrix3X<S> const>(rates.data(), 3, rates.cols()); }
  Matter const& tissue() const noexcept { return matter_; }

  palpate::Matrix3X<S> points, rates;   // m, m/s

 private:
  Matter matter_;
};

}  // namespace palpate_test
