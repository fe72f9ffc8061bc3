// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/tetrahedral_adjacency.hpp>
#include <palpate/volume/detail/tetrahedron_cells.hpp>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace palpate::detail {

/// Whether two tetrahedra that meet at a point of the undeformed solid hang together there: a chain of faces leads from one to the other, all at that point.
/// Where a wound is open they do not, but at its end; and one that was taken away, −1, only with another such.
template <class Body>
class HangTogether {
 public:
  using Point = Vector3<double>;
  explicit HangTogether(Body const& body) : body_(body), solid_(body.tissue().topology()) {}

  bool operator()(int a, int b, Point const& x) {
    if (a == b || a < 0 || b < 0) return a == b;
    double const slack = near + 4 * std::max({0.0, -weights(a, x).minCoeff(), -weights(b, x).minCoeff()});   // where they reach beyond the border
    reached_.assign(1, a);
    for (std::size_t i = 0; i < reached_.size() && i < 64; ++i)
      for (int k = 0; k < 4; ++k) {
        int const next = solid_.neighbour(reached_[i], k);
        if (next == b) return true;
        if (next >= 0 && std::find(reached_.begin(), reached_.end(), next) == reached_.end() && weights(next, x).minCoeff() > -slack) reached_.push_back(next);
      }
    return false;
  }
  TetrahedralAdjacency::Corners corners(int t) const noexcept { return solid_.corners(t); }
  Matrix<double, 4, 1> weights(int t, Point const& x) const noexcept {
    auto const c = solid_.corners(t);
    return weights_in({rest(c[0]), rest(c[1]), rest(c[2]), rest(c[3])}, x);
  }

 private:
  static constexpr double near = sizeof(typename Body::Scalar) == sizeof(float) ? 1e-4 : 1e-6;

  Point rest(int i) const noexcept { return body_.tissue().rest_position(i).template cast<double>(); }

  Body const& body_;
  TetrahedralAdjacency const& solid_;
  std::vector<int> reached_;
};

}  // namespace palpate::detail
