// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/triple_buffer.hpp>
#include <palpate/device/limit.hpp>
#include <palpate/haply/detail/connection.hpp>
#include <palpate/haply/detail/messages.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>

namespace palpate {

/// What happened between host and service since the device was opened.
struct Inverse3Counts {
  std::uint64_t exchanges = 0;    ///< messages that were answered
  std::uint64_t unattended = 0;   ///< those that asked for no force because the host had not written one for a while
  std::uint64_t jumps = 0, gaps = 0;   ///< of the position and of the answers: the force began at zero again
};

namespace detail::haply {

struct Sample {
  DeviceState<double> state{};
  Clock::time_point asked{};   // when its request was sent: it is no older
};

struct Command {
  Vector3<double> force = Vector3<double>::Zero();
  Clock::time_point written{};
};

/// A device of a service that this program has open.
/// Invariant  one for each: two would send the same motors their forces in turn.
/// Limits     of another machine a service is where it was reached: by IPv4 and by IPv6, or by two network cards, it counts as
///            two. On this machine 127.0.0.1, ::1 and the addresses of its network cards are one.
class Claim {
 public:
  Claim(std::string const& service, std::string const& device) : name_(device + "@" + service) {   // where it is, not what it is called: a machine has several names
    std::lock_guard const lock(held().mutex);
    if (!held().names.insert(name_).second)
      throw HaplyError(HaplyProblem::in_use, message(legible(device), " is open in this program already; close it there first, or name another device"));
  }
  Claim(Claim const&) = delete;
  Claim& operator=(Claim const&) = delete;
  ~Claim() {
    std::lock_guard const lock(held().mutex);
    held().names.erase(name_);
  }

 private:
  struct Held {
    std::mutex mutex;
    std::set<std::string> names;
  };
  static Held& held() {
    static Held& all = *new Held;   // for ever: a device that is static may go after it
    return all;
  }

  std::string name_;
};

/// One open device and the thread that talks to its service: a force goes, a state comes, then the next, never two at a time.
///   force sent = ramp · limited(force written, largest force);   ramp: 0 → 1 within options.ramp from arming, a jump or a gap on
/// However it ends, the last force sent is zero if anything can be sent at all, and then nothing more: the service lets the device idle.
/// Threads    `run`: its own. `samples` has one reader, `commands` one writer: the servo. Atomics and `end`: any; `words` once `ended` is not none.
class Link {
 public:
  /// Connects, reads the inventory, and sends zero once. Throws `HaplyError`.
  explicit Link(Inverse3Options const& options) : options_(options), report_(opened()), max_force_(options.max_force), command_(report_) {
    claim_.emplace(connection_->peer(), report_.device_id);
    exchange(Vector3<double>::Zero());
  }
  ~Link() { stop(); }
  Link(Link const&) = delete;
  Link& operator=(Link const&) = delete;

  void start() {
    thread_ = std::thread([this] { run(); });
  }
  void stop() noexcept {
    stopping_.store(true);
    if (thread_.joinable()) thread_.join();
    claim_.reset();
  }

  std::atomic<bool> force_wanted{false};
  std::atomic<bool> quiet{true};   // the last force sent is zero
  std::atomic<Clock::rep> armed_at{0};
  std::atomic<HaplyProblem> ended{HaplyProblem::none};   // never none again
  std::atomic<std::uint64_t> exchanges{0}, unattended{0}, jumps{0}, gaps{0};
  TripleBuffer<Sample> samples;
  TripleBuffer<Command> commands;

  Inverse3Report const& report() const noexcept { return report_; }
  /// Says nothing new once it has ended.
  void end(HaplyProblem why) noexcept {
    HaplyProblem none = HaplyProblem::none;
    ended.compare_exchange_strong(none, why);
  }
  char const* words() const noexcept {
    return ended.load() == HaplyProblem::silent ? "the service has fallen silent: no state in the time of .stall" : words_.c_str();
  }

