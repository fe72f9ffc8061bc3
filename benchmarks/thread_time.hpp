// SPDX-License-Identifier: MIT
#pragma once

#include <ctime>

namespace benchmarks {

/// The processor time of this thread [s].
inline double thread_time() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace benchmarks
