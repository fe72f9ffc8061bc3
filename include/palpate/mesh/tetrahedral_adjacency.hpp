// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/columns.hpp>
#include <palpate/core/index_lists.hpp>
#include <palpate/core/huge_page_vector.hpp>
#include <palpate/mesh/surface_topology.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace palpate {

/// The tetrahedra at a vertex, in connected fans: what fans_at fills. Its memory serves the next call.
class TetrahedronFans {
 public:
  int size() const noexcept { return static_cast<int>(ends_.size()); }
  std::span<int const> operator[](int fan) const noexcept {
    std::size_t const k = static_cast<std::size_t>(fan), first = fan == 0 ? 0 : ends_[k - 1];
    return std::span(tetrahedra_).subspan(first, ends_[k] - first);
  }

 private:
  friend class TetrahedralAdjacency;
  std::vector<int> tetrahedra_;
  std::vector<std::size_t> ends_;
};

/// Which tetrahedra of a solid meet at each vertex, round each edge and across each face, and the border: what a TetrahedralTopology is asked.
/// Corners    in positive order: (b − a) × (c − a) · (d − a) > 0. Face k lies opposite corner k; its corners are counter-clockwise seen from outside.
/// Faces      two tetrahedra with the same face, once in each direction, are neighbours: it is the corners alone that say what is joined.
/// Border     the faces with one tetrahedron, as a SurfaceTopology with the vertices of the solid (inner vertices have no triangle).
///            It is closed: each directed edge occurs as often as its opposite. It is a manifold along an edge exactly if the tetrahedra
///            round that edge are one fan (`fans_round`). Parts that touch in an edge alone are allowed, since meshes come so and any split
///            may lead there: then several border triangles hold one directed edge, `border().triangle_with_edge` gives any of them, and
///            `border_neighbour`, which turns round the edge inside the solid, is the one that keeps to its part.
/// Invariant  a directed face belongs to at most one tetrahedron; no two tetrahedra have the same four corners.
/// Cost       every query is O(tetrahedra and border triangles at the vertex); for_each_round is quadratic in those round the edge, and fans_at and
///            for_each_neighbour in those at the vertex, where each step compares a number.
class TetrahedralAdjacency {
 public:
  using Corners = std::array<int, 4>;
  using Triangle = SurfaceTopology::Corners;
  struct Face {
    int tetrahedron, face;
  };

  int vertex_count() const noexcept { return at_.size(); }
  int tetrahedron_count() const noexcept { return corners_.size(); }
  auto tetrahedra() const noexcept { return corners_.view(); }
  Corners corners(int tetrahedron) const noexcept {
    auto const c = corners_[tetrahedron];
    return {c[0], c[1], c[2], c[3]};
  }

  /// The tetrahedra that meet at a vertex, in no particular order.
  std::span<int const> tetrahedra_at(int vertex) const noexcept { return at_[vertex]; }
  /// Whether the tetrahedra at a vertex close around it: it is no vertex of the border.
  bool is_inside(int vertex) const noexcept { return !at_[vertex].empty() && border_.triangles_at(vertex).empty(); }

  /// Which of the tetrahedron's four corners the vertex is: 0 … 3; −1 if none.
  int corner_of(int tetrahedron, int vertex) const noexcept {
    auto const c = corners_[tetrahedron];
    return c[0] == vertex ? 0 : c[1] == vertex ? 1 : c[2] == vertex ? 2 : c[3] == vertex ? 3 : -1;
  }

  /// The corners of face k, counter-clockwise seen from outside.
  Triangle face(int tetrahedron, int k) const noexcept {
    auto const c = corners_[tetrahedron];
    int const first = k == 0 ? 1 : 0, second = turn[k][first];
    return {c[first], c[second], c[turn[k][second]]};
  }

  /// The tetrahedron that holds the directed face a → b → c, counter-clockwise seen from outside it, or −1. In the reverse order they name the
  /// one beyond.
  int tetrahedron_with_face(int a, int b, int c) const noexcept {
    int const place = place_of({a, b, c});
    return place < 0 ? -1 : place / 4;
  }
  /// The tetrahedron beyond face k, or −1 at the border.
  int neighbour(int tetrahedron, int k) const noexcept {
    int const beyond = at(tetrahedron)[k];
    return beyond < 0 ? -1 : beyond / 4;
  }

