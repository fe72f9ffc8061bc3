// SPDX-License-Identifier: MIT
// The stand-in's scheduler: a virtual clock, a tick for each palpate_advance_clock(1), or the wall's.
#include "library.hpp"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <mutex>
#include <thread>

using namespace fake_libhd;

namespace {

void sort_tasks() {   // by priority; those of one are shuffled by the seed
  for (Task& task : lib().tasks) task.order = static_cast<unsigned>(task.handle * 2654435761u) ^ (plan().seed * 40503u);
  std::sort(std::begin(lib().tasks), std::end(lib().tasks),
            [](Task const& a, Task const& b) { return a.priority != b.priority ? a.priority > b.priority : a.order < b.order; });
}

void one_tick() {
  Library& l = lib();
  std::uint64_t const tick = l.control.ticks.load();
  l.tick_began = std::chrono::steady_clock::now();
  double const h = 1.0 / l.rate;
  for (Mishap const& mishap : plan().mishaps)
    if (mishap.code != 0 && tick >= mishap.tick && tick < mishap.tick + mishap.ticks) {
      fail(mishap.code, mishap.device);
      if (mishap.code == 0x302 || mishap.code == 0x303) l.devices[mishap.device].gone = true;
    }
  if (plan().drifts_at != 0 && plan().drifts_at == tick)
    for (Device& device : l.devices) {
      device.calibration = 0x5001;
      device.off_by_jump = true;
    }
  if (plan().stall_milliseconds > 0 && plan().stall_at == tick) std::this_thread::sleep_for(std::chrono::milliseconds(plan().stall_milliseconds));
  for (Task& task : l.tasks) {
    if (task.handle == 0) continue;
    if (plan().around_callback != nullptr) plan().around_callback(true);
    Code const more = task.call(task.context);
    if (plan().around_callback != nullptr) plan().around_callback(false);
    if (more == 0) task = {};
  }
  for (unsigned i = 0; i < 4; ++i) {
    Device& device = l.devices[i];
    if (!device.open) continue;
    if (device.in_frame) {
      violate("a frame is open at the end of the tick");
      device.in_frame = false;
    }
    if (device.framed_in != tick + 1) device.felt = {};   // not served in this tick
    Seen& seen = l.control.seen[i];
    for (std::size_t k = 0; k < 3; ++k) {
      seen.force[k].store(device.felt[k]);
      seen.torque[k].store(device.motors ? device.torque[k] : 0.0);
    }
    device.move(plan(), h);
    for (std::size_t k = 0; k < 3; ++k) seen.position[k].store(device.tip[k]);
    seen.motors.store(device.motors);
  }
  l.control.ticks.store(tick + 1);
}

void scheduler() {
  Library& l = lib();
  l.servo.store(std::this_thread::get_id());
  auto next = std::chrono::steady_clock::now();
  std::unique_lock lock(l.mutex);
  while (!l.quit) {
    bool const by_wall = plan().real_clock || l.free;
    if (by_wall || plan().scheduler_is_silent) {
      next = std::max(next + std::chrono::nanoseconds(static_cast<long long>(1e9 / l.rate)),
                      std::chrono::steady_clock::now() - std::chrono::milliseconds(5));
      l.changed.wait_until(lock, next, [&] { return l.quit; });
    } else {
      l.changed.wait(lock, [&] { return l.quit || l.free || l.requested > l.done; });
      next = std::chrono::steady_clock::now();
    }
    if (l.quit || (!by_wall && l.requested == l.done)) continue;
    if (!plan().scheduler_is_silent) {
      lock.unlock();
      one_tick();
      lock.lock();
    }
    if (l.requested > l.done) ++l.done;
    l.changed.notify_all();
  }
}

}  // namespace

