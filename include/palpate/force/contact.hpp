// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/core/phase.hpp>

namespace palpate {

/// Forces that differ by less than this share feel the same: a hand's just noticeable difference, 7 to 10 % from some 2 N on and more below.
/// Source     \cite zheng2006 ch. 1, for 7 %.
constexpr double force_just_noticeable_difference = 0.07;

/// What a force model knows about the tool in one servo tick. An open aggregate; every member has a default,
/// so a caller names only what its model needs. All vectors in the world frame.
/// Units      depths [m], velocity [m/s], force [N], seconds [s].
/// Invariant  `normal` has length one and points out of the tissue. Depth grows into the tissue and is
///            measured from the home (undeformed) surface; a depth ≤ 0 is outside.
template <RealScalar S>
struct ToolContact {
  using Scalar = S;

  CuttingPhase phase = CuttingPhase::no_contact;
  S depth = S(0);                                    ///< of the tip, along the normal
  S previous_depth = S(0);                           ///< one servo tick ago
  Vector3<S> normal = Vector3<S>::UnitZ();           ///< outward normal of the tissue
  Vector3<S> velocity = Vector3<S>::Zero();          ///< of the tip
  Vector3<S> tissue_force = Vector3<S>::Zero();      ///< reaction of the deformed tissue on the tool, for the tight coupling
  S seconds = S(0.001);                              ///< since the last servo tick
};

}  // namespace palpate
