// SPDX-License-Identifier: MIT
// How fast a whole simulation runs: the library's liver of 2000 vertices with the tissue and the force of examples/incision, a scripted
// stroke, lock-step. One command prints all:
//   bench_simulator
// Each row is one simulation: <scalar, region> and what the tool does, `indenting` (drawn over the surface, pressed in to 3/4 of the puncture depth) or
// `cutting` (to 1.15 of it); both 6 cm at 2 cm/s.
// Columns (from Simulator::statistics() but for the last three; a tick is 1 ms of simulated time):
//   servo_p50_us, servo_p99_us  median and 99th percentile of a servo tick: read the device, answer with the force
//   body_p50_us, body_p99_us    the same of a body tick: contact, cut, and the body's steps. A real-time run at 1 kHz needs less than
//                               1000 in the servo; the body needs less than 1e6 / body_rate (2000 at 500 Hz)
//   steps/tick                  body steps in a tick, mean: a tick is split where the stable step asks for it
//   cut_particles               particles that the cut added; 0 while indenting
//   x_realtime                  simulated seconds / wall seconds of the lock-step run, in the ticks in which the tool indents or cuts:
//                               above 1 the simulation is faster than the hand
//   Time                        wall time of the whole row without building the organ
// The way in, 100 of 3100 ticks, is in the percentiles, not wholly in x_realtime. In a zone of influence the median of `cutting` is small:
// between two cuts the tissue comes to rest, and a zone at rest costs nothing. Run it on a quiet machine.
#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/force/cutting_force.hpp>
#include <palpate/force/liver.hpp>
#include <palpate/force/noise.hpp>
#include <palpate/force/organ_force.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/organ.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <benchmark/benchmark.h>

#include <Eigen/LU>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>
#include <vector>

