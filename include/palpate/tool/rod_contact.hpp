// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/body/pseudo_normal.hpp>
#include <palpate/collision/segment_triangle.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/tool_pose.hpp>
#include <palpate/tool/contact_forces.hpp>
#include <palpate/tool/tool_shape.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace palpate {

/// Where a triangle of the body is at a rod of a tool.
/// Units      m, N; world frame.
template <RealScalar Scalar>
struct RodTouch {
  int rod = -1;                                       ///< of the shape
  int triangle = -1;                                  ///< of the body's surface
  Scalar parameter = 0;                               ///< along the rod, from 0 to 1
  Vector3<Scalar> barycentric = Vector3<Scalar>::Zero();
  Vector3<Scalar> point = Vector3<Scalar>::Zero();    ///< of the triangle, nearest to the rod's axis
  Vector3<Scalar> on_axis = Vector3<Scalar>::Zero();  ///< of the axis, nearest to the triangle
  Vector3<Scalar> normal = Vector3<Scalar>::UnitZ();  ///< the way out of the tissue
  Scalar distance = 0;                                ///< of the axis from the triangle, not negative
  Scalar depth = 0;                                   ///< how far the rod is in the tissue there
  bool behind = false;                                ///< the axis is on the inner side, or goes through
  bool crosses = false;                               ///< it goes through
  bool acts = false;                                  ///< it is pushed: the rod came from outside
  Vector3<Scalar> force = Vector3<Scalar>::Zero();    ///< N, of the tissue on the tool in the last step
  Scalar pressed = 0, rubbed = 0;                     ///< N, sums of the sizes of its parts across and along the rod's surface: rubbed ≤ friction · pressed
};

struct LeavesNone {
  constexpr bool operator()(int, int) const noexcept { return false; }
};

/// The contact of a tool's deforming rods with a body, along their whole length.
///   advance(body, pose)     finds the triangles that are nearer to a rod's axis than its radius, for this pose
///   press(body, share, h)   pushes them out of the way in the body's next step; the tool is at this share of the way between the last two poses
/// A triangle is pushed at its point nearest to the axis, by barycentric weights, so that at the end of the step it is outside the rod: see ContactForces.
/// Tissue that the axis has gone through is pushed along its outward normal, as long as the rod was seen outside before: a triangle is taken up where the
/// rod comes to its outer side, also between two poses, or beside one that is pushed already. A rod that is placed in the tissue touches nothing until it
/// has been outside.
/// Units      m, N, s; world frame. Moments are about the tool's origin.
/// Cost       advance: one search of the body's tree a rod, and the triangles near it once for each half radius that it has gone, at most 64 times; press:
///            those once, and the sweeps over the contacts. No allocation once the lists have grown to what is touched.
/// Limits     A rod that goes more than 32 of its radii in a tick may pass thin tissue. The constraint of a step is linear: rotation within it leaves an
///            error of second order in the way of that step.
template <RealScalar Scalar>
class RodContact {
 public:
  using Vector = Vector3<Scalar>;
  using Pose = ToolPose<Scalar>;

  explicit RodContact(ToolShape<Scalar> shape, ContactOptions<Scalar> const& options = {}) : shape_(std::move(shape)), forces_(options) {
    shape_.validate();
    outside_.assign(shape_.rods.size(), 0);
  }

  ToolShape<Scalar> const& shape() const noexcept { return shape_; }
  ContactOptions<Scalar> const& options() const noexcept { return forces_.options(); }
  /// The triangles at the rods, in the order of rods and triangles. After advance(): all that are nearer to an axis than 1.01 radii, and those behind it
  /// that are pushed; after press(): within 1.5 radii.
  std::span<RodTouch<Scalar> const> touches() const noexcept { return touches_; }
  /// What the tissue does to the tool, of the last press(): force [N], and moment about the tool's origin [N m].
  Vector const& force() const noexcept { return force_; }
  Vector const& moment() const noexcept { return moment_; }
  Pose const& pose() const noexcept { return pose_; }
  /// The tool at a share of the way between the last two poses; above 1: beyond.
  Pose pose_at(Scalar share) const noexcept {
    Pose at = pose_;
    at.position = previous_.position + share * (pose_.position - previous_.position);
    at.orientation = previous_.orientation.slerp(share, pose_.orientation).normalized();
    at.opening = std::clamp(previous_.opening + share * (pose_.opening - previous_.opening), Scalar(0), Scalar(1));
    return at;
  }

