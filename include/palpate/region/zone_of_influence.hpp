// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/region/concept.hpp>

#include <cmath>
#include <cstddef>

namespace palpate {

/// Computes only the particles within `rings` edges of a touched one; the others stand still and are the fixed border of the zone.
/// A particle that leaves the zone goes on moving until it has relaxed, so nothing freezes deformed. It has relaxed when its elastic
/// force over its stiffness, and its speed over √(stiffness/mass), are below `relaxation` mean edges, and it is within 100 times that of
/// its home. Away from home, as beside a wound, particles stop together when all have relaxed and nothing is touched. Then the zone is
/// empty, and a step costs nothing.
/// With a `tolerance` the number of rings adapts to the body's truncation_error(): one more where that is above the tolerance, one less
/// where it is below a tenth of it and nobody beyond the rings moves. `rings` is then the start after each rest.
/// Limits     float resolves no less than 1e-3 of a mean edge on the way home, and stops where a step no longer shows.
/// Source     \cite zheng2006, two rings. The relaxation is ours. The tolerance is of an estimate: in the tests the largest error of a
///            resting body was at most three times that.
/// Cost       O(particles in the zone). With a tolerance the border's forces are probed at every eighth step, and at each while rings
///            grow.
struct ZoneOfInfluence {
  static constexpr bool follows_touch = true;
  int rings = 2;
  double relaxation = 1e-7;   // share of a mean edge length
  double tolerance = 0;       // of truncation_error(), as a share of a mean edge length; 0: the rings stay

  /// Throws InvalidArgument; a body that is given a zone asks.
  void validate() const {
    if (rings < 0) throw InvalidArgument(detail::message("a zone of ", rings, " rings; give 0 or more"));
    detail::require_non_negative("a zone's relaxation", relaxation, "of an edge");
    detail::require_non_negative("a zone's tolerance", tolerance, "of an edge");
  }

  bool adapts() const noexcept { return tolerance > 0; }

  /// Changes `rings` by one for a truncation error in mean edges: more where it is above the tolerance, less where it may shrink and is
  /// far below. True where it was above.
  bool adapt(double error, bool may_shrink) noexcept {
    if (error > tolerance) {
      ++rings;
      return true;
    }
    if (may_shrink && error < tolerance / 10 && rings > 0) --rings;
    return false;
  }

  template <class Graph>
  void select(Graph const& graph, std::span<int const> touched, Selection& selection) const {
    for (int const p : touched) selection.add(p);
    std::size_t first = 0;
    for (int ring = 0; ring < rings; ++ring) {
      std::size_t const end = selection.particles().size();
      if (first == end) return;   // the whole piece
      for (; first < end; ++first)
        graph.for_each_neighbour(selection.particles()[first], [&](int neighbour) { selection.add(neighbour); });
    }
  }
};

}  // namespace palpate
