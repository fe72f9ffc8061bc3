// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/device/limit.hpp>
#include <palpate/testing/violations.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <numbers>
#include <set>
#include <string>
#include <thread>

namespace palpate::testing {

struct DeviceLawOptions {
  int ticks = 1000;           ///< so many reads and writes
  double force = 0.0;         ///< N, at most the device's `max_force`: comes and goes along sin², to six sides in turn. 0 for a device in somebody's hand
  bool paced = false;         ///< one tick a period of the clock, as a device of metal needs; otherwise as fast as they go
  bool may_fail = false;      ///< reads and writes may fail; false: each failure is a violation
  double patience = 5.0;      ///< s, that a device with a clock of its own may take longer than its rate says
};

/// `ticks` times a read and a write of zero, and nothing else: count the allocations about it.
template <RealScalar Scalar, class Device>
  requires HapticDevice<Device, Scalar>
void serve(Device& device, DeviceState<Scalar>& state, int ticks) noexcept {
  for (int tick = 0; tick < ticks; ++tick) {
    static_cast<void>(device.read(state));
    static_cast<void>(device.write(Wrench<Scalar>{}));
  }
}

namespace detail {

template <class A, class B>
bool same_capabilities(A const& a, B const& b) {
  auto const same = [](DeviceValue const& x, DeviceValue const& y) { return x.value == y.value && x.provenance == y.provenance; };
  return same(a.max_force, b.max_force) && same(a.rate, b.rate) && same(a.max_torque, b.max_torque) && a.reports_velocity == b.reports_velocity &&
         a.reports_orientation == b.reports_orientation && a.reports_gripper == b.reports_gripper && a.buttons == b.buttons && a.moves_a_hand == b.moves_a_hand &&
         same(a.continuous_force, b.continuous_force) && same(a.max_stiffness, b.max_stiffness) && same(a.max_damping, b.max_damping) &&
         same(a.mass, b.mass) && same(a.damping, b.damping) && same(a.friction, b.friction) && same(a.resolution, b.resolution) &&
         a.workspace.lower == b.workspace.lower && a.workspace.upper == b.workspace.upper && a.workspace.provenance == b.workspace.provenance;
}

/// The laws of one tick; each that is broken is told once, with the tick.
template <RealScalar Scalar, class Device>
class DeviceTicks {
 public:
  DeviceTicks(Device& device, Capabilities const& capabilities, DeviceLawOptions const& options, Violations& found)
      : device_(device), capabilities_(capabilities), options_(options), found_(found) {
    state_.velocity.setConstant(Scalar(12345.5));   // what a device does not measure it must not touch
    state_.angular_velocity.setConstant(Scalar(-54321.5));
    state_.orientation = Eigen::Quaternion<Scalar>(Scalar(0.5), Scalar(-0.5), Scalar(0.5), Scalar(-0.5));
    state_.gripper = Scalar(-17.25);
    untouched_ = state_;
  }

  void run() {
    read();
    write(push());
    ++tick_;
  }
  /// A side lasts a sixth of the run, and a tenth of a second at least, which bounds how fast the force changes.
  Wrench<Scalar> push() const noexcept {
    int const lasts = std::max(options_.ticks / 6, static_cast<int>(std::min(std::ceil(0.1 * capabilities_.rate), 1e9)));
    int const side = tick_ / lasts % 6;
    double const wave = std::sin(std::numbers::pi * (tick_ % lasts) / lasts);
    Wrench<Scalar> wrench;
    wrench.force[side / 2] = static_cast<Scalar>((side % 2 == 0 ? options_.force : -options_.force) * wave * wave);
    return limited(wrench, capabilities_);
  }
  void write(Wrench<Scalar> const& wrench) {
    DeviceStatus const status = device_.write(wrench);
    if (is_unknown(status)) tell("written", "write() gives a status that does not exist");
    if (!is_usable(status) && !options_.may_fail) tell("write", "write() says \"", to_string(status), "\"");
  }
  void end() {
    if (usable_ == 0 && !options_.may_fail) tell("none", "no read gave a sample");
    double const allowed = 0.2 * moved_ + 4.0 * windows_ * capabilities_.resolution + 1e-6;
    if (error_ > allowed)
      tell("velocity", "velocities do not fit positions: in pieces of 20 ticks they sum up to ", moved_, " m of motion and miss the positions by ",
           error_, " m; is the velocity in m/s, and the rate right? A device of metal needs .paced");
  }

