// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/cutting/concept.hpp>
#include <palpate/cutting/detail/rest_walk.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <vector>

namespace palpate {

/// The end of a cut that is being made: from which particle it goes on, and the triangle that holds the blade.
///
/// The path consists of particles joined by edges of the mesh. It always goes on from the *anchor*, its last permanent particle,
/// through a triangle at the anchor, the *host*. Leaving the host over the edge that faces the anchor puts a particle there, which
/// divides the host and the triangle beyond, and the new edge anchor–particle is cut: the anchor falls into a left and a right copy
/// when the fan of triangles around it is open. Inside the host a temporary particle follows the blade, and the anchor is open already.
/// The blade does not pass a border or a lip beside the anchor: it waits in the host until it can go on.
/// Where      everything is decided in the undeformed shape.
/// Source     spec Z8: a cut is a set of cut edges, and each vertex has one copy per connected fan of triangles around it.
/// Invariant  between calls every particle has one fan of triangles; while the anchor is open, without the temporary particle the host
///            hangs on the left copy.
/// Cost       O(triangles crossed).
template <RealScalar Scalar>
class CutFront {
 public:
  using Vector = Vector3<Scalar>;

  CutReport const& report() const noexcept { return report_; }
  std::vector<std::array<int, 2>> const& lips() const noexcept { return lips_; }

  /// A triangle at the front, to go on walking from.
  template <class Body>
  int triangle(Body const& body) const noexcept {
    if (body.temporary_triangle() >= 0) return body.temporary_triangle();
    return body.tissue().surface().triangles_at(left_).front();
  }

  /// Punctures: the path begins at a point of a triangle, or at the vertex or edge nearer than `snap` [m].
  template <class Body>
  void start(Body& body, int triangle, Vector const& barycentric, Scalar snap) {
    report_ = {};
    lips_.clear();
    snap_ = snap;
    came_from_ = host_ = -1;
    left_ = right_ = put(body, triangle, barycentric);
  }

  /// The blade moves to a point of a triangle of the body as it is.
  template <class Body>
  void advance(Body& body, int triangle, Vector const& barycentric) {
    Vector const target = detail::rest_point(body, triangle, barycentric);
    Vector const target_normal = detail::rest_normal(body, triangle, barycentric);
    if (is_temporary(body, triangle)) {   // still in the host
      blade_ = target;
      blade_normal_ = target_normal;
      body.move_temporary(inside(body));
      return;
    }
    take_temporary_away(body);
    Vector from = host_ >= 0 ? blade_ : body.tissue().rest_position(left_);
    Vector from_normal = host_ >= 0 ? blade_normal_ : Vector(body.home_normal(left_));
    bool arrived = false;
    for (int anchors = 0; anchors < most_anchors && !arrived; ++anchors) {
      detail::RestWay<Scalar> const way(from, from_normal, target, target_normal);
      if (!(way.length2 > 0)) break;
      if (host_ < 0) host_ = host_towards(body, way, triangle);
      if (host_ < 0) return;   // not ahead: the front waits
      Exit exit;
      Scalar progress = -way.length2;
      while (true) {   // round the anchor, until the way leaves over the edge that faces it
        arrived = host_ == triangle;
        if (arrived) break;
        exit = detail::exit_of(body, host_, way);
        bool const ends = exit.edge < 0 || exit.progress > way.length2 * (1 + Scalar(1e-6)) || !(exit.progress > progress);
        if (!ends && faces_anchor(body, exit)) break;
        arrived = ends || !turn(body, exit);
        if (arrived) break;
        progress = exit.progress;
      }
      if (arrived) break;
      from_normal = exit_normal(body, exit);
      bool const target_is_beyond = beyond(body, exit) == triangle;
      cross(body, exit);
      if (target_is_beyond) triangle = holder(body, left_, target, triangle);
      from = body.tissue().rest_position(left_);
    }
    if (host_ < 0) return;
    Vector const w = detail::rest_weights(body, host_, target);
    blade_ = w.minCoeff() >= 0 ? target : detail::rest_point(body, host_, clamped(w, Scalar(0)));
    blade_normal_ = target_normal;
    put_temporary(body);
  }