extern "C" {

PALPATE_FAKE_EXPORT Control* fake_libhd_control() { return &lib().control; }

PALPATE_FAKE_EXPORT void fake_libhd_reset() {
  Library& l = lib();
  bool const real = plan().real_clock;
  plan() = Plan{};
  plan().real_clock = real && std::getenv("PALPATE_FAKE_LIBHD_CLOCK") != nullptr;
  for (Device& device : l.devices) device = Device{};
  for (Seen& seen : l.control.seen) seen.calibrations = seen.calibrations_under_force = seen.frames = 0;
  l.control.starts = l.control.stops = l.control.inits = l.control.disables = l.control.violations = 0;
  l.control.violation = "";
  l.control.init_in_plain_locale = l.control.calibration_in_plain_locale = false;
  l.error_count = 0;
  l.rate = rate_default;
  l.licensed = false;
}

PALPATE_FAKE_EXPORT int palpate_advance_clock(int ticks) {
  Library& l = lib();
  if (plan().real_clock) return -1;
  if (ticks <= 0 || !l.running.load()) return 0;
  if (in_servo()) {
    violate("the clock is advanced from within a tick");
    return 0;
  }
  std::unique_lock lock(l.mutex);
  if (l.free) return 0;
  l.requested += static_cast<std::uint64_t>(ticks);
  l.changed.notify_all();
  l.changed.wait(lock, [&] { return l.quit || l.done == l.requested; });
  return ticks;
}

PALPATE_FAKE_EXPORT void palpate_release_clock(int free) {
  std::lock_guard const lock(lib().mutex);
  lib().free = free != 0;
  lib().changed.notify_all();
}

PALPATE_FAKE_EXPORT void hdStartScheduler() {
  Library& l = lib();
  l.control.calls.fetch_add(1);
  if (l.running.load()) return violate("the scheduler is started twice");
  if (plan().start_error != 0) return fail(plan().start_error, nobody);
  sort_tasks();
  l.control.starts.fetch_add(1);
  l.control.ticks.store(0);
  for (Device& device : l.devices) device.framed_in = 0;
  l.quit = false;
  l.requested = l.done = 0;
  l.running.store(true);
  l.thread = std::thread(scheduler);
}
PALPATE_FAKE_EXPORT void hdStopScheduler() {
  Library& l = lib();
  l.control.calls.fetch_add(1);
  if (!l.running.load()) return;
  if (in_servo()) return violate("the scheduler is stopped from within a tick");
  {
    std::lock_guard const lock(l.mutex);
    l.quit = true;
    l.changed.notify_all();
  }
  l.thread.join();
  l.servo.store({});
  l.running.store(false);
  l.control.stops.fetch_add(1);
}

PALPATE_FAKE_EXPORT unsigned long hdScheduleAsynchronous(Callback call, void* context, unsigned short priority) {
  Library& l = lib();
  if (!legal("hdScheduleAsynchronous")) return 0;
  for (Task& task : l.tasks)
    if (task.handle == 0) {
      task = {++l.last_task, call, context, priority, 0};
      return task.handle;
    }
  fail(0x501, nobody);
  return 0;
}
PALPATE_FAKE_EXPORT void hdScheduleSynchronous(Callback call, void* context, unsigned short) {
  if (legal("hdScheduleSynchronous")) call(context);   // at once: the scheduler stands still, or this is its thread
}
PALPATE_FAKE_EXPORT void hdUnschedule(unsigned long handle) {
  if (!legal("hdUnschedule")) return;
  for (Task& task : lib().tasks)
    if (task.handle == handle && handle != 0) {
      task = {};
      return;
    }
  fail(0x101, nobody);
}
PALPATE_FAKE_EXPORT unsigned char hdWaitForCompletion(unsigned long handle, Code) {
  for (Task const& task : lib().tasks)
    if (task.handle == handle) return 1;
  return 0;
}
PALPATE_FAKE_EXPORT double hdGetSchedulerTimeStamp() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - lib().tick_began).count();
}
PALPATE_FAKE_EXPORT void hdSetSchedulerRate(unsigned long hertz) {
  lib().control.calls.fetch_add(1);
  if (hertz != 500 && hertz != 1000 && hertz != 2000) return fail(0x101, nobody);
  lib().rate = static_cast<double>(hertz);
}

}  // extern "C"
