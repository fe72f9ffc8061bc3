// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/simulator/realtime_options.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <mutex>

#if defined(__linux__)
#include <cerrno>
#include <fcntl.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>
#endif

/// The single requests of a RealtimeThread. Each asks, reads back, fills in its line of the report, and takes back at its end what it changed.
namespace palpate::detail {

#if defined(__linux__)

inline constexpr std::string_view not_kept = "the system agreed, and reads back something else";

/// SCHED_FIFO for the calling thread.
class FifoPriority {
 public:
  void ask(int priority, RealtimeItem& item) noexcept {
    item.asked = true;
    if (::pthread_getschedparam(::pthread_self(), &policy_before_, &before_) != 0) {
      item.reason = "the thread's present priority can not be read, so it could not be restored";
      return;
    }
    ::sched_param wanted{};
    wanted.sched_priority = priority;
    int const error = ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &wanted);
    if (error != 0) {
      item.reason = error == EPERM ? "needs CAP_SYS_NICE or `ulimit -r` of at least the priority (rtprio in /etc/security/limits.conf), and a "
                                     "control group with time for it"
                                   : "this system has no such policy or priority";
      return;
    }
    changed_ = true;
    // Not pthread_getschedparam: that gives what was set, without asking the kernel.
    ::sched_param got{};
    int const policy = ::sched_getscheduler(0);
    item.found = ::sched_getparam(0, &got) == 0 ? got.sched_priority : -1;
    item.granted = policy == SCHED_FIFO && item.found == priority;
    if (!item.granted) item.reason = not_kept;
  }
  ~FifoPriority() {
    if (changed_) ::pthread_setschedparam(::pthread_self(), policy_before_, &before_);
  }

 private:
  bool changed_ = false;
  int policy_before_ = 0;
  ::sched_param before_{};
};

/// The calling thread on one core.
class OwnCore {
 public:
  void ask(int core, RealtimeItem& item) noexcept {
    item.asked = true;
    if (::sched_getaffinity(0, sizeof before_, &before_) != 0) {
      item.reason = "the thread's present cores can not be read, so they could not be restored";
      return;
    }
    ::cpu_set_t wanted;
    CPU_ZERO(&wanted);
    CPU_SET(static_cast<unsigned>(core), &wanted);
    if (::sched_setaffinity(0, sizeof wanted, &wanted) != 0) {
      item.reason = "there is no such core, or this process may not use it (control group)";
      return;
    }
    changed_ = true;
    ::cpu_set_t got;
    CPU_ZERO(&got);
    item.granted = ::sched_getaffinity(0, sizeof got, &got) == 0 && CPU_EQUAL(&got, &wanted);
    item.found = ::sched_getcpu();
    if (!item.granted) item.reason = not_kept;
  }
  ~OwnCore() {
    if (changed_) ::sched_setaffinity(0, sizeof before_, &before_);
  }

 private:
  bool changed_ = false;
  ::cpu_set_t before_{};
};

/// By how much an ordinary thread may be woken late, so that wake-ups can be joined. SCHED_FIFO has none.
class TimerSlack {
 public:
  void ask(RealtimeItem& item) noexcept {
    item.asked = true;
    before_ = ::prctl(PR_GET_TIMERSLACK, 0, 0, 0, 0);
    changed_ = before_ > 1 && ::prctl(PR_SET_TIMERSLACK, 1UL, 0, 0, 0) == 0;
    item.found = ::prctl(PR_GET_TIMERSLACK, 0, 0, 0, 0);
    item.granted = item.found == 0 || item.found == 1;
    if (!item.granted) item.reason = "this kernel keeps its slack";
  }
  ~TimerSlack() {
    if (changed_) ::prctl(PR_SET_TIMERSLACK, static_cast<unsigned long>(before_), 0, 0, 0);
  }

 private:
  bool changed_ = false;
  int before_ = 0;   // ns
};

/// A request to the whole machine that lasts while the file is open.
class NoDeepSleep {
 public:
  void ask(RealtimeItem& item) noexcept {
    item.asked = true;
    file_ = ::open("/dev/cpu_dma_latency", O_RDWR | O_CLOEXEC);
    if (file_ < 0) {
      item.reason = errno == ENOENT ? "this system has no /dev/cpu_dma_latency"
                                    : "needs the right to write to /dev/cpu_dma_latency (root, or a udev rule)";
      return;
    }
    std::int32_t const none = 0;   // µs
    std::int32_t got = -1;
    bool const asked = ::write(file_, &none, sizeof none) == static_cast<::ssize_t>(sizeof none);
    bool const read = ::pread(file_, &got, sizeof got, 0) == static_cast<::ssize_t>(sizeof got);
    item.found = got;
    item.granted = asked && read && got == none;
    if (!item.granted) item.reason = not_kept;
  }
  ~NoDeepSleep() {
    if (file_ >= 0) ::close(file_);
  }

 private:
  int file_ = -1;
};

/// KiB of this process that are locked; −1 when it can not be read.
inline long long locked_kib() noexcept {
  std::array<char, 8192> text{};
  int const file = ::open("/proc/self/status", O_RDONLY | O_CLOEXEC);
  if (file < 0) return -1;
  ::ssize_t const size = ::read(file, text.data(), text.size() - 1);
  ::close(file);
  char const* const line = size > 0 ? std::strstr(text.data(), "\nVmLck:") : nullptr;
  return line != nullptr ? std::atoll(line + 7) : -1;
}

