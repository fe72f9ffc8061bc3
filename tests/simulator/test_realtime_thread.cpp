// SPDX-License-Identifier: MIT
// Yardstick: what the kernel says of the thread and the process in /proc, read by the test itself, before, meanwhile and after. Which rights the
// tests are run with does not matter: what is said to be granted has to be there, what is not has to have a reason.
#include "catch.hpp"

#include "device/message.hpp"
#include "forked.hpp"
#include "servo_guard.hpp"
#include "simulator/thread_facts.hpp"

#include <palpate/simulator/realtime_thread.hpp>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <limits>
#include <optional>
#include <string>
#include <thread>

using namespace palpate;
using palpate_test::Child;
using palpate_test::give_up_rights;
using palpate_test::in_child;
using palpate_test::message_of;
using palpate_test::thread_facts;
using palpate_test::ThreadFacts;
using palpate_test::unsaid;

namespace {

/// Runs on a thread of its own: a fresh thread has what the system gives by default.
template <class Function>
void on_a_thread(Function function) {
  std::thread(function).join();
}

}  // namespace

TEST_CASE("by default a real-time thread asks for exact timers alone, or for nothing", "[simulator][realtime_thread]") {
  ThreadFacts const before = thread_facts();
  {
    RealtimeThread const realtime{RealtimeOptions{}};
    CHECK(thread_facts() == before);
    for (RealtimeItem const& item : realtime.report().items()) CHECK(item.asked == (item.name == realtime.report().timers.name));
  }
  RealtimeThread const nothing{{.exact_timers = false}};
  CHECK(thread_facts() == before);
  CHECK(nothing.report().complete());
  for (RealtimeItem const& item : nothing.report().items()) {
    CHECK_FALSE(item.asked);
    CHECK_FALSE(item.granted);
  }
  std::string const text = to_text(nothing.report());
  CHECK(std::count(text.begin(), text.end(), '\n') == 7);
  CHECK(unsaid(text, "SCHED_FIFO priority: not asked for\n", "denormals are zero: not asked for\n") == "");
}

TEST_CASE("what is granted is there, what is not has a reason, and at the end all is as it was", "[simulator][realtime_thread][threads]") {
  ThreadFacts before, meanwhile, after;
  RealtimeReport report;
  int slack_after = -1;
  on_a_thread([&] {
    before = thread_facts();
    {
      RealtimeOptions options = RealtimeOptions::recommended();
      options.core = 0;
      RealtimeThread const realtime(options);
      meanwhile = thread_facts();
      report = realtime.report();
    }
    after = thread_facts();
    RealtimeThread const again({.exact_timers = true});   // it would not find 50 µs to change if the first had left 1 ns
    slack_after = again.report().timers.granted ? 1 : 0;
  });
  INFO(to_text(report));
  CHECK(after == before);
  for (RealtimeItem const& item : report.items()) {
    CAPTURE(item.name);
    CHECK(item.asked);
    CHECK((item.granted || !item.reason.empty()));
  }
  if (!before.known) {   // not Linux
    CHECK(report.priority.reason == "not available here: only on Linux so far");
    return;
  }
  CHECK(report.priority.granted == (meanwhile.policy == 1 && meanwhile.priority == 75));
  CHECK(report.core.granted == (meanwhile.cores == "0"));
  CHECK((!report.memory.granted || meanwhile.locked > 0));
  if (palpate_test::guard_aborts()) CHECK(report.stack.granted);   // the thread sanitizer maps pages of its own meanwhile
  CHECK(report.stack.found == 256);
  CHECK(report.timers.granted);
  CHECK(slack_after == 1);
}