  /// The blade is lifted: its last point becomes permanent. It snaps to the corners and edges of the host like the start.
  template <class Body>
  void finish(Body& body) {
    if (host_ < 0) return;
    take_temporary_away(body);
    auto const corners = body.tissue().surface().corners(host_);
    auto const a = static_cast<std::size_t>(anchor_corner(body, host_));
    int const b = corners[(a + 1) % 3], c = corners[(a + 2) % 3];
    Vector const w = clamped(detail::rest_weights(body, host_, blade_), Scalar(0));
    Spot const spot = spot_of(body, host_, w);
    if (spot.kind == Kind::interior) {
      report_.particles_added += 1;
      report_.triangles_added += 2;
      divide_host(body, w, [&](Vector const& inside) { return body.insert_in_triangle(host_, inside); });
      if (left_ != right_) body.balance_copies(left_, right_);
    } else if (spot.kind == Kind::vertex) {
      if (spot.corner == a)
        close_anchor(body);
      else
        cut_along_edge(body, corners[spot.corner]);
    } else if (spot.corner == a) {
      join(body, insert_facing(body, b, c, spot.s));
    } else {
      end_beside_anchor(body, spot.corner == (a + 2) % 3 ? b : c, spot);
    }
    host_ = -1;
  }

 private:
  using Exit = detail::RestExit<Scalar>;
  enum class Kind { interior, edge, vertex };

  /// What a point of a triangle snaps to: the corner, or the edge that faces the corner, at s from the next corner on.
  struct Spot {
    Kind kind = Kind::interior;
    std::size_t corner = 0;
    Scalar s = 0;
  };

  static constexpr int most_anchors = 100000;
  /// Shares of an edge below which a point is not told from its end: smaller triangles have no reliable area.
  static constexpr Scalar least_share = std::same_as<Scalar, float> ? Scalar(5e-3) : Scalar(1e-4);

  Scalar near(Scalar length) const noexcept { return std::max(snap_, least_share * length); }

  template <class Body>
  Spot spot_of(Body const& body, int t, Vector const& w) const {
    auto const c = body.tissue().surface().corners(t);
    Vector const point = detail::rest_point(body, t, w);
    Spot spot;
    Scalar nearest = -1;
    for (std::size_t k = 0; k < 3; ++k) {
      Scalar const distance = (body.tissue().rest_position(c[k]) - point).norm();
      Scalar const size = std::max(detail::rest_length(body, c[k], c[(k + 1) % 3]), detail::rest_length(body, c[k], c[(k + 2) % 3]));
      if (distance <= near(size) && (nearest < 0 || distance < nearest)) nearest = distance, spot = {Kind::vertex, k, Scalar(0)};
    }
    if (spot.kind == Kind::vertex) return spot;
    for (std::size_t k = 0; k < 3; ++k) {
      Scalar const height = detail::rest_height(body, t, k), distance = height * w[static_cast<int>(k)];
      if (!(distance <= near(height)) || (nearest >= 0 && distance >= nearest)) continue;
      Scalar const ahead = w[static_cast<int>((k + 1) % 3)], behind = w[static_cast<int>((k + 2) % 3)];
      nearest = distance, spot = {Kind::edge, k, behind / (ahead + behind)};
    }
    if (spot.kind == Kind::edge) {   // its foot may be nearer to a corner than the point is
      std::size_t const from = (spot.corner + 1) % 3, to = (spot.corner + 2) % 3;
      Scalar const length = detail::rest_length(body, c[from], c[to]);
      if (std::min(spot.s, 1 - spot.s) <= least_share) return {Kind::vertex, spot.s <= Scalar(0.5) ? from : to, Scalar(0)};
      spot.s = std::clamp(spot.s, std::min(Scalar(0.5), snap_ / (2 * length)), std::max(Scalar(0.5), 1 - snap_ / (2 * length)));
    }
    return spot;
  }

  /// Weights of the point of the triangle that a point beside it goes to.
  static Vector clamped(Vector const& w, Scalar least) {
    Vector const raised = w.cwiseMax(least);
    return raised / raised.sum();
  }

  // --- the mesh around the anchor -----------------------------------------------------------------------------------
  bool is_anchor(int particle) const noexcept { return particle == left_ || particle == right_; }
  bool is_open() const noexcept { return left_ != right_; }

  template <class Body>
  int anchor_corner(Body const& body, int t) const noexcept {
    int const k = body.tissue().surface().corner_of(t, left_);
    return k >= 0 ? k : body.tissue().surface().corner_of(t, right_);
  }

  template <class Body>
  std::array<int, 2> ends(Body const& body, Exit const& exit) const {
    auto const c = body.tissue().surface().corners(host_);
    auto const k = static_cast<std::size_t>(exit.edge);
    return {c[k], c[(k + 1) % 3]};
  }

  template <class Body>
  bool faces_anchor(Body const& body, Exit const& exit) const {
    auto const [a, b] = ends(body, exit);
    return !is_anchor(a) && !is_anchor(b);
  }

