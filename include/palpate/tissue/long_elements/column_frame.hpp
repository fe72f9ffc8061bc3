// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/surface_topology.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/tissue/long_elements/columns_through.hpp>

#include <Eigen/SparseCore>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace palpate::detail {

/// The columns through a skin in three directions, and how its vertices follow them: u = W e, e how much longer each column is. Those along x come first,
/// then y and z.
template <RealScalar Scalar>
class ColumnFrame {
 public:
  using Numbers = Matrix<Scalar, Dynamic, 1>;

  ColumnFrame() = default;
  ColumnFrame(TriangleMesh<Scalar> const& mesh, Scalar spacing) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      grids_[axis] = columns_through(mesh, static_cast<int>(axis), static_cast<double>(spacing));
      first_[axis + 1] = first_[axis] + static_cast<int>(grids_[axis].columns.size());
      for (auto const& column : grids_[axis].columns) length_.push_back(std::max(static_cast<Scalar>(column.length()), Scalar(1e-3) * spacing));
    }
  }

  int size() const noexcept { return static_cast<int>(length_.size()); }
  Scalar length(int i) const noexcept { return length_[at(i)]; }   // m, at rest
  Scalar area(int i) const noexcept { return area_[at(i)]; }       // m², of the skin that it carries
  bool is_fixed(int i) const noexcept { return fixed_[at(i)] != 0; }   // both ends are nailed
  /// W, rows 3 vertex + axis.
  Eigen::SparseMatrix<Scalar, Eigen::RowMajor> const& weights() const noexcept { return weights_; }
  /// Vertices with no column near in one direction at least.
  int uncovered() const noexcept { return uncovered_; }

  /// Holds the ends of columns in triangles that are nailed, and the nailed vertices, and finds W.
  template <class Rest, class IsNailed>
  void hold(SurfaceTopology const& skin, Rest const& rest, IsNailed const& is_nailed) {
    auto const is_end_nailed = [&](LineCrossing const& end) {
      auto const corners = skin.corners(end.triangle);
      return std::all_of(corners.begin(), corners.end(), is_nailed);
    };
    int const n = size();
    low_share_.assign(at(n), Scalar(0.5)), fixed_.assign(at(n), 0), area_.assign(at(n), Scalar(0));
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::size_t k = 0; k < grids_[axis].columns.size(); ++k) {
        auto const& column = grids_[axis].columns[k];
        bool const low = is_end_nailed(column.low), high = is_end_nailed(column.high);
        std::size_t const i = at(first_[axis]) + k;
        if (low != high) low_share_[i] = low ? Scalar(0) : Scalar(1);
        fixed_[i] = low && high;
      }
    std::vector<Eigen::Triplet<Scalar>> entries;
    uncovered_ = 0;
    for (int v = 0; v < static_cast<int>(rest.cols()); ++v) {
      Vector3<double> const point = Vector3<Scalar>(rest.col(v)).template cast<double>();
      bool is_covered = true;
      for (int axis = 0; axis < 3; ++axis) {
        auto const& grid = grids_[at(axis)];
        is_covered &= follow(grid, point, [&](int k, double weight) {
          int const i = first_[at(axis)] + k;
          if (is_nailed(v) || fixed_[at(i)] != 0) return;
          auto const& column = grid.columns[at(k)];
          double const along = std::clamp((point[axis] - column.low.place) / std::max(column.length(), 1e-12), 0.0, 1.0);
          entries.emplace_back(3 * v + axis, i, static_cast<Scalar>(weight * (along - static_cast<double>(low_share_[at(i)]))));
        });
      }
      uncovered_ += is_covered ? 0 : 1;
    }
    weights_.resize(3 * rest.cols(), n);
    weights_.setFromTriplets(entries.begin(), entries.end());
    weights_.makeCompressed();
  }
  /// Takes what each carries of a gradient ∂V/∂x, 3 × vertices in one column.
  void take_areas(Numbers const& gradient) {
    Numbers const carried = weights_.transpose() * gradient;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Scalar const least = Scalar(1e-3 * grids_[axis].width[0] * grids_[axis].width[1]);
      for (int i = first_[axis]; i < first_[axis + 1]; ++i) area_[at(i)] = std::max(std::abs(carried[i]), least);
    }
  }
  /// σ (w_i − w_j)² / 2 of the ends of columns that are side by side.
  Eigen::SparseMatrix<Scalar> tension(Scalar surface_tension) const {
    std::vector<Eigen::Triplet<Scalar>> entries;
    for (std::size_t axis = 0; axis < 3 && surface_tension > 0; ++axis) {
      auto const& grid = grids_[axis];
      int const wide = grid.cells[0], high = grid.cells[1];
      auto const join = [&](int line, int other, Scalar sigma) {
        for (int m = grid.first[at(line)]; m < grid.first[at(line) + 1]; ++m)
          for (int k = grid.first[at(other)]; k < grid.first[at(other) + 1]; ++k) {
            auto const &one = grid.columns[at(m)], &two = grid.columns[at(k)];
            if (one.high.place < two.low.place || two.high.place < one.low.place) continue;
            int const i = first_[axis] + m, j = first_[axis] + k;
            for (Scalar const end : {Scalar(0), Scalar(1)}) {
              Scalar const wi = is_fixed(i) ? Scalar(0) : end - low_share_[at(i)], wj = is_fixed(j) ? Scalar(0) : end - low_share_[at(j)];
              entries.emplace_back(i, i, sigma * wi * wi), entries.emplace_back(j, j, sigma * wj * wj);
              entries.emplace_back(i, j, -sigma * wi * wj), entries.emplace_back(j, i, -sigma * wi * wj);
            }
          }
      };
      auto const over = static_cast<Scalar>(grid.width[1] / grid.width[0]);
      for (int b = 0; b < high; ++b)
        for (int a = 0; a < wide; ++a) {
          if (a + 1 < wide) join(b * wide + a, b * wide + a + 1, surface_tension * over);
          if (b + 1 < high) join(b * wide + a, (b + 1) * wide + a, surface_tension / over);
        }
    }
    Eigen::SparseMatrix<Scalar> made(size(), size());
    made.setFromTriplets(entries.begin(), entries.end());
    return made;
  }

 private:
  static std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }
  static double distance(SurfaceColumn const& column, double place) noexcept {
    return std::max({column.low.place - place, place - column.high.place, 0.0});
  }

  /// Of the columns of a line the nearest to a place on it, −1 where none is within `reach`.
  static int nearest_column(SurfaceColumns const& grid, int line, double place, double reach) {
    int found = -1;
    for (int k = grid.first[at(line)]; k < grid.first[at(line) + 1]; ++k)
      if (double const away = distance(grid.columns[at(k)], place); away <= reach) reach = away, found = k;
    return found;
  }
  /// visit(column of the axis, weight) for those that a point follows; false if none.
  template <class Visit>
  static bool follow(SurfaceColumns const& grid, Vector3<double> const& point, Visit const& visit) {
    double const place = point[grid.axis], reach = 3 * std::max(grid.width[0], grid.width[1]);
    double sum = 0;
    grid.for_lines_round(point, [&](int line, double weight) { sum += nearest_column(grid, line, place, reach) >= 0 ? weight : 0; });
    if (sum > 0) {
      grid.for_lines_round(point, [&](int line, double weight) {
        if (int const k = nearest_column(grid, line, place, reach); k >= 0) visit(k, weight / sum);
      });
      return true;
    }
    int best = -1;   // beside the grid's cells round it: the nearest within reach
    double nearest = reach * reach;
    for (std::size_t k = 0; k < grid.columns.size(); ++k) {
      auto const& column = grid.columns[k];
      std::array<int, 2> const cell{column.line % grid.cells[0], column.line / grid.cells[0]};
      double squared = distance(column, place) * distance(column, place);
      for (std::size_t s = 0; s < 2; ++s) {
        double const off = grid.low[s] + (cell[s] + 0.5) * grid.width[s] - point[grid.across(static_cast<int>(s))];
        squared += off * off;
      }
      if (squared < nearest) nearest = squared, best = static_cast<int>(k);
    }
    if (best >= 0) visit(best, 1.0);
    return best >= 0;
  }

  std::array<SurfaceColumns, 3> grids_;
  std::array<int, 4> first_{};                      // column along each axis
  std::vector<Scalar> length_, area_, low_share_;   // of each: m, m², of its elongation what its low end goes
  std::vector<char> fixed_;
  int uncovered_ = 0;
  Eigen::SparseMatrix<Scalar, Eigen::RowMajor> weights_;
};

}  // namespace palpate::detail
