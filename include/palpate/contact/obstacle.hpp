// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/rotation_vector.hpp>
#include <palpate/core/tool_pose.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/tissue/skin_body.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <utility>

namespace palpate {

/// A rigid body that no force moves: bone, a table, a probe that the host leads. A body for BodyContact, as a SoftBody is.
///
///   Obstacle table(surface(make_block<double>(3, 3, 2, 0.2)));
///   table.move_to({.position = {0, 0, 0.01}}, 1e-3), table.step(1e-3);   // there after 1 ms; a Scene steps it
///
/// Motion     evenly, in the steps that follow, and at rest when the time is over: the mesh's origin on a straight line, the turn about one axis, the shorter way.
///              x = p(t) + R(t) X,   v = p′ + ω × (x − p),   so it stays as it is however far it turns.
/// Units      m, s; world frame.
/// Errors     InvalidMesh for a mesh that is open or turned inside out, InvalidArgument for a pose.
template <RealScalar ScalarType>
class Obstacle : public SkinBody<ScalarType> {
  using Base = SkinBody<ScalarType>;

 public:
  using Scalar = ScalarType;
  using Vector = Vector3<Scalar>;
  using Base::size;

  struct Report {
    int moving = 0;
    explicit operator bool() const noexcept { return true; }
  };
  /// From one pose to another, world ← mesh.
  struct Motion {
    Vector from = Vector::Zero(), to = Vector::Zero();   // m
    Eigen::Quaternion<Scalar> from_turn = Eigen::Quaternion<Scalar>::Identity(), to_turn = Eigen::Quaternion<Scalar>::Identity();
    Scalar time = 0, gone = 0;                           // s, in all and so far
  };
  struct State {
    typename Base::SkinState skin;
    Motion motion;
  };

  explicit Obstacle(TriangleMesh<Scalar> const& mesh) : Base(mesh, {.closed = true}) {
    for (int i = 0; i < size(); ++i) this->mark_nailed(i);
  }

  /// Where its mesh, turned about the origin and moved, will be h seconds from now; h = 0: it is there, and was all the time.
  void move_to(ToolPose<Scalar> const& pose, Scalar h) {
    this->check_step(h);
    detail::require_pose("Obstacle", pose);
    auto const [at, turn] = pose_now();
    motion_ = {.from = at, .to = pose.position, .from_turn = turn, .to_turn = pose.orientation.normalized(), .time = h};
    place();
  }

  void apply_force(int i, Vector const& force) { this->check(i), this->check_force(i, force); }
  Report step(Scalar h) {
    this->check_step(h);
    if (!is_on_its_way()) return {};
    motion_.gone += h;
    if (motion_.time - motion_.gone < Scalar(1e-3) * h) motion_.gone = motion_.time;
    place();
    return {.moving = size()};
  }
  /// Stands where it will be h seconds from now, for bodies that take their steps before it; look_ahead(0) puts it back, to the byte.
  void look_ahead(Scalar h) noexcept {
    if (!is_on_its_way()) return;
    Scalar const gone = std::exchange(motion_.gone, std::min(motion_.gone + h, motion_.time));
    place();
    motion_.gone = gone;
  }
  Vector predicted_acceleration(int, Scalar) const noexcept { return Vector::Zero(); }
  Scalar mobility(int, int, Scalar) const noexcept { return 0; }

  State save() const { return {this->save_skin(), motion_}; }
  void restore(State const& state) {
    this->require_own(state.skin);
    motion_ = state.motion;
    place();
    this->restore_skin(state.skin);
  }

 private:
  bool is_on_its_way() const noexcept { return motion_.gone < motion_.time; }
  /// The whole turn of a motion [rad], in the world frame.
  Vector whole_turn() const noexcept { return rotation_vector<Scalar>(motion_.to_turn * motion_.from_turn.conjugate()); }
  std::pair<Vector, Eigen::Quaternion<Scalar>> pose_now() const noexcept {
    if (!is_on_its_way()) return {motion_.to, motion_.to_turn};
    Scalar const share = motion_.gone / motion_.time;
    return {motion_.from + share * (motion_.to - motion_.from), (rotation_of<Scalar>(share * whole_turn()) * motion_.from_turn).normalized()};
  }
  /// All vertices to where the motion has come: a function of that alone, so that a restored one goes on to the byte.
  void place() noexcept {
    auto const [at, turned] = pose_now();
    Matrix<Scalar, 3, 3> const rotation = turned.toRotationMatrix();
    Vector speed = Vector::Zero(), spin = Vector::Zero();
    if (is_on_its_way()) speed = (motion_.to - motion_.from) / motion_.time, spin = whole_turn() / motion_.time;
    for (int i = 0; i < size(); ++i) {
      Vector const rest = this->rest_[i], arm = rotation * rest;
      this->displace(i, Vector(at + arm - rest), Vector(speed + spin.cross(arm)));
    }
  }

  Motion motion_;
};

}  // namespace palpate
