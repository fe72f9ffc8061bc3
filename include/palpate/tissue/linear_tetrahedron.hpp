// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/core/tensor3.hpp>
#include <palpate/material/concept.hpp>
#include <palpate/material/semidefinite_tangent.hpp>
#include <palpate/tissue/element.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace palpate {

namespace detail {

/// −V P g for the three nodes whose gradients are the rows of `gradients`, as the rows of a tensor.
template <class T>
[[gnu::always_inline]] inline Tensor3<T> nodal_forces(Tensor3<T> const& P, Tensor3<T> const& gradients, T const& volume) noexcept {
  return (T{} - volume) * (gradients * transpose(P));
}

}  // namespace detail

/// A tetrahedron of constant strain, total Lagrangian: what does not change is computed as it is made. With ∇N_a the gradients of the shape functions of
/// nodes 1 … 3 at rest and V the volume there, F = Σ_a (x_a − x_0) ⊗ ∇N_a, and the force on node a is −V P(F) ∇N_a; node 0 takes what is left.
/// Source     \cite bonet2008 ch. 9.
template <RealScalar Scalar, MaterialLaw<Scalar> Law>
class LinearTetrahedron {
 public:
  static constexpr int nodes = 4;
  using Columns = NodeColumns<Scalar, 4>;

  /// Its nodes at rest [m], (x₁ − x₀) × (x₂ − x₀) · (x₃ − x₀) > 0; density in kg/m³.
  LinearTetrahedron(Columns const& rest, Law const& law, Scalar density) : law_(law), density_(density) {
    Tensor3<Scalar> const edges = rows(rest), cof = cofactor(edges);
    Scalar const six_volumes = determinant(edges, cof);
    volume_ = six_volumes / 6;
    gradients_ = (1 / six_volumes) * cof;
  }

  Scalar volume() const noexcept { return volume_; }
  Scalar mass() const noexcept { return density_ * volume_; }
  /// kg/m³ at rest.
  Scalar density() const noexcept { return density_; }
  Law const& law() const noexcept { return law_; }
  Law& law() noexcept { return law_; }
  /// ∇N of nodes 1, 2, 3 [1/m], in rows.
  Tensor3<Scalar> const& gradients() const noexcept { return gradients_; }

  Tensor3<Scalar> deformation_gradient(Columns const& x) const noexcept { return transpose(rows(x)) * gradients_; }
  Scalar energy(Columns const& x) const noexcept { return volume_ * law_.energy(deformation_gradient(x)); }
  Columns force(Columns const& x) const noexcept { return columns(detail::nodal_forces(law_.stress(deformation_gradient(x)), gradients_, volume_)); }
  NodeMatrix<Scalar, 4> stiffness(Columns const& x) const noexcept {
    Tensor3<Scalar> const F = deformation_gradient(x);
    return matrix([&](Tensor3<Scalar> const& dF) { return law_.stress_change(F, dF); });
  }
  NodeMatrix<Scalar, 4> semidefinite_stiffness(Columns const& x) const noexcept {
    auto const tangent = tangent_at(x);
    return matrix([&](Tensor3<Scalar> const& dF) { return tangent.stress_change(dF); });
  }
  /// Of the 3 × 3 blocks of stiffness(rest). Where F is a multiple of the identity an isotropic law's stress changes by a tr(dF) 1 + b dF + c dFᵀ, and with g and h
  /// the gradients of two nodes their block is V (a g hᵀ + c h gᵀ + b (g · h) 1). In the plane of both that is 2 × 2, and its norm is found at once.
  Matrix<Scalar, 4, 4> block_norms_at_rest(Columns const& rest) const noexcept
    requires IsIsotropicLaw<Law>
  {
    Tensor3<Scalar> const F = deformation_gradient(rest);
    Scalar const off = std::max({std::abs(F.xy), std::abs(F.xz), std::abs(F.yx), std::abs(F.yz), std::abs(F.zx), std::abs(F.zy), std::abs(F.yy - F.xx), std::abs(F.zz - F.xx)});
    if (!(off * off <= std::numeric_limits<Scalar>::epsilon() * F.xx * F.xx)) return detail::block_norms<Scalar, 12>(stiffness(rest));
    Tensor3<Scalar> const dP = law_.stress_change(F, {1, 1, 0, 0, 0, 0, 0, 0, 0});
    Scalar const a = volume_ * dP.yy, b = volume_ * dP.xy, c = volume_ * dP.yx;
    Columns const all = columns(gradients_);   // ∇N of all four
    Matrix<Scalar, 4, 4> const dots = all.transpose().lazyProduct(all);
    Matrix<Scalar, 4, 4> norms;
    for (int i = 0; i < 4; ++i)
      for (int j = i; j < 4; ++j) {
        // [p, a s; c s, q] with s = |g × h|: the sum and the difference of its singular values σ₁ ± σ₂ are the roots of |·|² ± 2 |det|.
        Scalar const dot = dots(i, j), squared = std::max(Scalar(0), dots(i, i) * dots(j, j) - dot * dot), p = (a + b + c) * dot, q = b * dot;
        Scalar const sum = p * p + q * q + (a * a + c * c) * squared, twice = 2 * std::abs(p * q - a * c * squared);
        norms(i, j) = norms(j, i) = (std::sqrt(sum + twice) + std::sqrt(std::max(Scalar(0), sum - twice))) / 2;
      }
    return norms;
  }
  /// The same of a law that remembers, where nothing has faded.
  Matrix<Scalar, 4, 4> block_norms_at_rest(Columns const& rest) const
    requires HasFadedStress<Law>
  {
    return detail::block_norms_at_rest(with_law(law_.tangent_law()), rest);
  }
  /// That without the matrix; it has no damping.
  Columns stiffness_product(Columns const& x, Columns const& d) const noexcept {
    return -columns(detail::nodal_forces(tangent_at(x).stress_change(deformation_gradient(d)), gradients_, volume_));
  }
  Columns force(Columns const& x, Columns const& /*v*/) const noexcept { return force(x); }
  Columns damping_product(Columns const& /*x*/, Columns const& /*v*/) const noexcept { return Columns::Zero(); }

