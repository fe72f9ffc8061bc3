// SPDX-License-Identifier: MIT
#pragma once

#include "hook_hand.hpp"

#include <palpate/tool/hook.hpp>

#include <atomic>
#include <memory>
#include <utility>

namespace viewer {

/// Whether the hook has hooked in, for the thread that draws.
using IsHooked = std::atomic<bool>;

/// A hook that says to another thread whether it has hooked in: a tool of our own, out of one of the library's.
class WatchedHook : public palpate::Hook<double> {
 public:
  explicit WatchedHook(std::shared_ptr<IsHooked> told) : Hook({.shape = hook_shape, .friction = 0.5}), told_(std::move(told)) {}
  /// The same, as it is in the tissue, told elsewhere.
  WatchedHook(palpate::Hook<double> const& hook, std::shared_ptr<IsHooked> told) : Hook(hook), told_(std::move(told)) {}

  template <class Body>
  void advance(Body& body, palpate::ToolPose<double> const& tool) {
    Hook::advance(body, tool);
    told_->store(hooked(), std::memory_order_relaxed);
  }

 private:
  std::shared_ptr<IsHooked> told_;
};

}  // namespace viewer
