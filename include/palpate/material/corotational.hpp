// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/simd.hpp>
#include <palpate/core/tensor3.hpp>
#include <palpate/material/isotropic.hpp>

#include <algorithm>
#include <limits>
#include <type_traits>

namespace palpate {

/// The rotation R of F = R S, S symmetric, its determinant positive: that which turns F nearest to 1. What is turned over has one too: then the
/// smallest principal stretch of S is the negative one.
/// How        s = tr S is the largest root of s⁴ − 2 I s² − 8 J s + I² − 4 K, I = |F|², J = det F, K = |cof F|²; Newton's steps come down to it from √(3 I).
///            With q = (s² − I)/2 the theorem of Cayley and Hamilton, as \cite hoger1984 use it for S, gives R = ((s² − q) F + s cof F − F FᵀF)/(s q − J),
///            without S and without memory.
/// Limits     where the two smallest stretches cancel, σ₂ = −σ₃, no rotation is nearest; it is finite there.
template <class T>
struct RotationOf {
  Tensor3<T> R;
  T trace;     ///< of S
  T divisor;   ///< (s₁ + s₂)(s₂ + s₃)(s₃ + s₁) of the principal stretches

  explicit RotationOf(Tensor3<T> const& F) noexcept {
    Tensor3<T> const cof = cofactor(F);
    T const I = double_contraction(F, F), J = determinant(F, cof), K = double_contraction(cof, cof);
    T lowest;
    find(I, J, K, lowest, [](T const& value, T& slope) {
      simd::raise_to(slope, number<T>(1e-30));
      return T(value / slope);
    });
    if (!simd::all_below(T(lowest - divisor), NumberOf<T>(0))) find_double_root(I, J, K, lowest);
    simd::raise_to(lowest, number<T>(1e-30));
    simd::raise_to(divisor, lowest);
    R = (number<T>(1) / divisor) * ((number<T>(0.5) * (trace * trace + I) * F + trace * cof) - F * (transpose(F) * F));   // s² − q = (s² + I)/2
  }

 private:
  static constexpr double least_share = sizeof(NumberOf<T>) == 8 ? 3e-8 : 1e-3;   // of the divisor in I s: below it the two smaller roots have no digits, about √ε

  template <class StepOf>
  void find(T const& I, T const& J, T const& K, T& lowest, StepOf const& step_of) noexcept {
    constexpr double epsilon = std::numeric_limits<NumberOf<T>>::epsilon();
    T& s = trace;
    simd::square_root(s, T(number<T>(3) * I));
    for (int k = 0; k < 30; ++k) {
      T const squared = s * s, two_I = I + I;
      T const value = squared * (squared - two_I) - number<T>(8) * J * s + (I * I - number<T>(4) * K);
      T slope = number<T>(4) * (s * (squared - I) - (J + J));   // eight times the divisor
      T step = step_of(value, slope);
      simd::raise_to(step, T{});   // only down; NaN stays where it is
      s -= step;
      if (simd::all_below(T(step - number<T>(4 * epsilon) * s), std::numeric_limits<NumberOf<T>>::min())) break;
    }
    divisor = s * (number<T>(0.5) * (s * s - I)) - J;
    lowest = number<T>(least_share) * I * s;
  }
  /// Where two roots come together Newton's steps run past them and away: they stop where the slope is no more than rounding.
  [[gnu::noinline]] void find_double_root(T const& I, T const& J, T const& K, T& lowest) noexcept {
    find(I, J, K, lowest, [&](T const& value, T& slope) {
      T const least = number<T>(8 * least_share) * I * trace;
      simd::raise_to(slope, T{});
      T divided = slope * slope + least * least;
      simd::raise_to(divided, number<T>(1e-37));
      return T(value * slope / divided);
    });
  }
};

/// Hooke's law in the frame of the nearest rotation R: ψ = μ |F − R|² + λ/2 (tr S − 3)², P = 2μ (F − R) + λ (tr S − 3) R.
template <class T>
struct CorotationalLaw {
  T lambda, mu;   ///< Pa

  static constexpr bool isotropic = true;
  static CorotationalLaw of(LameConstants<T> const& lame) { return {lame.lambda, lame.mu}; }
  T bulk_modulus() const noexcept { return lambda + number<T>(2.0 / 3) * mu; }

  T energy(Tensor3<T> const& F) const noexcept {
    RotationOf<T> const rotation(F);
    Tensor3<T> const strain = F - rotation.R;
    T const volume = rotation.trace - number<T>(3);
    return mu * double_contraction(strain, strain) + number<T>(0.5) * lambda * volume * volume;
  }
  Tensor3<T> stress(Tensor3<T> const& F) const noexcept {
    RotationOf<T> const rotation(F);
    return (mu + mu) * (F - rotation.R) + (lambda * (rotation.trace - number<T>(3))) * rotation.R;
  }
  /// With the change of the rotation, R [G⁻¹ a]×, G = tr(S) 1 − S, a the axis of RᵀdF − dFᵀR.
  Tensor3<T> stress_change(Tensor3<T> const& F, Tensor3<T> const& dF) const noexcept {
    RotationOf<T> const rotation(F);
    Tensor3<T> const& R = rotation.R;
    Tensor3<T> const A = transpose(R) * dF;
    Tensor3<T> const G = Tensor3<T>::diagonal(rotation.trace) - symmetric_part(transpose(R) * F), inverse = cofactor(G);   // times the divisor
    T const ax = A.zy - A.yz, ay = A.xz - A.zx, az = A.yx - A.xy;
    T const x = (inverse.xx * ax + inverse.xy * ay + inverse.xz * az) / rotation.divisor, y = (inverse.yx * ax + inverse.yy * ay + inverse.yz * az) / rotation.divisor,
            z = (inverse.zx * ax + inverse.zy * ay + inverse.zz * az) / rotation.divisor;
    Tensor3<T> const turn{T{}, T{} - z, y, z, T{}, T{} - x, T{} - y, x, T{}};
    T const pull = lambda * (rotation.trace - number<T>(3)) - (mu + mu);
    return (mu + mu) * dF + (lambda * trace(A)) * R + pull * (R * turn);
  }
};

template <RealScalar Scalar>
using Corotational = IsotropicMaterial<CorotationalLaw, Scalar>;

}  // namespace palpate
