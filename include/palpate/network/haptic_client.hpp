// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/tool_pose.hpp>
#include <palpate/core/triple_buffer.hpp>
#include <palpate/device/session.hpp>
#include <palpate/network/detail/client_link.hpp>
#include <palpate/network/hand_reporter.hpp>
#include <palpate/network/options.hpp>
#include <palpate/network/protocol.hpp>
#include <palpate/network/remote_tissue.hpp>
#include <palpate/network/surface_then_tissue.hpp>
#include <palpate/simulator/pacer.hpp>
#include <palpate/simulator/realtime_servo.hpp>
#include <palpate/simulator/recording.hpp>
#include <palpate/simulator/seqlock.hpp>
#include <palpate/simulator/tick_statistics.hpp>

#include <boost/asio/io_context.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

namespace palpate {

/// What went over the network since the client was made.
struct HapticClientCounts {
  std::uint64_t patches = 0;                         ///< surfaces and tissue answers that were used
  std::uint64_t connections = 0, reconnects = 0;     ///< reconnects: those after the first of a run
  std::uint64_t sent = 0, left_out = 0;              ///< samples; left out by the deadband
  std::uint64_t problems = 0;                        ///< connections that ended because the server broke the protocol
  std::uint64_t bytes_sent = 0, bytes_received = 0;
  RemoteCounts answers{};
  double rtt = 0.0;                                  ///< s, the way there and back; 0: not measured yet
  double latency = 0.0;                              ///< s, from a sample to the answer to it, in ticks of the servo
  std::optional<Farewell> last_farewell{};           ///< why the last connection ended or was refused, where that was said
  bool is_connected = false;
};
struct HapticClientStatistics : HapticClientCounts {
  TickStatistics servo{};   ///< of this run, or the last
  ServoCounts servo_counts{};
};

/// The hand's side of a haptic hierarchy over TCP: device and force at the servo's rate here, on a plane or ball that a TissueServer sends and with what its
/// tissue answers.
///
///   HapticClient client(PhantomDevice(), {.server = "simulator", .port = 4747});
///   Recording const session = client.run_realtime(60.0);
///
/// run_realtime   opens the device and connects, then the servo runs on a thread of its own and the calling thread talks. Between them are two triple buffers.
/// A lost server  or a silent one: the last surface stays until it is `stale_after` old, then the force fades to zero. Every `retry` seconds the client
///                tries to connect again; then the tool has to touch anew. The run ends when its time is over.
/// Safety         what a server says is checked and limited: see RemoteTissueOptions. The device's own limits hold as with every force.
/// Units          s, Hz, m, N.
/// Errors         InvalidArgument for options or a duration that make no sense. NetworkError where there is no first connection within `connect_timeout`, or
///                the server refuses it. Error where a device's own clock stands still. Whatever happens, zero is written last.
/// Threads        `stop`, `statistics`: any. `shown`: one, besides. All else: that which runs.
/// Limits         a run ends no sooner than the system has looked the server's name up, whatever `connect_timeout` says: where names may be slow, as with no
///                network, give an address in numbers.
template <class Device, class Force = SurfaceThenTissue<double>>
class HapticClient {
 public:
  explicit HapticClient(Device device, HapticClientOptions const& options = {}) : HapticClient(std::move(device), Force(), options) {}
  HapticClient(Device device, Force force, HapticClientOptions const& options)
      : options_((options.validate(), options)),
        servo_{.loop{std::move(device), std::move(force), over_a_network(options.servo)}},
        reporter_(options.deadband),
        remote_(options.remote) {}
  HapticClient(HapticClient const&) = delete;
  HapticClient& operator=(HapticClient const&) = delete;

