// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/tensor3.hpp>
#include <palpate/material/isotropic.hpp>

namespace palpate {

/// Hooke's law of the small strain ε = (F + Fᵀ)/2 − 1: ψ = λ/2 tr²ε + μ ε : ε.
/// Limits     a turned body is strained: by 1 − cos θ, 1.5 % at 10°, 13 % at 30°. For tests, modes and comparisons.
template <class T>
struct LinearElasticLaw {
  T lambda, mu;   ///< Pa

  static LinearElasticLaw of(LameConstants<T> const& lame) { return {lame.lambda, lame.mu}; }

  T energy(Tensor3<T> const& F) const noexcept {
    Tensor3<T> const strain = symmetric_part(F) - Tensor3<T>::identity();
    T const volume = trace(strain);
    return number<T>(0.5) * lambda * volume * volume + mu * double_contraction(strain, strain);
  }
  Tensor3<T> stress(Tensor3<T> const& F) const noexcept { return stress_change(F, F - Tensor3<T>::identity()); }
  Tensor3<T> stress_change(Tensor3<T> const& /*F*/, Tensor3<T> const& dF) const noexcept {
    return Tensor3<T>::diagonal(lambda * trace(dF)) + (mu + mu) * symmetric_part(dF);
  }
  Tensor3<T> semidefinite_stress_change(Tensor3<T> const& F, Tensor3<T> const& dF) const noexcept { return stress_change(F, dF); }
};

template <RealScalar Scalar>
using LinearElastic = IsotropicMaterial<LinearElasticLaw, Scalar>;

}  // namespace palpate
