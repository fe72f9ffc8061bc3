// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/event_ring.hpp>
#include <palpate/core/flush_denormals.hpp>
#include <palpate/core/tool_pose.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/device/limit.hpp>
#include <palpate/force/concept.hpp>
#include <palpate/haptics/concept.hpp>
#include <palpate/haptics/local_model.hpp>
#include <palpate/haptics/safety_chain.hpp>
#include <palpate/haptics/workspace_mapping.hpp>
#include <palpate/simulator/tick.hpp>
#include <palpate/tool/trocar.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <type_traits>
#include <utility>

namespace palpate {

/// How forces reach a device.
struct ServoOptions {
  SafetyOptions safety{};
  WorkspaceMapping<double> mapping{};    ///< from the device's frame to the world's
  std::uint32_t clutch = 0;              ///< buttons; while one is pressed the tip stays and the hand moves freely. 0: none
  std::uint32_t grip = 0;                ///< buttons; while one is pressed the tool's jaws close, of a device that reports no gripper. 0: none
  double grip_time = 0.1;                ///< s, in which they close or open
  std::optional<TrocarOptions<double>> trocar = {};   ///< a fixed point that the tool's shaft goes through, wherever the hand commands its tip
};

/// What happened on the servo's side.
struct ServoCounts {
  std::uint64_t ticks = 0;
  std::uint64_t unread = 0;       ///< reads that failed or were not finite: the last pose was kept and the force was zero
  std::uint64_t unwritten = 0;    ///< writes that failed
  std::uint64_t faulted = 0;      ///< ticks without force because the device had reported a fault in this session
  std::uint64_t diverged = 0;      ///< ticks without force because the body had diverged
  std::uint64_t off_trocar = 0;   ///< samples for which no pose leads through the trocar: the tool stayed, and the hand moved freely
  std::uint64_t faded = 0;        ///< ticks in which the force of before a restoration faded
  SafetyCounts safety{};
  ForceSaturation saturation{};   ///< of this session, or the last
  ArmingWaitsFor waits_for = ArmingWaitsFor::sample;   ///< what has to come before the hand feels anything; `nothing` while it may
};

/// What the safety chain did, and when [s of simulated time].
struct ServoEvent {
  double time = 0.0;
  SafetyEvent what = SafetyEvent::armed;
  ArmingWaitsFor waits_for = ArmingWaitsFor::nothing;   ///< what arming waits for at the end of that tick
};
using ServoEvents = EventRing<ServoEvent, 256>;

namespace detail {

/// The scalar that a device computes in: the body's if it can, else the other one.
template <class Device, RealScalar Scalar>
struct DeviceScalarOf {
  using Other = std::conditional_t<std::is_same_v<Scalar, double>, float, double>;
  using type = std::conditional_t<!HapticDevice<Device, Scalar> && HapticDevice<Device, Other>, Other, Scalar>;
};

}  // namespace detail

/// The hand's side of a simulation: read the device, ask the force model, write the force through the safety chain. Both calls are noexcept and
/// allocate nothing. Forces are the scene's; the mapping brings them to the device's frame.
/// The force is zero when the read failed or gave no finite position, when the body has diverged, when the force is not finite, while the
/// chain is not armed, and, from a fault of the device on, until its next session. When the body is restored under the
/// tool, the last force fades to zero over 50 ms, evenly; then the force model is heard again, and the tool has to touch anew. Where the position jumps, the
/// tool was placed anew: `pose_discontinuities()` tells the body's side, and until that has answered there is no force.
/// A device with torque gets the moment of the contact on the tool, about its tip, beside the force and by the same rules; through a trocar only what turns
/// the tool about its shaft, since the hand does not tilt it. Where no pose leads through the trocar the tool stays as it was, as with an open clutch.
/// A force model with an overlay (see HasOverlay) adds to the tissue's force in free space too, and goes on during that fading.
template <class Device, class Force, RealScalar Scalar>
class ServoLoop {
 public:
  using DeviceScalar = typename detail::DeviceScalarOf<Device, Scalar>::type;
  using Vector = Vector3<Scalar>;

 private:
  static_assert(HapticDevice<Device, DeviceScalar> && RendersForce<Force, Scalar>);
  static_assert(sizeof(detail::DeviceRefinements<Device>) > 0 && sizeof(detail::ForceRefinements<Force, Scalar>) > 0);