  /// The tool at the begin and the end of the body's next step, at whose end it is at this share of the way since the last pose, and there: where the body's
  /// forces are those of a later time, begin and end are so much later. Before press().
  struct StepPoses {
    Pose begin, end, now;
    Scalar lead = 0;   // of the step
  };
  template <class Body>
  StepPoses step_poses(Scalar share) const noexcept {
    Scalar lead = 0;
    if constexpr (StatesForceTime<Body>) lead = static_cast<Scalar>(Body::force_time);
    Scalar const later = lead * (share - pressed_share_);
    return {.begin = pose_at(pressed_share_ + later), .end = pose_at(share + later), .now = pose_at(share), .lead = lead};
  }
  bool is_placed() const noexcept { return placed_; }

  /// Moves the tool. A pose that is not finite leaves it where it is.
  template <class Body>
  void advance(Body& body, Pose const& pose) {
    static_assert(SearchableBody<Body>,
                  "palpate: a tool needs a body with visit_triangles_in_box(low, high, visit), which calls visit(triangle); see SearchableBody.");
    if (body.restorations() != restorations_) reset();
    restorations_ = body.restorations();
    if (!is_finite(pose.position) || !(std::abs(pose.orientation.norm() - 1) < Scalar(0.01)) || !(pose.opening >= 0 && pose.opening <= 1)) return;
    previous_ = placed_ ? pose_ : pose;
    pose_ = pose;
    placed_ = true;
    pressed_share_ = 0;
    renumbered_ = revision_ != body.topology_revision();
    revision_ = body.topology_revision();
    Scalar const motion = collect(body);
    int const looks = static_cast<int>(std::clamp<Scalar>(std::ceil(2 * motion / min_radius()), 1, 64));
    for (int k = 1; k <= looks; ++k) look(body, pose_at(Scalar(k) / Scalar(looks)), Scalar(0), touching);
  }

  /// Pushes the tissue in the body's next step of h seconds, at whose end the tool is at this share of the way since the last pose; returns the force on
  /// the tool [N]. leaves(rod, triangle): those that a rod does not push.
  template <class Body, class Leaves = LeavesNone>
  Vector press(Body& body, Scalar share, Scalar h, PinnedPoint<Scalar>* pin = nullptr, Leaves const& leaves = {}) {
    force_.setZero(), moment_.setZero();
    if (!placed_ || !(h > 0)) return force_;
    auto const [begin, end, now, lead] = step_poses<Body>(share);
    look(body, end, lead * h, coming);
    pressed_share_ = share;
    forces_.begin(), pushed_.clear();
    for (std::size_t i = 0; i < touches_.size(); ++i) {
      RodTouch<Scalar>& touch = touches_[i];
      touch.force.setZero(), touch.pressed = touch.rubbed = 0;
      if (!touch.acts || (pin != nullptr && touch.rod == pin->rod && (pin->through || touch.triangle == pin->triangle)) || leaves(touch.rod, touch.triangle)) continue;
      push(body, touch, i, begin, end);
      if (!touch.behind) push_ends(body, touch, i, begin, end, lead * h);
    }
    if (pin != nullptr) {
      Vector point = Vector::Zero();
      auto const corners = body.tissue().surface().corners(pin->triangle);
      for (std::size_t k = 0; k < 3; ++k) point += pin->barycentric[static_cast<int>(k)] * moved(body, corners[k], lead * h);
      forces_.add(corners, *pin, placed(end, pin->offset) - point, placed(end, pin->offset) - placed(begin, pin->offset));
    }
    if (!forces_.solve(body, h)) return force_;
    std::size_t k = 0;
    for (Pushed const& each : pushed_) {
      Vector const force = -forces_.force(k++);
      RodTouch<Scalar>& touch = touches_[each.touch];
      Scalar const across = force.dot(each.normal);
      touch.force += force, touch.pressed += across, touch.rubbed += (force - across * each.normal).norm();
      take(force, point_at(body, touch.triangle, each.barycentric), now);
    }
    if (pin != nullptr) {
      pin->force = -forces_.force(k);
      take(pin->force, point_at(body, pin->triangle, pin->barycentric), now);
    }
    return force_;
  }

