// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/body/particle_order.hpp>
#include <palpate/body/soft_body.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/padded_columns.hpp>
#include <palpate/integrator/concept.hpp>
#include <palpate/integrator/conjugate_gradients.hpp>
#include <palpate/tissue/concept.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace palpate::detail {

/// How a body will move in its next step, and how it gives way to impulses: what a contact has to know. Of explicit bodies the particle's mass, or its mobility, says it.
template <SimulatedBody Body>
class FreeMotion {
 public:
  using Scalar = typename Body::Scalar;
  using Vector = Vector3<Scalar>;
  static constexpr bool solves = false;

  void begin(Body const&, Scalar) const noexcept {}
  /// m/s, of a particle at the end of a step of h seconds, with the forces applied so far.
  Vector velocity(Body const& body, int i, Scalar h) const {
    Vector const now = body.velocities().col(i);
    return own_mobility(body, i, h) > 0 ? Vector(now + h * Vector(body.predicted_acceleration(i, h))) : now;
  }
};

/// Of implicit bodies the whole body's stiffness says it: A = M + h C + h² K at the positions of now, as BackwardEuler has it.
///   velocity   v + A⁻¹ (h f(x, v) − h² K v)
///   respond    A⁻¹ r
/// Cost       one tangent a begin(), and conjugate gradients for it, to 1e-3, and for each response, to 1e-2, at most 100 iterations. Allocates after edits, and when nails or held particles change.
/// Limits     the whole body moves, whatever its region says.
template <class Tissue, class IntegratorType, class RegionType, class ExecutionType>
  requires ImplicitIntegrator<IntegratorType, typename Tissue::Scalar>
class FreeMotion<SoftBody<Tissue, IntegratorType, RegionType, ExecutionType>> {
  using Body = SoftBody<Tissue, IntegratorType, RegionType, ExecutionType>;

 public:
  using Scalar = typename Tissue::Scalar;
  using Vector = Vector3<Scalar>;
  static constexpr bool solves = true;

  void begin(Body const& body, Scalar h) {
    choose(body);
    h_ = h;
    if (chosen_.empty()) return;
    for (int k = 0; k < all(); ++k) x_[k] = body.positions().col(assembly_.particles()[at(k)]);
    assembly_.linearise(x_.padded_view(), inverse_mass_.data());
    assembly_.tangent_diagonal(Scalar(1), h, h * h, inverse_.padded_view().data());
    auto&& inverse = inverse_.padded_view();
    inverse = (inverse.array() > 0).select(inverse.array().inverse(), Scalar(0)).matrix();
    inverse.rightCols(all() - moving()).setZero();
    direction_.set_zero(), force_.set_zero(), velocity_.set_zero();
    for (int k = 0; k < moving(); ++k) direction_[k] = body.velocities().col(chosen_[at(k)]);
    for (int k = DampsByTangent<Tissue> ? moving() : 0; k < all(); ++k) velocity_[k] = body.velocities().col(assembly_.particles()[at(k)]);
    assembly_.multiply_tangent(Scalar(0), DampsByTangent<Tissue> ? h : Scalar(0), h * h, direction_.padded_view().data(), product_.padded_view().data());
    if constexpr (HasHistory<Tissue>) assembly_.take_history(body.tissue());
    auto force = force_.view();
    assembly_.add_forces(std::as_const(x_).view(), std::as_const(velocity_).view(), force);
    for (int k = 0; k < moving(); ++k) {
      Vector const pushed = Vector(force_[k]) + body.applied_force(chosen_[at(k)]) + body.gravity() / inverse_mass_[at(k)];
      residual_[k] = h * pushed - Vector(product_[k]);
    }
    solve(change_, Scalar(1e-3));
  }
  Vector velocity(Body const& body, int i, Scalar) const {
    Vector const now = body.velocities().col(i);
    int const k = place_[at(i)];
    return k >= 0 ? Vector(now + change_[k]) : now;
  }
  /// Changes of velocity of some particles [m/s] by impulses [N s]: to[n] of particle to_of(n).
  template <class Impulses, class ToOf>
  void respond(Impulses const& impulses, ToOf const& to_of, std::span<Vector> to) {
    std::fill(to.begin(), to.end(), Vector(Vector::Zero()));
    if (chosen_.empty()) return;
    residual_.set_zero();
    impulses([&](int particle, Vector const& impulse) {
      if (int const k = place_[at(particle)]; k >= 0) residual_[k] += impulse;
    });
    solve(response_, Scalar(1e-2));
    for (std::size_t n = 0; n < to.size(); ++n)
      if (int const k = place_[at(to_of(n))]; k >= 0) to[n] = response_[k];
  }

 private:
  static std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }
  int moving() const noexcept { return static_cast<int>(chosen_.size()); }
  int all() const noexcept { return static_cast<int>(assembly_.particles().size()); }

  void choose(Body const& body) {
    auto const& tissue = body.tissue();
    free_.clear();
    for (int i = 0; i < tissue.size(); ++i)
      if (!tissue.nailed(i) && !body.is_held(i)) free_.push_back(i);
    std::array const now{tissue.revision(), body.restorations()};   // a restore brings back a revision that another edit follows
    if (free_ == free_then_ && made_of_ == now) return;
    free_then_ = chosen_ = free_, made_of_ = now;
    ParticleOrder order;
    order.find(tissue), order.sort(chosen_);
    tissue.assemble(chosen_, assembly_);
    place_.assign(at(tissue.size()), -1), inverse_mass_.clear();
    for (int k = 0; k < moving(); ++k) place_[at(chosen_[at(k)])] = k, inverse_mass_.push_back(1 / tissue.mass(chosen_[at(k)]));
    for (auto* columns : {&x_, &velocity_, &force_, &inverse_, &residual_, &direction_, &product_, &change_, &response_}) columns->resize(0), columns->resize(all());
  }
  /// A to = residual_, which is spent, to this share of it. From zero: what is found depends on the body alone, also after a restore.
  void solve(PaddedColumns<Scalar>& to, Scalar tolerance) {
    auto&& change = to.padded_view();
    auto&& residual = residual_.padded_view();
    auto&& inverse = inverse_.padded_view();
    auto&& direction = direction_.padded_view();
    auto&& product = product_.padded_view();
    change.setZero();
    int left = 100, negative = 0;
    Scalar const enough = tolerance * tolerance * residual.cwiseProduct(residual).cwiseProduct(inverse).sum();
    conjugate_gradients<Scalar>([&](auto const& d, auto& out) { assembly_.multiply_tangent(Scalar(1), h_, h_ * h_, d.data(), out.data()); },
                                GradientColumns{inverse, change, residual, direction, product, product}, enough, left, negative);
  }

  typename Tissue::Assembly assembly_;
  std::vector<int> chosen_, free_, free_then_, place_;   // particles that move; place_: of each of the body among them, −1 of others
  std::vector<Scalar> inverse_mass_;         // 1/kg
  std::array<std::size_t, 2> made_of_{};     // revision and restorations
  PaddedColumns<Scalar> x_, velocity_, force_, inverse_, residual_, direction_, product_, change_, response_;
  Scalar h_ = 0;
};

}  // namespace palpate::detail