  /// So many seconds of the hand.
  Recording run_realtime(double seconds) {
    if (!(seconds >= 0.0) || !(seconds < 1e6))
      throw InvalidArgument(detail::message("HapticClient: a run of ", seconds, " s; it must not be negative nor above 1e6 s"));
    flags_.stop.store(false), flags_.body_runs.store(true);
    DeviceSession const session(servo_.loop.device());
    Run run(*this, seconds);
    try {
      run.io.run();
    } catch (...) {
      flags_.body_runs.store(false);
      if (run.servo) run.servo->end();
      finish(run);
      throw;
    }
    finish(run);
    return run.servo ? run.servo->take_recording() : Recording();
  }
  /// Ends the run that goes on, and the recording; before a run it does nothing.
  void stop() noexcept { flags_.stop.store(true, std::memory_order_release); }

  /// Each part is whole; the servo's are published every 50 ticks.
  HapticClientStatistics statistics() const noexcept {
    HapticClientStatistics all;
    static_cast<HapticClientCounts&>(all) = told_.read();
    SimulatorStatistics const servo = servo_.live->statistics();
    all.servo = servo.servo, all.servo_counts = servo.servo_counts;
    return all;
  }
  /// The tool as it is to be drawn: outside the tissue, on the surface where the hand is behind it. For one thread.
  ToolPose<double> const& shown() noexcept { return shown_.read(); }

  // --- between runs -------------------------------------------------------------------------------------------------------
  Device& device() noexcept { return servo_.loop.device(); }
  Force& force() noexcept { return servo_.loop.force(); }
  auto const& servo() const noexcept { return servo_.loop; }
  auto& servo() noexcept { return servo_.loop; }

 private:
  using Servo = detail::RealtimeServo<Device, Force, double>;
  using Clock = std::chrono::steady_clock;

  /// What lives as long as a run.
  struct Run {
    Run(HapticClient& client, double its_seconds)
        : seconds(its_seconds),
          rate(static_cast<double>(client.servo_.loop.device().capabilities().rate)),
          gives_up_at(Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(client.options_.connect_timeout))),
          link(io, {.server = client.options_.server, .port = client.options_.port, .hello = {.role = ClientRole::hand, .rate = std::clamp(rate, 1.0, 1e5)},
                    .connect_timeout = client.options_.connect_timeout, .retry = client.options_.retry, .silence = client.options_.silence},
               [&client, this](Welcome const& welcome) { client.welcomed(*this, welcome); },
               [&client, this](Frame const& frame) { return client.use(*this, frame); }),
          beat(io, client.options_.send_rate > 0.0 ? client.options_.send_rate : std::clamp(rate, 50.0, 1000.0), [&client, this] {
            bool const goes_on = client.talk(*this);
            if (!goes_on) io.stop();
            return goes_on;
          }) {}

    double const seconds, rate;   // s, Hz
    Clock::time_point const gives_up_at;
    std::optional<Servo> servo{};   // from the first connection on
    double reported_at = -1.0;      // s, the pose that was looked at last
    boost::asio::io_context io{1};
    detail::network::ClientLink link;
    detail::network::Beat beat;
  };

  void welcomed(Run& run, Welcome const& welcome) {
    reporter_.reconnected();
    if (run.servo) {
      remote_.reconnected();
      ++counts_.reconnects;
      return;
    }
    remote_.begin_session();
    servo_.loop.begin_session(welcome.body_rate);
    servo_.statistics = TickStatistics(Pacer::period_of(servo_.loop.rate()));
    run.servo.emplace(servo_, options_.realtime, static_cast<std::uint64_t>(std::llround(run.seconds * servo_.loop.rate())), flags_);
    run.servo->start();
  }

