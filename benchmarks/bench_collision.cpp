// SPDX-License-Identifier: MIT
// Nearest vertex and nearest surface point of a deformed sphere: tree beside a plain search through everything, in one run.
// The first four sizes are those of an octree's published timings (docs: collision), the last shows the growth.
//   bench_collision --benchmark_repetitions=5 --benchmark_report_aggregates_only=true
#include <palpate/collision/surface_tree.hpp>
#include <palpate/core/random.hpp>

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

namespace {

using namespace palpate;

/// A sphere of 1 + 1 + rings × meridians vertices, 10 cm in radius, dented by smooth waves of a centimetre.
template <class Scalar>
struct Scene {
  TriangleMesh<Scalar> rest, mesh;
  SurfaceTree<Scalar> tree;
  Matrix3X<Scalar> scattered;   // queries within 2 cm of the surface, no two near each other
  Matrix3X<Scalar> stroke;      // queries along a line of 1 mm steps just over it, as a tool gives them

  explicit Scene(long vertices) {
    int rings = 30, meridians = 48;
    if (vertices == 3970) rings = 62, meridians = 64;
    if (vertices == 5762) rings = 60, meridians = 96;
    if (vertices == 8664) rings = 71, meridians = 122;
    if (vertices > 8664) rings = 250, meridians = 400;
    double const pi = 3.14159265358979323846;
    auto const on_sphere = [&](double polar, double azimuth) -> Vector3<Scalar> {
      return Eigen::Vector3d(std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth), std::cos(polar))
          .template cast<Scalar>();
    };
    rest.points.resize(3, 2 + rings * meridians);
    rest.points.col(0) << 0, 0, 1;
    rest.points.col(1) << 0, 0, -1;
    auto const at = [&](int r, int m) { return 2 + r * meridians + m % meridians; };
    for (int r = 0; r < rings; ++r)
      for (int m = 0; m < meridians; ++m)
        rest.points.col(at(r, m)) = on_sphere(pi * (r + 1) / (rings + 1), 2 * pi * m / meridians);
    rest.points *= Scalar(0.1);
    rest.triangles.resize(3, 2 * meridians * rings);
    Eigen::Index t = 0;
    for (int m = 0; m < meridians; ++m) {
      rest.triangles.col(t++) << 0, at(0, m), at(0, m + 1);
      rest.triangles.col(t++) << 1, at(rings - 1, m + 1), at(rings - 1, m);
      for (int r = 0; r + 1 < rings; ++r) {
        rest.triangles.col(t++) << at(r, m), at(r + 1, m), at(r + 1, m + 1);
        rest.triangles.col(t++) << at(r, m), at(r + 1, m + 1), at(r, m + 1);
      }
    }
    tree = SurfaceTree<Scalar>(rest);
    mesh = rest;
    for (Eigen::Index i = 0; i < mesh.points.cols(); ++i)
      mesh.points.col(i) *= 1 + Scalar(0.1) * std::sin(70 * mesh.points(0, i)) * std::cos(50 * mesh.points(1, i) + 1);
    tree.refit(mesh.points);

    Random random(Seed{1});
    scattered.resize(3, 4096);
    stroke.resize(3, 4096);
    for (Eigen::Index i = 0; i < scattered.cols(); ++i) {
      double const z = 2 * random.uniform<double>() - 1, azimuth = 2 * pi * random.uniform<double>();
      scattered.col(i) = Scalar(0.1 + 0.04 * random.uniform<double>() - 0.02) * on_sphere(std::acos(z), azimuth);
      stroke.col(i) = Scalar(0.105) * on_sphere(0.3 + 2.5e-4 * double(i), 0.01 * double(i));
    }
  }

  Vector3<Scalar> query(std::size_t i) const { return scattered.col(static_cast<Eigen::Index>(i % 4096)); }
};

template <class Scalar>
Scene<Scalar>& scene(benchmark::State const& state) {   // made once for each size
  static std::vector<std::pair<long, Scene<Scalar>>> made;
  long const vertices = state.range(0);
  for (auto& [size, known] : made)
    if (size == vertices) return known;
  made.reserve(8);
  return made.emplace_back(vertices, Scene<Scalar>(vertices)).second;
}

template <class Scalar>
void build(benchmark::State& state) {
  auto const& s = scene<Scalar>(state);
  for (auto _ : state) benchmark::DoNotOptimize(SurfaceTree<Scalar>(s.rest).size());
}

template <class Scalar>
void refit(benchmark::State& state) {
  auto& s = scene<Scalar>(state);
  for (auto _ : state) {
    s.tree.refit(s.mesh.points);
    benchmark::ClobberMemory();
  }
}

