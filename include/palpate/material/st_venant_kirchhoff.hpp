// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/tensor3.hpp>
#include <palpate/material/isotropic.hpp>

namespace palpate {

/// Hooke's law of Green's strain E = (FᵀF − 1)/2: ψ = λ/2 tr²E + μ E : E, P = F (λ tr(E) 1 + 2μ E).
/// Limits     collapses under pressure: its uniaxial stress (E/2)(λ³ − λ) is least at a stretch of 1/√3.
template <class T>
struct StVenantKirchhoffLaw {
  T lambda, mu;   ///< Pa

  static constexpr bool isotropic = true;
  static StVenantKirchhoffLaw of(LameConstants<T> const& lame) { return {lame.lambda, lame.mu}; }
  T bulk_modulus() const noexcept { return lambda + number<T>(2.0 / 3) * mu; }

  T energy(Tensor3<T> const& F) const noexcept {
    Tensor3<T> const E = strain(F);
    T const volume = trace(E);
    return number<T>(0.5) * lambda * volume * volume + mu * double_contraction(E, E);
  }
  Tensor3<T> stress(Tensor3<T> const& F) const noexcept { return F * second_stress(strain(F)); }
  Tensor3<T> stress_change(Tensor3<T> const& F, Tensor3<T> const& dF) const noexcept {
    return dF * second_stress(strain(F)) + F * second_stress(symmetric_part(transpose(F) * dF));
  }

 private:
  static Tensor3<T> strain(Tensor3<T> const& F) noexcept {
    T const half = number<T>(0.5), one = number<T>(1);
    T const xy = half * (F.xx * F.xy + F.yx * F.yy + F.zx * F.zy), xz = half * (F.xx * F.xz + F.yx * F.yz + F.zx * F.zz),
            yz = half * (F.xy * F.xz + F.yy * F.yz + F.zy * F.zz);
    return {half * (F.xx * F.xx + F.yx * F.yx + F.zx * F.zx - one), xy, xz, xy, half * (F.xy * F.xy + F.yy * F.yy + F.zy * F.zy - one), yz, xz, yz,
            half * (F.xz * F.xz + F.yz * F.yz + F.zz * F.zz - one)};
  }
  /// The second Piola–Kirchhoff stress of a strain.
  Tensor3<T> second_stress(Tensor3<T> const& E) const noexcept { return Tensor3<T>::diagonal(lambda * trace(E)) + (mu + mu) * E; }
};

template <RealScalar Scalar>
using StVenantKirchhoff = IsotropicMaterial<StVenantKirchhoffLaw, Scalar>;

}  // namespace palpate
