// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/detail/corner_table.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace palpate::detail {

/// Evens the triangles of a closed surface field = 0 and brings it to an exact number of vertices: long edges are
/// split, short ones collapsed, edges flipped towards six neighbours per vertex, vertices moved along the surface to the
/// centre of their neighbourhood and back onto it, in turns (the isotropic remeshing of Botsch and Kobbelt, 2004).
/// Deterministic: no random choice, ties by index.
template <class Field>
class Remesher {
 public:
  Remesher(CornerTable table, Field const& field, double scale)
      : table_(std::move(table)), field_(field), step_(1e-5 * scale) {}

  CornerTable const& run(int vertices, int rounds) {
    double edge = target_edge(vertices);
    for (int round = 0; round < rounds; ++round) {
      split_long(4.0 / 3.0 * edge);
      collapse_short(0.8 * edge, 4.0 / 3.0 * edge);
      flip_to_six();
      relax();
      relax();
      edge *= std::clamp(std::sqrt(table_.vertices() / double(vertices)), 0.8, 1.25);
    }
    for (int tries = 0; table_.vertices() != vertices; ++tries) {
      if (tries == 50)
        throw InvalidArgument(message("no surface of ", vertices, " vertices follows this shape (", table_.vertices(),
                                      " reached); ask for more vertices"));
      if (table_.vertices() < vertices) split_longest(vertices - table_.vertices());
      else collapse_shortest(table_.vertices() - vertices);
      flip_to_six();
      relax();
    }
    for (int round = 0; round < 8; ++round) {
      round < 4 ? flip_to_six() : flip_to_delaunay();
      relax();
    }
    flip_to_delaunay();
    for (int v = 0; v < table_.capacity(); ++v)
      for (int i = 0; i < 3; ++i) project(table_.points[index(v)]);
    return table_;
  }

  /// Does every triangle face the way the field grows? A fold, or a sheet thinner than the triangles, does not.
  bool faces_outward() const {
    for (int h = 0; h < table_.size(); h += 3) {
      int const a = table_.from(h), b = table_.to(h), c = table_.apex(h);
      Point const middle = (table_.at(a) + table_.at(b) + table_.at(c)) / 3;
      if (!(area_vector(a, b, c).dot(gradient(middle, field_(middle))) > 0)) return false;
    }
    return true;
  }

 private:
  using Point = Vector3<double>;
  static constexpr std::size_t index(int i) noexcept { return static_cast<std::size_t>(i); }

  /// The side of the equilateral triangle that `vertices` of them cover the surface with.
  double target_edge(int vertices) const {
    double area = 0;
    for (int h = 0; h < table_.size(); h += 3)
      if (table_.exists(h)) area += area_vector(table_.from(h), table_.to(h), table_.apex(h)).norm() / 2;
    return std::sqrt(4 * area / (std::sqrt(3.0) * (2.0 * vertices - 4)));
  }

  Point area_vector(int a, int b, int c) const {
    return (table_.at(b) - table_.at(a)).cross(table_.at(c) - table_.at(a));
  }

  Point gradient(Point const& p, double f) const {
    Point g;
    for (int k = 0; k < 3; ++k) {
      Point q = p;
      q[k] += step_;
      g[k] = (field_(q) - f) / step_;
    }
    return g;
  }

  void project(Point& p) const {
    double const f = field_(p);
    Point const g = gradient(p, f);
    if (double const g2 = g.squaredNorm(); g2 > 0) p -= f / g2 * g;
  }

  void split_long(double limit) {
    int const sides = table_.size();
    for (int h = 0; h < sides; ++h)
      if (table_.exists(h) && h < table_.opposite(h) && table_.length(h) > limit) split(h);
  }

  void split(int h) {
    Point p = (table_.at(table_.from(h)) + table_.at(table_.to(h))) / 2;
    project(p);
    table_.split(h, p);
  }

  bool try_collapse(int h, double limit) {
    if (!table_.can_collapse(h)) return false;
    Point p = (table_.at(table_.from(h)) + table_.at(table_.to(h))) / 2;
    project(p);
    int const ends[2] = {table_.from(h), table_.to(h)};
    for (int e = 0; e < 2; ++e) {
      bool good = true;
      table_.around(ends[e], [&](int s) {
        int const v = table_.to(s), w = table_.apex(s);
        if ((table_.at(v) - p).norm() > limit) good = false;
        if (v == ends[1 - e] || w == ends[1 - e]) return;
        Point const before = area_vector(ends[e], v, w), after = (table_.at(v) - p).cross(table_.at(w) - p);
        if (before.dot(after) < 0.2 * before.norm() * after.norm()) good = false;
      });
      if (!good) return false;
    }
    table_.collapse(h, p);
    return true;
  }

