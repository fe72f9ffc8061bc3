// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/tissue/element.hpp>
#include <palpate/tissue/linear_spring.hpp>
#include <palpate/tissue/spring_law.hpp>

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <variant>

namespace palpate {

/// The coefficients of a spring that holds a particle at its rest position.
/// Units      k [N/m], c [N·s/m].
template <RealScalar Scalar>
struct HomeSpring {
  Scalar stiffness = 0;
  Scalar damping = 0;
};

/// A spring with a damper along the line d between its ends: two particles, or one and a fixed point.
///   f_0 = −w (T(|d| − L) + c n·v) n,   d = x_0 − x_1 or x_0 − C,  n = d/|d|,  v the relative velocity;   f_1 = −f_0
///   K = w (s I + (T′ − s) n nᵀ),   C = w c n nᵀ,   s = T/|d|; positive semidefinite with max(0, T′) and max(0, s)
/// A compressed link's sideways softening is left out of the latter, and a falling tension counts as flat. How a damper's force turns with its
/// spring is left out of K.
/// Units      T [N], L [m], c [N·s/m]; w without: a cut leaves a lip only its own side's share.
/// Source     \cite zheng2006 eq. 5-9.
/// Limits     |d| = 0 has no direction: no force.
/// `LawType` is a SpringLaw, or a reference to one that is kept elsewhere.
template <RealScalar Scalar, class LawType, int Nodes>
struct AxialSpring {
  static_assert(Nodes == 1 || Nodes == 2, "AxialSpring: a spring has two ends; one of them may be a fixed point");
  static constexpr int nodes = Nodes;
  using Law = std::remove_cvref_t<LawType>;
  using Columns = NodeColumns<Scalar, Nodes>;
  using Matrix = NodeMatrix<Scalar, Nodes>;
  using Vector = Vector3<Scalar>;

  Scalar rest_length = 1;
  Scalar weight = 1;
  LawType law{};
  [[no_unique_address]] std::conditional_t<Nodes == 1, Vector, std::monostate> anchor{};   // C [m]

  Scalar energy(Columns const& x) const noexcept { return weight * energy_of(law, axis(x).norm() - rest_length, rest_length); }

  Columns force(Columns const& x) const noexcept { return force(x, Columns::Zero()); }
  Columns force(Columns const& x, Columns const& v) const noexcept {
    Vector n = axis(x);
    Scalar const length = n.norm();
    if (!(length > 0)) return Columns::Zero();
    n /= length;
    return opposed(-(weight * static_cast<Scalar>(tension(length) + static_cast<Scalar>(law.damping) * n.dot(difference(v)))) * n);
  }

  Matrix stiffness(Columns const& x) const noexcept { return tangent(x, false); }
  Matrix semidefinite_stiffness(Columns const& x) const noexcept { return tangent(x, true); }
  Columns stiffness_product(Columns const& x, Columns const& d) const noexcept {
    Vector n = axis(x);
    Scalar const length = n.norm();
    if (!(length > 0)) return Columns::Zero();
    n /= length;
    Scalar const along = weight * std::max(Scalar(0), slope(length)), across = weight * std::max(Scalar(0), tension(length)) / length;
    Vector const w = difference(d);
    return opposed(across * w + (along - across) * n.dot(w) * n);
  }

  Matrix damping(Columns const& x) const noexcept {
    Vector const d = axis(x);
    Scalar const squared_length = d.squaredNorm();
    if (!(squared_length > 0)) return Matrix::Zero();
    return opposed_blocks(weight * static_cast<Scalar>(law.damping) / squared_length * d * d.transpose());
  }
  Columns damping_product(Columns const& x, Columns const& v) const noexcept {
    Vector n = axis(x);
    Scalar const length = n.norm();
    if (!(length > 0)) return Columns::Zero();
    n /= length;
    return opposed(weight * static_cast<Scalar>(law.damping) * n.dot(difference(v)) * n);
  }

