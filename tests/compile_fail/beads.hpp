// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/palpate.hpp>

#include <cstddef>
#include <span>
#include <vector>

/// Tissue that has forces but no way to change its surface: particles on home springs of 10 N/m.
class Beads {
 public:
  using Scalar = double;

  class Assembly {
   public:
    std::span<int const> particles() const { return particles_; }
    template <class X, class V, class F>
    void add_forces(X const& x, V const&, F& f) const {
      for (std::size_t k = 0; k < particles_.size(); ++k) {
        auto const i = static_cast<Eigen::Index>(k);
        f.col(i) -= 10.0 * (x.col(i) - rest_[k]);
      }
    }

   private:
    friend Beads;
    std::vector<int> particles_;
    std::vector<palpate::Vector3<double>> rest_;
  };

  explicit Beads(palpate::TriangleMesh<double> const& mesh)
      : points_(mesh.points), surface_(static_cast<int>(mesh.points.cols()), mesh.triangles) {}

  int size() const { return static_cast<int>(points_.cols()); }
  std::size_t revision() const { return 0; }
  palpate::Vector3<double> rest_position(int i) const { return points_.col(i); }
  double mass(int) const { return 0.1; }
  bool nailed(int) const { return false; }
  template <class Visit>
  void for_each_neighbour(int, Visit) const {}
  palpate::SurfaceTopology const& surface() const { return surface_; }
  void assemble(std::span<int const> moving, Assembly& assembly) const {
    assembly.particles_.assign(moving.begin(), moving.end());
    assembly.rest_.clear();
    for (int const i : moving) assembly.rest_.push_back(rest_position(i));
  }
  template <class X, class V>
  palpate::Vector3<double> internal_force(int i, X const& x, V const&) const {
    return -10.0 * (x.col(i) - points_.col(i));
  }
  double stiffness_bound(int) const { return 10.0; }
  double damping_bound(int) const { return 0.0; }

 private:
  palpate::Matrix3X<double> points_;
  palpate::SurfaceTopology surface_;
};