namespace {

using namespace palpate;

constexpr double puncture_depth = 0.0115;   // m, a twentieth of the organ's diagonal, as in examples/incision
constexpr double length = 0.06;             // m, of the stroke

/// The liver in its bed, settled under its pre-tension.
template <RealScalar S, class Region>
auto liver(Region region) {
  auto const mesh = make_organ<S>({.vertices = 2000});
  S const total = S(1060) * volume(mesh), particle = total / S(mesh.points.cols());
  MassSpring<S> tissue(mesh, {.mass = {.total = total},
                              .link = {.stiffness = 62500 * particle, .damping = 6 * particle},
                              .home = {.stiffness = 25000 * particle, .damping = 310 * particle},
                              .link_prestrain = S(0.25)});
  auto const normals = vertex_normals(mesh);
  std::vector<int> underside;
  for (int i = 0; i < mesh.points.cols(); ++i)
    if (normals(2, i) < S(0.2)) underside.push_back(i);
  tissue.nail(underside);
  SoftBody body(std::move(tissue), LeapfrogVerlet{}, region);
  body.reserve(body.size() + 4000, static_cast<int>(mesh.triangles.cols()) + 8000);
  return body;
}

/// z of the upper side over (x, y) [m].
template <RealScalar S>
S top(TriangleMesh<S> const& mesh, S x, S y) {
  S highest = mesh.points.row(2).minCoeff();
  for (int t = 0; t < mesh.triangles.cols(); ++t) {
    Eigen::Matrix<S, 3, 3> corners;
    for (int k = 0; k < 3; ++k) corners.col(k) = mesh.points.col(mesh.triangles(k, t));
    Eigen::Matrix<S, 3, 3> lifted = corners;
    lifted.row(2).setOnes();
    if (!(lifted.determinant() > 0)) continue;   // looks down
    Vector3<S> const weights = lifted.inverse() * Vector3<S>(x, y, 1);
    if (weights.minCoeff() >= 0) highest = std::max(highest, corners.row(2).dot(weights));
  }
  return highest;
}

/// Down in 0.1 s and, below the dome of the settled organ by `depth`, 6 cm along.
template <RealScalar S>
Trajectory<S> stroke(TriangleMesh<S> const& mesh, double depth) {
  constexpr int samples = 60;
  std::vector<Vector3<S>> line;
  for (int i = 0; i <= samples; ++i) {
    S const x = S(length * (double(i) / samples - 0.8)), y = S(0.005);
    line.emplace_back(x, y, top(mesh, x, y) - S(depth));
  }
  auto path = Trajectory<S>::start(line[0] + Vector3<S>(0, 0, S(depth + 0.005)));
  path.line(line[0], 0.1);
  for (int i = 1; i <= samples; ++i) path.line(line[std::size_t(i)], length / 0.02 / samples);
  return path;
}

template <RealScalar S, class Region>
void session(benchmark::State& state, CuttingPhase wanted) {
  using Clock = std::chrono::steady_clock;
  bool const cuts = wanted == CuttingPhase::moving;
  SimulatorStatistics sum;
  double simulated = 0.0, wall = 0.0, ticks = 0.0, steps = 0.0;
  int added = 0;
  for (auto _ : state) {
    state.PauseTiming();
    Region region{};
    if constexpr (requires { region.rings; }) region.rings = 4;
    auto body = liver<S>(region);
    auto const path = stroke<S>(body.mesh(), (cuts ? 1.15 : 0.75) * puncture_depth);
    Simulator simulator(ScriptedDevice<S>(path), std::move(body), ProgressiveCutter<S>({.puncture_depth = S(puncture_depth)}),
                        CuttingForce(scaled(liver_hysteresis<S>(), S(4)),
                                     OrganForce<S>{.coefficient = S(800), .wall_normal = Vector3<S>::UnitX(), .max_damping = S(11)},
                                     CurveJoin<S>{.reversal_depth = S(0.001)}, WhiteGaussianNoise<S>({.snr_db = 30.0, .seed = 7})));
    state.ResumeTiming();
    auto last = Clock::now();
    simulator.run(path.duration(), [&](Tick const& tick) {
      auto const now = Clock::now();
      if (tick.phase == wanted) {
        wall += std::chrono::duration<double>(now - last).count();
        simulated += 1e-3;
      }
      last = now;
    });
    SimulatorStatistics const statistics = simulator.statistics();
    sum.servo.merge(statistics.servo);
    sum.body.merge(statistics.body);
    ticks += double(statistics.body_counts.ticks);
    steps += double(statistics.body_counts.steps);
    added = simulator.cutter().report().particles_added;
    if (statistics.body_counts.diverged > 0) state.SkipWithError("the body diverged");
    if (cuts != (added > 0)) state.SkipWithError(cuts ? "nothing was cut" : "the tissue was punctured");
  }
  auto const us = [](DurationHistogram::Duration d) { return double(d.count()) / 1000.0; };
  state.counters["servo_p50_us"] = us(sum.servo.compute().p50());
  state.counters["servo_p99_us"] = us(sum.servo.compute().p99());
  state.counters["body_p50_us"] = us(sum.body.compute().p50());
  state.counters["body_p99_us"] = us(sum.body.compute().p99());
  state.counters["steps/tick"] = steps / std::max(1.0, ticks);
  state.counters["cut_particles"] = added;
  state.counters["x_realtime"] = wall > 0.0 ? simulated / wall : 0.0;
}

template <RealScalar S, class Region>
void indenting(benchmark::State& state) {
  session<S, Region>(state, CuttingPhase::indenting);
}
template <RealScalar S, class Region>
void cutting(benchmark::State& state) {
  session<S, Region>(state, CuttingPhase::moving);
}

BENCHMARK(indenting<double, WholeBody>)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK(cutting<double, WholeBody>)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK(indenting<double, ZoneOfInfluence>)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK(cutting<double, ZoneOfInfluence>)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK(indenting<float, WholeBody>)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK(cutting<float, WholeBody>)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK(indenting<float, ZoneOfInfluence>)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK(cutting<float, ZoneOfInfluence>)->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