 public:
  ServoLoop(Device device, Force force, ServoOptions const& options = {})
      : device_(std::move(device)), force_(std::move(force)), options_(options), mapping_(options.mapping.template cast<Scalar>()), events_(std::make_unique<ServoEvents>()) {
    options.safety.validate();
    if (options.trocar) trocar_.emplace(options.trocar->template cast<Scalar>());
    detail::require_positive("ServoOptions: .grip_time", options.grip_time, "s");
    if ((options.clutch & options.grip) != 0) throw InvalidArgument(detail::message("ServoOptions: .clutch, ", options.clutch, ", and .grip, ", options.grip, ", are the same button; give each its own"));
  }

  /// Reads the device. The tip and its velocity are then known; without velocity from the device it is the way from one new sample to the next over the time
  /// between them, a period at least, and stays while there is no new one. A tick may come before its time: `elapsed` [s] is what has passed on the clock then, and no rule
  /// that counts by the second lets more through.
  void read(Scalar h, double elapsed = std::numeric_limits<double>::infinity()) noexcept {
    double const passed = elapsed >= 0.0 && elapsed < 0.75 * static_cast<double>(h) ? elapsed : static_cast<double>(h);   // else it is the clock's jitter
    since_last_ = static_cast<Scalar>(passed);
    DeviceState<DeviceScalar> state = state_;
    DeviceStatus const status = device_.read(state);
    ++counts_.ticks;
    Vector const position = state.position.template cast<Scalar>();
    usable_ = is_usable(status) && is_finite(state.position) && is_finite(position);
    chain_.read({.works = is_usable(status),
                 .usable = usable_,
                 .fresh = status == DeviceStatus::ok,
                 .position = position,
                 .orientation = state.orientation.template cast<Scalar>(),
                 .seconds = static_cast<double>(h),
                 .elapsed = elapsed,
                 .buttons = state.buttons,
                 .calibration = calibration()});
    if (chain_.interrupted()) follows_ = false;
    if (passed > 0) since_sample_ += passed;   // a tick of no time, or of none that is a number, tells nothing of speed
    sample_age_ = status == DeviceStatus::stale ? sample_age_ + passed : 0.0;
    if (!usable_) {
      ++counts_.unread;
      velocity_.setZero();
      follows_ = false;
      return;
    }
    has_sample_ = has_sample_ || status == DeviceStatus::ok;
    if (!has_sample_) {   // nothing is known yet, in this session: where the tool was is not where it is
      velocity_.setZero();
      follows_ = false, since_sample_ = 0;
      return;
    }
    state_ = state;
    bool const fresh = is_fresh_ = status == DeviceStatus::ok;
    work_clutch(position);
    Vector const tip = mapping_.clutch_open() ? mapping_.held() : mapping_.to_world(position);
    Vector const reported = mapping_.velocity_to_world(state.velocity.template cast<Scalar>());
    work_jaws(since_last_);
    if (!turn(state.orientation, tip)) {
      ++counts_.off_trocar;
      if (fresh) since_sample_ = 0;
      velocity_.setZero();
      follows_ = false;
      return;
    }
    if (placed_ && static_cast<double>(stable_norm(tip - tip_)) > longest_way()) ++pose_discontinuities_, answer_is_due_ = true;
    if (mapping_.clutch_open())
      velocity_.setZero();
    else if (reports_velocity_ && is_finite(reported))
      velocity_ = reported;
    else if (!follows_)
      velocity_.setZero();
    else if (fresh && since_sample_ * rate_ > 0.999)   // over a period at least: a tick may come before its time
      velocity_ = (tip - from_) / static_cast<Scalar>(since_sample_);
    if (fresh && (!follows_ || since_sample_ * rate_ > 0.999)) since_sample_ = 0, from_ = tip;
    tip_ = tip;
    placed_ = true;
    follows_ = follows_ || fresh;
  }

  /// Answers with the force for the tip that was read, and says what was written.
  Tick respond(LocalModel<Scalar> const& model, double time) noexcept { return respond(model, time, time); }

