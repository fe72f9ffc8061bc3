// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/cutting/concept.hpp>
#include <palpate/cutting/detail/blade_way.hpp>
#include <palpate/cutting/detail/edge_path.hpp>
#include <palpate/cutting/detail/rest_walk.hpp>
#include <palpate/cutting/detail/vertex_slide.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace palpate {

/// What a separating cut has done so far. It adds no triangles; vertex_vertex counts the edges it opened.
template <RealScalar Scalar>
struct SeparatingReport : CutReport {
  int particles_moved = 0;
  Scalar largest_move = 0;   ///< m, in the undeformed shape
  Scalar area_change = 0;    ///< m², of the undeformed surface
};

namespace detail {

/// The end of a cut along edges of the mesh.
///
/// The cut follows the blade to the vertex nearest to it, the *goal*, over the edges nearest to the blade's way. It stays one edge behind: when
/// the goal changes, the path from the cut's *end* is found anew and all of it but the last edge is cut; the rest when the blade
/// leaves. Each vertex is moved onto the blade's way and then falls into one copy per fan of triangles that the cut edges leave.
/// An edge between two inner vertices can not open: it waits in the *chain* until the cut goes on, and nothing has changed until then.
/// A call goes over so many edges at most. Where the blade has gone farther, the front is *behind*: it goes straight towards where the blade was, from
/// vertex to vertex and over wounds from copy to copy, and each call that follows cuts as far as it has come.
/// Where      everything is decided in the undeformed shape.
/// Source     \cite deformable_survey; one copy per fan, and only across the blade, is what \cite haaland leaves open.
/// Invariant  between calls every particle has one fan of triangles. Opened vertices lie on the border, and those are never moved: a
///            vertex moves at most once, and the lips stay together. A front that is behind by a length of n mean edges no longer is after 2n calls,
///            whatever others do to the body; where edges are far shorter than the mean, when it has gone over them.
template <RealScalar Scalar>
class SeparatingFront {
 public:
  using Vector = Vector3<Scalar>;

  SeparatingReport<Scalar> const& report() const noexcept { return report_; }
  std::vector<std::array<int, 2>> const& lips() const noexcept { return lips_; }

  /// The point of a triangle at the blade: the vertex nearest to it.
  template <class Body>
  TrianglePoint<Scalar> blade_point(Body const& body) const noexcept {
    return TrianglePoint<Scalar>::at_particle(body, goal_);
  }

  /// The cut has not come to where the blade was.
  bool is_behind() const noexcept { return is_behind_; }
  /// The blade is beside the surface, and the cut has gone on to the border there.
  bool is_outside() const noexcept { return is_outside_; }

  /// Punctures: the cut begins at the vertex nearest to a point of a triangle. `max_edges`: that a call goes over.
  template <class Body>
  void start(Body const& body, int triangle, Vector const& barycentric, int max_edges) {
    max_edges_ = max_edges;
    report_ = {};
    lips_.clear();
    restart(body, triangle, barycentric);
  }

  /// The blade moves to a point of a triangle. True when it changed the body. Not for a front that is behind, as leave() and enter().
  template <class Body>
  bool advance(Body& body, int triangle, Vector const& barycentric) {
    return go_to(body, {triangle, blade_at(body, triangle, barycentric), false});
  }

  /// A front that is behind goes on to where the blade was.
  template <class Body>
  void catch_up(Body& body) {
    target_.triangle = triangle_near(body, target_.triangle, target_.blade.point);   // others may have divided it
    go_to(body, target_);
    body.advance_cut_epoch();
  }

  /// The blade has left the surface over an edge of this triangle: the cut goes on to the border, and then along it without cutting.
  template <class Body>
  bool leave(Body& body, int triangle, Vector const& barycentric) {
    Target const to{triangle, blade_at(body, triangle, barycentric), true};
    if (!is_outside_) return go_to(body, to);
    int const goal = nearest_corner(body, to);
    if (goal == goal_) return false;
    way_.go_to(to.blade);
    goal_ = nearest_ = goal;
    begin_at(goal);
    way_.forget_before(way_.blade().point);
    return false;
  }

