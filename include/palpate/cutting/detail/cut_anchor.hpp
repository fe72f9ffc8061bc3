// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/cutting/concept.hpp>
#include <palpate/cutting/detail/rest_walk.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

namespace palpate::detail {

/// The last permanent particle of a cut, and the edits around it that open it and hand it on.
///
/// A cut edge separates the triangles on its sides. The triangles around a particle form fans; where cut edges and a border leave more
/// than one, the particle falls into one copy per fan. While the blade is in a triangle at the anchor, the *host*, the anchor is *open*
/// if its fan can be parted along the way into the host: then it has a left and a right copy, and during edits the host hangs on the left one.
/// Source  \cite zheng2006 ch. 3; one copy per connected fan is ours.
class CutAnchor {
 public:
  /// Begins a cut; the edits are counted from zero.
  void begin() {
    report = {};
    lips_.clear();
    came_from_ = left_ = right_ = -1;
  }
  void place(int particle) noexcept { left_ = right_ = particle; }
  /// The blade's point in the host has become a particle, the next anchor: another blade has come too near.
  void go_on_from(int particle) noexcept {
    report.particles_added += 1, report.triangles_added += 2;
    came_from_ = is_open() ? -1 : left_;
    place(particle);
  }
  /// Goes on from elsewhere: no cut edge leads there.
  void restart(int particle) noexcept {
    place(particle);
    came_from_ = -1;
  }

  /// Another blade may have put a particle on the closed edge that the path came along.
  template <class Body>
  void find_where_it_came_from(Body& body) {
    auto const& surface = body.tissue().surface();
    if (came_from_ < 0 || is_open() || surface.triangle_with_edge(left_, came_from_) >= 0 || surface.triangle_with_edge(came_from_, left_) >= 0) return;
    VectorOf<Body> const at = body.tissue().rest_position(left_), back = (body.tissue().rest_position(came_from_) - at).normalized();
    typename Body::Scalar least = typename Body::Scalar(1e-3);   // 1 − cosine
    int const before = came_from_;
    came_from_ = -1;
    for (int const t : surface.triangles_at(left_))
      for (int const q : surface.corners(t)) {
        if (q == left_ || q == before) continue;
        auto const off = 1 - (body.tissue().rest_position(q) - at).normalized().dot(back);
        if (off < least) least = off, came_from_ = q;
      }
    body.advance_cut_epoch();   // that particle is to stay
  }

  int left() const noexcept { return left_; }
  int right() const noexcept { return right_; }
  bool is_open() const noexcept { return left_ != right_; }
  bool is(int particle) const noexcept { return particle == left_ || particle == right_; }
  template <class Body>
  bool is_at(Body const& body, int t) const noexcept {
    auto const& surface = body.tissue().surface();
    return surface.corner_of(t, left_) >= 0 || surface.corner_of(t, right_) >= 0;
  }
  /// Pairs of particles that were one.
  std::vector<std::array<int, 2>> const& lips() const noexcept { return lips_; }

  template <class Body>
  std::size_t corner_in(Body const& body, int t) const noexcept {
    int const k = body.tissue().surface().corner_of(t, left_);
    return static_cast<std::size_t>(k >= 0 ? k : body.tissue().surface().corner_of(t, right_));
  }

  /// Whether the blade may not pass from the host over its edge to `corner`: the path came along it, or the anchor's fan ends there.
  bool ends_at(int corner, bool to_the_left) const noexcept {
    return corner == came_from_ || (is_open() && corner == (to_the_left ? left_end_ : right_end_));
  }

  template <class Body>
  int insert_in_triangle(Body& body, int t, VectorOf<Body> const& w) {
    report.particles_added += 1;
    report.triangles_added += 2;
    return body.insert_in_triangle(t, w);
  }

