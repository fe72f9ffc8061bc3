// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/region/concept.hpp>

#include <cmath>
#include <cstddef>

namespace palpate {

/// Only the particles within `rings` edges of a touched one are computed; the rest stand still and hold the zone's border.
/// A particle that leaves the rings goes on moving until it has relaxed, so nothing freezes deformed: its elastic force over its
/// stiffness, and its speed over √(stiffness/mass), are below `relaxation` mean edge lengths, and it is back within 100 times that
/// of its home. Away from home, as beside a wound, particles stop all at once when all have relaxed and nothing is touched.
/// Then the zone is empty, and a step costs nothing.
/// Limits     float has digits for no more than 1e-3 of a mean edge of the way home, and stops where a step no longer shows.
/// Source     \cite zheng2006, two rings; spec Z5. What the thesis leaves out: the relaxation.
/// Cost       O(particles in the zone).
struct ZoneOfInfluence {
  static constexpr bool follows_touch = true;
  int rings = 2;
  double relaxation = 1e-7;   // share of a mean edge length

  /// Throws InvalidArgument; a body that is given a zone asks.
  void validate() const {
    if (rings < 0) throw InvalidArgument(detail::message("a zone of ", rings, " rings; give 0 or more"));
    if (!(relaxation >= 0) || !std::isfinite(relaxation))
      throw InvalidArgument(detail::message("a zone's relaxation is ", relaxation, " of an edge; it must be finite and not negative"));
  }

  template <class Graph>
  void select(Graph const& graph, std::span<int const> touched, Selection& selection) const {
    for (int const p : touched) selection.add(p);
    std::size_t first = 0;
    for (int ring = 0; ring < rings; ++ring) {
      std::size_t const end = selection.particles().size();
      for (; first < end; ++first)
        graph.for_each_neighbour(selection.particles()[first], [&](int neighbour) { selection.add(neighbour); });
    }
  }
};

static_assert(Region<ZoneOfInfluence>);

}  // namespace palpate
