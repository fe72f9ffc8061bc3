// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/detail/simplices.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

namespace palpate::detail {

/// Sets that are joined step by step; the smallest member stands for its set.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t size) : parent_(size) { std::iota(parent_.begin(), parent_.end(), 0); }
  int find(int i) {
    while (at(i) != i) {
      at(i) = at(at(i));
      i = at(i);
    }
    return i;
  }
  void join(int a, int b) {
    a = find(a), b = find(b);
    if (a != b) at(std::max(a, b)) = std::min(a, b);
  }
  /// The wanted members of each set, in order; sets in the order of their first.
  template <class Wanted>
  std::vector<std::vector<int>> sets(Wanted const& wanted) {
    std::vector<std::vector<int>> found;
    std::vector<std::size_t> place(parent_.size(), parent_.size());
    for (int i = 0; i < static_cast<int>(parent_.size()); ++i) {
      if (!wanted(i)) continue;
      std::size_t& slot = place[static_cast<std::size_t>(find(i))];
      if (slot == parent_.size()) slot = found.size(), found.emplace_back();
      found[slot].push_back(i);
    }
    return found;
  }

 private:
  int& at(int i) { return parent_[static_cast<std::size_t>(i)]; }
  std::vector<int> parent_;
};

/// One side of one triangle: corner 3t + c, running from it to the next corner of triangle t.
struct Side {
  std::uint64_t edge;   ///< its vertices, the smaller first
  int corner;
  bool rising;          ///< runs from the smaller to the larger vertex

  friend bool operator<(Side const& a, Side const& b) { return a.edge != b.edge ? a.edge < b.edge : a.corner < b.corner; }
};

/// The sides of the triangles for which use(t) holds, those of one edge next to each other.
template <class Use>
std::vector<Side> sorted_sides(Matrix<int, 3, Dynamic> const& triangles, Use use) {
  std::vector<Side> sides;
  sides.reserve(3 * static_cast<std::size_t>(triangles.cols()));
  for (int t = 0; t < static_cast<int>(triangles.cols()); ++t) {
    if (!use(t)) continue;
    for (int c = 0; c < 3; ++c) {
      int const a = triangles(c, t), b = triangles((c + 1) % 3, t);
      sides.push_back({edge_key(a, b), 3 * t + c, a < b});
    }
  }
  std::sort(sides.begin(), sides.end());
  return sides;
}

/// Calls visit(first, last) for each run of neighbours in a list for which same(first, other) holds.
template <class T, class Same, class Visit>
void for_each_run(std::vector<T> const& list, Same same, Visit visit) {
  for (auto const *first = list.data(), *end = first + list.size(); first != end;) {
    auto const* last = first + 1;
    while (last != end && same(*first, *last)) ++last;
    visit(first, last);
    first = last;
  }
}

/// Calls visit(first, last) for the sides of each edge.
template <class Visit>
void for_each_edge(std::vector<Side> const& sides, Visit visit) {
  for_each_run(sides, [](Side const& a, Side const& b) { return a.edge == b.edge; }, visit);
}

inline constexpr int outward_faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};   // of a tetrahedron of positive volume

/// Whether a face, 4 · tetrahedron + face, goes round its corners in rising order when seen from outside. Two tetrahedra at a face differ in it.
inline bool rises(Matrix<int, 4, Dynamic> const& tetrahedra, std::int64_t face) {
  auto const& [a, b, c] = outward_faces[face % 4];
  int const u = tetrahedra(a, face / 4), v = tetrahedra(b, face / 4), w = tetrahedra(c, face / 4);
  return (u < v) + (v < w) + (w < u) == 2;
}

/// Calls visit(places) for the faces with the same corners: 4 · tetrahedron + face each, in rising order. Of tetrahedra for which use(t) holds.
template <class Use, class Visit>
void for_each_face(Matrix<int, 4, Dynamic> const& tetrahedra, Use use, Visit visit) {
  using Face = std::pair<std::array<int, 3>, std::int64_t>;
  std::vector<Face> faces;
  faces.reserve(4 * static_cast<std::size_t>(tetrahedra.cols()));
  for (int t = 0; t < static_cast<int>(tetrahedra.cols()); ++t) {
    if (!use(t)) continue;
    for (int f = 0; f < 4; ++f) {
      auto const& [a, b, c] = outward_faces[f];
      std::array<int, 3> corners{tetrahedra(a, t), tetrahedra(b, t), tetrahedra(c, t)};
      std::sort(corners.begin(), corners.end());
      faces.emplace_back(corners, 4 * static_cast<std::int64_t>(t) + f);
    }
  }
  std::sort(faces.begin(), faces.end());
  for_each_run(faces, [](Face const& a, Face const& b) { return a.first == b.first; }, visit);
}

