// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/device/concept.hpp>
#include <palpate/device/limit.hpp>
#include <palpate/force/concept.hpp>
#include <palpate/haptics/local_model.hpp>
#include <palpate/haptics/overlay.hpp>
#include <palpate/simulator/recording.hpp>

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

namespace palpate {

/// What happened on the servo's side.
struct ServoCounts {
  std::uint64_t ticks = 0;
  std::uint64_t unread = 0;       ///< reads that failed or were not finite: the last pose was kept and the force was zero
  std::uint64_t unwritten = 0;    ///< writes that failed
  std::uint64_t faulted = 0;      ///< ticks without force because the device had reported a fault in this session
  std::uint64_t unsound = 0;      ///< ticks without force because the body had diverged
  std::uint64_t faded = 0;        ///< ticks in which the force of before a restoration faded
  std::uint64_t not_finite = 0;   ///< forces that were not finite and became zero
  std::uint64_t limited = 0;      ///< forces shortened to the device's maximum
};

namespace detail {

/// The scalar that a device computes in: the body's if it can, else the other one.
template <class Device, RealScalar Scalar>
struct DeviceScalarOf {
  using Other = std::conditional_t<std::is_same_v<Scalar, double>, float, double>;
  using type = std::conditional_t<!HapticDevice<Device, Scalar> && HapticDevice<Device, Other>, Other, Scalar>;
};

}  // namespace detail

/// The hand's side of a simulation: read the device, ask the force model, write the force. Both calls are noexcept and allocate nothing.
/// The force is zero when the read failed or gave no finite position, when the body has diverged, when the force is not finite, and,
/// from a fault of the device on, until its next session; it is never above the device's maximum. When the body is restored under the
/// tool, the last force fades to zero over 50 ms, evenly; then the force model is heard again, and the tool has to touch anew.
/// A force model with an overlay (see haptics/overlay.hpp) adds to the tissue's force in free space too, and goes on during that fading.
template <class Device, class Force, RealScalar Scalar>
class ServoLoop {
 public:
  using DeviceScalar = typename detail::DeviceScalarOf<Device, Scalar>::type;
  using Vector = Vector3<Scalar>;

 private:
  static_assert(HapticDevice<Device, DeviceScalar>,
                "Simulator: the device needs capabilities(), read(DeviceState<double>&) noexcept and write(Wrench<double> const&) noexcept; "
                "see palpate/device/concept.hpp.");
  static_assert(ForceModel<Force, Scalar>,
                "Simulator: the force model must be callable, noexcept, with a ToolContact of the body's scalar and return a Vector3 of it "
                "in N; NoForce{} is one.");

 public:
  ServoLoop(Device device, Force force) : device_(std::move(device)), force_(std::move(force)) {}

  /// Reads the device. The tip and its velocity are then known; without velocity from the device it is the difference over h.
  void read(Scalar h) noexcept {
    since_last_ = h;
    DeviceState<DeviceScalar> state = state_;
    DeviceStatus const status = device_.read(state);
    ++counts_.ticks;
    Vector const tip = state.position.template cast<Scalar>();
    faulted_ = faulted_ || !is_usable(status);
    usable_ = is_usable(status) && state.position.allFinite() && tip.allFinite();
    if (!usable_) {
      ++counts_.unread;
      velocity_.setZero();
      follows_ = false;
      return;
    }
    state_ = state;
    Vector const reported = state.velocity.template cast<Scalar>();
    if (reports_velocity_ && reported.allFinite())
      velocity_ = reported;
    else if (follows_)
      velocity_ = (tip - tip_) / h;
    else
      velocity_.setZero();
    tip_ = tip;
    placed_ = follows_ = true;
  }

  /// Answers with the force for the tip that was read, and says what was written.
  Tick respond(LocalModel<Scalar> const& model, double time) noexcept {
    ToolContact<Scalar> contact;
    contact.phase = model.phase;
    contact.depth = model.depth(tip_);
    contact.previous_depth = last_depth_;
    contact.normal = model.normal;
    contact.velocity = velocity_;
    contact.tissue_force = model.tissue_force;
    contact.seconds = since_last_;
    last_depth_ = contact.depth;

    Wrench<DeviceScalar> wrench;
    if (faulted_)
      ++counts_.faulted;
    else if (!model.sound)
      ++counts_.unsound;
    else if (usable_)
      wrench.force = answer(model, contact);
    if (!usable_ || faulted_ || !model.sound) fall_silent();
    restorations_ = model.restorations;
    if (!is_usable(device_.write(wrench))) {
      ++counts_.unwritten;
      faulted_ = true;
    }

    Tick tick;
    tick.time = time;
    tick.tip = tip_.template cast<double>();
    tick.depth = static_cast<double>(contact.depth);
    tick.phase = contact.phase;
    tick.force = wrench.force.template cast<double>();
    return tick;
  }

