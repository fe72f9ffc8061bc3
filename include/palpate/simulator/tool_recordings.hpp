// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/simulator/recording.hpp>

#include <cstddef>
#include <utility>
#include <vector>

namespace palpate {

/// What several tools did, tick by tick: a recording of each, in their places; what `Simulator::run` returns where there are tools.
class ToolRecordings {
 public:
  explicit ToolRecordings(std::vector<Recording> recordings) : recordings_(std::move(recordings)) {}

  std::vector<Recording> const& recordings() const noexcept { return recordings_; }
  /// Throws OutOfRange for a tool that is not there.
  Recording const& recording(std::size_t tool) const {
    detail::check_index("tool", static_cast<int>(tool), static_cast<int>(recordings_.size()));
    return recordings_[tool];
  }

 private:
  std::vector<Recording> recordings_;
};

}  // namespace palpate
