// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/temporary_subdivision.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/cutting/concept.hpp>
#include <palpate/cutting/detail/cut_anchor.hpp>
#include <palpate/cutting/detail/cut_passage.hpp>
#include <palpate/cutting/detail/rest_walk.hpp>
#include <palpate/cutting/detail/snapping.hpp>
#include <palpate/cutting/detail/wound_crossing.hpp>

#include <array>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

namespace palpate {

/// The end of a cut that is being made: from which particle it goes on, and the triangle that holds the blade.
///
/// The path consists of particles joined by edges of the mesh. It always goes on from the *anchor*, its last permanent particle,
/// through a triangle at the anchor, the *host*. Leaving the host over the edge that faces the anchor puts a particle there, which
/// divides the host and the triangle beyond, and the new edge anchor–particle is cut: the anchor falls into a left and a right copy
/// when the fan of triangles around it is open. While the blade is inside the host the anchor is open already where both sides have triangles, and
/// the host is divided for the eye; see TemporarySubdivision.
/// The blade does not pass a border or a lip beside the anchor: it waits in the host until it can go on.
/// Where another blade comes to the host, a particle is put where this one is, and this cut goes on from there.
/// A call crosses so many edges at most. Where the way to the blade has more, the front is *behind*: it has no host, and goes on to where the
/// blade was with the calls that follow, before it follows the blade again.
/// Where      everything is decided in the undeformed shape.
/// Source     \cite zheng2006 ch. 3, restated: a cut is a set of cut edges, and each vertex has one copy per connected fan of triangles around it.
/// Invariant  between calls every particle has one fan of triangles; the host is whole, and hangs on one copy of an anchor that is open.
/// Cost       O(triangles crossed), of which a call has a largest number.
template <RealScalar Scalar>
class CutFront {
 public:
  using Vector = Vector3<Scalar>;

  CutReport const& report() const noexcept { return anchor_.report; }
  std::vector<std::array<int, 2>> const& lips() const noexcept { return anchor_.lips(); }

  /// The cut has not come to where the blade was.
  bool is_behind() const noexcept { return is_behind_; }

  /// A triangle where the blade was, to go on walking from.
  template <class Body>
  int triangle(Body const& body) const noexcept {
    if (is_behind_) return target_.triangle;
    if (host_ >= 0) return host_;
    return body.tissue().surface().triangles_at(anchor_.left()).front();
  }

  /// The point of a triangle at the blade, or where the cut ends.
  template <class Body>
  detail::TrianglePoint<Scalar> blade_point(Body const& body) const noexcept {
    if (host_ >= 0 && body.find_temporary(temporary_) != nullptr) return {host_, inside(body)};
    return detail::TrianglePoint<Scalar>::at_particle(body, anchor_.left());
  }

  /// Punctures: the path begins at a point of a triangle, or at the vertex or edge that it snaps to. `max_crossings`: of edges, in a call.
  template <class Body>
  void start(Body& body, int triangle, Vector const& barycentric, detail::Snapping<Scalar> const& snapping, int max_crossings) {
    snapping_ = snapping.on(body.mean_edge());
    max_crossings_ = max_crossings;
    anchor_.begin();
    host_ = -1;
    temporary_ = 0;
    is_kept_ = is_behind_ = false;
    Vector const point = detail::rest_point(body, triangle, barycentric);
    triangle = without_temporary(body, triangle, point);
    anchor_.place(put(body, triangle, detail::rest_weights(body, triangle, point)));
    body.advance_cut_epoch();
  }

  /// The blade moves to a point of a triangle of the body as it is. Not for a front that is behind.
  template <class Body>
  void advance(Body& body, int triangle, Vector const& barycentric) {
    go_on_from_kept(body);
    Target const target{triangle, detail::rest_point(body, triangle, barycentric), detail::rest_normal(body, triangle, barycentric)};
    if (temporary_ != 0 && triangle == host_) {   // still in the host
      blade_ = target.point;
      blade_normal_ = target.normal;
      body.move_temporary(temporary_, inside(body));
      return;
    }
    moves_ = 0;
    go_to(body, target);
    if (host_ < 0) body.advance_cut_epoch();
  }

  /// A front that is behind goes on to where the blade was.
  template <class Body>
  void catch_up(Body& body) {
    target_.triangle = detail::triangle_near(body, target_.triangle, target_.point);   // others may have divided it
    go_to(body, target_);
    if (host_ < 0) body.advance_cut_epoch();
  }

