// SPDX-License-Identifier: MIT
// What a step of a heart-sized body costs (961 particles, whole body or zone, leapfrog), beside a plain Eigen loop over the same springs.
//   bench_body --benchmark_repetitions=21 --benchmark_report_aggregates_only=true
// prints medians; "steps/s" is the rate. `ratio` runs both in turn and reports the median of plain time / library time: above 1
// the library is faster.
#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/runge_kutta_4.hpp>
#include <palpate/mesh/edges.hpp>
#include <palpate/mesh/heart.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <vector>

namespace {

using namespace palpate;

constexpr double total = 0.3, link = 100.0, link_damping = 0.02, home = 10.0, home_damping = 0.05, step = 1e-4;

template <RealScalar S>
MassSpring<S> heart() {
  return {make_heart<S>(), {.mass = {.total = S(total), .lumping = Lumping::equal},
                            .link = {.stiffness = S(link), .damping = S(link_damping)},
                            .home = {.stiffness = S(home), .damping = S(home_damping)}}};
}

/// The peer: the same springs and the same leapfrog as one would write them first, edge by edge into a 3 × n matrix of forces.
template <RealScalar S>
class PlainBody {
 public:
  explicit PlainBody(TriangleMesh<S> const& mesh)
      : rest_(mesh.points), x_(mesh.points), v_(Matrix3X<S>::Zero(3, x_.cols())), a_(v_), last_a_(v_), force_(v_), applied_(v_) {
    for (auto const& [a, b] : edges(mesh)) edges_.push_back({a, b, (x_.col(a) - x_.col(b)).norm(), S(link), S(link_damping)});
  }

  void push(int i, Vector3<S> const& force) { applied_.col(i) = force; }

  void advance(S h) {
    x_ += h / 2 * v_;
    a_ = v_ + h / 2 * last_a_;
    accelerate(x_, a_);
    v_ += h * last_a_;
    x_ += h / 2 * v_;
  }

  Matrix3X<S> const& positions() const { return x_; }

 private:
  struct Edge {
    int a, b;
    S rest_length, stiffness, damping;
  };

  void accelerate(Matrix3X<S> const& x, Matrix3X<S> const& v) {
    force_ = applied_ - S(home) * (x - rest_) - S(home_damping) * v;
    for (Edge const& e : edges_) {
      Vector3<S> const d = x.col(e.a) - x.col(e.b);
      S const length = d.norm();
      Vector3<S> const n = d / length;
      Vector3<S> const pull = (e.stiffness * (length - e.rest_length) + e.damping * n.dot(v.col(e.a) - v.col(e.b))) * n;
      force_.col(e.a) -= pull;
      force_.col(e.b) += pull;
    }
    last_a_ = force_ * (S(x_.cols()) / S(total));
  }

  Matrix3X<S> rest_, x_, v_, a_, last_a_, force_, applied_;
  std::vector<Edge> edges_;
};

Vector3<double> const push(0.0, 0.2, -0.3);

template <RealScalar S>
void plain(benchmark::State& state) {
  PlainBody<S> body(make_heart<S>());
  body.push(100, push.cast<S>());
  for (auto _ : state) {
    body.advance(S(step));
    benchmark::DoNotOptimize(body.positions().data());
  }
  state.counters["steps/s"] = benchmark::Counter(1, benchmark::Counter::kIsIterationInvariantRate);
}

template <RealScalar S, class I, class R>
void soft_body(benchmark::State& state) {
  SoftBody body(heart<S>(), I{}, R{});
  int moving = 0;
  for (auto _ : state) {
    body.apply_force(100, push.cast<S>());
    moving = body.step(S(step)).moving;
  }
  state.counters["moving"] = moving;
  state.counters["steps/s"] = benchmark::Counter(1, benchmark::Counter::kIsIterationInvariantRate);
}

/// The touch wanders from particle to particle every 20 steps, so that the zone is chosen anew and what it leaves relaxes.
template <RealScalar S>
void wandering_zone(benchmark::State& state) {
  SoftBody body(heart<S>(), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 2});
  int k = 0, touched = 100;
  double moving = 0;
  for (auto _ : state) {
    if (++k % 20 == 0) {
      int next = touched;
      body.tissue().for_each_neighbour(touched, [&](int neighbour) { next = std::max(next, neighbour); });
      touched = next == touched ? 100 : next;
    }
    body.apply_force(touched, push.cast<S>());
    moving += body.step(S(step)).moving;
  }
  state.counters["moving"] = moving / std::max(1, k);
  state.counters["steps/s"] = benchmark::Counter(1, benchmark::Counter::kIsIterationInvariantRate);
}

/// Both in turn, 100 steps each, so that the machine treats them alike.
template <RealScalar S>
void ratio(benchmark::State& state) {
  using Clock = std::chrono::steady_clock;
  PlainBody<S> peer(make_heart<S>());
  SoftBody body(heart<S>(), LeapfrogVerlet{}, WholeBody{});
  peer.push(100, push.cast<S>());
  std::vector<double> ratios;
  for (auto _ : state) {
    auto const start = Clock::now();
    for (int k = 0; k < 100; ++k) peer.advance(S(step));
    auto const middle = Clock::now();
    for (int k = 0; k < 100; ++k) {
      body.apply_force(100, push.cast<S>());
      body.step(S(step));
    }
    auto const end = Clock::now();
    ratios.push_back(std::chrono::duration<double>(middle - start) / std::chrono::duration<double>(end - middle));
  }
  std::nth_element(ratios.begin(), ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2), ratios.end());
  state.counters["plain/library"] = ratios[ratios.size() / 2];
  if ((peer.positions() - body.positions()).cwiseAbs().maxCoeff() > S(1e-4)) state.SkipWithError("the two bodies do not move alike");
}

BENCHMARK(plain<double>);
BENCHMARK(soft_body<double, LeapfrogVerlet, WholeBody>);
BENCHMARK(ratio<double>);
BENCHMARK(plain<float>);
BENCHMARK(soft_body<float, LeapfrogVerlet, WholeBody>);
BENCHMARK(ratio<float>);
BENCHMARK(soft_body<double, RungeKutta4, WholeBody>);
BENCHMARK(soft_body<double, LeapfrogVerlet, ZoneOfInfluence>);
BENCHMARK(soft_body<float, LeapfrogVerlet, ZoneOfInfluence>);
BENCHMARK(wandering_zone<double>);

}  // namespace
