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
/// Where      everything is decided in the undeformed shape.
/// Source     \cite deformable_survey; one copy per fan, and only across the blade, is what \cite haaland leaves open.
/// Invariant  between calls every particle has one fan of triangles. Opened vertices lie on the border, and those are never moved: a
///            vertex moves at most once, and the lips stay together.
template <RealScalar Scalar>
class SeparatingFront {
 public:
  using Vector = Vector3<Scalar>;

  SeparatingReport<Scalar> const& report() const noexcept { return report_; }
  std::vector<std::array<int, 2>> const& lips() const noexcept { return lips_; }

  /// The particle at the blade: the vertex nearest to it.
  template <class Body>
  int blade_particle(Body const&) const noexcept {
    return goal_;
  }

  /// Punctures: the cut begins at the vertex nearest to a point of a triangle.
  template <class Body>
  void start(Body const& body, int triangle, Vector const& barycentric) {
    report_ = {};
    lips_.clear();
    restart(body, triangle, barycentric);
  }

  /// The blade moves to a point of a triangle. True when it changed the body.
  template <class Body>
  bool advance(Body& body, int triangle, Vector const& barycentric) {
    is_outside_ = false;
    way_.go_to(blade_at(body, triangle, barycentric));
    int const goal = nearest_vertex(body, triangle, way_.blade().point);
    if (goal == goal_) return false;
    goal_ = goal;
    return go_on(body, 1);
  }

  /// The blade has left the surface over an edge of this triangle: the cut goes on to the border, and then along it without cutting.
  template <class Body>
  bool leave(Body& body, int triangle, Vector const& barycentric) {
    int most = 0;
    barycentric.maxCoeff(&most);
    int const goal = body.tissue().surface().corners(triangle)[static_cast<std::size_t>(most)];
    bool const has_left = !is_outside_;
    is_outside_ = true;
    if (!has_left && goal == goal_) return false;
    way_.go_to(blade_at(body, triangle, barycentric));
    goal_ = goal;
    if (has_left) return go_on(body, 0);
    begin_at(goal);
    way_.forget_before(way_.blade().point);
    return false;
  }

  /// The blade comes back onto the surface elsewhere. Beside a border the cut begins there.
  template <class Body>
  bool enter(Body& body, int triangle, Vector const& barycentric) {
    restart(body, triangle, barycentric);
    int const first = chain_.front();
    if (is_on_border(body, first)) return false;
    int border = -1;
    Scalar nearest = std::numeric_limits<Scalar>::infinity();
    for_each_beside(body, first, [&](int q) {
      Scalar const squared = (body.tissue().rest_position(q) - puncture_).squaredNorm();
      if (squared < nearest && is_on_border(body, q)) nearest = squared, border = q;
    });
    if (border < 0) return false;
    begin_at(border);
    return append(body, first);
  }

  /// The blade is lifted: the cut ends at the vertex nearest to it. An edge that waits then is not cut.
  template <class Body>
  void finish(Body& body) {
    if (!chain_.empty()) go_on(body, 0);
    chain_.clear(), ends_.clear();
    goal_ = -1;
  }

 private:
  template <class Body>
  static BladePoint<Scalar> blade_at(Body const& body, int t, Vector const& w) {
    return {rest_point(body, t, w), rest_normal(body, t, w)};
  }

  template <class Body>
  void restart(Body const& body, int triangle, Vector const& barycentric) {
    way_.start(blade_at(body, triangle, barycentric), body.mean_edge() / 4);
    puncture_ = way_.blade().point;
    goal_ = nearest_vertex(body, triangle, puncture_);
    begin_at(goal_);
    is_start_ = true;
    is_outside_ = false;
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
    auto const look = [&](int p) {
      if (body.is_temporary(p)) return;   // another blade's
      Scalar const squared = (body.tissue().rest_position(p) - point).squaredNorm();
      if (squared < nearest) nearest = squared, best = p;
    };
    for (int const p : body.tissue().surface().corners(triangle)) look(p);
    for (int from = -1; from != best;) {
      from = best;
      for_each_beside(body, from, look);
    }
    return best;
  }

  // --- how the cut goes on ------------------------------------------------------------------------------------------
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
    for (int const particle : chain_) body.keep_temporaries_at(particle);   // of other blades
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
    if (body.tissue().nailed(p) || is_on_border(body, p)) return false;
    if constexpr (requires { body.is_held(p); }) return !body.is_held(p);
    return true;
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
  BladeWay<Scalar> way_;
  Vector puncture_ = Vector::Zero();
  bool is_outside_ = false;  // the blade is beside the surface
  bool is_start_ = false;    // the chain begins at the puncture
};

}  // namespace detail

}  // namespace palpate
