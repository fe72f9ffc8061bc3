// SPDX-License-Identifier: MIT
#pragma once

#include <fstream>
#include <sstream>
#include <string>

#if __has_include(<sys/resource.h>)
#include <sys/resource.h>
#include <unistd.h>
#endif

namespace palpate_test {

/// What the kernel's files say of the calling thread; on a system without them `known` is false.
struct ThreadFacts {
  bool known = false;
  int priority = -1, policy = -1;   ///< 0 of ordinary threads; policy 1 is SCHED_FIFO
  std::string cores;                ///< "0-1"
  long locked = -1;                 ///< KiB of the process
  bool operator==(ThreadFacts const&) const = default;
};

inline ThreadFacts thread_facts() {
  ThreadFacts facts;
  std::ifstream stat("/proc/thread-self/stat");
  std::string line;
  if (!std::getline(stat, line)) return facts;
  std::istringstream rest(line.substr(line.rfind(')') + 1));   // the name of the program may contain anything
  std::string field;
  for (int number = 3; rest >> field; ++number) {
    if (number == 40) facts.priority = std::stoi(field);
    if (number == 41) facts.policy = std::stoi(field);
  }
  std::ifstream status("/proc/thread-self/status");
  while (std::getline(status, line)) {
    std::istringstream words(line);
    words >> field;
    if (field == "Cpus_allowed_list:") words >> facts.cores;
    if (field == "VmLck:") words >> facts.locked;
  }
  facts.known = true;
  return facts;
}

/// For a child process: no rights, and a limit [bytes] to locked memory. False where that can not be had.
inline bool give_up_rights([[maybe_unused]] unsigned long long max_locked) {
#if __has_include(<sys/resource.h>) && defined(__linux__)
  ::rlimit const none{0, 0};
  ::rlimit const memory{static_cast<::rlim_t>(max_locked), static_cast<::rlim_t>(max_locked)};
  if (::setrlimit(RLIMIT_RTPRIO, &none) != 0 || ::setrlimit(RLIMIT_MEMLOCK, &memory) != 0) return false;
  return ::geteuid() != 0 || (::setgid(65534) == 0 && ::setuid(65534) == 0);
#else
  return false;
#endif
}

}  // namespace palpate_test
