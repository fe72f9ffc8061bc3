// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <thread>

#if __has_include(<unistd.h>)
#include <unistd.h>
#endif

namespace network_pair {

inline std::atomic<bool> is_asked_to_end{false};   // by SIGINT or SIGTERM
static_assert(std::atomic<bool>::is_always_lock_free);

inline void end_on_signals() {
  for (int const which : {SIGINT, SIGTERM}) std::signal(which, [](int) { is_asked_to_end.store(true); });
}

inline bool is_terminal() {
#if __has_include(<unistd.h>)
  return ::isatty(1) == 1;
#else
  return false;
#endif
}

/// A thread that asks for the end once a signal came, and prints status() once a second: on a terminal always over itself, else a line where `always`.
template <class Status, class End>
std::jthread watch(bool always, Status status, End end) {
  return std::jthread([=](std::stop_token const& stop) {
    bool const rewrites = is_terminal();
    auto next = std::chrono::steady_clock::now() + std::chrono::seconds(1);
    while (!stop.stop_requested()) {
      if (is_asked_to_end.load()) end();
      if (auto const now = std::chrono::steady_clock::now(); now >= next) {
        next += std::chrono::seconds(1);
        if (rewrites)
          std::printf("\r%s\033[K", status().c_str());
        else if (always)
          std::printf("%s\n", status().c_str());
        std::fflush(stdout);
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    if (rewrites) std::printf("\r\033[K");
  });
}

}  // namespace network_pair