 private:
  /// What the service says first.
  Inverse3Report opened() {
    std::string version;
    if (options_.dialect == HaplyDialect::by_version) version = service_version(Connection(options_).get("/version"));
    connection_ = std::make_unique<Connection>(options_);
    connection_->upgrade();
    return read_inventory(connection_->receive(after(Clock::now(), options_.timeout)), options_, version);
  }

  void run() noexcept {
    auto next = Clock::now();
    auto const period = after(next, 1.0 / options_.exchange_rate) - next;
    try {
      while (!stopping_.load() && ended.load() == HaplyProblem::none) {
        next = std::max(next + period, Clock::now());
        std::this_thread::sleep_until(next);
        exchange(force_now(Clock::now()));
      }
    } catch (HaplyError const& error) {
      fail(error.problem(), error.reason());
    } catch (std::exception const& error) {
      fail(HaplyProblem::protocol, error.what());
    }
    say_goodbye();
  }

  /// One force for one state.
  void exchange(Vector3<double> const& force) {
    auto const asked = Clock::now();
    auto const deadline = after(asked, options_.stall);
    connection_->forget_unasked(deadline);
    if (!force.isZero(0.0)) quiet.store(false);
    connection_->send(command_.text(force), deadline);
    if (force.isZero(0.0)) quiet.store(true);
    std::string const answer = connection_->receive(deadline);
    Vector3<double> const before = sample_.state.position;
    auto const last = std::exchange(sample_.asked, asked);
    read_state(answer, report_, sample_.state);
    double const passed = std::chrono::duration<double>(Clock::now() - last).count();
    bool const first = exchanges.fetch_add(1, std::memory_order_relaxed) == 0;
    if (!first && passed > options_.held) begin_again(gaps);
    if (!first && (sample_.state.position - before).norm() > options_.jump + fastest_hand * passed) begin_again(jumps);
    samples.write(sample_);
  }

  Vector3<double> force_now(Clock::time_point now) noexcept {
    commands.fetch();
    Command const& command = commands.front();
    bool const wanted = force_wanted.load() && command.written.time_since_epoch().count() >= armed_at.load();
    bool const held = std::chrono::duration<double>(now - command.written).count() <= options_.held;
    if (wanted && !held) unattended.fetch_add(1, std::memory_order_relaxed);
    if (!wanted || !held) {
      rising_ = false;
      return Vector3<double>::Zero();
    }
    if (!std::exchange(rising_, true)) rises_since_ = now;
    double const passed = std::chrono::duration<double>(now - rises_since_).count();
    double const ramp = passed < options_.ramp ? passed / options_.ramp : 1.0;
    return ramp * limited(command.force, max_force_);
  }

  void begin_again(std::atomic<std::uint64_t>& why) noexcept {
    rising_ = false;
    why.fetch_add(1, std::memory_order_relaxed);
  }

  void fail(HaplyProblem why, char const* words) noexcept {
    if (ended.load() != HaplyProblem::none) return;   // the servo noticed first that it is silent
    try {
      words_ = words;
    } catch (std::exception const&) {
    }
    end(why);
  }

  /// The last force is zero, also while the answer to another is awaited: that one may never come.
  void say_goodbye() noexcept {
    try {
      connection_->send(command_.text(Vector3<double>::Zero()), after(Clock::now(), patience));
      quiet.store(true);
      if (!connection_->is_reading()) static_cast<void>(connection_->receive(after(Clock::now(), patience)));
    } catch (std::exception const&) {
    }
    connection_->finish(after(Clock::now(), patience));
  }

  static constexpr double fastest_hand = 2.0;   // m/s
  static constexpr double patience = 0.1;       // s, for each step of the goodbye

  Inverse3Options const options_;
  std::unique_ptr<Connection> connection_;   // before the report: it brings it
  Inverse3Report const report_;
  std::optional<Claim> claim_;
  double const max_force_;
  ForceCommand command_;
  Sample sample_;
  std::string words_;
  Clock::time_point rises_since_{};
  bool rising_ = false;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace detail::haply

}  // namespace palpate
