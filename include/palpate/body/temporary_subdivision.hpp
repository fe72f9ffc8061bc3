// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <array>
#include <cstddef>

namespace palpate {

/// Barycentric weights of a point of a triangle, kept off its edges: off each by a share of the height over it, or by a distance [m] where that is
/// more, but by no more than a quarter of the height.
template <RealScalar Scalar>
Vector3<Scalar> off_edges(std::array<Vector3<Scalar>, 3> const& corners, Vector3<Scalar> const& w, Scalar share, Scalar distance) {
  Scalar const twice_area = (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm();
  Vector3<Scalar> least;
  for (std::size_t k = 0; k < 3; ++k) {
    Scalar const part = distance * (corners[(k + 2) % 3] - corners[(k + 1) % 3]).norm();   // of the area, as the height is
    least[static_cast<int>(k)] = part < twice_area / 4 ? std::max(share, part / twice_area) : Scalar(0.25);
  }
  Vector3<Scalar> const above = (w - least).cwiseMax(Scalar(0));
  return least + (1 - least.sum()) / above.sum() * above;
}

using TemporaryId = std::size_t;   // of a temporary subdivision: no other gets the same

/// A triangle that a blade is in, as a picture shows it: divided in three around the blade, and open up to there. It is for the eye only: the body has
/// no such particle or triangle.
///   x = Σ w_k x_k   over its corners; of the one that the cut has come over, the mean of both copies
/// Source  the temporary subdivision of \cite zheng2006 ch. 3.
template <RealScalar Scalar>
struct TemporarySubdivision {
  TemporaryId id = 0;
  int triangle = -1;                                   // of the body's surface: the first of the three is drawn in its place
  Vector3<Scalar> weights = Vector3<Scalar>::Zero();   // barycentric, of the blade
  int entered = 0;                                     // 0, 1 or 2: the corner that the cut has come over
  std::array<int, 2> lips{-1, -1};                     // that particle on the left and on the right of the cut: two copies where it is open

  /// Which of the three triangles are beside the cut.
  std::size_t to_the_left() const noexcept { return static_cast<std::size_t>((entered + 2) % 3); }
  std::size_t to_the_right() const noexcept { return static_cast<std::size_t>(entered); }

  /// The three triangles; `blade` is the number of the vertex there.
  std::array<std::array<int, 3>, 3> parts(std::array<int, 3> const& corners, int blade) const noexcept {
    std::array<std::array<int, 3>, 3> made{{{corners[0], corners[1], blade}, {corners[1], corners[2], blade}, {corners[2], corners[0], blade}}};
    made[to_the_right()][0] = lips[1], made[to_the_left()][1] = lips[0];
    return made;
  }

  /// What a field of the particles, such as their positions, is at the blade.
  template <class Columns>
  Vector3<Scalar> mean(std::array<int, 3> const& corners, Columns const& values) const {
    Vector3<Scalar> sum = Vector3<Scalar>::Zero();
    for (int k = 0; k < 3; ++k) {
      Vector3<Scalar> value = values.col(corners[static_cast<std::size_t>(k)]);
      if (k == entered) value = (values.col(lips[0]) + values.col(lips[1])) / 2;
      sum += weights[k] * value;
    }
    return sum;
  }
};

}  // namespace palpate
