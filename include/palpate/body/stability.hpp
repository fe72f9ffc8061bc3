// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/particle_order.hpp>
#include <palpate/core/columns.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/padded_columns.hpp>
#include <palpate/integrator/measured_stability.hpp>
#include <palpate/tissue/concept.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <numeric>
#include <vector>

namespace palpate {

/// Bounds of a body's modes x″ = −M⁻¹K x − M⁻¹C x′ by Gershgorin's theorem in blocks: largest κ ≤ max_i Σ_j ‖K_ij‖/m_i, and so for γ.
/// `moves(i)` says whether particle i is free to move; `x` are the positions it is linearised at, 3 × n.
/// Guarantee  no mode of the body linearised at x is faster, whatever the directions of its springs. With Hooke's law a bound found at
///            rest holds wherever the body goes: a link of length l resists with k along itself and k (1 − L/l) < k across. A law that
///            hardens has a larger tangent elsewhere than at x: ask again on the way. Pre-tension counts by |T|/l, also where a
///            compressed link pushes sideways: such a mode buckles at a rate that no step prevents.
/// Tissue that does not state its bounds at x (HasStiffnessRowBoundsAt, HasDampingBoundAt) is bounded at its rest shape.
/// Cost       one pass over the elements, two where damping is asked at x; allocates nothing, but of solids with nodal pressure. On surfaces 2 to 2.5 times the
///            largest κ, so two thirds of the step.
/// Source     \cite golub2013 ch. 7.2, 7.3.
template <TissueModel Tissue, class X, class Moves>
ModalBounds<typename Tissue::Scalar> row_bounds(Tissue const& tissue, X const& x, Moves moves) {
  using Scalar = typename Tissue::Scalar;
  ModalBounds<Scalar> modes;
  modes.min_decay_rate = std::numeric_limits<Scalar>::infinity();
  bool any = false;
  for (int i = 0; i < tissue.size(); ++i) {
    if (!moves(i)) continue;
    any = true;
    Scalar stiffness;
    if constexpr (HasStiffnessRowBoundsAt<Tissue>)
      stiffness = tissue.stiffness_bound(i, x);
    else
      stiffness = tissue.stiffness_bound(i);
    modes.squared_frequency = std::max(modes.squared_frequency, stiffness / tissue.mass(i));
    Scalar damping;
    if constexpr (HasDampingBoundAt<Tissue>)
      damping = tissue.damping_bound(i, x);
    else
      damping = tissue.damping_bound(i);
    modes.decay_rate = std::max(modes.decay_rate, damping / tissue.mass(i));
    if constexpr (HasHomeSprings<Tissue>)
      modes.min_decay_rate = std::min(modes.min_decay_rate, tissue.home(i).damping / tissue.mass(i));
    else
      modes.min_decay_rate = 0;
  }
  if (!any) modes.min_decay_rate = 0;
  return modes;
}

namespace detail {

/// The tangent of a whole tissue by its Assembly, of one that says it is faster so.
template <class Tissue>
struct WholeTangent {
  void set_order(ParticleOrder const&) noexcept {}
  typename LayoutOf<Tissue>::type layout() const noexcept { return {}; }
};
template <HasFastTangent Tissue>
class WholeTangent<Tissue> {
 public:
  using Scalar = typename Tissue::Scalar;

  void set_order(ParticleOrder const& order) { order_ = order, d_.resize(0); }
  template <class X>
  void linearise(Tissue const& tissue, X const& x) {
    if (d_.size() != tissue.size() || revision_ != tissue.revision()) {
      all_.resize(static_cast<std::size_t>(tissue.size()));
      std::iota(all_.begin(), all_.end(), 0);
      order_.sort(all_);
      if constexpr (FollowsEdits<Tissue>)
        tissue.follow_edits(all_, assembly_);
      else
        tissue.assemble(all_, assembly_);
      d_.resize(tissue.size()), y_.resize(tissue.size());
      revision_ = tissue.revision();
    }
    gather(x);
    assembly_.linearise(d_.padded_view(), nullptr);
  }
  /// y = (damping C + stiffness K) d.
  template <class D, class Y>
  void multiply(Scalar damping, Scalar stiffness, D const& d, Y& y) {
    gather(d);
    assembly_.multiply_tangent(Scalar(0), damping, stiffness, d_.padded_view().data(), y_.padded_view().data());
    if (order_.is_by_number())
      y = y_.view();
    else
      for (int k = 0; k < y_.size(); ++k) y.col(all_[static_cast<std::size_t>(k)]) = y_[k];
  }
  /// The order of its sums, and the tissue is another one whose tangent had that.
  typename LayoutOf<Tissue>::type layout() const {
    if constexpr (FollowsEdits<Tissue>)
      return assembly_.layout();
    else
      return {};
  }
  void take([[maybe_unused]] typename LayoutOf<Tissue>::type const& layout) {
    if constexpr (FollowsEdits<Tissue>) assembly_.take(layout);
    d_.resize(0);
  }

 private:
  template <class From>
  void gather(From const& from) {
    if (order_.is_by_number())
      d_.view() = from;
    else
      for (int k = 0; k < d_.size(); ++k) d_[k] = from.col(all_[static_cast<std::size_t>(k)]);
  }