  /// The blade comes back onto the surface elsewhere. Beside a border the cut begins there. One whose border the cut has not come to, as
  /// it was behind, ends at the vertex nearest to the blade.
  template <class Body>
  bool enter(Body& body, int triangle, Vector const& barycentric) {
    bool const edited = !is_outside_ && go_on(body, 0);
    restart(body, triangle, barycentric);
    int const first = chain_.front();
    if (is_on_border(body, first)) return edited;
    int border = -1;
    Scalar nearest = std::numeric_limits<Scalar>::infinity();
    for_each_beside(body, first, [&](int q) {
      Scalar const squared = (body.tissue().rest_position(q) - puncture_).squaredNorm();
      if (squared < nearest && is_on_border(body, q)) nearest = squared, border = q;
    });
    if (border < 0) return edited;
    begin_at(border);
    return append(body, first) || edited;
  }

  /// The blade is lifted: the cut ends at the vertex nearest to it, or to where it has come if it is behind. An edge that waits then is not cut.
  template <class Body>
  void finish(Body& body) {
    is_behind_ = false;
    if (!chain_.empty()) go_on(body, 0);
    chain_.clear(), ends_.clear();
    goal_ = -1;
  }

 private:
  /// Where the cut is to come to.
  struct Target {
    int triangle = -1;
    BladePoint<Scalar> blade;
    bool leaves = false;   // the surface, over an edge of the triangle
  };

  template <class Body>
  static BladePoint<Scalar> blade_at(Body const& body, int t, Vector const& w) {
    return {rest_point(body, t, w), rest_normal(body, t, w)};
  }

  template <class Body>
  void restart(Body const& body, int triangle, Vector const& barycentric) {
    way_.start(blade_at(body, triangle, barycentric), body.mean_edge() / 4);
    puncture_ = way_.blade().point;
    goal_ = nearest_ = nearest_vertex(body, triangle, puncture_);
    begin_at(goal_);
    is_start_ = true;
    is_outside_ = is_behind_ = false;
  }

  void begin_at(int particle) {
    chain_.assign(1, particle);
    ends_.assign(1, particle);
    is_start_ = false;
  }

  bool is_end(int particle) const {
    if (chain_.size() > 1) return particle == chain_.back();
    return std::find(ends_.begin(), ends_.end(), particle) != ends_.end();
  }

  /// The vertex nearest to a point of a triangle: its nearest corner, and from there on along edges.
  template <class Body>
  static int nearest_vertex(Body const& body, int triangle, Vector const& point) {
    int best = -1;
    Scalar nearest = std::numeric_limits<Scalar>::infinity();
    for (int const p : body.tissue().surface().corners(triangle)) {
      Scalar const squared = (body.tissue().rest_position(p) - point).squaredNorm();
      if (squared < nearest) nearest = squared, best = p;
    }
    for (int from = -1; from != best;) {
      from = best;
      best = nearer_beside(body, from, from, point);
    }
    return best;
  }

  /// The particle beside p that is nearest to a point and nearer than `best`, or `best`.
  template <class Body>
  static int nearer_beside(Body const& body, int p, int best, Vector const& point) {
    Scalar nearest = (body.tissue().rest_position(best) - point).squaredNorm();
    for_each_beside(body, p, [&](int q) {
      Scalar const squared = (body.tissue().rest_position(q) - point).squaredNorm();
      if (squared < nearest) nearest = squared, best = q;
    });
    return best;
  }

  /// The same beside the other copies of p: beyond the wounds that it lies on.
  template <class Body>
  static int nearer_beyond(Body const& body, int p, Vector const& point) {
    int best = p;
    for (int copy = body.tissue().next_copy(p); copy != p; copy = body.tissue().next_copy(copy)) best = nearer_beside(body, copy, best, point);
    return best;
  }

  template <class Body>
  static int nearest_corner(Body const& body, Target const& to) {
    int most = 0;
    rest_weights(body, to.triangle, to.blade.point).maxCoeff(&most);
    return body.tissue().surface().corners(to.triangle)[static_cast<std::size_t>(most)];
  }

  // --- how the cut goes on ------------------------------------------------------------------------------------------
  /// As far as a call goes: to a point of the straight way to the target.
  struct Stage {
    BladePoint<Scalar> blade;
    int nearest = -1;       // the vertex nearest to it, or on the way there
    bool is_last = false;   // the target
  };

  template <class Body>
  bool go_to(Body& body, Target to) {
    BladeStretch<Scalar> const straight(way_.blade(), to.blade);
    Stage const stage = stage_towards(body, to.blade);
    is_behind_ = !stage.is_last;
    is_outside_ = stage.is_last && to.leaves;
    way_.go_to(stage.blade);
    int goal = -1;
    if (is_behind_) {
      target_ = to;
      nearest_ = stage.nearest;
      goal = goal_along(body, straight);
    } else {
      if (body.make_permanent_in(to.triangle) >= 0) to.triangle = triangle_near(body, to.triangle, to.blade.point);
      goal = nearest_ = to.leaves ? nearest_corner(body, to) : nearest_vertex(body, to.triangle, to.blade.point);
    }
    if (goal == goal_ && !is_outside_) return false;
    goal_ = goal;
    return go_on(body, is_outside_ ? 0 : 1);
  }