 private:
  static bool is_unknown(DeviceStatus status) noexcept { return std::string(to_string(status)) == "unknown"; }

  template <class... Parts>
  void tell(char const* law, Parts const&... parts) {
    if (told_.insert(law).second) found_.push_back(palpate::detail::message("tick ", tick_, ": ", parts...));
  }

  void read() {
    DeviceState<Scalar> const before = state_;
    DeviceStatus const status = device_.read(state_);
    if (is_unknown(status)) tell("status", "read() gives a status that does not exist");
    if (!is_usable(status)) {
      if (!options_.may_fail) tell("read", "read() says \"", to_string(status), "\"");
      if (!(state_.position == before.position && state_.velocity == before.velocity && state_.buttons == before.buttons &&
            state_.orientation.coeffs() == before.orientation.coeffs() && state_.angular_velocity == before.angular_velocity))
        tell("failed", "read() failed and changed the state; a failed read leaves it as it was");
      state_ = before;
      in_window_ = -1;
      return;
    }
    ++usable_;
    if (!is_finite(state_.position)) tell("position", "the position is not finite");
    if (capabilities_.reports_velocity && !is_finite(state_.velocity)) tell("speed", "the velocity is not finite");
    if (!capabilities_.reports_velocity && state_.velocity != untouched_.velocity)
      tell("no velocity", "the velocity was written, but capabilities() say that it is not reported");
    if (!capabilities_.reports_orientation &&
        (state_.orientation.coeffs() != untouched_.orientation.coeffs() || state_.angular_velocity != untouched_.angular_velocity))
      tell("no orientation", "orientation or angular velocity was written, but capabilities() say that they are not reported");
    if (capabilities_.reports_orientation && !(std::abs(state_.orientation.norm() - Scalar(1)) <= Scalar(1e-5)))
      tell("unit", "the orientation has length ", state_.orientation.norm(), "; it must be a unit quaternion");
    if (!capabilities_.reports_gripper && state_.gripper != untouched_.gripper && state_.gripper != Scalar(1))   // open, as a new state says
      tell("no gripper", "the gripper was written, but capabilities() say that it is not reported");
    if (capabilities_.reports_gripper && !(state_.gripper >= 0 && state_.gripper <= 1))
      tell("gripper", "the gripper is ", state_.gripper, "; it must be from 0, closed, to 1, open");
    if (capabilities_.buttons < 32 && (state_.buttons >> capabilities_.buttons) != 0)
      tell("buttons", "button bits ", state_.buttons, " are set; capabilities() tell of ", capabilities_.buttons, " buttons");
    compare(status);
  }

  /// Sums up how far velocities carry in pieces of 20 ticks, and by how much that misses the positions.
  void compare(DeviceStatus status) {
    if (!capabilities_.reports_velocity || !is_finite(state_.position) || !is_finite(state_.velocity)) return;
    Vector3<double> const x = state_.position.template cast<double>(), v = state_.velocity.template cast<double>();
    if (status != DeviceStatus::ok) {
      in_window_ = -1;
      return;
    }
    if (in_window_ < 0) {
      begin_ = x, path_.setZero();
      in_window_ = 0;
    } else {
      path_ += (last_ + v) / (2.0 * capabilities_.rate);
      if (++in_window_ == 20) {
        error_ += (x - begin_ - path_).norm(), moved_ += path_.norm();
        ++windows_;
        begin_ = x, path_.setZero();
        in_window_ = 0;
      }
    }
    last_ = v;
  }