/// Two rings around a touched vertex: what a zone of influence moves. The vertex goes to and fro, so that boxes do change.
template <class Scalar>
void refit_two_rings(benchmark::State& state) {
  auto& s = scene<Scalar>(state);
  int const touched = static_cast<int>(s.mesh.points.cols() / 2);
  Scalar const radius = (s.rest.points.col(touched) - s.rest.points.col(touched + 1)).norm() * Scalar(2.5);
  std::vector<int> moved, particles;
  for (int t = 0; t < s.tree.size(); ++t)
    if ((s.rest.points.col(s.rest.triangles(0, t)) - s.rest.points.col(touched)).norm() < radius) moved.push_back(t);
  for (int const t : moved)
    for (int k = 0; k < 3; ++k) particles.push_back(s.rest.triangles(k, t));
  auto points = s.mesh.points;
  Scalar push = Scalar(1e-3);
  for (auto _ : state) {
    for (int const i : particles) points(2, i) += push;
    push = -push;
    s.tree.refit(points, moved);
    benchmark::ClobberMemory();
  }
  s.tree.refit(s.mesh.points);
  state.counters["triangles"] = double(moved.size());
}

/// What a cutter does in a tick: triangles are divided and added beside others, here and there, and taken away again.
template <class Scalar>
void edits(benchmark::State& state) {
  auto const& s = scene<Scalar>(state);
  auto tree = s.tree;
  int const size = tree.size(), divided = 64;
  tree.reserve(size + 3 * divided);
  for (auto _ : state) {
    for (int i = 0; i < divided; ++i) {
      int const t = static_cast<int>((i * 7919L) % size);
      auto const [a, b, c] = tree.corners(t);
      tree.add(s.mesh.points, {b, c, a}, t);
      tree.add(s.mesh.points, {c, a, b}, t);
      tree.replace(s.mesh.points, t, {a, b, c});
      tree.add(s.mesh.points, {a, c, b}, size + 2 * i);
    }
    while (tree.size() > size) tree.remove(s.mesh.points, tree.size() - 1);
  }
  state.SetItemsProcessed(state.iterations() * divided * 7);
}

template <class Scalar>
void nearest_point(benchmark::State& state) {
  auto const& s = scene<Scalar>(state);
  std::size_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(s.tree.nearest(s.mesh.points, s.query(i++)));
}

template <class Scalar>
void nearest_point_along_stroke(benchmark::State& state) {
  auto const& s = scene<Scalar>(state);
  std::size_t i = 0;
  int hint = -1;
  for (auto _ : state) {
    auto const found = s.tree.nearest(s.mesh.points, s.stroke.col(static_cast<Eigen::Index>(i++ % 4096)), hint);
    benchmark::DoNotOptimize(hint = found.triangle);
  }
}

template <class Scalar>
void nearest_point_linear(benchmark::State& state) {
  auto const& s = scene<Scalar>(state);
  std::size_t i = 0;
  for (auto _ : state) {
    Vector3<Scalar> const query = s.query(i++);
    Scalar best = std::numeric_limits<Scalar>::infinity();
    for (Eigen::Index t = 0; t < s.mesh.triangles.cols(); ++t) {
      auto const corner = s.mesh.triangles.col(t);
      best = std::min(best, closest_point_on_triangle<Scalar>(query, s.mesh.points.col(corner[0]), s.mesh.points.col(corner[1]),
                                                              s.mesh.points.col(corner[2]))
                                .squared_distance);
    }
    benchmark::DoNotOptimize(best);
  }
}

template <class Scalar>
void nearest_vertex(benchmark::State& state) {
  auto const& s = scene<Scalar>(state);
  std::size_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(s.tree.nearest_vertex(s.mesh.points, s.query(i++)));
}

template <class Scalar>
void nearest_vertex_linear(benchmark::State& state) {
  auto const& s = scene<Scalar>(state);
  std::size_t i = 0;
  for (auto _ : state) {
    Eigen::Index best = 0;
    (s.mesh.points.colwise() - s.query(i++)).colwise().squaredNorm().minCoeff(&best);
    benchmark::DoNotOptimize(best);
  }
}

void sizes(benchmark::internal::Benchmark* registered) {
  for (long const vertices : {1442, 3970, 5762, 8664, 100002}) registered->Arg(vertices);
}

BENCHMARK(nearest_vertex<double>)->Apply(sizes);
BENCHMARK(nearest_vertex_linear<double>)->Apply(sizes);
BENCHMARK(nearest_point<double>)->Apply(sizes);
BENCHMARK(nearest_point_along_stroke<double>)->Apply(sizes);
BENCHMARK(nearest_point_linear<double>)->Apply(sizes);
BENCHMARK(refit<double>)->Apply(sizes);
BENCHMARK(refit_two_rings<double>)->Apply(sizes);
BENCHMARK(edits<double>)->Apply(sizes);
BENCHMARK(build<double>)->Apply(sizes);
BENCHMARK(nearest_vertex<float>)->Apply(sizes);
BENCHMARK(nearest_point<float>)->Apply(sizes);
BENCHMARK(nearest_point_along_stroke<float>)->Apply(sizes);
BENCHMARK(refit<float>)->Apply(sizes);

}  // namespace
