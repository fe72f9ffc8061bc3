// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/tool_pose.hpp>
#include <palpate/integrator/motion_forecast.hpp>
#include <palpate/tool/rod_contact.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <span>
#include <vector>

namespace palpate {

/// How jaws hold what is between them.
template <RealScalar Scalar>
struct GraspOptions {
  Scalar friction = Scalar(0.8);      ///< Coulomb, of the pads, which are toothed
  Scalar clamp_force = Scalar(3);     ///< N, with which each pad presses; closing jaws stop where the tissue presses back so
  Scalar stiffness = Scalar(1000);    ///< N/m, of all springs together
  Scalar damping = Scalar(2);         ///< N s/m, likewise
  Scalar width = Scalar(0.006);       ///< m, of the pads, along y

  void validate() const {
    detail::OptionCheck const check{"GraspOptions"};
    check.not_negative(".friction", static_cast<double>(friction));
    check.positive(".clamp_force", static_cast<double>(clamp_force), " N");
    check.positive(".stiffness", static_cast<double>(stiffness), " N/m");
    check.not_negative(".damping", static_cast<double>(damping), " N s/m");
    check.positive(".width", static_cast<double>(width), " m");
  }
};

/// A particle that jaws hold.
template <RealScalar Scalar>
struct GraspedParticle {
  int particle = -1;
  Vector3<Scalar> place = Vector3<Scalar>::Zero();   ///< m, in the tool's frame, where it was when it was grasped
  Vector3<Scalar> home = Vector3<Scalar>::Zero();    ///< m, of the undisturbed body
  Vector3<Scalar> seen = Vector3<Scalar>::Zero();    ///< m, where it was in the last step
  Matrix<Scalar, 3, 3> gradient = Matrix<Scalar, 3, 3>::Identity();   ///< of places in the tool's frame by homes, round it, when it was grasped
  Vector3<Scalar> force = Vector3<Scalar>::Zero();   ///< N, on the tool in the last step
};

/// Tissue between two jaws. Each particle of the surface there hangs on a spring whose other end goes with the tool, and closes with the jaws:
///   f = −k (x⁺ − a⁺) − c (v⁺ − v_a),   v⁺ = v + h (a_t + f/m),   x⁺ = x + h v⁺     on a particle; k and c are the total over the number grasped
/// and where the body forecasts its steps, as implicit ones do, x⁺ and v⁺ are those of a step of the body with all springs in it.
/// So it is the force of the end of the step, and at rest k (a − x) at any step. A particle is let go when its spring leaves the friction cone of its pads,
///   |f − f_n| ≤ friction · max(2 N, |f_n|)   with f_n the part across the pads and N its share of the clamp force: the sum of what two pads press with
/// The others then have its share. All are let go when a cut has gone through the tissue between the jaws: when what is grasped, with what cuts have added
/// to what was between the jaws, however far its load has drawn it out, falls into more pieces than before.
/// Cuts       a copy of a grasped particle is grasped too; one that is gone, or that nothing holds any more, is not.
/// Limits     Where several tools hold one particle, each knows in a step what those before it do, not those after it. So the last one prevails, the more the
///            longer the step, and the force of the others is not k (a − x) at rest.
/// Frame      the jaws close along x, the pads lie in y and z; the joint is at z > 0.
/// Units      m, N, s.
/// Source     \cite bielser2002 for what forceps do; the springs' law is the step's end, \cite baraff1998.
/// Cost       press: O(particles), and of a body that forecasts its steps the solution of one; no allocation. advance: O(1). Either, after a cut, and press where one slips:
///            O(new particles · grasped ones) more.
template <RealScalar Scalar>
class Grasp {
 public:
  using Vector = Vector3<Scalar>;
  using Pose = ToolPose<Scalar>;

  explicit Grasp(GraspOptions<Scalar> const& options) : options_(options) { options.validate(); }

