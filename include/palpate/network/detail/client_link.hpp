// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/network/detail/connection.hpp>

#include <boost/asio/connect.hpp>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace palpate::detail::network {

struct ClientLinkOptions {
  std::string server;
  std::uint16_t port = 0;
  Hello hello{};
  double connect_timeout = 2.0, retry = 0.25, silence = 2.0;   // s
};

/// How often a client was connected, and what went wrong.
struct LinkCounts {
  std::uint64_t connections = 0, problems = 0, sent_bytes = 0, received_bytes = 0;
  std::optional<Farewell> last_farewell{};   ///< why the last connection ended or was refused, where that was said
};

/// A client's side of its connections to one server, one after the other: finds it, connects, says hello, and begins again where that fails or ends.
/// Threads    that of its loop, which must not run once this is gone.
class ClientLink {
 public:
  /// `welcomed` once a connection, `use` for each message after that but keep-alives and goodbyes.
  ClientLink(boost::asio::io_context& io, ClientLinkOptions options, std::function<void(Welcome const&)> welcomed, Connection::Use use)
      : io_(io), resolver_(io), options_(std::move(options)), welcomed_(std::move(welcomed)), use_(std::move(use)) {}

  /// What there is to do now; to be called again and again.
  void tick() {
    auto const now = Clock::now();
    if (connection_) {
      if (is_connected_) connection_->watch();
      if (!is_welcome_ && now > gives_up_at_) connection_->close(), problem_ = "no answer in time";
      if (!connection_->is_closed()) return;
      leave();
    }
    if (now < tries_at_ || is_resolving_ || is_ended_) return;
    gives_up_at_ = now + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(options_.connect_timeout));
    if (found_.empty())
      resolve();
    else
      connect();
  }
  /// Says goodbye; no other connection begins.
  void end() {
    is_ended_ = true;
    if (connection_) is_welcome_ ? connection_->end(Farewell::ended) : connection_->close();
  }
  bool has_ended() const noexcept { return is_ended_ && (!connection_ || connection_->is_closed()); }

  /// The one on which messages go; null where there is none now.
  Connection* connection() const noexcept { return is_welcome_ && !connection_->is_ending() ? connection_.get() : nullptr; }
  LinkCounts counts() const noexcept {
    LinkCounts all = counts_;
    if (connection_) all.sent_bytes += connection_->sent(), all.received_bytes += connection_->received();
    return all;
  }
  /// What kept the last attempt from succeeding, in words.
  std::string const& problem() const noexcept { return problem_; }
  std::optional<Farewell> refusal() const noexcept { return refusal_; }

 private:
  void resolve() {
    is_resolving_ = true;
    resolver_.async_resolve(options_.server, std::to_string(options_.port), [this](ErrorCode error, Tcp::resolver::results_type found) {
      is_resolving_ = false;
      if (error) {
        problem_ = "there is no such host (" + error.message() + ")";
        tries_at_ = after_retry();
      } else {
        found_ = std::move(found);
        if (!is_ended_ && !connection_) connect();
      }
    });
  }
  void connect() {
    connection_ = std::make_shared<Connection>(Tcp::socket(io_), ConnectionOptions{.silence = options_.silence});
    is_connected_ = is_welcome_ = false;
    problem_.clear();
    boost::asio::async_connect(connection_->socket(), found_, [this, mine = connection_](ErrorCode error, Tcp::endpoint const&) {
      if (mine->is_closed()) return;
      if (error) {
        problem_ = error.message();
        return mine->close();
      }
      is_connected_ = true;
      mine->start([this](Frame const& frame) { return take(frame); });
      mine->add(options_.hello);
      mine->flush();
    });
  }
  ProtocolProblem take(Frame const& frame) {
    if (is_welcome_) return use_(frame);
    ProtocolProblem problem{};
    if (frame.type == MessageType::refusal) {
      if (auto const refusal = decode<Refusal>(frame, problem)) {
        counts_.last_farewell = refusal_ = refusal->why;
        problem_ = to_string(refusal->why);
        connection_->close();
      }
      return problem;
    }
    if (frame.type != MessageType::welcome) return ProtocolProblem::order;
    if (auto const welcome = decode<Welcome>(frame, problem)) {
      if (welcome->version < options_.hello.oldest || welcome->version > options_.hello.newest) return ProtocolProblem::version;
      is_welcome_ = true;
      refusal_.reset();
      ++counts_.connections;
      connection_->welcome(send_buffer);
      welcomed_(*welcome);
    }
    return problem;
  }
  void leave() {
    if (connection_->problem() != ProtocolProblem::none) {
      ++counts_.problems;
      problem_ = to_string(connection_->problem());
    } else if (!is_welcome_ && problem_.empty()) {
      problem_ = "the connection ended before it was welcome";
    }
    if (connection_->why()) counts_.last_farewell = connection_->why();
    counts_.sent_bytes += connection_->sent(), counts_.received_bytes += connection_->received();
    connection_.reset();
    is_connected_ = is_welcome_ = false;
    tries_at_ = after_retry();
  }
  Clock::time_point after_retry() const { return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(options_.retry)); }

  static constexpr int send_buffer = 16384;   // bytes, 0.1 s of samples

  boost::asio::io_context& io_;
  Tcp::resolver resolver_;
  ClientLinkOptions const options_;
  std::function<void(Welcome const&)> welcomed_;
  Connection::Use use_;
  Tcp::resolver::results_type found_;
  std::shared_ptr<Connection> connection_;
  Clock::time_point tries_at_{}, gives_up_at_{};
  bool is_resolving_ = false, is_connected_ = false, is_welcome_ = false, is_ended_ = false;
  LinkCounts counts_{};
  std::optional<Farewell> refusal_;
  std::string problem_;
};

}  // namespace palpate::detail::network