  template <class Body>
  int insert_on_edge(Body& body, int a, int b, typename Body::Scalar s) {
    auto const& surface = body.tissue().surface();
    report.particles_added += 1;
    report.triangles_added += (surface.triangle_with_edge(a, b) >= 0 ? 1 : 0) + (surface.triangle_with_edge(b, a) >= 0 ? 1 : 0);
    return body.insert_on_edge(a, b, s);
  }

  /// Puts a particle on the host's edge b → c, which faces the anchor; the right half goes to the right copy of the anchor.
  template <class Body>
  int insert_facing(Body& body, int b, int c, typename Body::Scalar s) {
    int const n = insert_on_edge(body, b, c, s);
    if (is_open()) attach_triangle(body, body.tissue().surface().triangle_with_edge(b, n), right_);
    return n;
  }

  /// Hangs a triangle on one copy of the anchor.
  template <class Body>
  void attach_triangle(Body& body, int t, int copy) {
    int const other = copy == left_ ? right_ : left_;
    if (other != copy && body.tissue().surface().corner_of(t, other) >= 0) body.change_corner(t, other, copy);
  }

  /// Opens the anchor while the blade is in the host. The host is not divided: it hangs on one copy, the left one if it can, and its edge to the other
  /// side is open to the end. Where each side would leave a particle with two fans or none, the anchor is closed again; false if it can not be.
  template <class Body>
  bool open(Body& body, int host) {
    bool const opens = !is_open() && finds_fan(body, host);
    if (opens) part(body), hang_fan(body);
    if (!is_open()) return true;
    if (!has_one_fan_each(body, host, right_, 1)) {
      attach_triangle(body, host, right_);
      if (!has_one_fan_each(body, host, left_, 2)) {
        attach_triangle(body, host, left_);
        bool const closes = can_close(body);
        if (closes) close(body);
        return closes;
      }
    }
    if (opens) body.balance_copies(left_, right_), open_behind(body);
    return true;
  }

  /// Divides the host at barycentric weights, and opens the anchor up to there: what lies to the right of the line from the anchor to the new particle
  /// hangs on the right copy, the rest on the left one.
  template <class Body>
  void divide(Body& body, int host, VectorOf<Body> const& w) {
    auto const& surface = body.tissue().surface();
    bool const opens = !is_open() && finds_fan(body, host);
    if (opens) part(body);
    int const end = insert_in_triangle(body, host, w);
    if (!is_open()) return;
    if (opens) hang_fan(body);
    attach_triangle(body, surface.triangle_with_edge(end, left_), right_);
    if (opens) body.balance_copies(left_, right_), open_behind(body);
    body.balance_copies(left_, right_);
  }

  /// Makes the edge from the anchor to `next` a cut, and `next` the anchor.
  template <class Body>
  void join(Body& body, int next) {
    bool open = is_open();
    int const anchor = left_;
    if (open)
      body.balance_copies(left_, right_);
    else if ((open = separate(body, anchor, came_from_, next)))
      open_behind(body);
    came_from_ = open ? -1 : anchor;
    place(next), body.advance_cut_epoch();
    if (separate(body, next, came_from_, -1)) came_from_ = -1;
  }

  /// Whether there is something to cut between an open anchor and a corner of the host: triangles on both sides.
  template <class Body>
  bool can_cut_to(Body const& body, int host, int corner) const noexcept {
    auto const& surface = body.tissue().surface();
    std::size_t const a = corner_in(body, host);
    bool const is_right = surface.corners(host)[(a + 2) % 3] == corner;
    int const other = is_right ? left_ : right_;
    return !is_open() || surface.triangles_at(other).size() > (surface.corners(host)[a] == other ? 1u : 0u);
  }

  /// Cuts the edge from the anchor to a corner of the host; the corner is the next anchor. False when there is nothing to cut: the edge
  /// is a border, a lip, or the way the path came.
  template <class Body>
  bool cut_to(Body& body, int host, int corner) {
    bool const cuts = can_cut_to(body, host, corner);
    if (is_open()) {   // the host hangs on the left copy; if it lies to the right of the edge, it changes sides
      if (body.tissue().surface().triangle_with_edge(corner, left_) == host) attach_triangle(body, host, right_);
      if (!cuts) close(body);
    }
    join(body, corner);
    return cuts;
  }

