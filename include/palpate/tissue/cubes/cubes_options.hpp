// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/random.hpp>
#include <palpate/core/steady_seconds.hpp>
#include <palpate/core/visit_order.hpp>
#include <palpate/material/isotropic.hpp>

#include <cmath>
#include <limits>

namespace palpate {

/// What a body of cubes is made of, and how it is relaxed.
template <RealScalar Scalar>
struct CubesOptions {
  Scalar edge{};                       ///< of a cube [m]
  Scalar young{};                      ///< Young's modulus [Pa]; Poisson's ratio is 1/4
  Scalar density = 1000;               ///< kg/m³; 0: none
  Scalar pretension = 0;               ///< by which share springs are shorter than their spacing: a cut gapes
  int levels = 0;                      ///< how often a touched cube is split, each time in 8: 0 … 4
  int join_after = 100;                ///< steps after the last touch; then it is one cube again
  int touched_cubes = 8;               ///< so many split at once allocate nothing
  VisitOrder order = VisitOrder::breadth_first;
  Scalar relaxation = Scalar(1.2);     ///< α, above 0 and below 2
  int sweeps = 6;                      ///< of a step
  double seconds = std::numeric_limits<double>::infinity();   ///< of a step at most, by `clock`
  double (*clock)() = steady_seconds;        ///< s; not asked where there is no limit
  Seed seed{1};                        ///< of the random order

  void validate() const {
    detail::OptionCheck const check{"Cubes"};
    check.positive(".edge", static_cast<double>(edge), " m");
    detail::require_young("Cubes: .young", young);
    if (density != 0) detail::require_density("Cubes: .density", density);
    check(pretension >= 0 && pretension < 1, ".pretension", static_cast<double>(pretension), "springs are shorter by this share; give one from 0 to below 1");
    check(levels >= 0 && levels <= 4, ".levels", levels, "give how often a touched cube is split, 0 to 4");
    check(join_after >= 0, ".join_after", join_after, "give a number of steps, zero or more");
    check(touched_cubes >= 0, ".touched_cubes", touched_cubes, "give a number of cubes, zero or more");
    check(relaxation > 0 && relaxation < 2, ".relaxation", static_cast<double>(relaxation), "give a factor above 0 and below 2");
    check(sweeps >= 1, ".sweeps", sweeps, "give one or more");
    if (clock == nullptr && std::isfinite(seconds)) throw InvalidArgument("Cubes: .seconds is a limit, and .clock is null; give a clock, or none for the steady one");
    check(seconds > 0, ".seconds", seconds, " s", "give a time above zero, or none for no limit");
  }
};

}  // namespace palpate
