// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/cutting/concept.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace palpate {

/// The end of a cut that is being made: from which particle it goes on, and the triangle that holds the blade.
///
/// The path consists of particles joined by edges of the mesh. It always goes on from the *anchor*, its last permanent particle,
/// through a triangle at the anchor, the *host*. Leaving the host over the edge that faces the anchor puts a particle there, which
/// divides the host and the triangle beyond, and the new edge anchor–particle is cut: the anchor falls into a left and a right copy
/// when the fan of triangles around it is open. Inside the host a temporary particle follows the blade, and the anchor is open already.
/// Where      everything is decided in the undeformed shape.
/// Source     spec Z8: a cut is a set of cut edges, and each vertex has one copy per connected fan of triangles around it.
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
    came_from_ = -1;
    host_ = -1;
    left_ = right_ = put(body, triangle, barycentric);
  }

  /// The blade moves to a point of a triangle of the body as it is.
  template <class Body>
  void advance(Body& body, int triangle, Vector const& barycentric) {
    Vector const target = rest_point(body, triangle, barycentric);
    Vector const target_normal = rest_normal(body, triangle, barycentric);
    if (is_temporary(body, triangle)) {   // still in the host
      blade_ = target;
      blade_normal_ = target_normal;
      body.move_temporary(inside(body));
      return;
    }
    take_temporary_away(body);
    Vector from = host_ >= 0 ? blade_ : body.tissue().rest_position(left_);
    Vector from_normal = host_ >= 0 ? blade_normal_ : Vector(body.home_normal(left_));
    for (int crossed = 0; crossed < 100000; ++crossed) {
      Vector const way = target - from;
      if (!(way.squaredNorm() > 0)) break;
      Vector const side = way.cross(from_normal + target_normal);   // points to the right of the way
      if (host_ < 0) {
        host_ = host_towards(body, from, way, side, triangle);
        if (host_ < 0) return;   // not ahead: the front waits
      }
      if (host_ == triangle) break;
      Exit const exit = exit_of(body, host_, from, way, side);
      if (exit.edge < 0 || exit.progress > way.squaredNorm() * (1 + Scalar(1e-6))) break;
      from_normal = exit_normal(body, exit);
      Vector const point = exit.point;
      if (faces_anchor(body, exit)) {
        bool const target_is_beyond = neighbour(body, exit) == triangle;
        cross(body, exit);
        if (target_is_beyond) triangle = holder(body, left_, target, triangle);
        from = body.tissue().rest_position(left_);
      } else if (!turn(body, exit)) {
        break;   // a lip or the border beside the anchor: the blade stays inside
      } else {
        from = point;
      }
    }
    if (host_ < 0) return;
    blade_ = target;
    blade_normal_ = target_normal;
    put_temporary(body);
  }

  /// The blade is lifted: its last point becomes permanent.
  template <class Body>
  void finish(Body& body) {
    if (host_ < 0) return;
    take_temporary_away(body);
    Vector w = weights(body, host_, blade_);
    auto const corners = body.tissue().surface().corners(host_);
    bool const opened = left_ != right_;
    for (std::size_t k = 0; k < 3; ++k) {   // the anchor itself, or a corner nearer than snap
      if ((body.tissue().rest_position(corners[k]) - blade_).norm() > snap_) continue;
      if (corners[k] == left_ || corners[k] == right_) {
        if (opened) close_anchor(body);
      } else {
        cut_along_edge(body, corners[k]);
      }
      host_ = -1;
      return;
    }
    auto const a = static_cast<std::size_t>(anchor_corner(body, host_));
    int const b = corners[(a + 1) % 3], c = corners[(a + 2) % 3];
    Scalar const facing = height(body, host_, static_cast<int>(a)) * w[static_cast<int>(a)];
    if (facing <= std::max(snap_, Scalar(1e-6) * height(body, host_, static_cast<int>(a)))) {
      Scalar const s = w[static_cast<int>((a + 2) % 3)] / (w[static_cast<int>((a + 1) % 3)] + w[static_cast<int>((a + 2) % 3)]);
      join(body, insert_facing(body, b, c, s));
    } else {
      for (int k = 0; k < 3; ++k) w[k] = std::max(w[k], Scalar(0.02));
      w /= w.sum();
      report_.particles_added += 1;
      report_.triangles_added += 2;
      divide_host(body, w, [&](Vector const& inside) { return body.insert_in_triangle(host_, inside); });
    }
    host_ = -1;
  }

 private:
  enum class Kind { interior, edge, vertex };   ///< what the anchor was before the cut reached it

  /// Where the way leaves a triangle: over the edge from corner `edge` to the next, at parameter s.
  struct Exit {
    int edge = -1;
    Scalar s = 0;
    Scalar progress = 0;
    Vector point = Vector::Zero();
  };

  // --- geometry in the undeformed shape -----------------------------------------------------------------------------
  template <class Body>
  static Vector rest_point(Body const& body, int t, Vector const& w) {
    auto const c = body.tissue().surface().corners(t);
    return w[0] * body.tissue().rest_position(c[0]) + w[1] * body.tissue().rest_position(c[1]) + w[2] * body.tissue().rest_position(c[2]);
  }

  template <class Body>
  static Vector rest_normal(Body const& body, int t, Vector const& w) {
    auto const c = body.tissue().surface().corners(t);
    return (w[0] * body.home_normal(c[0]) + w[1] * body.home_normal(c[1]) + w[2] * body.home_normal(c[2])).normalized();
  }

  /// Barycentric weights of a point, seen along the triangle's normal.
  template <class Body>
  static Vector weights(Body const& body, int t, Vector const& point) {
    return weights(body, body.tissue().surface().corners(t), point);
  }
  template <class Body>
  static Vector weights(Body const& body, std::array<int, 3> const& c, Vector const& point) {
    Vector const a = body.tissue().rest_position(c[0]) - point, b = body.tissue().rest_position(c[1]) - point,
                 d = body.tissue().rest_position(c[2]) - point;
    Vector const n = (b - a).cross(d - a);
    return Vector(n.dot(b.cross(d)), n.dot(d.cross(a)), n.dot(a.cross(b))) / n.squaredNorm();
  }

  /// The distance of a corner from the edge that faces it.
  template <class Body>
  static Scalar height(Body const& body, int t, int corner) {
    auto const c = body.tissue().surface().corners(t);
    auto const k = static_cast<std::size_t>(corner);
    Scalar const base = (body.tissue().rest_position(c[(k + 1) % 3]) - body.tissue().rest_position(c[(k + 2) % 3])).norm();
    return 2 * body.tissue().triangle_area(t) / base;
  }

  template <class Body>
  static Exit exit_of(Body const& body, int t, Vector const& from, Vector const& way, Vector const& side) {
    auto const c = body.tissue().surface().corners(t);
    Exit best;
    best.progress = 0;
    for (int k = 0; k < 3; ++k) {
      Vector const p = body.tissue().rest_position(c[static_cast<std::size_t>(k)]);
      Vector const q = body.tissue().rest_position(c[static_cast<std::size_t>((k + 1) % 3)]);
      Scalar const sp = side.dot(p - from), sq = side.dot(q - from);
      if (!(sp >= 0 && sq < 0) && !(sp > 0 && sq <= 0)) continue;   // leaving: its start is to the right, its end to the left
      Scalar const s = sp / (sp - sq);
      Vector const point = p + s * (q - p);
      Scalar const progress = way.dot(point - from);
      if (best.edge < 0 || progress > best.progress) best = {k, s, progress, point};
    }
    return best;
  }

  template <class Body>
  Vector exit_normal(Body const& body, Exit const& exit) const {
    auto const [a, b] = ends(body, exit);
    return ((1 - exit.s) * body.home_normal(a) + exit.s * body.home_normal(b)).normalized();
  }

  // --- the mesh around the anchor -----------------------------------------------------------------------------------
  bool is_anchor(int particle) const noexcept { return particle == left_ || particle == right_; }

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

  /// The triangle beyond an edge of the host, whichever copy of the anchor it hangs on; −1 at a border.
  template <class Body>
  int neighbour(Body const& body, Exit const& exit) const {
    auto const [a, b] = ends(body, exit);
    auto const& surface = body.tissue().surface();
    if (int const t = surface.triangle_with_edge(b, a); t >= 0) return t;
    if (left_ == right_) return -1;
    if (is_anchor(a)) return surface.triangle_with_edge(b, a == left_ ? right_ : left_);
    if (is_anchor(b)) return surface.triangle_with_edge(b == left_ ? right_ : left_, a);
    return -1;
  }

  template <class Body>
  bool is_temporary(Body const& body, int t) const noexcept {
    if (body.temporary_triangle() < 0) return false;
    return t == body.temporary_triangle() || t >= body.tissue().surface().triangle_count() - 2;
  }

  /// The triangle at the anchor that the way enters: its facing edge starts to the right of the way and ends to the left.
  template <class Body>
  int host_towards(Body const& body, Vector const& from, Vector const& way, Vector const& side, int target_triangle) const {
    auto const& surface = body.tissue().surface();
    int best = -1;
    Scalar best_progress = 0;
    for (int const t : surface.triangles_at(left_)) {
      auto const c = surface.corners(t);
      auto const k = static_cast<std::size_t>(surface.corner_of(t, left_));
      Vector const p = body.tissue().rest_position(c[(k + 1) % 3]), q = body.tissue().rest_position(c[(k + 2) % 3]);
      Scalar const sp = side.dot(p - from), sq = side.dot(q - from);
      if (!(sp >= 0 && sq <= 0 && sp > sq)) continue;
      Scalar const progress = way.dot(p + sp / (sp - sq) * (q - p) - from);
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
      Scalar const inside = weights(body, t, point).minCoeff();
      if (inside > best) best = inside, otherwise = t;
    }
    return otherwise;
  }

  // --- edits --------------------------------------------------------------------------------------------------------
  /// Makes a point of a triangle a particle, or finds the vertex it snaps to; sets what kind of anchor that is.
  template <class Body>
  int put(Body& body, int t, Vector const& w) {
    auto const c = body.tissue().surface().corners(t);
    Vector const point = rest_point(body, t, w);
    for (int const v : c)
      if ((body.tissue().rest_position(v) - point).norm() <= snap_) {
        kind_ = Kind::vertex;
        return v;
      }
    int nearest = 0;
    Scalar distance = height(body, t, 0) * w[0];
    for (int k = 1; k < 3; ++k)
      if (Scalar const d = height(body, t, k) * w[k]; d < distance) distance = d, nearest = k;
    if (distance <= std::max(snap_, Scalar(1e-6) * height(body, t, nearest))) {
      auto const k = static_cast<std::size_t>(nearest);
      int const a = c[(k + 1) % 3], b = c[(k + 2) % 3];
      kind_ = Kind::edge;
      return insert_on_edge(body, a, b, w[static_cast<int>((k + 2) % 3)] / (w[static_cast<int>((k + 1) % 3)] + w[static_cast<int>((k + 2) % 3)]));
    }
    kind_ = Kind::interior;
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

  /// Puts a particle on the host's edge b → c, which faces the anchor; the right half goes to the right copy of the anchor.
  template <class Body>
  int insert_facing(Body& body, int b, int c, Scalar s) {
    int const n = insert_on_edge(body, b, c, s);
    if (left_ != right_) {
      int const right_half = body.tissue().surface().triangle_with_edge(b, n);
      if (body.tissue().surface().corner_of(right_half, left_) >= 0) body.change_corner(right_half, left_, right_);
    }
    return n;
  }

  /// The path leaves the host over the edge that faces the anchor: the next anchor is there, or at the vertex it snaps to.
  template <class Body>
  void cross(Body& body, Exit const& exit) {
    auto const [b, c] = ends(body, exit);
    Scalar const length = (body.tissue().rest_position(b) - body.tissue().rest_position(c)).norm();
    Scalar const near = std::max(snap_, Scalar(1e-6) * length);
    bool const to_b = exit.s * length <= near && exit.s <= Scalar(0.5);
    bool const to_c = (1 - exit.s) * length <= near && exit.s > Scalar(0.5);
    count(to_b || to_c);
    if (to_b || to_c) {
      cut_along_edge(body, to_b ? b : c);
      kind_ = Kind::vertex;
    } else {
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

  /// Cuts the edge from the anchor to a corner of the host; the corner is the next anchor.
  template <class Body>
  void cut_along_edge(Body& body, int corner) {
    if (left_ != right_) {   // the host hangs on the left copy; if it lies to the right of the edge, it changes sides
      auto const& surface = body.tissue().surface();
      bool const host_is_right = surface.triangle_with_edge(corner, left_) == host_;
      if (host_is_right) body.change_corner(host_, left_, right_);
    }
    join(body, corner);
  }

  /// Makes the edge from the anchor to `next` a cut, and `next` the anchor.
  template <class Body>
  void join(Body& body, int next) {
    bool open = left_ != right_;
    int const anchor = left_;
    if (!open) open = separate(body, anchor, came_from_, next);
    came_from_ = open ? -1 : anchor;
    left_ = right_ = next;
    separate(body, next, came_from_, -1);
  }

  /// Divides the host around a particle inside it, `insert(weights)`, and opens the anchor up to there: what lies to the right of
  /// the line from the anchor to the particle hangs on the right copy, the rest on the left one.
  template <class Body, class Insert>
  void divide_host(Body& body, Vector const& w, Insert insert) {
    auto const& surface = body.tissue().surface();
    bool const opens = left_ == right_ && fan_to_the_right(body);
    if (opens) {
      right_ = body.split_particle(left_, {});
      lips_.push_back({left_, right_});
      report_.particles_added += 1;
    }
    int const end = insert(w);
    if (left_ == right_) return;
    if (opens)
      for (int const t : fan_) body.change_corner(t, left_, right_);
    int const right_child = std::max(surface.triangle_with_edge(end, left_), surface.triangle_with_edge(end, right_));
    int const left_child = std::max(surface.triangle_with_edge(left_, end), surface.triangle_with_edge(right_, end));
    if (surface.corner_of(right_child, left_) >= 0) body.change_corner(right_child, left_, right_);
    if (surface.corner_of(left_child, right_) >= 0) body.change_corner(left_child, right_, left_);
    if (opens) body.balance_copies(left_, right_);
  }

  /// Collects the triangles around the anchor to the right of the host, up to a border or the cut edge; false if there is neither.
  template <class Body>
  bool fan_to_the_right(Body const& body) {
    auto const& surface = body.tissue().surface();
    fan_.clear();
    for (int t = host_;;) {
      auto const c = surface.corners(t);
      int const ahead = c[static_cast<std::size_t>((surface.corner_of(t, left_) + 1) % 3)];
      if (ahead == came_from_) return true;
      t = surface.triangle_with_edge(ahead, left_);
      if (t < 0) return true;
      if (t == host_) return false;
      fan_.push_back(t);
    }
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

  /// The path ends at the anchor after all: its copies become one again, if nothing was added since; otherwise they stay two.
  template <class Body>
  void close_anchor(Body& body) {
    int const copy = std::max(left_, right_);
    if (copy != body.size() - 1) return;
    int const kept = std::min(left_, right_);
    body.merge_last_particle(kept);
    report_.particles_added -= 1;
    lips_.pop_back();
    left_ = right_ = kept;
  }

  /// The blade turns about the anchor into the triangle beside the host. False at a lip or border.
  template <class Body>
  bool turn(Body& body, Exit const& exit) {
    int const next = neighbour(body, exit);
    if (next < 0) return false;
    if (left_ != right_) {
      auto const [a, b] = ends(body, exit);
      bool const to_the_left = is_anchor(b);   // over the edge c → anchor
      int const from = to_the_left ? left_ : right_, to = to_the_left ? right_ : left_;
      if (body.tissue().surface().corner_of(host_, from) >= 0) body.change_corner(host_, from, to);
    }
    host_ = next;
    return true;
  }

  /// The blade's barycentric weights in the host, kept off its edges. While the host is divided its corners are those it had.
  template <class Body>
  Vector inside(Body const& body) const {
    Vector w = weights(body, host_corners_, blade_);
    for (int k = 0; k < 3; ++k) w[k] = std::max(w[k], Scalar(1e-3));
    return w / w.sum();
  }

  template <class Body>
  void put_temporary(Body& body) {
    host_corners_ = body.tissue().surface().corners(host_);
    divide_host(body, inside(body), [&](Vector const& w) { return body.insert_temporary(host_, w); });
  }

  /// The host gets its corners back; where the anchor is open it hangs on the copy on its own side, or else on the left one.
  template <class Body>
  void take_temporary_away(Body& body) {
    int const v = body.temporary_particle();
    if (v < 0) return;
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
  int came_from_ = -1;   // the other end of the last cut edge, while that edge is still closed
  int host_ = -1;        // the triangle that holds the blade, or −1 when the blade is at the anchor
  std::array<int, 3> host_corners_{-1, -1, -1};   // of the host before it was divided
  Kind kind_ = Kind::interior;
  Vector blade_ = Vector::Zero();          // where the blade is, undeformed
  Vector blade_normal_ = Vector::Zero();
};

}  // namespace palpate
