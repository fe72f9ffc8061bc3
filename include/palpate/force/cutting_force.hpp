// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/force/concept.hpp>
#include <palpate/force/curve_join.hpp>
#include <palpate/force/indentation_spring.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <type_traits>
#include <utility>

namespace palpate {

namespace detail {

template <class T>
concept NamesScalar = requires { typename T::Scalar; };

template <class T>
struct ScalarOf {
  using type = void;
};
template <NamesScalar T>
struct ScalarOf<T> {
  using type = typename T::Scalar;
};

/// The first scalar that a part names, double when none does.
template <class... Parts>
struct CommonScalar {
  using type = double;
};
template <class First, class... Rest>
struct CommonScalar<First, Rest...> {
  using type = std::conditional_t<std::is_void_v<typename ScalarOf<First>::type>, typename CommonScalar<Rest...>::type,
                                  typename ScalarOf<First>::type>;
};

template <class T, class S>
concept OfScalar = std::is_void_v<typename ScalarOf<T>::type> || std::same_as<typename ScalarOf<T>::type, S>;

enum class PartKind { none, join, noise, curve, model };

template <class T, class S>
constexpr PartKind part_kind() noexcept {
  if constexpr (std::same_as<T, CurveJoin<S>>)
    return PartKind::join;
  else if constexpr (ForceNoise<T, S>)
    return PartKind::noise;
  else if constexpr (ForceCurve<T, S>)
    return PartKind::curve;
  else if constexpr (ForceModel<T, S>)
    return PartKind::model;
  else
    return PartKind::none;
}

/// A part of another scalar is reported as such, not as a part of no kind.
template <class T, class S>
constexpr bool is_part() noexcept {
  if constexpr (OfScalar<T, S>)
    return part_kind<T, S>() != PartKind::none;
  else
    return true;
}

}  // namespace detail

/// The force of palpating and cutting on the hand, a sum of parts in any order:
///   force curves      (depth [m]) or (depth [m], Phase) → [N], after the puncture, along the normal
///   force models      ToolContact → Vector3, in every phase but `no_contact`: `OrganForce`, `TissueReaction`, one of your own
///   noise             after the puncture, along the sum of all others: `WhiteGaussianNoise`
///   contact laws      before the puncture, in place of the default `IndentationSpring`: `IndentationSpring`, `PolynomialContact`,
///                     `ExponentialContact`, `HuntCrossleyContact`, or one of your own with resists_before_puncture = true; several add up
///   `CurveJoin`       replaces the default
///
///   no contact    F = 0
///   indenting     F = contact law + Σ models
///   moving        F = p F_p g(d) + (1 − p) (Σ fade(d) curve(d) n + Σ models) + Σ noise
/// F_p is the last force while indenting; p falls from 1 to 0 after the puncture, g with the depth. A curve with hysteresis blends from
/// loading to unloading as the tool comes back, and to loading again as it goes deeper. Unloading is never above loading: the smaller of
/// the two curves. Every curve fades to zero at depth 0 and is zero outside. `CurveJoin` states these rules.
///
///   CuttingForce force(liver_hysteresis<double>(), OrganForce<double>{.coefficient = 2000.0}, WhiteGaussianNoise<double>({.seed = 7}));
///
/// Units      [m], [N]; world frame. The force pushes the hand out of the tissue, along +normal.
/// Source     \cite zheng2006 eq. 6-7 … 6-13
/// Invariant  All parts compute in one scalar. Options are checked at set-up by each part's `validate`.
/// Cost       Two evaluations of each curve with hysteresis, one of others; noexcept, no allocation: allowed in the servo tick.
/// Limits     A contact with values that are not finite gives zero force. The published curves (0.36 N at 18 mm) and the default spring
///            (3 N there) stem from two experiments, so the force falls at the puncture by more than tissue would, though not at once.
///            Scale the curve (`scaled`). One object serves one tool: noise and joins keep state, `reset()` restarts them.
template <class... Parts>
class CuttingForce {
 public:
  using Scalar = typename detail::CommonScalar<Parts...>::type;

 private:
  static_assert((detail::OfScalar<Parts, Scalar> && ...),
                "palpate::CuttingForce: the parts compute in different scalars. Write all of them for double or all for float: "
                "CuttingForce(liver_hysteresis<float>(), OrganForce<float>{...}).");
  static_assert((detail::is_part<Parts, Scalar>() && ...),
                "palpate::CuttingForce: a part is neither a force curve, (depth [m]) -> N or (depth [m], palpate::Phase) -> N, nor a force "
                "model, palpate::ToolContact<Scalar> -> palpate::Vector3<Scalar>, nor a noise with draw(force). Give it such a call "
                "operator, and mark it noexcept: it runs in the servo tick. Scalar is what a part names by using Scalar, double where none does.");
  template <class T>
  static constexpr int count_ = (0 + ... + (std::is_same_v<Parts, T> ? 1 : 0));
  static constexpr bool has_contact_law_ = (ContactLaw<Parts, Scalar> || ...);
  static_assert(count_<IndentationSpring<Scalar>> <= 1, "palpate::CuttingForce: give one IndentationSpring, not several.");
  static_assert(count_<CurveJoin<Scalar>> <= 1, "palpate::CuttingForce: give one CurveJoin, not several.");

  using Spring = IndentationSpring<Scalar>;
  using Join = CurveJoin<Scalar>;
  using Vector = Vector3<Scalar>;

 public:
  /// Throws `InvalidArgument` when a part's options are out of their meaning.
  explicit CuttingForce(Parts... parts) : parts_(std::move(parts)...) {
    each([&](auto& part) {
      using Part = std::remove_cvref_t<decltype(part)>;
      if constexpr (Validatable<Part>) part.validate();
      if constexpr (std::is_same_v<Part, Join>) join_ = part;
    });
  }

