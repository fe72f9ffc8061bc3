// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>

namespace palpate {

/// How two bodies press each other.
template <RealScalar Scalar>
struct BodyContactOptions {
  Scalar pressure = Scalar(1e4);     ///< Pa, where they are deep in one another; about Young's modulus of the softer one
  Scalar depth = Scalar(3e-3);       ///< m: a region of this mean depth has that pressure; one less deep, in proportion
  Scalar settling = Scalar(2e-3);    ///< s: the speed at which they close counts as the depth that it makes in this time
  Scalar friction = Scalar(0.3);     ///< Coulomb

  void validate(char const* whose = "BodyContact") const {
    detail::OptionCheck const check{whose};
    check.positive(".pressure", static_cast<double>(pressure), " Pa");
    check.positive(".depth", static_cast<double>(depth), " m");
    check.not_negative(".settling", static_cast<double>(settling), " s");
    check.not_negative(".friction", static_cast<double>(friction));
  }
};

/// How a body presses itself where it is folded.
template <RealScalar Scalar>
struct SelfContactOptions {
  Scalar pressure = Scalar(1e4);     ///< Pa, as of BodyContactOptions; so are the next three
  Scalar depth = Scalar(3e-3);       ///< m
  Scalar settling = Scalar(2e-3);    ///< s
  Scalar friction = Scalar(0.3);     ///< Coulomb
  Scalar apart = Scalar(0);          ///< m: triangles whose corners are nearer than this in the rest shape do not press each other; 0 is a thousandth of the mean edge
  Scalar parted = Scalar(0.01);      ///< mean edges that the lips of a cut have to be apart, on average round a vertex,
  Scalar parted_for = Scalar(0.01);  ///< s, and for how long, before they press when they meet again

  BodyContactOptions<Scalar> of_bodies() const { return {.pressure = pressure, .depth = depth, .settling = settling, .friction = friction}; }
  void validate() const {
    of_bodies().validate("SelfContact");
    detail::OptionCheck{"SelfContact"}.not_negative(".apart", static_cast<double>(apart), " m");
    detail::OptionCheck{"SelfContact"}.positive(".parted", static_cast<double>(parted), " mean edges");
    detail::OptionCheck{"SelfContact"}.not_negative(".parted_for", static_cast<double>(parted_for), " s");
  }
};

}  // namespace palpate
