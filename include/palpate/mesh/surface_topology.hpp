// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/columns.hpp>
#include <palpate/core/index_lists.hpp>

#include <algorithm>
#include <array>

namespace palpate {

/// The triangles of a surface that is being edited, and which of them meet at each vertex.
/// Invariant  at most one triangle holds each directed edge; a triangle's corners are counter-clockwise seen from outside.
///            The border of a solid may touch itself along an edge: there several triangles hold one directed edge, and
///            triangle_with_edge gives any of them. See TetrahedralTopology, which pairs them.
/// Cost       every query and edit is O(triangles at the vertex), whatever the size of the surface.
class SurfaceTopology {
 public:
  using Corners = std::array<int, 3>;

  SurfaceTopology() = default;

  template <class Derived>
  SurfaceTopology(int vertices, Eigen::MatrixBase<Derived> const& triangles) : triangles_(triangles) {
    at_.reserve(vertices, 8 * vertices);
    for (int v = 0; v < vertices; ++v) at_.add_list();
    for (int t = 0; t < triangles_.size(); ++t)
      for (int k = 0; k < 3; ++k) at_.add(triangles_[t][k], t, triangles_[t][(k + 1) % 3]);
  }

  int vertex_count() const noexcept { return at_.size(); }
  int triangle_count() const noexcept { return triangles_.size(); }

  auto triangles() const noexcept { return triangles_.view(); }
  Corners corners(int triangle) const noexcept {
    auto const t = triangles_[triangle];
    return {t[0], t[1], t[2]};
  }

  /// The triangles that meet at a vertex, in no particular order.
  std::span<int const> triangles_at(int vertex) const noexcept { return at_[vertex]; }

  /// The triangle that holds the directed edge from → to, or −1.
  int triangle_with_edge(int from, int to) const noexcept {
    return at_.find(from, to);
  }

  /// Which of the triangle's three corners the vertex is: 0, 1 or 2; −1 if none.
  int corner_of(int triangle, int vertex) const noexcept {
    auto const c = triangles_[triangle];
    return c[0] == vertex ? 0 : c[1] == vertex ? 1 : c[2] == vertex ? 2 : -1;
  }

  /// Whether the triangles at a vertex close around it: it lies on no border and no lip.
  bool is_inside(int vertex) const noexcept {
    for (int const t : triangles_at(vertex)) {
      auto const c = triangles_[t];
      if (triangle_with_edge(vertex, c[0] == vertex ? c[2] : c[1] == vertex ? c[0] : c[1]) < 0) return false;
    }
    return true;
  }

  void add_vertex() { at_.add_list(); }
  /// Takes the last vertex away; no triangle may hold it.
  void pop_vertex() noexcept { at_.pop_list(); }

  int add_triangle(Corners const& corners) {
    int const t = triangles_.size();
    triangles_.push_back(Matrix<int, 3, 1>(corners[0], corners[1], corners[2]));
    for (std::size_t k = 0; k < 3; ++k) at_.add(corners[k], t, corners[(k + 1) % 3]);
    return t;
  }

  void set_triangle(int triangle, Corners const& corners) {
    Corners const before = this->corners(triangle);
    for (std::size_t k = 0; k < 3; ++k) {
      int const was = corner_of(triangle, corners[k]), ahead = corners[(k + 1) % 3];
      if (was < 0)
        at_.add(corners[k], triangle, ahead);
      else if (static_cast<std::size_t>(was) < k)
        at_.move_last(corners[k], triangle, ahead);
      else if (before[(static_cast<std::size_t>(was) + 1) % 3] != ahead)
        at_.set_key(corners[k], triangle, ahead);
    }
    for (int const gone : before)
      if (gone != corners[0] && gone != corners[1] && gone != corners[2]) at_.remove(gone, triangle);
    triangles_[triangle] = Matrix<int, 3, 1>(corners[0], corners[1], corners[2]);
  }

  /// Gives a triangle another vertex in the place of one that it holds.
  void replace_corner(int triangle, int before, int now) {
    auto held = triangles_[triangle];
    int const k = corner_of(triangle, before);
    held[k] = now;
    at_.remove(before, triangle);
    at_.add(now, triangle, held[(k + 1) % 3]);
    at_.set_key(held[(k + 2) % 3], triangle, now);
  }

  /// Takes the last triangle away.
  void pop_triangle() noexcept {
    int const t = triangles_.size() - 1;
    for (int k = 0; k < 3; ++k) at_.remove(triangles_[t][k], t);
    triangles_.pop_back();
  }

  void reserve(int vertices, int triangles) {
    triangles_.reserve_and_prefault(triangles);
    at_.reserve(vertices, std::max(16 * vertices, 12 * triangles));
  }

 private:
  Columns<int, 3> triangles_;
  IndexLists at_;   // triangles, each with its next corner
};

}  // namespace palpate
