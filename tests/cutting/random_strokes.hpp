// SPDX-License-Identifier: MIT
#pragma once

#include "stroke_case.hpp"

#include <palpate/core/random.hpp>
#include <palpate/mesh/normals.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

/// Draws strokes at random over a body as it is, its wounds included: all that a hand may do, and what it hardly does.
template <class S>
class RandomStrokes {
 public:
  using Vector = palpate::Vector3<S>;

  RandomStrokes(palpate::Random& random, palpate::TriangleMesh<S> mesh, S edge)
      : random_(random), mesh_(std::move(mesh)), tree_(mesh_), normals_(palpate::vertex_normals(mesh_)), edge_(edge) {}

  /// The tips of one stroke: down, along, and mostly up again.
  Points<S> draw() {
    Points<S> const corners = way();
    Points<S> path = along(corners);
    S const noise = chance(2) ? 0 : edge_ * std::pow(S(10), random_.uniform(S(-12), S(-1)));
    S const depth = edge_ * random_.uniform(S(0.25), S(0.6)), height = edge_ * random_.uniform(S(0.05), S(1));
    std::size_t const lifted = chance(5) ? 1 + random_.below(path.size()) : 0;   // from this tick on, for a few, the blade is up
    std::size_t const down_again = lifted + 1 + random_.below(3);
    Points<S> tips;
    if (!chance(8)) tips.push_back(tip(path.front(), height));
    tips.push_back(tip(path.front(), height / 8));
    if (chance(2)) tips.push_back(tip(path.front(), -depth / 4));
    for (std::size_t i = 0; i < path.size(); ++i) {
      bool const up = lifted > 0 && i >= lifted && i < down_again;
      tips.push_back(tip(Vector(path[i] + noise * any()), up ? height : -depth));
      if (chance(20)) tips.push_back(tips.back());   // a tick without motion
    }
    if (!chance(6)) tips.push_back(tip(path.back(), height));
    return tips;
  }

 private:
  static constexpr int max_ticks = 24;

  bool chance(std::uint64_t one_in) { return random_.below(one_in) == 0; }
  Vector any() { return {random_.uniform(S(-1), S(1)), random_.uniform(S(-1), S(1)), random_.uniform(S(-1), S(1))}; }
  int pick(Eigen::Index count) { return static_cast<int>(random_.below(static_cast<std::uint64_t>(count))); }

  Vector normal(Vector const& point) const {
    auto const on = tree_.nearest(mesh_.points, point);
    Vector n = Vector::Zero();
    for (int k = 0; k < 3; ++k) n += on.barycentric[k] * normals_.col(mesh_.triangles(k, on.triangle));
    return n.squaredNorm() > 0 ? Vector(n.normalized()) : Vector(Vector::UnitZ());
  }

  /// The tip above a point of the surface, or beside it: what lies beyond a border stays beyond.
  Vector tip(Vector const& p, S above) const {
    Vector const n = normal(p), on = tree_.nearest(mesh_.points, p).point;
    return p - (p - on).dot(n) * n + above * n;
  }

  /// A point of the surface: a vertex, on an edge, in a triangle, at a border or lip, beyond it.
  Vector place() {
    int const t = pick(mesh_.triangles.cols());
    int const k = pick(3);
    Vector const a = mesh_.points.col(mesh_.triangles(k, t)), b = mesh_.points.col(mesh_.triangles((k + 1) % 3, t)), c = mesh_.points.col(mesh_.triangles((k + 2) % 3, t));
    switch (random_.below(8)) {
      case 0:
      case 1: return a;
      case 2: return (a + b) / 2;
      case 3: return a + random_.uniform(S(0), S(1)) * (b - a);
      case 4: return (a + b + c) / 3;
      case 5: {
        auto const border = palpate::boundary_edges(mesh_);
        if (border.empty()) return a;
        auto const& e = border[static_cast<std::size_t>(pick(static_cast<Eigen::Index>(border.size())))];
        S const s = chance(3) ? S(0) : random_.uniform(S(0), S(1));
        return (1 - s) * mesh_.points.col(e[0]) + s * mesh_.points.col(e[1]);
      }
      default: {
        S const u = random_.uniform(S(0), S(1)), v = random_.uniform(S(0), S(1)) * (1 - u);
        return a + u * (b - a) + v * (c - a);
      }
    }
  }

  Vector onto(Vector const& p) const { return tree_.nearest(mesh_.points, p).point; }

  /// Any direction in the surface, or along x or y, where grids have their edges.
  Vector direction(Vector const& at) {
    Vector d = chance(4) ? Vector(chance(2) ? Vector::UnitX() : Vector::UnitY()) : any();
    Vector const n = normal(at);
    d -= d.dot(n) * n;
    return d.norm() > S(1e-3) ? Vector(d.normalized()) : n.unitOrthogonal();
  }