  /// Forgets the contact: every rod has to come from outside again.
  void reset() noexcept {
    engaged_.clear(), touches_.clear(), candidates_.clear();
    outside_.assign(outside_.size(), 0);
    force_.setZero(), moment_.setZero();
    placed_ = false;
  }

  /// A point of the tissue as it is now [m].
  template <class Body>
  static Vector point_at(Body const& body, int triangle, Vector const& weights) {
    auto const corners = body.tissue().surface().corners(triangle);
    Vector point = Vector::Zero();
    for (std::size_t k = 0; k < 3; ++k) point += weights[static_cast<int>(k)] * body.positions().col(corners[k]);
    return point;
  }
  static Vector placed(Pose const& pose, Vector const& in_tool) noexcept { return pose.position + pose.orientation * in_tool; }

  /// Where a particle is after so many seconds, if it goes on as it does.
  template <class Body>
  static Vector moved(Body const& body, int i, Scalar seconds) {
    Vector const x = body.positions().col(i);
    if (!(seconds > 0)) return x;
    return x + seconds * body.velocities().col(i);
  }

 private:
  using Key = std::pair<int, int>;   // rod, triangle
  /// One contact that was pushed: of which touch, at which weights, and the way out there.
  struct Pushed {
    std::size_t touch;
    Vector barycentric, normal;
  };

  // Tissue that a rod carries lies at its surface, to rounding on either side. What is near may come within a step.
  static constexpr Scalar touching = Scalar(1.01), coming = Scalar(1.5);   // radii

  Capsule<Scalar> rod_at(int k, Pose const& pose) const noexcept { return shape_.rods[static_cast<std::size_t>(k)].at(pose.opening); }
  Scalar min_radius() const noexcept {
    Scalar least = std::numeric_limits<Scalar>::infinity();
    for (auto const& each : shape_.rods)
      if (each.use == RodUse::deforming) least = std::min(least, each.rod.radius);
    return least;
  }

  void take(Vector const& force, Vector const& at, Pose const& now) noexcept {
    force_ += force;
    moment_ += (at - now.position).cross(force);
  }

  template <class Body>
  void push(Body const& body, RodTouch<Scalar> const& touch, std::size_t index, Pose const& begin, Pose const& end) {
    auto const at = [&](Pose const& pose) {
      Capsule<Scalar> const rod = rod_at(touch.rod, pose);
      return placed(pose, rod.from + touch.parameter * (rod.to - rod.from));
    };
    forces_.add(body.tissue().surface().corners(touch.triangle), touch.barycentric, touch.normal, touch.depth, at(end) - at(begin));
    pushed_.push_back({index, touch.barycentric, touch.normal});
  }

  /// Where a rod lies along a triangle, one point would leave it free to tilt from step to step: it is pushed at the ends of their common stretch too.
  template <class Body>
  void push_ends(Body const& body, RodTouch<Scalar> const& touch, std::size_t index, Pose const& begin, Pose const& end, Scalar seconds) {
    Capsule<Scalar> const rod = rod_at(touch.rod, end);
    Vector const from = placed(end, rod.from), way = placed(end, rod.to) - from;
    auto const corners = body.tissue().surface().corners(touch.triangle);
    Vector const a = moved(body, corners[0], seconds), b = moved(body, corners[1], seconds), c = moved(body, corners[2], seconds);
    Scalar const length2 = way.squaredNorm();
    if (!(length2 > 0)) return;
    Vector const along(way.dot(a - from) / length2, way.dot(b - from) / length2, way.dot(c - from) / length2);
    for (Scalar const parameter : {std::clamp(along.minCoeff(), Scalar(0), Scalar(1)), std::clamp(along.maxCoeff(), Scalar(0), Scalar(1))}) {
      if (!(std::abs(parameter - touch.parameter) * std::sqrt(length2) > rod.radius / 2)) continue;
      RodTouch<Scalar> other = touch;
      other.parameter = parameter;
      other.on_axis = from + parameter * way;
      auto const foot = closest_point_on_triangle<Scalar>(other.on_axis, a, b, c);
      other.distance = std::sqrt(foot.squared_distance);
      if (!(other.distance < coming * rod.radius)) continue;
      other.barycentric = foot.barycentric / foot.barycentric.sum();
      other.normal = (other.on_axis - foot.point) / other.distance;
      other.depth = rod.radius - other.distance;
      if (other.normal.dot(touch.normal) > 0) push(body, other, index, begin, end);
    }
  }

