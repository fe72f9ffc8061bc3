// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/surface_tree.hpp>
#include <palpate/core/columns.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>
#include <unordered_map>
#include <vector>

namespace palpate::detail {

/// The triangles of a surface, each of which may be replaced by any number of parts, and their search tree.
/// Invariant  numbered without gaps: one that goes leaves its number to the last.
template <RealScalar Scalar>
class PartedTriangles {
 public:
  using Corners = std::array<int, 3>;

  PartedTriangles() = default;
  explicit PartedTriangles(TriangleMesh<Scalar> const& mesh)
      : triangles_(mesh.triangles), tree_(mesh), whole_(static_cast<std::size_t>(mesh.triangles.cols())) {
    std::iota(whole_.begin(), whole_.end(), 0);
  }

  int size() const noexcept { return triangles_.size(); }
  auto view() const noexcept { return triangles_.view(); }
  Corners operator[](int t) const noexcept {
    auto const c = triangles_[t];
    return {c[0], c[1], c[2]};
  }
  /// The one that it is a part of, by its number when nothing was parted.
  int whole(int t) const noexcept { return whole_[static_cast<std::size_t>(t)]; }
  bool is_whole(int f, Corners const& corners) const noexcept {
    auto const own = parts_.find(f);
    return own == parts_.end() || (own->second.size() == 1 && (*this)[own->second[0]] == corners);
  }
  SurfaceTree<Scalar>& tree() noexcept { return tree_; }
  SurfaceTree<Scalar> const& tree() const noexcept { return tree_; }

  template <class Points>
  void set_parts(int f, std::vector<Corners> const& now, Points const& points) {
    std::vector<int>& own = parts_.try_emplace(f, 1, f).first->second;
    for (std::size_t k = 0; k < now.size(); ++k) {
      auto const column = Matrix<int, 3, 1>(now[k][0], now[k][1], now[k][2]);
      if (k >= own.size()) {
        own.push_back(tree_.add(points, now[k], own.empty() ? -1 : own[0]));
        triangles_.push_back(column), whole_.push_back(f);
      } else if ((*this)[own[k]] != now[k]) {
        triangles_[own[k]] = column;
        tree_.replace(points, own[k], now[k]);
      }
    }
    while (own.size() > now.size()) {
      int const gone = own.back(), last = size() - 1, of = whole(last);
      own.pop_back();
      tree_.remove(points, gone);
      if (gone != last) {
        auto& others = parts_.try_emplace(of, 1, of).first->second;
        std::replace(others.begin(), others.end(), last, gone);
        triangles_[gone] = Matrix<int, 3, 1>(triangles_.view().col(last));
        whole_[static_cast<std::size_t>(gone)] = of;
      }
      triangles_.pop_back(), whole_.pop_back();
    }
  }

 private:
  Columns<int, 3> triangles_;
  SurfaceTree<Scalar> tree_;
  std::vector<int> whole_;
  std::unordered_map<int, std::vector<int>> parts_;   // of those that ever had others than themselves
};

}  // namespace palpate::detail
