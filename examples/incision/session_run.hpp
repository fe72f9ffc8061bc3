// SPDX-License-Identifier: MIT
#pragma once

#include "hand_device.hpp"
#include "hand_force.hpp"
#include "progress.hpp"
#include "session.hpp"

#include <palpate/palpate.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <optional>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

namespace incision {

using palpate::CuttingPhase;

constexpr double frame_period = 0.04;    // s, of the series
constexpr double after_release = 2.0;    // s, when the gap is measured

template <class Cutter>
concept HasLips = requires(Cutter const& cutter) { cutter.lips(); };

/// The largest distance between two particles of a solid that have one place in the undeformed shape.
template <class Body>
double widest_gap(Body const& body) {
  std::vector<int> order(static_cast<std::size_t>(body.size()));
  std::iota(order.begin(), order.end(), 0);
  auto const rest = [&](int i) {
    Vector const X = body.tissue().rest_position(i);
    return std::array{X[0], X[1], X[2]};
  };
  std::sort(order.begin(), order.end(), [&](int i, int j) { return rest(i) < rest(j); });
  double widest = 0.0;
  for (std::size_t k = 1; k < order.size(); ++k)
    if (rest(order[k - 1]) == rest(order[k])) widest = std::max(widest, (body.positions().col(order[k - 1]) - body.positions().col(order[k])).norm());
  return widest;
}

/// The largest distance between two particles that were one before the cut.
template <class Simulator>
double gap_of(Simulator const& simulator) {
  if constexpr (HasLips<std::remove_cvref_t<decltype(simulator.cutter())>>) {
    double gap = 0.0;
    auto const x = simulator.body().positions();
    for (auto const& [left, right] : simulator.cutter().lips()) gap = std::max(gap, (x.col(left) - x.col(right)).norm());
    return gap;
  } else {
    return widest_gap(simulator.body());
  }
}

template <class Simulator>
Frame frame_of(Simulator const& simulator, palpate::Tick const& tick) {
  auto const& body = simulator.body();
  Frame frame{.time = tick.time, .mesh = body.drawn_mesh(), .displacement = {}, .tip = tick.tip, .phase = tick.phase, .depth = tick.depth};
  palpate::Matrix3X<double> displacement = body.positions();
  for (int i = 0; i < body.size(); ++i) displacement.col(i) -= body.reference_position(i);
  body.draw_columns(displacement, frame.displacement);
  return frame;
}

/// In lock-step: frames are taken between ticks by frame_at(simulator, tick), and their time does not count.
template <class Simulator, class FrameAt>
void run_lockstep(Simulator& simulator, Hand const& hand, Outcome& outcome, FrameAt const& frame_at) {
  using Clock = std::chrono::steady_clock;
  Progress progress("simulating");
  auto const started = Clock::now();
  Clock::duration aside{};
  long long next_frame = 0;
  CuttingPhase before = CuttingPhase::no_contact;
  outcome.recording = simulator.run(hand.seconds, [&](palpate::Tick const& tick) {
    auto const paused = Clock::now();
    if (before == CuttingPhase::moving && tick.phase != CuttingPhase::moving) {
      outcome.release = tick.time;
      outcome.gap.reset();
      outcome.cut = simulator.cutter().report();
    }
    before = tick.phase;
    if (outcome.release && !outcome.gap && tick.time >= *outcome.release + after_release) outcome.gap = gap_of(simulator);
    if (tick.time >= frame_period * double(next_frame) - 1e-9) {
      outcome.frames.push_back(frame_at(simulator, tick));
      ++next_frame;
      progress.show(tick.time / hand.seconds, to_string(tick.phase));
    }
    aside += Clock::now() - paused;
  });
  progress.show(1.0, "done");
  outcome.wall_seconds = std::chrono::duration<double>(Clock::now() - started - aside).count();
}

/// In real time: another thread collects what the body publishes, as a window would; frame_of(snapshot).
template <class Simulator, class FrameOf>
void run_realtime(Simulator& simulator, Hand const& hand, Outcome& outcome, FrameOf const& frame_from) {
  std::atomic<bool> running{true};
  std::thread collector([&] {
    Progress progress("simulating");
    auto& channel = simulator.snapshots();
    double last = -1.0;
    while (running.load()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      if (!channel.fetch()) continue;
      auto const& now = channel.latest();
      if (now.time < last + frame_period) continue;
      last = now.time;
      outcome.frames.push_back(frame_from(now));
      progress.show(now.time / hand.seconds, to_string(now.phase));
    }
  });
  auto const started = std::chrono::steady_clock::now();
  try {
    outcome.recording = simulator.run_realtime(hand.seconds);
  } catch (...) {
    running.store(false);
    collector.join();
    throw;
  }
  outcome.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  running.store(false);
  collector.join();

  auto const& ticks = outcome.recording.ticks();
  for (std::size_t i = 1; i < ticks.size(); ++i)
    if (ticks[i - 1].phase == CuttingPhase::moving && ticks[i].phase != CuttingPhase::moving) outcome.release = ticks[i].time;
  if (outcome.release && hand.seconds >= *outcome.release + after_release) outcome.gap = gap_of(simulator);
  for (Frame& frame : outcome.frames) {   // the depth is the servo's to know
    auto const tick = std::lower_bound(ticks.begin(), ticks.end(), frame.time, [](palpate::Tick const& t, double time) { return t.time < time; });
    if (tick != ticks.end()) frame.depth = tick->depth;
  }
}

/// Both ways, and what there is to say of any tissue.
template <class Simulator, class FrameAt, class FrameOf>
Outcome run_and_report(Simulator& simulator, Hand const& hand, bool realtime, FrameAt const& frame_at, FrameOf const& frame_from) {
  Outcome outcome;
  outcome.particles_before = simulator.body().size();
  outcome.triangles_before = static_cast<int>(simulator.body().triangles().cols());
  outcome.realtime = realtime;
  if (realtime)
    run_realtime(simulator, hand, outcome, frame_from);
  else
    run_lockstep(simulator, hand, outcome, frame_at);
  if (outcome.frames.empty()) outcome.frames.push_back(frame_at(simulator, palpate::Tick{.tip = hand.path.begin()}));

  outcome.device = description_of(simulator.device());
  outcome.device_faults = faults_of(simulator.device());
  auto const statistics = simulator.statistics();
  outcome.cut = simulator.cutter().report();
  outcome.particles_after = simulator.body().size();
  outcome.triangles_after = static_cast<int>(simulator.body().triangles().cols());
  outcome.pieces = static_cast<int>(palpate::connected_components(simulator.body().mesh()).size());
  outcome.servo = statistics.servo;
  outcome.body = statistics.body;
  outcome.body_counts = statistics.body_counts;
  return outcome;
}

template <class Integrator, class Region>
Outcome run_with(Options const& options, Organ const& organ, Hand& hand, Integrator integrator, Region region) {
  palpate::MassSpring<double> tissue(organ.mesh, {.mass = {.total = organ.mass},
                                                  .link = {.stiffness = organ.link_stiffness, .damping = organ.link_damping},
                                                  .home = {.stiffness = organ.home_stiffness, .damping = organ.home_damping},
                                                  .link_prestrain = options.prestrain.value_or(default_prestrain)});
  tissue.nail(organ.underside);
  palpate::SoftBody body(std::move(tissue), integrator, region);   // settles under its pre-tension
  body.reserve(body.size() + 4000, static_cast<int>(organ.mesh.triangles.cols()) + 8000);
  hand = prepare_hand(options, organ, body.mesh());

  Device device = make_device(options, hand);
  bool const realtime = options.realtime || keeps_time(device);
  palpate::Simulator simulator(std::move(device), std::move(body),
                               palpate::ProgressiveCutter<double>({.puncture_depth = organ.puncture_depth}),
                               HandForce(options, hand.along), {.servo = {.mapping = mapping_of(options, hand)}});
  Outcome outcome = run_and_report(simulator, hand, realtime, [](auto const& all, palpate::Tick const& tick) { return frame_of(all, tick); }, [](auto const& now) {
    return Frame{.time = now.time, .mesh = {now.points, now.triangles}, .displacement = {}, .tip = now.tip, .phase = now.phase};
  });
  auto const rest = simulator.body().rest_mesh();
  for (auto const& [a, b] : palpate::boundary_edges(rest)) outcome.cut_length += (rest.points.col(a) - rest.points.col(b)).norm() / 2;   // two lips
  return outcome;
}

template <class Region>
Outcome with_integrator(Options const& options, Organ const& organ, Hand& hand, Region region) {
  switch (options.integrator.value_or(IntegratorName::leapfrog)) {
    case IntegratorName::leapfrog: return run_with(options, organ, hand, palpate::LeapfrogVerlet{}, region);
    case IntegratorName::velocity_verlet: return run_with(options, organ, hand, palpate::VelocityVerlet{}, region);
    case IntegratorName::symplectic_euler: return run_with(options, organ, hand, palpate::SymplecticEuler{}, region);
    case IntegratorName::explicit_euler: return run_with(options, organ, hand, palpate::ExplicitEuler{}, region);
    case IntegratorName::runge_kutta_4: return run_with(options, organ, hand, palpate::RungeKutta4{}, region);
    case IntegratorName::backward_euler: break;   // refused with springs
  }
  return {};
}

}  // namespace incision
