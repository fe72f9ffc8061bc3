// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/triple_buffer.hpp>
#include <palpate/cutting/no_cutter.hpp>
#include <palpate/network/detail/connection.hpp>
#include <palpate/network/options.hpp>
#include <palpate/network/picture_messages.hpp>
#include <palpate/network/protocol.hpp>
#include <palpate/network/tissue_node.hpp>
#include <palpate/simulator/pacer.hpp>
#include <palpate/simulator/seqlock.hpp>
#include <palpate/simulator/snapshot.hpp>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/tcp.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace palpate {

/// What a server has done since it was made.
struct TissueServerStatistics {
  std::uint64_t connections = 0;      ///< taken
  std::uint64_t hands = 0;            ///< sessions of a hand
  std::uint64_t refused = 0;          ///< a Refusal was said, or there were too many connections
  std::uint64_t silent = 0, too_fast = 0;                  ///< connections that ended so
  std::array<std::uint64_t, 7> problems{};                 ///< connections that broke the protocol, by ProtocolProblem
  std::uint64_t samples = 0;                               ///< of the hand
  std::uint64_t surfaces = 0, tissues = 0, pictures = 0;   ///< sent
  std::uint64_t sent = 0, received = 0;                    ///< bytes, of connections that have ended
  std::uint64_t body_ticks = 0, late_ticks = 0;            ///< late: left out because one before it took so long
  double rtt = 0.0;                                        ///< s, to the hand and back; 0: not known
  int onlookers = 0;                                       ///< now
  bool has_hand = false;                                   ///< now

  std::uint64_t protocol_problems() const noexcept {
    std::uint64_t all = 0;
    for (std::uint64_t const count : problems) all += count;
    return all;
  }
};

/// The tissue's side of a haptic hierarchy over TCP: a body and its cutter for one hand that is elsewhere, and pictures for those who look on.
///
///   TissueServer server(std::move(body), {.port = 4747});
///   server.run(stop);   // until a stop is asked for
///
/// run        the calling thread ticks the body at `rate`; a second one talks, and follows the surface at `surface_rate`. Between them go
///            newest values, nothing waits.
/// A hand     one at a time; when it goes the tool goes, and the body stays as it is for the next. Slow partners get fewer values, never older ones.
/// Safety     nothing that a socket sends ends `run`: who breaks the protocol, floods or falls silent loses the connection, and no one else notices.
/// Units      s, Hz.
/// Errors     the constructor: InvalidArgument for options that make no sense, NetworkError where it can not listen. `run` throws what the body throws, after
///            the hand was told goodbye.
/// Threads    `port`, `statistics`, `stop`: any. `node`, `body`: not while it runs.
/// Limits     no encryption, no authentication.
template <SimulatedBody BodyType, class CutterType = NoCutter<typename BodyType::Scalar>>
class TissueServer {
 public:
  using Body = BodyType;
  using Scalar = typename Body::Scalar;

  explicit TissueServer(Body body, TissueServerOptions const& options = {}) : TissueServer(std::move(body), CutterType(), options) {}
  TissueServer(Body body, CutterType cutter, TissueServerOptions const& options)
      : options_((options.validate(), options)),
        node_(std::move(body), std::move(cutter), options.node),
        surface_(options.node.surface, options.node.deadband) {
    listen();
  }
  TissueServer(TissueServer const&) = delete;
  TissueServer& operator=(TissueServer const&) = delete;

  std::uint16_t port() const noexcept { return port_; }

  /// Until a stop is asked for, here or there.
  void run(std::stop_token stop = {}) {
    stops_.store(false);
    is_ending_.store(false);
    begun_ = Clock::now();
    next_picture_ = 0.0;
    std::exception_ptr talk_failed, body_failed;
    std::thread talk([&] {
      try {
        talks();
      } catch (...) {
        talk_failed = std::current_exception();
        stops_.store(true);
      }
    });
    try {
      ticks(stop);
    } catch (...) {
      body_failed = std::current_exception();
    }
    is_ending_.store(true);
    talk.join();
    if (body_failed || talk_failed) std::rethrow_exception(body_failed ? body_failed : talk_failed);
  }
  /// Ends the run that goes on; before a run it does nothing.
  void stop() noexcept { stops_.store(true); }

  TissueServerStatistics statistics() const noexcept {
    TissueServerStatistics all = told_.read();
    all.body_ticks = body_ticks_.load(std::memory_order_relaxed), all.late_ticks = late_ticks_.load(std::memory_order_relaxed);
    return all;
  }
  TissueNode<Body, CutterType>& node() noexcept { return node_; }
  Body& body() noexcept { return node_.body(); }
  Body const& body() const noexcept { return node_.body(); }

