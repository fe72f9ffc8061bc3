// SPDX-License-Identifier: MIT
// Vertex rings, the whole tick of the model: the vertex of the surface, as it is now, that is nearest to the tip; a force along its normal that would bring it
// as deep as the tip; the step of 1 ms; the force of the home springs on the hand. The tip is 1 mm in a ball of 10 cm with dents, along a stroke of
// 20 mm/s. All of these run in turn in each round:
//   linear_whole   search through all vertices, home springs of all of them summed
//   tree_whole     search in the tree
//   tree_rings     and the home spring of the touched vertex alone
//   hint_rings     the same, and the search begins at the last tick's triangle
//   far_rings      as tree_rings, but no two tips are near each other: the caches hold nothing of what is asked
//   trail_rings    as hint_rings, and vertices return in 10 ms instead of at once; `away` of them are on their way, which is a length on the surface
//   tool           a probe in contact, as a Simulator has it: the touched point is followed, coupled, stepped
// In us a tick, medians over the rounds of the thread's processor time. `linear/rings` is the median ratio of linear_whole to tree_rings in a round.
//   bench_rings --benchmark_counters_tabular=true
// p_linear, p_tree, p_rings are the published times of the first three, on another machine: ratios and growth can be compared, not times.
#include <palpate/cutting/no_cutter.hpp>
#include <palpate/models.hpp>
#include <palpate/simulator/body_loop.hpp>

#include "dented_ball.hpp"
#include "thread_time.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace {

using namespace palpate;
using Point = Vector3<double>;
using Body = VertexRings<double>;

Point stroke(std::size_t i, double out = -0.001) {
  return benchmarks::on_dented_ball(std::numbers::pi / 2 + 0.4 * std::sin(1.7e-4 * double(i)), 1.9e-4 * double(i), out);
}
Point far(std::size_t i) { return benchmarks::on_dented_ball(std::numbers::pi / 2 + 0.5 * std::sin(2.4 * double(i)), 2.399963 * double(i), -0.001); }

int search_linear(Body const& body, Point const& tip) {
  Eigen::Index best = 0;
  (body.positions().colwise() - tip).colwise().squaredNorm().minCoeff(&best);
  return static_cast<int>(best);
}

/// Of the tip below a vertex at home, along its normal [m].
double depth(Body const& body, int vertex, Point const& tip) { return (body.reference_position(vertex) - tip).dot(body.reference_normal(vertex)); }

/// Sum of all home springs [N]: four vertices at a time, and what is left of them.
Point force_of_all(Body const& body, Matrix3X<double> const& home) {
  using Rows = Eigen::Array<double, 12, 1>;
  auto const x = body.positions();
  Eigen::Index const fours = x.cols() / 4;
  Rows rows = Rows::Zero();
  for (Eigen::Index k = 0; k < fours; ++k) rows += Eigen::Map<Rows const>(home.data() + 12 * k) - Eigen::Map<Rows const>(x.data() + 12 * k);
  Point sum = rows.segment<3>(0) + rows.segment<3>(3) + rows.segment<3>(6) + rows.segment<3>(9);
  for (Eigen::Index v = 4 * fours; v < x.cols(); ++v) sum += home.col(v) - x.col(v);
  return body.home_stiffness() * sum;
}

