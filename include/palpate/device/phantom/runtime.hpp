// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/device/phantom/control_thread.hpp>
#include <palpate/device/phantom/library.hpp>
#include <palpate/device/phantom/servo.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace palpate::detail::phantom {

/// The library's errors, newest first, until there is none.
inline std::vector<NativeError> drained(Functions const& hd) {
  std::vector<NativeError> all;
  while (all.size() < 64) {
    NativeError const error = hd.next_error();
    if (error.code == error::none) break;
    all.push_back(error);
  }
  return all;
}

/// The one thing in a process that speaks to libHD: there is one scheduler, one error stack and one current device. One callback, of the highest
/// priority, serves all devices; while a device is opened or closed the scheduler stands still and the others feel nothing for a moment.
/// Threads    Its calls come from a thread of its own (see ControlThread), one at a time; `servo` from the scheduler's.
/// Invariant  It outlives every device and is never destroyed: a driver may call back until the process ends.
class Runtime {
 public:
  static Runtime& instance() {
    static Runtime& runtime = *new Runtime;
    return runtime;
  }

  /// Runs `job(functions, others)` with the scheduler stopped; `others` is how many devices are open. A servo that it returns is attached; then the
  /// scheduler runs again. Throws what it throws, and PhantomError when the driver does not come back in time or the scheduler does not start.
  using Opening = std::function<std::shared_ptr<Servo>(Functions const& hd, std::size_t others)>;
  std::shared_ptr<Servo> open(std::string const& library, std::string const& what, double rate, double timeout, Opening const& opening) {
    std::lock_guard const one_at_a_time(control_);
    auto const result = std::make_shared<std::shared_ptr<Servo>>();
    auto job = [this, result, library, rate, opening] {
      if (!library_) library_ = std::make_unique<Library>(load_library(library));
      if (!library.empty() && library != library_->path)
        throw InvalidArgument(
            message("PhantomOptions: .library is ", library, "; this process has libHD from ", library_->path, ", and can have one"));
      if (attached() > 0 && rate != rate_)
        throw InvalidArgument(message("PhantomOptions: .rate is ", rate, " Hz; another device is open and all share one clock, of ", rate_, " Hz"));
      stop();
      rate_ = rate;
      std::shared_ptr<Servo> servo;
      try {
        servo = opening(library_->functions, attached());
        attach(servo);
        *result = servo;
        start();
      } catch (...) {
        if (servo) detach(servo);
        resume();
        throw;
      }
    };
    auto undo = [this, result] {   // it came too late: nobody has this device
      stop();
      if (*result) detach(*result);
      resume();
    };
    if (!thread_.run(timeout, std::move(job), std::move(undo)))
      throw PhantomError(PhantomProblem::timeout,
                         message("opening ", what, " took longer than ", timeout,
                                 " s and may go on for ever; end the program, switch the device off and on, and check that this driver "
                                 "fits the system (PhantomOptions::timeout says how long to wait)"));
    return *result;
  }

  /// From within a tick, and when the driver hangs for longer than `timeout`, the device is closed as soon as that is over. Within a tick it takes
  /// no lock and allocates nothing.
  void close(Servo& servo, double timeout) noexcept {
    servo.leaves.store(true);
    if (inside_.load() && servo_thread() == std::this_thread::get_id()) return thread_.wake();   // it stops after this tick
    try {
      std::lock_guard const one_at_a_time(control_);
      if (!thread_.run(timeout, [] {})) thread_.wake();   // it is closed before a job begins
    } catch (...) {
      thread_.wake();
    }
  }

  /// Does the library keep a virtual clock? Known once it is loaded.
  bool has_virtual_clock() const noexcept { return virtual_clock_.load(); }
  /// One tick of the virtual clock, unless it runs by itself.
  void advance() noexcept {
    if (has_virtual_clock() && free_clocks_.load() == 0) library_->functions.advance_clock(1);
  }
  /// While a device has the clock, a virtual one runs by the wall's.
  void release_clock(bool free) noexcept {
    int const before = free_clocks_.fetch_add(free ? 1 : -1);
    if (has_virtual_clock() && library_->functions.release_clock != nullptr && (free ? before == 0 : before == 1))
      library_->functions.release_clock(free ? 1 : 0);
  }
  /// One more at each start and each stop of the scheduler: odd while it runs.
  unsigned turns() const noexcept { return turns_.load(); }
  std::thread::id servo_thread() const noexcept { return servo_thread_.load(); }
  std::string library_path() const { return library_ ? library_->path : std::string(); }

 private:
  static constexpr double usual_rate = 1000.0;   // Hz
  static constexpr std::size_t max_devices = 8;
  static constexpr int max_errors = 32;   // a tick

  Runtime() : thread_([this] { let_go(); }) {}