  /// All that there is to do at a beat. False at the end.
  bool talk(Run& run) {
    run.link.tick();
    if (!run.servo) {
      if (flags_.stop.load()) return false;
      wait(run);
      return true;
    }
    run.servo->watch();
    if (run.servo->runs()) {
      report(run);
    } else {
      run.servo->end();
      run.link.end();
    }
    if (auto* const connection = run.link.connection()) connection->flush();
    tell(run);
    return !run.link.has_ended();
  }
  /// For the first connection, with patience for a server that is not there or a hand that is about to leave.
  void wait(Run& run) const {
    auto const refusal = run.link.refusal();
    bool const is_taken = refusal == Farewell::hand_taken;
    bool const is_refused = refusal == Farewell::version || refusal == Farewell::protocol || run.link.counts().problems > 0;   // else it may be ending
    if (!is_refused && Clock::now() < run.gives_up_at) return;
    char const* const advice = is_taken                         ? "end the other client, or wait for it"
                               : refusal == Farewell::version   ? "client and server need the same version of palpate"
                               : is_refused                     ? "is that a palpate server, and of this version?"
                                                                : "start the server there, and give the port that it says it listens on";
    std::string const problem = run.link.problem().empty() ? "no answer in time" : run.link.problem();
    throw NetworkError(detail::message("HapticClient: no connection with ", options_.server, ":", options_.port, " (", problem, "); ", advice));
  }
  /// The newest pose, if it is worth it.
  void report(Run& run) {
    Servo& servo = *run.servo;
    if (!servo.fetch_pose() || servo.pose().clock == run.reported_at) return;
    auto const& pose = servo.pose();
    remote_.placed(pose.pose_discontinuities);
    shown_.back() = pose.tool;
    shown_.back().position = remote_.shown(pose.tool.position);
    shown_.publish();
    auto* const connection = run.link.connection();
    if (connection == nullptr || !connection->is_free()) return;   // newer ones will come
    run.reported_at = pose.clock;
    if (auto const sample = reporter_(pose.tool, pose.pose_discontinuities, remote_, pose.clock)) connection->add(*sample);
  }
  ProtocolProblem use(Run& run, Frame const& frame) {
    ProtocolProblem problem{};
    if (frame.type == MessageType::surface) {
      if (auto const answer = decode<SurfaceAnswer>(frame, problem)) take(run, *answer);
    } else if (frame.type == MessageType::tissue) {
      if (auto const answer = decode<TissueAnswer>(frame, problem)) take(run, *answer);
    } else {
      problem = ProtocolProblem::order;
    }
    return problem;
  }
  /// Its time is that of the newest pose, which is never after a tick that placed the tool anew: no answer from before counts.
  template <class Answer>
  void take(Run& run, Answer const& answer) {
    Servo& servo = *run.servo;
    if (!servo.fetch_pose()) return;   // the hand has not been anywhere
    remote_.placed(servo.pose().pose_discontinuities);
    if (remote_.take(answer, servo.pose().clock)) servo.publish(remote_.model(), remote_.model().time);
  }

  void finish(Run const& run) noexcept {
    tell(run);
    counts_ = told_.read();
  }
  void tell(Run const& run) noexcept {
    HapticClientCounts now = counts_;
    auto const link = run.link.counts();
    now.connections += link.connections, now.problems += link.problems;
    now.bytes_sent += link.sent_bytes, now.bytes_received += link.received_bytes;
    if (link.last_farewell) now.last_farewell = link.last_farewell;
    now.answers = remote_.counts();
    now.patches = now.answers.surfaces + now.answers.tissues;
    now.sent = reporter_.deadband().sent(), now.left_out = reporter_.deadband().left_out();
    now.latency = remote_.latency();
    auto const* const connection = run.link.connection();
    now.is_connected = connection != nullptr;
    now.rtt = connection != nullptr ? connection->rtt() : told_.read().rtt;
    told_.write(now);
  }

  HapticClientOptions const options_;
  detail::ToolServo<Device, Force, double> servo_;
  detail::RunFlags flags_;
  HandReporter reporter_;
  RemoteTissue remote_;
  HapticClientCounts counts_{};
  Seqlock<HapticClientCounts> told_;
  TripleBuffer<ToolPose<double>> shown_;
};

}  // namespace palpate
