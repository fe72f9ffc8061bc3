// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/rotation_vector.hpp>
#include <palpate/device/capabilities.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/haptics/sampled_wall.hpp>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {

/// Properties of a device along one axis, or about one: kg, N·s/m, N/m, or kg·m², N·m·s/rad, N·m/rad.
struct CouplingLimits {
  double mass = 0.0;            ///< m, apparent at the tip; 0: not known
  double damping = 0.0;         ///< b, of the mechanics, for certain; 0: not known
  double max_stiffness = std::numeric_limits<double>::infinity();   ///< that the driver renders
  double max_damping = std::numeric_limits<double>::infinity();     ///< that the driver renders
  double rate = 1000.0;         ///< Hz, of the servo
  double friction = 0.0;        ///< f_c [N or N·m], Coulomb's, of the mechanics; 0: not known
  double quantum = 0.0;         ///< Δ [m or rad], step of the position that the device reports; 0: not known
};

/// Limits from a device's capabilities, along an axis at its tip. Zero counts as not known, and so does a guess of the damping of a device that moves a hand: a guess
/// does not pay for energy.
inline CouplingLimits coupling_limits(Capabilities const& device) {
  auto const known = [](DeviceValue const& value, double otherwise) { return value.known() && value.value != 0.0 ? value.value : otherwise; };
  CouplingLimits const none{};
  return {.mass = known(device.mass, none.mass),
          .damping = device.moves_a_hand && device.damping.provenance < Provenance::datasheet ? none.damping : known(device.damping, none.damping),
          .max_stiffness = known(device.max_stiffness, none.max_stiffness),
          .max_damping = known(device.max_damping, none.max_damping),
          .rate = device.rate.value,
          .friction = known(device.friction, none.friction),
          .quantum = known(device.resolution, none.quantum)};
}

/// A spring and a damper between device and tool, and the tool's own mass. Units as in `CouplingLimits`.
struct CouplingLaw {
  double stiffness = 500.0;   ///< K_c, above 0
  double damping = 0.0;       ///< B_c
  double mass = 0.0;          ///< m_t, of the tool; 0: it is where the forces on it are in balance
};

/// The stiffest coupling that is passive on the device's side, whatever the tool touches, and a tool that it damps critically:
/// `coupling_for(coupling_limits(device.capabilities()))`.
///   b known      B_c = min(b/10, B_max, m/(4 T)),   K_c = min(K_max, 0.9 · 2 (b − B_c)/T)
///   not known    B_c = min(B_max, m/(4 T)),         K_c = K_max: the driver's word is all there is
///   f_c and Δ known    K_c ≤ 2 f_c/Δ as well: a force step K_c Δ that friction does not hold is felt, and may give energy
///   m_t = B_c²/(4 K_c)
/// Source     \cite adams1999; the bounds \cite colgate1997, \cite abbott2005. A held damper above m/(4 T) makes the mass oscillate.
/// Errors     InvalidArgument for what is negative or not finite, and where neither damping nor largest stiffness is known.
inline CouplingLaw coupling_for(CouplingLimits const& limits) {
  detail::OptionCheck const require{"coupling_for"};
  double const unknown = std::numeric_limits<double>::infinity();
  require(limits.mass >= 0.0 && std::isfinite(limits.mass), ".mass", limits.mass, "give the apparent mass at the tip, or 0 where it is not known");
  require(limits.damping >= 0.0 && std::isfinite(limits.damping), ".damping", limits.damping,
          "give that of the mechanics, or 0 where it is not known");
  require(limits.max_stiffness > 0.0, ".max_stiffness", limits.max_stiffness, "give what the driver renders, above zero");
  require(limits.max_damping >= 0.0, ".max_damping", limits.max_damping, "give what the driver renders, zero or more");
  require(limits.rate > 0.0 && std::isfinite(limits.rate), ".rate", limits.rate, "give that of the servo in Hz, 1000 for most");
  require(limits.friction >= 0.0 && std::isfinite(limits.friction), ".friction", limits.friction, "give that of the mechanics, or 0 where it is not known");
  require(limits.quantum >= 0.0 && std::isfinite(limits.quantum), ".quantum", limits.quantum, "give the step of the position, or 0 where it is not known");
  require(limits.damping > 0.0 || limits.max_stiffness < unknown, ".max_stiffness", limits.max_stiffness, "give that or .damping, or both");
  double const held = limits.mass > 0.0 ? limits.mass * limits.rate / 4.0 : unknown;
  double damping = std::min(limits.max_damping, held);
  double stiffness = limits.max_stiffness;
  if (limits.damping > 0.0) {
    damping = std::min(damping, limits.damping / 10.0);
    stiffness = std::min(stiffness, 0.9 * passive_wall(limits.damping, damping, 1.0 / limits.rate));
  } else if (!(damping < unknown)) {
    damping = 0.0;
  }
  if (limits.friction > 0.0 && limits.quantum > 0.0) stiffness = std::min(stiffness, 2.0 * limits.friction / limits.quantum);
  return {.stiffness = stiffness, .damping = damping, .mass = damping * damping / (4.0 * stiffness)};
}

