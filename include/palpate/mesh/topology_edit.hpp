// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace palpate {

/// What one operator has changed in a topology: a record of fixed size, for whoever keeps something per vertex, element or triangle.
///   vertex            the new vertex n: the last one
///   parents           what it lies between: 1 the vertex it is a copy of, 2 the ends of an edge, 3 the corners of a face, 4 of a tetrahedron
///   replaced          elements and triangles at n with numbers below `first_…`: each has n in the place of its parent, `parents().back()`
///   appended          elements and triangles first_… to end_… − 1
/// Everything else is as it was, numbers included. A surface has no tetrahedra: first and end are 0.
/// Limits     how far n lies towards each parent is the caller's, who chose it.
struct TopologyEdit {
  int vertex = -1;
  std::array<int, 4> parent{-1, -1, -1, -1};
  int parent_count = 0;
  int first_tetrahedron = 0, end_tetrahedron = 0;
  int first_triangle = 0, end_triangle = 0;

  std::span<int const> parents() const noexcept { return {parent.data(), static_cast<std::size_t>(parent_count)}; }
  bool is_copy() const noexcept { return parent_count == 1; }
};

/// What taking a tetrahedron away has changed in a topology.
///   tetrahedron       it had this number, which the one that was the last has now
///   last              the number that the last one had
///   corners           its vertices, which stay
///   opened()          border triangles where it had neighbours, appended in this order
///   gone()            then border triangles that were its faces went, in this order: each left its number to the one that was the last then
struct TetrahedronRemoval {
  int tetrahedron = -1, last = -1;
  std::array<int, 4> corners{-1, -1, -1, -1};
  std::array<std::array<int, 3>, 4> opened_triangles{};
  std::array<int, 4> gone_triangles{-1, -1, -1, -1};
  std::size_t opened_count = 0, gone_count = 0;

  std::span<std::array<int, 3> const> opened() const noexcept { return {opened_triangles.data(), opened_count}; }
  std::span<int const> gone() const noexcept { return {gone_triangles.data(), gone_count}; }
};

}  // namespace palpate
