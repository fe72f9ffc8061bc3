// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/core/tensor3.hpp>
#include <palpate/material/concept.hpp>
#include <palpate/core/detail/semidefinite.hpp>
#include <palpate/material/principal_tangent.hpp>

#include <concepts>
#include <type_traits>
#include <utility>

namespace palpate::detail {

/// Column by column.
template <class T>
Tensor3<T> block_of(auto const& tangent, Direction<T> const& a, Direction<T> const& b) noexcept {
  T const o{};
  auto const along = [&](Tensor3<T> const& dF) {
    Tensor3<T> const P = tangent.stress_change(dF);
    return Direction<T>{P.xx * a.x + P.xy * a.y + P.xz * a.z, P.yx * a.x + P.yy * a.y + P.yz * a.z, P.zx * a.x + P.zy * a.y + P.zz * a.z};
  };
  Direction<T> const x = along({b.x, b.y, b.z, o, o, o, o, o, o}), y = along({o, o, o, b.x, b.y, b.z, o, o, o}), z = along({o, o, o, o, o, o, b.x, b.y, b.z});
  return {x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z};
}

/// A positive semidefinite part of a law's tangent at F, for many changes of F: what the law states; of an isotropic law that in the frames of its
/// principal stretches; of another the nearest, by the eigenvalues of its 9 × 9 matrix.
///   stress_change(dF)   what the stress changes by
///   turned(g)           directions, in rows, in a frame of its own; of those a and b
///   block(a, b)         what a change of F by e ⊗ b changes of the stress along a, as a matrix of e
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
  Tensor3<T> block(Direction<T> const& a, Direction<T> const& b) const noexcept { return block_of(*this, a, b); }
  Tensor3<T> stress_change(Tensor3<T> const& dF) const noexcept { return of(matrix * of(dF)); }

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

  SemidefiniteTangent(Law const& of, Tensor3<T> const& at) noexcept : law(of), F(at) {}
  Tensor3<T> turned(Tensor3<T> const& g) const noexcept { return g; }
  Tensor3<T> block(Direction<T> const& a, Direction<T> const& b) const noexcept { return block_of(*this, a, b); }
  Tensor3<T> stress_change(Tensor3<T> const& dF) const noexcept { return law.semidefinite_stress_change(F, dF); }
};
template <class T, class Law>
  requires(HasTangentLaw<Law, T> && !HasSemidefiniteStressChange<Law, T>)
struct SemidefiniteTangent<T, Law> : SemidefiniteTangent<T, std::remove_cvref_t<decltype(std::declval<Law const&>().tangent_law())>> {
  using Other = SemidefiniteTangent<T, std::remove_cvref_t<decltype(std::declval<Law const&>().tangent_law())>>;
  SemidefiniteTangent(Law const& law, Tensor3<T> const& F, auto const&... known_of_F) noexcept : Other(law.tangent_law(), F, known_of_F...) {}
};
template <class T, class Law>
  requires(IsIsotropicLaw<Law> && !HasSemidefiniteStressChange<Law, T> && !HasTangentLaw<Law, T>)
struct SemidefiniteTangent<T, Law> : PrincipalTangent<T> {
  using PrincipalTangent<T>::PrincipalTangent;
};

/// Whether that is found without eigenvalues of 9 × 9 matrices, which there are of single numbers alone.
template <class T, class Law>
inline constexpr bool has_known_tangent = HasSemidefiniteStressChange<Law, T> || IsIsotropicLaw<Law>;
template <class T, class Law>
  requires(HasTangentLaw<Law, T> && !HasSemidefiniteStressChange<Law, T>)
inline constexpr bool has_known_tangent<T, Law> = has_known_tangent<T, std::remove_cvref_t<decltype(std::declval<Law const&>().tangent_law())>>;

}  // namespace palpate::detail
