// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/region/concept.hpp>

namespace palpate {

/// Every particle is computed at every step.
struct WholeBody {
  static constexpr bool follows_touch = false;   ///< the choice never changes with the touch
  double relaxation = 0;

  template <class Graph>
  void select(Graph const& graph, std::span<int const> /*touched*/, Selection& selection) const {
    for (int i = 0; i < graph.size(); ++i) selection.add(i);
  }
};

}  // namespace palpate
