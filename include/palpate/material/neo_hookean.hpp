// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/simd.hpp>
#include <palpate/core/tensor3.hpp>
#include <palpate/material/isotropic.hpp>

namespace palpate {

/// Rubber's law with volume: ψ = μ/2 (F : F − 3) − μ ln J + λ/2 ln²J, P = μ F + (λ ln J − μ) F⁻ᵀ, J = det F.
/// Limits     J > 0: what is turned over has no energy; NaN then.
template <class T>
struct NeoHookeanLaw {
  T lambda, mu;   ///< Pa

  static constexpr bool isotropic = true;
  static NeoHookeanLaw of(LameConstants<T> const& lame) { return {lame.lambda, lame.mu}; }
  T bulk_modulus() const noexcept { return lambda + number<T>(2.0 / 3) * mu; }
  static bool accepts(T const& J) noexcept { return J > 0; }

  T energy(Tensor3<T> const& F) const noexcept {
    T const half = number<T>(0.5), log_J = logarithm(determinant(F, cofactor(F)));
    return half * mu * (double_contraction(F, F) - number<T>(3)) - mu * log_J + half * lambda * log_J * log_J;
  }
  Tensor3<T> stress(Tensor3<T> const& F) const noexcept {
    Tensor3<T> const cof = cofactor(F);
    T const J = determinant(F, cof);
    return mu * F + ((lambda * logarithm(J) - mu) / J) * cof;
  }
  Tensor3<T> stress_change(Tensor3<T> const& F, Tensor3<T> const& dF) const noexcept {
    Tensor3<T> const cof = cofactor(F);
    T const J = determinant(F, cof), tension = lambda * logarithm(J) - mu, dJ = double_contraction(cof, dF);
    return mu * dF + ((lambda - tension) * dJ / (J * J)) * cof + (tension / J) * cofactor_change(F, dF);
  }

 private:
  static T logarithm(T const& J) noexcept {
    T of;
    simd::logarithm(of, J);
    return of;
  }
};

template <RealScalar Scalar>
using NeoHookean = IsotropicMaterial<NeoHookeanLaw, Scalar>;

}  // namespace palpate