  /// Force on the hand [N] in this servo tick. Call it once a tick: noise and reversal advance with every call.
  Vector operator()(ToolContact<Scalar> const& contact) noexcept {
    bool const moving = contact.phase == CuttingPhase::moving;
    if (!moving) loading_share_ = Scalar(1);
    if (contact.phase == CuttingPhase::no_contact) {
      forget_puncture();
      return Vector::Zero();
    }

    Vector force = Vector::Zero();
    if constexpr (!has_contact_law_) force += Spring{}(contact);
    if (moving) force += curves(contact) * contact.normal;
    each([&](auto& part) {
      if constexpr (kind<decltype(part)> == detail::PartKind::model) force += part(contact);
    });
    join_at_puncture(force, contact, moving);
    if (moving) {
      Vector noise = Vector::Zero();
      each([&](auto& part) {
        if constexpr (kind<decltype(part)> == detail::PartKind::noise) noise += part.draw(force);
      });
      if (Scalar const work = noise.dot(contact.velocity) * contact.seconds; std::isfinite(work)) noise_energy_ += work;
      force += noise;
    }
    return is_finite(force) ? force : Vector(Vector::Zero());
  }

  /// Energy that the noise has given the hand since the start or reset() [J]: Σ ΔF·v Δt, v of the tick in which the noise is drawn;
  /// negative where it has taken energy. Subtract it when you check the passivity of the tissue.
  Scalar noise_energy() const noexcept { return noise_energy_; }

  /// Restarts noise and all other state: the same contacts give the same forces again.
  void reset() noexcept {
    loading_share_ = Scalar(1);
    noise_energy_ = Scalar(0);
    forget_puncture();
    each([&](auto& part) {
      if constexpr (Resettable<std::remove_cvref_t<decltype(part)>>) part.reset();
    });
  }

 private:
  template <class Part>
  static constexpr detail::PartKind kind = detail::part_kind<std::remove_cvref_t<Part>, Scalar>();

  template <class Function>
  void each(Function function) {
    std::apply([&](auto&... part) { (function(part), ...); }, parts_);
  }

  void forget_puncture() noexcept {
    puncture_force_.setZero();
    puncture_depth_ = put_in_ = last_resistance_ = Scalar(0);
    since_puncture_ = join_.puncture_time;
  }

  /// Stores the force while the tool indents; after the puncture blends it into the present one.
  void join_at_puncture(Vector& force, ToolContact<Scalar> const& contact, bool moving) noexcept {
    if (!is_finite(force)) return;
    if (!moving) {
      Scalar const resistance = force.dot(contact.normal), work = (resistance + last_resistance_) / 2 * (contact.depth - contact.previous_depth);
      if (std::isfinite(work)) put_in_ += work;
      last_resistance_ = resistance;
      puncture_force_ = force;
      puncture_depth_ = contact.depth;
      since_puncture_ = Scalar(0);
    } else if (since_puncture_ < join_.puncture_time) {
      since_puncture_ += contact.seconds > Scalar(0) ? contact.seconds : Scalar(0.001);   // false for a NaN
      force += join_.puncture_share(since_puncture_) * (remaining(contact.depth) * puncture_force_ - force);
    }
  }

  /// The share of the force at the puncture that a depth leaves.
  Scalar remaining(Scalar depth) const noexcept {
    if (!(depth > Scalar(0)) || !(puncture_depth_ > Scalar(0))) return Scalar(0);
    if (!(depth < puncture_depth_)) return Scalar(1);
    Scalar const whole = puncture_force_.norm() * puncture_depth_;
    Scalar const n = put_in_ > whole / Scalar(64) ? std::max(Scalar(1), whole / put_in_ - Scalar(1)) : Scalar(63);
    return std::pow(depth / puncture_depth_, n);
  }

  /// Sum of the curves [N].
  Scalar curves(ToolContact<Scalar> const& contact) noexcept {
    loading_share_ = join_.reverse(loading_share_, contact.depth - contact.previous_depth);
    if (!(contact.depth > Scalar(0))) return Scalar(0);
    Scalar sum = Scalar(0);
    each([&](auto& part) {
      if constexpr (kind<decltype(part)> == detail::PartKind::curve) {
        Scalar const loading = detail::evaluate_curve<Scalar>(part, contact.depth, Phase::loading);
        Scalar value = loading;
        if constexpr (HysteresisCurve<std::remove_cvref_t<decltype(part)>, Scalar>) {
          if (loading_share_ < Scalar(1)) {
            Scalar const unloading = std::min(detail::evaluate_curve<Scalar>(part, contact.depth, Phase::unloading), loading);
            value = unloading + loading_share_ * (loading - unloading);
          }
        }
        sum += value;
      }
    });
    return join_.fade(contact.depth) * sum;
  }

  std::tuple<Parts...> parts_;
  Join join_{};
  Vector puncture_force_ = Vector::Zero();   // N, the last one while indenting
  Scalar since_puncture_ = std::numeric_limits<Scalar>::max();   // s; from puncture_time on nothing is left of it
  Scalar puncture_depth_ = Scalar(0);    // m, where it was felt
  Scalar put_in_ = Scalar(0);            // J, by the hand while indenting
  Scalar last_resistance_ = Scalar(0);   // N, along the normal, one tick ago
  Scalar noise_energy_ = Scalar(0);      // J
  Scalar loading_share_ = Scalar(1);   // 1 on the loading curve, 0 on the unloading curve
};

}  // namespace palpate
