// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/device/concept.hpp>
#include <palpate/device/phantom/library.hpp>
#include <palpate/device/phantom/opening.hpp>
#include <palpate/device/phantom/options.hpp>
#include <palpate/device/phantom/runtime.hpp>
#include <palpate/device/phantom/servo.hpp>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

namespace palpate {

/// A PHANToM of SensAble, Geomagic or 3D Systems: Omni, Touch, Desktop, Touch X, Premium. The vendor's libHD is loaded when the device is opened;
/// nothing of it is needed to build.
///
///   PhantomDevice device({.device = "Left Device"});
///   DeviceSession const session(device);   // opens and arms
///
/// The driver calls back from its own thread, once a tick, for all devices. Two ways to meet it:
///   start(tick, context)   the tick runs in that thread, where read and write are the device itself: no delay
///   read and write         from a thread of the host's, once a tick: the newest state and the newest force are exchanged without waiting, which
///                          costs up to a tick each way. A force that is not written anew for options.held becomes zero.
/// Units      SI; mm and mN·m of the driver are converted. Frame: x to the right, y up, z towards the user, origin near the middle of the workspace.
/// Errors     PhantomError from open, arm and start, in one line; faults later: the status of read and write, and pop_fault. A device that was at
///            fault or silent for options.silence stays so until it is opened again. No wait is without end, but for a tick of the host's that does
///            not return.
/// Threads    open, close, arm, disarm, start and stop from one thread; read, write and pop_fault from one, as said, not while this device is opened
///            or closed; calibrate, calibration and counts from any between the two. Other devices may be opened and closed at any time.
/// Cost       read and write: wait-free, noexcept, no allocation. open takes as long as the driver does, up to options.timeout.
/// Limits     written to published facts and tested against a stand-in for the library; it has met no real device yet. 64-bit Linux.
class PhantomDevice {
  using Servo = detail::phantom::Servo;
  using Runtime = detail::phantom::Runtime;

 public:
  explicit PhantomDevice(PhantomOptions options = {}) : options_(std::move(options)) {
    options_.validate();
    facts_.capabilities = {.max_force = guessed(std::min(options_.max_force, 3.3)),
                           .rate = guessed(options_.rate),
                           .reports_velocity = true,
                           .reports_orientation = true,
                           .buttons = 4};
  }

  PhantomDevice(PhantomDevice&&) = default;
  PhantomDevice& operator=(PhantomDevice&&) = delete;
  ~PhantomDevice() { close(); }

  /// Loads the library if need be, opens the device and starts the driver's clock. The motors are off.
  void open() {
    if (opened_) throw InvalidArgument("PhantomDevice: it is open already; close it first");
    auto const facts = std::make_shared<detail::phantom::Facts>();
    auto servo =
        runtime().open(options_.library, who(), options_.rate,
                       options_.timeout, [facts, options = options_](detail::phantom::Functions const& hd, std::size_t others) {
                         return detail::phantom::open_device(hd, others, options, *facts);
                       });
    opened_ = servo_ = std::move(servo);
    facts_ = *facts;
    facts_.capabilities.moves_a_hand = !runtime().has_virtual_clock();
    lost_ = lost_told_ = waits_ = false;
    if (!wait(options_.timeout, [&] { return servo_->ticks.load() > 0; })) {
      close();
      throw PhantomError(PhantomProblem::timeout, detail::message("the driver's clock was started, but it has not called within ", options_.timeout,
                                                                  " s; run the vendor's diagnosis, and check that the driver fits this system"));
    }
  }
  /// Also from the tick, where it takes no lock and allocates nothing: the motors go off in the next one, and the driver lets the device go after it.
  void close() noexcept {
    if (!opened_) return;
    stop();
    servo_->force_wanted.store(false);
    opened_.reset();   // servo_ has it still: nothing is freed here
    runtime().close(*servo_, options_.timeout);
  }

