// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/tissue/concept.hpp>

#include <algorithm>
#include <span>

namespace palpate {

/// What a constraint pass found.
template <RealScalar Scalar>
struct ElongationReport {
  Scalar largest = 0;   ///< of |d|/L − 1 over the links with an end that can move, as the last sweep found them
  int sweeps = 0;
  bool satisfied = false;
};

/// Keeps links from growing beyond (1 + limit) × their rest length, however soft their law is: after a step, one that has is shortened
/// to that length by moving its ends along it, each in proportion to its inverse mass; a fixed end stays and the other moves alone.
///   x_i −= w_i s n,   x_j += w_j s n,   s = (|d| − (1 + limit) L)/(w_i + w_j),   w = 1/m, or 0 for a nailed, held or waiting particle
///
///   body.step(h);
///   body.correct(MaximumElongation{.limit = 0.1});   // velocities change by Δx/h
///
/// Links share particles, so one correction undoes part of another: up to `sweeps` sweeps over the moving particles, in their order and
/// back by turns, each correction seen by the next (Gauss–Seidel), until no link with a free end is longer than limit + tolerance says.
/// Converges linearly where the links can be satisfied together: a few sweeps where few links are too long. A pull at the end of a chain
/// of n links travels its length in one sweep, but evens out in O(n²): the rest is done in the steps that follow.
/// Where both ends of what is too long are fixed nothing can satisfy it; the pass leaves some links too long and reports the longest.
/// The centre of mass and momentum of free particles stay; kinetic energy is lost, as in an inelastic shock, where a link grew too long in that step. One that was
/// before comes back at Δx/h, with energy that is new.
/// Units      limit, tolerance: shares of the rest length.
/// Source     \cite provot1995, there 10 %, equal masses, one sweep, and velocities as they are.
/// Cost       O(links at the moving particles) a sweep. noexcept, no allocation: allowed in the servo tick.
/// Limits     links with pre-tension start at ε/(1 − ε): the limit must be above that.
struct MaximumElongation {
  double limit = 0.1;
  int sweeps = 20;
  double tolerance = 1e-3;

  /// `inverse_mass(i)` [1/kg], 0 for a particle that stays; `move(i, Δx)` must move column i of `positions`.
  template <HasLinks Tissue, class InverseMass, class X, class Move, RealScalar Scalar = typename Tissue::Scalar>
  ElongationReport<Scalar> correct(Tissue const& tissue, std::span<int const> moving, InverseMass inverse_mass, X const& positions,
                                   Move move) const noexcept {
    ElongationReport<Scalar> report;
    auto const most = static_cast<Scalar>(1 + limit);
    auto const shorten_links_at = [&](int i) {
      Scalar const wi = inverse_mass(i);
      if (!(wi > 0)) return;
      for (int const l : tissue.links().at(i)) {
        auto const& link = tissue.links()[l];
        int const j = link.a == i ? link.b : link.a;
        Scalar const wj = inverse_mass(j);
        if (wj > 0 && j < i) continue;   // it is seen from its lower end
        Vector3<Scalar> const d = positions.col(i) - positions.col(j);
        Scalar const length = d.norm(), excess = length - most * link.rest_length;
        report.largest = std::max(report.largest, length / link.rest_length - 1);
        if (!(excess > 0)) continue;
        Vector3<Scalar> const shift = excess / (length * (wi + wj)) * d;
        move(i, Vector3<Scalar>(-wi * shift));
        if (wj > 0) move(j, Vector3<Scalar>(wj * shift));
      }
    };
    while (report.sweeps < sweeps && !report.satisfied) {
      report.largest = moving.empty() ? Scalar(0) : Scalar(-1);
      if (report.sweeps % 2 == 0)
        for (auto i = moving.begin(); i != moving.end(); ++i) shorten_links_at(*i);
      else
        for (auto i = moving.rbegin(); i != moving.rend(); ++i) shorten_links_at(*i);
      ++report.sweeps;
      report.satisfied = report.largest <= static_cast<Scalar>(limit + tolerance);
    }
    return report;
  }
};

}  // namespace palpate