  /// The blade is lifted: its last point becomes permanent. It snaps to the corners and edges of the host like the start. A cut that is behind
  /// ends where it has come to.
  template <class Body>
  void finish(Body& body) {
    is_behind_ = false;
    go_on_from_kept(body);
    if (host_ < 0) return;
    take_temporary_away(body);
    auto const corners = body.tissue().surface().corners(host_);
    std::size_t const a = anchor_.corner_in(body, host_);
    int const b = corners[(a + 1) % 3], c = corners[(a + 2) % 3];
    Vector const w = detail::clamped(detail::rest_weights(body, host_, blade_));
    auto const spot = snapping_.spot_of(body, host_, w);
    bool const closes = spot.kind == detail::SpotKind::vertex ? spot.corner == a || !anchor_.can_cut_to(body, host_, corners[spot.corner])
                                                              : spot.corner != a && anchor_.is_lip(body, host_, spot.corner == (a + 2) % 3 ? b : c);
    if (spot.kind == detail::SpotKind::interior || (closes && !anchor_.can_close(body))) {
      anchor_.divide(body, host_, spot.kind == detail::SpotKind::interior ? w : body.kept_weights(host_, w));
    } else if (spot.kind == detail::SpotKind::vertex) {
      if (spot.corner == a)
        anchor_.close(body);
      else if (anchor_.cut_to(body, host_, corners[spot.corner]))
        count(true);
    } else if (spot.corner == a) {
      count(false);
      anchor_.join(body, anchor_.insert_facing(body, b, c, spot.s));
    } else {
      anchor_.cut_towards(body, host_, spot.corner == (a + 2) % 3 ? b : c, spot.s);
    }
    host_ = -1;
  }

 private:
  using Exit = detail::RestExit<Scalar>;
  /// Where the blade is to come to, undeformed.
  struct Target {
    int triangle = -1;
    Vector point = Vector::Zero(), normal = Vector::Zero();
  };

  static constexpr int max_moves = 32;   // over wounds, between two crossings: where lips lie on each other, rounding may lead to and fro

  template <class Body>
  void go_to(Body& body, Target to) {
    bool const goes_on = std::exchange(is_behind_, false);
    to.triangle = without_temporary(body, to.triangle, to.point);
    anchor_.find_where_it_came_from(body);
    take_temporary_away(body);
    if (host_ < 0 && is_kept_ && (to.point - body.tissue().rest_position(anchor_.left())).norm() < body.mean_edge() / 10) return;
    is_kept_ = false;
    Vector from = host_ >= 0 ? blade_ : body.tissue().rest_position(anchor_.left());
    Vector from_normal = host_ >= 0 || goes_on ? blade_normal_ : Vector(body.reference_normal(anchor_.left()));
    bool arrived = false;
    for (int crossed = 0; !arrived; ++crossed) {
      if (crossed == max_crossings_) {
        target_ = to;
        blade_normal_ = from_normal;
        is_behind_ = true;
        return;
      }
      if (crossed > 0) body.even_masses();   // as after a tick: where the path may divide depends on masses, but not on how many edges a tick crosses
      detail::RestWay<Scalar> const way(from, from_normal, to.point, to.normal);
      if (!(way.length2 > 0)) break;
      if (host_ < 0) host_ = detail::triangle_towards(body, anchor_.left(), way, to.triangle);
      if (host_ >= 0 && body.make_permanent_in(host_) >= 0) host_ = detail::triangle_towards(body, anchor_.left(), way, to.triangle);
      if (host_ < 0) {
        if (++moves_ > max_moves || !(step_over_wound(body, way) || enter_beyond_wound(body, way, to.triangle, to.point))) return;   // the front waits
        from = body.tissue().rest_position(anchor_.left());
        from_normal = body.reference_normal(anchor_.left());
        continue;
      }
      Exit exit;
      Scalar progress = -way.length2;
      bool is_at_lip = false;
      while (true) {   // round the anchor, until the way leaves over the edge that faces it
        arrived = host_ == to.triangle;
        if (arrived) break;
        exit = detail::exit_of(body, host_, way);
        bool const ends = exit.edge < 0 || exit.progress > way.length2 * (1 + Scalar(1e-6)) || !(exit.progress > progress);
        if (!ends && faces_anchor(body, exit)) break;
        arrived = ends;
        if (arrived) break;
        if (!turn(body, exit)) {
          is_at_lip = true;
          break;
        }
        progress = exit.progress;
      }
      if (is_at_lip) {
        if (++moves_ > max_moves || !enter_beyond_wound(body, way, to.triangle, to.point)) break;   // the blade waits in the host
        from = body.tissue().rest_position(anchor_.left());
        from_normal = body.reference_normal(anchor_.left());
        continue;
      }
      if (arrived) break;
      from_normal = exit_normal(body, exit);
      bool const target_is_beyond = beyond(body, exit) == to.triangle;
      cross(body, exit);
      moves_ = 0;
      if (target_is_beyond) to.triangle = holder(body, anchor_.left(), to.point, to.triangle);
      from = body.tissue().rest_position(anchor_.left());
    }
    if (host_ < 0) return;
    leave_to_other(body, to.point);
    Vector const w = detail::rest_weights(body, host_, to.point);
    blade_ = w.minCoeff() >= 0 ? to.point : detail::rest_point(body, host_, detail::clamped(w));
    blade_normal_ = to.normal;
    put_temporary(body);
  }