  /// The same where the tick's time is not that of the clock: `now` [s] is on the clock of the model's time.
  Tick respond(LocalModel<Scalar> const& model, double time, double now) noexcept {
    FlushDenormals const flush;
    ToolContact<Scalar> contact;
    contact.phase = model.phase;
    contact.depth = model.depth(tip_);
    contact.previous_depth = last_depth_;
    contact.normal = model.normal;
    contact.velocity = velocity_;
    contact.tissue_force = model.tissue_force;
    contact.seconds = since_last_;
    last_depth_ = contact.depth;

    if (answer_is_due_) placed_at_ = now, answer_is_due_ = false;
    bool const valid = model.valid && placed_ && !(model.time < placed_at_);   // a model of where the tool was says nothing of where it is
    bool const asked = usable_ && !model.diverged && valid && !chain_.faulted();
    if (chain_.faulted())
      ++counts_.faulted;
    else if (model.diverged)
      ++counts_.diverged;
    WantedForce<Scalar> wanted{.inside = model.phase == CuttingPhase::moving || (model.phase != CuttingPhase::no_contact && contact.depth > 0),
                               .valid = valid,
                               .diverged = model.diverged,
                               .age = std::fmax(now - model.time, sample_age_),
                               .quiet = mapping_.clutch_open() || is_off_};
    if (asked) ask(model, contact, wanted);
    restorations_ = model.restorations;
    Vector const out = chain_(wanted, mapping_);
    if (!asked || !is_finite(wanted.force) || !is_finite(wanted.torque) || !may_render(chain_.stage())) reset_force();
    Wrench<DeviceScalar> wrench;
    wrench.force = limited(Vector3<DeviceScalar>(out.template cast<DeviceScalar>()), max_force_);   // rounding to a float may lengthen it by a bit
    wrench.torque = limited(Vector3<DeviceScalar>(chain_.torque().template cast<DeviceScalar>()), max_torque_);
    if (!is_usable(device_.write(wrench))) {
      ++counts_.unwritten;
      chain_.write_failed();
    }
    while (auto const event = chain_.pop_event()) static_cast<void>(events_->push({time, *event, chain_.waits_for()}));

    Tick tick;
    tick.time = time;
    tick.tip = tip_.template cast<double>();
    tick.depth = static_cast<double>(contact.depth);
    tick.phase = contact.phase;
    tick.force = mapping_.force_to_world(wrench.force.template cast<Scalar>()).template cast<double>();
    tick.energy = chain_.energy();
    tick.cut_area = model.cut_area;
    tick.torque = mapping_.torque_to_world(wrench.torque.template cast<Scalar>()).template cast<double>();
    return tick;
  }

  /// The hand is let go: zero is written. The last act of a run, and all there is to do for a driver that still calls.
  void write_zero_force() noexcept { static_cast<void>(device_.write(Wrench<DeviceScalar>{})); }

  /// A session begins: takes over what the device can do, now that it is open, and trusts it again. Local models will come at `model_rate` Hz.
  void begin_session(double model_rate) {
    Capabilities const capabilities = device_.capabilities();
    SafetyOptions safety = options_.safety;
    if (!safety.dead_man && (options_.clutch | options_.grip) != 0)   // they hold no dead man
      safety.dead_man = limits_for(safety, capabilities, model_rate).dead_man & ~(options_.clutch | options_.grip);
    if (int const buttons = capabilities.buttons; !capabilities.reports_gripper && buttons < 32 && (options_.grip >> buttons) != 0)
      throw InvalidArgument(detail::message("ServoOptions: .grip is ", options_.grip, ", and the device has ", buttons, " buttons; bit 0 is the first"));
    chain_.begin(safety, capabilities, model_rate, mapping_);
    max_force_ = static_cast<DeviceScalar>(chain_.limits().max_force), max_torque_ = static_cast<DeviceScalar>(chain_.limits().max_torque);
    if constexpr (LimitsStiffness<Force>) force_.limit_stiffness(chain_.stiffest(force_.max_stiffness()));
    rate_ = capabilities.rate;
    if constexpr (BeginsSession<Force, Scalar>)
      force_.begin_session(capabilities, mapping_, model_rate);
    else if constexpr (SurfaceForce<Force, Scalar>)
      force_.begin_session(rate_, model_rate);
    since_sample_ = 0, from_ = tip_, has_sample_ = false;
    reports_velocity_ = capabilities.reports_velocity;
    reports_orientation_ = capabilities.reports_orientation;
    reports_gripper_ = capabilities.reports_gripper;
    placed_at_ = -std::numeric_limits<double>::infinity();   // the clock of a session begins anew
    answer_is_due_ = false;
    reset_force();
    fade_left_ = 0;
    sample_age_ = 0;
    if (chain_.limits().protects_a_hand) follows_ = false;   // it may have moved meanwhile; a simulated one has not
  }
  /// The same where every tick has a local model of its own.
  void begin_session() { begin_session(static_cast<double>(device_.capabilities().rate)); }