  /// Switches the motors on; from then on the force rises to what is written within options.ramp.
  void arm() {
    require_open("arm");
    if (DeviceStatus const now = servo_->status.load(); !is_usable(now))
      throw PhantomError(PhantomProblem::driver,
                         detail::message("the motors of ", who(), " stay off: the device is at fault (", to_string(now), "); close it and open it again"));
    if (options_.calibrated_only) require_calibration();
    servo_->force_wanted.store(true);
    if (!wait(options_.timeout, [&] { return servo_->force_on.load() || !is_usable(servo_->status.load()); }) || !servo_->force_on.load()) {
      servo_->force_wanted.store(false);
      throw PhantomError(is_usable(servo_->status.load()) ? PhantomProblem::timeout : PhantomProblem::driver,
                         detail::message("the motors of ", who(), " were not switched on; ask pop_fault() what the driver said"));
    }
  }
  void disarm() noexcept {
    if (!opened_) return;
    servo_->force_wanted.store(false);
    if (on_servo_thread()) return;   // from the next tick on
    static_cast<void>(wait(0.1, [&] { return !servo_->force_on.load() || !is_usable(servo_->status.load()); }));
  }

  DeviceStatus read(DeviceState<double>& state) noexcept {
    if (!opened_) return DeviceStatus::disconnected;
    if (within_tick()) return servo_->latched(state);
    if (DeviceStatus const now = servo_->status.load(); !is_usable(now)) return now;
    if (servo_->self_clocked.load() != nullptr) return DeviceStatus::stale;   // the tick's alone
    if (lost_) return DeviceStatus::disconnected;
    bool fresh = servo_->states.fetch();
    if (!fresh && runtime().has_virtual_clock()) {
      runtime().advance();
      if (DeviceStatus const now = servo_->status.load(); !is_usable(now)) return now;
      fresh = servo_->states.fetch();
    }
    unsigned const turn = runtime().turns();
    bool const stands_still = turn % 2 == 0;   // for another device, which has its own timeout
    if (fresh) {
      waits_ = false;
    } else if (auto const now = Clock::now(); !std::exchange(waits_, true) || turn != waits_in_) {
      waits_since_ = now;
      waits_in_ = turn;
    } else if (std::chrono::duration<double>(now - waits_since_).count() > options_.silence + (stands_still ? options_.timeout : 0.0)) {
      lost_ = true;
      return DeviceStatus::disconnected;
    }
    state = servo_->states.front();
    return fresh ? DeviceStatus::ok : DeviceStatus::stale;
  }

  DeviceStatus write(Wrench<double> const& wrench) noexcept {
    if (!opened_ || lost_) return DeviceStatus::disconnected;
    if (DeviceStatus const now = servo_->status.load(); !is_usable(now)) return now;
    if (within_tick())
      servo_->command(wrench);
    else if (servo_->self_clocked.load() != nullptr)
      return DeviceStatus::stale;
    else
      servo_->commands.write(wrench);
    return DeviceStatus::ok;
  }

  /// From now on the driver's thread calls tick(context) once a tick, also when the device is at fault, until `stop`.
  void start(void (*tick)(void*) noexcept, void* context) {
    require_open("start");
    if (tick == nullptr) throw InvalidArgument("PhantomDevice: start() was given no function to call");
    if (servo_->self_clocked.load() != nullptr) throw InvalidArgument("PhantomDevice: it is started already; stop it first");
    servo_->context = context;
    servo_->self_clocked.store(tick);
    runtime().release_clock(true);
  }
  void stop() noexcept {
    if (!opened_ || servo_->self_clocked.exchange(nullptr) == nullptr) return;
    if (!on_servo_thread())
      while (servo_->inside.load()) std::this_thread::sleep_for(std::chrono::microseconds(50));
    runtime().release_clock(false);
  }

  Calibration calibration() noexcept { return opened_ ? servo_->calibrated.load() : Calibration::needs_hand; }
  /// In the next ticks: the motors go off, the driver calibrates, the motors come on again. Ten times a second at most; without effect on
  /// devices whose encoders are reset by hand.
  void calibrate() noexcept {
    if (opened_) servo_->calibration_wanted.store(true);
  }
  /// What the user has to do.
  char const* calibration_advice() const noexcept {
    namespace style = detail::phantom::calibration;
    if ((facts_.styles & style::automatic) != 0) return "move the tool slowly through its workspace; the driver finds its zero by itself";
    if ((facts_.styles & style::inkwell) != 0) return "put the stylus into the inkwell and leave it there for a second";
    if ((facts_.styles & style::reset_pose) != 0)
      return "close the device, hold its links at right angles to each other with the tool pointing ahead, and open it with "
             "PhantomOptions::in_reset_pose";
    return "calibrate it in the vendor's setup program";
  }