/// Linearised load on the tool: a wrench at its present pose, and by how much it falls as the tool yields.
///   F(x) ≈ force − stiffness (x − x_t),   torque likewise over the rotation vector
/// Units      N, N/m; N·m, N·m/rad; world frame. The wrench is about the tool's tip.
/// Invariant  Both stiffnesses are symmetric positive semidefinite; 0 where not known.
template <RealScalar S>
struct ToolLoad {
  Wrench<S> wrench{};
  Matrix<S, 3, 3> stiffness = Matrix<S, 3, 3>::Zero();
  Matrix<S, 3, 3> angular_stiffness = Matrix<S, 3, 3>::Zero();
};

struct VirtualCouplingOptions {
  CouplingLaw position{};                   ///< N/m, N·s/m, kg; see `coupling_for`
  CouplingLaw rotation{.stiffness = 0.0};   ///< N·m/rad, N·m·s/rad, kg·m²; stiffness 0: the device's orientation, and no torque
  double period = 0.001;                    ///< T [s], of the servo
};

/// Virtual coupling: a simulated tool between device and tissue, held to the device by a spring and a damper. The tissue acts on the
/// motors through these alone, so their stiffness decides what the device has to stand.
///   F = K_c (x_t − x_d) + B_c (v_t − v_d)                  on the hand, −F on the tool
///   τ = K_θ log(q_t q_d⁻¹) + B_θ (ω_t − ω_d)              the rotation vector of the shortest arc
///   m_t (v_t⁺ − v_t)/T = −F⁺ + F_e − k_e T v_t⁺,   x_t⁺ = x_t + T v_t⁺        F_e, k_e the load on the tool
/// The step of the tool is implicit, so it is stable for any load and any mass, zero too; the force on the hand is that of its end. A
/// device with b > K_c T/2 + |B_c| is passive with any passive load that is given with its stiffness.
/// Units      SI, world frame; force [N] and torque [N·m] on the hand.
/// Source     \cite colgate1995; the passive choice \cite adams1999.
/// Invariant  K_c > 0, all else ≥ 0 and finite, T > 0; checked at set-up. The first tick, and the one after a state that is not finite,
///            place the tool at the device: no force. What the hand gets is taken from the tool; of torques, up to the rotation of axes
///            in a tick.
/// Cost       Two solutions of three equations; noexcept, no allocation: allowed in the servo tick.
/// Limits     The hand feels at most K_c, however stiff the tissue. The load is that of the last tick: a tool enters by one tick's way
///            before it is held. A load without its stiffness k is stable for k T² < m_t + T B_c + T² K_c only. Implicit steps damp what
///            is faster than a tick. Rotations within a tick are small; at half a turn between tool and device the torque reverses.
template <RealScalar S>
class VirtualCoupling {
 public:
  using Scalar = S;