  std::span<GraspedParticle<Scalar> const> particles() const noexcept { return held_; }
  bool holds_any() const noexcept { return !held_.empty(); }
  bool holds(int particle) const noexcept {
    return std::any_of(held_.begin(), held_.end(), [&](auto const& each) { return each.particle == particle; });
  }
  void release() noexcept { held_.clear(), let_go_.clear(); }
  /// Where the k-th is in the tool's frame now: its place closes with the jaws [m].
  Vector place(std::size_t k) const noexcept { return closing(held_[k].place); }

  /// Takes hold of the particles between two jaws for this pose; where there are none, of the corners of the triangle that passes there.
  template <class Body>
  void take(Body& body, Pose const& pose, std::array<Capsule<Scalar>, 2> const& jaws) {
    release();
    jaws_ = jaws, taken_at_ = std::max(pose.opening, Scalar(0.01)), squeeze_ = 1;
    auto const& surface = body.tissue().surface();
    Scalar const reach = jaws[1].from.norm() + (jaws[1].to - jaws[1].from).norm() + options_.width;
    Vector const centre = pose.position;
    std::array<int, 3> nearest{-1, -1, -1};
    Scalar least = std::numeric_limits<Scalar>::infinity();
    body.visit_triangles_in_box(centre - Vector::Constant(reach), centre + Vector::Constant(reach), [&](int t) {
      auto const corners = surface.corners(t);
      for (int const p : corners)
        if (is_between(in_tool(pose, body.positions().col(p)))) hold(body, pose, p);
      auto const near = closest_points<Scalar>(Vector::Zero(), jaws[1].to / 2, in_tool(pose, body.positions().col(corners[0])),
                                               in_tool(pose, body.positions().col(corners[1])), in_tool(pose, body.positions().col(corners[2])));
      if (near.squared_distance < least && is_between(near.on_triangle)) least = near.squared_distance, nearest = corners;
    });
    if (held_.empty() && nearest[0] >= 0)
      for (int const p : nearest) hold(body, pose, p);
    std::sort(held_.begin(), held_.end(), [](auto const& a, auto const& b) { return a.particle < b.particle; });
    held_.erase(std::unique(held_.begin(), held_.end(), [](auto const& a, auto const& b) { return a.particle == b.particle; }), held_.end());
    let_go_.reserve(4 * held_.size()), pulls_.reserve(4 * held_.size()), springs_.reserve(4 * held_.size());
    first_new_ = static_cast<int>(body.positions().cols());
    revision_ = body.topology_revision(), restorations_ = body.restorations();
    if constexpr (RenumbersParticles<Body>) renumberings_ = body.renumberings();
    pieces_ = count_pieces(body);
  }

  /// Once a tick: follows cuts, and the jaws.
  template <class Body>
  void advance(Body const& body, Pose const& pose) {
    if (restorations_ != body.restorations()) release();
    if (held_.empty()) return;
    std::array<Scalar, 2> pressed{}, rise{};   // N, that each half of the tissue presses its jaw with; by which that rises, if it does not give way, to full squeeze
    for (auto const& each : held_) {
      std::size_t const side = each.place.x() < 0 ? 0 : 1;
      pressed[side] += (side == 0 ? -1 : 1) * (pose.orientation.conjugate() * each.force).x();
      rise[side] += options_.stiffness / static_cast<Scalar>(held_.size()) * std::abs(each.place.x());
    }
    Scalar way = 0;
    for (std::size_t side = 0; side < 2; ++side)
      if (rise[side] > 0) way = std::max(way, (options_.clamp_force - pressed[side]) / rise[side]);
    Scalar const closed = std::min(pose.opening / taken_at_, Scalar(1));
    squeeze_ = std::max(closed, squeeze_ - way);
    look_for_cuts(body);
  }

