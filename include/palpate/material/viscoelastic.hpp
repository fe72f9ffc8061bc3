// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/tensor3.hpp>
#include <palpate/material/concept.hpp>
#include <palpate/material/isotropic.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace palpate {

/// One term of a Prony series: this share of the deviatoric stress fades with this time.
template <RealScalar Scalar>
struct PronyTerm {
  Scalar share = 0;   ///< of the stress at once; the rest, 1 − Σ shares, stays
  Scalar time = 1;    ///< s
};

/// A law whose deviatoric stress fades: what has faded, S̄ = Σ g_i Q_i [Pa], is a second Piola–Kirchhoff stress that stands while a step is computed,
///   ψ − S̄ : (FᵀF − 1)/2,   P = ∂ψ/∂F − F S̄,
/// and is moved on when the step is taken: see PronyHistory. Its positive semidefinite tangent is that of ψ.
template <class Law, class T>
struct ViscoelasticLaw {
  static constexpr std::size_t max_terms = 4;
  Law law;
  SymmetricTensor3<T> faded;
  std::array<T, max_terms> share{}, time{};   // of no term 0 and 1

  T energy(Tensor3<T> const& F) const noexcept {
    return law.energy(F) - number<T>(0.5) * double_contraction(Tensor3<T>(faded), transpose(F) * F - Tensor3<T>::identity());
  }
  Tensor3<T> stress(Tensor3<T> const& F) const noexcept { return law.stress(F) - F * faded; }
  Tensor3<T> stress_change(Tensor3<T> const& F, Tensor3<T> const& dF) const noexcept { return law.stress_change(F, dF) - dF * faded; }
  Law const& tangent_law() const noexcept { return law; }
  auto bulk_modulus() const noexcept
    requires HasBulkModulus<Law, T>
  {
    return law.bulk_modulus();
  }
  bool accepts(T const& J) const noexcept
    requires RefusesInversion<Law, T>
  {
    return law.accepts(J);
  }
};

/// A step of h seconds, for terms of some times, found when the times change: with s = h/τ, 1 − e⁻ˢ of the past fades,
/// and 1 − (1 − e⁻ˢ)/s of the change follows.
template <RealScalar Scalar>
class PronyStep {
 public:
  using Terms = std::array<Scalar, ViscoelasticLaw<int, Scalar>::max_terms>;
  Terms fades{}, follows{};

  explicit PronyStep(Scalar h) noexcept : h_(h) {}
  void take(Terms const& times) noexcept {
    if (times == times_) return;
    times_ = times;
    for (std::size_t k = 0; k < times.size(); ++k) {
      Scalar const s = times[k] > 0 ? h_ / times[k] : Scalar(0);
      fades[k] = -std::expm1(-s);
      follows[k] = s > Scalar(0.01) ? 1 - fades[k] / s : s / 2 * (1 - s / 3 * (1 - s / 4 * (1 - s / 5 * (1 - s / 6))));
    }
  }

 private:
  Scalar h_;
  Terms times_{};
};

/// What a tetrahedron remembers: of each term Q, the deviatoric stress averaged over the past, dQ/dt = (S_dev − Q)/τ, and S_dev of the last step.
/// With S_dev linear in time within a step the recursion is exact:  Q⁺ = Q + (S − Q) (1 − e) + (S⁺ − S) (1 − (1 − e) τ/h),   e = exp(−h/τ).
/// S_dev = S − (S : C) C⁻¹/3 with S = F⁻¹P, in full where q = |F|² |F⁻¹|²/9 is at most 30, as in a pull to five times the length or a press to a fifth, less
/// beyond, and none from 60 on and of what is turned over: C⁻¹ grows without bound there, and what is remembered of it would hold flat what is let go.
/// Limits     in float the rate is off by up to 6e-8 τ/h of itself, for what a step adds to Q is rounded: 6e-3 where τ is 10⁵ steps.
/// Source     \cite simo1987; the recursion for S_dev at both ends of a step is ours, of second order as the midpoint's there.
template <RealScalar Scalar>
struct PronyHistory {
  using Stress = SymmetricTensor3<Scalar>;
  Stress last;
  std::array<Stress, ViscoelasticLaw<int, Scalar>::max_terms> average;