/// All pages of the process, now and later. Locks are the process's and do not count: who holds them is counted here.
class LockedMemory {
 public:
  void ask(RealtimeItem& item) noexcept {
    item.asked = true;
    Holders& all = holders();
    std::lock_guard const one_at_a_time(all.mutex);
    bool const first = all.count == 0;
    if (first) all.others = locked_kib() != 0;
    bool const later_too = ::mlockall(MCL_CURRENT | MCL_FUTURE) == 0 && has_room();
    if (!later_too && ::mlockall(MCL_CURRENT) != 0) {
      item.reason = "needs CAP_IPC_LOCK or `ulimit -l unlimited` (memlock in /etc/security/limits.conf)";
      return;
    }
    ++all.count;
    holds_ = true;
    item.found = locked_kib();
    item.granted = later_too && item.found > 0;
    if (item.found <= 0)
      item.reason = not_kept;
    else if (!later_too)
      item.reason = "what is mapped now is locked, what is mapped later is not: that needs CAP_IPC_LOCK or `ulimit -l unlimited`";
    else if (all.others)
      item.reason = "some was locked before, so it stays locked";
  }
  ~LockedMemory() {
    if (!holds_) return;
    Holders& all = holders();
    std::lock_guard const one_at_a_time(all.mutex);
    if (--all.count == 0 && !all.others) ::munlockall();
  }

 private:
  struct Holders {
    std::mutex mutex;
    int count = 0;
    bool others = false;   // someone else had locked memory before
  };
  static Holders& holders() noexcept {
    static Holders all;   // as global as the lock itself
    return all;
  }
  /// Can more than the limit be mapped? If not, locking what comes later would make allocations fail. Nothing is loaded for this.
  static bool has_room() noexcept {
    ::rlimit limit{};
    if (::getrlimit(RLIMIT_MEMLOCK, &limit) != 0) return false;
    if (limit.rlim_cur == RLIM_INFINITY) return true;
    std::size_t const more = static_cast<std::size_t>(limit.rlim_cur) + 4096;
    void* const room = ::mmap(nullptr, more, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (room == MAP_FAILED) return false;
    ::munmap(room, more);
    return true;
  }

  bool holds_ = false;
};

/// Where the thread's stack is now. A variable's address would not tell: the address sanitizer puts variables elsewhere.
inline std::uintptr_t here_on_the_stack() noexcept { return reinterpret_cast<std::uintptr_t>(__builtin_frame_address(0)); }

/// Writes to every page of the stack down to `end`.
[[gnu::noinline]] inline int touch_stack(std::uintptr_t end) noexcept {
  std::array<unsigned char volatile, 4096> page;
  page[0] = 1;
  int const below = here_on_the_stack() > end ? touch_stack(end) : 0;
  page[page.size() - 1] = 1;   // after the call, so that each frame keeps its page
  return below + page[0];
}

inline long page_faults() noexcept {
  ::rusage usage{};
  return ::getrusage(RUSAGE_THREAD, &usage) == 0 ? usage.ru_minflt + usage.ru_majflt : -1;
}

inline void prefault_stack(std::size_t bytes, RealtimeItem& item) noexcept {
  item.asked = true;
  constexpr std::size_t margin = 64 * 1024;
  std::uintptr_t const here = here_on_the_stack();
  ::pthread_attr_t attributes;
  void* lowest = nullptr;
  std::size_t size = 0;
  bool known = ::pthread_getattr_np(::pthread_self(), &attributes) == 0;
  if (known) {
    known = ::pthread_attr_getstack(&attributes, &lowest, &size) == 0;
    ::pthread_attr_destroy(&attributes);
  }
  std::uintptr_t const left = here - reinterpret_cast<std::uintptr_t>(lowest);
  if (!known || left < margin || left - margin < bytes) {
    item.reason = "the thread's stack is not that large";
    return;
  }
  touch_stack(here - bytes);
  for (int times = 0; times < 3 && !item.granted; ++times) {   // the second time every page is there, unless the kernel just moves one
    long const before = page_faults();
    touch_stack(here - bytes);
    item.granted = before >= 0 && page_faults() == before;
  }
  item.found = static_cast<long long>(bytes / 1024);
  if (!item.granted) item.reason = "pages of it are taken away again: memory is short and not locked";
}

#else

inline void refuse(RealtimeItem& item) noexcept {
  item.asked = true;
  item.reason = "not available here: only on Linux so far";
}

struct FifoPriority {
  void ask(int, RealtimeItem& item) noexcept { refuse(item); }
};
struct OwnCore {
  void ask(int, RealtimeItem& item) noexcept { refuse(item); }
};
struct TimerSlack {
  void ask(RealtimeItem& item) noexcept { refuse(item); }
};
struct NoDeepSleep {
  void ask(RealtimeItem& item) noexcept { refuse(item); }
};
struct LockedMemory {
  void ask(RealtimeItem& item) noexcept { refuse(item); }
};
inline void prefault_stack(std::size_t, RealtimeItem& item) noexcept { refuse(item); }

#endif

}  // namespace palpate::detail
