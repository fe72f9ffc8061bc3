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
///   table.move_to({.position = {0, 0, 0.01}}, 1e-3);   // in a step of 1 ms
///
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
    Matrix3X<Scalar> positions, velocities;
  };

  explicit Obstacle(TriangleMesh<Scalar> const& mesh) : Base(mesh, {.closed = true}) {
    for (int i = 0; i < size(); ++i) this->mark_nailed(i);
  }

  /// Where its mesh, turned about the origin and moved, is at the end of a step of h seconds; h = 0: it was there all the time.
  void move_to(ToolPose<Scalar> const& pose, Scalar h) {
    this->check_step(h);
    detail::require_pose("Obstacle", pose);
    Matrix<Scalar, 3, 3> const turn = pose.orientation.toRotationMatrix();
    for (int i = 0; i < size(); ++i) {
      Vector const rest = this->rest_[i], to = pose.position + turn * rest, from = this->x_[i];
      this->displace(i, Vector(to - rest), h > 0 ? Vector((to - from) / h) : Vector(Vector::Zero()));
    }
  }

  void apply_force(int i, Vector const& force) { this->check(i), this->check_force(i, force); }
  Report step(Scalar h) { return (this->check_step(h), Report{}); }
  Vector predicted_acceleration(int, Scalar) const noexcept { return Vector::Zero(); }
  Scalar mobility(int, int, Scalar) const noexcept { return 0; }

  State save() const { return {this->save_skin(), this->positions(), this->velocities()}; }
  void restore(State const& state) {
    for (int i = 0; i < size(); ++i) this->displace(i, Vector(state.positions.col(i) - this->rest_[i]), Vector(state.velocities.col(i)));
    this->restore_skin(state.skin);
  }
};

}  // namespace palpate
