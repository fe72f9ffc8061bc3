// SPDX-License-Identifier: MIT
// Two elements to copy: see docs/new_tissue.md. Positions x come as 3 × nodes [m]; energy [J], force [N], stiffness [N/m].
#pragma once

#include <palpate/tissue/element.hpp>

#include <Eigen/Geometry>
#include <Eigen/LU>

/// One node: a spring that holds a particle where it rests, f = −k (x − X) − c v.
struct OwnHome {
  static constexpr int nodes = 1;
  using Vector = palpate::Vector3<double>;
  using Square = palpate::NodeMatrix<double, 1>;

  Vector rest;   // X [m]
  double k, c;   // N/m, N·s/m

  double energy(Vector const& x) const { return k / 2 * (x - rest).squaredNorm(); }
  Vector force(Vector const& x) const { return -k * (x - rest); }
  Square stiffness(Vector const&) const { return k * Square::Identity(); }
  Square damping(Vector const&) const { return c * Square::Identity(); }   // optional
};

/// Three nodes: a triangle of a thin sheet that resists stretching, constant strain, the St. Venant–Kirchhoff law in plane stress:
///   F = Σ x_a ⊗ g_a,  E = (FᵀF − I)/2,  S = λ tr(E) I + 2μ E,  W = A h (λ/2 tr²(E) + μ E:E)
struct OwnMembrane {
  static constexpr int nodes = 3;
  using Columns = palpate::NodeColumns<double, 3>;
  using Flat = palpate::Matrix<double, 2, 2>;
  using Gradient = palpate::Matrix<double, 3, 2>;

  Gradient gradient;           // row a: g_a, of node a's shape function along two axes of the plane [1/m]
  double volume, lambda, mu;   // m³, Pa, Pa

  OwnMembrane(Columns const& rest, double young, double poisson, double thickness)
      : lambda(young * poisson / (1 - poisson * poisson)), mu(young / (2 * (1 + poisson))) {
    palpate::Vector3<double> const a = rest.col(1) - rest.col(0), b = rest.col(2) - rest.col(0), u = a.normalized(), w = (b - b.dot(u) * u).normalized();
    Flat edges;
    edges << a.dot(u), b.dot(u), a.dot(w), b.dot(w);
    gradient.bottomRows<2>() = edges.inverse();
    gradient.row(0) = -gradient.row(1) - gradient.row(2);
    volume = edges.determinant() / 2 * thickness;
  }

  Flat strain(Columns const& x) const {
    Gradient const f = x * gradient;
    return (f.transpose() * f - Flat::Identity()) / 2;
  }
  Flat stress(Flat const& e) const { return lambda * e.trace() * Flat::Identity() + 2 * mu * e; }

  double energy(Columns const& x) const {
    Flat const e = strain(x);
    return volume / 2 * e.cwiseProduct(stress(e)).sum();
  }
  Columns force(Columns const& x) const { return -volume * (x * gradient) * stress(strain(x)) * gradient.transpose(); }
  palpate::NodeMatrix<double, 3> stiffness(Columns const& x) const {
    Gradient const f = x * gradient;
    Flat const s = stress(strain(x));
    palpate::NodeMatrix<double, 3> k;
    for (int column = 0; column < 9; ++column) {   // one node moves along one axis
      Gradient moved = Gradient::Zero();
      moved.row(column % 3) = gradient.row(column / 3);
      Columns const pull = volume * (moved * s + f * stress((f.transpose() * moved + moved.transpose() * f) / 2)) * gradient.transpose();
      k.col(column) = pull.reshaped();
    }
    return k;
  }
};

// If one of these fails, the compiler says which member is missing, or has other arguments.
static_assert(palpate::Element<OwnHome, double> && palpate::HasElementDamping<OwnHome, double>);
static_assert(palpate::Element<OwnMembrane, double>);
