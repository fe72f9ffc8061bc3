// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/triple_buffer.hpp>
#include <palpate/network/detail/client_link.hpp>
#include <palpate/network/options.hpp>
#include <palpate/network/picture_messages.hpp>
#include <palpate/network/protocol.hpp>
#include <palpate/simulator/seqlock.hpp>
#include <palpate/simulator/snapshot.hpp>

#include <boost/asio/io_context.hpp>

#include <atomic>
#include <cstdint>
#include <exception>
#include <optional>
#include <thread>

namespace palpate {

struct OnlookerStatistics {
  std::uint64_t pictures = 0;      ///< whole ones
  std::uint64_t connections = 0;
  std::uint64_t problems = 0;      ///< connections that ended because the server broke the protocol
  std::uint64_t received = 0;      ///< bytes
  double rtt = 0.0;                ///< s; 0: not measured yet
  std::optional<Farewell> last_farewell{};   ///< why the last connection ended or was refused, where that was said
  bool is_connected = false;
};

/// Looks on at a TissueServer: a thread of its own keeps the newest whole picture for a renderer, and connects again, for as long as this lives.
///
///   Onlooker onlooker({.server = "simulator", .port = 4747});
///   if (onlooker.fetch()) draw(onlooker.latest());   // in each frame
///
/// Pictures   `topology_revision` counts the triangles that came, whatever server they are from: while it is the same, only points moved. Never half a picture,
///            nor one whose triangles belong to other points.
/// Errors     InvalidArgument for options that make no sense. A server that is not there is none: `statistics` says how it stands.
/// Threads    `fetch`, `latest`: one. `statistics`: any.
/// Limits     its end waits until the system has looked the server's name up; see HapticClient.
class Onlooker {
 public:
  explicit Onlooker(OnlookerOptions const& options)
      : link_(io_, link_options((options.validate(), options)), [this](Welcome const&) { assembly_.reset(); },
              [this](Frame const& frame) { return use(frame); }),
        beat_(io_, 100.0, [this] { return talk(); }),
        thread_([this] { run(); }) {}
  ~Onlooker() {
    stops_.store(true);
    thread_.join();
  }
  Onlooker(Onlooker const&) = delete;
  Onlooker& operator=(Onlooker const&) = delete;

  /// Takes the newest picture; false if there was none since the last call.
  bool fetch() noexcept { return pictures_.fetch(); }
  /// The picture taken last; it stays as it is until the next fetch().
  BodySnapshot<float> const& latest() const noexcept { return pictures_.front(); }

  OnlookerStatistics statistics() const noexcept { return told_.read(); }

 private:
  static detail::network::ClientLinkOptions link_options(OnlookerOptions const& options) {
    return {.server = options.server, .port = options.port, .hello = {.role = ClientRole::onlooker},
            .connect_timeout = options.connect_timeout, .retry = options.retry, .silence = options.silence};
  }

  void run() noexcept {
    while (!stops_.load()) {
      try {
        io_.run();
        return;
      } catch (std::exception const&) {   // no memory for such a picture: the server may say better ones
      }
    }
  }
  bool talk() {
    if (stops_.load()) link_.end();
    link_.tick();
    auto* const connection = link_.connection();
    if (connection != nullptr) connection->flush();
    auto const counts = link_.counts();
    counts_.connections = counts.connections, counts_.problems = counts.problems, counts_.received = counts.received_bytes;
    counts_.last_farewell = counts.last_farewell;
    counts_.is_connected = connection != nullptr;
    if (connection != nullptr) counts_.rtt = connection->rtt();
    told_.write(counts_);
    if (link_.has_ended()) io_.stop();
    return !link_.has_ended();
  }
  ProtocolProblem use(Frame const& frame) {
    if (frame.type == MessageType::triangles) return assembly_.take_triangles(frame);
    if (frame.type == MessageType::points) return assembly_.take_points(frame);
    if (frame.type != MessageType::drawn) return ProtocolProblem::order;
    ProtocolProblem problem{};
    auto const drawn = decode<Drawn>(frame, problem);
    if (!drawn) return problem;
    problem = assembly_.check(*drawn);
    if (problem != ProtocolProblem::none) return problem;
    assembly_.draw(*drawn, pictures_.back());
    pictures_.publish();
    ++counts_.pictures;
    return problem;
  }

  TripleBuffer<BodySnapshot<float>> pictures_;
  Seqlock<OnlookerStatistics> told_;
  std::atomic<bool> stops_{false};
  PictureAssembly assembly_;
  OnlookerStatistics counts_{};
  boost::asio::io_context io_{1};
  detail::network::ClientLink link_;
  detail::network::Beat beat_;
  std::thread thread_;   // last: it uses all of them
};

}  // namespace palpate