  explicit VirtualCoupling(VirtualCouplingOptions const& options = {}) : options_(options) {
    detail::OptionCheck const require{"VirtualCoupling", true};
    require.positive(".position.stiffness", options.position.stiffness, " N/m");
    require.not_negative(".position.damping", options.position.damping, " N·s/m");
    require.not_negative(".position.mass", options.position.mass, " kg");
    require.not_negative(".rotation.stiffness", options.rotation.stiffness, " N·m/rad");
    require.not_negative(".rotation.damping", options.rotation.damping, " N·m·s/rad");
    require.not_negative(".rotation.mass", options.rotation.mass, " kg·m²");
    require(options.period > 0.0, ".period", options.period, " s", "give that of the servo, 0.001 for most");
  }

  /// The wrench of spring and damper alone, for a tool at this pose.
  Wrench<S> between(DeviceState<S> const& device, DeviceState<S> const& tool) const noexcept {
    Wrench<S> wrench;
    wrench.force = S(options_.position.stiffness) * (tool.position - device.position) +
                   S(options_.position.damping) * (tool.velocity - device.velocity);
    if (options_.rotation.stiffness > 0.0)
      wrench.torque = S(options_.rotation.stiffness) * rotation_vector<S>(tool.orientation * device.orientation.conjugate()) +
                      S(options_.rotation.damping) * (tool.angular_velocity - device.angular_velocity);
    return wrench;
  }

  /// One servo tick: moves the tool under its load and the coupling, and returns the wrench on the hand. The load is that at `tool()`.
  Wrench<S> operator()(DeviceState<S> const& device, ToolLoad<S> const& load = {}) noexcept {
    if (!is_number(device)) {
      attached_ = false;
      return {};
    }
    if (!attached_) {
      attach(device);
      return {};
    }
    S const h = S(options_.period);
    DeviceState<S> const before = tool_;
    CouplingLaw const& p = options_.position;
    tool_.velocity = solved(p, load.stiffness,
                            S(p.mass) * before.velocity +
                                h * (S(p.stiffness) * (device.position - before.position) + S(p.damping) * device.velocity + load.wrench.force));
    tool_.position += h * tool_.velocity;
    if (CouplingLaw const& r = options_.rotation; r.stiffness > 0.0) {
      Vector3<S> const apart = rotation_vector<S>(device.orientation * before.orientation.conjugate());
      tool_.angular_velocity = solved(r, load.angular_stiffness,
                                      S(r.mass) * before.angular_velocity +
                                          h * (S(r.stiffness) * apart + S(r.damping) * device.angular_velocity + load.wrench.torque));
      tool_.orientation = (rotation_of<S>(h * tool_.angular_velocity) * before.orientation).normalized();
    } else {
      tool_.orientation = device.orientation;
      tool_.angular_velocity = device.angular_velocity;
    }
    tool_.buttons = device.buttons;
    if (!is_number(tool_)) {   // a load that is no number
      attached_ = false;
      return {};
    }
    return between(device, tool_);
  }

  /// Places the tool at a pose and velocity; `operator()` does so at the device by itself.
  void attach(DeviceState<S> const& tool) noexcept {
    tool_ = tool;
    attached_ = true;
  }
  bool attached() const noexcept { return attached_; }

  /// The tool, for what it touches and for the picture; not before it is attached.
  DeviceState<S> const& tool() const noexcept { return tool_; }

  void reset() noexcept { attached_ = false; }

 private:
  static bool is_number(DeviceState<S> const& s) noexcept {
    return is_finite(s.position) && is_finite(s.velocity) && is_finite(s.orientation.coeffs()) && is_finite(s.angular_velocity);
  }

  /// v of (m + T B + T² (K + k)) v = push
  Vector3<S> solved(CouplingLaw const& law, Matrix<S, 3, 3> const& stiffness, Vector3<S> const& push) const noexcept {
    S const h = S(options_.period);
    Matrix<S, 3, 3> matrix = h * h * stiffness;
    matrix.diagonal().array() += S(law.mass + options_.period * (law.damping + options_.period * law.stiffness));
    return matrix.inverse() * push;
  }

  VirtualCouplingOptions options_;
  DeviceState<S> tool_{};
  bool attached_ = false;
};

}  // namespace palpate
