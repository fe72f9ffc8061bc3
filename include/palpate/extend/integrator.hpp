// SPDX-License-Identifier: MIT
#pragma once

/// An integrator of one's own: all that it takes. The page to this header is docs/new_integrator.md.
///
/// Required, together the concept Integrator<I, Scalar>; a step takes what the concept System says
///   template <class System> void step(System& system, typename System::Scalar h) const      h [s], const, in System::Scalar
///   copyable
/// Optional; static_assert(StatesOrder<MyRule>) finds a misspelt one
///   static constexpr int order                                    the error shrinks as h^order                      StatesOrder
///   template <RealScalar S> S stable_step(ModalBounds<S> const& modes) const   [s], infinity: none is needed        StatesStableStep
///     modes: squared_frequency, largest κ [1/s²], decay_rate and min_decay_rate, largest and smallest γ [1/s], of x″ = −κ x − γ x′
///   static constexpr double force_time                             forces are asked for at x + force_time · h v       HasForceTime
///   static constexpr bool fused_step = true                         a step is one call of step_by_parts               FusedStep
///   double end_weight() const                                     θ of an implicit θ-scheme: tools then foresee it    StatesEndWeight
///   a step that calls linearise(), multiply_tangent(): it takes a LinearisedSystem alone                            ImplicitIntegrator
/// Battery
///   testing::to_text(testing::check_integrator(MyRule{})) == ""   and static_assert(Integrator<MyRule, float>)
/// In use
///   SoftBody body(tissue, MyRule{}, WholeBody{});                 palpate/body/soft_body.hpp

#include <palpate/integrator/concept.hpp>
#include <palpate/testing/integrator.hpp>

namespace palpate::testing {

/// The least integrator: v⁺ = v + h a(x, v), x⁺ = x + h v⁺, and no word about order or stability.
struct IntegratorArchetype {
  template <class System>
  void step(System& system, typename System::Scalar h) const {
    system.velocities() += h * system.acceleration(system.positions(), system.velocities());
    system.positions() += h * system.velocities();
  }
};

}  // namespace palpate::testing
