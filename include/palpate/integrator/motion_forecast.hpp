// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/flush_denormals.hpp>
#include <palpate/integrator/concept.hpp>
#include <palpate/integrator/conjugate_gradients.hpp>
#include <palpate/integrator/theta_scheme.hpp>

#include <cmath>
#include <span>
#include <type_traits>

namespace palpate {

/// A spring from a particle to where its other end will be: it adds `inertia` [kg] to what resists a change of the particle's velocity, h (c + hθ k) for a
/// stiffness k and a damping c, and gives it `impulse` [N s] in the step.
template <RealScalar Scalar>
struct SpringOnParticle {
  int particle;
  Scalar inertia;
  Vector3<Scalar> impulse;
};

/// What the next implicit step of h seconds will do to a body, and how the body gives way in it, its particles together: A = M + hθ C + h²θ² K now.
///   respond(p)    u = A⁻¹ p, what impulses p [N s] change velocities by [m/s]: response(i)
///   along()       after respond(p): p·Δv [J], where Δv = A⁻¹ b is what the step does by itself, b = h f(x, v) − h²θ K v with the forces applied so
///                 far: as A is symmetric it is u·b, and Δv need not be found
///   solve(…)      Δv with springs that are in the step: response(i), which is of the last that was asked for
/// Units      SI, world frame; particles by the body's numbers, those that do not move have a response of zero.
/// Lifetime   until anything of the body changes, also by a force. It lives in the body's own memory: one at a time, and nothing is
///            allocated once a body has taken a step.
/// Source     \cite baraff1998.
/// Cost       the first in a step: the forces once, the tangent, which the step then has, and two products; a later one nothing of that. Each
///            call conjugate gradients from zero, at most 100 iterations: respond to 2 % of the residual, the error of p·u is the square of that,
///            and solve to 0.1 %.
template <class System>
class MotionForecast {
 public:
  using Scalar = typename System::Scalar;
  using Vector = Vector3<Scalar>;
  using Spring = SpringOnParticle<Scalar>;

  MotionForecast(System& system, Scalar h, Scalar theta) : system_(&system), theta_(theta), damping_(h * theta) {
    auto&& b = push();
    if (system.foresees(h)) {   // for another tool
      system.changes_of_pushes([&](int column, Vector const& by) { b.template block<3, 1>(0, column) += h * by; });
      return;
    }
    ThetaScheme{static_cast<double>(theta)}.begin(system, h);
    b = columns(ThetaScheme::residual_at);
    system.foresee(h);
  }

  /// for_each(add) calls add(particle, impulse).
  template <class Impulses>
  void respond(Impulses const& for_each) {
    auto&& residual = columns(ThetaScheme::residual_at);
    residual.setZero();
    for_each([&](int particle, Vector const& impulse) {
      if (int const k = system_->column_of(particle); k >= 0) residual.template block<3, 1>(0, k) += impulse;
    });
    find({}, Scalar(0.02));
  }
  Scalar along() { return columns(ThetaScheme::change_at).cwiseProduct(push()).sum(); }
  void solve(std::span<Spring const> springs) {
    auto&& residual = columns(ThetaScheme::residual_at);
    residual = push();
    for (Spring const& each : springs)
      if (int const k = system_->column_of(each.particle); k >= 0) residual.template block<3, 1>(0, k) += each.impulse;
    find(springs, Scalar(1e-3));
  }

  /// Whether a particle moves in the step that is foreseen. In a zone of influence one that was touched last does not yet.
  bool moves(int particle) const noexcept { return system_->column_of(particle) >= 0; }
  Scalar end_weight() const noexcept { return theta_; }
  Vector response(int particle) { return of(columns(ThetaScheme::change_at), particle); }
  /// b of a particle [N s]: what its velocity would change by, times its mass, if the others left it alone.
  Vector own(int particle) { return of(push(), particle); }

 private:
  static constexpr int held_at = 6, push_at = 9;   // the inverse with springs, b: what ThetaScheme leaves free before a step

  auto columns(int k) { return padded_view(system_->scratch(k)); }
  auto push() { return columns(push_at); }
  Vector of(auto const& from, int particle) const noexcept {
    int const k = system_->column_of(particle);
    return k >= 0 ? Vector(from.template block<3, 1>(0, k)) : Vector(Vector::Zero());
  }

  /// A, with the springs, times the response is the residual, to this share of it.
  void find(std::span<Spring const> springs, Scalar tolerance) {
    auto&& change = columns(ThetaScheme::change_at);
    auto&& residual = columns(ThetaScheme::residual_at);
    auto&& inverse = columns(springs.empty() ? ThetaScheme::inverse_at : held_at);
    auto&& product = columns(ThetaScheme::product_at);
    auto&& direction = columns(ThetaScheme::direction_at);
    auto&& scaled = columns(ThetaScheme::scaled_at);
    if (!springs.empty()) inverse = columns(ThetaScheme::inverse_at);
    for (Spring const& each : springs)
      if (int const k = system_->column_of(each.particle); k >= 0)
        for (int row = 0; row < 3; ++row) inverse(row, k) = 1 / (1 / inverse(row, k) + each.inertia);
    change.setZero();
    Scalar const size = residual.cwiseProduct(residual).cwiseProduct(inverse).sum();
    if (!std::isfinite(size)) return;
    int left = 100, negative = 0;
    FlushDenormals const flush;
    auto const multiply = [&](auto const& d, auto& out) {
      system_->multiply_tangent(Scalar(1), damping_, damping_ * damping_, d, out);
      for (Spring const& each : springs)
        if (int const k = system_->column_of(each.particle); k >= 0) out.col(k) += static_cast<std::remove_cvref_t<decltype(d(0, 0))>>(each.inertia) * d.col(k);
    };
    detail::GradientColumns const at{inverse, change, residual, direction, product, scaled};
    detail::conjugate_gradients(*system_, multiply, at, tolerance * tolerance * size, left, negative);
  }

  System* system_;
  Scalar theta_, damping_;   // s
};

}  // namespace palpate