  Vector const& tip() const noexcept { return tip_; }
  Vector const& velocity() const noexcept { return velocity_; }
  /// The tool in the world. One whose device reports no orientation is not turned.
  ToolPose<Scalar> tool() const noexcept { return {tip_, orientation_, velocity_, opening_}; }
  /// Has there been a pose yet?
  bool placed() const noexcept { return placed_; }
  /// How often the tip was found farther from where it was than `SafetyLimits::jump`, or than the fastest hand goes while a device has no new samples for a
  /// while: after a calibration, a long gap between ticks or samples, between two sessions. The tool is then elsewhere without having gone the way.
  std::uint64_t pose_discontinuities() const noexcept { return pose_discontinuities_; }
  double rate() const noexcept { return rate_; }   // Hz
  Device& device() noexcept { return device_; }
  Device const& device() const noexcept { return device_; }
  Force& force() noexcept { return force_; }
  ServoCounts counts() const noexcept {
    ServoCounts all = counts_;
    all.safety = chain_.counts();
    all.saturation = chain_.saturation();
    all.waits_for = chain_.waits_for();
    return all;
  }
  SafetyChain<Scalar> const& chain() const noexcept { return chain_; }
  WorkspaceMapping<Scalar> const& mapping() const noexcept { return mapping_; }
  /// For one other thread, or between ticks.
  ServoEvents& events() noexcept { return *events_; }

 private:
  static constexpr Scalar fade_time = Scalar(0.05);   // s

  void reset_force() noexcept {
    last_ = {};
    continues_ = false;
  }

  /// The tissue's force and what is laid over it. What the model holds elastically is at most force times depth, for every law that rises with depth.
  void ask(LocalModel<Scalar> const& model, ToolContact<Scalar> const& contact, WantedForce<Scalar>& wanted) noexcept {
    Vector answer;
    if constexpr (SurfaceForce<Force, Scalar>)
      answer = force_.on_surface(model, ToolMotion<Scalar>{tip_, velocity_, since_last_, continues_, is_fresh_});
    else
      answer = force_(contact);
    Wrench<Scalar> const tissue = faded(model, {answer, moment(model)});
    Scalar const kappa = mapping_.force_scale();
    last_ = {limited(tissue.force, static_cast<Scalar>(max_force_) / kappa),
             limited(tissue.torque, static_cast<Scalar>(max_torque_) * mapping_.world_from_device().scale() / kappa)};
    wanted.force = tissue.force, wanted.torque = tissue.torque;
    wanted.elastic = static_cast<double>(tissue.force.norm() * contact.depth);
    if constexpr (HasOverlay<Force, Scalar>) {
      wanted.force += force_.overlay(ToolMotion<Scalar>{tip_, velocity_, since_last_, continues_, is_fresh_});
      if constexpr (HasOverlayEnergy<Force>) wanted.elastic += static_cast<double>(force_.overlay_energy());
    }
    continues_ = true;
  }

  /// N m, of the contact about the tip, that the hand is to feel.
  Vector moment(LocalModel<Scalar> const& model) const noexcept {
    if (!(max_torque_ > 0)) return Vector::Zero();
    if (!trocar_) return model.tissue_moment;
    return (orientation_ * trocar_->options().shaft).dot(model.tissue_moment) * twist_;
  }

  /// The force and torque wanted, or, after a restoration, what is left of those before.
  Wrench<Scalar> faded(LocalModel<Scalar> const& model, Wrench<Scalar> const& wanted) noexcept {
    if (model.restorations != restorations_ && !(is_zero(last_.force) && is_zero(last_.torque))) {
      faded_ = last_;
      fade_left_ = fade_time;
    }
    if (!(fade_left_ > 0)) return wanted;
    fade_left_ = fade_left_ > since_last_ ? fade_left_ - since_last_ : Scalar(0);
    ++counts_.faded;
    Scalar const share = fade_left_ / fade_time;
    return {share * faded_.force, share * faded_.torque};
  }

  /// Turns the tool as the device says, through the trocar with its tip there. False where that leads to no pose.
  bool turn(Eigen::Quaternion<DeviceScalar> const& reported, Vector const& tip) noexcept {
    ToolPose<Scalar> pose{.position = tip, .orientation = reports_orientation_ || !trocar_ ? orientation_ : trocar_->options().orientation};
    if (reports_orientation_ && std::abs(reported.norm() - 1) < DeviceScalar(0.01))   // false for what is not finite
      pose.orientation = mapping_.orientation_to_world(reported.template cast<Scalar>());
    auto const through = trocar_ ? trocar_->find(pose) : std::optional(pose);
    is_off_ = !through.has_value();
    if (through) orientation_ = through->orientation;
    if (through && trocar_) {   // the tool's shaft d turns about itself at (s + d)·ω/(1 + s·d) where the hand, which commands the shaft s, turns at ω
      Vector const commanded = pose.orientation * trocar_->options().shaft, shaft = orientation_ * trocar_->options().shaft;
      twist_ = (commanded + shaft) / (1 + commanded.dot(shaft));   // less than a right angle apart
    }
    return !is_off_;
  }