  template <class Body>
  int beyond(Body const& body, Exit const& exit) const {
    auto const [a, b] = ends(body, exit);
    return body.tissue().surface().triangle_with_edge(b, a);
  }

  template <class Body>
  Vector exit_normal(Body const& body, Exit const& exit) const {
    auto const [a, b] = ends(body, exit);
    return ((1 - exit.s) * body.home_normal(a) + exit.s * body.home_normal(b)).normalized();
  }

  template <class Body>
  bool is_temporary(Body const& body, int t) const noexcept {
    if (body.temporary_triangle() < 0) return false;
    return t == body.temporary_triangle() || t >= body.tissue().surface().triangle_count() - 2;
  }

  /// The triangle at the anchor that the way enters: its facing edge starts to the right of the way and ends to the left.
  template <class Body>
  int host_towards(Body const& body, detail::RestWay<Scalar> const& way, int target_triangle) const {
    auto const& surface = body.tissue().surface();
    int best = -1;
    Scalar best_progress = 0;
    for (int const t : surface.triangles_at(left_)) {
      auto const c = surface.corners(t);
      auto const k = static_cast<std::size_t>(surface.corner_of(t, left_));
      Vector const p = body.tissue().rest_position(c[(k + 1) % 3]), q = body.tissue().rest_position(c[(k + 2) % 3]);
      Scalar const at_p = way.to_the_right(p), at_q = way.to_the_right(q);
      if (!(at_p >= 0 && at_q <= 0 && at_p > at_q)) continue;
      Scalar const progress = way.progress(p + at_p / (at_p - at_q) * (q - p));
      if (!(progress > 0)) continue;
      if (t == target_triangle) return t;
      if (best < 0 || progress > best_progress) best = t, best_progress = progress;
    }
    return best;
  }

  /// Of the triangles at a new particle, the one that holds a point: the old triangle was divided.
  template <class Body>
  int holder(Body const& body, int particle, Vector const& point, int otherwise) const {
    Scalar best = -1;
    for (int const t : body.tissue().surface().triangles_at(particle)) {
      Scalar const least = detail::rest_weights(body, t, point).minCoeff();
      if (least > best) best = least, otherwise = t;
    }
    return otherwise;
  }

  // --- edits --------------------------------------------------------------------------------------------------------
  /// Makes a point of a triangle a particle, or finds the vertex it snaps to; sets what kind of anchor that is.
  template <class Body>
  int put(Body& body, int t, Vector const& barycentric) {
    auto const c = body.tissue().surface().corners(t);
    Vector const w = clamped(barycentric, Scalar(0));
    Spot const spot = spot_of(body, t, w);
    kind_ = spot.kind;
    if (spot.kind == Kind::vertex) return c[spot.corner];
    if (spot.kind == Kind::edge) return insert_on_edge(body, c[(spot.corner + 1) % 3], c[(spot.corner + 2) % 3], spot.s);
    report_.particles_added += 1;
    report_.triangles_added += 2;
    return body.insert_in_triangle(t, w);
  }

  template <class Body>
  int insert_on_edge(Body& body, int a, int b, Scalar s) {
    auto const& surface = body.tissue().surface();
    report_.particles_added += 1;
    report_.triangles_added += (surface.triangle_with_edge(a, b) >= 0 ? 1 : 0) + (surface.triangle_with_edge(b, a) >= 0 ? 1 : 0);
    return body.insert_on_edge(a, b, s);
  }

  /// Hangs a triangle on one copy of the anchor.
  template <class Body>
  void hang(Body& body, int t, int copy) {
    int const other = copy == left_ ? right_ : left_;
    if (other != copy && body.tissue().surface().corner_of(t, other) >= 0) body.change_corner(t, other, copy);
  }

  /// Puts a particle on the host's edge b → c, which faces the anchor; the right half goes to the right copy of the anchor.
  template <class Body>
  int insert_facing(Body& body, int b, int c, Scalar s) {
    int const n = insert_on_edge(body, b, c, s);
    if (is_open()) hang(body, body.tissue().surface().triangle_with_edge(b, n), right_);
    return n;
  }

  /// The path leaves the host over the edge that faces the anchor: the next anchor is there, or at the vertex it snaps to.
  template <class Body>
  void cross(Body& body, Exit const& exit) {
    auto const [b, c] = ends(body, exit);
    Scalar const length = detail::rest_length(body, b, c);
    Scalar const limit = near(length);
    bool const to_b = exit.s * length <= limit && exit.s <= Scalar(0.5);
    bool const to_c = (1 - exit.s) * length <= limit && exit.s > Scalar(0.5);
    if (to_b || to_c) {
      if (cut_along_edge(body, to_b ? b : c)) count(true);
      kind_ = Kind::vertex;
    } else {
      count(false);
      join(body, insert_facing(body, b, c, exit.s));
      kind_ = Kind::edge;
    }
    host_ = -1;
  }

