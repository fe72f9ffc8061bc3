// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/tool_pose.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/tissue/skin_body.hpp>

namespace palpate {

/// A rigid body that no force moves: bone, a table, a probe that the host leads. A body for BodyContact, as a SoftBody is.
///
///   Obstacle table(surface(make_block<double>(3, 3, 2, 0.2)));
///   table.move_to({.position = {0, 0, 0.01}}, 1e-3), table.step(1e-3);   // there after 1 ms; a Scene steps it
///
/// Motion     evenly, in the steps that follow, and at rest when the time is over.
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
  struct State {
    typename Base::SkinState skin;
    Matrix3X<Scalar> positions, velocities, target;
    Scalar left;
  };

  explicit Obstacle(TriangleMesh<Scalar> const& mesh) : Base(mesh, {.closed = true}) {
    for (int i = 0; i < size(); ++i) this->mark_nailed(i);
    target_ = this->positions();
  }

  /// Where its mesh, turned about the origin and moved, will be h seconds from now; h = 0: it is there, and was all the time.
  void move_to(ToolPose<Scalar> const& pose, Scalar h) {
    this->check_step(h);
    detail::require_pose("Obstacle", pose);
    Matrix<Scalar, 3, 3> const turn = pose.orientation.toRotationMatrix();
    left_ = h;
    for (int i = 0; i < size(); ++i) {
      target_.col(i) = pose.position + turn * Vector(this->rest_[i]);
      if (h > 0) this->v_[i] = (target_.col(i) - Vector(this->x_[i])) / h;
    }
    if (!(h > 0)) arrive();
  }

  void apply_force(int i, Vector const& force) { this->check(i), this->check_force(i, force); }
  Report step(Scalar h) {
    this->check_step(h);
    if (!(left_ > 0)) return {};
    left_ -= h;
    if (left_ < Scalar(1e-3) * h) return (arrive(), Report{.moving = size()});
    for (int i = 0; i < size(); ++i) this->displace(i, Vector(this->u_[i] + h * this->v_[i]));
    return {.moving = size()};
  }
  Vector predicted_acceleration(int, Scalar) const noexcept { return Vector::Zero(); }
  Scalar mobility(int, int, Scalar) const noexcept { return 0; }

  State save() const { return {this->save_skin(), this->positions(), this->velocities(), target_, left_}; }
  void restore(State const& state) {
    this->require_own(state.skin);
    for (int i = 0; i < size(); ++i) this->displace(i, Vector(state.positions.col(i) - this->rest_[i]), Vector(state.velocities.col(i)));
    target_ = state.target, left_ = state.left;
    this->restore_skin(state.skin);
  }

 private:
  void arrive() noexcept {
    left_ = 0;
    for (int i = 0; i < size(); ++i) this->displace(i, Vector(target_.col(i) - Vector(this->rest_[i])), Vector(Vector::Zero()));
  }

  Matrix3X<Scalar> target_;   // m
  Scalar left_ = 0;           // s, until it is there
};

}  // namespace palpate
