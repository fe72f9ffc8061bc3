// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/testing/violations.hpp>
#include <palpate/tissue/spring_law.hpp>

#include <algorithm>
#include <cmath>
#include <concepts>

namespace palpate::testing {

/// Checks a spring law on elongations −reach … reach of a link of the given rest length:
///   T(0) = 0, T is finite and continuous, T grows near 0, the damping is finite and not negative,
///   tangent_stiffness = dT/dδ (central differences over 1e-5 of the reach, float 3e-3; to 1e-5 of the slope, float 2e-2) and
///   energy = ∫T dδ (Simpson's rule; to 1e-6 of T_max · reach, float 1e-4) where the law states them,
///   and T grows from −rest_length to the reach where the law says that it is monotone.
/// Units      rest_length, reach [m]. `reach` is half the rest length if none is given; a law with a pole ends before it.
template <RealScalar Scalar, SpringLaw<Scalar> Law>
Violations check_spring_law(Law const& law, Scalar rest_length, Scalar reach = 0) {
  using palpate::detail::message;
  constexpr bool single = std::same_as<Scalar, float>;
  constexpr int grid = 64;
  if (!(reach > 0)) reach = rest_length / 2;
  Violations found;
  auto const tension = [&](Scalar elongation) { return static_cast<Scalar>(law.tension(elongation, rest_length)); };
  auto const at = [&](int k) { return reach * Scalar(2 * k - grid) / Scalar(grid); };

  if (!(tension(0) == 0)) found.push_back(message("tension(0, L) is ", tension(0), " N; a link at rest must not pull"));
  if (Scalar const c = static_cast<Scalar>(law.damping); !(c >= 0) || !std::isfinite(c))
    found.push_back(message("damping is ", c, " N s/m; it must be finite and not negative"));

  Scalar largest = 0;
  for (int k = 0; k <= grid; ++k) {
    if (!std::isfinite(tension(at(k)))) {
      found.push_back(message("tension(", at(k), ", ", rest_length, ") is not finite"));
      return found;
    }
    largest = std::max(largest, std::abs(tension(at(k))));
  }
  Scalar const near = reach * (single ? Scalar(1e-3) : Scalar(1e-5));
  if (!(tension(near) > 0 && tension(-near) < 0))
    found.push_back(message("tension(±", near, ", ", rest_length, ") is ", tension(near), " and ", tension(-near),
                            " N; a short stretch must pull and a short compression push"));

  for (int k = 0; k < grid; ++k) {   // follow the larger rise down to the last digits: what is left is a jump
    Scalar low = at(k), high = at(k + 1);
    for (int halving = 0; halving < (single ? 14 : 40); ++halving) {
      Scalar const middle = (low + high) / 2;
      (std::abs(tension(middle) - tension(low)) > std::abs(tension(high) - tension(middle)) ? high : low) = middle;
    }
    if (Scalar const jump = std::abs(tension(high) - tension(low)); jump > largest * (single ? Scalar(1e-3) : Scalar(1e-6)))
      found.push_back(message("tension jumps by ", jump, " N at an elongation of ", low, " m; it must be continuous"));
  }

  Scalar const step = reach * (single ? Scalar(3e-3) : Scalar(1e-5));
  Scalar const scale = largest / reach;
  if constexpr (StatesStiffness<Law, Scalar>) {
    for (int k = 1; k < grid; ++k) {
      Scalar const measured = (tension(at(k) + step) - tension(at(k) - step)) / (2 * step);
      Scalar const stated = static_cast<Scalar>(law.tangent_stiffness(at(k), rest_length));
      if (std::abs(at(k)) < 2 * step) continue;   // a law may have a kink in its slope at rest
      if (!(std::abs(stated - measured) <= scale * (single ? Scalar(2e-2) : Scalar(1e-5)) + std::abs(measured) * (single ? Scalar(2e-2) : Scalar(1e-5))))
        found.push_back(message("tangent_stiffness(", at(k), ", ", rest_length, ") is ", stated, " N/m; the tension grows by ", measured));
    }
  }
  if constexpr (StatesStiffness<Law, Scalar>)
    if (Scalar const at_rest = static_cast<Scalar>(law.tangent_stiffness(0, rest_length)); !(at_rest >= 0) || !std::isfinite(at_rest))
      found.push_back(message("tangent_stiffness(0, ", rest_length, ") is ", at_rest, " N/m; it must be finite and not negative"));
  if constexpr (StatesEnergy<Law, Scalar>)
    if (Scalar const at_rest = static_cast<Scalar>(law.energy(0, rest_length)); !(std::abs(at_rest) <= (single ? Scalar(1e-4) : Scalar(1e-6)) * largest * reach))
      found.push_back(message("energy(0, ", rest_length, ") is ", at_rest, " J; a link at rest has none"));
  if constexpr (StatesMonotony<Law, Scalar>) {
    bool grows = law.monotone(rest_length);   // one that says no promises nothing
    for (int k = 0; k < 4 * grid && grows; ++k) {
      auto const place = [&](int m) { return -rest_length + (reach + rest_length) * Scalar(m) / Scalar(4 * grid); };
      Scalar const low = tension(place(k)), high = tension(place(k + 1));
      grows = high > low;
      if (!grows)
        found.push_back(message("tension goes from ", low, " to ", high, " N as the elongation grows from ", place(k), " to ", place(k + 1),
                                " m, but monotone(", rest_length, ") is true"));
    }
  }
  if constexpr (StatesEnergy<Law, Scalar>) {
    for (int const side : {-1, 1}) {
      double sum = 0;   // Simpson's rule on pieces of reach/64
      for (int k = 0; k < grid; ++k) {
        double const width = static_cast<double>(side) * static_cast<double>(reach) / grid;
        auto const t = [&](double place) { return static_cast<double>(tension(static_cast<Scalar>(place * width))); };
        sum += width / 6 * (t(k) + 4 * t(k + 0.5) + t(k + 1));
        Scalar const stretch = static_cast<Scalar>((k + 1) * width);
        Scalar const stated = static_cast<Scalar>(law.energy(stretch, rest_length));
        if (!(std::abs(static_cast<double>(stated) - sum) <= (single ? 1e-4 : 1e-6) * static_cast<double>(largest * reach))) {
          found.push_back(message("energy(", stretch, ", ", rest_length, ") is ", stated, " J; the tension does a work of ", sum));
          break;
        }
      }
    }
  }
  return found;
}

/// For what is no law: says why.
template <RealScalar Scalar, class Law>
Violations check_spring_law(Law const&, Scalar, Scalar = 0) {
  static_assert(sizeof(palpate::detail::SpringLawSentences<Law, Scalar>) > 0);
  return {};
}

}  // namespace palpate::testing
