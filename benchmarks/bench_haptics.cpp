// SPDX-License-Identifier: MIT
// What the hand's side costs in a servo tick of 1 ms: the whole tick, and each part alone.
//   bench_haptics
// The whole tick reads a device that says what a stylus of 45 g says, a button held, positions in steps of 55 µm and no velocity; asks
// CuttingForce (the liver's hysteresis, an organ force, noise); lays over it the spring to a proxy with friction on three planes, handed over every
// 33 ticks while they tilt and rise; and writes through the whole safety chain of a device that moves a hand, thermal limit included, and a passivity
// controller with a reservoir so small that it has to damp.
//   Time, CPU        mean of a batch without a clock inside, wall and processor time
//   p50, p99, p99.9  µs, of ticks timed one by one, nothing taken off; `own_clock` is a tick in which nothing happens
//   p99/5us          the p99 as a share of 5 µs
//   cold             the same, with 4 MiB read between two ticks: what the body leaves of the caches. Time is the mean of these ticks, CPU the
//                    reading too. `switched` is the share of ticks before which, since the tick before, another program had the core: p50s is
//                    their median, p99a the p99 of all others
// and of the ticks one by one what share was in contact, on an edge (two planes push), in the corner (three), sliding, damped by the controller.
// Another program that takes the core for a while is in Time, and in p99.9; it comes too seldom for the p99, unless there are many.
#include <palpate/core/triple_buffer.hpp>
#include <palpate/force/cutting_force.hpp>
#include <palpate/force/liver.hpp>
#include <palpate/force/noise.hpp>
#include <palpate/force/organ_force.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/haptics/overlay.hpp>
#include <palpate/haptics/passivity.hpp>
#include <palpate/haptics/patch_handover.hpp>
#include <palpate/haptics/plane_handover.hpp>
#include <palpate/haptics/plane_set.hpp>
#include <palpate/haptics/safety_chain.hpp>
#include <palpate/haptics/surface_proxy.hpp>
#include <palpate/haptics/velocity_estimate.hpp>
#include <palpate/haptics/virtual_coupling.hpp>
#include <palpate/simulator/servo_loop.hpp>

#include "servo_scene.hpp"

#include <benchmark/benchmark.h>

#include <Eigen/Geometry>

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace {

using namespace palpate;
using namespace benchmarks;

/// Planes that arrive through a triple buffer, handed over, and the spring to a proxy with friction in front of them.
template <RealScalar S>
class ProxyOverlay {
 public:
  explicit ProxyOverlay(TripleBuffer<ToldPlanes<S>>& told) : told_(&told), proxy_({.static_friction = 0.4, .dynamic_friction = 0.25}) {}
  Vector3<S> operator()(ToolMotion<S> const& motion) noexcept {
    if (told_->fetch()) handover_.take(told_->front().planes, told_->front().stiffness, told_->front().sequence, motion.tip);
    if (!motion.continues) proxy_.reset();
    PlaneSet<S> const planes = handover_(motion.tip);
    return proxy_(planes, motion.tip, handover_.stiffness());
  }
  SurfaceProxy<S> const& proxy() const noexcept { return proxy_; }

 private:
  TripleBuffer<ToldPlanes<S>>* told_;
  PlaneHandover<S> handover_{};
  SurfaceProxy<S> proxy_;
};

template <RealScalar S>
auto liver_force() {
  return CuttingForce(liver_hysteresis<S>(), OrganForce<S>{.coefficient = S(2)}, WhiteGaussianNoise<S>({.snr_db = 30.0, .seed = 7}));
}

/// All of it. `between` is what happens outside the tick, `operator()` the tick.
template <RealScalar S>
class WholeTick {
 public:
  WholeTick()
      : servo_(RoundHand<S>(path_), Overlaid(liver_force<S>(), ProxyOverlay<S>(told_)), {.safety = {.protects_a_hand = true, .reservoir = 1e-4}}) {
    for (std::size_t k = 0; k < model_count; ++k) sets_.push_back(corner_planes<S>(k));
    servo_.begin_session(1000.0 / ticks_per_model);
  }
  void between() noexcept {
    if (tick_ % ticks_per_model != 0) return;
    auto const k = tick_ / ticks_per_model;
    PlaneSet<S> const& planes = sets_[k % model_count];
    told_.write({planes, S(400), k + 1});
    models_.write({.phase = k % model_count < 20 ? CuttingPhase::moving : CuttingPhase::indenting,
                   .time = 1e-3 * double(tick_),
                   .home_point = planes[0].offset * planes[0].normal,
                   .normal = planes[0].normal});
  }
  void operator()() noexcept {
    servo_.read(S(1e-3));
    benchmark::DoNotOptimize(written_ = servo_.respond(models_.read(), 1e-3 * double(tick_++)));
  }
  /// Shares of the ticks since the start.
  void look() noexcept {
    auto const& proxy = servo_.force().over().proxy();
    auto const pushing = sets_[(tick_ - 1) / ticks_per_model % model_count].project(servo_.tip()).count;   // nearly the planes that were felt
    contact_ += proxy.touches(), edge_ += pushing == 2, corner_ += pushing == 3, slides_ += proxy.slides();
    felt_ += !written_.force.isZero(0);
  }
  void tell(benchmark::State& state, double ticks) const {
    auto const share = [&](double count) { return std::round(1000 * count / ticks) / 1000; };
    state.counters["contact"] = share(contact_);
    state.counters["edge"] = share(edge_);
    state.counters["corner"] = share(corner_);
    state.counters["sliding"] = share(slides_);
    state.counters["damped"] = share(double(servo_.counts().safety.damped));
    if (felt_ < 0.5 * ticks) state.SkipWithError("the hand felt too little: the chain did not arm");
    if (servo_.counts().safety.not_finite > 0) state.SkipWithError("a force was no number");
  }

 private:
  std::vector<Vector3<S>> path_ = hand_path<S>();
  std::vector<PlaneSet<S>> sets_;
  TripleBuffer<ToldPlanes<S>> told_;
  TripleBuffer<LocalModel<S>> models_{LocalModel<S>{.valid = false}};
  ServoLoop<RoundHand<S>, Overlaid<decltype(liver_force<S>()), ProxyOverlay<S>>, S> servo_;
  Tick written_;
  std::uint64_t tick_ = 0;
  double contact_ = 0, edge_ = 0, corner_ = 0, slides_ = 0, felt_ = 0;
};

/// How often this thread has lost the core.
long switches() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_nivcsw + usage.ru_nvcsw;
}