  /// In the body's next step of h seconds. Adds what the tissue does to the tool, about the tool's origin.
  template <class Body>
  void press(Body& body, typename RodContact<Scalar>::StepPoses const& poses, Scalar h, Vector& force, Vector& moment) {
    if (h > 0) look_for_cuts(body);   // of tools that came later in this tick
    if (held_.empty() || !(h > 0)) return;
    Scalar const share = options_.clamp_force / static_cast<Scalar>(held_.size());
    Vector const across = poses.end.orientation * Vector::UnitX();
    find_pulls(body, poses, h);
    for (std::size_t n = 0; n < held_.size(); ++n) {
      auto& each = held_[n];
      int const i = each.particle;
      if (is_gone(body, i)) continue;
      Vector const on_tissue = pulls_[n];
      Scalar const normal = on_tissue.dot(across), along = (on_tissue - normal * across).norm();
      if (!(along <= options_.friction * std::max(2 * share, std::abs(normal))) || !is_finite(on_tissue)) {   // out of the cone
        let_go_.push_back(i);
        each.particle = -1;
        continue;
      }
      each.force = -on_tissue, each.seen = body.positions().col(i);
      body.apply_force(i, on_tissue);
      force += each.force;
      moment += (Vector(body.positions().col(i)) - poses.now.position).cross(each.force);
    }
    if (std::erase_if(held_, [](auto const& each) { return each.particle < 0; }) > 0) pieces_ = count_pieces(body);   // it may have been what joined them
  }

 private:
  /// Of the springs at the end of the step, on the tissue [N].
  template <class Body>
  void find_pulls(Body& body, typename RodContact<Scalar>::StepPoses const& poses, Scalar h) {
    Scalar const count = static_cast<Scalar>(held_.size()), k = options_.stiffness / count, c = options_.damping / count;
    pulls_.clear();
    for (auto const& each : held_) {   // if it went on at the velocity of now
      int const i = each.particle;
      if (is_gone(body, i)) {
        pulls_.push_back(Vector::Zero());
        continue;
      }
      Vector const anchor = placed(poses.end, each), way = anchor - placed(poses.begin, each), velocity = body.velocities().col(i);
      pulls_.push_back(-(k * (RodContact<Scalar>::moved(body, i, poses.lead * h) + h * velocity - anchor) + c * (velocity - way / h)));
    }
    if constexpr (ForecastsSteps<Body>)
      if (auto forecast = body.forecast(h); forecast && std::ranges::all_of(held_, [&](auto const& each) {
            return is_gone(body, each.particle) || detail::knows(*forecast, body, each.particle, h);
          })) {
        Scalar const resists = c + h * forecast->end_weight() * k;
        springs_.clear();
        for (std::size_t n = 0; n < held_.size(); ++n)
          if (!is_gone(body, held_[n].particle)) springs_.push_back({held_[n].particle, h * resists, h * pulls_[n]});
        forecast->solve(springs_);
        for (std::size_t n = 0; n < held_.size(); ++n)
          if (!is_gone(body, held_[n].particle)) pulls_[n] -= resists * forecast->response(held_[n].particle);
        return;
      }
    for (std::size_t n = 0; n < held_.size(); ++n) {
      int const i = held_[n].particle;
      if (Scalar const own = is_gone(body, i) ? Scalar(0) : detail::own_mobility(body, i, h); own > 0)
        pulls_[n] = (pulls_[n] - h * (c + h * k) * Vector(body.predicted_acceleration(i, h))) / (1 + h * (c + h * k) * own);
    }
  }
  /// Another tool's cut has given it back in this tick.
  static bool is_gone(auto const& body, int particle) noexcept { return particle >= static_cast<int>(body.positions().cols()); }

  static Vector in_tool(Pose const& pose, Vector const& point) noexcept { return pose.orientation.conjugate() * (point - pose.position); }

  /// Where a spring's end is [m]: it closes with the jaws.
  Vector placed(Pose const& pose, GraspedParticle<Scalar> const& each) const noexcept {
    return RodContact<Scalar>::placed(pose, closing(each.place));
  }
  Vector closing(Vector const& place) const noexcept { return {squeeze_ * place.x(), place.y(), place.z()}; }

