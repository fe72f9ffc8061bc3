// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

namespace palpate::detail {

/// The order in which a body computes its particles, whatever their numbers. Meshes from files are often numbered without regard to place: then what elements
/// share is not in cache, and a step takes several times as long.
/// Order      by number where neighbours' numbers are close: |i − j| below 2 n^(2/3) in the mean; in a block that is numbered row by row it is about half of n^(2/3).
///            Else row by row through the rest shape, in slabs and rows that are a mean edge thick, across the longest side first.
/// Later      particles that edits add follow in the order of their numbers.
/// Cost       once, O(n log n). Copies share what it found.
class ParticleOrder {
 public:
  /// Finds the order for a tissue.
  template <class Tissue>
  void find(Tissue const& tissue) {
    rank_ = nullptr;
    int const n = tissue.size();
    double apart = 0, edges = 0, count = 0;   // of neighbours, looked at here and there: numbers, m
    for (int i = 0; i < n; i += 1 + n / 4096)
      tissue.for_each_neighbour(i, [&](int j) { apart += std::abs(i - j), edges += (place_of(tissue, i) - place_of(tissue, j)).matrix().norm(), ++count; });
    double const edge = edges / count;
    if (!(apart > 2 * count * std::pow(n, 2.0 / 3) && edge > 0)) return;
    Eigen::Array3Xd at(3, n);
    for (int i = 0; i < n; ++i) at.col(i) = place_of(tissue, i);
    if (!at.isFinite().all()) return;
    Eigen::Array3d const low = at.rowwise().minCoeff(), size = at.rowwise().maxCoeff() - low;
    std::array<int, 3> axes{0, 1, 2};
    std::stable_sort(axes.begin(), axes.end(), [&](int a, int b) { return size[a] > size[b]; });
    for (int const k : {axes[0], axes[1]}) at.row(k) = ((at.row(k) - low[k]) / edge + 1e-6).floor();
    auto const place = [&](int i) { return std::array{at(axes[0], i), at(axes[1], i), at(axes[2], i)}; };
    std::vector<int> order(static_cast<std::size_t>(n)), rank(order.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](int i, int j) { return place(i) < place(j); });
    for (int i = 0; i < n; ++i) rank[static_cast<std::size_t>(order[static_cast<std::size_t>(i)])] = i;
    rank_ = std::make_shared<std::vector<int> const>(std::move(rank));
  }
  bool is_by_number() const noexcept { return rank_ == nullptr; }
  /// Brings particles, which are in the order of their numbers, into this one.
  void sort(std::span<int> particles) const {
    if (rank_ == nullptr) return;
    auto const rank = [&](int i) { return static_cast<std::size_t>(i) < rank_->size() ? (*rank_)[static_cast<std::size_t>(i)] : i; };
    std::sort(particles.begin(), particles.end(), [&](int i, int j) { return rank(i) < rank(j); });
  }

 private:
  template <class Tissue>
  static Eigen::Array3d place_of(Tissue const& tissue, int i) {
    Vector3<typename Tissue::Scalar> const rest = tissue.rest_position(i);
    return rest.template cast<double>().array();
  }

  std::shared_ptr<std::vector<int> const> rank_;   // of those that were there; none: by number
};

}  // namespace palpate::detail