  std::size_t attached() const noexcept {
    return static_cast<std::size_t>(std::count_if(servos_.begin(), servos_.end(), [](auto const& servo) { return servo != nullptr; }));
  }
  void attach(std::shared_ptr<Servo> const& servo) {
    auto const place = std::find(servos_.begin(), servos_.end(), nullptr);
    if (place == servos_.end()) {
      library_->functions.disable_device(servo->handle());
      throw PhantomError(PhantomProblem::driver, message("more than ", max_devices, " devices are open; close one first"));
    }
    *place = servo;
  }
  void detach(std::shared_ptr<Servo> const& servo) {
    auto const place = std::find(servos_.begin(), servos_.end(), servo);
    if (place == servos_.end()) return;
    library_->functions.make_current(servo->handle());
    library_->functions.disable(capability::force);
    library_->functions.disable_device(servo->handle());
    static_cast<void>(drained(library_->functions));
    *place = nullptr;
  }

  /// Closes what is to be closed.
  void let_go() {
    auto const leaving = servos_;
    if (std::none_of(leaving.begin(), leaving.end(), [](auto const& servo) { return servo && servo->leaves.load(); })) return;
    stop();
    for (auto const& servo : leaving)
      if (servo && servo->leaves.load()) detach(servo);
    resume();
  }

  void stop() {
    if (!running_) return;
    Functions const& hd = library_->functions;
    turns_.fetch_add(1);
    hd.stop_scheduler();
    for (int k = 0; inside_.load() && k < 1000; ++k)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));   // a driver that does not wait for us
    hd.unschedule(task_);
    running_ = false;
    for (auto const& servo : servos_)
      if (servo) {
        hd.make_current(servo->handle());
        hd.disable(capability::force);
        servo->interrupted();
      }
    static_cast<void>(drained(hd));
  }

  void start() {
    Functions const& hd = library_->functions;
    virtual_clock_.store(hd.advance_clock != nullptr && hd.advance_clock(0) == 0);
    last_ = Clock::time_point{};
    if (hd.set_rate != nullptr) hd.set_rate(static_cast<unsigned long>(rate_));
    if (rate_ == usual_rate)   // some devices have no other, and no function to ask for it
      static_cast<void>(drained(hd));
    refuse(hd, message("a rate of ", rate_, " Hz was refused; the usual ones are 500, 1000 and 2000"));
    task_ = hd.schedule(&Runtime::servo, this, highest_priority);
    refuse(hd, "the callback was not scheduled");
    hd.start_scheduler();
    running_ = true;
    turns_.fetch_add(1);
    try {
      refuse(hd, "the scheduler did not start");
    } catch (...) {
      stop();
      throw;
    }
  }
  void resume() {
    if (attached() > 0) start();
  }

  static void refuse(Functions const& hd, std::string const& what) {
    if (auto const errors = drained(hd); !errors.empty())
      throw PhantomError(PhantomProblem::driver,
                         message(what, ": ", said(errors.front(), hd.error_text(errors.front().code)), "; ", advice(errors.front().code)),
                         static_cast<int>(errors.front().code));
  }

  /// The scheduler's callback. Nothing in it throws: no exception passes through the driver.
  static Number servo(void* self) noexcept {
    Runtime& runtime = *static_cast<Runtime*>(self);
    Functions const& hd = runtime.library_->functions;
    runtime.inside_.store(true);
    runtime.servo_thread_.store(std::this_thread::get_id(), std::memory_order_relaxed);
    auto const now = Clock::now();
    bool const by_the_wall = !runtime.has_virtual_clock() && runtime.last_ != Clock::time_point{};
    bool const gap = by_the_wall && now - runtime.last_ > longest_gap;
    double const passed = by_the_wall ? std::chrono::duration<double>(now - runtime.last_).count() * runtime.rate_ : 1.0;   // periods
    runtime.last_ = now;
    for (auto const& servo : runtime.servos_) {
      if (!servo) continue;
      servo->tick(hd, gap, passed);
      runtime.distribute(hd, *servo);
      servo->publish(hd);
    }
    runtime.inside_.store(false);
    return callback_continues;
  }

  /// Errors that came in this device's frame, oldest first; one that names another device is that one's.
  void distribute(Functions const& hd, Servo& here) noexcept {
    std::array<NativeError, max_errors> errors;
    std::size_t count = 0;
    for (; count < errors.size(); ++count) {
      errors[count] = hd.next_error();
      if (errors[count].code == error::none) break;
    }
    auto const deliver = [&](NativeError const& error) {
      Servo* whose = &here;
      for (auto const& servo : servos_)
        if (servo && servo->handle() == error.device) whose = servo.get();
      whose->take(hd, error);
    };
    here.take_early(deliver);
    while (count > 0) deliver(errors[--count]);
  }

  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds longest_gap{50};

  std::mutex control_;
  ControlThread thread_;
  std::unique_ptr<Library> library_;   // once there, for ever
  std::array<std::shared_ptr<Servo>, max_devices> servos_;   // changed only while the scheduler stands still
  Task task_ = 0;
  bool running_ = false;
  double rate_ = 0.0;   // Hz
  Clock::time_point last_;   // tick
  std::atomic<unsigned> turns_{0};
  std::atomic<bool> virtual_clock_{false};
  std::atomic<bool> inside_{false};   // the callback
  std::atomic<int> free_clocks_{0};
  std::atomic<std::thread::id> servo_thread_{};
};

}  // namespace palpate::detail::phantom