TEST_CASE("without rights a thread goes on without, and is told what it needs", "[simulator][realtime_thread]") {
  Child const child = in_child([] {
    if (!give_up_rights(64 * 1024)) std::_Exit(77);
    ThreadFacts const before = thread_facts();
    RealtimeThread const realtime(RealtimeOptions::recommended());
    std::cerr << to_text(realtime.report()) << (realtime.report().complete() ? "complete" : "not complete") << '\n';
    ThreadFacts const meanwhile = thread_facts();
    std::cerr << (meanwhile.policy == before.policy && meanwhile.priority == before.priority ? "as before" : "changed") << std::endl;
  });
  if (child.code == 77) return;   // not Linux
  REQUIRE(child.code == 0);
  INFO(child.said);
  CHECK(unsaid(child.said, "SCHED_FIFO priority: not granted; needs CAP_SYS_NICE or `ulimit -r` of at least the priority",
               "memory locked: not granted; ", "wake-up from sleep: not granted; ", "/dev/cpu_dma_latency", "stack touched: ",
               "timer slack: granted, ", "\nnot complete\nas before\n") == "");
  if (palpate_test::guard_aborts())   // sanitizers say that memory is locked and lock none, and map pages of their own meanwhile
    CHECK(unsaid(child.said, "memory locked: not granted; needs CAP_IPC_LOCK or `ulimit -l unlimited`", "stack touched: granted, 256 KiB\n") == "");
}

TEST_CASE("memory is not locked in such a way that allocations fail later", "[simulator][realtime_thread]") {
  if (!palpate_test::guard_aborts()) return;   // sanitizers lock no memory
  Child const child = in_child([] {
    if (!give_up_rights(256ull << 20)) std::_Exit(77);   // more than this process has now, less than it will ask for
    RealtimeThread const realtime({.lock_memory = true});
    void* volatile const later = std::malloc(512ull << 20);
    std::cerr << to_text(realtime.report()) << (later != nullptr ? "allocated" : "refused") << " with " << thread_facts().locked << " KiB"
              << std::endl;
    std::free(later);
  });
  if (child.code == 77) return;   // the limit is lower and may not be raised
  REQUIRE(child.code == 0);
  INFO(child.said);
  CHECK(unsaid(child.said, "what is mapped now is locked, what is mapped later is not", "allocated with") == "");
  CHECK(child.said.find("with 0 KiB") == std::string::npos);
}

TEST_CASE("memory stays locked until the last that asked for it ends", "[simulator][realtime_thread]") {
  ThreadFacts const before = thread_facts();
  {
    RealtimeThread const first({.lock_memory = true});
    {
      RealtimeThread const second({.lock_memory = true});
      CHECK(first.report().memory.granted == second.report().memory.granted);
    }
    if (first.report().memory.granted) CHECK(thread_facts().locked > 0);
  }
  CHECK(thread_facts().locked == before.locked);
}

TEST_CASE("a core that does not exist is reported", "[simulator][realtime_thread]") {
  ThreadFacts const before = thread_facts();
  RealtimeThread const realtime({.core = 1023});
  CHECK_FALSE(realtime.report().core.granted);
  CHECK_FALSE(realtime.report().complete());
  if (before.known) CHECK(unsaid(std::string(realtime.report().core.reason), "there is no such core") == "");
  CHECK(thread_facts() == before);
}

TEST_CASE("more stack than the thread has is refused, not touched", "[simulator][realtime_thread][threads]") {
  for (std::size_t const bytes : {std::size_t{1} << 32, std::numeric_limits<std::size_t>::max()}) {   // with a margin the last would be little
    RealtimeItem item;
    on_a_thread([&] { detail::prefault_stack(bytes, item); });
    CAPTURE(bytes);
    CHECK_FALSE(item.granted);
    CHECK_FALSE(item.reason.empty());
  }
}

TEST_CASE("real-time options out of their meaning are refused with a reason", "[simulator][realtime_thread]") {
  using namespace std::chrono_literals;
  CHECK_NOTHROW(RealtimeOptions{}.validate());
  CHECK_NOTHROW(RealtimeOptions::recommended().validate());
  auto const said = [](RealtimeOptions const& options) { return message_of([&] { options.validate(); }); };
  CHECK(unsaid(said({.priority = 99}), "a real-time priority of 99", "1 to 98") == "");
  CHECK(unsaid(said({.priority = 0}), "a real-time priority of 0") == "");
  CHECK(unsaid(said({.core = -1}), "the servo's core is -1") == "");
  CHECK(unsaid(said({.prefault_stack = 1u << 30}), "prefault_stack is 1073741824 bytes") == "");
  CHECK(unsaid(said({.spin = 51us}), "a spin of 51000 ns") == "");
}