  /// Whatever its direction.
  Scalar stiffness_bound() const noexcept { return Nodes * weight * tangent_stiffness_of(law, Scalar(0), rest_length); }
  Scalar stiffness_bound(Columns const& x) const noexcept {
    Scalar const length = axis(x).norm();
    return Nodes * weight * std::max(std::abs(slope(length)), length > 0 ? std::abs(tension(length)) / length : Scalar(0));
  }
  Scalar damping_bound() const noexcept { return Nodes * weight * static_cast<Scalar>(law.damping); }

 private:
  Scalar tension(Scalar length) const noexcept { return static_cast<Scalar>(law.tension(length - rest_length, rest_length)); }
  Scalar slope(Scalar length) const noexcept { return tangent_stiffness_of(law, length - rest_length, rest_length); }

  Vector axis(Columns const& x) const noexcept {
    if constexpr (Nodes == 2)
      return x.col(0) - x.col(1);
    else
      return x - anchor;
  }
  static Vector difference(Columns const& columns) noexcept {
    if constexpr (Nodes == 2)
      return columns.col(0) - columns.col(1);
    else
      return columns;
  }
  static Columns opposed(Vector const& force) noexcept {
    Columns both;
    both.col(0) = force;
    if constexpr (Nodes == 2) both.col(1) = -force;
    return both;
  }
  static Matrix opposed_blocks(palpate::Matrix<Scalar, 3, 3> const& block) noexcept {
    Matrix all;
    for (int i = 0; i < Nodes; ++i)
      for (int j = 0; j < Nodes; ++j) all.template block<3, 3>(3 * i, 3 * j) = i == j ? block : -block;
    return all;
  }

  Matrix tangent(Columns const& x, bool semidefinite) const noexcept {
    Vector n = axis(x);
    Scalar const length = n.norm();
    if (!(length > 0)) return Matrix::Zero();
    n /= length;
    Scalar along = slope(length), across = tension(length) / length;
    if (semidefinite) along = std::max(Scalar(0), along), across = std::max(Scalar(0), across);
    return opposed_blocks(weight * (across * palpate::Matrix<Scalar, 3, 3>::Identity() + (along - across) * n * n.transpose()));
  }
};

/// Between two particles.
template <RealScalar Scalar, class Law = LinearSpring<Scalar>>
using LinkSpring = AxialSpring<Scalar, Law, 2>;

/// From a particle to a fixed point.
template <RealScalar Scalar, class Law = LinearSpring<Scalar>>
using SupportSpring = AxialSpring<Scalar, Law, 1>;

/// A home spring (anchor spring) with a damper, which holds one particle at X: f = −k (x − X) − c v.
/// Units      k [N/m], c [N·s/m], X [m].
/// Source     \cite zheng2006 eq. 5-11.
template <RealScalar Scalar>
struct AnchorSpring {
  static constexpr int nodes = 1;
  using Vector = Vector3<Scalar>;
  using Matrix = NodeMatrix<Scalar, 1>;

  Vector rest = Vector::Zero();   // X
  HomeSpring<Scalar> spring;

  Scalar energy(Vector const& x) const noexcept { return spring.stiffness / 2 * (x - rest).squaredNorm(); }
  Vector force(Vector const& x) const noexcept { return -spring.stiffness * (x - rest); }
  Vector force(Vector const& x, Vector const& v) const noexcept { return -spring.stiffness * (x - rest) - spring.damping * v; }
  Matrix stiffness(Vector const&) const noexcept { return spring.stiffness * Matrix::Identity(); }
  Vector stiffness_product(Vector const&, Vector const& d) const noexcept { return spring.stiffness * d; }
  Matrix damping(Vector const&) const noexcept { return spring.damping * Matrix::Identity(); }
  Vector damping_product(Vector const&, Vector const& v) const noexcept { return spring.damping * v; }
  Scalar stiffness_bound() const noexcept { return spring.stiffness; }
  Scalar stiffness_bound(Vector const&) const noexcept { return spring.stiffness; }
  Scalar damping_bound() const noexcept { return spring.damping; }
};

}  // namespace palpate