double median(std::vector<double>& values) {
  auto const middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

void rings(benchmark::State& state) {
  long const vertices = state.range(0);
  auto const mesh = benchmarks::dented_ball(vertices);
  if (mesh.points.cols() != vertices) return state.SkipWithError("a size that is not in the table");
  VertexRingsOptions<double> const at_once{.slopes = {-5e-3, -2.5e-3, -1.25e-3}, .return_time = 0};
  VertexRingsOptions<double> const in_time{.slopes = at_once.slopes, .return_time = 0.01};
  Body body(mesh, at_once), returning(mesh, in_time);
  BodyLoop loop(Body(mesh, in_time), NoCutter<double>(), ContactCoupling{}, 100);
  std::size_t tick = 0;
  int hint = -1;

  auto const render = [&](Body& pressed, int touched, Point const& tip, bool all) {
    pressed.apply_force(touched, -pressed.home_stiffness() * depth(pressed, touched, tip) * pressed.reference_normal(touched));
    pressed.step(1e-3);
    return all ? force_of_all(pressed, mesh.points) : pressed.home_force(touched);
  };
  auto const along = [&](Body& pressed) {
    Point const tip = stroke(tick++);
    int const touched = pressed.nearest_vertex(tip, hint);
    hint = pressed.tissue().surface().triangles_at(touched)[0];
    return render(pressed, touched, tip, false);
  };
  // However the touched vertex is found, it is the same, its spring renders the depth, and all springs together what two rings do.
  int changed = 0;
  for (std::size_t i = 0, last = 0; i < 50; ++i) {
    Point const tip = stroke(997 * i);
    int const touched = body.nearest_vertex(tip), other = search_linear(body, tip);
    changed += static_cast<int>(last) != touched, last = static_cast<std::size_t>(touched);
    Point const felt = render(body, touched, tip, false), all = force_of_all(body, mesh.points);
    Point sum = Point::Zero();
    for (int const v : body.away()) sum += body.home_force(v);
    double const expected = body.home_stiffness() * std::abs(depth(body, touched, tip));
    if (touched != other || !(std::abs(felt.norm() - expected) < 1e-9) || !((sum - all).norm() < 1e-9))
      return state.SkipWithError("the touched vertex is another, or its force is");
  }
  if (changed < 40) return state.SkipWithError("the touched vertex is dragged along");

  struct Way {
    char const* name;
    std::vector<double> us;
  };
  std::array<Way, 7> ways{{{"linear_whole", {}}, {"tree_whole", {}}, {"tree_rings", {}}, {"hint_rings", {}}, {"far_rings", {}}, {"trail_rings", {}},
                           {"tool", {}}}};
  std::vector<double> ratios, away;
  auto const timed = [&](std::size_t which, std::size_t ticks, auto one) {
    for (std::size_t k = 0; k < ticks / 10 + 1; ++k) benchmark::DoNotOptimize(one());
    double const start = benchmarks::thread_time();
    for (std::size_t k = 0; k < ticks; ++k) benchmark::DoNotOptimize(one());
    ways[which].us.push_back(1e6 * (benchmarks::thread_time() - start) / double(ticks));
  };
  std::size_t const few = static_cast<std::size_t>(std::clamp(400000 / vertices, 4L, 200L)), many = 2000;
  for (auto _ : state) {
    timed(0, few, [&] { Point const tip = stroke(tick++); return render(body, search_linear(body, tip), tip, true); });
    timed(1, few, [&] { Point const tip = stroke(tick++); return render(body, body.nearest_vertex(tip), tip, true); });
    timed(2, many, [&] { Point const tip = stroke(tick++); return render(body, body.nearest_vertex(tip), tip, false); });
    timed(3, many, [&] { return along(body); });
    timed(4, many, [&] { Point const tip = far(tick++); return render(body, body.nearest_vertex(tip), tip, false); });
    timed(5, many, [&] { return along(returning); });
    away.push_back(double(returning.away().size()));
    std::size_t const began = tick;   // a probe comes from outside, and stays in
    for (std::size_t k = 0; k < 50; ++k) loop.tick({stroke(began, 0.001 - 4e-5 * double(k))}, 1e-3);
    timed(6, many, [&] { return loop.tick({stroke(tick++)}, 1e-3).tissue_force; });
    if (!(loop.tick({stroke(tick++)}, 1e-3).tissue_force.norm() > 0.01)) return state.SkipWithError("the probe has lost the surface");
    loop.tick({stroke(tick, 0.01)}, 1e-3);
    ratios.push_back(ways[0].us.back() / ways[2].us.back());
  }
  for (Way& way : ways) state.counters[way.name] = median(way.us);
  state.counters["linear/rings"] = median(ratios);
  state.counters["away"] = median(away);
  struct Published {
    long vertices;
    double linear, tree, rings;   // us
  };
  for (auto const& row : {Published{1442, 4.8, 3.8, 0.9}, Published{3970, 13.5, 10.1, 1.4}, Published{5762, 19.5, 12.5, 1.85},
                          Published{8664, 30.1, 21.5, 2.7}})
    if (row.vertices == vertices) state.counters["p_linear"] = row.linear, state.counters["p_tree"] = row.tree, state.counters["p_rings"] = row.rings;
}
BENCHMARK(rings)
    ->ArgName("vertices")
    ->Arg(1442)->Arg(3970)->Arg(5762)->Arg(8664)->Arg(10002)->Arg(100002)->Arg(1000002)
    ->Iterations(15)->Unit(benchmark::kMillisecond);

}  // namespace