  /// m, in the world, that the tip can have moved since the last sample. Where only samples are missing, and not for as long as a long gap, the hand may have
  /// gone on at its speed all the time; else nobody knows what it did.
  double longest_way() const noexcept {
    SafetyLimits const& limits = chain_.limits();
    bool const unseen = chain_.interrupted() || since_sample_ > limits.long_gap;
    double const way = unseen ? limits.jump : std::fmax(limits.jump, limits.overspeed * since_sample_);
    return way * static_cast<double>(mapping_.world_from_device().scale());
  }

  /// Asks the device, where it can be asked; while the chain is disarmed for it, the device may mend what it can by itself.
  Calibration calibration() noexcept {
    if constexpr (Calibratable<Device>) {
      Calibration const now = device_.calibration();
      if (now == Calibration::needs_update && chain_.stage() == DeviceStage::calibrating) device_.calibrate();
      return now;
    } else {
      return Calibration::good;
    }
  }

  /// The clutch opens and closes with its button.
  void work_clutch(Vector const& position) noexcept {
    if ((state_.buttons & options_.clutch) != 0)
      mapping_.open_clutch(position);
    else
      mapping_.close_clutch(position);
  }

  /// The jaws are where the gripper is, or go on closing or opening with their button.
  void work_jaws(Scalar h) noexcept {
    if (reports_gripper_) {
      if (std::isfinite(state_.gripper)) opening_ = std::clamp(static_cast<Scalar>(state_.gripper), Scalar(0), Scalar(1));
      return;
    }
    if (!(h >= 0)) return;
    Scalar const way = h / static_cast<Scalar>(options_.grip_time);
    opening_ = std::clamp((state_.buttons & options_.grip) != 0 ? opening_ - way : opening_ + way, Scalar(0), Scalar(1));
  }

  Device device_;
  Force force_;
  ServoOptions options_;
  WorkspaceMapping<Scalar> mapping_;
  std::optional<Trocar<Scalar>> trocar_;
  SafetyChain<Scalar> chain_;
  std::unique_ptr<ServoEvents> events_;
  DeviceState<DeviceScalar> state_;   // the last usable one
  DeviceScalar max_force_ = 0, max_torque_ = 0;   // N, N m
  double rate_ = 0.0;
  bool reports_velocity_ = false, reports_orientation_ = false, reports_gripper_ = false;
  bool usable_ = false;    // this tick's pose is new
  bool is_fresh_ = false;  // and so is its sample
  bool follows_ = false;   // there was a new sample since the tool was placed: from it to the next one is a way
  bool has_sample_ = false;   // there was one in this session
  bool placed_ = false;
  double since_sample_ = 0;      // s, since its velocity was measured last
  std::uint64_t pose_discontinuities_ = 0;
  bool answer_is_due_ = false;   // the tool was placed anew in this tick
  double placed_at_ = -std::numeric_limits<double>::infinity();   // s, on the clock of the model's time
  Vector tip_ = Vector::Zero(), from_ = Vector::Zero();   // now; when its velocity was measured last
  Vector velocity_ = Vector::Zero();
  Eigen::Quaternion<Scalar> orientation_ = Eigen::Quaternion<Scalar>::Identity();   // world ← tool
  Vector twist_ = Vector::Zero();   // rad of the tool in a trocar, about its shaft, per rad of the hand about an axis: the torque that does the same work per N m
  Scalar opening_ = 1;   // of the tool's jaws
  Scalar last_depth_ = 0;
  Scalar since_last_ = 0;   // s, the tick before this one
  double sample_age_ = 0;   // s, for which the device has had no new sample
  std::size_t restorations_ = 0;   // of the body, in the last tick
  bool is_off_ = false;            // no pose leads through the trocar
  Wrench<Scalar> last_;            // the tissue's part of what the hand felt, world frame
  bool continues_ = false;   // the hand felt something in the last tick, or could have
  Wrench<Scalar> faded_;     // before the restoration
  Scalar fade_left_ = 0;   // s
  ServoCounts counts_;
};

}  // namespace palpate
