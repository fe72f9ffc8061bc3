// SPDX-License-Identifier: MIT
// Filling surfaces with tetrahedra, and the winding number that says what is inside, beside the plain sum over all triangles.
//   bench_fill --benchmark_repetitions=3 --benchmark_report_aggregates_only=true
#include <palpate/core/random.hpp>
#include <palpate/mesh/organ.hpp>
#include <palpate/volume/fill.hpp>
#include <palpate/volume/winding_number.hpp>

#include <benchmark/benchmark.h>

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

namespace {

using namespace palpate;

TriangleMesh<double> const& organ(int vertices) {
  static std::vector<std::pair<int, TriangleMesh<double>>> made;
  for (auto const& [count, mesh] : made)
    if (count == vertices) return mesh;
  return made.emplace_back(vertices, make_organ<double>({.vertices = vertices})).second;
}

/// Arguments: vertices of the skin, edge in tenths of a millimetre.
void fill_organ(benchmark::State& state) {
  auto const& skin = organ(static_cast<int>(state.range(0)));
  double tetrahedra = 0;
  for (auto _ : state) {
    auto const filled = fill(skin, {.edge = 1e-4 * static_cast<double>(state.range(1))});
    tetrahedra = static_cast<double>(filled.mesh.tetrahedra.cols());
    benchmark::DoNotOptimize(filled.volume);
  }
  state.counters["tetrahedra"] = tetrahedra;
}
BENCHMARK(fill_organ)->Args({2000, 80})->Args({2000, 50})->Args({50000, 80})->Unit(benchmark::kMillisecond);

double plain(TriangleMesh<double> const& mesh, Vector3<double> const& q) {
  double sum = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    Vector3<double> const a = mesh.points.col(mesh.triangles(0, t)) - q, b = mesh.points.col(mesh.triangles(1, t)) - q, c = mesh.points.col(mesh.triangles(2, t)) - q;
    double const x = a.norm(), y = b.norm(), z = c.norm();
    sum += 2 * std::atan2(a.dot(b.cross(c)), x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y);
  }
  return sum / (4 * std::numbers::pi);
}

template <class Ask>
void ask_around(benchmark::State& state, Ask const& ask) {
  Random random(Seed{3});
  for (auto _ : state) {
    Vector3<double> const q(0.2 * random.uniform<double>() - 0.1, 0.2 * random.uniform<double>() - 0.1, 0.2 * random.uniform<double>() - 0.1);
    benchmark::DoNotOptimize(ask(q));
  }
}
void winding_tree(benchmark::State& state) {
  WindingNumber const winding(organ(static_cast<int>(state.range(0))));
  ask_around(state, winding);
}
void winding_plain(benchmark::State& state) {
  auto const& mesh = organ(static_cast<int>(state.range(0)));
  ask_around(state, [&](Vector3<double> const& q) { return plain(mesh, q); });
}
BENCHMARK(winding_tree)->Arg(2000)->Arg(50000)->Unit(benchmark::kMicrosecond);
BENCHMARK(winding_plain)->Arg(2000)->Arg(50000)->Unit(benchmark::kMicrosecond);

}  // namespace