template <RealScalar S>
void servo_tick(benchmark::State& state) {
  auto const work = std::make_unique<WholeTick<S>>();
  time_ticks(state, *work);
}

template <RealScalar S>
void servo_tick_cold(benchmark::State& state) {
  auto const work = std::make_unique<WholeTick<S>>();
  std::vector<int> other(1 << 20, 1);   // 4 MiB
  std::vector<double> ticks, alone, switched;
  long before = switches();
  for (auto _ : state) {
    work->between();
    int sum = 0;
    for (std::size_t i = 0; i < other.size(); i += 16) sum += other[i];
    benchmark::DoNotOptimize(sum);
    long const now = switches();
    ticks.push_back(one_tick(*work));
    (now == before ? alone : switched).push_back(ticks.back());
    before = now;
    state.SetIterationTime(ticks.back());
    work->look();
  }
  tell_percentiles(state, ticks);
  state.counters["switched"] = double(switched.size()) / double(ticks.size());
  state.counters["p50s"] = percentile(switched, 0.5);
  state.counters["p99a"] = percentile(alone, 0.99);
  work->tell(state, double(ticks.size()));
}

void own_clock(benchmark::State& state) {
  part_alone(state, [](auto const& tip, std::size_t) { benchmark::DoNotOptimize(tip.data()); });
}

void cutting_force_alone(benchmark::State& state) {
  part_alone(state, [force = liver_force<double>(), contact = ToolContact<double>{}](auto const& tip, std::size_t i) mutable {
    contact.phase = i / ticks_per_model % model_count < 20 ? CuttingPhase::moving : CuttingPhase::indenting;
    contact.previous_depth = contact.depth;
    contact.depth = std::max(0.0, 0.002 - tip.z());
    benchmark::DoNotOptimize(force(contact));
  });
}

/// The device, the mapping and the whole chain, with a force of nothing.
void loop_without_force(benchmark::State& state) {
  auto const path = hand_path<double>();
  ServoLoop<RoundHand<double>, NoForce, double> servo(RoundHand<double>(path), NoForce{}, {.safety = {.protects_a_hand = true}});
  servo.begin_session();
  LocalModel<double> const model{.phase = CuttingPhase::indenting};
  double time = 0;
  auto work = [&] {
    servo.read(1e-3);
    benchmark::DoNotOptimize(servo.respond(model, time += 1e-3));
  };
  time_ticks(state, work);
}

/// The chain alone, with a force that has to be shortened now and then.
void safety_chain_alone(benchmark::State& state) {
  auto const path = hand_path<double>();
  SafetyChain<double> chain;
  chain.begin({.protects_a_hand = true}, RoundHand<double>(path).capabilities(), 30.0);
  WorkspaceMapping<double> const mapping{};
  part_alone(state, [&](auto const& tip, std::size_t) {
    chain.read({.position = tip, .buttons = 1});
    benchmark::DoNotOptimize(chain({.force = {0, 0, -300 * std::min(0.0, tip.z())}, .elastic = 1e-3}, mapping));
    while (chain.pop_event()) {}
  });
}

