// SPDX-License-Identifier: MIT
// Elements as a user writes them: the element alone.
#pragma once

#include <palpate/tissue/element.hpp>

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace palpate_test {

using namespace palpate;

/// A tetrahedron of small strains ε = sym(∇u): σ = λ tr(ε) I + 2μ ε, constant in it; density [kg/m³].
template <RealScalar S>
struct UserTetrahedron {
  static constexpr int nodes = 4;
  using Columns = NodeColumns<S, 4>;
  using Block = Matrix<S, 3, 3>;

  Matrix<S, 4, 3> gradient;   // of the shape functions, 1/m
  S volume, lambda, mu, density;

  UserTetrahedron(Columns const& rest, S young, S poisson, S mass_density = 1000)
      : lambda(young * poisson / ((1 + poisson) * (1 - 2 * poisson))), mu(young / (2 * (1 + poisson))), density(mass_density) {
    Block const edges = rest.template rightCols<3>().colwise() - rest.col(0);
    gradient.template bottomRows<3>() = edges.inverse();
    gradient.row(0) = -gradient.template bottomRows<3>().colwise().sum();
    volume = edges.determinant() / 6;
  }
  Block strain(Columns const& x) const {
    Block const f = x * gradient;
    return (f + f.transpose()) / 2 - Block::Identity();
  }
  S energy(Columns const& x) const {
    Block const e = strain(x);
    return volume * (lambda / 2 * e.trace() * e.trace() + mu * e.squaredNorm());
  }
  Columns force(Columns const& x) const {
    Block const e = strain(x), stress = lambda * e.trace() * Block::Identity() + 2 * mu * e;
    return -volume * stress * gradient.transpose();
  }
  NodeMatrix<S, 4> stiffness(Columns const&) const {
    NodeMatrix<S, 4> k;
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b) {
        Vector3<S> const g = gradient.row(a), h = gradient.row(b);
        k.template block<3, 3>(3 * a, 3 * b) = volume * (lambda * g * h.transpose() + mu * h * g.transpose() + mu * g.dot(h) * Block::Identity());
      }
    return k;
  }
  S mass() const { return density * volume; }
};

/// A triangle of membrane, St. Venant–Kirchhoff in plane stress, with a damping in proportion to its stiffness at rest: large turns, and a tangent that is
/// not positive semidefinite under compression.
template <RealScalar S>
struct MembraneTriangle {
  static constexpr int nodes = 3;
  using Columns = NodeColumns<S, 3>;
  using Flat = Matrix<S, 2, 2>;
  using Gradient = Matrix<S, 3, 2>;

  Gradient gradient;   // of the shape functions, in a basis of the plane, 1/m
  S volume, lambda, mu, relaxation;

  MembraneTriangle(Columns const& rest, S young, S poisson, S thickness, S relaxation_time = 0)
      : lambda(young * poisson / (1 - poisson * poisson)), mu(young / (2 * (1 + poisson))), relaxation(relaxation_time) {
    Vector3<S> const a = rest.col(1) - rest.col(0), b = rest.col(2) - rest.col(0), u = a.normalized(), w = (b - b.dot(u) * u).normalized();
    Flat edges;
    edges << a.dot(u), b.dot(u), a.dot(w), b.dot(w);
    gradient.template bottomRows<2>() = edges.inverse();
    gradient.row(0) = -gradient.template bottomRows<2>().colwise().sum();
    volume = edges.determinant() / 2 * thickness;
  }
  Flat strain(Columns const& x) const {
    Gradient const f = x * gradient;
    return (f.transpose() * f - Flat::Identity()) / 2;
  }
  Flat stress(Flat const& e) const { return lambda * e.trace() * Flat::Identity() + 2 * mu * e; }
  S energy(Columns const& x) const {
    Flat const e = strain(x);
    return volume * (lambda / 2 * e.trace() * e.trace() + mu * e.squaredNorm());
  }
  Columns force(Columns const& x) const { return -volume * (x * gradient) * stress(strain(x)) * gradient.transpose(); }
  NodeMatrix<S, 3> stiffness(Columns const& x) const {
    Gradient const f = x * gradient;
    Flat const s = stress(strain(x));
    NodeMatrix<S, 3> k;
    for (int column = 0; column < 9; ++column) {
      Gradient change = Gradient::Zero();
      change.row(column % 3) = gradient.row(column / 3);
      Flat const stretch = (f.transpose() * change + change.transpose() * f) / 2;
      k.col(column) = Columns(volume * (change * s + f * stress(stretch)) * gradient.transpose()).reshaped();
    }
    return k;
  }
  NodeMatrix<S, 3> damping(Columns const& x) const {   // of the change of strain, so that turning is free
    Gradient const f = x * gradient;
    NodeMatrix<S, 3> c;
    for (int column = 0; column < 9; ++column) {
      Gradient change = Gradient::Zero();
      change.row(column % 3) = gradient.row(column / 3);
      c.col(column) = Columns(relaxation * volume * f * stress((f.transpose() * change + change.transpose() * f) / 2) * gradient.transpose()).reshaped();
    }
    return c;
  }
};

}  // namespace palpate_test
