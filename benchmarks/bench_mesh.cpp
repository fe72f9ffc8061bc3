// SPDX-License-Identifier: MIT
// What a tetrahedral topology costs on blocks of n³ points.
//   build       all neighbours and the border from the corners; `surface`, which finds the border alone by sorting, beside it.
//   edits       an edge, a face, a tetrahedron divided, a vertex split, and all four taken back, at 4,096 random places in turn.
#include <palpate/core/random.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/tetrahedral_topology.hpp>

#include <benchmark/benchmark.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace {

using namespace palpate;

void build(benchmark::State& state) {
  int const n = static_cast<int>(state.range(0));
  auto const mesh = make_block<double>(n, n, n, 0.001, BlockPattern::alternating);
  for (auto _ : state) {
    TetrahedralTopology const topology(mesh);
    benchmark::DoNotOptimize(topology.tetrahedron_count());
  }
  state.counters["tetrahedra"] = static_cast<double>(mesh.tetrahedra.cols());
}

void surface_alone(benchmark::State& state) {
  int const n = static_cast<int>(state.range(0));
  auto const mesh = make_block<double>(n, n, n, 0.001, BlockPattern::alternating);
  for (auto _ : state) benchmark::DoNotOptimize(surface(mesh).triangles.cols());
  state.counters["tetrahedra"] = static_cast<double>(mesh.tetrahedra.cols());
}

void edits(benchmark::State& state) {
  int const n = static_cast<int>(state.range(0));
  TetrahedralTopology topology(make_block<double>(n, n, n, 0.001, BlockPattern::alternating));
  topology.reserve(topology.vertex_count() + 10, topology.tetrahedron_count() + 100, topology.border().triangle_count() + 100);
  Random random;
  std::vector<int> places(4096);
  for (int& t : places)
    do t = static_cast<int>(random.below(static_cast<std::uint64_t>(topology.tetrahedron_count())));
    while (topology.tetrahedra_at(topology.corners(t)[2]).size() < 2);   // a corner of the block can not be split
  std::size_t k = 0;
  for (auto _ : state) {
    int const t = places[k++ % places.size()];
    auto const c = topology.corners(t);
    auto const split = topology.split_vertex(c[2], topology.tetrahedra_at(c[2]).first(topology.tetrahedra_at(c[2]).size() / 2));
    auto const edge = topology.insert_on_edge(c[0], c[1]);
    auto const face = topology.insert_on_face(c[0], edge.vertex, c[3]);
    auto const inside = topology.insert_in_tetrahedron(t);
    for (auto const& edit : {inside, face, edge, split}) topology.undo(edit);
  }
  state.counters["tetrahedra"] = static_cast<double>(topology.tetrahedron_count());
}

}  // namespace

BENCHMARK(build)->Arg(11)->Arg(31)->Arg(61)->Unit(benchmark::kMillisecond);
BENCHMARK(surface_alone)->Arg(11)->Arg(31)->Arg(61)->Unit(benchmark::kMillisecond);
BENCHMARK(edits)->Arg(11)->Arg(31)->Arg(61);
