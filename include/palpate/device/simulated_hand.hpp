// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/device/hand_tremor.hpp>
#include <palpate/device/limit.hpp>
#include <palpate/device/sampled_mass.hpp>
#include <palpate/device/trajectory.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace palpate {

/// A hand that holds a device and means to follow a path.
struct HandOptions {
  double mass = 0.15;             ///< kg, that moves with the tip
  double damping = 4.0;           ///< N·s/m, towards the speed of the path
  double stiffness = 150.0;       ///< N/m, towards the path
  double reaction_share = 0.0;    ///< 0 … 1, share of the stiffness that comes from seeing where the tip is, and comes late
  double reaction_delay = 0.0;    ///< s, so late
  double lets_go_at = std::numeric_limits<double>::infinity();   ///< s: from then on the device is alone
};

/// Three hands. They are an engineer's choice of numbers that behave like a hand; nobody was measured.
constexpr HandOptions light_hand() noexcept { return {.mass = 0.10, .damping = 2.0, .stiffness = 50.0}; }
constexpr HandOptions normal_hand() noexcept { return {.mass = 0.15, .damping = 4.0, .stiffness = 150.0}; }
constexpr HandOptions firm_hand() noexcept { return {.mass = 0.25, .damping = 8.0, .stiffness = 500.0}; }

struct SimulatedHandOptions {
  HandOptions hand = {};
  HandTremorOptions tremor = {.amplitude = 0.0};   ///< of what the hand means to do; the tip trembles less. Its rate is not looked at, and nothing of it where the amplitude is 0
  double max_force = 3.3;      ///< N; what is written is limited to it, direction kept
  double rate = 1000.0;        ///< Hz
  double mass = 0.045;         ///< kg, of the device, apparent at the tip
  double damping = 0.1;        ///< N·s/m, of its mechanics
  double friction = 0.0;       ///< N, Coulomb's, of its mechanics; a Touch has 0.26
  double quantum = 0.0;        ///< m, resolution of the position; 0: exact
  int force_delay = 0;         ///< ticks from a write to the motors
  int buttons = 0;
};

/// Simulated device in a simulated hand: mass, spring and damper that follow a path and yield to the force that is written.
///   (m + m_h) ẍ + b ẋ + f_c ẋ/|ẋ| = F + k_h (p − x) + b_h (ṗ − ẋ),   p the intended path with its tremor
/// F is held from one write to the next, as motors hold it, and p within a tick at its middle. The motion in between is exact, since the
/// instability of a stiff wall depends on it. Friction brings the tip to rest within a tick where it can, and holds it up to f_c. A hand
/// with a reaction delay applies `reaction_share` of its stiffness to p − x as they were that long ago. A hand that lets go removes its
/// mass, spring and damper.
///
///   SimulatedHand<double> device(Trajectory<double>::start({0, 0, 0.01}).line({0, 0, -0.01}, 1.0), {.hand = firm_hand()});
///
/// Units      SI, the world's frame. Time counts in reads: tick n is at n / rate.
/// Source     zero-order hold: \cite franklin1998 ch. 4. Hand as mass, spring and damper: \cite hajian1997. Presets: see above.
/// Invariant  mass > 0, the others ≥ 0, and reaction_share k_h (reaction_delay + 1/rate) < b + b_h, which keeps the hand stable; checked
///            at set-up.
/// Cost       About 60 ns a tick, 95 with tremor; noexcept, no allocation.
/// Limits     one impedance for all directions and all postures; no gravity; no rotation. Simulated people do not learn.
template <RealScalar Scalar>
class SimulatedHand {
 public:
  explicit SimulatedHand(Trajectory<Scalar> path, SimulatedHandOptions const& options = {})
      : path_(std::move(path)),
        options_(checked(options)),
        held_({.mass = options.mass + options.hand.mass,
               .damping = options.damping + options.hand.damping,
               .stiffness = options.hand.stiffness * (1.0 - options.hand.reaction_share),
               .rate = options.rate}),
        alone_({.mass = options.mass, .damping = options.damping, .rate = options.rate}),
        tremor_(tremor_of(options)),
        seen_(options.hand.reaction_share > 0.0 ? static_cast<std::size_t>(std::lround(options.hand.reaction_delay * options.rate)) + 1 : 1),
        forces_(static_cast<std::size_t>(options.force_delay) + 1, Vector3<Scalar>::Zero()) {
    require_valid(capabilities());
    rewind();
  }