  /// V ∂J/∂x, a column a node: how its volume grows with their places [m²].
  Columns volume_gradient(Columns const& x) const noexcept { return -columns(detail::nodal_forces(cofactor(deformation_gradient(x)), gradients_, volume_)); }
  /// V J, the volume that it has.
  Scalar volume(Columns const& x) const noexcept {
    Tensor3<Scalar> const F = deformation_gradient(x);
    return volume_ * determinant(F, cofactor(F));
  }

  /// The same tetrahedron of another law.
  template <MaterialLaw<Scalar> Other>
  LinearTetrahedron<Scalar, Other> with_law(Other const& law) const noexcept {
    return {law, density_, volume_, gradients_};
  }

 private:
  template <RealScalar S, MaterialLaw<S> L>
  friend class LinearTetrahedron;
  LinearTetrahedron(Law const& law, Scalar density, Scalar volume, Tensor3<Scalar> const& gradients) noexcept
      : law_(law), density_(density), volume_(volume), gradients_(gradients) {}

  detail::SemidefiniteTangent<Scalar, Law> tangent_at(Columns const& x) const noexcept { return {law_, deformation_gradient(x)}; }

  /// x₁ − x₀, x₂ − x₀, x₃ − x₀ in rows.
  static Tensor3<Scalar> rows(Columns const& x) noexcept {
    return {x(0, 1) - x(0, 0), x(1, 1) - x(1, 0), x(2, 1) - x(2, 0), x(0, 2) - x(0, 0), x(1, 2) - x(1, 0), x(2, 2) - x(2, 0),
            x(0, 3) - x(0, 0), x(1, 3) - x(1, 0), x(2, 3) - x(2, 0)};
  }
  static Columns columns(Tensor3<Scalar> const& f) noexcept {
    Columns all;
    all << -(f.xx + f.yx + f.zx), f.xx, f.yx, f.zx, -(f.xy + f.yy + f.zy), f.xy, f.yy, f.zy, -(f.xz + f.yz + f.zz), f.xz, f.yz, f.zz;
    return all;
  }
  template <class Change>
  NodeMatrix<Scalar, 4> matrix(Change const& stress_change) const noexcept {
    NodeMatrix<Scalar, 4> all;
    Tensor3<Scalar> const& g = gradients_;
    std::array<std::array<Scalar, 3>, 3> const gradient{{{g.xx, g.xy, g.xz}, {g.yx, g.yy, g.yz}, {g.zx, g.zy, g.zz}}};
    all.template leftCols<3>().setZero();
    for (int k = 3; k < 12; ++k) {   // a move of one of the nodes 1 … 3 along an axis: one row of F; node 0 takes what is left
      auto const& [x, y, z] = gradient[static_cast<std::size_t>(k / 3 - 1)];
      int const axis = k % 3;
      Tensor3<Scalar> const dF = axis == 0 ? Tensor3<Scalar>{x, y, z, 0, 0, 0, 0, 0, 0} : axis == 1 ? Tensor3<Scalar>{0, 0, 0, x, y, z, 0, 0, 0} : Tensor3<Scalar>{0, 0, 0, 0, 0, 0, x, y, z};
      Columns const pull = columns(detail::nodal_forces(stress_change(dF), gradients_, volume_));
      all.col(k) = -Eigen::Map<Matrix<Scalar, 12, 1> const>(pull.data());
      all.col(axis) -= all.col(k);
    }
    return all;
  }

  Law law_;
  Scalar density_, volume_;
  Tensor3<Scalar> gradients_;
};

}  // namespace palpate
