// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/simd.hpp>
#include <palpate/core/tensor3.hpp>
#include <palpate/material/isotropic.hpp>

namespace palpate {

/// Rubber's law that has energy and stress for every F, flat and turned over too \cite smith2018:
///   ψ = m/2 (I − 3) + l/2 (J − α)² − m/2 ln(I + 1), less its value at F = 1, with I = F : F, J = det F,
///   P = m (1 − 1/(I + 1)) F + l (J − α) cof F.
/// Constants  m = 4μ/3, l = λ + 5μ/6, α = 1 + m/l − m/(4l): with them small strains obey Hooke's law with λ and μ. (With m = μ and l = λ the shear modulus
///            would be 3μ/4.)
template <class T>
struct StableNeoHookeanLaw {
  T m, l, alpha;

  static constexpr bool isotropic = true;
  static StableNeoHookeanLaw of(LameConstants<T> const& lame) {
    T const m = 4 * lame.mu / 3, l = lame.lambda + 5 * lame.mu / 6;
    return {m, l, 1 + 3 * m / (4 * l)};
  }
  T bulk_modulus() const noexcept { return l - number<T>(0.125) * m; }   // λ + 2μ/3

  T energy(Tensor3<T> const& F) const noexcept {
    T const half = number<T>(0.5), I = double_contraction(F, F), J = determinant(F, cofactor(F)), one = number<T>(1);
    T log_part;
    simd::logarithm(log_part, T((I + one) * number<T>(0.25)));
    T const volume = J - alpha, at_rest = one - alpha;
    return half * (m * (I - number<T>(3) - log_part) + l * (volume * volume - at_rest * at_rest));
  }
  Tensor3<T> stress(Tensor3<T> const& F) const noexcept {
    Tensor3<T> const cof = cofactor(F);
    T const I = double_contraction(F, F), J = determinant(F, cof);
    return (m * (I / (I + number<T>(1)))) * F + (l * (J - alpha)) * cof;
  }
  Tensor3<T> stress_change(Tensor3<T> const& F, Tensor3<T> const& dF) const noexcept {
    Tensor3<T> const cof = cofactor(F);
    T const I = double_contraction(F, F), J = determinant(F, cof), inverse = number<T>(1) / (I + number<T>(1));
    T const along = number<T>(2) * m * inverse * inverse * double_contraction(F, dF);
    return (m * (I * inverse)) * dF + along * F + (l * double_contraction(cof, dF)) * cof + (l * (J - alpha)) * cofactor_change(F, dF);
  }
};

template <RealScalar Scalar>
using StableNeoHookean = IsotropicMaterial<StableNeoHookeanLaw, Scalar>;

}  // namespace palpate
