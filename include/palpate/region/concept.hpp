// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/policy.hpp>

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace palpate {

/// A set of particles in insertion order, with membership in constant time (stamps).
/// Cost       clear, add and contains are O(1); nothing is allocated below the reserved size.
class Selection {
 public:
  void reserve(int particles) {
    particles_.reserve(static_cast<std::size_t>(particles));
    stamp_.resize(static_cast<std::size_t>(particles), 0);
  }

  void clear() noexcept {
    particles_.clear();
    ++now_;
  }

  /// True if the particle was not in the set before.
  bool add(int particle) {
    auto const p = static_cast<std::size_t>(particle);
    if (p >= stamp_.size()) stamp_.resize(p + 1, 0);
    if (stamp_[p] == now_) return false;
    stamp_[p] = now_;
    particles_.push_back(particle);
    return true;
  }

  bool contains(int particle) const noexcept {
    auto const p = static_cast<std::size_t>(particle);
    return p < stamp_.size() && stamp_[p] == now_;
  }

  void sort() { std::sort(particles_.begin(), particles_.end()); }

  std::span<int const> particles() const noexcept { return particles_; }
  int size() const noexcept { return static_cast<int>(particles_.size()); }

 private:
  std::vector<int> particles_;
  std::vector<std::uint64_t> stamp_;
  std::uint64_t now_ = 1;
};

namespace detail {

/// The least a graph of particles can be; concepts are checked against it.
struct GraphArchetype {
  int size() const { return 0; }
  template <class Visit>
  void for_each_neighbour(int, Visit) const {}
};

}  // namespace detail

/// Selects the particles that a step computes: adds them to `selection`, given those that are touched, held or pulled. `relaxation` is
/// the share of a mean edge below which a particle outside the selection may stop (see SoftBody::step).
/// A Validatable region is validated when a body is made.
/// What the syntax can not say: the selection contains every touched particle and depends on the graph and the touched ones alone.
template <class R>
concept Region = std::copyable<R> && requires(R const& region, detail::GraphArchetype const& graph, std::span<int const> touched,
                                              Selection& selection) {
  region.select(graph, touched, selection);
  { region.relaxation } -> std::convertible_to<double>;
  { R::follows_touch } -> std::convertible_to<bool>;
};

namespace detail {

/// Says, where it is instantiated, what keeps R from being a Region.
template <class R>
struct RegionSentences {
  static_assert(Region<R>, "palpate: the third policy is no Region, which has: template <class Graph> void select(Graph const& graph, std::span<int const> touched, Selection& "
                           "selection) const, a number relaxation and static constexpr bool follows_touch; WholeBody{} and ZoneOfInfluence{.rings = 2} are.");
};

}  // namespace detail

/// Refinement: a region that adapts to its truncation error. `adapt(error, may_shrink)` takes the error in mean edges while something is
/// touched: at every eighth step, and at the next one where it returned true. `adapts()` says whether it wants to be called. A body works
/// on a copy, and returns to the original region whenever nothing moves any more.
template <class R>
concept AdaptsToError = Region<R> && requires(R& region, R const& asked, double error) {
  { region.adapt(error, true) } -> std::convertible_to<bool>;
  { asked.adapts() } -> std::convertible_to<bool>;
};

}  // namespace palpate
