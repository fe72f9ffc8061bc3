// SPDX-License-Identifier: MIT
#pragma once

namespace palpate {

/// The branch of a force curve with hysteresis: the tool goes deeper (loading) or comes back (unloading).
enum class Phase { loading, unloading };

constexpr char const* to_string(Phase phase) noexcept {
  return phase == Phase::loading ? "loading" : "unloading";
}

}  // namespace palpate