  S reach() { return edge_ * std::exp(random_.uniform(std::log(S(0.05)), std::log(S(8)))); }

  /// The corners of a way over the surface.
  Points<S> way() {
    Vector const start = place();
    Points<S> corners{start};
    switch (random_.below(9)) {
      case 0: corners.push_back(start + reach() * direction(start)); break;   // straight, often over a border
      case 1:                                                                 // a polyline of near points
        for (std::uint64_t k = 1 + random_.below(4); k > 0; --k) corners.push_back(onto(Vector(corners.back() + reach() * any() / 2)));
        break;
      case 2: {   // round, closed, from the inside out or beginning on the line
        Vector const n = normal(start), u = direction(start), v = n.cross(u);
        S const radius = reach() / 2;
        int const sides = 3 + pick(10);
        corners.clear();
        for (int k = 0; k <= sides + pick(2); ++k) {
          S const angle = S(2 * std::numbers::pi) * S(k) / S(sides);
          corners.push_back(onto(Vector(start + radius * (std::cos(angle) * u + std::sin(angle) * v))));
        }
        break;
      }
      case 3: {   // back and forth over the same line
        Vector const end = onto(Vector(start + reach() * direction(start)));
        for (std::uint64_t k = 2 + random_.below(3); k > 0; --k) corners.push_back(corners.size() % 2 == 1 ? end : start);
        break;
      }
      case 4: {   // along edges, from vertex to vertex
        int t = pick(mesh_.triangles.cols()), v = mesh_.triangles(pick(3), t);
        corners.assign(1, mesh_.points.col(v));
        for (std::uint64_t k = 1 + random_.below(6); k > 0; --k) {
          std::vector<int> beside;
          for (Eigen::Index i = 0; i < mesh_.triangles.cols(); ++i)
            for (int j = 0; j < 3; ++j)
              if (mesh_.triangles(j, i) == v) beside.push_back(mesh_.triangles((j + 1) % 3, i)), beside.push_back(mesh_.triangles((j + 2) % 3, i));
          v = beside[static_cast<std::size_t>(pick(static_cast<Eigen::Index>(beside.size())))];
          corners.push_back(mesh_.points.col(v));
        }
        break;
      }
      case 5: {   // a figure of eight
        Vector const u = reach() * direction(start), v = reach() * normal(start).cross(u.normalized());
        corners = {start - u, onto(Vector(start + u + v)), onto(Vector(start + u - v)), onto(Vector(start - u + v)), onto(Vector(start - u))};
        corners.front() = onto(corners.front());
        break;
      }
      case 6:   // from anywhere to anywhere
        for (std::uint64_t k = 1 + random_.below(3); k > 0; --k) corners.push_back(place());
        break;
      case 7: {   // over the border and back
        Vector const out = start + reach() * direction(start);
        corners.insert(corners.end(), {out, Vector(out + reach() * any()), onto(Vector(start + reach() * any()))});
        break;
      }
      default: {   // curved
        Vector at = start, ahead = direction(start);
        S const step = edge_ * random_.uniform(S(0.1), S(1)), bend = random_.uniform(S(-1), S(1));
        for (int k = 0; k < 8; ++k) {
          Vector const n = normal(at);
          ahead = (ahead - ahead.dot(n) * n + bend * n.cross(ahead)).normalized();
          corners.push_back(at = onto(Vector(at + step * ahead)));
        }
      }
    }
    return corners;
  }

  /// Points along the way, from far less than an edge apart to farther than the way is long; a way of many ticks is given up early.
  Points<S> along(Points<S> const& corners) {
    S const tick = edge_ * std::exp(random_.uniform(std::log(S(0.02)), std::log(S(10))));
    Points<S> path{corners.front()};
    for (std::size_t k = 1; k < corners.size() && path.size() < max_ticks; ++k) {
      Vector const from = path.back(), leg = corners[k] - from;
      if (!(leg.norm() < edge_ * 1000)) continue;
      auto const ticks = static_cast<int>(std::ceil(leg.norm() / tick));
      for (int i = 1; i <= std::max(1, ticks) && path.size() < max_ticks; ++i) path.push_back(i >= ticks ? corners[k] : Vector(from + leg * (S(i) / S(ticks))));
    }
    return path;
  }

  palpate::Random& random_;
  palpate::TriangleMesh<S> mesh_;
  palpate::SurfaceTree<S> tree_;
  palpate::Matrix<S, 3, palpate::Dynamic> normals_;
  S edge_;
};
