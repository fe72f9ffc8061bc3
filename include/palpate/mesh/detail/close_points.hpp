// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace palpate::detail {

/// The median distance between the first two corners of the elements: a measure of the mesh that a few wild points do not
/// change. Elements with a corner out of range or a point that is not finite do not count; 0 where none is left.
template <RealScalar Scalar, int Corners>
double median_side(Matrix<Scalar, 3, Dynamic> const& points, Matrix<int, Corners, Dynamic> const& elements) {
  std::vector<double> lengths;
  lengths.reserve(static_cast<std::size_t>(elements.cols()));
  for (Eigen::Index e = 0; e < elements.cols(); ++e) {
    int const a = elements(0, e), b = elements(1, e);
    if (a < 0 || b < 0 || a >= points.cols() || b >= points.cols()) continue;
    double const length = (points.col(b).template cast<double>() - points.col(a).template cast<double>()).norm();
    if (std::isfinite(length)) lengths.push_back(length);
  }
  if (lengths.empty()) return 0;
  auto const middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return *middle;
}

/// For every point the first one, itself or earlier, that it lies on: within `distance` of it, and not itself on another.
/// Points that are not finite lie on themselves.
/// Cost       O(n): cells of 64 distances in a hash table; a neighbouring cell is looked at only from near its wall.
template <RealScalar Scalar>
std::vector<int> first_close_point(Matrix<Scalar, 3, Dynamic> const& points, double distance) {
  double const cell = 64 * distance;
  auto const mix = [](std::uint64_t h, std::uint64_t word) {
    h = (h ^ word) * 0x9e3779b97f4a7c15u;
    return h ^ (h >> 29);
  };
  auto const cell_of = [&](double x) {   // without a distance every coordinate is a cell of its own
    if (!(distance > 0)) return std::bit_cast<std::uint64_t>(x + 0.0);
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::clamp(std::floor(x / cell), -4e18, 4e18)));
  };
  std::unordered_map<std::uint64_t, int> latest;   // the last first point of a cell; chained by `before`
  latest.reserve(static_cast<std::size_t>(points.cols()));
  std::vector<int> before(static_cast<std::size_t>(points.cols()), -1), first(before.size());
  for (int i = 0; i < static_cast<int>(points.cols()); ++i) {
    Vector3<double> const p = points.col(i).template cast<double>();
    first[static_cast<std::size_t>(i)] = i;
    if (!is_finite(p)) continue;
    std::uint64_t range[3][3];
    int sizes[3];
    for (int k = 0; k < 3; ++k) {
      range[k][0] = cell_of(p[k]);
      sizes[k] = 1;
      if (!(distance > 0)) continue;
      for (double const side : {-distance, distance})
        if (std::uint64_t const c = cell_of(p[k] + side); c != range[k][0]) range[k][sizes[k]++] = c;
    }
    int found = i;
    for (int x = 0; x < sizes[0]; ++x)
      for (int y = 0; y < sizes[1]; ++y)
        for (int z = 0; z < sizes[2]; ++z) {
          auto const entry = latest.find(mix(mix(mix(0, range[0][x]), range[1][y]), range[2][z]));
          if (entry == latest.end()) continue;
          for (int j = entry->second; j >= 0; j = before[static_cast<std::size_t>(j)])
            if (j < found && (points.col(j).template cast<double>() - p).norm() <= distance) found = j;
        }
    first[static_cast<std::size_t>(i)] = found;
    if (found != i) continue;
    auto const [entry, fresh] = latest.try_emplace(mix(mix(mix(0, range[0][0]), range[1][0]), range[2][0]), i);
    if (!fresh) {
      before[static_cast<std::size_t>(i)] = entry->second;
      entry->second = i;
    }
  }
  return first;
}

}  // namespace palpate::detail