  /// Whether the edge of the host from an open anchor to this corner is a lip.
  template <class Body>
  bool is_lip(Body const& body, int host, int corner) const noexcept {
    auto const& surface = body.tissue().surface();
    if (!is_open()) return false;
    bool const is_right = surface.corners(host)[(corner_in(body, host) + 1) % 3] == corner;
    return (is_right ? surface.triangle_with_edge(corner, right_) : surface.triangle_with_edge(left_, corner)) < 0;
  }

  /// Cuts the edge from the anchor to a corner of the host as far as s, counted from the start of the edge in the host, and makes that
  /// point the anchor. Where the edge is a lip already, the anchor closes instead.
  template <class Body>
  void cut_towards(Body& body, int host, int corner, typename Body::Scalar s) {
    auto const& surface = body.tissue().surface();
    bool const is_right = surface.corners(host)[(corner_in(body, host) + 1) % 3] == corner;   // edge and way lead from the anchor on
    int const copy = is_right ? right_ : left_;
    if (is_open()) {
      bool const is_lip_there = is_lip(body, host, corner);
      attach_triangle(body, host, copy);
      if (is_lip_there) {
        close(body);
        return;
      }
    }
    int const n = is_right ? insert_on_edge(body, copy, corner, s) : insert_on_edge(body, corner, copy, s);
    if (is_open()) attach_triangle(body, is_right ? surface.triangle_with_edge(copy, n) : surface.triangle_with_edge(n, copy), is_right ? left_ : right_);
    join(body, n);
  }

  /// Whether the anchor's copies can become one again: another blade has added nothing since they were parted, and none has come to stand on one.
  template <class Body>
  bool can_close(Body const& body) const noexcept {
    return !is_open() || (cut_epoch_ == body.cut_epoch() && std::max(left_, right_) == body.size() - 1);
  }

  /// Nothing is cut at the anchor after all: its copies become one again.
  template <class Body>
  void close(Body& body) {
    if (!is_open()) return;
    place(std::min(left_, right_));
    body.merge_last_particle(left_);
    report.particles_added -= 1;
    lips_.pop_back();
  }

  CutReport report;   ///< of the cut so far

 private:
  /// While the host hangs on the other one: whether this copy has triangles, and the host's corner on that side, the first or second after the anchor,
  /// one fan.
  template <class Body>
  bool has_one_fan_each(Body const& body, int host, int copy, std::size_t side) {
    auto const& surface = body.tissue().surface();
    int const corner = surface.corners(host)[(corner_in(body, host) + side) % 3];
    return !surface.triangles_at(copy).empty() && fan_at(body, corner).size() == surface.triangles_at(corner).size();
  }

  /// fan_to_the_right(), where other blades have left the anchor one fan: what they divide for the eye becomes permanent, and where one has cut to the
  /// anchor, the edge to where the path came from is open.
  template <class Body>
  bool finds_fan(Body& body, int host) {
    if (came_from_ >= 0 && separate(body, left_, came_from_, -1, host)) {
      open_behind(body);
      came_from_ = -1;
    }
    body.make_permanent_at(left_);
    return fan_to_the_right(body, host);
  }
  template <class Body>
  void part(Body& body) {
    right_ = body.split_particle(left_, {});
    cut_epoch_ = body.cut_epoch();
    lips_.push_back({left_, right_});
    report.particles_added += 1;
  }
  /// What lies to the right of the host goes to the right copy.
  template <class Body>
  void hang_fan(Body& body) {
    for (int const t : fan_) body.change_corner(t, left_, right_);
  }