 private:
  using Clock = std::chrono::steady_clock;
  using Tcp = boost::asio::ip::tcp;
  using Connection = detail::network::Connection;
  using Bytes = detail::network::Bytes;

  /// What the talking thread tells the body's.
  struct HandNews {
    std::uint64_t session = 0;   // of the hand; 0: there was none yet
    bool is_here = false;
    double heard = 0.0;          // s, when the sample came
    HandReport sample{};
  };
  /// What the body's thread tells the talking one.
  struct BodyNews {
    std::uint64_t session = 0;   // that the answer belongs to
    CapturedSurface<Scalar> captured{};
    TissueAnswer answer{};       // the last one that is worth sending
    std::uint64_t revision = 0;
  };
  struct Guest {
    std::shared_ptr<Connection> connection;
    std::optional<ClientRole> role{};
    std::uint64_t triangles = 0;   // of an onlooker, which were sent last; 0: none
    std::uint64_t pictures = 0;    // how many there were when it got one
  };

  double time() const noexcept { return detail::network::seconds_between(begun_, Clock::now()); }

  // --- the body's thread ------------------------------------------------------------------------------------------------
  void ticks(std::stop_token const& stop) {
    constexpr std::uint64_t max_caught_up = 4;   // a body too slow for its rate falls behind rather than taking ever longer steps
    double const period = 1.0 / options_.rate;
    Pacer pacer(options_.rate);
    while (!stop.stop_requested() && !stops_.load(std::memory_order_relaxed)) {
      auto const slot = pacer.wait();
      std::uint64_t const caught_up = std::min(slot.skipped, max_caught_up);
      if (slot.skipped > caught_up) node_.loop().leave_out(period * static_cast<double>(slot.skipped - caught_up));
      late_ticks_.fetch_add(slot.skipped, std::memory_order_relaxed);
      tick(period * static_cast<double>(1 + caught_up));
    }
  }
  void tick(double h) {
    double const now = time();
    HandNews const& hand = hand_news_.read();
    if (hand.session != session_) {
      node_.hand_came();
      session_ = hand.session, answer_ = {};
    }
    if (!hand.is_here)
      node_.hand_left();
    else if (hand.sample.sequence > 0)
      node_.take(hand.sample, hand.heard);
    node_.tick(h, now);
    simulated_ += h;
    body_ticks_.fetch_add(1, std::memory_order_relaxed);
    if (hand.is_here && node_.is_worth_sending(now)) answer_ = node_.last();
    BodyNews& news = body_news_.back();
    news.session = session_;
    news.captured = node_.captured(), news.captured.handed_over = time();
    news.answer = answer_;
    news.revision = body().topology_revision();
    body_news_.publish();
    if (onlookers_.load(std::memory_order_relaxed) > 0 && now >= next_picture_) {
      next_picture_ = std::max(next_picture_ + 1.0 / options_.picture_rate, now);
      draw();
    }
  }
  void draw() {
    auto const shown = node_.shown();
    ToolSnapshot<Scalar> tool{.phase = node_.last().phase};
    if (shown)
      tool.pose = {shown->position.template cast<Scalar>(), shown->orientation.template cast<Scalar>(), shown->velocity.template cast<Scalar>(),
                   static_cast<Scalar>(shown->opening)};
    snapshots_.publish(body(), simulated_, tool.pose.position, tool.phase, std::span(&tool, shown ? 1u : 0u));
  }

  // --- the talking thread -----------------------------------------------------------------------------------------------
  void listen() {
    namespace ip = boost::asio::ip;
    detail::network::ErrorCode error;
    auto const address = ip::make_address(options_.address, error);
    if (error)
      throw NetworkError(detail::message("TissueServer: \"", options_.address, "\" is no address; give one in numbers, 127.0.0.1 for this machine alone"));
    Tcp::endpoint const here(address, options_.port);
    auto const tried = [&](auto const& act) {
      if (!error) act();
    };
    acceptor_.open(here.protocol(), error);
    tried([&] { acceptor_.set_option(Tcp::acceptor::reuse_address(true), error); });
    tried([&] { acceptor_.bind(here, error); });
    tried([&] { acceptor_.listen(boost::asio::socket_base::max_listen_connections, error); });
    if (error) {
      char const* const advice = error == boost::asio::error::address_in_use ? "another program has that port: give another one, or 0 for any that is free"
                                 : error == boost::asio::error::access_denied ? "ports below 1024 need rights: give a higher one"
                                                                              : "give an address of this machine, 127.0.0.1 or 0.0.0.0";
      throw NetworkError(detail::message("TissueServer: can not listen on ", options_.address, ":", options_.port, " (", error.message(), "); ", advice));
    }
    port_ = acceptor_.local_endpoint().port();
  }

