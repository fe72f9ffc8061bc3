// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/cutting/detail/cut_anchor.hpp>
#include <palpate/cutting/detail/rest_walk.hpp>
#include <palpate/cutting/detail/snapping.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace palpate::detail {

/// Where a path from the anchor passes the edge of the host that faces it: at a vertex, or at a part `s` of the edge. What is near to a vertex,
/// would make thin triangles, or follows a wound closely goes to a vertex.
/// Where      in the undeformed shape.
template <class Body>
class CutPassage {
 public:
  using Scalar = typename Body::Scalar;
  using Vector = VectorOf<Body>;

  int vertex = -1;   ///< −1: the path passes the edge at s
  Scalar s = 0;

  CutPassage(Body const& body, CutAnchor const& anchor, int host, RestExit<Scalar> const& exit, Snapping<Scalar> const& snapping) : body_(body), anchor_(anchor) {
    auto const corners = body_.tissue().surface().corners(host);
    int const b = corners[static_cast<std::size_t>(exit.edge)], c = corners[static_cast<std::size_t>((exit.edge + 1) % 3)];
    int const beyond = body_.tissue().surface().triangle_with_edge(c, b);
    Vector const from = body_.tissue().rest_position(anchor_.left()), start = body_.tissue().rest_position(b);
    Vector const edge = body_.tissue().rest_position(c) - start;
    Scalar const length = edge.norm(), height = 2 * body_.tissue().triangle_area(host) / length;
    Scalar const reach = snapping.near(std::max(length, std::max(mean_edge(host), beyond < 0 ? Scalar(0) : mean_edge(beyond))));
    s = exit.s;
    Scalar way = (start + s * edge - from).norm();
    auto const nearest_end = [&] { return s <= Scalar(0.5) ? b : c; };
    auto const from_end = [&] { return std::min(s, 1 - s) * length; };
    auto const off_way = [&](Scalar part) { return part * height * length / way; };   // how far an end of the edge is off the way
    if (from_end() <= Scalar(2.5) * reach && runs_along_wound(from, start + s * edge, nearest_end())) {
      vertex = nearest_end();
      return;
    }
    if (beyond < 0)   // a corner of a wound would come free as a sliver
      for (auto const& [corner, part] : {std::pair(b, s), std::pair(c, 1 - s)})
        if (off_way(part) <= reach && is_lip(anchor_.left(), corner)) {
          vertex = corner;
          return;
        }
    if (height < reach) {   // a thin triangle, crossed at a slant
      Scalar const foot = std::clamp((from - start).dot(edge) / (length * length), Scalar(0), Scalar(1));
      Scalar const slide = reach / 2 * way / (height * length);
      s = s < foot ? std::min(foot, s + slide) : std::max(foot, s - slide);
      way = (start + s * edge - from).norm();
    }
    Scalar const limit = way < reach ? reach * reach / way : reach;   // a short way through a narrow corner
    if (from_end() <= limit || off_way(std::min(s, 1 - s)) <= limit / 2 || !has_mass_to_divide(body_, b, c, s)) vertex = nearest_end();
  }

 private:
  Scalar mean_edge(int t) const {
    auto const c = body_.tissue().surface().corners(t);
    return (rest_length(body_, c[0], c[1]) + rest_length(body_, c[1], c[2]) + rest_length(body_, c[2], c[0])) / 3;
  }

  /// Whether an edge is a lip or a border. Between edits an open anchor's host is parted from its neighbour: both copies of the anchor count.
  bool is_lip(int p, int q) const noexcept {
    auto const& surface = body_.tissue().surface();
    auto const holds = [&](int from, int to) {
      if (surface.triangle_with_edge(from, to) >= 0) return true;
      if (anchor_.is(from)) return surface.triangle_with_edge(anchor_.left(), to) >= 0 || surface.triangle_with_edge(anchor_.right(), to) >= 0;
      if (anchor_.is(to)) return surface.triangle_with_edge(from, anchor_.left()) >= 0 || surface.triangle_with_edge(from, anchor_.right()) >= 0;
      return false;
    };
    return !holds(p, q) || !holds(q, p);
  }

  /// Whether a way leads to within 25 degrees along a lip or border at this end of the edge, which lies ahead: it follows a cut that was snapped there, and
  /// would free a sliver beside it.
  bool runs_along_wound(Vector const& from, Vector const& to, int end) const {
    auto const& surface = body_.tissue().surface();
    Vector const way = to - from;
    Vector const at = body_.tissue().rest_position(end);
    if (!(way.dot(at - from) > 0) || surface.is_inside(end)) return false;
    Scalar const least = Scalar(0.81) * way.squaredNorm();
    auto const is_along = [&](int other) {
      Vector const lip = body_.tissue().rest_position(other) - at;
      Scalar const along = way.dot(lip);
      return along * along > least * lip.squaredNorm();
    };
    for (int const t : surface.triangles_at(end)) {
      auto const c = surface.corners(t);
      auto const k = static_cast<std::size_t>(surface.corner_of(t, end));
      int const ahead = c[(k + 1) % 3], behind = c[(k + 2) % 3];
      if ((is_along(ahead) && is_lip(ahead, end)) || (is_along(behind) && is_lip(end, behind))) return true;
    }
    return false;
  }

  Body const& body_;
  CutAnchor const& anchor_;
};

}  // namespace palpate::detail