  /// Collects the triangles around the anchor to the right of the host, up to a border or the cut edge; false if there is neither.
  /// Finds where the fan ends to the right and to the left.
  template <class Body>
  bool fan_to_the_right(Body const& body, int host) {
    auto const& surface = body.tissue().surface();
    fan_.clear();
    for (int t = host;;) {
      right_end_ = surface.corners(t)[static_cast<std::size_t>((surface.corner_of(t, left_) + 1) % 3)];
      if (right_end_ == came_from_) break;
      t = surface.triangle_with_edge(right_end_, left_);
      if (t < 0) break;
      if (t == host) return false;
      fan_.push_back(t);
    }
    for (int t = host; t >= 0;) {
      left_end_ = surface.corners(t)[static_cast<std::size_t>((surface.corner_of(t, left_) + 2) % 3)];
      t = left_end_ == came_from_ ? -1 : surface.triangle_with_edge(left_, left_end_);
    }
    return true;
  }

  /// The edge to where the path came from, still closed until now, is open at the anchor. Where another blade has cut to its other end
  /// meanwhile, there is a fan more.
  template <class Body>
  void open_behind(Body& body) {
    if (came_from_ >= 0) separate(body, came_from_, -1, -1);
  }

  /// Splits a particle into one copy per connected fan of triangles; the edges to `cut_a` and `cut_b` do not connect. The fan of `stays` is not split off.
  template <class Body>
  bool separate(Body& body, int particle, int cut_a, int cut_b, int stays = -1) {
    auto const around = [&] { return body.tissue().surface().triangles_at(particle); };
    body.make_permanent_at(particle);
    bool split = false;
    while (fan_at(body, particle, stays, cut_a, cut_b).size() != around().size()) {
      if (stays >= 0) {
        auto const here = around();
        fan_at(body, particle, *std::find_if(here.begin(), here.end(), [&](int t) { return std::find(fan_.begin(), fan_.end(), t) == fan_.end(); }), cut_a, cut_b);
      }
      lips_.push_back({particle, body.split_particle(particle, fan_)});
      report.particles_added += 1;
      split = true;
    }
    return split;
  }

  /// The triangles at a particle that hang together with one, or with the first; the edges to `cut_a` and `cut_b` do not connect.
  template <class Body>
  std::vector<int> const& fan_at(Body const& body, int particle, int first = -1, int cut_a = -1, int cut_b = -1) {
    auto const& surface = body.tissue().surface();
    fan_.clear();
    auto const around = surface.triangles_at(particle);
    if (around.empty()) return fan_;
    auto const corner_after = [&](int t, int k) { return surface.corners(t)[static_cast<std::size_t>((surface.corner_of(t, particle) + k) % 3)]; };
    auto const is_cut = [&](int corner) { return corner == cut_a || corner == cut_b; };
    if (first < 0) first = around.front();
    for (int t = first; t >= 0 && (t != first || fan_.empty());) {   // round the particle with the clock, up to an edge that does not connect
      fan_.push_back(t);
      int const ahead = corner_after(t, 1);
      t = is_cut(ahead) ? -1 : surface.triangle_with_edge(ahead, particle);
    }
    for (int t = first; fan_.size() < around.size();) {   // and against it
      int const behind = corner_after(t, 2);
      t = is_cut(behind) ? -1 : surface.triangle_with_edge(particle, behind);
      if (t < 0 || t == fan_.back()) break;
      fan_.push_back(t);
    }
    return fan_;
  }

  std::vector<std::array<int, 2>> lips_;
  std::vector<int> fan_;
  int left_ = -1;        // the copy to the left of the path ahead; the same as right_ while it is one
  int right_ = -1;
  int left_end_ = -1;    // while it is open: where its fan of triangles ends
  int right_end_ = -1;
  int came_from_ = -1;   // the other end of the last cut edge, if that edge is still closed
  std::size_t cut_epoch_ = 0;   // of the body, when the copies were parted
};

}  // namespace palpate::detail
