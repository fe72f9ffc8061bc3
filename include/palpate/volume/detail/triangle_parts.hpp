// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>
#include <vector>

namespace palpate::detail {

/// A triangle that straight cuts divide into convex parts. A point on the side of two parts belongs to both.
struct TriangleParts {
  using Point = Vector3<double>;   // barycentric coordinates
  struct Part {
    int leaf;
    std::vector<int> corners;   // counter-clockwise
  };
  enum class Side { above, below, both };
  static constexpr double on_line = 1e-9;

  std::vector<Point> points{Point::UnitX(), Point::UnitY(), Point::UnitZ()};
  std::vector<Part> parts{{-1, {0, 1, 2}}};

  Point const& at(int p) const noexcept { return points[static_cast<std::size_t>(p)]; }
  /// Which side of the triangle a point lies on, that opposite its corner; −1: inside, or a corner.
  int side_of(int p) const noexcept {
    for (int k = 0; k < 3; ++k)
      if (p > 2 && at(p)[k] == 0) return k;
    return -1;
  }
  /// How far round the triangle a corner or a point on a side is, from corner 0 at 0 to 3.
  double way_round(int p) const noexcept {
    int const k = side_of(p);
    return k < 0 ? p : (k + 1) % 3 + at(p)[(k + 2) % 3];
  }
  /// Of a part that has this point.
  int leaf_at(int p) const noexcept {
    for (Part const& part : parts)
      if (std::find(part.corners.begin(), part.corners.end(), p) != part.corners.end()) return part.leaf;
    return parts.front().leaf;
  }

  /// Cuts a part along the line where f, linear over the triangle, is zero. What is below it becomes the last part.
  Side cut(std::size_t n, Point const& f) {
    auto const height = [&](int p) { return f.dot(at(p)); };
    auto const is_below = [&](int p) { return height(p) < -on_line; };
    auto& corners = parts[n].corners;
    if (std::none_of(corners.begin(), corners.end(), is_below)) return Side::above;
    if (std::none_of(corners.begin(), corners.end(), [&](int p) { return height(p) > on_line; })) return Side::below;
    auto const first = std::find_if(corners.begin(), corners.end(), [&](int p) { return height(p) > on_line; });
    std::rotate(corners.begin(), first, corners.end());   // so that those below follow each other
    auto const crossing = [&](std::size_t k) {   // between corner k and the next one: a point on the line
      int const a = corners[k], b = corners[(k + 1) % corners.size()];
      for (int const p : {a, b})
        if (!is_below(p) && !(height(p) > on_line)) return p;
      return insert(a, b, (height(b) * at(a) - height(a) * at(b)) / (height(b) - height(a)));
    };
    auto const place = [&](int p) { return std::find(corners.begin(), corners.end(), p) - corners.begin(); };
    int const in = crossing(static_cast<std::size_t>(std::find_if(corners.begin(), corners.end(), is_below) - corners.begin()) - 1);
    int const out = crossing(static_cast<std::size_t>(corners.rend() - std::find_if(corners.rbegin(), corners.rend(), is_below)) - 1);
    auto const from = place(in), to = place(out);
    std::vector<int> below;
    for (auto k = from;; k = (k + 1) % std::ssize(corners)) {
      below.push_back(corners[static_cast<std::size_t>(k)]);
      if (k == to) break;
    }
    std::erase_if(corners, [&](int p) { return p != in && p != out && std::find(below.begin(), below.end(), p) != below.end(); });
    parts.push_back({-1, std::move(below)});
    return Side::both;
  }
  /// A point between two that follow each other, in all parts.
  int insert(int a, int b, Point const& w) {
    int const p = static_cast<int>(points.size());
    points.push_back(w);
    for (Part& part : parts)
      for (std::size_t k = 0; k < part.corners.size(); ++k)
        if (int const i = part.corners[k], j = part.corners[(k + 1) % part.corners.size()]; (i == a && j == b) || (i == b && j == a)) {
          part.corners.insert(part.corners.begin() + static_cast<std::ptrdiff_t>(k) + 1, p);
          break;
        }
    return p;
  }
  /// A point on the side from corner k to the next one, where there may be one already within this distance.
  int insert_on_side(int k, double share, double same) {
    int const side = (k + 2) % 3, next = (k + 1) % 3;
    int before = k, after = next;
    double from = 0, to = 1;
    for (int p = 3; p < static_cast<int>(points.size()); ++p) {
      if (side_of(p) != side) continue;
      double const there = at(p)[next];
      if (there < share + same && there > share - same) return p;
      if (there < share && there > from) before = p, from = there;
      if (there > share && there < to) after = p, to = there;
    }
    return insert(before, after, (1 - share) * Point::Unit(k) + share * Point::Unit(next));
  }

  /// visit(part, a, b, other): each side of each part, and the part beyond it; −1 at the triangle's sides.
  template <class Visit>
  void for_each_side(Visit const& visit) const {
    struct Run {
      int low, high, part, from;
      bool operator<(Run const& other) const noexcept { return std::pair(low, high) < std::pair(other.low, other.high); }
    };
    std::vector<Run> sides;
    for (std::size_t n = 0; n < parts.size(); ++n)
      for (std::size_t k = 0; k < parts[n].corners.size(); ++k) {
        int const a = parts[n].corners[k], b = parts[n].corners[(k + 1) % parts[n].corners.size()];
        sides.push_back({std::min(a, b), std::max(a, b), static_cast<int>(n), a});
      }
    std::sort(sides.begin(), sides.end());
    for (std::size_t i = 0; i < sides.size(); ++i) {
      int other = -1;
      for (std::size_t const j : {i - 1, i + 1})
        if (j < sides.size() && sides[j].low == sides[i].low && sides[j].high == sides[i].high) other = sides[j].part;
      visit(sides[i].part, sides[i].from, sides[i].low + sides[i].high - sides[i].from, other);
    }
  }
  /// visit(a, b, c) for triangles that make up a convex polygon of these points.
  template <class Visit>
  void triangulate(std::vector<int> const& polygon, Visit const& visit) const {
    std::size_t const n = polygon.size();
    if (n < 3) return;
    if (n == 3) return visit(polygon[0], polygon[1], polygon[2]);
    std::vector<double> fan(n, 0.0);   // area from the first corner on
    for (std::size_t k = 2; k < n; ++k) fan[k] = fan[k - 1] + doubled_area(polygon[0], polygon[k - 1], polygon[k]);
    std::size_t from = 0, to = 2;
    double best = -1;
    for (std::size_t i = 0; i < n; ++i)   // the diagonal that is short for what it leaves on either side
      for (std::size_t j = i + 2; j < n && j - i + 1 < n; ++j) {
        double const part = fan[j] - fan[i] - doubled_area(polygon[0], polygon[i], polygon[j]), less = std::min(part, fan[n - 1] - part);
        if (double const value = less / (at(polygon[i]) - at(polygon[j])).squaredNorm(); value > best) best = value, from = i, to = j;
      }
    std::vector<int> one(polygon.begin() + static_cast<std::ptrdiff_t>(from), polygon.begin() + static_cast<std::ptrdiff_t>(to) + 1), other;
    for (std::size_t k = to; k != from + 1; k = (k + 1) % n) other.push_back(polygon[k]);
    triangulate(one, visit), triangulate(other, visit);
  }

 private:
  /// In shares of the triangle.
  double doubled_area(int a, int b, int c) const noexcept {
    Matrix<double, 3, 3> corners;
    corners << at(a), at(b), at(c);
    return corners.determinant();
  }
};

}  // namespace palpate::detail
