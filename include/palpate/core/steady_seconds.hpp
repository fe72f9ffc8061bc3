// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>

namespace palpate {

/// s, of the system's steady clock: what work is timed with that may take so long and no longer.
inline double steady_seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

}  // namespace palpate