  SurfaceTopology const& border() const noexcept { return border_; }
  /// The border triangle on face k, or −1 where there is a neighbour.
  int border_triangle(int tetrahedron, int k) const noexcept {
    int const beyond = at(tetrahedron)[k];
    return beyond < 0 ? ~beyond : -1;
  }
  /// The face that a border triangle lies on.
  Face border_face(int triangle) const noexcept {
    int const place = place_[static_cast<std::size_t>(triangle)];
    return {place / 4, place % 4};
  }
  /// The border triangle across the side from corner k to corner k + 1 of another: the one that is reached round the edge inside the solid.
  int border_neighbour(int triangle, int k) const noexcept {
    Triangle const c = border_.corners(triangle);
    auto [t, entered] = border_face(triangle);
    for (;;) {
      int const beyond = at(t)[6 - corner_of(t, c[static_cast<std::size_t>(k)]) - corner_of(t, c[static_cast<std::size_t>((k + 1) % 3)]) - entered];
      if (beyond < 0) return ~beyond;
      t = beyond / 4, entered = beyond % 4;
    }
  }

  /// Calls visit(t) for the tetrahedra that hold the edge a–b, each once, counter-clockwise seen from b. A fan begins and ends at the border; inside
  /// the solid it is a cycle. Where there are several they come one after the other. No edit meanwhile.
  template <class Visit>
  void for_each_round(int a, int b, Visit visit) const {
    for_each_fan_round(a, b, [&](int first) {
      int t = first;
      do visit(t), t = step_round(t, a, b, true);
      while (t >= 0 && t != first);
    });
  }
  /// How many fans the tetrahedra round an edge are: 0 where there is no such edge, 1 in a solid whose border is a manifold.
  int fans_round(int a, int b) const noexcept {
    int count = 0;
    for_each_fan_round(a, b, [&](int) { ++count; });
    return count;
  }

  /// The tetrahedra at a vertex in fans that hang together over faces at it, but for faces with `separated(tetrahedron, face)`, which must say the
  /// same from both sides: what a cut along those faces would split the vertex into. Each fan ascending, in the order of their first ones.
  template <class Separated>
  void fans_at(int vertex, TetrahedronFans& fans, Separated const& separated) const {
    std::vector<int>& all = fans.tetrahedra_;
    all.assign(at_[vertex].begin(), at_[vertex].end());
    fans.ends_.clear();
    for (auto first = all.begin(), end = first; first != all.end(); first = end) {
      std::iter_swap(end++, std::min_element(first, all.end()));
      for (auto t = first; t != end; ++t)
        for (int k = 0; k < 4; ++k)
          if (int const u = neighbour(*t, k); u >= 0 && corners_[*t][k] != vertex && !separated(*t, k))
            if (auto const found = std::find(end, all.end(), u); found != all.end()) std::iter_swap(found, end++);
      std::sort(first, end);
      fans.ends_.push_back(static_cast<std::size_t>(end - all.begin()));
    }
  }
  void fans_at(int vertex, TetrahedronFans& fans) const {
    fans_at(vertex, fans, [](int, int) { return false; });
  }

  /// Calls visit(w) for each vertex that an edge joins to this one, once.
  template <class Visit>
  void for_each_neighbour(int vertex, Visit visit) const {
    auto const here = at_[vertex];
    std::array<int, 64> visited;   // the first ones: nearly always all
    std::size_t count = 0;
    for (auto t = here.begin(); t != here.end(); ++t)
      for (int const w : corners(*t)) {
        if (w == vertex || std::find(visited.begin(), visited.begin() + count, w) != visited.begin() + count) continue;
        if (count < visited.size())
          visited[count++] = w;
        else if (std::any_of(here.begin(), t, [&](int earlier) { return corner_of(earlier, w) >= 0; }))
          continue;
        visit(w);
      }
  }

 protected:
  TetrahedralAdjacency() = default;
  explicit TetrahedralAdjacency(int vertices) : border_(vertices, Matrix<int, 3, Dynamic>(3, 0)) {
    for (int v = 0; v < vertices; ++v) at_.add_list();
  }

  /// (i, j, turn[i][j], the fourth) is an even permutation of 0 … 3. So on face i, turn[i][j] comes after j; and round the edge from corner i to corner
  /// j, face turn[i][j] is the one that leads on.
  static constexpr signed char turn[4][4] = {{-1, 2, 3, 1}, {3, -1, 0, 2}, {1, 3, -1, 0}, {2, 0, 1, -1}};

