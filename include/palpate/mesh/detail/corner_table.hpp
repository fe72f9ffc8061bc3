// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/detail/simplices.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace palpate::detail {

/// A closed triangle surface that can be flipped, split and collapsed edge by edge.
/// Side 3t + c of triangle t runs from its corner c to its corner (c + 1) mod 3; `opposite` is the same side in the
/// neighbouring triangle, running backwards.
/// Invariant  closed, manifold and consistently oriented, before and after every operation; a removed triangle has
///            `from` = −1, a removed vertex `out` = −1.
class CornerTable {
 public:
  std::vector<Vector3<double>> points;

  CornerTable(std::vector<Vector3<double>> vertices, std::vector<std::array<int, 3>> const& triangles)
      : points(std::move(vertices)), out_(points.size(), -1), valence_(points.size(), 0) {
    from_.reserve(3 * triangles.size());
    for (auto const& t : triangles) from_.insert(from_.end(), t.begin(), t.end());
    opposite_.assign(from_.size(), -1);
    std::vector<std::pair<std::uint64_t, int>> sides(from_.size());
    for (int h = 0; h < size(); ++h) {
      sides[index(h)] = {edge_key(from(h), to(h)), h};
      out_[index(from(h))] = h;
      ++valence_[index(from(h))];
    }
    std::sort(sides.begin(), sides.end());
    for (std::size_t i = 0; i + 1 < sides.size(); i += 2) glue(sides[i].second, sides[i + 1].second);
    vertices_ = static_cast<int>(points.size());
  }

  static constexpr int next(int h) noexcept { return h % 3 == 2 ? h - 2 : h + 1; }
  static constexpr int previous(int h) noexcept { return h % 3 == 0 ? h + 2 : h - 1; }

  int size() const noexcept { return static_cast<int>(from_.size()); }            ///< sides, removed ones included
  int capacity() const noexcept { return static_cast<int>(points.size()); }       ///< vertices, removed ones included
  int vertices() const noexcept { return vertices_; }                             ///< vertices that exist
  bool exists(int h) const noexcept { return from_[index(h)] >= 0; }
  bool vertex_exists(int v) const noexcept { return out_[index(v)] >= 0; }
  int from(int h) const noexcept { return from_[index(h)]; }
  int to(int h) const noexcept { return from_[index(next(h))]; }
  int apex(int h) const noexcept { return from_[index(previous(h))]; }
  int opposite(int h) const noexcept { return opposite_[index(h)]; }
  int valence(int v) const noexcept { return valence_[index(v)]; }
  double length(int h) const { return (points[index(to(h))] - points[index(from(h))]).norm(); }
  Vector3<double> const& at(int v) const noexcept { return points[index(v)]; }

  /// Calls visit(side) for the sides that start at v.
  template <class Visit>
  void around(int v, Visit visit) const {
    int const first = out_[index(v)];
    int h = first;
    do {
      visit(h);
      h = opposite(previous(h));
    } while (h != first);
  }

  bool joined(int a, int b) const {
    bool found = false;
    around(a, [&](int h) { found = found || to(h) == b; });
    return found;
  }

  /// Replaces the edge a–b between the triangles (a, b, c) and (b, a, d) by c–d. False, and no change, where c–d exists
  /// already or a vertex would keep fewer than three neighbours.
  bool flip(int h) {
    int const o = opposite(h), hn = next(h), hp = previous(h), on = next(o), op = previous(o);
    int const a = from(h), b = from(o), c = from(hp), d = from(op);
    if (valence(a) <= 3 || valence(b) <= 3 || joined(c, d)) return false;
    int const ca = opposite(hp), ad = opposite(on), db = opposite(op), bc = opposite(hn);
    set(h, d), set(hn, c), set(hp, a), set(o, c), set(on, d), set(op, b);
    glue(hn, ca), glue(hp, ad), glue(on, db), glue(op, bc);
    --valence_[index(a)], --valence_[index(b)], ++valence_[index(c)], ++valence_[index(d)];
    return true;
  }