  void count(bool to_vertex) {
    if (kind_ == Kind::interior) return;
    if (kind_ == Kind::vertex)
      ++(to_vertex ? report_.vertex_vertex : report_.vertex_edge);
    else
      ++(to_vertex ? report_.edge_vertex : report_.edge_edge);
  }

  /// Cuts the edge from the anchor to a corner of the host; the corner is the next anchor. False when there is nothing to cut: the edge
  /// is a border, a lip, or the way the path came.
  template <class Body>
  bool cut_along_edge(Body& body, int corner) {
    bool cuts = true;
    if (is_open()) {   // the host hangs on the left copy; if it lies to the right of the edge, it changes sides
      auto const& surface = body.tissue().surface();
      if (surface.triangle_with_edge(corner, left_) == host_) hang(body, host_, right_);
      cuts = !surface.triangles_at(left_).empty() && !surface.triangles_at(right_).empty();
      if (!cuts) close_anchor(body);
    }
    join(body, corner);
    return cuts;
  }

  /// The path ends on an edge of the host beside the anchor, the one to `corner`: up to there that edge is cut.
  template <class Body>
  void end_beside_anchor(Body& body, int corner, Spot const& spot) {
    auto const& surface = body.tissue().surface();
    auto const c = surface.corners(host_);
    bool const is_right = c[(spot.corner + 2) % 3] == corner;   // the edge from the anchor to the corner; else the one from the corner
    int const copy = is_right ? right_ : left_;
    if (is_open()) {
      hang(body, host_, copy);
      bool const is_lip = is_right ? surface.triangle_with_edge(corner, copy) < 0 : surface.triangle_with_edge(copy, corner) < 0;
      if (is_lip) {
        close_anchor(body);
        return;
      }
    }
    int const n = is_right ? insert_on_edge(body, copy, corner, spot.s) : insert_on_edge(body, corner, copy, spot.s);
    if (is_open()) hang(body, is_right ? surface.triangle_with_edge(copy, n) : surface.triangle_with_edge(n, copy), is_right ? left_ : right_);
    join(body, n);
  }

  /// Makes the edge from the anchor to `next` a cut, and `next` the anchor.
  template <class Body>
  void join(Body& body, int next) {
    bool open = is_open();
    int const anchor = left_;
    if (open)
      body.balance_copies(left_, right_);
    else
      open = separate(body, anchor, came_from_, next);
    came_from_ = open ? -1 : anchor;
    left_ = right_ = next;
    if (separate(body, next, came_from_, -1)) came_from_ = -1;
  }

  /// Divides the host around a particle inside it, `insert(weights)`, and opens the anchor up to there: what lies to the right of
  /// the line from the anchor to the particle hangs on the right copy, the rest on the left one.
  template <class Body, class Insert>
  void divide_host(Body& body, Vector const& w, Insert insert) {
    auto const& surface = body.tissue().surface();
    bool const opens = !is_open() && fan_to_the_right(body);
    if (opens) {
      right_ = body.split_particle(left_, {});
      lips_.push_back({left_, right_});
      report_.particles_added += 1;
    }
    int const end = insert(w);
    if (!is_open()) return;
    if (opens)
      for (int const t : fan_) body.change_corner(t, left_, right_);
    hang(body, std::max(surface.triangle_with_edge(end, left_), surface.triangle_with_edge(end, right_)), right_);
    hang(body, std::max(surface.triangle_with_edge(left_, end), surface.triangle_with_edge(right_, end)), left_);
    if (opens) body.balance_copies(left_, right_);
  }

  /// Collects the triangles around the anchor to the right of the host, up to a border or the cut edge; false if there is neither.
  /// Finds where the fan ends to the right and to the left.
  template <class Body>
  bool fan_to_the_right(Body const& body) {
    auto const& surface = body.tissue().surface();
    fan_.clear();
    for (int t = host_;;) {
      right_end_ = surface.corners(t)[static_cast<std::size_t>((surface.corner_of(t, left_) + 1) % 3)];
      if (right_end_ == came_from_) break;
      t = surface.triangle_with_edge(right_end_, left_);
      if (t < 0) break;
      if (t == host_) return false;
      fan_.push_back(t);
    }
    for (int t = host_; t >= 0;) {
      left_end_ = surface.corners(t)[static_cast<std::size_t>((surface.corner_of(t, left_) + 2) % 3)];
      t = left_end_ == came_from_ ? -1 : surface.triangle_with_edge(left_, left_end_);
    }
    return true;
  }