  std::optional<DeviceFault> pop_fault() noexcept {
    if (!servo_) return std::nullopt;
    if (auto fault = servo_->faults.pop()) return fault;
    if (auto fault = servo_->ending.pop()) return fault;
    if (!lost_ || std::exchange(lost_told_, true)) return std::nullopt;
    return DeviceFault{.status = DeviceStatus::disconnected, .native_code = 0, .what = "the driver has stopped calling"};
  }

  Capabilities capabilities() const { return facts_.capabilities; }
  DeviceDescription description() const { return facts_.description; }
  /// The name that the driver took; empty: its default device.
  std::string const& name() const noexcept { return facts_.name; }
  /// The file that libHD came from; empty before the first device of the process is open.
  std::string library() const { return runtime().library_path(); }
  /// True for a stand-in for libHD whose clock goes on with each read: a run in lock-step is then reproducible.
  bool has_virtual_clock() const noexcept { return opened_ && runtime().has_virtual_clock(); }

  PhantomCounts counts() const noexcept {
    if (!servo_) return {};
    return {.ticks = servo_->ticks, .unreadable = servo_->unreadable, .force_errors = servo_->force_errors, .misuses = servo_->misuses,
            .unattended = servo_->unattended, .jumps = servo_->jumps, .gaps = servo_->gaps};
  }

 private:
  using Clock = std::chrono::steady_clock;

  static Runtime& runtime() { return Runtime::instance(); }

  bool on_servo_thread() const noexcept { return runtime().servo_thread() == std::this_thread::get_id(); }
  bool within_tick() const noexcept { return servo_->inside.load() && on_servo_thread(); }

  std::string who() const { return options_.device.empty() ? "the default PHANToM" : "the PHANToM \"" + options_.device + "\""; }

  void require_open(char const* call) const {
    if (!opened_)
      throw InvalidArgument(detail::message("PhantomDevice: ", call, "() needs an open device; call open() first, or use a DeviceSession"));
  }

  /// Until `done()`, for so many seconds of the driver's clock at most.
  template <class Done>
  bool wait(double seconds, Done done) const noexcept {
    auto const until = Clock::now() + std::chrono::duration<double>(seconds);
    bool const by_ticks = runtime().has_virtual_clock() && servo_->self_clocked.load() == nullptr;
    for (double ticks = seconds * options_.rate; by_ticks ? ticks > 0.0 : Clock::now() < until; ticks -= 1.0) {
      if (done()) return true;
      if (by_ticks)
        runtime().advance();
      else
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return done();
  }

  void require_calibration() {
    if (calibration() == Calibration::needs_update && servo_->calibrates_while_running()) {
      calibrate();
      static_cast<void>(wait(std::min(options_.timeout, 2.0), [&] { return calibration() != Calibration::needs_update; }));
    }
    if (wait(options_.calibration_patience, [&] { return calibration() == Calibration::good; })) return;
    throw PhantomError(PhantomProblem::not_calibrated,
                       detail::message("the motors of ", who(), " stay off, the calibration ", to_string(calibration()), ": ", calibration_advice(),
                                       " (PhantomOptions::calibration_patience says how long arm() waits for that)"));
  }

  PhantomOptions options_;
  detail::phantom::Facts facts_;
  std::shared_ptr<Servo> servo_;   // of the last opening: its counts and faults can be asked for afterwards
  std::shared_ptr<Servo> opened_;   // the same while it is open
  Clock::time_point waits_since_{};   // for a new state
  unsigned waits_in_ = 0;             // turn of the scheduler
  bool lost_ = false, lost_told_ = false, waits_ = false;
};

}  // namespace palpate