  Device& device_;
  Capabilities const& capabilities_;
  DeviceLawOptions const& options_;
  Violations& found_;
  std::set<std::string> told_;
  DeviceState<Scalar> state_, untouched_;
  int tick_ = 0, usable_ = 0;
  Vector3<double> begin_ = Vector3<double>::Zero(), path_ = Vector3<double>::Zero(), last_ = Vector3<double>::Zero();
  int in_window_ = -1, windows_ = 0;
  double error_ = 0.0, moved_ = 0.0;   // m
};

/// `ticks` calls of `body`, from the device's own clock or from here.
template <class Device, class Body>
void run_ticks(Device& device, double rate, DeviceLawOptions const& options, Violations& found, Body& body) {
  using Clock = std::chrono::steady_clock;
  auto const now = Clock::now();
  if constexpr (SelfClocked<Device>) {
    struct Context {
      Body& body;
      int left;
      std::atomic<int> calls = 0;
    } context{body, options.ticks};
    device.start(
        [](void* pointer) noexcept {
          auto& c = *static_cast<Context*>(pointer);
          if (c.calls < c.left) c.body();
          ++c.calls;
        },
        &context);
    auto const until = now + std::chrono::duration<double>(options.ticks / rate + options.patience);
    while (context.calls < options.ticks && Clock::now() < until) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    device.stop();
    int const calls = context.calls;
    if (calls < options.ticks)
      found.push_back(palpate::detail::message("the device's clock ticked ", calls, " times where ", options.ticks, " were to come"));
    std::this_thread::sleep_for(std::chrono::duration<double>(5.0 / rate));
    if (context.calls != calls) found.push_back("the device's clock ticks after stop() has returned");
    device.stop();
  } else {
    for (int tick = 0; tick < options.ticks; ++tick) {
      if (options.paced) std::this_thread::sleep_until(now + std::chrono::duration<double>(tick / rate));
      body();
    }
  }
}

struct LawOptionRefused : InvalidArgument {
  using InvalidArgument::InvalidArgument;
};

/// Whatever way a check ends early: no force, motors off, closed.
template <RealScalar Scalar, class Device>
class EndsSafely {
 public:
  explicit EndsSafely(Device& device) noexcept : device_(device) {}
  EndsSafely(EndsSafely const&) = delete;
  EndsSafely& operator=(EndsSafely const&) = delete;
  ~EndsSafely() {
    if (opened) static_cast<void>(device_.write(Wrench<Scalar>{}));
    if constexpr (Armable<Device>) {
      if (armed) device_.disarm();
    }
    if constexpr (OpensAndCloses<Device>) {
      if (!closed) device_.close();
    }
  }

  bool opened = !OpensAndCloses<Device>, armed = false, closed = false;

