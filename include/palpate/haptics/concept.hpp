// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/device/capabilities.hpp>
#include <palpate/force/concept.hpp>
#include <palpate/haptics/local_model.hpp>
#include <palpate/haptics/workspace_mapping.hpp>

#include <concepts>

namespace palpate {

/// Input of an overlay in one servo tick, also in free space, where a force model is not asked.
/// Units      tip [m], velocity [m/s], seconds [s]; world frame.
template <RealScalar S>
struct ToolMotion {
  using Scalar = S;

  Vector3<S> tip = Vector3<S>::Zero();
  Vector3<S> velocity = Vector3<S>::Zero();
  S seconds = S(0.001);     ///< since the last servo tick
  bool continues = false;   ///< it was asked in the tick before; false at first, and after a tick in which nothing was to be felt
  bool fresh = true;        ///< the device had a new sample; else the tip is still where the last one was
};

/// A force on the hand [N] that does not come from the tissue: guidance along a path, a forbidden region. Beyond the syntax: called once
/// a servo tick, so no allocation, lock, or input and output. A finite motion gives a finite force. Where `continues` is false the force
/// begins at zero.
template <class T, class Scalar>
concept ForceOverlay = RealScalar<Scalar> && requires(T& overlay, ToolMotion<Scalar> const& motion) {
  { overlay(motion) } noexcept -> detail::Vector3Of<Scalar>;
};

/// A force model with an overlay: the simulator adds `overlay(motion)` in every tick in which the hand may feel anything, after the
/// fading of a restoration and before the safety chain. On a device that moves a hand the passivity controller damps an overlay that
/// gives more than it took; one that stores energy states it: `energy()` [J].
template <class T, class Scalar>
concept HasOverlay = RealScalar<Scalar> && requires(T& model, ToolMotion<Scalar> const& motion) {
  { model.overlay(motion) } noexcept -> detail::Vector3Of<Scalar>;
};

/// Refinement: an overlay that states its elastic energy [J], which it may return without being active.
template <class T>
concept StoresEnergy = requires(T const& overlay) {
  { overlay.energy() } -> std::convertible_to<double>;
};

/// Refinement: a force model that states the elastic energy of its overlays [J].
template <class T>
concept HasOverlayEnergy = requires(T const& model) {
  { model.overlay_energy() } -> std::convertible_to<double>;
};

/// Refinement: a force that states its stiffness as the tool yields [N/m]: of the last `on_surface`, symmetric, positive semidefinite.
template <class T, class Scalar>
concept KnowsLoadStiffness = requires(T const& force) {
  { force.load_stiffness() } -> std::convertible_to<Matrix<Scalar, 3, 3>>;
};

/// Refinement: a force that needs local surface models: `begin_session(servo rate, model rate)` [Hz] tells how many ticks lie between
/// two.
template <class T>
concept SensesSurface = requires(T& model, T const& seen) {
  { seen.surface_kind() } -> std::same_as<SurfaceKind>;
  model.begin_session(1000.0, 500.0);
};

/// A force computed from the present surface, instead of a depth below the undisturbed one. Beyond the syntax: as of `ForceModel`; zero
/// soon after the surface's stiffness has become 0.
template <class T, class Scalar>
concept SurfaceForce = RealScalar<Scalar> && SensesSurface<T> && requires(T& model, LocalModel<Scalar> const& local, ToolMotion<Scalar> const& motion) {
  { model.on_surface(local, motion) } noexcept -> detail::Vector3Of<Scalar>;
};

/// Refinement: a force that states the largest stiffness [N/m, in the scene] that it renders, and accepts a lower limit. A simulator sets
/// it to what the device stands, seen through the mapping.
template <class T>
concept LimitsStiffness = requires(T& force, T const& constant, double stiffness) {
  { constant.max_stiffness() } noexcept -> std::convertible_to<double>;
  { force.limit_stiffness(stiffness) } noexcept;
};

/// A force policy of a simulator: a model of the depth, or one of the surface.
template <class T, class Scalar>
concept RendersForce = ForceModel<T, Scalar> || SurfaceForce<T, Scalar>;

namespace detail {

/// Says, where it is instantiated, what keeps T from being either.
template <class T, class Scalar>
struct ForceSentences {
  static constexpr bool is_force = RendersForce<T, Scalar>;   // else the compiler says at length why not
  static_assert(is_force,
                "Simulator: the force model must be callable, noexcept, with a ToolContact of the body's scalar and return a Vector3 of it in N; declare: Vector3<double> "
                "operator()(ToolContact<double> const& contact) noexcept; NoForce{} is one. A ProxyForce answers to the surface instead.");
};

}  // namespace detail

namespace detail {

// Members that have the names of refinements, whether they are them or not.
template <class T, class Scalar>
concept TakesMotion = requires(T& model, ToolMotion<Scalar> const& motion) { model.overlay(motion); };
template <class T>
concept NamesOverlay = TakesMotion<T, double> || TakesMotion<T, float>;
template <class T>
concept NamesOverlayEnergy = requires(T& model) { model.overlay_energy(); };
template <class T>
concept NamesStiffness = requires(T& force, double stiffness) { force.max_stiffness(), force.limit_stiffness(stiffness); };

/// Says, where it is instantiated, which members of T would not be called, because they are not quite those of a refinement.
template <class T, class Scalar>
struct ForceRefinements {
  static_assert(!NamesOverlay<T> || HasOverlay<T, Scalar>,
                "palpate: the force's overlay() may throw, or computes in another scalar than the body, and would not be felt; declare: Vector3<Scalar> overlay(ToolMotion<Scalar> "
                "const& motion) noexcept, in N.");
  static_assert(!NamesOverlayEnergy<T> || HasOverlayEnergy<T>, "palpate: the force's overlay_energy() would not be called; declare: double overlay_energy() const, in J.");
  static_assert(!NamesStiffness<T> || LimitsStiffness<T>,
                "palpate: the force's max_stiffness() or limit_stiffness() may throw, so that the device's limit would not reach it; declare: double max_stiffness() const noexcept; "
                "void limit_stiffness(double) noexcept, in N/m.");
};

}  // namespace detail

/// Refinement: a force that is told the device of each session and the mapping into the scene; local models come at `model_rate` [Hz].
template <class T, class Scalar>
concept BeginsSession = requires(T& model, Capabilities const& device, WorkspaceMapping<Scalar> const& mapping, double model_rate) {
  model.begin_session(device, mapping, model_rate);
};

}  // namespace palpate