  /// The triangles near the way of each rod from the last pose to this one. Returns how far the rods' ends have gone [m].
  template <class Body>
  Scalar collect(Body& body) {
    Scalar motion = 0;
    auto const ends = [&](std::size_t k, Pose const& pose) {
      Capsule<Scalar> const rod = rod_at(static_cast<int>(k), pose);
      return std::array{placed(pose, rod.from), placed(pose, rod.to)};
    };
    for (std::size_t k = 0; k < shape_.rods.size(); ++k)
      for (std::size_t end = 0; auto const& was : ends(k, previous_)) motion = std::max(motion, (ends(k, pose_)[end++] - was).norm());
    candidates_.clear();
    for (std::size_t k = 0; k < shape_.rods.size(); ++k) {
      if (shape_.rods[k].use != RodUse::deforming) continue;
      auto const now = ends(k, pose_), before = ends(k, previous_);
      Vector low = now[0], high = low;
      for (Vector const& corner : {now[1], before[0], before[1]}) low = low.cwiseMin(corner), high = high.cwiseMax(corner);
      Vector const margin = Vector::Constant(2 * shape_.rods[k].rod.radius + motion);
      body.visit_triangles_in_box(low - margin, high + margin, [&](int triangle) { candidates_.emplace_back(static_cast<int>(k), triangle); });
    }
    std::sort(candidates_.begin(), candidates_.end());
    return motion;
  }

  /// Which candidates are within so many radii of the rods for a pose, the body so many seconds ahead, and which of them act.
  template <class Body>
  void look(Body& body, Pose const& pose, Scalar seconds, Scalar reach) {
    touches_.clear();
    for (auto const& [rod, triangle] : candidates_) {
      if (triangle >= body.tissue().surface().triangle_count()) continue;   // taken away since
      RodTouch<Scalar> touch{.rod = rod, .triangle = triangle};
      if (measure(body, pose, seconds, reach, touch)) touches_.push_back(touch);
    }
    for (std::size_t k = 0; k < outside_.size(); ++k)
      if (outside_[k] == 0 && shape_.rods[k].use == RodUse::deforming) outside_[k] = is_outside(body, pose, static_cast<int>(k)) ? 1 : 0;
    for (auto& touch : touches_)
      touch.acts = outside_[static_cast<std::size_t>(touch.rod)] != 0 && (!touch.behind || was_engaged(touch) || renumbered_);
    renumbered_ = false;
    spread(body);
    kept_.clear();
    for (auto const& touch : touches_)
      if (touch.acts || (touch.behind && was_engaged(touch))) kept_.emplace_back(touch.rod, touch.triangle);
    engaged_.swap(kept_);
  }

  bool was_engaged(RodTouch<Scalar> const& touch) const noexcept {
    return std::binary_search(engaged_.begin(), engaged_.end(), Key{touch.rod, touch.triangle});
  }

  /// Where a triangle is at a rod; false where it is not near.
  template <class Body>
  bool measure(Body const& body, Pose const& pose, Scalar seconds, Scalar reach, RodTouch<Scalar>& touch) const {
    Capsule<Scalar> const rod = rod_at(touch.rod, pose);
    Vector const from = placed(pose, rod.from), to = placed(pose, rod.to);
    auto const corners = body.tissue().surface().corners(touch.triangle);
    Vector const a = moved(body, corners[0], seconds), b = moved(body, corners[1], seconds), c = moved(body, corners[2], seconds);
    auto const near = closest_points<Scalar>(from, to, a, b, c);
    touch.distance = std::sqrt(near.squared_distance);
    if (!std::isfinite(touch.distance) || !is_finite(near.barycentric)) return false;   // so far away that its square is no number
    if (!(touch.distance < reach * rod.radius) && !was_engaged(touch)) return false;
    touch.parameter = near.parameter, touch.barycentric = near.barycentric / near.barycentric.sum();
    touch.point = near.on_triangle, touch.on_axis = near.on_segment;
    Vector const facet = (b - a).cross(c - a);
    Scalar const area = facet.norm();
    if (!(area > 0)) return false;
    if (near.crosses || !(touch.distance > Scalar(1e-6) * rod.radius)) {   // through: out along the normal
      touch.normal = facet / area;
      touch.behind = touch.crosses = true;
      touch.depth = rod.radius + std::max(Scalar(0), -std::min(touch.normal.dot(from - a), touch.normal.dot(to - a)));
      return true;
    }
    Vector const out = (near.on_segment - near.on_triangle) / touch.distance;
    bool const on_face = near.barycentric.minCoeff() > 0;
    bool on_border = false;
    Scalar const above = on_face ? out.dot(facet) : out.dot(detail::pseudo_normal(body, touch.triangle, near.barycentric, on_border));
    touch.behind = !(above > 0);
    if (!touch.behind) {
      touch.normal = out;
      touch.depth = rod.radius - touch.distance;
      return touch.distance < reach * rod.radius;
    }
    touch.normal = -out;
    touch.depth = rod.radius + touch.distance;
    // At an edge or a corner the sign is sure where all triangles there agree; else a neighbour is nearer, and it is that one's to push.
    if (!on_face && (on_border || !all_below(body, touch.triangle, near.barycentric, out))) touch.depth = 0;
    return true;
  }

