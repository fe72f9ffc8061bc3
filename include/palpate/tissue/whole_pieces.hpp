// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>

#include <cstddef>
#include <span>
#include <vector>

namespace palpate::detail {

/// Some of a tissue's particles, in the order of a tissue of their own: one or more whole pieces.
/// Errors     InvalidArgument for none, one that is listed twice, and what hangs on particles inside and outside; OutOfRange for a bad index.
class WholePieces {
 public:
  WholePieces(std::span<int const> some, int size) : particles(some), now_(static_cast<std::size_t>(size), -1) {
    if (some.empty()) throw InvalidArgument("a part of no particles; list those of one piece, see connected_components()");
    for (std::size_t k = 0; k < some.size(); ++k) {
      check_index("particle", some[k], size);
      if (now(some[k]) >= 0) throw InvalidArgument(message("particle ", some[k], " is listed twice"));
      now_[static_cast<std::size_t>(some[k])] = static_cast<int>(k);
    }
  }

  std::span<int const> particles;

  /// Its place in that order, −1 outside.
  int now(int particle) const noexcept { return now_[static_cast<std::size_t>(particle)]; }
  std::span<int const> now() const noexcept { return now_; }
  /// Whether what joins these is inside.
  template <class Ends>
  bool hold(Ends const& ends) const {
    bool const first = now(ends[0]) >= 0;
    for (int const end : ends)
      if ((now(end) >= 0) != first)
        throw InvalidArgument(message("particles ", ends[0], " and ", end, " hang together; a part is made of whole pieces, see connected_components()"));
    return first;
  }
  /// The columns of particles that are inside.
  template <class Joined>
  auto inside(Joined const& joined) const {
    Matrix<int, Joined::RowsAtCompileTime, Dynamic> kept(joined.rows(), joined.cols());
    Eigen::Index count = 0;
    for (Eigen::Index e = 0; e < joined.cols(); ++e)
      if (auto const corners = joined.col(e); hold(corners)) kept.col(count++) = corners.unaryExpr([&](int corner) { return now(corner); });
    kept.conservativeResize(Eigen::NoChange, count);
    return kept;
  }

 private:
  std::vector<int> now_;
};

}  // namespace palpate::detail