  /// Splits a particle into one copy per connected fan of triangles; the edges to `cut_a` and `cut_b` do not connect.
  template <class Body>
  bool separate(Body& body, int particle, int cut_a, int cut_b) {
    auto const& surface = body.tissue().surface();
    bool split = false;
    while (true) {
      fan_.clear();
      auto const around = surface.triangles_at(particle);
      if (around.empty()) return split;
      fan_.push_back(around.front());
      for (std::size_t i = 0; i < fan_.size(); ++i) {
        auto const c = surface.corners(fan_[i]);
        auto const k = static_cast<std::size_t>(surface.corner_of(fan_[i], particle));
        int const ahead = c[(k + 1) % 3], behind = c[(k + 2) % 3];
        for (int const t : {ahead == cut_a || ahead == cut_b ? -1 : surface.triangle_with_edge(ahead, particle),
                            behind == cut_a || behind == cut_b ? -1 : surface.triangle_with_edge(particle, behind)})
          if (t >= 0 && std::find(fan_.begin(), fan_.end(), t) == fan_.end()) fan_.push_back(t);
      }
      if (fan_.size() == around.size()) return split;
      lips_.push_back({particle, body.split_particle(particle, fan_)});
      report_.particles_added += 1;
      split = true;
    }
  }

  /// Nothing is cut at the anchor after all: its copies become one again. The copy is the last particle: nothing was added since.
  template <class Body>
  void close_anchor(Body& body) {
    if (!is_open()) return;
    left_ = std::min(left_, right_);
    right_ = left_;
    body.merge_last_particle(left_);
    report_.particles_added -= 1;
    lips_.pop_back();
  }

  /// The blade turns about the anchor into the triangle beside the host. False at a lip or border, and where the path came from.
  template <class Body>
  bool turn(Body& body, Exit const& exit) {
    auto const& surface = body.tissue().surface();
    auto const [a, b] = ends(body, exit);
    bool const to_the_left = is_anchor(b);   // over the edge corner → anchor
    int const corner = to_the_left ? a : b;
    if (corner == came_from_ || (is_open() && corner == (to_the_left ? left_end_ : right_end_))) return false;
    int const copy = to_the_left ? left_ : right_;
    int const next = to_the_left ? surface.triangle_with_edge(copy, corner) : surface.triangle_with_edge(corner, copy);
    if (next < 0) return false;
    if (to_the_left) hang(body, host_, right_);
    host_ = next;
    hang(body, host_, left_);
    return true;
  }

  /// The blade's barycentric weights in the host, kept off its edges. While the host is divided its corners are those it had.
  template <class Body>
  Vector inside(Body const& body) const {
    return clamped(detail::rest_weights(body, host_corners_, blade_), Scalar(1e-3));
  }

  template <class Body>
  void put_temporary(Body& body) {
    host_corners_ = body.tissue().surface().corners(host_);
    divide_host(body, inside(body), [&](Vector const& w) { return body.insert_temporary(host_, w); });
  }

  /// The host gets its corners back; where the anchor is open it hangs on the left copy.
  template <class Body>
  void take_temporary_away(Body& body) {
    if (body.temporary_particle() < 0) return;
    auto const& surface = body.tissue().surface();
    int const last = surface.triangle_count() - 1;
    std::array<int, 3> corners{surface.corners(body.temporary_triangle())[0], surface.corners(last - 1)[0], surface.corners(last)[0]};
    for (int& c : corners)
      if (c == right_) c = left_;
    body.remove_temporary(corners);
  }

  CutReport report_;
  std::vector<std::array<int, 2>> lips_;
  std::vector<int> fan_;
  Scalar snap_ = 0;
  int left_ = -1;        // the anchor's copy to the left of the path ahead; the same as right_ while it is one
  int right_ = -1;
  int left_end_ = -1;    // while the anchor is open: where its fan of triangles ends
  int right_end_ = -1;
  int came_from_ = -1;   // the other end of the last cut edge, if that edge is still closed
  int host_ = -1;        // the triangle that holds the blade, or −1 when the blade is at the anchor
  std::array<int, 3> host_corners_{-1, -1, -1};   // of the host before it was divided
  Kind kind_ = Kind::interior;   // what the anchor was before the cut reached it
  Vector blade_ = Vector::Zero();          // where the blade is, undeformed
  Vector blade_normal_ = Vector::Zero();
};

}  // namespace palpate