  /// A session begins: takes over what the device can do, now that it is open, and trusts it again.
  void begin_session() {
    Capabilities const capabilities = device_.capabilities();
    require_valid(capabilities);
    max_force_ = static_cast<DeviceScalar>(capabilities.max_force);
    rate_ = capabilities.rate;
    reports_velocity_ = capabilities.reports_velocity;
    faulted_ = false;
    fall_silent();
    fade_left_ = 0;
  }

  Vector const& tip() const noexcept { return tip_; }
  Vector const& velocity() const noexcept { return velocity_; }
  /// Has there been a pose yet?
  bool placed() const noexcept { return placed_; }
  double rate() const noexcept { return rate_; }   // Hz
  Device& device() noexcept { return device_; }
  Device const& device() const noexcept { return device_; }
  Force& force() noexcept { return force_; }
  ServoCounts const& counts() const noexcept { return counts_; }

 private:
  static constexpr Scalar fade_time = Scalar(0.05);   // s

  void fall_silent() noexcept {
    last_force_.setZero();
    overlay_continues_ = false;
  }

  /// The tissue's force and what is laid over it, as it may be written.
  Vector3<DeviceScalar> answer(LocalModel<Scalar> const& model, ToolContact<Scalar> const& contact) noexcept {
    Vector3<DeviceScalar> const tissue = faded(model, Vector(force_(contact)).template cast<DeviceScalar>());
    if constexpr (HasOverlay<Force, Scalar>) {
      Vector const over = force_.overlay(ToolMotion<Scalar>{tip_, velocity_, since_last_, overlay_continues_});
      last_force_ = limited(tissue, max_force_);
      Vector3<DeviceScalar> const all = tissue + over.template cast<DeviceScalar>();
      overlay_continues_ = all.allFinite();
      return permitted(all);
    } else {
      return last_force_ = permitted(tissue);
    }
  }

  /// The force wanted, or, after a restoration, what is left of the force before.
  Vector3<DeviceScalar> faded(LocalModel<Scalar> const& model, Vector3<DeviceScalar> const& wanted) noexcept {
    if (model.restorations != restorations_ && !last_force_.isZero(0)) {
      faded_force_ = last_force_;
      fade_left_ = fade_time;
    }
    if (!(fade_left_ > 0)) return wanted;
    fade_left_ = fade_left_ > since_last_ ? fade_left_ - since_last_ : Scalar(0);
    ++counts_.faded;
    return static_cast<DeviceScalar>(fade_left_ / fade_time) * faded_force_;
  }

  Vector3<DeviceScalar> permitted(Vector3<DeviceScalar> const& wanted) noexcept {
    if (!wanted.allFinite())
      ++counts_.not_finite;
    else if (wanted.stableNorm() > max_force_)
      ++counts_.limited;
    return limited(wanted, max_force_);
  }

  Device device_;
  Force force_;
  DeviceState<DeviceScalar> state_;   // the last usable one
  DeviceScalar max_force_ = 0;
  double rate_ = 0.0;
  bool reports_velocity_ = false;
  bool usable_ = false;    // this tick's pose is new
  bool follows_ = false;   // so was the last one's: a difference of the two is a velocity
  bool placed_ = false;
  bool faulted_ = false;
  Vector tip_ = Vector::Zero();
  Vector velocity_ = Vector::Zero();
  Scalar last_depth_ = 0;
  Scalar since_last_ = 0;   // s, the tick before this one
  std::size_t restorations_ = 0;   // of the body, in the last tick
  Vector3<DeviceScalar> last_force_ = Vector3<DeviceScalar>::Zero();    // N, written; the tissue's part of it
  bool overlay_continues_ = false;   // the hand felt the overlay in the last tick
  Vector3<DeviceScalar> faded_force_ = Vector3<DeviceScalar>::Zero();   // N, before the restoration
  Scalar fade_left_ = 0;   // s
  ServoCounts counts_;
};

}  // namespace palpate