  /// Whether a point of the tool's frame is between the pads, as wide open as they were, or just below them: tissue that the tips touch is a radius below.
  bool is_between(Vector const& p) const noexcept {
    Scalar const height = jaws_[1].to.z(), open = jaws_[1].from.x() * (1 - std::max(p.z(), Scalar(0)) / height);
    return p.z() >= -2 * jaws_[1].radius && p.z() <= height && std::abs(p.y()) <= options_.width / 2 && std::abs(p.x()) <= open;
  }

  /// About where a point of the undisturbed body was in the tool's frame when the jaws took hold: beside what is held, the more the nearer that is.
  Vector place_then(Vector const& home) const noexcept {
    Vector sum = Vector::Zero();
    Scalar weights = 0;
    for (auto const& each : held_) {
      Vector const off = home - each.home;
      Scalar const distance = off.squaredNorm() / (jaws_[1].radius * jaws_[1].radius);
      if (!(distance > 0)) return each.place;
      Scalar const weight = 1 / (distance * distance);
      sum += weight * (each.place + each.gradient * off), weights += weight;
    }
    return sum / weights;
  }

  template <class Body>
  void hold(Body const& body, Pose const& pose, int p) {
    held_.push_back({.particle = p, .place = in_tool(pose, body.positions().col(p)), .home = body.reference_position(p), .seen = body.positions().col(p)});
    Matrix<Scalar, 3, 3> const gradient = pose.orientation.conjugate().toRotationMatrix() * gradient_at(body, p);
    if (is_finite(gradient)) held_.back().gradient = gradient;
  }
  /// That which takes edges and normals of the undisturbed triangles at a particle to what they are now, in least squares.
  template <class Body>
  static Matrix<Scalar, 3, 3> gradient_at(Body const& body, int p) noexcept {
    auto const& surface = body.tissue().surface();
    Matrix<Scalar, 3, 3> across = Matrix<Scalar, 3, 3>::Zero(), own = across;   // m²
    for (int const t : surface.triangles_at(p)) {
      auto const c = surface.corners(t);
      std::array<Vector, 3> now, home;   // two edges, and the normal, as long as the undisturbed triangle is wide
      for (std::size_t k = 0; k < 2; ++k) {
        now[k] = Vector(body.positions().col(c[k + 1])) - Vector(body.positions().col(c[0]));
        home[k] = Vector(body.reference_position(c[k + 1])) - Vector(body.reference_position(c[0]));
      }
      now[2] = now[0].cross(now[1]), home[2] = home[0].cross(home[1]);
      Scalar const width = std::sqrt(home[2].norm());
      now[2] = width * now[2].normalized(), home[2] = width * home[2].normalized();
      for (std::size_t k = 0; k < 3; ++k) across += now[k] * home[k].transpose(), own += home[k] * home[k].transpose();
    }
    return across * own.inverse();
  }

  template <class Body>
  void look_for_cuts(Body const& body) {
    if (held_.empty() || revision_ == body.topology_revision()) return;
    revision_ = body.topology_revision();
    follow(body);
    int const pieces = count_pieces(body);
    if (pieces > pieces_) release();
    pieces_ = pieces;
  }

