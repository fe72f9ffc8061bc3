// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/solid_edit.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/tetrahedral_topology.hpp>
#include <palpate/volume/detail/tetrahedron_cells.hpp>
#include <palpate/volume/detail/triangle_parts.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

namespace palpate::detail {

inline void sort_each_once(std::vector<int>& list) {
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

/// The tetrahedra of a solid as it was made (roots), undeformed, and into which each has been divided since: a tree of planes, whose leaves are the tetrahedra
/// of now. What is beyond the border belongs to the root it was found with, and to the leaf on its side of all planes.
/// Cost       an edit O(1); find O(depth of the tree).
class DividedSolid {
 public:
  using Point = Vector3<double>;

  DividedSolid() = default;
  template <RealScalar Scalar>
  DividedSolid(TetrahedralMesh<Scalar> const& mesh, TetrahedralTopology const& topology) {
    for (Eigen::Index i = 0; i < mesh.points.cols(); ++i) points_.push_back(mesh.points.col(i).template cast<double>());
    made_of_ = points_.size();
    for (int t = 0; t < topology.tetrahedron_count(); ++t) {
      nodes_.push_back({Point::Zero(), 0, topology.corners(t), -1, t, t});
      beyond_.push_back({topology.neighbour(t, 0), topology.neighbour(t, 1), topology.neighbour(t, 2), topology.neighbour(t, 3)});
    }
    forget();
  }

  int roots() const noexcept { return static_cast<int>(beyond_.size()); }
  int vertices() const noexcept { return static_cast<int>(made_of_); }   // of the roots
  /// Of tetrahedra now.
  int size() const noexcept { return static_cast<int>(leaf_of_.size()); }
  int root_of(int tetrahedron) const noexcept { return node(leaf_of_[at(tetrahedron)]).root; }
  /// −1: it was taken away.
  int tetrahedron(int leaf) const noexcept { return node(leaf).tetrahedron; }
  std::array<Point, 4> corners_of_root(int root) const noexcept { return corners(node(root)); }

  /// Nothing has been divided.
  void forget() {
    nodes_.resize(beyond_.size()), leaf_of_.resize(beyond_.size()), points_.resize(made_of_);
    for (Node& root : nodes_) root.child = -1, root.tetrahedron = root.root;
    std::iota(leaf_of_.begin(), leaf_of_.end(), 0);
  }
  template <RealScalar Scalar>
  void follow(SolidEdit<Scalar> const& edit) {
    if (edit.kind == SolidEdit<Scalar>::Kind::removed) return remove(edit.first);
    if (edit.kind != SolidEdit<Scalar>::Kind::divided) return;
    int const leaf = leaf_of_[at(edit.first)];
    auto const a = static_cast<std::size_t>(edit.from), b = static_cast<std::size_t>(edit.to);
    auto const c = node(leaf).corners;
    Point const from = point(c[a]), to = point(c[b]);
    Point const n = from + static_cast<double>(edit.s) * (to - from);
    std::size_t const k = a != 0 && b != 0 ? 0 : a != 1 && b != 1 ? 1 : 2, l = 6 - a - b - k;
    Node whole{Point::Zero(), 0, c, -1, edit.first, node(leaf).root}, part = whole;
    whole.corners[b] = part.corners[a] = static_cast<int>(points_.size()), part.tetrahedron = edit.second;
    Node& parent = nodes_[at(leaf)];
    Point const normal = (point(c[k]) - n).cross(point(c[l]) - n);
    parent.normal = normal / normal.dot(from - n);
    parent.offset = parent.normal.dot(n);
    parent.child = leaf_of_[at(edit.first)] = static_cast<int>(nodes_.size()), parent.tetrahedron = -1;
    leaf_of_.push_back(parent.child + 1);
    points_.push_back(n), nodes_.push_back(whole), nodes_.push_back(part);
  }

  /// The leaf that a point of a root is in.
  int find(int root, Point const& p) const noexcept {
    int found = root;
    while (node(found).child >= 0) found = node(found).child + (node(found).normal.dot(p) < node(found).offset ? 1 : 0);
    return found;
  }

  /// Divides a triangle, of which the first corner is in `root`, into parts of a leaf each.
  void divide(TriangleParts& parts, std::array<Point, 3> const& corner, int root) const {
    std::vector<int> from{-1};   // of each part the root that it comes from
    parts.parts[0].leaf = root;
    int steps = 0;
    for (std::size_t n = 0; n < parts.parts.size(); ++n)
      for (int k = 0; k < 4; ++k) {
        int const here = parts.parts[n].leaf, beyond = beyond_[at(here)][static_cast<std::size_t>(k)];
        if (beyond < 0 || beyond == from[n] || ++steps > max_steps) continue;   // across the border everything stays
        Point inside;
        for (int i = 0; i < 3; ++i) inside[i] = weights_in(corners(node(here)), corner[static_cast<std::size_t>(i)])[k];
        auto const side = parts.cut(n, inside);
        if (side == TriangleParts::Side::both) parts.parts.back().leaf = beyond, from.push_back(here);
        if (side == TriangleParts::Side::below) parts.parts[n].leaf = beyond, from[n] = here, k = -1;
      }
    for (std::size_t n = 0; n < parts.parts.size(); ++n)
      while (node(parts.parts[n].leaf).child >= 0) {
        Node const& here = node(parts.parts[n].leaf);
        Point above;
        for (int i = 0; i < 3; ++i) above[i] = here.normal.dot(corner[static_cast<std::size_t>(i)]) - here.offset;
        auto const side = parts.cut(n, above);
        if (side == TriangleParts::Side::both) parts.parts.back().leaf = here.child + 1;
        parts.parts[n].leaf = here.child + (side == TriangleParts::Side::below ? 1 : 0);
      }
  }

 private:
  static constexpr int max_steps = 100000;   // outside of the solid, where no tetrahedron holds a point, they might go on for ever

  struct Node {
    Point normal;   // normal · x − offset is 0 in the plane that divides it, and 1 at the corner that the first child keeps
    double offset;
    std::array<int, 4> corners;
    int child, tetrahedron, root;   // the second child follows the first
  };

  static std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }
  void remove(int tetrahedron) noexcept {
    nodes_[at(leaf_of_[at(tetrahedron)])].tetrahedron = -1;
    if (tetrahedron + 1 < size()) leaf_of_[at(tetrahedron)] = leaf_of_.back(), nodes_[at(leaf_of_.back())].tetrahedron = tetrahedron;
    leaf_of_.pop_back();
  }
  Node const& node(int i) const noexcept { return nodes_[at(i)]; }
  Point const& point(int i) const noexcept { return points_[at(i)]; }
  std::array<Point, 4> corners(Node const& of) const noexcept {
    auto const& c = of.corners;
    return {point(c[0]), point(c[1]), point(c[2]), point(c[3])};
  }

  std::vector<Point> points_;                 // corners of the roots, and what edges have been divided at
  std::size_t made_of_ = 0;                   // so many are corners of the roots
  std::vector<Node> nodes_;                   // first the roots
  std::vector<std::array<int, 4>> beyond_;    // across each face of a root
  std::vector<int> leaf_of_;                  // of each tetrahedron of now
};

}  // namespace palpate::detail
