// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/device/session.hpp>
#include <palpate/network/hand_reporter.hpp>
#include <palpate/network/impaired_link.hpp>
#include <palpate/network/options.hpp>
#include <palpate/network/protocol.hpp>
#include <palpate/network/remote_tissue.hpp>
#include <palpate/network/surface_then_tissue.hpp>
#include <palpate/network/tissue_node.hpp>
#include <palpate/simulator/recording.hpp>
#include <palpate/simulator/servo_loop.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

namespace palpate {

struct NetworkSimulationOptions {
  double body_rate = 100.0;            ///< Hz, of the server's slow side
  double surface_rate = 500.0;         ///< Hz, of its fast side
  Impairment up{}, down{};             ///< from the hand to the tissue, and back
  WeberDeadbandOptions deadband{};     ///< of the hand's samples; that of the answers is the server's
  TissueNodeOptions server{};
  ServoOptions servo{};
  RemoteTissueOptions remote{};
};

/// What went over the network.
struct NetworkCounts {
  std::uint64_t sent_up = 0, sent_down = 0;         ///< messages
  std::uint64_t bytes_up = 0, bytes_down = 0;
  std::uint64_t lost_up = 0, lost_down = 0;         ///< first copies; TCP sends them again
  RemoteCounts answers{};
};

/// Client and server of a haptic hierarchy in one program, on one virtual clock, with a bad network between them: the same devices, bodies, forces, messages and
/// bytes as over sockets, in lock-step. The same inputs and seeds give the same bytes.
///   each tick of the servo: samples that have arrived → tick of the body, where one is due → surface, where one is due → answers that have arrived → read, respond
/// Units      s, Hz, m, N.
/// Errors     InvalidArgument for options that make no sense.
template <class Device, SimulatedBody Body, class CutterType, class Force = SurfaceThenTissue<double>>
class NetworkSimulation {
 public:
  NetworkSimulation(Device device, Body body, CutterType cutter, Force force, NetworkSimulationOptions const& options = {})
      : options_(checked(options)),
        servo_(std::move(device), std::move(force), over_a_network(options.servo)),
        tissue_(std::move(body), std::move(cutter), options.server),
        surface_(options.server.surface, options.server.deadband),
        reporter_(options.deadband),
        remote_(options.remote),
        up_(options.up),
        down_(options.down) {}

  /// after_tick(tick) once a tick of the servo, if given.
  template <class AfterTick>
  Recording run(double seconds, AfterTick const& after_tick) {
    if (!(seconds >= 0.0) || !(seconds < 1e6)) throw InvalidArgument(detail::message("NetworkSimulation: a run of ", seconds, " s; it must not be negative nor above 1e6 s"));
    DeviceSession const session(servo_.device());
    servo_.begin_session(options_.body_rate);
    if (!(options_.surface_rate <= servo_.rate()))
      throw InvalidArgument(detail::message("NetworkSimulation: .surface_rate is ", options_.surface_rate, " Hz, and the device ticks at ", servo_.rate(), " Hz; give at most that"));
    auto const ticks = static_cast<std::uint64_t>(std::llround(seconds * servo_.rate()));
    Recording recording(ticks);
    for (std::uint64_t k = 0; k < ticks; ++k) {
      Tick const tick = one_tick();
      recording.append(tick);
      after_tick(tick);
    }
    servo_.write_zero_force();
    recording.set_saturation(servo_.chain().saturation());
    return recording;
  }
  Recording run(double seconds) {
    return run(seconds, [](Tick const&) {});
  }

  double time() const noexcept { return servo_.rate() > 0.0 ? static_cast<double>(done_) / servo_.rate() : 0.0; }
  NetworkCounts counts() const noexcept {
    return {.sent_up = up_.messages(), .sent_down = down_.messages(), .bytes_up = up_.bytes(), .bytes_down = down_.bytes(), .lost_up = up_.lost(), .lost_down = down_.lost(),
            .answers = remote_.counts()};
  }
  Device& device() noexcept { return servo_.device(); }
  Force& force() noexcept { return servo_.force(); }
  auto const& servo() const noexcept { return servo_; }
  auto& servo() noexcept { return servo_; }
  /// The tissue as the hand's side knows it, and as it is.
  RemoteTissue const& remote() const noexcept { return remote_; }
  TissueNode<Body, CutterType> const& tissue() const noexcept { return tissue_; }
  TissueNode<Body, CutterType>& tissue() noexcept { return tissue_; }
  Body& body() noexcept { return tissue_.body(); }

 private:
  static NetworkSimulationOptions const& checked(NetworkSimulationOptions const& options) {
    detail::OptionCheck const require{"NetworkSimulation", true};
    require(options.body_rate >= 1.0, ".body_rate", options.body_rate, " Hz", "give 1 or more, 30 to 100 for most");
    require(options.surface_rate >= options.body_rate, ".surface_rate", options.surface_rate, " Hz", "give the body's rate or more, 100 to 500 for most");
    return options;
  }

  Tick one_tick() {
    double const rate = servo_.rate(), now = static_cast<double>(done_) / rate;
    up_.receive(now, [&](std::span<std::byte const> bytes) {
      if (auto const sample = decoded<HandReport>(bytes)) sample_ = *sample, tissue_.take(*sample, now);
    });
    if (is_due(bodies_, options_.body_rate, now)) {
      tissue_.tick(1.0 / options_.body_rate, now);
      if (tissue_.is_worth_sending(now)) send(down_, tissue_.last(), now);
    }
    if (is_due(surfaces_, options_.surface_rate, now) && sample_.sequence > 0) {
      SurfaceAnswer const& answer = surface_.look(tissue_.captured(), sample_, now, 1.5 / options_.body_rate);
      if (surface_.is_worth_sending(now)) send(down_, answer, now);
    }
    down_.receive(now, [&](std::span<std::byte const> bytes) {
      if (static_cast<MessageType>(bytes[5]) == MessageType::surface) {
        if (auto const answer = decoded<SurfaceAnswer>(bytes)) remote_.take(*answer, now);
      } else if (auto const answer = decoded<TissueAnswer>(bytes)) {
        remote_.take(*answer, now);
      }
    });
    servo_.read(1.0 / rate);
    if (servo_.placed()) {
      remote_.placed(servo_.pose_discontinuities());
      if (auto const sample = reporter_(servo_.tool(), servo_.pose_discontinuities(), remote_, now)) send(up_, *sample, now);
    }
    ++done_;
    return servo_.respond(remote_.model(), now);
  }

  template <class M>
  void send(ImpairedLink& link, M const& message, double now) {
    std::array<std::byte, max_fixed_frame> frame;
    link.send({frame.data(), encode(message, frame)}, now);
  }
  template <class M>
  std::optional<M> decoded(std::span<std::byte const> bytes) noexcept {
    ProtocolProblem problem{};
    return decode<M>({static_cast<MessageType>(bytes[5]), bytes.subspan(FrameFormat::header)}, problem);
  }
  /// Counts in whole periods, so that nothing drifts.
  static bool is_due(std::uint64_t& count, double rate, double now) noexcept {
    if (now * rate < static_cast<double>(count) - 1e-6) return false;
    ++count;
    return true;
  }

  NetworkSimulationOptions options_;
  ServoLoop<Device, Force, double> servo_;
  TissueNode<Body, CutterType> tissue_;
  SurfaceNode<typename Body::Scalar> surface_;
  HandReporter reporter_;
  RemoteTissue remote_;
  ImpairedLink up_, down_;
  HandReport sample_{};
  std::uint64_t done_ = 0, bodies_ = 0, surfaces_ = 0;
};

}  // namespace palpate