  void talks() {
    io_.restart();
    accept();
    detail::network::Beat const beat(io_, options_.surface_rate, [this] {
      bool const goes_on = talk();
      if (!goes_on) {
        detail::network::ErrorCode ignored;
        acceptor_.cancel(ignored);
        io_.stop();
      }
      return goes_on;
    });
    io_.run();
  }
  void accept() {
    acceptor_.async_accept([this](detail::network::ErrorCode error, Tcp::socket socket) {
      if (error == boost::asio::error::operation_aborted) return;
      if (!error) take(std::move(socket));
      accept_again_ = static_cast<bool>(error);   // no more files, perhaps: at the next beat
      if (!error) accept();
    });
  }
  void take(Tcp::socket socket) {
    ++counts_.connections;
    if (is_ending_.load() || guests_.size() >= static_cast<std::size_t>(options_.onlookers) + 1 + strangers) {
      ++counts_.refused;
      return;   // closes it
    }
    auto guest = std::make_unique<Guest>();
    guest->connection = std::make_shared<Connection>(
        std::move(socket), detail::network::ConnectionOptions{.silence = options_.silence, .bytes_per_second = options_.max_bytes_per_second, .refuses = true});
    Guest& one = *guests_.emplace_back(std::move(guest));
    one.connection->start([this, &one](Frame const& frame) { return use(one, frame); });
  }
  ProtocolProblem use(Guest& guest, Frame const& frame) {
    ProtocolProblem problem{};
    if (!guest.role) {
      if (frame.type != MessageType::hello) return ProtocolProblem::order;
      if (auto const hello = decode<Hello>(frame, problem)) greet(guest, *hello);
      return problem;
    }
    if (frame.type != MessageType::hand || guest.role != ClientRole::hand) return ProtocolProblem::order;
    if (auto const sample = decode<HandReport>(frame, problem)) {
      ++counts_.samples;
      if (sample->sequence > hand_.sample.sequence) hand_.sample = *sample, hand_.heard = time(), hand_news_.write(hand_);
    }
    return problem;
  }
  void greet(Guest& guest, Hello const& hello) {
    bool const is_hand = hello.role == ClientRole::hand;
    if (hello.oldest > protocol_version || hello.newest < protocol_version) return guest.connection->end(Farewell::version);
    if (is_hand && holder_ != nullptr) return guest.connection->end(Farewell::hand_taken);
    if (!is_hand && onlookers_.load() >= options_.onlookers) return guest.connection->end(Farewell::too_many);
    guest.role = hello.role;
    guest.connection->welcome(is_hand ? 16384 : 32768);   // bytes
    if (is_hand) {
      holder_ = &guest;
      ++counts_.hands;
      surface_.hand_came();
      tissue_sent_ = 0;
      hand_ = {.session = hand_.session + 1, .is_here = true};
      hand_news_.write(hand_);
    } else {
      guest.pictures = pictures_;   // it waits for a new one
      onlookers_.fetch_add(1);
    }
    guest.connection->add(Welcome{.version = protocol_version,
                                  .session = session_number_,
                                  .body_rate = options_.rate,
                                  .surface_rate = options_.surface_rate,
                                  .contact_stiffness = node_.contact_stiffness(),
                                  .revision = body_news_.read().revision});
    guest.connection->flush();
  }

