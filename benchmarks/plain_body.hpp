// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/mesh/edges.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <vector>

namespace benchmarks {

/// The same for every particle and link.
struct Coefficients {
  double mass_per_particle = 3e-4;   // kg
  double link = 100.0, link_damping = 0.02, home = 10.0, home_damping = 0.05;   // N/m, N s/m
};

template <palpate::RealScalar S>
palpate::MassSpring<S> tissue_of(palpate::TriangleMesh<S> const& mesh, Coefficients const& c) {
  return {mesh, {.mass = {.total = S(c.mass_per_particle * static_cast<double>(mesh.points.cols())), .lumping = palpate::Lumping::equal},
                 .link = {.stiffness = S(c.link), .damping = S(c.link_damping)},
                 .home = {.stiffness = S(c.home), .damping = S(c.home_damping)}}};
}

/// The peer of the library's body: the same springs and the same leapfrog as one would write them first, edge by edge into a 3 × n
/// matrix of forces.
template <palpate::RealScalar S>
class PlainBody {
 public:
  PlainBody(palpate::TriangleMesh<S> const& mesh, Coefficients const& c)
      : home_(S(c.home)), home_damping_(S(c.home_damping)), inverse_mass_(S(1 / c.mass_per_particle)), rest_(mesh.points), x_(mesh.points),
        v_(palpate::Matrix3X<S>::Zero(3, x_.cols())), middle_v_(v_), a_(v_), force_(v_), applied_(v_) {
    for (auto const& [a, b] : palpate::edges(mesh)) edges_.push_back({a, b, (x_.col(a) - x_.col(b)).norm(), S(c.link), S(c.link_damping)});
  }

  void push(int i, palpate::Vector3<S> const& force) { applied_.col(i) = force; }

  void advance(S h) {
    x_ += h / 2 * v_;
    middle_v_ = v_ + h / 2 * a_;
    accelerate();
    v_ += h * a_;
    x_ += h / 2 * v_;
  }

  palpate::Matrix3X<S> const& positions() const { return x_; }

 private:
  struct Edge {
    int a, b;
    S rest_length, stiffness, damping;
  };

  void accelerate() {
    force_ = applied_ - home_ * (x_ - rest_) - home_damping_ * middle_v_;
    for (Edge const& e : edges_) {
      palpate::Vector3<S> const d = x_.col(e.a) - x_.col(e.b);
      S const length = d.norm();
      palpate::Vector3<S> const n = d / length;
      palpate::Vector3<S> const pull =
          (e.stiffness * (length - e.rest_length) + e.damping * n.dot(middle_v_.col(e.a) - middle_v_.col(e.b))) * n;
      force_.col(e.a) -= pull;
      force_.col(e.b) += pull;
    }
    a_ = inverse_mass_ * force_;
  }

  S home_, home_damping_, inverse_mass_;
  palpate::Matrix3X<S> rest_, x_, v_, middle_v_, a_, force_, applied_;
  std::vector<Edge> edges_;
};

}  // namespace benchmarks