  // --- the mesh around the anchor -----------------------------------------------------------------------------------
  template <class Body>
  std::array<int, 2> ends(Body const& body, Exit const& exit) const {
    auto const c = body.tissue().surface().corners(host_);
    auto const k = static_cast<std::size_t>(exit.edge);
    return {c[k], c[(k + 1) % 3]};
  }

  template <class Body>
  bool faces_anchor(Body const& body, Exit const& exit) const {
    auto const [a, b] = ends(body, exit);
    return !anchor_.is(a) && !anchor_.is(b);
  }

  template <class Body>
  int beyond(Body const& body, Exit const& exit) const {
    auto const [a, b] = ends(body, exit);
    return body.tissue().surface().triangle_with_edge(b, a);
  }

  template <class Body>
  Vector exit_normal(Body const& body, Exit const& exit) const {
    auto const [a, b] = ends(body, exit);
    return ((1 - exit.s) * body.reference_normal(a) + exit.s * body.reference_normal(b)).normalized();
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
    Vector const w = detail::clamped(barycentric);
    auto const spot = snapping_.spot_of(body, t, w);
    kind_ = spot.kind;
    if (spot.kind == detail::SpotKind::vertex) return c[spot.corner];
    if (spot.kind == detail::SpotKind::interior) return anchor_.insert_in_triangle(body, t, w);
    return anchor_.insert_on_edge(body, c[(spot.corner + 1) % 3], c[(spot.corner + 2) % 3], spot.s);
  }

  /// The path leaves the host over the edge that faces the anchor: the next anchor is there, or at the vertex it snaps to.
  template <class Body>
  void cross(Body& body, Exit const& exit) {
    auto const [b, c] = ends(body, exit);
    detail::CutPassage const passage(body, anchor_, host_, exit, snapping_);
    int const vertex = passage.vertex;
    if (vertex >= 0 && (anchor_.can_cut_to(body, host_, vertex) || anchor_.can_close(body))) {
      if (anchor_.cut_to(body, host_, vertex)) count(true);
      kind_ = detail::SpotKind::vertex;
    } else {
      count(false);
      anchor_.join(body, anchor_.insert_facing(body, b, c, vertex < 0 ? passage.s : vertex == b ? Scalar(0.25) : Scalar(0.75)));
      kind_ = detail::SpotKind::edge;
    }
    host_ = -1;
  }

  /// The anchor lies on a lip, and the way leads away from that: the cut goes on from the same place of the other lip. False where there is none,
  /// or the way does not enter it.
  template <class Body>
  bool step_over_wound(Body& body, detail::RestWay<Scalar> const& way) {
    auto const place = detail::place_across(body, anchor_.left(), way, snapping_);
    if (place.a >= 0) restart_at(body, place);
    return place.a >= 0;
  }

  /// The way to the target leads over a wound or a border: the cut ends on this side, and goes on from where the way, followed back from the
  /// target, comes to the other side. False when nothing lies between.
  template <class Body>
  bool enter_beyond_wound(Body& body, detail::RestWay<Scalar> const& way, int& triangle, Vector const& target) {
    auto const is_at_anchor = [&](int t) { return anchor_.is_at(body, t); };
    auto const [t, place] = detail::border_on_the_way(body, triangle, way.reversed(), is_at_anchor);
    if (t < 0) return false;
    if (body.make_permanent_on(place.a, place.b)) {   // it was open beside another blade only
      triangle = detail::triangle_near(body, triangle, target);
      return enter_beyond_wound(body, way, triangle, target);
    }
    if (host_ >= 0 && !anchor_.can_close(body))
      anchor_.divide(body, host_, body.kept_weights(host_, detail::rest_weights(body, host_, blade_)));
    else if (host_ >= 0)
      anchor_.close(body);
    host_ = -1;
    restart_at(body, detail::snapped(body, place, snapping_));
    if (kind_ == detail::SpotKind::edge && t == triangle) triangle = holder(body, anchor_.left(), target, triangle);
    return true;
  }

  template <class Body>
  void restart_at(Body& body, detail::BorderPlace<Scalar> const& place) {
    kind_ = place.b < 0 ? detail::SpotKind::vertex : detail::SpotKind::edge;
    anchor_.restart(place.b < 0 ? place.a : anchor_.insert_on_edge(body, place.a, place.b, place.s));
  }