  Capabilities capabilities() const noexcept {
    return {.max_force = options_.max_force,
            .rate = options_.rate,
            .reports_velocity = true,
            .buttons = options_.buttons,
            .moves_a_hand = false,
            .mass = options_.mass,
            .damping = options_.damping,
            .friction = options_.friction,
            .resolution = options_.quantum > 0.0 ? DeviceValue(options_.quantum) : DeviceValue{}};
  }

  DeviceStatus read(DeviceState<Scalar>& state) noexcept {
    if (begun_) advance();
    begun_ = true;
    state.position = quantised(position_, options_.quantum);
    state.velocity = velocity_;
    state.buttons = buttons_;
    return DeviceStatus::ok;
  }
  DeviceStatus write(Wrench<Scalar> const& wrench) noexcept {
    last_wrench_ = limited(wrench, capabilities());
    return DeviceStatus::ok;
  }

  /// The hand is off the device, or on it again where the tip is then; between ticks.
  void let_go() noexcept { holds_ = false; }
  void take_hold() noexcept { holds_ = true, taken_ = true; }
  bool holds() const noexcept { return holds_ && (taken_ || time() < options_.hand.lets_go_at); }

  void set_buttons(std::uint32_t pressed) noexcept { buttons_ = pressed; }
  /// Puts the tip somewhere: a stop, a push; between ticks.
  void place(Vector3<Scalar> const& position, Vector3<Scalar> const& velocity) noexcept { position_ = position, velocity_ = velocity; }

  /// Where the tip is, not quantised.
  Vector3<Scalar> const& position() const noexcept { return position_; }
  Vector3<Scalar> const& velocity() const noexcept { return velocity_; }
  /// What is felt until the next write, after the limit.
  Wrench<Scalar> const& last_wrench() const noexcept { return last_wrench_; }
  Trajectory<Scalar> const& path() const noexcept { return path_; }
  SimulatedHandOptions const& options() const noexcept { return options_; }
  /// s, of the last read.
  double time() const noexcept { return static_cast<double>(tick_) / options_.rate; }

  /// Starts over: at rest at the beginning of the path, held, no force.
  void rewind() noexcept {
    tick_ = 0;
    begun_ = taken_ = false;
    holds_ = true;
    buttons_ = 0;
    position_ = path_.begin();
    velocity_.setZero();
    last_wrench_ = {};
    tremor_.reset();
    for (Vector3<Scalar>& seen : seen_) seen.setZero();   // before, it rested where it meant to
    for (Vector3<Scalar>& force : forces_) force.setZero();
  }

 private:
  static SimulatedHandOptions const& checked(SimulatedHandOptions const& options) {
    detail::OptionCheck const require{"SimulatedHand"};
    HandOptions const& hand = options.hand;
    require(options.mass > 0.0 && std::isfinite(options.mass), ".mass", options.mass, "give the device's apparent mass in kg, above zero");
    require(options.rate > 0.0 && std::isfinite(options.rate), ".rate", options.rate, "give the servo's rate in Hz, 1000 for most");
    require.not_negative(".damping", options.damping);
    require.not_negative(".friction", options.friction);
    require(options.quantum == 0.0 || (options.quantum >= finest_quantum && std::isfinite(options.quantum)), ".quantum", options.quantum,
            "give metres, zero or 1e-12 and more, for example 5.5e-5");
    require.not_negative(".hand.mass", hand.mass);
    require.not_negative(".hand.damping", hand.damping);
    require.not_negative(".hand.stiffness", hand.stiffness);
    require(hand.reaction_share >= 0.0 && hand.reaction_share <= 1.0, ".hand.reaction_share", hand.reaction_share, "give a share, 0 to 1");
    require(hand.reaction_delay >= 0.0 && hand.reaction_delay <= 10.0, ".hand.reaction_delay", hand.reaction_delay, "give seconds, 0 to 10");
    require(!std::isnan(hand.lets_go_at), ".hand.lets_go_at", hand.lets_go_at, "give seconds, or infinity for never");
    require(options.force_delay >= 0 && options.force_delay <= 10000, ".force_delay", options.force_delay, "give ticks, 0 to 10000");
    require(options.buttons >= 0 && options.buttons <= 32, ".buttons", options.buttons, "give 0 to 32");
    double const late = hand.reaction_share * hand.stiffness * (hand.reaction_delay + 1.0 / options.rate), damping = options.damping + hand.damping;
    if (hand.reaction_share > 0.0 && !(late < damping))   // |k r (e^(−iωτ) − 1)| ≤ k r ω τ < b ω: small gain
      throw InvalidArgument(detail::message("SimulatedHand: .hand.reaction_delay is ", hand.reaction_delay,
                                            " s: a hand that pulls so hard and so late shakes by itself (", late,
                                            " N s/m of stiffness times delay, ", damping,
                                            " of damping); give a shorter delay, a smaller .hand.reaction_share or more damping"));
    return options;
  }
  static HandTremorOptions tremor_of(SimulatedHandOptions const& options) {
    if (options.tremor.amplitude == 0.0) return {.amplitude = 0.0};   // its band may be anything, also none that the rate can carry
    HandTremorOptions tremor = options.tremor;
    tremor.rate = options.rate;
    return tremor;
  }

