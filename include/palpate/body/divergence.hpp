// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>

namespace palpate {

/// A particle that left its body.
template <class Scalar>
struct Divergence {
  int particle = -1;    // −1: none that stands out
  Scalar value = 0;     // the coordinate [m] or velocity [m/s] that is out of bounds, NaN included
};

/// Which particle of `system`, whose columns are the particles in `moving`, is farther than `bound` [m] from the origin or not finite.
template <class System>
std::optional<Divergence<typename System::Scalar>> find_diverged(System& system, std::span<int const> moving,
                                                                 typename System::Scalar bound) noexcept {
  using Scalar = typename System::Scalar;
  if (system.is_within(bound)) return {};
  auto const x = system.positions();
  auto const v = system.velocities();
  constexpr Scalar largest = std::numeric_limits<Scalar>::max();
  for (int i = 0; i < system.moving(); ++i)
    for (int k = 0; k < 6; ++k) {
      Scalar const value = k < 3 ? x(k, i) : v(k - 3, i);
      if (!(std::abs(value) < bound || (k >= 3 && std::abs(value) <= largest))) return Divergence<Scalar>{moving[static_cast<std::size_t>(i)], value};
    }
  return {};
}

}  // namespace palpate