/// For every element for which use(e) holds the first one with the same corners; −1 for the others.
template <int Corners, class Use>
std::vector<int> first_with_same_corners(Matrix<int, Corners, Dynamic> const& elements, Use use) {
  std::vector<std::pair<std::array<int, Corners>, int>> sorted;
  std::vector<int> first(static_cast<std::size_t>(elements.cols()), -1);
  sorted.reserve(first.size());
  for (int e = 0; e < static_cast<int>(elements.cols()); ++e) {
    if (!use(e)) continue;
    std::array<int, Corners> corners;
    for (int c = 0; c < Corners; ++c) corners[static_cast<std::size_t>(c)] = elements(c, e);
    std::sort(corners.begin(), corners.end());
    sorted.emplace_back(corners, e);
  }
  std::sort(sorted.begin(), sorted.end());
  for (std::size_t i = 0, head = 0; i < sorted.size(); ++i) {
    if (sorted[i].first != sorted[head].first) head = i;
    first[static_cast<std::size_t>(sorted[i].second)] = sorted[head].second;
  }
  return first;
}

/// 0 for a triangle without area: its height over its longest side, divided by that side.
inline double flatness(Vector3<double> const& a, Vector3<double> const& b, Vector3<double> const& c) {
  Vector3<double> const u = b - a, v = c - a, w = c - b;
  double const longest = std::max({u.norm(), v.norm(), w.norm()});
  if (!(longest > 0)) return 0;
  Vector3<double> const x = u / longest, y = v / longest;
  return x.cross(y).norm();
}

/// 0 for a tetrahedron without volume: six times its signed volume divided by its longest side cubed.
inline double flatness(Vector3<double> const& a, Vector3<double> const& b, Vector3<double> const& c,
                       Vector3<double> const& d) {
  Vector3<double> const u = b - a, v = c - a, w = d - a;
  double const longest = std::max({u.norm(), v.norm(), w.norm(), (v - u).norm(), (w - u).norm(), (w - v).norm()});
  if (!(longest > 0)) return 0;
  Vector3<double> const x = u / longest, y = v / longest, z = w / longest;
  return x.cross(y).dot(z);
}

/// A connected piece of a surface: a number that names it, signed volume and box.
struct Piece {
  int name;
  Vector3<double> origin, low = origin, high = origin;   ///< volumes are summed about a point of it
  double volume = 0;

  template <RealScalar Scalar>
  Piece(int named, TriangleMesh<Scalar> const& mesh, int vertex) : name(named), origin(mesh.points.col(vertex).template cast<double>()) {}

  template <RealScalar Scalar>
  void add(TriangleMesh<Scalar> const& mesh, int t) {
    std::array<Vector3<double>, 3> p;
    for (std::size_t c = 0; c < 3; ++c)
      for (int k = 0; k < 3; ++k) {
        double const place = static_cast<double>(mesh.points(k, mesh.triangles(static_cast<int>(c), t)));
        low[k] = std::min(low[k], place), high[k] = std::max(high[k], place);
        p[c][k] = place - origin[k];
      }
    volume += p[0].dot(p[1].cross(p[2])) / 6;
  }
  bool holds(Piece const& other) const {
    for (int k = 0; k < 3; ++k)
      if (!(low[k] <= other.low[k] && high[k] >= other.high[k])) return false;
    return true;
  }
};

/// A piece is outward with positive volume, or as the wall of a cavity: inside the box of a larger outward one.
inline bool faces_inward(Piece const& piece, Piece const& largest) {
  return piece.volume < 0 && !(largest.volume > -piece.volume && largest.holds(piece));
}

}  // namespace palpate::detail