  /// Takes the deformation F at the end of a step; returns what has faded then.
  template <class Law>
  Stress advance(ViscoelasticLaw<Law, Scalar> const& law, Tensor3<Scalar> const& F, PronyStep<Scalar>& step) noexcept {
    step.take(law.time);
    Stress const before = last;
    last = deviatoric(law.law, F);
    Stress const change = last + Scalar(-1) * before;
    Stress faded;
    for (std::size_t k = 0; k < average.size(); ++k) {
      if (law.share[k] == 0) continue;
      average[k] = average[k] + step.fades[k] * (before + Scalar(-1) * average[k]) + step.follows[k] * change;
      faded = faded + law.share[k] * average[k];
    }
    return faded;
  }

 private:
  template <class Law>
  static Stress deviatoric(Law const& law, Tensor3<Scalar> const& F) noexcept {
    Tensor3<Scalar> const cof = cofactor(F), P = law.stress(F);
    Scalar const J = determinant(F, cof), q = double_contraction(F, F) * double_contraction(cof, cof) / (9 * J * J);
    if (!(J > 0 && q < 60)) return {};
    Tensor3<Scalar> const inverse = (1 / J) * transpose(cof), S = inverse * P;   // C⁻¹ = F⁻¹F⁻ᵀ, S : C = P : F
    Tensor3<Scalar> const D = S - (double_contraction(P, F) / 3) * (inverse * transpose(inverse));
    return std::min(2 - q / 30, Scalar(1)) * upper_triangle(symmetric_part(D));
  }
};

namespace detail {

template <class M>
struct ScalarOfMaterial {
  using type = double;
};
template <template <class> class Law, RealScalar Scalar>
struct ScalarOfMaterial<Law<Scalar>> {
  using type = Scalar;
};
template <template <class> class Law, RealScalar Scalar>
struct ScalarOfMaterial<IsotropicMaterial<Law, Scalar>> {
  using type = Scalar;
};

}  // namespace detail

/// A material whose deviatoric stress fades by a Prony series; its volume is elastic. The moduli are those at once, of a fast pull.
///   Viscoelastic{StableNeoHookean<double>{.young = 5e3, .poisson = 0.45}, {{0.3, 0.1}, {0.2, 2.0}}}    5 kPa at once, about half of it after some seconds
/// Errors     InvalidArgument, as the law is made: a share outside 0 … 1, shares of 1 and more together, a time that is not positive.
template <class M, RealScalar Scalar = typename detail::ScalarOfMaterial<M>::type>
struct Viscoelastic {
  M material{};
  PronyTerm<Scalar> terms[ViscoelasticLaw<M, Scalar>::max_terms]{};

  auto law() const {
    using Inner = detail::LawOf<M>;
    ViscoelasticLaw<typename Inner::type, Scalar> made{.law = Inner::of(material), .faded = {}};
    Scalar sum = 0;
    for (std::size_t k = 0; k < made.share.size(); ++k) {
      auto const [share, time] = terms[k];
      if (!(share >= 0 && share < 1)) throw InvalidArgument(detail::message("the share of Prony's term ", k, " is ", share, "; give one from 0 to below 1"));
      if (!(time > 0)) throw InvalidArgument(detail::message("the time of Prony's term ", k, " is ", time, " s; it must be positive"));
      made.share[k] = share, made.time[k] = time, sum += share;
    }
    if (!(sum < 1)) throw InvalidArgument(detail::message("the shares of Prony's series are ", sum, " together; something has to stay: give less than 1"));
    return made;
  }
};
template <class M, std::size_t Terms>
Viscoelastic(M, PronyTerm<typename detail::ScalarOfMaterial<M>::type> const (&)[Terms]) -> Viscoelastic<M, typename detail::ScalarOfMaterial<M>::type>;

namespace detail {

template <class Law, RealScalar S, class T>
  requires IsLawOfNumbers<Law, S, T>
struct LawOver<ViscoelasticLaw<Law, S>, T> {
  using type = ViscoelasticLaw<typename LawOver<Law, T>::type, T>;
};

}  // namespace detail

}  // namespace palpate
