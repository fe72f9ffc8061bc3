// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

namespace palpate {

/// Slew limit: `from`, moved straight towards `to` by at most `most`.
///   |to − from| ≤ most: to;   else from + most (to − from)/|to − from|
/// Units      N.
/// Invariant  finite for finite forces; a limit that is not above zero keeps `from`.
/// Cost       noexcept, no allocation: allowed in the servo tick.
/// Limits     A limit below stiffness × speed × period makes a wall softer than stated and can destabilise it: 0.5 N a tick suffices for
///            500 N/m at 1 m/s.
template <RealScalar S>
Vector3<S> slewed(Vector3<S> const& from, Vector3<S> const& to, S most) noexcept {
  Vector3<S> const way = to - from;
  S const length = stable_norm(way);
  if (length <= most) return to;
  if (!(most > S(0))) return from;
  return from + (most / length) * way;
}

}  // namespace palpate