  /// What lies beyond the four faces: 4 · tetrahedron + face of the neighbour, or ~triangle of the border.
  class Beyond {
   public:
    int& operator[](int k) noexcept { return beyond_[static_cast<std::size_t>(k)]; }
    int operator[](int k) const noexcept { return beyond_[static_cast<std::size_t>(k)]; }

   private:
    std::array<int, 4> beyond_{};
  };
  Beyond& at(int t) noexcept { return beyond_[static_cast<std::size_t>(t)]; }
  Beyond const& at(int t) const noexcept { return beyond_[static_cast<std::size_t>(t)]; }

  static Triangle reversed(Triangle const& c) noexcept { return {c[0], c[2], c[1]}; }

  /// 4 · tetrahedron + face of the one that holds a directed face, or −1.
  int place_of(Triangle const& c) const noexcept {
    auto const here = at_[c[0]], corner = at_.keys(c[0]);
    for (std::size_t n = 0; n < here.size(); ++n) {
      int const i = corner[n], j = corner_of(here[n], c[1]);
      if (j < 0) continue;
      if (int const k = corner_of(here[n], c[2]); k >= 0 && turn[6 - i - j - k][i] == j) return 4 * here[n] + 6 - i - j - k;
    }
    return -1;
  }

  /// The next tetrahedron round an edge that t holds, or the one before it; −1 at the border.
  int step_round(int t, int a, int b, bool on) const noexcept {
    int const i = corner_of(t, a), j = corner_of(t, b);
    return neighbour(t, on ? turn[i][j] : turn[j][i]);
  }

  /// Calls visit(first) for each fan round an edge: the tetrahedron it begins with, in a cycle that with the smallest number.
  template <class Visit>
  void for_each_fan_round(int a, int b, Visit visit) const {
    for (int const t : at_[a]) {
      if (corner_of(t, b) < 0) continue;
      int first = t, other = step_round(t, a, b, false);   // visited from the smallest alone
      for (; other > t; other = step_round(other, a, b, false)) first = other;
      if (other >= 0 && other < t) continue;
      if (other < 0)
        for (other = step_round(t, a, b, true); other > t;) other = step_round(other, a, b, true);
      else
        first = t;
      if (other < 0 || other == t) visit(first);
    }
  }

  template <std::size_t N>
  bool holds(int t, std::array<int, N> const& vertices) const noexcept {
    return std::all_of(vertices.begin(), vertices.end(), [&](int v) { return corner_of(t, v) >= 0; });
  }

  void append(Corners const& c) {
    int const t = tetrahedron_count();
    corners_.push_back(Matrix<int, 4, 1>(c[0], c[1], c[2], c[3]));
    beyond_.emplace_back();
    for (int k = 0; k < 4; ++k) at_.add(c[static_cast<std::size_t>(k)], t, k);
  }
  void drop() noexcept {
    int const t = tetrahedron_count() - 1;
    for (int const v : corners(t)) at_.remove(v, t);
    corners_.pop_back(), beyond_.pop_back();
  }

  void join(int t, int k, int u, int l) noexcept {
    at(t)[k] = 4 * u + l;
    at(u)[l] = 4 * t + k;
  }
  /// What lies beyond face k of `from` lies beyond that of t.
  void take_link(int t, int from, int k) noexcept {
    int const beyond = at(t)[k] = at(from)[k];
    (beyond < 0 ? place_[static_cast<std::size_t>(~beyond)] : at(beyond / 4)[beyond % 4]) = 4 * t + k;
  }
  void add_border(int t, int k) {
    at(t)[k] = ~border_.add_triangle(face(t, k));
    place_.push_back(4 * t + k);
  }
  void remove_border(int triangle) {
    int const last = border_.triangle_count() - 1, place = place_.back();
    Triangle const corners = border_.corners(last);
    border_.pop_triangle(), place_.pop_back();
    if (triangle == last) return;
    border_.set_triangle(triangle, corners);
    place_[static_cast<std::size_t>(triangle)] = place;
    at(place / 4)[place % 4] = ~triangle;
  }

  Columns<int, 4> corners_;
  HugePageVector<Beyond> beyond_;
  IndexLists at_;            // of each vertex: tetrahedra, each with which of its corners the vertex is
  SurfaceTopology border_;
  HugePageVector<int> place_;   // of each border triangle: 4 · tetrahedron + face
};

}  // namespace palpate
