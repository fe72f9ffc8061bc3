// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <optional>
#include <string>
#include <vector>

namespace palpate {

/// A point of a measured indentation curve. The same depth may be there many times.
struct IndentationPoint {
  double depth = 0.0;       ///< m, above 0: how far the indenter has moved since it touched the tissue at rest
  double force = 0.0;       ///< N, 0 or more: against its movement
  double deviation = 1.0;   ///< standard deviation of this force, in any unit: what counts is the ratio between points
};

/// Where and how the tissue was pressed: a point indenter sticks to one particle and moves it along a line.
template <RealScalar Scalar>
struct IndentationTest {
  int particle = -1;                                       ///< the touched one; −1: the surface particle nearest to `point`
  std::optional<Vector3<Scalar>> point{};                  ///< m, on the undeformed mesh
  Vector3<Scalar> direction = Vector3<Scalar>::Zero();     ///< into the tissue, of any length; zero: the inward normal there
  std::vector<int> nailed{};                               ///< particles that lie fast, besides those that are nailed in the tissue
};

/// A coefficient to be found: what it is called, its unit, and the value to begin with, above 0.
struct StiffnessGuess {
  std::string name;
  std::string unit;
  double value = 0.0;
};

}  // namespace palpate
