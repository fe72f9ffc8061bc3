// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/tensor3.hpp>
#include <palpate/material/concept.hpp>

#include <type_traits>

namespace palpate {

/// A law whose own resistance to volume, κ/2 (J − 1)², is taken out, under a pressure p from outside instead (tension is positive):
///   ψ − κ/2 (J − 1)² + p (J − 1)
/// Source     \cite bonet1998, averaged nodal pressure.
template <class T, class Law>
struct WithPressure {
  Law law;
  T bulk, pressure;   ///< Pa

  static constexpr bool isotropic = IsIsotropicLaw<Law>;

  auto tangent_law() const noexcept
    requires HasTangentLaw<Law, T>
  {
    return WithPressure<T, std::remove_cvref_t<decltype(law.tangent_law())>>{law.tangent_law(), bulk, pressure};
  }
  T energy(Tensor3<T> const& F) const noexcept {
    T const volume = determinant(F, cofactor(F)) - number<T>(1);
    return law.energy(F) + (pressure - number<T>(0.5) * bulk * volume) * volume;
  }
  Tensor3<T> stress(Tensor3<T> const& F) const noexcept {
    Tensor3<T> const cof = cofactor(F);
    return law.stress(F) + (pressure - bulk * (determinant(F, cof) - number<T>(1))) * cof;
  }
  Tensor3<T> stress_change(Tensor3<T> const& F, Tensor3<T> const& dF) const noexcept {
    Tensor3<T> const cof = cofactor(F);
    T const left = pressure - bulk * (determinant(F, cof) - number<T>(1));
    return law.stress_change(F, dF) + left * cofactor_change(F, dF) - (bulk * double_contraction(cof, dF)) * cof;
  }
};

}  // namespace palpate