  void count(bool to_vertex) {
    if (kind_ == detail::SpotKind::interior) return;
    if (kind_ == detail::SpotKind::vertex)
      ++(to_vertex ? anchor_.report.vertex_vertex : anchor_.report.vertex_edge);
    else
      ++(to_vertex ? anchor_.report.edge_vertex : anchor_.report.edge_edge);
  }

  /// The blade turns about the anchor into the triangle beside the host. False at a lip or border, and where the path came from.
  template <class Body>
  bool turn(Body& body, Exit const& exit) {
    auto const& surface = body.tissue().surface();
    auto const [a, b] = ends(body, exit);
    bool const to_the_left = anchor_.is(b);   // over the edge corner → anchor
    int const corner = to_the_left ? a : b;
    if (anchor_.ends_at(corner, to_the_left)) return false;
    int const copy = to_the_left ? anchor_.left() : anchor_.right();
    auto const beside = [&] { return to_the_left ? surface.triangle_with_edge(copy, corner) : surface.triangle_with_edge(corner, copy); };
    if (beside() < 0) return false;
    body.make_permanent_in(beside());
    int const next = beside();
    if (to_the_left) anchor_.attach_triangle(body, host_, anchor_.right());
    host_ = next;
    anchor_.attach_triangle(body, host_, anchor_.left());
    return true;
  }

  /// The blade's barycentric weights in the host, kept off its edges, by more than rounding.
  template <class Body>
  Vector inside(Body const& body) const {
    auto const c = body.tissue().surface().corners(host_);
    auto const corner = [&](std::size_t k) { return body.tissue().rest_position(c[k]); };
    return off_edges<Scalar>({corner(0), corner(1), corner(2)}, detail::rest_weights(body, host_, blade_), Scalar(1e-3),
                             1000 * std::numeric_limits<Scalar>::epsilon() * body.mean_edge());
  }

  template <class Body>
  void put_temporary(Body& body) {
    bool const can_be_seen = anchor_.open(body, host_);
    temporary_ = body.insert_temporary(host_, inside(body), static_cast<int>(anchor_.corner_in(body, host_)), {anchor_.left(), anchor_.right()});
    if (!can_be_seen) body.make_permanent(temporary_);
  }

  /// Where another blade is in the host, a particle is put there. The host is then the triangle at the anchor that holds the point best.
  template <class Body>
  void leave_to_other(Body& body, Vector const& point) {
    int const kept = body.make_permanent_in(host_);
    if (kept < 0) return;
    Scalar best = -std::numeric_limits<Scalar>::infinity();
    for (int const t : body.tissue().surface().triangles_at(kept)) {
      Scalar const least = detail::rest_weights(body, t, point).minCoeff();
      if (anchor_.is_at(body, t) && least > best) best = least, host_ = t;
    }
  }

  /// The host is whole again for the eye too.
  template <class Body>
  void take_temporary_away(Body& body) {
    if (temporary_ == 0) return;
    body.remove_temporary(temporary_);
    anchor_.attach_triangle(body, host_, anchor_.left());
    temporary_ = 0;
  }

  /// Another blade has had a particle put where this one was: the cut goes on from there.
  template <class Body>
  void go_on_from_kept(Body& body) {
    if (temporary_ == 0 || body.find_temporary(temporary_) != nullptr) return;
    anchor_.go_on_from(body.take_kept(temporary_));
    kind_ = detail::SpotKind::interior;
    host_ = -1;
    temporary_ = 0;
    is_kept_ = true;
  }

  /// Where another blade is in a triangle, a particle is put there. Returns the triangle that holds the point.
  template <class Body>
  int without_temporary(Body& body, int t, Vector const& point) {
    if (temporary_ != 0 && t == host_) return t;
    int const kept = body.make_permanent_in(t);
    return kept >= 0 ? holder(body, kept, point, t) : t;
  }

  detail::Snapping<Scalar> snapping_;
  int max_crossings_ = 1;
  int moves_ = 0;                                        // over wounds since the last crossing
  detail::CutAnchor anchor_;
  detail::SpotKind kind_ = detail::SpotKind::interior;   // what the anchor was before the cut reached it
  int host_ = -1;                                        // the triangle that holds the blade, or −1 when the blade is at the anchor
  TemporaryId temporary_ = 0;                            // how the host is divided for the eye, or 0
  bool is_behind_ = false;                               // the way to the target has more edges than a call may cross
  Target target_;                                        // while it is
  bool is_kept_ = false;                                 // the anchor was put where the blade is; the cut goes on once the blade has left it
  Vector blade_ = Vector::Zero();                        // where the blade is, undeformed
  Vector blade_normal_ = Vector::Zero();                 // there, or at the front that is behind
};

}  // namespace palpate
