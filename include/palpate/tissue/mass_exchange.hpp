// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/huge_page_vector.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/reserve_and_prefault.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <span>

namespace palpate {

/// Where a cut has put each particle, and who may lend it mass: a small particle on stiff springs would force small steps on the whole body.
/// A particle at X = Σ w_k X_k takes δ from its parents, w_k δ from each, or gives it back so; copies of one particle lie at one place and
/// lend each other what they like. Mass carries its velocity along.
/// Invariant  Σ m, Σ m X and Σ m v stay, and the kinetic energy does not rise: every transfer is an inelastic one. No mass becomes 0: what would be lost in the
///            rounding of the one that gets it stays where it is.
/// Source     \cite zheng2006 ch. 3 conserves mass; how it is shared among particles is left open there.
/// Cost       O(springs at the particle and at those around it).
template <RealScalar Scalar>
class MassExchange {
 public:
  void add_particle() { origins_.push_back({{-1, -1, -1}, {}, size()}); }
  /// The last particle lies between these, at barycentric weights.
  template <std::size_t Parents>
  void set_parents(std::array<int, Parents> const& parents, std::array<Scalar, Parents> const& weights) noexcept {
    std::copy(parents.begin(), parents.end(), origins_.back().parents.begin());
    std::copy(weights.begin(), weights.end(), origins_.back().weights.begin());
  }
  /// The last particle is a copy of p.
  void set_copy_of(int p) noexcept {
    origins_.back() = at(p);   // its parents are the copy's too
    at(p).next_copy = size() - 1;
  }
  void pop_particle() noexcept {
    int const last = size() - 1;
    int before = last;
    while (at(before).next_copy != last) before = at(before).next_copy;
    at(before).next_copy = at(last).next_copy;
    origins_.pop_back();
  }
  /// The copies of a particle form a ring: the one after i, or i where there is no other.
  int next_copy(int i) const noexcept { return at(i).next_copy; }
  void reserve(int particles) { reserve_and_prefault(origins_, static_cast<std::size_t>(particles)); }

  /// Of the particles listed, in their order; `now` says where each particle of the whole is in that list, −1 for none. A relation to one that
  /// stays behind is lost, unless a copy of that one comes along.
  MassExchange part(std::span<int const> particles, std::span<int const> now) const {
    MassExchange made;
    made.origins_.reserve(particles.size());
    auto const along = [&](int i) {   // i, or a copy of it that comes along
      for (int copy = at(i).next_copy; now[static_cast<std::size_t>(i)] < 0 && copy != i; copy = at(copy).next_copy)
        if (int const there = now[static_cast<std::size_t>(copy)]; there >= 0) return there;
      return now[static_cast<std::size_t>(i)];
    };
    for (int const i : particles) {
      Origin origin = at(i);
      for (int& parent : origin.parents)
        if (parent >= 0 && (parent = along(parent)) < 0) {
          origin.parents.fill(-1);
          break;
        }
      int next = at(i).next_copy;
      while (now[static_cast<std::size_t>(next)] < 0) next = at(next).next_copy;
      origin.next_copy = now[static_cast<std::size_t>(next)];
      made.origins_.push_back(origin);
    }
    return made;
  }

  /// Gives particle i mass until its stiffness bound is at most `rate` [1/s²] times its mass, or a quarter more than that
  /// where its relatives can not spare as much, and so on. `move(from, to, amount)` does each transfer [kg].
  template <class Tissue, class Move>
  void relieve(Tissue const& tissue, int i, Scalar rate, Move const& move) const {
    if (!(tissue.mass(i) > 0) || tissue.nailed(i) || !(rate > 0)) return;
    for (int tries = 0; tries < 32 && spare(tissue, i, rate) < 0; ++tries, rate *= Scalar(1.25)) draw(tissue, i, Scalar(0), rate, 3, move);
  }

 private:
  struct Origin {
    std::array<int, 3> parents;      // −1: none; an original particle has none
    std::array<Scalar, 3> weights;
    int next_copy;                   // the copies of a particle form a ring
  };

  int size() const noexcept { return static_cast<int>(origins_.size()); }
  Origin const& at(int i) const noexcept { return origins_[static_cast<std::size_t>(i)]; }
  Origin& at(int i) noexcept { return origins_[static_cast<std::size_t>(i)]; }

