// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/network/protocol.hpp>
#include <palpate/simulator/pacer.hpp>

#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace palpate::detail::network {

using Tcp = boost::asio::ip::tcp;
using ErrorCode = boost::system::error_code;
using Clock = std::chrono::steady_clock;
using Bytes = std::vector<std::byte>;

inline double seconds_between(Clock::time_point begin, Clock::time_point end) noexcept { return std::chrono::duration<double>(end - begin).count(); }

/// Calls `tick` at a rate in the thread that runs the loop, for as long as it returns true; ticks that come too late are left out.
class Beat {
 public:
  Beat(boost::asio::io_context& io, double rate, std::function<bool()> tick)
      : timer_(io), schedule_(Clock::now(), Pacer::period_of(rate)), tick_(std::move(tick)) {
    next();
  }

 private:
  void next() {
    timer_.expires_at(schedule_.next(Clock::now()).due);
    timer_.async_wait([this, is_there = std::weak_ptr(is_there_)](ErrorCode error) {
      if (!error && !is_there.expired() && tick_()) next();
    });
  }

  boost::asio::steady_timer timer_;
  Schedule schedule_;
  std::function<bool()> tick_;
  std::shared_ptr<bool> is_there_ = std::make_shared<bool>();
};

struct ConnectionOptions {
  double silence = 2.0;          ///< s
  double bytes_per_second = std::numeric_limits<double>::infinity();   ///< that the partner may send
  bool refuses = false;          ///< is the server's: until the partner is welcome, the last message is a Refusal
};

