// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/core/policy.hpp>
#include <palpate/force/concept.hpp>
#include <palpate/haptics/concept.hpp>

#include <utility>

namespace palpate {

/// A force model and an overlay, for a simulator: `Simulator(device, body, cutter, Overlaid(CuttingForce(…), PathGuidance(…)))`. Where the force
/// model has an overlay itself, both are added.
template <class Force, class Overlay>
class Overlaid {
  static_assert(ForceOverlay<Overlay, double> || ForceOverlay<Overlay, float>,
                "palpate::Overlaid: the second part is no overlay; declare: Vector3<Scalar> operator()(ToolMotion<Scalar> const& motion) noexcept, in N.");

 public:
  Overlaid(Force force, Overlay overlay) : force_(std::move(force)), over_(std::move(overlay)) {}

  /// The tissue's part.
  template <RealScalar Scalar>
    requires ForceModel<Force, Scalar>
  Vector3<Scalar> operator()(ToolContact<Scalar> const& contact) noexcept {
    require_overlay<Scalar>();
    return force_(contact);
  }
  template <RealScalar Scalar>
    requires ForceOverlay<Overlay, Scalar>
  Vector3<Scalar> overlay(ToolMotion<Scalar> const& motion) noexcept {
    if constexpr (HasOverlay<Force, Scalar>)
      return force_.overlay(motion) + over_(motion);
    else
      return over_(motion);
  }

  /// J, that the overlays hold elastically, where they say so with `energy()`: what they may give back without being active.
  double overlay_energy() const noexcept {
    double held = 0.0;
    if constexpr (StoresEnergy<Overlay>) held += static_cast<double>(over_.energy());
    if constexpr (HasOverlayEnergy<Force>) held += static_cast<double>(force_.overlay_energy());
    return held;
  }

  /// Where the force answers to the surface: see SurfaceForce.
  template <RealScalar Scalar>
    requires SurfaceForce<Force, Scalar>
  Vector3<Scalar> on_surface(LocalModel<Scalar> const& local, ToolMotion<Scalar> const& motion) noexcept {
    require_overlay<Scalar>();
    return force_.on_surface(local, motion);
  }
  SurfaceKind surface_kind() const noexcept
    requires SensesSurface<Force>
  {
    return force_.surface_kind();
  }
  void begin_session(double servo_rate, double model_rate)
    requires SensesSurface<Force>
  {
    force_.begin_session(servo_rate, model_rate);
  }
  double max_stiffness() const noexcept
    requires LimitsStiffness<Force>
  {
    return force_.max_stiffness();
  }
  void limit_stiffness(double most) noexcept
    requires LimitsStiffness<Force>
  {
    force_.limit_stiffness(most);
  }
  /// Where the force knows it: see KnowsLoadStiffness.
  auto load_stiffness() const noexcept
    requires(KnowsLoadStiffness<Force, double> || KnowsLoadStiffness<Force, float>)
  {
    return force_.load_stiffness();
  }
  /// Where the force wants to know the device: see BeginsSession.
  template <RealScalar Scalar>
    requires BeginsSession<Force, Scalar>
  void begin_session(Capabilities const& device, WorkspaceMapping<Scalar> const& mapping, double model_rate) {
    force_.begin_session(device, mapping, model_rate);
  }

  void validate() const {
    if constexpr (Validatable<Force>) force_.validate();
    if constexpr (Validatable<Overlay>) over_.validate();
  }
  void reset() noexcept {
    if constexpr (Resettable<Force>) force_.reset();
    if constexpr (Resettable<Overlay>) over_.reset();
  }

  Force& force() noexcept { return force_; }
  Force const& force() const noexcept { return force_; }
  Overlay& over() noexcept { return over_; }
  Overlay const& over() const noexcept { return over_; }

 private:
  /// One that is none would not be felt.
  template <RealScalar Scalar>
  static consteval void require_overlay() {
    static_assert(sizeof(detail::ForceRefinements<Force, Scalar>) > 0);
    static_assert(ForceOverlay<Overlay, Scalar>,
                  "palpate::Overlaid: the second part computes in another scalar than the body; it takes a ToolMotion<Scalar> of the body's.");
  }

  Force force_;
  Overlay over_;
};

}  // namespace palpate
