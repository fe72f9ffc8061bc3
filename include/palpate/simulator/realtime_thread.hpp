// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/simulator/detail/realtime_linux.hpp>
#include <palpate/core/flush_denormals.hpp>
#include <palpate/simulator/realtime_options.hpp>

#include <optional>

namespace palpate {

/// Makes the calling thread fit for real time for as long as it lives, as far as the system permits, and says how far that is.
///
///   RealtimeThread const realtime(RealtimeOptions::recommended());
///   std::cout << to_text(realtime.report());
///
/// Each request is made, then read back from the system; one that fails is reported with what would help, and the thread goes on without it.
/// At the end what was changed is as it was before: policy and priority, core, timer slack, denormals, the latency request. Memory belongs to
/// the process: it is unlocked when the last RealtimeThread that locked it ends, and not at all if some of it was locked before the first.
/// Simulator::run_realtime makes one for its servo; make one yourself in a callback's thread that a device driver owns.
/// Threads    made and destroyed by the thread it is for; any number of threads may have one.
/// Cost       system calls, and with `lock_memory` the time to load all pages of the process: at set-up, not in a tick. noexcept.
/// Limits     Linux; elsewhere all but the denormals are reported as not available. Linux takes 50 ms a second away from threads of
///            SCHED_FIFO that never sleep (kernel.sched_rt_runtime_us). With a finite `ulimit -l` and no CAP_IPC_LOCK only the pages
///            mapped now are locked: were later ones locked as well, allocations would fail once the limit is reached.
class RealtimeThread {
 public:
  explicit RealtimeThread(RealtimeOptions const& options) noexcept {
    if (options.flush_denormals) {
      flush_.emplace();
      report_.denormals.asked = true;
      report_.denormals.granted = flush_->active();
      if (!flush_->active()) report_.denormals.reason = "this processor's mode for it is not known here";
    }
    if (options.lock_memory) memory_.ask(report_.memory);   // before the priority: loading pages takes a while
    if (options.prefault_stack > 0) detail::prefault_stack(options.prefault_stack, report_.stack);
    if (options.exact_timers) timers_.ask(report_.timers);
    if (options.core) core_.ask(*options.core, report_.core);
    if (options.no_deep_sleep) sleep_.ask(report_.sleep);
    if (options.fifo) priority_.ask(options.priority, report_.priority);
  }
  RealtimeThread(RealtimeThread const&) = delete;
  RealtimeThread& operator=(RealtimeThread const&) = delete;

  RealtimeReport const& report() const noexcept { return report_; }

 private:
  RealtimeReport report_;
  std::optional<FlushDenormals> flush_;   // members end in the reverse order: the priority goes first, the memory last
  detail::LockedMemory memory_;
  detail::TimerSlack timers_;
  detail::OwnCore core_;
  detail::NoDeepSleep sleep_;
  detail::FifoPriority priority_;
};

}  // namespace palpate
