// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/device/concept.hpp>
#include <palpate/device/limit.hpp>
#include <palpate/force/contact.hpp>
#include <palpate/haptics/local_model.hpp>
#include <palpate/simulator/recording.hpp>

#include <concepts>
#include <cstdint>
#include <type_traits>
#include <utility>

namespace palpate {

/// What happened on the servo's side.
struct ServoCounts {
  std::uint64_t ticks = 0;
  std::uint64_t unread = 0;       ///< reads that failed or were not finite: the last pose was kept and the force was zero
  std::uint64_t unwritten = 0;    ///< writes that failed
  std::uint64_t not_finite = 0;   ///< forces that were not finite and became zero
  std::uint64_t limited = 0;      ///< forces shortened to the device's maximum
};

/// The hand's side of a simulation: read the device, ask the force model, write the force. Both calls are noexcept and allocate nothing.
template <class Device, class Force, RealScalar Scalar>
class ServoLoop {
  using DeviceScalar = std::conditional_t<HapticDevice<Device, Scalar>, Scalar, double>;
  static_assert(HapticDevice<Device, DeviceScalar>,
                "Simulator: the device needs capabilities(), read(DeviceState<double>&) noexcept and write(Wrench<double> const&) noexcept; "
                "see palpate/device/concept.hpp.");
  static_assert(requires(Force& force, ToolContact<Scalar> const& contact) {
    { force(contact) } -> std::convertible_to<Vector3<Scalar>>;
  }, "Simulator: the force model must be callable with a ToolContact of the body's scalar and return a Vector3 in N; NoForce{} is one.");

 public:
  using Vector = Vector3<Scalar>;

  ServoLoop(Device device, Force force) : device_(std::move(device)), force_(std::move(force)) {}

  /// Reads the device. The tip and its velocity are then known; without velocity from the device it is the difference over h.
  void read(Scalar h) noexcept {
    DeviceState<DeviceScalar> state;
    DeviceStatus const status = device_.read(state);
    ++counts_.ticks;
    usable_ = is_usable(status) && state.position.allFinite();
    if (!usable_) {
      ++counts_.unread;
      velocity_.setZero();
      has_tip_ = false;
      return;
    }
    Vector const tip = state.position.template cast<Scalar>();
    if (reports_velocity_ && state.velocity.allFinite())
      velocity_ = state.velocity.template cast<Scalar>();
    else if (has_tip_)
      velocity_ = (tip - tip_) / h;
    else
      velocity_.setZero();
    tip_ = tip;
    has_tip_ = true;
  }

  /// Answers with the force for the tip that was read, and says what was written.
  Tick respond(LocalModel<Scalar> const& model, double time) noexcept {
    ToolContact<Scalar> contact;
    contact.phase = usable_ ? model.phase : CuttingPhase::no_contact;
    contact.depth = model.depth(tip_);
    contact.previous_depth = last_depth_;
    contact.normal = model.normal;
    contact.velocity = velocity_;
    contact.tissue_force = model.tissue_force;
    last_depth_ = contact.depth;

    Vector const wanted = usable_ ? Vector(force_(contact)) : Vector(Vector::Zero());
    if (!wanted.allFinite()) ++counts_.not_finite;
    Wrench<DeviceScalar> wrench;
    wrench.force = limited(Vector3<DeviceScalar>(wanted.template cast<DeviceScalar>()), static_cast<DeviceScalar>(max_force_));
    if (wanted.allFinite() && (wrench.force.template cast<Scalar>() - wanted).norm() > Scalar(1e-6) * wanted.norm()) ++counts_.limited;
    if (!is_usable(device_.write(wrench))) ++counts_.unwritten;

    Tick tick;
    tick.time = time;
    tick.tip = tip_.template cast<double>();
    tick.depth = static_cast<double>(contact.depth);
    tick.phase = contact.phase;
    tick.force = wrench.force.template cast<double>();
    return tick;
  }

  /// Takes over what the device can do; call it once the device is open.
  void learn_capabilities() {
    Capabilities const capabilities = device_.capabilities();
    require_valid(capabilities);
    max_force_ = capabilities.max_force;
    rate_ = capabilities.rate;
    reports_velocity_ = capabilities.reports_velocity;
  }

  Vector const& tip() const noexcept { return tip_; }
  Vector const& velocity() const noexcept { return velocity_; }
  bool usable() const noexcept { return usable_; }
  double rate() const noexcept { return rate_; }   // Hz
  Device& device() noexcept { return device_; }
  Device const& device() const noexcept { return device_; }
  Force& force() noexcept { return force_; }
  ServoCounts const& counts() const noexcept { return counts_; }

 private:
  Device device_;
  Force force_;
  double max_force_ = 0.0;
  double rate_ = 0.0;
  bool reports_velocity_ = false;
  bool usable_ = false;
  bool has_tip_ = false;
  Vector tip_ = Vector::Zero();
  Vector velocity_ = Vector::Zero();
  Scalar last_depth_ = 0;
  ServoCounts counts_;
};

}  // namespace palpate