  /// Goes in half edges, each to the vertex nearest to there. Where a step has too many edges, as they are far shorter than the mean, it ends beside
  /// the vertex come to. A way that is too long for a call and leads over a wound ends beyond that first.
  template <class Body>
  Stage stage_towards(Body const& body, BladePoint<Scalar> const& to) const {
    BladePoint<Scalar> const from = way_.blade();
    Vector const way = to.point - from.point;
    Scalar const length = way.norm(), step = body.mean_edge() / 2;
    auto const on_way = [&](Scalar part) {
      return BladePoint<Scalar>{(1 - part) * from.point + part * to.point, ((1 - part) * from.normal + part * to.normal).normalized()};
    };
    Stage stage{from, nearest_}, beyond_wound;
    int edges = 0;
    Scalar before = 0;
    for (int steps = 1;; ++steps) {
      bool const is_end = !(Scalar(steps) * step < length);
      Scalar const part = is_end ? Scalar(1) : Scalar(steps) * step / length;
      stage.blade = is_end ? to : on_way(part);
      bool crosses = false, arrived = false;
      while (true) {
        int next = nearer_beside(body, stage.nearest, stage.nearest, stage.blade.point);
        bool const is_across = next == stage.nearest;
        if (is_across) next = nearer_beyond(body, stage.nearest, stage.blade.point);
        arrived = next == stage.nearest;
        if (arrived || edges == max_edges_) break;
        crosses = crosses || is_across;
        stage.nearest = next;
        ++edges;
      }
      if (arrived && is_end) return {to, stage.nearest, true};
      if (!arrived && length > 0) {
        Scalar const beside = way.dot(body.tissue().rest_position(stage.nearest) - from.point) / (length * length);
        stage.blade = on_way(std::clamp(beside, before, part));
      }
      if (crosses && beyond_wound.nearest < 0) beyond_wound = stage;
      if (edges == max_edges_ || steps / 2 == max_edges_) return beyond_wound.nearest < 0 ? stage : beyond_wound;
      before = part;
    }
  }

  /// The goal of a blade that is on its way: the vertex nearest to it. Where the surface ends that one lies beside the way: then it is the one on
  /// the other side, or stays until the blade is there.
  template <class Body>
  int goal_along(Body const& body, BladeStretch<Scalar> const& straight) {
    auto const is_along = [&](int p) {
      return straight.squared_distance(body.tissue().rest_position(p)) <= EdgePath<Scalar>::longest_squared(body, p);
    };
    if (is_along(nearest_)) return nearest_;
    Vector const& point = way_.blade().point;
    int const beyond = nearest_vertex(body, target_.triangle, point);
    auto const distance = [&](int p) { return (body.tissue().rest_position(p) - point).squaredNorm(); };
    return is_along(beyond) && distance(beyond) < distance(nearest_) ? nearest_ = beyond : goal_;
  }

  /// Cuts towards the goal, up to so many edges before it. Where a wound or a gap lies between, the cut goes to the border on this side and
  /// on from the border on the other.
  template <class Body>
  bool go_on(Body& body, std::size_t left_over) {
    if (is_end(goal_)) return false;
    std::array<int, 1> const last{chain_.back()};
    std::span<int const> const starts = chain_.size() > 1 ? std::span<int const>(last) : std::span<int const>(ends_);
    if (path_.find(body, way_, starts, goal_)) return follow(body, left_over);
    bool edited = false;
    if (path_.find_border(body, way_.blade().point)) edited = follow(body, 0);
    int const behind = chain_.back();
    std::array<int, 1> const ahead{goal_};
    if (path_.find(body, way_, ahead, behind) || path_.find_border(body, body.tissue().rest_position(behind))) {
      path_.reverse();
      begin_at(path_.particles().front());
      return follow(body, left_over) || edited;
    }
    begin_at(goal_);
    way_.forget_before(way_.blade().point);
    return edited;
  }

  template <class Body>
  bool follow(Body& body, std::size_t left_over) {
    auto const& path = path_.particles();
    if (chain_.size() == 1 && chain_.front() != path.front()) begin_at(path.front());
    bool edited = false;
    for (std::size_t i = 1; i + left_over < path.size(); ++i) edited = append(body, path[i]) || edited;
    if (path.size() > 1 + left_over) way_.forget_before(body.tissue().rest_position(chain_.back()));
    return edited;
  }

