// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/core/tensor3.hpp>

#include <concepts>
#include <cstddef>
#include <type_traits>
#include <utility>

namespace palpate {

namespace detail {

template <class L, class T>
concept HasEnergyDensity = requires(L const& law, Tensor3<T> const& F) { { law.energy(F) } -> std::convertible_to<T>; };
template <class L, class T>
concept HasStress = requires(L const& law, Tensor3<T> const& F) { { law.stress(F) } -> std::convertible_to<Tensor3<T>>; };
template <class L, class T>
concept HasStressChange = requires(L const& law, Tensor3<T> const& F) { { law.stress_change(F, F) } -> std::convertible_to<Tensor3<T>>; };

}  // namespace detail

/// What stress a deformation costs, of a hyperelastic material: ψ its energy per volume of the undeformed tissue [J/m³], F the deformation gradient.
///   energy(F) const → T                  ψ, 0 at F = 1
///   stress(F) const → Tensor3<T>         first Piola–Kirchhoff stress P = ∂ψ/∂F [Pa], 0 at F = 1
///   stress_change(F, dF) const           ∂P/∂F : dF
/// A template over its numbers, struct MyLaw<T> { T …; }, computes as many elements at once as a register holds; a law of plain numbers one after the
/// other. What the syntax can not say, and testing::check_material checks: the three belong together, and turning the tissue changes no energy.
template <class L, class T>
concept MaterialLaw = std::copyable<L> && detail::HasEnergyDensity<L, T> && detail::HasStress<L, T> && detail::HasStressChange<L, T>;

namespace detail {

template <class M>
concept HasLaw = requires(M const& material) { material.law(); };

template <class M>
struct LawOf {
  using type = M;
  static M of(M const& material) { return material; }
};
template <HasLaw M>
struct LawOf<M> {
  using type = std::remove_cvref_t<decltype(std::declval<M const&>().law())>;
  static type of(M const& material) { return material.law(); }
};

}  // namespace detail

/// What tissue is made of: a MaterialLaw, or what a user gives and has one, of numbers that are computed once.
///   law() const → L
template <class M, class Scalar>
concept Material = RealScalar<Scalar> && std::copyable<M> && MaterialLaw<typename detail::LawOf<M>::type, Scalar>;

namespace detail {

/// Says, where it is instantiated, what keeps M from being a Material of this scalar.
template <class M, class Scalar>
struct MaterialSentences {
  using L = typename LawOf<M>::type;
  static_assert(std::copyable<L>, "palpate: a material's law is copied into each element; give it a copy constructor and a copy assignment.");
  static constexpr bool is_other = !HasEnergyDensity<L, Scalar> && HasEnergyDensity<L, std::conditional_t<std::same_as<Scalar, float>, double, float>>;
  static_assert(!is_other, "palpate: the material computes in another scalar than the tissue; write both for double or both for float: FiniteElements<float, StableNeoHookean<float>>.");
  static_assert(is_other || HasEnergyDensity<L, Scalar>, "palpate: the material has no energy(F); declare: Scalar energy(Tensor3<Scalar> const& F) const, in J/m3 of the undeformed tissue, 0 at F = 1.");
  static_assert(is_other || HasStress<L, Scalar>, "palpate: the material has no stress(F); declare: Tensor3<Scalar> stress(Tensor3<Scalar> const& F) const, the first Piola-Kirchhoff stress in Pa.");
  static_assert(is_other || HasStressChange<L, Scalar>,
                "palpate: the material has no stress_change(F, dF); declare: Tensor3<Scalar> stress_change(Tensor3<Scalar> const& F, Tensor3<Scalar> const& dF) const, in Pa.");
};

}  // namespace detail

// --- what a law may answer besides ------------------------------------------------------------------------------------

/// Refinement: states a positive semidefinite part of its tangent: semidefinite_stress_change(F, dF), at F = 1 all of it. Of isotropic laws it follows (see IsIsotropicLaw),
/// of others each element's is found by eigenvalues.
template <class L, class T>
concept HasSemidefiniteStressChange = MaterialLaw<L, T> && requires(L const& law, Tensor3<T> const& F) {
  { law.semidefinite_stress_change(F, F) } -> std::convertible_to<Tensor3<T>>;
};

/// Refinement: says that its energy depends on the principal stretches alone: `static constexpr bool isotropic = true`.
template <class L>
concept IsIsotropicLaw = requires {
  { L::isotropic } -> std::convertible_to<bool>;
  requires L::isotropic;
};

/// Refinement: states its bulk modulus κ at small strain [Pa], so that averaged nodal pressure can take the place of its own: see Pressure::nodal.
template <class L, class T>
concept HasBulkModulus = MaterialLaw<L, T> && requires(L const& law) {
  { law.bulk_modulus() } -> std::convertible_to<T>;
};

/// Refinement: its tangent may be taken to be another law's, whose positive semidefinite part is known: tangent_law().
template <class L, class T>
concept HasTangentLaw = MaterialLaw<L, T> && requires(L const& law) {
  requires MaterialLaw<std::remove_cvref_t<decltype(law.tangent_law())>, T>;
};

/// Refinement: remembers what it went through: as a law that each element has a copy of, whose `faded` stress a PronyHistory moves on.
template <class L>
concept HasFadedStress = requires(L& law) {
  law.faded;
  law.tangent_law();
};

/// Refinement: refuses deformations that turn an element over, J = det F ≤ 0: accepts(J).
template <class L, class Scalar>
concept RefusesInversion = MaterialLaw<L, Scalar> && requires(L const& law, Scalar J) {
  { law.accepts(J) } -> std::same_as<bool>;
};

namespace detail {

template <template <class> class L, class T>
concept CanBeOver = requires { typename L<T>; };

/// The law over packs of its numbers, where it is a template over them.
template <class L, class T>
struct LawOver {};
template <template <class> class L, RealScalar S, class T>
  requires CanBeOver<L, T>
struct LawOver<L<S>, T> {
  using type = L<T>;
};

template <class L, class Scalar, class T>
concept IsLawOfNumbers = requires { typename LawOver<L, T>::type; } && MaterialLaw<typename LawOver<L, T>::type, T> && std::is_trivially_copyable_v<L> &&
                         sizeof(typename LawOver<L, T>::type) * sizeof(Scalar) == sizeof(L) * sizeof(T);

}  // namespace detail

}  // namespace palpate