  /// Copies of what is held are held; what is gone is not. A number that a cut has given back and out again is another particle: its home tells.
  template <class Body>
  void follow(Body const& body) {
    int const size = static_cast<int>(body.positions().cols());
    first_new_ = std::min(first_new_, size);   // numbers that were given back since are handed out again
    bool is_renumbered = false;
    if constexpr (RenumbersParticles<Body>)
      if (renumberings_ != body.renumberings()) {
        for (auto each = held_.begin(); each != held_.end(); ++each) {   // what has its place at rest now, of several, on the lips of a wound, that which is nearest to where it was
          each->particle = size;
          Scalar least = std::numeric_limits<Scalar>::infinity();
          for (int n = 0; n < size; ++n)
            if (body.reference_position(n) == each->home && std::none_of(held_.begin(), each, [n](auto const& other) { return other.particle == n; }))
              if (Scalar const away = (Vector(body.positions().col(n)) - each->seen).squaredNorm(); away < least) least = away, each->particle = n;
        }
        renumberings_ = body.renumberings(), first_new_ = 0, is_renumbered = true;
        let_go_.clear();
      }
    auto const is_gone = [&](GraspedParticle<Scalar>& each) {
      if (each.particle >= size || body.tissue().surface().triangles_at(each.particle).empty()) return true;
      Vector const home = body.reference_position(each.particle);
      bool const is_another = each.particle >= first_new_ && home != each.home;
      each.home = home;
      return is_another;
    };
    std::erase_if(held_, is_gone);
    std::erase_if(let_go_, [&](int p) { return p >= size; });
    auto const is_apart = [&](int n, int p) {   // of those that any number may be: not a copy of now, but of the other lip
      return is_renumbered && !((Vector(body.positions().col(n)) - Vector(body.positions().col(p))).norm() <= jaws_[1].radius / 1000);
    };
    auto const count = held_.size();
    for (int n = first_new_; n < size; ++n)
      for (std::size_t k = 0; k < count; ++k)
        if (held_[k].particle != n && held_[k].home == body.reference_position(n) && !is_apart(n, held_[k].particle) && !holds(n) &&
            std::find(let_go_.begin(), let_go_.end(), n) == let_go_.end()) {
          GraspedParticle<Scalar> copy = held_[k];
          copy.particle = n;
          held_.push_back(copy);
          break;
        }
  }

  /// How many pieces the surface between the jaws is in: what is held, joined by triangles, and by particles there that cuts have added.
  template <class Body>
  int count_pieces(Body const& body) {
    if (held_.empty()) return 0;
    auto const& surface = body.tissue().surface();
    nodes_.clear();
    for (auto const& each : held_) nodes_.push_back(each.particle);
    for (int n = first_new_; n < static_cast<int>(body.positions().cols()); ++n)
      if (!holds(n) && is_between(place_then(body.reference_position(n)))) nodes_.push_back(n);
    std::sort(nodes_.begin(), nodes_.end());
    auto const place = [&](int p) {
      auto const found = std::lower_bound(nodes_.begin(), nodes_.end(), p);
      return found != nodes_.end() && *found == p ? static_cast<int>(found - nodes_.begin()) : -1;
    };
    root_.resize(nodes_.size());
    std::iota(root_.begin(), root_.end(), 0);
    auto const find = [&](int k) {
      while (root_[static_cast<std::size_t>(k)] != k) k = root_[static_cast<std::size_t>(k)];
      return k;
    };
    for (std::size_t k = 0; k < nodes_.size(); ++k)
      for (int const t : surface.triangles_at(nodes_[k]))
        for (int const p : surface.corners(t))
          if (int const other = place(p); other >= 0) root_[static_cast<std::size_t>(find(other))] = find(static_cast<int>(k));
    // Pieces that hold something: a splinter between the jaws that nothing holds is none.
    roots_.clear();
    for (auto const& each : held_) roots_.push_back(find(place(each.particle)));
    std::sort(roots_.begin(), roots_.end());
    return static_cast<int>(std::unique(roots_.begin(), roots_.end()) - roots_.begin());
  }

  GraspOptions<Scalar> options_;
  std::array<Capsule<Scalar>, 2> jaws_{};   // in the tool's frame, when they took hold
  Scalar taken_at_ = 1, squeeze_ = 1;       // the opening then; of the distance from the middle now
  std::vector<GraspedParticle<Scalar>> held_;
  std::vector<Vector> pulls_;                         // N, of each that is held
  std::vector<SpringOnParticle<Scalar>> springs_;
  std::vector<int> nodes_, root_, roots_, let_go_;
  int first_new_ = 0, pieces_ = 0;
  std::size_t revision_ = 0, restorations_ = 0, renumberings_ = 0;
};

}  // namespace palpate