 private:
  Device& device_;
};

}  // namespace detail

/// Checks a device against what `concept.hpp` says beyond syntax, whatever it is made of; a closed device is opened, served and closed again, twice:
///   capabilities are valid once it is open and stay the same; closing twice, opening after closing, disarming twice and a write before the first
///   read do no harm; samples are finite, orientations are unit quaternions; fields that it does not measure are not touched; buttons are those that
///   it has; a failed read leaves the state as it was; velocities fit the positions (to a fifth); faults come to an end; a clock ticks, and not after
///   `stop`. What needs a user's hand to be calibrated is told as a violation.
/// However it ends, the last write is zero, the motors are off and the device is closed.
/// Errors     what the device throws becomes a violation. `InvalidArgument` for a `.force` that is negative, not finite or above the device's
///            `max_force`. Allocations: see `serve`.
template <RealScalar Scalar = double, class Device>
  requires HapticDevice<Device, Scalar>
Violations check_device(Device& device, DeviceLawOptions const& options = {}) {
  using palpate::detail::message;
  static_assert(sizeof(palpate::detail::DeviceRefinements<Device>) > 0);
  palpate::detail::OptionCheck{"DeviceLawOptions", true}(options.force >= 0.0, ".force", options.force, " N", "give a finite one, zero or more");
  Violations found;
  try {
    detail::EndsSafely<Scalar, Device> end(device);
    if constexpr (OpensAndCloses<Device>) {
      device.close();
      device.open();
      end.opened = true;
    }
    Capabilities const capabilities = device.capabilities();
    require_valid(capabilities);
    if (options.force > capabilities.max_force)
      throw detail::LawOptionRefused(message("DeviceLawOptions: .force is ", options.force, " N, and the device's max_force ",
                                             capabilities.max_force.value, " N; give at most that"));
    detail::DeviceTicks<Scalar, Device> ticks(device, capabilities, options, found);
    ticks.write(Wrench<Scalar>{});
    if constexpr (DescribesItself<Device>) {
      DeviceDescription const one = device.description(), two = device.description();
      if (one.vendor != two.vendor || one.model != two.model || one.serial != two.serial || one.driver != two.driver)
        found.push_back("description() says something else the second time");
    }
    if constexpr (Calibratable<Device>) {
      DeviceState<Scalar> state;
      for (int tick = 0; tick < options.ticks && device.calibration() == Calibration::needs_update; ++tick) {
        device.calibrate();
        serve(device, state, 1);
      }
      if (Calibration const is = device.calibration(); is != Calibration::good) found.push_back(message("the calibration ", to_string(is)));
    }
    if constexpr (Armable<Device>) {
      end.armed = true;   // half of the motors may be on when arm() throws
      device.arm();
    }
    auto body = [&] { ticks.run(); };
    detail::run_ticks(device, capabilities.rate, options, found, body);
    ticks.end();
    if (!detail::same_capabilities(capabilities, device.capabilities())) found.push_back("capabilities() changed while the device was open");
    static_cast<void>(device.write(Wrench<Scalar>{}));
    if constexpr (Armable<Device>) {
      device.disarm();
      device.disarm();
      end.armed = false;
    }
    if constexpr (ReportsFaults<Device>) {
      int faults = 0;
      while (auto const fault = device.pop_fault()) {
        if (fault->what == nullptr) found.push_back("a fault of pop_fault() has no words; give static ones, or \"\"");
        if (!options.may_fail && faults == 0)
          found.push_back(message("pop_fault() tells of \"", fault->what == nullptr ? "" : fault->what, "\", ", fault->native_code));
        if (++faults > 100000) {
          found.push_back("pop_fault() never comes to an end");
          break;
        }
      }
    }
    if constexpr (OpensAndCloses<Device>) {
      end.opened = false;
      device.close();
      device.close();
      device.open();
      end.opened = true;
      if (!detail::same_capabilities(capabilities, device.capabilities())) found.push_back("capabilities() differ after closing and opening again");
      DeviceState<Scalar> state;
      bool reads = SelfClocked<Device>;   // its reads are for its own thread
      for (int tick = 0; tick < options.ticks && !reads; ++tick) reads = is_usable(device.read(state));
      if (!reads) found.push_back("no read succeeds after closing and opening again");
      static_cast<void>(device.write(Wrench<Scalar>{}));
      device.close();
      end.opened = false, end.closed = true;
    }
  } catch (detail::LawOptionRefused const&) {
    throw;
  } catch (std::exception const& error) {
    found.push_back(message("the device threw: ", error.what()));
  }
  return found;
}

/// For what is no device: says why.
template <RealScalar Scalar = double, class Device>
Violations check_device(Device&, DeviceLawOptions const& = {}) {
  static_assert(sizeof(palpate::detail::DeviceSentences<Device, Scalar>) > 0);
  return {};
}

}  // namespace palpate::testing
