// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/particle_state.hpp>
#include <palpate/tissue/concept.hpp>

#include <cstddef>
#include <span>

namespace palpate {

/// Velocities of a body at rest, as a 3 × n expression.
template <RealScalar Scalar>
struct Still {
  static Vector3<Scalar> col(int) noexcept { return Vector3<Scalar>::Zero(); }
};

/// A body as those see it that choose its moving particles, or look for its balance.
template <TissueModel Tissue>
struct BodyView {
  using Scalar = typename Tissue::Scalar;
  Tissue const& tissue;
  ParticleState<Scalar> const& state;
  std::span<int const> forced, held;
  Vector3<Scalar> gravity;   // m/s²
  Scalar last_step;          // s
  std::size_t revision;      // of the tissue

  int size() const noexcept { return state.size(); }
  bool is_free(int i) const noexcept { return !tissue.nailed(i) && state.held[static_cast<std::size_t>(i)] == 0; }
};

}  // namespace palpate