  void collapse_short(double limit, double longest) {
    for (int h = 0; h < table_.size(); ++h)
      if (table_.exists(h) && h < table_.opposite(h) && table_.length(h) < limit) try_collapse(h, longest);
    table_.compact();
  }

  std::vector<std::pair<double, int>> sides_by_length() const {
    std::vector<std::pair<double, int>> sides;
    for (int h = 0; h < table_.size(); ++h)
      if (table_.exists(h) && h < table_.opposite(h)) sides.emplace_back(table_.length(h), h);
    std::sort(sides.begin(), sides.end());
    return sides;
  }

  void split_longest(int count) {
    auto const sides = sides_by_length();
    std::vector<char> touched(index(table_.size() / 3), 0);
    for (auto side = sides.rbegin(); side != sides.rend() && count > 0; ++side) {
      std::size_t const t = index(side->second / 3), o = index(table_.opposite(side->second) / 3);
      if (touched[t] || o >= touched.size() || touched[o]) continue;   // past the end: born in this pass
      touched[t] = touched[o] = 1;
      split(side->second);
      --count;
    }
  }

  void collapse_shortest(int count) {
    auto const sides = sides_by_length();
    std::vector<char> touched(index(table_.capacity()), 0);
    double const longest = 2 * sides.back().first;
    for (auto const& [length, h] : sides) {
      if (count == 0) break;
      if (!table_.exists(h)) continue;
      int const a = table_.from(h), b = table_.to(h);
      if (touched[index(a)] || touched[index(b)] || !try_collapse(h, longest)) continue;
      touched[index(a)] = touched[index(b)] = 1;
      table_.around(b, [&](int s) { touched[index(table_.to(s))] = 1; });
      --count;
    }
    table_.compact();
  }

  /// Is the surface still as smooth after the flip? The new triangles must face as the old ones do.
  bool flip_keeps_shape(int h) const {
    int const a = table_.from(h), b = table_.to(h), c = table_.apex(h), d = table_.apex(table_.opposite(h));
    Point const n = area_vector(a, b, c) + area_vector(b, a, d);
    Point const p = area_vector(d, c, a), q = area_vector(c, d, b);
    return n.dot(p) > 0.5 * n.norm() * p.norm() && n.dot(q) > 0.5 * n.norm() * q.norm();
  }

  void flip_to_six() {
    auto const cost = [](int valence) { return (valence - 6) * (valence - 6); };
    for (int h = 0; h < table_.size(); ++h) {
      if (!table_.exists(h) || h > table_.opposite(h)) continue;
      int const a = table_.valence(table_.from(h)), b = table_.valence(table_.to(h)),
                c = table_.valence(table_.apex(h)), d = table_.valence(table_.apex(table_.opposite(h)));
      int const before = cost(a) + cost(b) + cost(c) + cost(d);
      int const after = cost(a - 1) + cost(b - 1) + cost(c + 1) + cost(d + 1);
      if (after < before && flip_keeps_shape(h)) table_.flip(h);
    }
  }

  double cotangent_at(int corner, int a, int b) const {
    Point const u = table_.at(a) - table_.at(corner), v = table_.at(b) - table_.at(corner);
    return u.dot(v) / u.cross(v).norm();
  }

  void flip_to_delaunay() {
    for (int pass = 0; pass < 3; ++pass) {
      int flips = 0;
      for (int h = 0; h < table_.size(); ++h) {
        if (!table_.exists(h) || h > table_.opposite(h)) continue;
        int const a = table_.from(h), b = table_.to(h), c = table_.apex(h), d = table_.apex(table_.opposite(h));
        if (cotangent_at(c, a, b) + cotangent_at(d, a, b) < -1e-6 && flip_keeps_shape(h)) flips += table_.flip(h);
      }
      if (flips == 0) return;
    }
  }

  /// Every vertex to the area-weighted centre of its triangles, along the surface.
  void relax() {
    std::vector<Point> moved = table_.points;
    for (int v = 0; v < table_.capacity(); ++v) {
      if (!table_.vertex_exists(v)) continue;
      Point const p = table_.at(v);
      Point centre = Point::Zero();
      double weight = 0;
      table_.around(v, [&](int s) {
        int const a = table_.to(s), b = table_.apex(s);
        double const area = area_vector(v, a, b).norm();
        centre += area * (p + table_.at(a) + table_.at(b)) / 3;
        weight += area;
      });
      if (!(weight > 0)) continue;
      double const f = field_(p);
      Point const g = gradient(p, f);
      double const g2 = g.squaredNorm();
      if (!(g2 > 0)) continue;
      Point move = centre / weight - p;
      move -= move.dot(g) / g2 * g;
      Point const q = p + move;
      moved[index(v)] = q - field_(q) / g2 * g;
    }
    table_.points = std::move(moved);
  }

  CornerTable table_;
  Field const& field_;
  double step_;
};

}  // namespace palpate::detail