/// A connection of this protocol, as both ends have it: reads frames, writes what it is given when the last is out, says that it is there, and ends when the
/// partner breaks the rules, floods, or makes no progress. Only one write is under way, and nothing waits behind it: who finds it busy comes again with newer
/// values.
/// An end is told to the partner, who has 0.2 s to take note; `is_closed` then.
/// Threads    that of its loop. Socket errors close it, none is thrown.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  /// What a message was that is neither of those that every partner understands.
  using Use = std::function<ProtocolProblem(Frame const&)>;

  Connection(Tcp::socket socket, ConnectionOptions const& options) : socket_(std::move(socket)), options_(options) { out_.reserve(4 * max_fixed_frame); }

  Tcp::socket& socket() noexcept { return socket_; }
  /// The socket is connected.
  void start(Use use) {
    use_ = std::move(use);
    begun_ = heard_ = sent_ = Clock::now();
    ErrorCode ignored;
    socket_.set_option(Tcp::no_delay(true), ignored);
    read();
  }
  /// The partner has said who it is. It must not let more than so many bytes wait in the system: they would be old when they arrive.
  void welcome(int waiting) {
    is_welcome_ = true;
    ErrorCode ignored;
    socket_.set_option(boost::asio::socket_base::send_buffer_size(waiting), ignored);
  }

  // --- out --------------------------------------------------------------------------------------------------------------
  /// May something be added?
  bool is_free() const noexcept { return !is_writing_ && !is_ending_ && !is_closed_; }
  template <FixedMessage M>
  void add(M const& message) {
    std::array<std::byte, max_fixed_frame> frame;
    out_.insert(out_.end(), frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(encode(message, frame)));
  }
  /// Whole frames that several connections share.
  void add(std::shared_ptr<Bytes const> frames) { shared_.push_back(std::move(frames)); }
  /// Sends what was added; a KeepAlive where there is nothing and there was nothing for a while, and in any case ten times a second.
  void flush() {
    if (!is_free()) return;
    auto const now = Clock::now();
    bool const is_idle = out_.empty() && shared_.empty() && seconds_between(sent_, now) > keep_alive;
    if (is_welcome_ && (is_idle || seconds_between(kept_alive_, now) > measure_every)) {
      kept_alive_ = now;
      add(KeepAlive{.time = time(now), .echo = echo_, .held = echo_ > 0.0 ? seconds_between(echoed_, now) : 0.0});
    }
    if (!out_.empty() || !shared_.empty()) write(now);
  }

  // --- the end ----------------------------------------------------------------------------------------------------------
  /// Says why, and ends.
  void end(Farewell why) {
    if (is_ending_ || is_closed_) return;
    is_ending_ = true;
    why_ = why;
    ends_by_ = Clock::now() + std::chrono::milliseconds(200);
    if (!is_writing_) say_farewell();
  }
  void close() noexcept {
    is_closed_ = true;
    ErrorCode ignored;
    socket_.close(ignored);
  }
  /// Ends what makes no progress. To be called again and again.
  void watch() {
    auto const now = Clock::now();
    if (is_closed_) return;
    if (is_ending_ ? now > ends_by_ : is_writing_ && seconds_between(progressed_, now) > options_.silence) {
      why_ = why_.value_or(Farewell::silent);
      close();
    } else if (seconds_between(is_welcome_ ? heard_ : begun_, now) > options_.silence) {
      end(Farewell::silent);
    }
  }
  bool is_closed() const noexcept { return is_closed_; }
  bool is_ending() const noexcept { return is_ending_ || is_closed_; }
  /// Why this end ended it, or the partner did; none where it just closed.
  std::optional<Farewell> why() const noexcept { return why_; }
  ProtocolProblem problem() const noexcept { return problem_; }

  /// s, the way there and back, as last measured; 0: not yet.
  double rtt() const noexcept { return rtt_; }
  std::uint64_t received() const noexcept { return received_; }
  std::uint64_t sent() const noexcept { return written_; }

 private:
  static constexpr double keep_alive = 0.018;     // s; a tick of whoever flushes makes it 0.02
  static constexpr double measure_every = 0.1;    // s
  static constexpr double burst = 0.25;           // s, of the bytes that the partner may send

  double time(Clock::time_point now) const noexcept { return seconds_between(begun_, now); }

  void read() {
    std::span<std::byte> const room = stream_.room();
    socket_.async_read_some(boost::asio::buffer(room.data(), room.size()),
                            [self = shared_from_this()](ErrorCode error, std::size_t count) { self->came(error, count); });
  }
  void came(ErrorCode error, std::size_t count) {
    if (is_closed_) return;
    if (error) return close();
    auto const now = Clock::now();
    allowed_ = std::min(burst, allowed_ + seconds_between(heard_, now)) - static_cast<double>(count) / options_.bytes_per_second;
    heard_ = now;
    received_ += count;
    if (allowed_ < 0.0) end(Farewell::too_fast);
    stream_.filled(count);
    while (!is_ending_) {
      auto const frame = stream_.next();
      if (!frame) break;
      if (ProtocolProblem const problem = take(*frame, now); problem != ProtocolProblem::none) fail(problem);
      if (is_closed_) return;
    }
    if (!is_ending_ && stream_.problem() != ProtocolProblem::none) fail(stream_.problem());
    if (is_ending_) stream_.reset();   // nobody listens any more
    read();
  }
  ProtocolProblem take(Frame const& frame, Clock::time_point now) {
    ProtocolProblem problem{};
    if (is_welcome_ && frame.type == MessageType::keep_alive) {
      if (auto const message = decode<KeepAlive>(frame, problem)) {
        double const passed = time(now) - message->echo - message->held;
        if (message->echo > 0.0 && passed >= 0.0) rtt_ = passed;
        echo_ = message->time, echoed_ = now;
      }
      return problem;
    }
    if (is_welcome_ && frame.type == MessageType::goodbye) {
      if (auto const message = decode<Goodbye>(frame, problem)) why_ = message->why, close();
      return problem;
    }
    return use_(frame);
  }
  void fail(ProtocolProblem problem) {
    if (is_ending_) return;
    problem_ = problem;
    end(problem == ProtocolProblem::version ? Farewell::version : Farewell::protocol);
  }

  void write(Clock::time_point now) {
    is_writing_ = true;
    sent_ = progressed_ = now;
    buffers_.clear();
    if (!out_.empty()) buffers_.push_back(boost::asio::buffer(out_.data(), out_.size()));
    for (auto const& frames : shared_) buffers_.push_back(boost::asio::buffer(frames->data(), frames->size()));
    auto const goes_on = [this](ErrorCode const& failed, std::size_t) -> std::size_t {
      progressed_ = Clock::now();
      return failed ? 0 : FrameFormat::max_body;
    };
    boost::asio::async_write(socket_, buffers_, goes_on, [self = shared_from_this()](ErrorCode error, std::size_t count) { self->wrote(error, count); });
  }
  void wrote(ErrorCode error, std::size_t count) {
    is_writing_ = false;
    written_ += count;
    out_.clear(), shared_.clear();
    if (is_closed_) return;
    if (error) return close();
    if (is_ending_) say_farewell();
  }
  void say_farewell() {
    if (!std::exchange(has_said_farewell_, true)) {
      out_.clear(), shared_.clear();
      if (options_.refuses && !is_welcome_)
        add(Refusal{*why_});
      else
        add(Goodbye{*why_});
      return write(Clock::now());
    }
    ErrorCode ignored;
    socket_.shutdown(Tcp::socket::shutdown_send, ignored);   // the partner reads to the end, then closes
  }

  Tcp::socket socket_;
  ConnectionOptions const options_;
  Use use_;
  FrameStream stream_;
  Bytes out_;
  std::vector<std::shared_ptr<Bytes const>> shared_;
  std::vector<boost::asio::const_buffer> buffers_;
  Clock::time_point begun_{}, heard_{}, sent_{}, progressed_{}, kept_alive_{}, echoed_{}, ends_by_{};
  double allowed_ = burst;   // s, of bytes that the partner may still send at once
  double echo_ = 0.0, rtt_ = 0.0;
  std::uint64_t received_ = 0, written_ = 0;
  bool is_welcome_ = false, is_writing_ = false, is_ending_ = false, has_said_farewell_ = false, is_closed_ = false;
  ProtocolProblem problem_ = ProtocolProblem::none;
  std::optional<Farewell> why_;
};

}  // namespace palpate::detail::network
