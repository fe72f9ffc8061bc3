// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>

#include <cmath>

namespace palpate {

namespace detail {

inline void require_servo(char const* who, double mass, double damping, double period) {
  require_positive(message(who, ": the mass"), mass, "kg");
  require_non_negative(message(who, ": the damping"), damping, "N·s/m");
  if (!(period > 0.0) || !std::isfinite(period)) throw InvalidArgument(message(who, ": the period is ", period, " s; give that of the servo, 0.001 for most"));
}

}  // namespace detail

/// The stiffest wall [N/m] that a mass with damping stays stable at when a servo renders it from samples: at a stiffer one it vibrates ever more.
///   K = min((1 − e) / (φ²/m − e (T − φ)/b), 2 b (1 + e) / (T (1 + e) − 2 φ)),   e = e^(−b T/m),   φ = (1 − e) m/b;   about 2 b/T
/// Units      kg, N·s/m, s.
/// Source     the loop under zero-order hold: at the first its determinant is 1, at the second, with more damping than 3.7 m/T, an eigenvalue −1;
///            \cite gil2004. Without delay, without virtual damping, the mass alone: a hand's mass
///            lowers it and its damping raises it.
/// Errors     InvalidArgument for what is not positive; 0 for a mass without damping, which no wall is stable with.
inline double stable_wall(double mass, double damping, double period) {
  detail::require_servo("stable_wall", mass, damping, period);
  double const a = damping / mass, loss = -std::expm1(-a * period);   // 1 − e
  if (!(loss > 0.0)) return 0.0;
  // φ = T (1 − y/2 + y²/6 …) with y = a T; for a small y both terms below cancel to y T²/m /12 …, so they are summed as a series.
  double const y = a * period;
  if (y < 1e-3) return 2.0 * damping / period * (1.0 + y / 6.0);
  double const phi = loss / a, kept = 2.0 - loss;   // 1 + e
  double const vibrates = loss / (phi * phi / mass - (1.0 - loss) * (period - phi) / (a * mass));
  double const alternates = 2.0 * damping * kept / (period * kept - 2.0 * phi);   // the denominator is y³/6 and above 0
  return y > 1.0 ? std::fmin(vibrates, alternates) : vibrates;
}

/// The stiffest wall [N/m] that is passive for every hand, with virtual damping B rendered beside it: K = 2 (b − |B|)/T, not below 0.
/// Source     \cite colgate1997
/// Errors     InvalidArgument for what is not positive or not finite.
inline double passive_wall(double damping, double virtual_damping, double period) {
  detail::require_servo("passive_wall", 1.0, damping, period);
  if (!std::isfinite(virtual_damping)) throw InvalidArgument(detail::message("passive_wall: the virtual damping is ", virtual_damping, " N·s/m; give a finite number"));
  return std::fmax(0.0, 2.0 * (damping - std::abs(virtual_damping)) / period);
}

}  // namespace palpate