  /// Cuts the edge in two at p; returns the new vertex.
  int split(int h, Vector3<double> const& p) {
    int const o = opposite(h), hn = next(h), hp = previous(h), op = previous(o);
    int const b = from(o), c = from(hp), d = from(op), m = capacity();
    int const bc = opposite(hn), db = opposite(op);
    points.push_back(p);
    out_.push_back(-1);
    valence_.push_back(4);
    ++vertices_, ++valence_[index(c)], ++valence_[index(d)];
    int const h2 = size(), o2 = h2 + 3;   // new triangles (m, b, c) and (b, m, d)
    from_.resize(from_.size() + 6);
    opposite_.resize(from_.size());
    set(h2, m), set(h2 + 1, b), set(h2 + 2, c);
    set(o2, b), set(o2 + 1, m), set(o2 + 2, d);
    set(hn, m), set(o, m);                // old ones become (a, m, c) and (m, a, d)
    glue(h2, o2), glue(h2 + 1, bc), glue(h2 + 2, hn), glue(o2 + 1, op), glue(o2 + 2, db);
    return m;
  }

  /// Would removing the edge leave a manifold surface? The ends must share two neighbours only.
  bool can_collapse(int h) const {
    int const a = from(h), b = to(h), c = apex(h), d = apex(opposite(h));
    if (valence(c) <= 3 || valence(d) <= 3 || valence(a) + valence(b) < 7) return false;
    bool allowed = true;
    around(a, [&](int s) {
      int const v = to(s);
      if (v != b && v != c && v != d && joined(v, b)) allowed = false;
    });
    return allowed;
  }

  /// Draws both ends of the edge together at p: the start vertex and two triangles go. Ask `can_collapse` first.
  void collapse(int h, Vector3<double> const& p) {
    int const o = opposite(h), hn = next(h), hp = previous(h), on = next(o), op = previous(o);
    int const a = from(h), b = to(h), c = from(hp), d = from(op);
    int const bc = opposite(hn), ca = opposite(hp), ad = opposite(on), db = opposite(op);
    std::vector<int> fan;
    around(a, [&](int s) { fan.push_back(s); });
    for (int const s : fan) from_[index(s)] = b;
    glue(bc, ca), glue(ad, db);
    for (int const s : {h, hn, hp, o, on, op}) from_[index(s)] = opposite_[index(s)] = -1;
    out_[index(a)] = -1;
    out_[index(b)] = ca;   // was a → c
    out_[index(c)] = bc;
    out_[index(d)] = ad;
    valence_[index(b)] += valence(a) - 4;
    --valence_[index(c)], --valence_[index(d)];
    --vertices_;
    points[index(b)] = p;
  }

  /// Drops what was removed and numbers the rest without gaps, old order kept.
  void compact() {
    std::vector<int> name(points.size(), -1);
    std::vector<Vector3<double>> kept;
    kept.reserve(static_cast<std::size_t>(vertices_));
    for (int v = 0; v < capacity(); ++v)
      if (vertex_exists(v)) {
        name[index(v)] = static_cast<int>(kept.size());
        kept.push_back(points[index(v)]);
      }
    std::vector<std::array<int, 3>> triangles;
    triangles.reserve(2 * kept.size());
    for (int h = 0; h < size(); h += 3)
      if (exists(h))
        triangles.push_back({name[index(from(h))], name[index(from(h + 1))], name[index(from(h + 2))]});
    *this = CornerTable(std::move(kept), triangles);
  }

 private:
  static constexpr std::size_t index(int i) noexcept { return static_cast<std::size_t>(i); }
  void glue(int x, int y) noexcept { opposite_[index(x)] = y, opposite_[index(y)] = x; }
  void set(int h, int v) noexcept { from_[index(h)] = v, out_[index(v)] = h; }

  std::vector<int> from_, opposite_, out_, valence_;
  int vertices_ = 0;
};

}  // namespace palpate::detail
