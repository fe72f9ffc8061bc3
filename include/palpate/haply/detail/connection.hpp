// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/haply/detail/messages.hpp>
#include <palpate/haply/options.hpp>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket.hpp>

#include <chrono>
#include <cstddef>
#include <exception>
#include <string>
#include <utility>

namespace palpate::detail::haply {

using Clock = std::chrono::steady_clock;

inline Clock::time_point after(Clock::time_point begin, double seconds) noexcept {
  return begin + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

/// A socket to the service on which each step ends by a deadline: it is begun, and the socket's own loop runs in the calling thread until it is done.
/// A step that is given up stays begun; then nothing but `finish` and the destructor makes sense.
/// Threads    one at a time.
class Connection {
 public:
  using Tcp = boost::asio::ip::tcp;
  using ErrorCode = boost::system::error_code;
  using WebSocket = boost::beast::websocket::stream<Tcp::socket, false>;   // without compression

  /// Connects; no request is on its way.
  explicit Connection(Inverse3Options const& options)
      : address_(address_of(options)), timeout_(options.timeout), resolver_(io_), socket_(io_) {
    auto const deadline = after(Clock::now(), timeout_);
    require(step(deadline,
                 [&](Step& done) {
                   resolver_.async_resolve(options.host, std::to_string(options.port),
                                           [this, &done](ErrorCode error, Tcp::resolver::results_type results) {
                                             found_ = std::move(results);
                                             done.end(error);
                                           });
                 }),
            HaplyProblem::not_reachable, "its host has no address");
    require(
        step(deadline,
             [&](Step& done) {
               boost::asio::async_connect(socket_.next_layer(), found_, [&done](ErrorCode error, Tcp::endpoint const&) { done.end(error); });
             }),
        HaplyProblem::not_reachable,
        "nothing takes a connection there; is Haply's Inverse Service running (Haply Hub, or its system service), and is that its host and port?");
    ErrorCode ignored;
    socket_.next_layer().set_option(Tcp::no_delay(true), ignored);
  }
  Connection(Connection const&) = delete;
  Connection& operator=(Connection const&) = delete;

  /// The text that GET gives; empty for anything but 200. Nothing else can follow on this connection.
  std::string get(char const* target) {
    namespace http = boost::beast::http;
    request_ = {http::verb::get, target, 11};
    request_.set(http::field::host, address_);
    request_.set(http::field::connection, "close");
    auto const deadline = after(Clock::now(), timeout_);
    auto const end = [](Step& done) { return [&done](ErrorCode error, std::size_t) { done.end(error); }; };
    if (step(deadline, [&](Step& done) { http::async_write(socket_.next_layer(), request_, end(done)); }) != Outcome::good) return {};
    if (step(deadline, [&](Step& done) { http::async_read(socket_.next_layer(), buffer_, response_, end(done)); }) != Outcome::good) return {};
    return response_.result_int() == 200 ? response_.body() : std::string();
  }

  void upgrade() {
    socket_.read_message_max(longest_message);
    require(step(after(Clock::now(), timeout_),
                 [&](Step& done) { socket_.async_handshake(address_, "/", [&done](ErrorCode error) { done.end(error); }); }),
            HaplyProblem::handshake_refused,
            "what answers there takes no WebSocket; is the port that of Haply's Inverse Service, and is another program on it?");
    socket_.text(true);
  }

  void send(std::string text, Clock::time_point deadline) {
    if (is_writing()) throw HaplyError(HaplyProblem::silent, message(address_, " takes no more messages; is the service busy or stopped?"));
    out_ = std::move(text);
    require(step(deadline, write_,
                 [&](Step& done) { socket_.async_write(boost::asio::buffer(out_), [&done](ErrorCode error, std::size_t) { done.end(error); }); }),
            HaplyProblem::gone, "the service ended the connection");
  }
  /// Where the service is, whatever names it: on this machine "localhost".
  std::string peer() const {
    ErrorCode error, other;
    auto const there = socket_.next_layer().remote_endpoint(error), here = socket_.next_layer().local_endpoint(other);
    if (error || other) return address_;
    return message(there.address() == here.address() ? std::string("localhost") : there.address().to_string(), ":", there.port());
  }
  /// The next message, whole, also if it comes in pieces.
  std::string receive(Clock::time_point deadline) {
    if (!read_.begun) begin_reading();   // else it may have come while the request was on its way out
    require(ran(deadline, read_), HaplyProblem::gone, "the service ended the connection");
    read_ = Step{};
    return boost::beast::buffers_to_string(buffer_.data());
  }
  /// Forgets what has come already: sent unasked, it would be taken for the answer to the next request, and every later answer be one message late.
  void forget_unasked(Clock::time_point deadline) {
    for (;;) {
      if (!read_.begun) begin_reading();
      io_.restart();
      while (!read_.done && io_.poll_one() > 0) {}
      if (!read_.done) return;
      require(outcome_of(read_), HaplyProblem::gone, "the service ended the connection");
      read_ = Step{};
      if (Clock::now() >= deadline)
        throw HaplyError(HaplyProblem::protocol, message(address_, " sends more than it is asked for, faster than it can be read; is that Haply's Inverse Service?"));
    }
  }
  /// Is an answer still to come?
  bool is_reading() const noexcept { return read_.begun && !read_.done; }
  /// Is a message still on its way out?
  bool is_writing() const noexcept { return write_.begun && !write_.done; }

  /// Says goodbye if that is possible, and closes.
  void finish(Clock::time_point deadline) noexcept {
    try {
      if (socket_.is_open() && !is_writing())
        static_cast<void>(step(deadline, [&](Step& done) {
          socket_.async_close(boost::beast::websocket::close_code::normal, [&done](ErrorCode error) { done.end(error); });
        }));
    } catch (std::exception const&) {
    }
    close();
  }

 private:
  enum class Outcome { good, failed, late };

  /// An operation that was begun and may not have ended.
  struct Step {
    bool begun = false, done = false;
    ErrorCode error{};
    void end(ErrorCode result) noexcept {
      error = result;
      done = true;
    }
  };

  template <class Begin>
  Outcome step(Clock::time_point deadline, Step& one, Begin begin) {
    one = Step{.begun = true};
    begin(one);
    return ran(deadline, one);
  }
  template <class Begin>
  Outcome step(Clock::time_point deadline, Begin begin) {
    return step(deadline, other_, begin);
  }

  Outcome ran(Clock::time_point deadline, Step& one) {
    io_.restart();
    while (!one.done && io_.run_one_until(deadline) > 0) {}
    return one.done ? outcome_of(one) : Outcome::late;
  }
  Outcome outcome_of(Step const& one) {
    last_error_ = one.error;
    return one.error ? Outcome::failed : Outcome::good;
  }
  void begin_reading() {
    buffer_.clear();
    read_ = Step{.begun = true};
    socket_.async_read(buffer_, [this](ErrorCode error, std::size_t) { read_.end(error); });
  }

  void require(Outcome outcome, HaplyProblem problem, char const* text) {
    namespace websocket = boost::beast::websocket;
    if (outcome == Outcome::good) return;
    if (outcome == Outcome::late)
      throw HaplyError(HaplyProblem::silent, message(address_, " did not answer in time; is the service busy or stopped?"));
    bool const in_websocket = last_error_.category() == make_error_code(websocket::error::closed).category();
    if (problem == HaplyProblem::gone && in_websocket && last_error_ != websocket::error::closed)
      throw HaplyError(HaplyProblem::protocol, message(address_, " sent what is no WebSocket message, or is longer than ", longest_message, " bytes (",
                                                       last_error_.message(), "); is another program on that port?"));
    throw HaplyError(problem, message(address_, ": ", text, " (", last_error_.message(), ")"));
  }
  /// An address of IPv6 is in brackets before a port.
  static std::string address_of(Inverse3Options const& options) {
    bool const is_ipv6 = options.host.find(':') != std::string::npos;
    return is_ipv6 ? message("[", options.host, "]:", options.port) : message(options.host, ":", options.port);
  }
  void close() noexcept {
    ErrorCode ignored;
    socket_.next_layer().close(ignored);
  }

  static constexpr std::size_t longest_message = std::size_t(1) << 20;   // bytes; a state has some 2000

  std::string const address_;
  double const timeout_;
  Step read_, write_, other_;   // outlive what is begun: the loop is destroyed first
  ErrorCode last_error_;
  std::string out_;
  boost::beast::flat_buffer buffer_;
  boost::beast::http::request<boost::beast::http::empty_body> request_;
  boost::beast::http::response<boost::beast::http::string_body> response_;
  Tcp::resolver::results_type found_;
  boost::asio::io_context io_{1};
  Tcp::resolver resolver_;
  WebSocket socket_;
};

}  // namespace palpate::detail::haply