  /// What a particle has above what its springs ask for [kg]; at most three quarters of its mass.
  template <class Tissue>
  static Scalar spare(Tissue const& tissue, int i, Scalar rate) {
    return spare(tissue, i, rate, tissue.nailed(i) ? Scalar(0) : tissue.stiffness_bound(i));
  }
  /// The same of one that is asked again and again: no transfer changes its stiffness bound.
  template <class Tissue>
  static Scalar spare(Tissue const& tissue, int i, Scalar rate, Scalar bound) {
    Scalar const m = tissue.mass(i);
    Scalar const most = Scalar(0.75) * m;
    return tissue.nailed(i) ? most : std::min(most, m - bound / rate);
  }

  /// What a particle gets is more than this [kg], else it stays: a nailed one, which can always spare some, would lend again and again until it has none.
  template <class Tissue>
  static Scalar least(Tissue const& tissue, int i) {
    return std::numeric_limits<Scalar>::epsilon() * tissue.mass(i);
  }

  /// Whether a particle still lies where its parents say: a cutter may have moved one of them, or taken away all that was round it.
  template <class Tissue>
  bool lies_between_parents(Tissue const& tissue, Origin const& origin, int i) const {
    if (origin.parents[0] < 0) return false;
    Vector3<Scalar> off = tissue.rest_position(i);
    Scalar size = off.norm();
    for (std::size_t k = 0; k < 3; ++k)
      if (int const parent = origin.parents[k]; parent >= 0) {
        if (!(tissue.mass(parent) > 0)) return false;
        off -= origin.weights[k] * tissue.rest_position(parent), size += tissue.rest_position(parent).norm();
      }
    return off.norm() <= 4 * std::numeric_limits<Scalar>::epsilon() * size;
  }

  /// Draws mass from relatives, theirs from their parents, until particle i can spare `wanted`, as far as they can.
  template <class Tissue, class Move>
  void draw(Tissue const& tissue, int i, Scalar wanted, Scalar rate, int generations, Move const& move) const {
    auto const lack = [&, bound = tissue.stiffness_bound(i)] { return wanted - spare(tissue, i, rate, bound); };
    for (int copy = at(i).next_copy; copy != i && lack() > 0; copy = at(copy).next_copy)
      if (Scalar const amount = std::min(lack(), spare(tissue, copy, rate)); amount > least(tissue, i)) move(copy, i, amount);
    if (!(lack() > 0)) return;
    Origin const& origin = at(i);
    if (lies_between_parents(tissue, origin, i)) {
      if (generations > 0)
        for (std::size_t k = 0; k < 3; ++k)
          if (origin.weights[k] > 0) draw(tissue, origin.parents[k], origin.weights[k] * lack(), rate, generations - 1, move);
      Scalar amount = lack();
      for (std::size_t k = 0; k < 3; ++k)
        if (origin.weights[k] > 0) amount = std::min(amount, spare(tissue, origin.parents[k], rate) / origin.weights[k]);
      if (amount > least(tissue, i))
        for (std::size_t k = 0; k < 3; ++k)
          if (origin.weights[k] > 0) move(origin.parents[k], i, origin.weights[k] * amount);
    }
    if (!(lack() > 0)) return;
    for (int copy = i;;) {
      tissue.for_each_neighbour(copy, [&](int child) { give_back(tissue, child, i, lack(), rate, move); });
      copy = at(copy).next_copy;
      if (copy == i || !(lack() > 0)) return;
    }
  }

  bool are_copies(int a, int b) const noexcept {
    int copy = at(a).next_copy;
    while (copy != a && copy != b) copy = at(copy).next_copy;
    return copy == b;
  }

  /// A child that can spare mass gives all its parents their parts, so that particle i gets up to `lack` in place of itself or a copy of it.
  template <class Tissue, class Move>
  void give_back(Tissue const& tissue, int child, int i, Scalar lack, Scalar rate, Move const& move) const {
    Origin origin = at(child);
    Scalar part = 0;
    for (std::size_t k = 0; k < 3; ++k)
      if (origin.parents[k] >= 0 && are_copies(i, origin.parents[k])) part += origin.weights[k], origin.parents[k] = i;
    if (!(part > 0 && lack > 0) || !lies_between_parents(tissue, origin, child)) return;
    Scalar const amount = std::min(spare(tissue, child, rate), lack / part);
    if (!(amount * part > least(tissue, i))) return;
    for (std::size_t k = 0; k < 3; ++k)
      if (origin.weights[k] > 0) move(child, origin.parents[k], origin.weights[k] * amount);
  }

  HugePageVector<Origin> origins_;
};

}  // namespace palpate
