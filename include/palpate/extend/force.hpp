// SPDX-License-Identifier: MIT
#pragma once

/// A force of one's own, what the hand feels: all that it takes. The page to this header is docs/new_force.md.
///
/// Required, the concept ForceModel<Force, Scalar>; Scalar is the body's
///   Vector3<Scalar> operator()(ToolContact<Scalar> const& contact) noexcept      on the hand [N], world frame; may be const
///   zero where contact.phase is no_contact; in a servo tick: it may not allocate, lock, print or wait
/// Optional; static_assert(Resettable<MyForce>) finds a misspelt one; one that lacks its noexcept is refused
///   void reset()                                                  starts it anew                                       Resettable
///   void validate() const                                         throws InvalidArgument before the first tick         Validatable
///   static constexpr bool resists_before_puncture = true          CuttingForce adds no spring of its own               ContactLaw
///   Vector3<Scalar> overlay(ToolMotion<Scalar> const& motion) noexcept      also in free space: guidance               HasOverlay
///   double overlay_energy() const                                 J, what overlays have stored                         HasOverlayEnergy
///   void begin_session(Capabilities const&, WorkspaceMapping<Scalar> const&, double model_rate)   Hz                   BeginsSession
///   double max_stiffness() const noexcept; void limit_stiffness(double) noexcept     N/m                              LimitsStiffness
/// Instead of operator(), an answer to the surface as it is now: SurfaceKind surface_kind() const, begin_session(servo rate, model rate) [Hz]
/// and Vector3<Scalar> on_surface(LocalModel<Scalar> const&, ToolMotion<Scalar> const&) noexcept                        SurfaceForce
/// Parts of CuttingForce: Scalar operator()(Scalar depth) noexcept, or with a Phase besides, m → N (DepthCurve, HysteresisCurve);
/// Vector3<Scalar> draw(Vector3<Scalar> const& force) noexcept (ForceNoise)
/// Battery
///   testing::to_text(testing::check_force(MyForce{...})) == ""    of a ForceModel; palpate::check_curve reports on a curve

#include <palpate/core/policy.hpp>
#include <palpate/force/concept.hpp>
#include <palpate/force/curve_report.hpp>
#include <palpate/haptics/concept.hpp>
#include <palpate/testing/force.hpp>

namespace palpate::testing {

/// The least force: 100 N/m · depth along the normal.
template <RealScalar Scalar>
struct ForceArchetype {
  Vector3<Scalar> operator()(ToolContact<Scalar> const& contact) const noexcept {
    return contact.phase == CuttingPhase::no_contact || !(contact.depth > 0) ? Vector3<Scalar>::Zero() : Vector3<Scalar>(100 * contact.depth * contact.normal);
  }
};

}  // namespace palpate::testing