  /// Whether a direction points to the inner side of all triangles at a point of an edge or a corner.
  template <class Body>
  static bool all_below(Body const& body, int triangle, Vector const& weights, Vector const& direction) {
    auto const& surface = body.tissue().surface();
    auto const corners = surface.corners(triangle);
    for (std::size_t k = 0; k < 3; ++k) {
      if (!(weights[static_cast<int>(k)] > 0)) continue;
      for (int const t : surface.triangles_at(corners[k])) {
        bool meets = true;
        for (std::size_t i = 0; i < 3; ++i) meets = meets && (!(weights[static_cast<int>(i)] > 0) || surface.corner_of(t, corners[i]) >= 0);
        if (meets && !(detail::facet_normal(body, t).dot(direction) < 0)) return false;
      }
    }
    return true;
  }

  /// Whether a rod that was not outside yet is now: nothing is behind it, and its begin is in front of the surface nearest to it.
  template <class Body>
  bool is_outside(Body& body, Pose const& pose, int rod) const {
    for (auto const& touch : touches_)
      if (touch.rod == rod && touch.behind && touch.depth > 0) return false;
    Vector const begin = placed(pose, rod_at(rod, pose).from);
    auto const nearest = body.nearest_point(begin);
    if (!nearest.found()) return false;
    bool on_border = false;
    return (begin - nearest.point).dot(detail::pseudo_normal(body, nearest.triangle, nearest.barycentric, on_border)) > 0;
  }

  /// What is behind a rod beside a triangle that is pushed, and looks the same way, is pushed too.
  template <class Body>
  void spread(Body const& body) {
    auto const acts = [&](RodTouch<Scalar> const& touch, int triangle) {
      auto const other = std::lower_bound(touches_.begin(), touches_.end(), Key{touch.rod, triangle},
                                          [](RodTouch<Scalar> const& each, Key const& key) { return Key{each.rod, each.triangle} < key; });
      return other != touches_.end() && other->rod == touch.rod && other->triangle == triangle && other->acts && other->normal.dot(touch.normal) > 0;
    };
    for (bool changed = true; changed;) {
      changed = false;
      for (auto& touch : touches_) {
        if (touch.acts || !touch.behind || !(touch.depth > 0) || outside_[static_cast<std::size_t>(touch.rod)] == 0) continue;
        auto const corners = body.tissue().surface().corners(touch.triangle);
        for (std::size_t k = 0; k < 3 && !touch.acts; ++k)
          if (int const beyond = body.triangle_across(corners[k], corners[(k + 1) % 3]); beyond >= 0 && acts(touch, beyond)) touch.acts = changed = true;
      }
    }
    for (auto& touch : touches_)
      if (touch.behind && !(touch.depth > 0)) touch.acts = false;
  }

  ToolShape<Scalar> shape_;
  ContactForces<Scalar> forces_;
  Pose pose_{}, previous_{};
  std::vector<Key> candidates_, engaged_, kept_;
  std::vector<RodTouch<Scalar>> touches_;
  std::vector<Pushed> pushed_;
  std::vector<char> outside_;
  Vector force_ = Vector::Zero(), moment_ = Vector::Zero();
  Scalar pressed_share_ = 0;   // of the way since the last pose, up to the last press
  std::size_t restorations_ = 0, revision_ = 0;
  bool placed_ = false, renumbered_ = false;
};

}  // namespace palpate