  ParticleOrder order_;
  typename Tissue::Assembly assembly_;
  std::vector<int> all_;
  PaddedColumns<Scalar> d_, y_;
  std::size_t revision_ = 0;
};

}  // namespace detail

/// Where the search for a body's fastest modes has come to: it goes on from there.
template <RealScalar Scalar>
struct ModalSearch {
  Columns<Scalar, 3> stiffest, max_damped;   // the modes themselves
  int products = 0;                          // of the last answer, and since
};

/// Finds the extremes of a body's modes x″ = −M⁻¹K x − M⁻¹C x′, linearised where it is.
/// Tissue that multiplies its stiffness: power iteration for the largest κ and γ, started from the last answer and raised by 5 %
/// (it nears its limit from below). Other tissue: row_bounds.
/// Cost       up to 60 products for each of the two: some 100 in all for a body of 1000 particles, 30 to 70 from the last answer or after
///            a cut; nothing is allocated while the body stays within what was reserved.
/// Source     \cite golub2013 ch. 7.2, 7.3.
template <TissueModel Tissue>
class ModalEstimate {
 public:
  using Scalar = typename Tissue::Scalar;

  /// `moves(i)` says whether particle i is free to move; `x` are the current positions, 3 × n.
  template <class X, class Moves>
  ModalBounds<Scalar> operator()(Tissue const& tissue, X const& x, Moves moves) {
    search_.products = 0;
    if constexpr (HasFastTangent<Tissue>) {
      whole_.linearise(tissue, x);
      ModalBounds<Scalar> modes;
      modes.min_decay_rate = 0;
      modes.squared_frequency = largest(tissue, moves, search_.stiffest, [&](auto const& d, auto& y) { whole_.multiply(Scalar(0), Scalar(1), d, y); });
      modes.decay_rate = largest(tissue, moves, search_.max_damped, [&](auto const& d, auto& y) { whole_.multiply(Scalar(1), Scalar(0), d, y); });
      return modes;
    }
    ModalBounds<Scalar> modes = row_bounds(tissue, x, moves);
    if constexpr (HasStiffnessProduct<Tissue>) {
      if (modes.squared_frequency > 0 || modes.decay_rate > 0) {
        modes.squared_frequency = largest(tissue, moves, search_.stiffest,
                                  [&](auto const& d, auto& y) { tissue.add_stiffness_product(x, d, y); });
        modes.decay_rate = largest(tissue, moves, search_.max_damped,
                                [&](auto const& d, auto& y) { tissue.add_damping_product(x, d, y); });
      }
    }
    return modes;
  }

  /// The largest κ and γ seen along the last fastest modes, where the body is now: not above its true ones, not raised, and one product
  /// each. The least damping is not looked for.
  template <class X, class Moves>
  ModalBounds<Scalar> follow(Tissue const& tissue, X const& x, Moves moves) {
    if constexpr (HasFastTangent<Tissue>) {
      whole_.linearise(tissue, x);
      ModalBounds<Scalar> modes;
      modes.squared_frequency = followed(tissue, moves, search_.stiffest, [&](auto const& d, auto& y) { whole_.multiply(Scalar(0), Scalar(1), d, y); });
      modes.decay_rate = followed(tissue, moves, search_.max_damped, [&](auto const& d, auto& y) { whole_.multiply(Scalar(1), Scalar(0), d, y); });
      return modes;
    } else if constexpr (HasStiffnessProduct<Tissue>) {
      ModalBounds<Scalar> modes;
      modes.squared_frequency = followed(tissue, moves, search_.stiffest, [&](auto const& d, auto& y) { tissue.add_stiffness_product(x, d, y); });
      modes.decay_rate = followed(tissue, moves, search_.max_damped, [&](auto const& d, auto& y) { tissue.add_damping_product(x, d, y); });
      return modes;
    } else {
      return row_bounds(tissue, x, moves);
    }
  }

  /// In this order the tissue's sums are made.
  void set_order(detail::ParticleOrder const& order) { whole_.set_order(order); }
  ModalSearch<Scalar> const& search() const noexcept { return search_; }
  typename detail::LayoutOf<Tissue>::type layout() const { return whole_.layout(); }
  /// The tissue is another one, whose search has come so far with sums in that order.
  void resume(ModalSearch<Scalar> const& search, typename detail::LayoutOf<Tissue>::type const& layout) {
    search_ = search;
    if constexpr (HasFastTangent<Tissue>) whole_.take(layout);
  }

  /// What the last answer cost: products with the stiffness and with the damping.
  int products() const noexcept { return search_.products; }

  /// Room for a body of this size.
  void reserve(int particles) {
    for (auto* columns : {&search_.stiffest, &search_.max_damped, &y_}) columns->reserve(particles);
  }

 private:
  using Columns3 = Columns<Scalar, 3>;

