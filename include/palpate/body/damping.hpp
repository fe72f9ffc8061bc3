// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/stability.hpp>
#include <palpate/core/error.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

namespace palpate {

namespace detail {

/// What damping_for() works on: particles, home springs and links. What set_damping() does besides can be changed.
template <class T>
concept DampedBySprings = HasParticles<T> && HasHomeSprings<T> && HasLinks<T>;

}  // namespace detail

/// What damping_for() is to keep.
enum class DampingGoal {
  at_most,    ///< no mode is damped more than asked; a particle alone on its home spring exactly so much
  at_least,   ///< no mode is damped less than asked; with a ratio of 1 nothing oscillates
};

/// Coefficients for a damping ratio, and what the modes of the body will show.
template <RealScalar Scalar>
struct DampingProposal {
  std::vector<Scalar> home;   ///< N·s/m, one per particle
  std::vector<Scalar> link;   ///< N·s/m, one per link
  Scalar min_ratio = 0;     ///< no mode of the body at its rest shape has less
  Scalar max_ratio = 0;      ///< nor more; infinite where a mode has no stiffness
};

/// Proposes home and link damping for a wanted damping ratio ζ = γ/(2ω); set_damping() puts it into the tissue. 0: none, 1: critical.
/// at_most    c_i = 2ζ√(k_i m_i), c_ij = β T′_ij(0), β = 2ζ/(Ω + s), Ω the fastest frequency, s = max √(k_i/m_i). For a mode u with the
///            share σ² of its ω² from home springs, Σ c_i u_i² ≤ 2ζσ, so γ ≤ 2ζ (σ + (ω² − σ²)/(Ω + s)) ≤ 2ζω: slow and fast modes have
///            almost ζ, those between less, down to `min_ratio`. Leapfrog's stable step is √(1 + 4ζ²) + 2ζ times smaller.
/// at_least   c_i = α m_i, c_ij = β T′_ij(0) with (α − β s²) β = ζ²: γ ≥ (α − β s²) + β ω² ≥ 2ζω for every ω, also without home
///            springs. The price: the slowest and the fastest modes have up to `max_ratio`, and the stable step shrinks accordingly.
/// Guarantee  for the body linearised at its rest shape without pre-tension, Ω as ModalEstimate finds it. −Re λ/|λ| of every
///            eigenvalue of the damped body lies between min_ratio and max_ratio.
/// Units      ζ without, β [s], α [1/s].
/// Source     the damped oscillator of any textbook; Rayleigh's damping for at_least.
/// Cost       that of ModalEstimate; allocates.
template <detail::DampedBySprings Tissue, RealScalar Scalar = typename Tissue::Scalar>
DampingProposal<Scalar> damping_for(Tissue const& tissue, std::type_identity_t<Scalar> ratio, DampingGoal goal = DampingGoal::at_most) {
  detail::require_non_negative("the damping ratio", ratio, "of the critical one");
  Matrix3X<Scalar> rest(3, tissue.size());
  Scalar slowest = std::numeric_limits<Scalar>::infinity(), stiffest = 0;   // √(k/m) of single particles on their homes
  for (int i = 0; i < tissue.size(); ++i) {
    rest.col(i) = tissue.rest_position(i);
    if (tissue.nailed(i)) continue;
    Scalar const own = std::sqrt(tissue.home(i).stiffness / tissue.mass(i));
    slowest = std::min(slowest, own);
    stiffest = std::max(stiffest, own);
  }
  DampingProposal<Scalar> proposal;
  proposal.home.assign(static_cast<std::size_t>(tissue.size()), Scalar(0));
  proposal.link.assign(static_cast<std::size_t>(tissue.links().size()), Scalar(0));
  proposal.min_ratio = proposal.max_ratio = ratio;
  ModalEstimate<Tissue> estimate;
  Scalar const fastest = std::sqrt(estimate(tissue, rest, [&](int i) { return !tissue.nailed(i); }).squared_frequency);
  if (!(fastest > 0) || ratio == 0) return proposal;

  Scalar per_mass = 0, per_stiffness = 0;   // α and β
  if (goal == DampingGoal::at_most) {
    per_stiffness = 2 * ratio / (fastest + stiffest);
    proposal.min_ratio = stiffest > 0 ? 2 * ratio * std::sqrt(slowest / (slowest + stiffest) * stiffest / (fastest + stiffest)) : Scalar(0);
  } else {
    Scalar const low = std::max(slowest, fastest / 100);   // the modes from here to the fastest are to be damped alike
    per_stiffness = ratio / std::sqrt(low * fastest);
    per_mass = ratio * std::sqrt(low * fastest) + per_stiffness * stiffest * stiffest;
    Scalar const at_fastest = (per_mass + per_stiffness * (fastest * fastest - slowest * slowest)) / (2 * fastest);
    proposal.max_ratio = slowest > 0 ? std::max(per_mass / (2 * slowest), at_fastest) : std::numeric_limits<Scalar>::infinity();
  }
  for (int i = 0; i < tissue.size(); ++i)
    proposal.home[static_cast<std::size_t>(i)] = goal == DampingGoal::at_most ? 2 * ratio * std::sqrt(tissue.home(i).stiffness * tissue.mass(i))
                                                                               : per_mass * tissue.mass(i);
  for (int l = 0; l < tissue.links().size(); ++l)
    proposal.link[static_cast<std::size_t>(l)] =
        per_stiffness * tangent_stiffness_of(tissue.links()[l].law, Scalar(0), tissue.links()[l].rest_length);
  return proposal;
}

/// Of what is no such tissue: what is wrong.
template <class Other, RealScalar Scalar = typename Other::Scalar>
  requires(!detail::DampedBySprings<Other>)
DampingProposal<Scalar> damping_for(Other const&, std::type_identity_t<Scalar>, DampingGoal = DampingGoal::at_most) {
  static_assert(detail::DampedBySprings<Other>,
                "damping_for: this is no tissue of links and home springs, as MassSpring is; of a body give body.tissue(); a solid is damped by its options' .damping.");
  return {};
}

/// Gives a tissue the damping proposed for it; stiffness stays.
template <detail::DampedBySprings Tissue, RealScalar Scalar>
  requires(!std::is_const_v<Tissue>)
void set_damping(Tissue& tissue, DampingProposal<Scalar> const& proposal) {
  if (static_cast<int>(proposal.home.size()) != tissue.size() || static_cast<int>(proposal.link.size()) != tissue.links().size())
    throw InvalidArgument(detail::message("the damping is for ", proposal.home.size(), " particles and ", proposal.link.size(),
                                          " links, the tissue has ", tissue.size(), " and ", tissue.links().size()));
  for (int i = 0; i < tissue.size(); ++i) {
    auto home = tissue.home(i);
    home.damping = proposal.home[static_cast<std::size_t>(i)];
    tissue.set_home(i, home);
  }
  for (int l = 0; l < tissue.links().size(); ++l) {
    auto law = tissue.links()[l].law;
    law.damping = static_cast<decltype(law.damping)>(proposal.link[static_cast<std::size_t>(l)]);
    tissue.set_link(l, law);
  }
}
/// Of what is no such tissue: what is wrong.
template <class Other, RealScalar Scalar>
  requires(!detail::DampedBySprings<Other> || std::is_const_v<Other>)
void set_damping(Other&, DampingProposal<Scalar> const&) {
  static_assert(detail::DampedBySprings<Other> && !std::is_const_v<Other>,
                "set_damping: this is no tissue of links and home springs, as MassSpring is, or it is const, as that of a body; set the damping before the body takes it.");
}

}  // namespace palpate
