// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/core/tensor3.hpp>
#include <palpate/material/concept.hpp>
#include <palpate/core/detail/semidefinite.hpp>
#include <palpate/material/principal_tangent.hpp>

#include <concepts>

namespace palpate::detail {

/// A positive semidefinite part of a law's tangent at F, for many changes of F: what the law states; of an isotropic law that in the frames of its
/// principal stretches; of another the nearest, by the eigenvalues of its 9 × 9 matrix.
///   stress_change(dF)         what the stress changes by
///   scale(factor)             so many times that
///   turned(g)                 gradients in a frame of its own; dF from those, what the stress changes by there: turned().change(dF);
///                             turned().curvatures(x, y, z, use): dF : change(dF) of dF = e_c ⊗ (x, y, z), c = 0, 1, 2
template <class T, class Law>
struct SemidefiniteTangent {
  static_assert(std::floating_point<T>);
  using Nine = Matrix<T, 9, 1>;
  Matrix<T, 9, 9> matrix;

  SemidefiniteTangent(Law const& law, Tensor3<T> const& F) noexcept {
    for (int k = 0; k < 9; ++k) matrix.col(k) = of(law.stress_change(F, of(Nine::Unit(k))));
    matrix = semidefinite_part<T, 9>(matrix);
  }
  Tensor3<T> turned(Tensor3<T> const& g) const noexcept { return g; }
  SemidefiniteTangent const& turned() const noexcept { return *this; }
  Tensor3<T> change(Tensor3<T> const& dF) const noexcept { return stress_change(dF); }
  template <class Use>
  void curvatures(T const& x, T const& y, T const& z, Use const& use) const noexcept {
    T const o{};
    auto const of_one = [&](Tensor3<T> const& dF) { return double_contraction(dF, stress_change(dF)); };
    use(of_one({x, y, z, o, o, o, o, o, o}), of_one({o, o, o, x, y, z, o, o, o}), of_one({o, o, o, o, o, o, x, y, z}));
  }
  Tensor3<T> stress_change(Tensor3<T> const& dF) const noexcept { return of(matrix * of(dF)); }
  void scale(T const& by) noexcept { matrix *= by; }

 private:
  static Nine of(Tensor3<T> const& a) noexcept {
    Nine all;
    all << a.xx, a.xy, a.xz, a.yx, a.yy, a.yz, a.zx, a.zy, a.zz;
    return all;
  }
  static Tensor3<T> of(Nine const& a) noexcept { return {a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8]}; }
};
template <class T, class Law>
  requires HasSemidefiniteStressChange<Law, T>
struct SemidefiniteTangent<T, Law> {
  Law law;
  Tensor3<T> F;
  T factor = number<T>(1);

  SemidefiniteTangent(Law const& of, Tensor3<T> const& at) noexcept : law(of), F(at) {}
  void scale(T const& by) noexcept { factor = by; }
  Tensor3<T> turned(Tensor3<T> const& g) const noexcept { return g; }
  SemidefiniteTangent const& turned() const noexcept { return *this; }
  Tensor3<T> change(Tensor3<T> const& dF) const noexcept { return stress_change(dF); }
  template <class Use>
  void curvatures(T const& x, T const& y, T const& z, Use const& use) const noexcept {
    T const o{};
    auto const of_one = [&](Tensor3<T> const& dF) { return double_contraction(dF, stress_change(dF)); };
    use(of_one({x, y, z, o, o, o, o, o, o}), of_one({o, o, o, x, y, z, o, o, o}), of_one({o, o, o, o, o, o, x, y, z}));
  }
  Tensor3<T> stress_change(Tensor3<T> const& dF) const noexcept { return factor * law.semidefinite_stress_change(F, dF); }
};
template <class T, class Law>
  requires(IsIsotropicLaw<Law> && !HasSemidefiniteStressChange<Law, T>)
struct SemidefiniteTangent<T, Law> : PrincipalTangent<T> {
  using PrincipalTangent<T>::PrincipalTangent;
  Tensor3<T> turned(Tensor3<T> const& g) const noexcept { return g * this->V; }
  TurnedTangent<T> const& turned() const noexcept { return *this; }
};

}  // namespace palpate::detail