  /// The largest eigenvalue of M⁻¹A by power iteration, A positive semidefinite.
  template <class Moves, class Product>
  Scalar largest(Tissue const& tissue, Moves moves, Columns3& mode, Product add_product) {
    int const n = tissue.size();
    int const known = mode.size();
    mode.resize(n);
    y_.resize(n);
    auto d = mode.view();
    auto y = y_.view();
    for (int i = 0; i < n; ++i) {   // a start that has a part of every mode, also of one that an edit put in an old particle's place
      Vector3<Scalar> const some(uneven(3 * i), uneven(3 * i + 1), uneven(3 * i + 2));
      d.col(i) = i < known ? Vector3<Scalar>(d.col(i) + Scalar(0.2) * some) : some;
    }
    Scalar value = 0;
    for (int k = 0; k < 60; ++k) {
      Scalar const last = value;
      value = quotient(tissue, moves, d, y, add_product);
      if (!(value > 0) || (k > 4 && std::abs(value - last) <= Scalar(1e-4) * value)) break;
      if (!turn(tissue, moves, d, y)) return 0;
    }
    return value * Scalar(1.05);
  }

  /// dᵀA d / dᵀM d of the free particles, with A d in y: not above the largest eigenvalue. 0 where nothing moves.
  template <class Moves, class View, class Product>
  Scalar quotient(Tissue const& tissue, Moves moves, View d, View y, Product add_product) {
    Scalar norm = 0;
    for (int i = 0; i < tissue.size(); ++i) {
      if (!moves(i)) d.col(i).setZero();
      norm += tissue.mass(i) * d.col(i).squaredNorm();
    }
    if (!(norm > 0)) return 0;
    y.setZero();
    add_product(d, y);
    ++search_.products;
    return y.cwiseProduct(d).sum() / norm;
  }

  /// d becomes M⁻¹y, its largest entry 1; false where that is zero.
  template <class Moves, class View>
  static bool turn(Tissue const& tissue, Moves moves, View d, View y) {
    Scalar size = 0;
    for (int i = 0; i < tissue.size(); ++i) {
      if (moves(i))
        y.col(i) /= tissue.mass(i);
      else
        y.col(i).setZero();
      size = std::max(size, y.col(i).cwiseAbs().maxCoeff());
    }
    if (!(size > 0)) return false;
    d = y / size;
    return true;
  }

  /// One turn of the power iteration, on from a mode; without it 0. A trace of other modes is kept alive.
  template <class Moves, class Product>
  Scalar followed(Tissue const& tissue, Moves moves, Columns3& mode, Product add_product) {
    int const known = mode.size();
    if (known == 0) return 0;
    mode.resize(tissue.size());
    y_.resize(tissue.size());
    auto d = mode.view();
    auto y = y_.view();
    for (int i = known; i < tissue.size(); ++i) d.col(i).setZero();
    for (int i = 0; i < tissue.size(); ++i)
      d.col(i) += Scalar(0.003) * Vector3<Scalar>(uneven(3 * i + search_.products), uneven(3 * i + 1 + search_.products), uneven(3 * i + 2 + search_.products));
    Scalar const value = quotient(tissue, moves, d, y, add_product);
    if (value > 0) turn(tissue, moves, d, y);
    return value;
  }

  static Scalar uneven(int k) noexcept {
    auto const turn = static_cast<double>(k) * 0.6180339887498949;
    return static_cast<Scalar>(turn - std::floor(turn) - 0.5);
  }

  ModalSearch<Scalar> search_;
  Columns3 y_;
  detail::WholeTangent<Tissue> whole_;
};

/// The largest stable step of an integrator for these modes [s]: what it states, or what is measured.
template <Integrator I, RealScalar Scalar>
Scalar stable_step(I const& integrator, ModalBounds<Scalar> const& modes) {
  if constexpr (StatesStableStep<I>)
    return integrator.stable_step(modes);
  else
    return static_cast<Scalar>(
        measured_stable_step(integrator, ModalBounds<double>{modes.squared_frequency, modes.decay_rate, modes.min_decay_rate}));
}

/// The stiffest link [N/m] that n particles of a total mass [kg] stand in steps of h [s], by the estimate of the thesis:
///   K_c = m/(n π² h²)
/// A rule of thumb for setting up a scene; `SoftBody::stable_step` is sharp. Of one mass on one spring leapfrog stands 4 m/h², 4 π² times the estimate;
/// of a sheet without dampers, in which six links meet, 5.7 times (2.4 times in the step).
/// Limits     It counts neither dampers nor home springs nor uneven masses. Where dampers limit the step it is far too large: with the coefficients of the
///            thesis's two scenes it allows steps 15 to 40 times as long as those that leapfrog stands.
/// Source     \cite zheng2006 eq. 2-1
/// Errors     InvalidArgument for what is not positive.
inline double critical_stiffness(double total_mass, int particles, double h) {
  detail::require_positive("critical_stiffness: the total mass", total_mass, "kg");
  if (particles < 1) throw InvalidArgument(detail::message("critical_stiffness: there are ", particles, " particles; give 1 or more"));
  detail::require_positive("critical_stiffness: the step", h, "s");
  return total_mass / (particles * std::numbers::pi * std::numbers::pi * h * h);
}

}  // namespace palpate