  /// One tick on.
  void advance() noexcept {
    forces_[tick_ % forces_.size()] = last_wrench_.force;
    Vector3<Scalar> force = forces_[(tick_ + 1) % forces_.size()];   // written `force_delay` ticks ago
    Vector3<Scalar> const position = position_;
    bool const rested = velocity_ == Vector3<Scalar>::Zero();
    bool const held = holds();
    SampledMass<Scalar> const& mass = held ? held_ : alone_;
    Motion<Scalar> meant{.position = position_};
    if (held) {
      meant = path_.at(time() + 0.5 / options_.rate);
      if (options_.tremor.amplitude > 0.0) {
        meant.position += tremor_.step();
        meant.velocity += tremor_.velocity();
      }
      force += static_cast<Scalar>(options_.hand.damping) * meant.velocity;
    }
    seen_[tick_ % seen_.size()] = meant.position - static_cast<Scalar>(0.5 / options_.rate) * meant.velocity - position;   // both as the tick begins
    if (held && options_.hand.reaction_share > 0.0)
      force += static_cast<Scalar>(options_.hand.reaction_share * options_.hand.stiffness) * seen_[(tick_ + 1) % seen_.size()];
    mass.step(position_, velocity_, force, meant.position);
    if (options_.friction > 0.0) rub(held ? push_held_ : push_alone_, position, rested);
    ++tick_;
  }

  /// Friction force, held for the tick: it brings the velocity to zero or, where that needs more than f_c, is f_c against it.
  void rub(Motion<Scalar> const& push, Vector3<Scalar> const& before, bool rested) noexcept {
    Scalar const dx = push.position.x(), dv = push.velocity.x(), speed = velocity_.norm(), limit = static_cast<Scalar>(options_.friction);
    if (speed <= limit * dv) {
      position_ = rested ? before : Vector3<Scalar>(position_ - velocity_ * (dx / dv));
      velocity_.setZero();
    } else {
      Vector3<Scalar> const force = velocity_ * (-limit / speed);
      position_ += force * dx;
      velocity_ += force * dv;
    }
  }
  /// Velocity that 1 N gives a mass at rest in a tick.
  static Motion<Scalar> push(SampledMass<Scalar> const& mass) noexcept {
    Motion<Scalar> motion;
    mass.step(motion.position, motion.velocity, Vector3<Scalar>::Ones());
    return motion;
  }

  Trajectory<Scalar> path_;
  SimulatedHandOptions options_;
  SampledMass<Scalar> held_, alone_;
  Motion<Scalar> push_held_ = push(held_), push_alone_ = push(alone_);
  HandTremor<Scalar> tremor_;
  std::vector<Vector3<Scalar>> seen_;     // from the tip to where it was meant to be, the last ticks of the reaction delay
  std::vector<Vector3<Scalar>> forces_;   // on their way to the motors
  std::uint64_t tick_ = 0;
  bool begun_ = false, holds_ = true, taken_ = false;
  std::uint32_t buttons_ = 0;
  Vector3<Scalar> position_ = Vector3<Scalar>::Zero(), velocity_ = Vector3<Scalar>::Zero();
  Wrench<Scalar> last_wrench_;
};

}  // namespace palpate
