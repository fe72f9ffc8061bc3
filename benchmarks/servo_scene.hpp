// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/haptics/plane_set.hpp>

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

// A hand, the planes that it moves among, and the timing of ticks one by one: what the benchmarks of a servo tick share.
namespace benchmarks {

inline constexpr int timed_ticks = 200000;      // one by one
inline constexpr int ticks_per_model = 33;      // a body of 30 Hz
inline constexpr std::size_t path_ticks = 8192, model_count = 64;

/// A hand that goes round in the corner of three planes, in and out, up to 13 mm/s; it ends where it began.
template <palpate::RealScalar S>
std::vector<palpate::Vector3<S>> hand_path() {
  std::vector<palpate::Vector3<S>> path(path_ticks);
  for (std::size_t i = 0; i < path_ticks; ++i) {
    double const round = 2 * std::numbers::pi * double(i) / double(path_ticks), quantum = 5.5e-5;
    palpate::Vector3<double> const exact(0.0025 * std::sin(3 * round) + 0.001, 0.0025 * std::sin(4 * round + 1) + 0.001,
                                         0.002 * std::sin(5 * round + 0.5) + 0.0005);
    path[i] = (quantum * (exact / quantum).array().round()).matrix().template cast<S>();
  }
  return path;
}

/// What the body tells the servo.
template <palpate::RealScalar S>
struct ToldPlanes {
  palpate::PlaneSet<S> planes;
  S stiffness = S(400);   // N/m
  std::uint64_t sequence = 0;
};

/// A floor and two walls that rise from it: the k-th set of a tissue that trembles.
template <palpate::RealScalar S>
palpate::PlaneSet<S> corner_planes(std::size_t k) {
  double const phase = 2 * std::numbers::pi * double(k % model_count) / double(model_count);
  palpate::PlaneSet<S> planes;
  using Normal = palpate::Vector3<double>;
  for (Normal const& normal : {Normal(0, 0, 1), Normal(0.8, 0, 0.6), Normal(0, 0.8, 0.6)}) {
    Normal const tilted = (normal + 0.05 * Normal(std::sin(3 * phase), std::cos(2 * phase), 0)).normalized();
    planes.add({tilted.cast<S>(), S(2e-4 * std::sin(5 * phase))});
  }
  return planes;
}

/// The hand, as a device that moves one.
template <palpate::RealScalar S>
class RoundHand {
 public:
  explicit RoundHand(std::vector<palpate::Vector3<S>> const& path) : path_(&path) {}
  palpate::Capabilities capabilities() const noexcept {
    return {.max_force = palpate::datasheet(3.3),
            .rate = 1000.0,
            .buttons = 2,
            .continuous_force = palpate::datasheet(0.88),
            .mass = palpate::datasheet(0.045),
            .resolution = palpate::datasheet(5.5e-5)};
  }
  palpate::DeviceStatus read(palpate::DeviceState<S>& state) noexcept {
    state.position = (*path_)[next_];
    state.buttons = 1;
    next_ = next_ + 1 == path_->size() ? 0 : next_ + 1;
    return palpate::DeviceStatus::ok;
  }
  palpate::DeviceStatus write(palpate::Wrench<S> const& wrench) noexcept {
    benchmark::DoNotOptimize(wrench.force.data());
    return palpate::DeviceStatus::ok;
  }

 private:
  std::vector<palpate::Vector3<S>> const* path_;
  std::size_t next_ = 0;
};

/// µs, of ticks [s]; 0 where there are none.
inline double percentile(std::vector<double>& ticks, double part) {
  if (ticks.empty()) return 0.0;
  auto const place = static_cast<std::ptrdiff_t>(part * static_cast<double>(ticks.size() - 1));
  std::nth_element(ticks.begin(), ticks.begin() + place, ticks.end());
  return std::round(1e9 * ticks[static_cast<std::size_t>(place)]) / 1e3;
}
inline void tell_percentiles(benchmark::State& state, std::vector<double>& ticks) {
  state.counters["p50"] = percentile(ticks, 0.5);
  state.counters["p99"] = percentile(ticks, 0.99);
  state.counters["p99.9"] = percentile(ticks, 0.999);
  state.counters["p99/5us"] = std::round(percentile(ticks, 0.99) / 5 * 1e4) / 1e4;
}

template <class Work>
double one_tick(Work& work) {
  auto const start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// One by one first, then as a batch.
template <class Work>
void time_ticks(benchmark::State& state, Work& work) {
  std::vector<double> ticks;
  ticks.reserve(timed_ticks);
  for (int i = 0; i < timed_ticks; ++i) {
    if constexpr (requires { work.between(); }) work.between();
    ticks.push_back(one_tick(work));
    if constexpr (requires { work.look(); }) work.look();
  }
  tell_percentiles(state, ticks);
  if constexpr (requires { work.tell(state, 1.0); }) work.tell(state, timed_ticks);
  for (auto _ : state) {
    if constexpr (requires { work.between(); }) work.between();
    work();
  }
}

/// A part alone, along the same way of the hand: called with the tip and the number of the tick.
template <class Part>
void part_alone(benchmark::State& state, Part part) {
  auto const path = hand_path<double>();
  std::size_t i = 0;
  auto work = [&] {
    part(path[i % path_ticks], i);
    ++i;
  };
  time_ticks(state, work);
}

}  // namespace benchmarks