  /// Goes on to a vertex beside the end. Along a border there is nothing to cut.
  template <class Body>
  bool append(Body& body, int next) {
    if (auto const known = std::find(chain_.begin(), chain_.end(), next); known != chain_.end()) {   // back the way it came
      chain_.erase(known + 1, chain_.end());
      return false;
    }
    if (chain_.size() == 1)
      for (int const end : ends_)
        if (is_beside(body, end, next)) chain_.front() = end;
    int const end = chain_.back();
    if (chain_.size() == 1 && is_open_edge(body, end, next)) {
      begin_at(next);
      return false;
    }
    chain_.push_back(next);
    if (chain_.size() == 2 && !is_on_border(body, next) && !is_on_border(body, end)) return false;
    open_chain(body);
    return true;
  }

  template <class Body>
  void open_chain(Body& body) {
    for (int const particle : chain_) body.make_permanent_at(particle);   // other blades'
    for (std::size_t i = 0; i < chain_.size(); ++i) {
      if (!is_movable(body, chain_[i])) continue;
      Vector const at = body.tissue().rest_position(chain_[i]);
      note(VertexSlide<Scalar>::move(body, chain_[i], i == 0 && is_start_ ? Vector(puncture_ - at) : way_.onto(at)));
    }
    for (std::size_t i = 0; i < chain_.size(); ++i)
      separate(body, chain_[i], i > 0 ? chain_[i - 1] : -1, i + 1 < chain_.size() ? chain_[i + 1] : -1);
    report_.vertex_vertex += static_cast<int>(chain_.size()) - 1;
    chain_.erase(chain_.begin(), chain_.end() - 1);
    is_start_ = false;
  }

  /// Lips and borders stay, and what is nailed or held.
  template <class Body>
  static bool is_movable(Body const& body, int p) {
    return !body.tissue().nailed(p) && !is_on_border(body, p) && !body.is_held(p);
  }

  void note(Slide<Scalar> const& slide) {
    if (!(slide.moved > 0)) return;
    ++report_.particles_moved;
    report_.largest_move = std::max(report_.largest_move, slide.moved);
    report_.area_change += slide.area_change;
  }

  /// Splits a particle into one copy per connected fan of triangles; the edges to `cut_a` and `cut_b` do not connect. They are the ends.
  template <class Body>
  void separate(Body& body, int particle, int cut_a, int cut_b) {
    auto const& surface = body.tissue().surface();
    ends_.assign(1, particle);
    while (true) {
      auto const around = surface.triangles_at(particle);
      fan_.assign(1, around.front());
      for (std::size_t i = 0; i < fan_.size(); ++i) {
        auto const c = surface.corners(fan_[i]);
        auto const k = static_cast<std::size_t>(surface.corner_of(fan_[i], particle));
        int const ahead = c[(k + 1) % 3], behind = c[(k + 2) % 3];
        auto const go_on = [&](int across, int t) {
          if (across != cut_a && across != cut_b && t >= 0 && std::find(fan_.begin(), fan_.end(), t) == fan_.end()) fan_.push_back(t);
        };
        go_on(ahead, surface.triangle_with_edge(ahead, particle));
        go_on(behind, surface.triangle_with_edge(particle, behind));
      }
      if (fan_.size() == around.size()) return;
      int const copy = body.split_particle(particle, fan_);
      lips_.push_back({particle, copy});
      ends_.push_back(copy);
      ++report_.particles_added;
    }
  }

  SeparatingReport<Scalar> report_;
  std::vector<std::array<int, 2>> lips_;
  EdgePath<Scalar> path_;
  std::vector<int> chain_;   // the end of the cut, last; before it the vertices whose edges wait to be opened
  std::vector<int> ends_;    // the copies of the end, while nothing waits
  std::vector<int> fan_;
  int goal_ = -1;            // the vertex nearest to the blade
  int nearest_ = -1;         // the same; beside a border that the blade goes on beyond, off its way
  int max_edges_ = 1;       // that a call goes over
  bool is_behind_ = false;
  Target target_;            // of a front that is behind
  BladeWay<Scalar> way_;
  Vector puncture_ = Vector::Zero();
  bool is_outside_ = false;  // the blade is beside the surface
  bool is_start_ = false;    // the chain begins at the puncture
};

}  // namespace detail

}  // namespace palpate