  /// All that there is to do at a beat. False once all is said.
  bool talk() {
    bool const ends = is_ending_.load();
    if (std::exchange(accept_again_, false)) accept();
    BodyNews const& news = body_news_.read();
    prepare_picture();
    for (auto& guest : guests_) {
      if (ends) guest->connection->end(Farewell::ended);
      if (guest->connection->is_free() && guest->role) guest->role == ClientRole::hand ? answer(*guest, news) : show(*guest);
      guest->connection->flush();
      guest->connection->watch();
      if (guest->connection->is_closed()) leave(*guest);
    }
    std::erase_if(guests_, [](auto const& guest) { return guest->connection->is_closed(); });
    counts_.rtt = holder_ != nullptr ? holder_->connection->rtt() : 0.0;
    counts_.has_hand = holder_ != nullptr;
    counts_.onlookers = onlookers_.load();
    told_.write(counts_);
    return !ends || !guests_.empty();
  }
  void answer(Guest& hand, BodyNews const& news) {
    if (news.session != hand_.session) return;   // the body has not noticed yet
    double const now = time();
    if (hand_.sample.sequence > 0) {
      SurfaceAnswer const& surface = surface_.look(news.captured, hand_.sample, now, 1.5 / options_.rate);
      if (surface_.is_worth_sending(now)) hand.connection->add(surface), ++counts_.surfaces;
    }
    if (news.answer.stamp.sequence > tissue_sent_) {
      tissue_sent_ = news.answer.stamp.sequence;
      hand.connection->add(news.answer);
      ++counts_.tissues;
    }
  }
  /// The frames of the newest picture, once for all.
  void prepare_picture() {
    if (!snapshots_.fetch()) return;
    BodySnapshot<Scalar> const& picture = snapshots_.latest();
    auto const revision = static_cast<std::uint64_t>(picture.topology_revision);
    if (std::max(picture.points.cols(), picture.triangles.cols()) > static_cast<Eigen::Index>(PictureFormat::max_total)) return;
    Drawn const drawn{.time = picture.time,
                      .revision = revision,
                      .points = static_cast<std::uint32_t>(picture.points.cols()),
                      .triangles = static_cast<std::uint32_t>(picture.triangles.cols()),
                      .has_hand = !picture.tools.empty(),
                      .tip = picture.tip.template cast<double>(),
                      .orientation = picture.tools.empty() ? Eigen::Quaterniond::Identity() : picture.tools[0].pose.orientation.template cast<double>(),
                      .phase = picture.phase};
    auto points = std::make_shared<Bytes>();
    if (!append_points(*points, picture) || !drawn.valid()) return;   // a body that flies away can not be shown
    std::array<std::byte, max_fixed_frame> last;
    points->insert(points->end(), last.begin(), last.begin() + static_cast<std::ptrdiff_t>(encode(drawn, last)));
    if (!triangles_ || revision != triangles_revision_) {
      auto triangles = std::make_shared<Bytes>();
      append_triangles(*triangles, picture);
      triangles_ = std::move(triangles), triangles_revision_ = revision, ++triangles_number_;
    }
    points_ = std::move(points), ++pictures_;
  }
  void show(Guest& onlooker) {
    if (!points_ || onlooker.pictures == pictures_) return;
    if (onlooker.triangles != triangles_number_) onlooker.connection->add(triangles_), onlooker.triangles = triangles_number_;
    onlooker.connection->add(points_), onlooker.pictures = pictures_;
    ++counts_.pictures;
  }
  void leave(Guest& guest) {
    Connection const& connection = *guest.connection;
    if (&guest == holder_) {
      holder_ = nullptr;
      hand_.is_here = false;
      hand_news_.write(hand_);
    } else if (guest.role == ClientRole::onlooker) {
      onlookers_.fetch_sub(1);
    }
    counts_.sent += connection.sent(), counts_.received += connection.received();
    if (auto const why = connection.why(); !guest.role && why) ++counts_.refused;
    if (connection.problem() != ProtocolProblem::none) ++counts_.problems[static_cast<std::size_t>(connection.problem())];
    if (connection.why() == Farewell::silent) ++counts_.silent;
    if (connection.why() == Farewell::too_fast) ++counts_.too_fast;
  }

  static constexpr std::size_t strangers = 16;   // connections that have not said who they are

  TissueServerOptions const options_;
  Clock::time_point begun_{};
  std::uint64_t const session_number_ = static_cast<std::uint64_t>(std::chrono::system_clock::now().time_since_epoch().count());
  std::uint16_t port_ = 0;

  // the body's thread
  TissueNode<Body, CutterType> node_;
  std::uint64_t session_ = 0;
  TissueAnswer answer_{};
  double simulated_ = 0.0, next_picture_ = 0.0;   // s

  // between the two, and for others
  TripleBuffer<HandNews> hand_news_;
  TripleBuffer<BodyNews> body_news_;
  SnapshotChannel<Scalar> snapshots_;
  std::atomic<int> onlookers_{0};
  std::atomic<bool> stops_{false}, is_ending_{false};
  std::atomic<std::uint64_t> body_ticks_{0}, late_ticks_{0};
  Seqlock<TissueServerStatistics> told_;

  // the talking thread
  SurfaceNode<Scalar> surface_;
  HandNews hand_{};
  Guest* holder_ = nullptr;   // of the hand
  std::uint64_t tissue_sent_ = 0, pictures_ = 0, triangles_revision_ = 0, triangles_number_ = 0;
  std::shared_ptr<Bytes const> points_, triangles_;
  TissueServerStatistics counts_{};
  bool accept_again_ = false;
  boost::asio::io_context io_{1};
  Tcp::acceptor acceptor_{io_};
  std::vector<std::unique_ptr<Guest>> guests_;
};

}  // namespace palpate
