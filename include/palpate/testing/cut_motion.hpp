// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/testing/violations.hpp>

namespace palpate::testing {

/// What no cut may change of a body's motion: taken before a tick of the cutter, checked after it, without a step between.
///
///   testing::CutMotion const before(body);
///   cutter.advance(body, tip);
///   CHECK(testing::to_text(before.check(body)) == "");
///
/// Momentum   p = Σ m v is as it was, to 1e-12 (double) or 1e-5 (float) of Σ m |v|.
/// Energy     T = Σ m v²/2 has not risen, to the same share.
template <class Body>
class CutMotion {
 public:
  explicit CutMotion(Body const& body) : before_(sums(body)) {}

  Violations check(Body const& body) const {
    Violations found;
    Sums const now = sums(body);
    Vector3<double> const gained = now.momentum - before_.momentum;
    if (!(gained.norm() <= tolerance * before_.motion))
      found.push_back(palpate::detail::message("the momentum has changed by (", gained[0], ", ", gained[1], ", ", gained[2], ") kg m/s, of ", before_.motion));
    if (!(now.energy <= before_.energy * (1 + tolerance)))
      found.push_back(palpate::detail::message("the kinetic energy has risen from ", before_.energy, " to ", now.energy, " J"));
    return found;
  }

 private:
  static constexpr double tolerance = sizeof(typename Body::Scalar) == sizeof(float) ? 1e-5 : 1e-12;

  struct Sums {
    Vector3<double> momentum = Vector3<double>::Zero();   // kg m/s
    double motion = 0;                                    // Σ m |v|, kg m/s
    double energy = 0;                                    // J
  };

  static Sums sums(Body const& body) {
    Sums s;
    for (int i = 0; i < body.size(); ++i) {
      double const m = static_cast<double>(body.tissue().mass(i));
      Vector3<double> const v = body.velocities().col(i).template cast<double>();
      s.momentum += m * v, s.motion += m * v.norm(), s.energy += m / 2 * v.squaredNorm();
    }
    return s;
  }

  Sums before_;
};

}  // namespace palpate::testing