void passivity_alone(benchmark::State& state) {
  part_alone(state, [control = PassivityController<double>()](auto const& tip, std::size_t) mutable {
    Vector3<double> const force = control(tip, {0, 0, -300 * std::min(0.0, tip.z())});
    control.sent(force);
    benchmark::DoNotOptimize(force.data());
  });
}

void plane_projection_alone(benchmark::State& state) {
  part_alone(state, [planes = corner_planes<double>(0)](auto const& tip, std::size_t) { benchmark::DoNotOptimize(planes.project(tip)); });
}

void proxy_alone(benchmark::State& state) {
  SurfaceProxy<double> proxy({.static_friction = 0.4, .dynamic_friction = 0.25});
  part_alone(state, [&, planes = corner_planes<double>(0)](auto const& tip, std::size_t) { benchmark::DoNotOptimize(proxy(planes, tip)); });
}

void plane_handover_alone(benchmark::State& state) {
  std::vector<PlaneSet<double>> sets;
  for (std::size_t k = 0; k < model_count; ++k) sets.push_back(corner_planes<double>(k));
  PlaneHandover<double> handover;
  part_alone(state, [&](auto const& tip, std::size_t i) {
    if (i % ticks_per_model == 0) handover.take(sets[i / ticks_per_model % model_count], 400.0, i + 1, tip);
    benchmark::DoNotOptimize(handover(tip));
  });
}

void patch_handover_alone(benchmark::State& state) {
  PatchHandover<double> handover;
  part_alone(state, [&](auto const& tip, std::size_t i) {
    if (i % ticks_per_model == 0) {
      auto const plane = corner_planes<double>(i / ticks_per_model)[0];
      SurfacePatch<double> patch{.point = plane.offset * plane.normal, .normal = plane.normal, .curvature = 20.0 + double(i % 7), .stiffness = 400.0};
      handover.take(patch, i + 1, tip);
    }
    benchmark::DoNotOptimize(handover(tip).force(tip));
  });
}

template <class Estimator>
void velocity_alone(benchmark::State& state) {
  part_alone(state, [estimator = Estimator{}](auto const& tip, std::size_t) mutable { benchmark::DoNotOptimize(estimator(tip)); });
}

/// With `turns` the orientation is coupled too.
template <bool turns>
void virtual_coupling_alone(benchmark::State& state) {
  VirtualCoupling<double> coupling({.position = {.stiffness = 500.0, .damping = 1.0, .mass = 0.001},
                                    .rotation = {.stiffness = turns ? 1.0 : 0.0, .damping = 0.01, .mass = 1e-5}});
  part_alone(state, [&](auto const& tip, std::size_t i) {
    DeviceState<double> hand;
    hand.position = tip;
    if (turns) hand.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(0.3 * std::sin(1e-3 * double(i)), Vector3<double>::UnitX()));
    ToolLoad<double> load;
    if (double const depth = -coupling.tool().position.z(); depth > 0) {
      load.wrench.force.z() = 2000 * depth;
      load.stiffness(2, 2) = 2000;
    }
    benchmark::DoNotOptimize(coupling(hand, load));
  });
}

BENCHMARK(servo_tick<double>)->Iterations(timed_ticks);
BENCHMARK(servo_tick<float>)->Iterations(timed_ticks);
BENCHMARK(servo_tick_cold<double>)->Iterations(20000)->UseManualTime();
BENCHMARK(own_clock)->Iterations(timed_ticks);
BENCHMARK(loop_without_force)->Iterations(timed_ticks);
BENCHMARK(safety_chain_alone)->Iterations(timed_ticks);
BENCHMARK(passivity_alone)->Iterations(timed_ticks);
BENCHMARK(cutting_force_alone)->Iterations(timed_ticks);
BENCHMARK(plane_projection_alone)->Iterations(timed_ticks);
BENCHMARK(proxy_alone)->Iterations(timed_ticks);
BENCHMARK(plane_handover_alone)->Iterations(timed_ticks);
BENCHMARK(patch_handover_alone)->Iterations(timed_ticks);
BENCHMARK(velocity_alone<BackwardDifference<double>>)->Iterations(timed_ticks);
BENCHMARK(velocity_alone<WindowedVelocity<double>>)->Iterations(timed_ticks);
BENCHMARK(velocity_alone<AdaptiveWindowVelocity<double>>)->Iterations(timed_ticks);
BENCHMARK(virtual_coupling_alone<false>)->Iterations(timed_ticks);
BENCHMARK(virtual_coupling_alone<true>)->Iterations(timed_ticks);

}  // namespace
