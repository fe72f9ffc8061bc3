// SPDX-License-Identifier: MIT
#pragma once

#include "control.hpp"
#include "device.hpp"
#include "parameters.hpp"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <thread>

/// What of the stand-in is seen from outside: C functions of the vendor's names.
#define PALPATE_FAKE_EXPORT __attribute__((visibility("default")))

namespace fake_libhd {

using Code = unsigned;
using Callback = Code (*)(void*);
constexpr unsigned nobody = 0xFFFFFFFFu;
constexpr double rate_default = 1000.0;

struct Entry {
  Code code;
  int internal;
  unsigned device;
};

struct Task {
  unsigned long handle = 0;   // 0: free
  Callback call = nullptr;
  void* context = nullptr;
  unsigned priority = 0, order = 0;
};

struct Library {
  Control control;
  Device devices[4];
  unsigned current = nobody;
  double rate = rate_default;
  bool licensed = false;

  std::mutex errors_mutex;
  Entry errors[64];
  int error_count = 0;

  Task tasks[8];
  unsigned long last_task = 0;

  std::thread thread;
  std::atomic<std::thread::id> servo{};
  std::atomic<bool> running{false};
  std::mutex mutex;
  std::condition_variable changed;
  bool quit = false, free = false;
  std::uint64_t requested = 0, done = 0;
  std::chrono::steady_clock::time_point tick_began{};
};

inline Library& lib() {
  static Library& library = *[] {   // the driver's thread may outlast everything
    auto* const made = new Library;
    char const* const clock = std::getenv("PALPATE_FAKE_LIBHD_CLOCK");
    made->control.plan.real_clock = clock != nullptr && std::strcmp(clock, "real") == 0;
    return made;
  }();
  return library;
}

inline Plan& plan() { return lib().control.plan; }

inline void fail(Code code, unsigned device) {
  Library& l = lib();
  std::lock_guard const lock(l.errors_mutex);
  if (l.error_count < 64) l.errors[l.error_count++] = {code, 7, device};
}

inline void violate(char const* rule) {
  lib().control.violations.fetch_add(1);
  lib().control.violation.store(rule);
}

inline bool in_servo() { return lib().servo.load() == std::this_thread::get_id(); }

/// May this thread speak to a device now?
inline bool legal(char const* call) {
  lib().control.calls.fetch_add(1);
  if (!lib().running.load() || in_servo()) return true;
  violate(call);
  return false;
}

inline Device* current() {
  Library& l = lib();
  return l.current < 4 && l.devices[l.current].open ? &l.devices[l.current] : nullptr;
}

}  // namespace fake_libhd
