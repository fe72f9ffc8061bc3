// SPDX-License-Identifier: MIT
// Rendering a touched vertex of a surface: what a servo tick costs as the mesh grows. A ball of 10 cm with dents is pressed in by 1 mm along a
// stroke of 20 mm/s; the touched vertex follows the tip, its first ring half of the way, its second a quarter, and the force is the sum of home
// springs over the vertices that are rendered. In each round all of these run in turn, so that the machine treats them alike:
//   linear_whole   search through all vertices, sum over all of them
//   tree_whole     search in the tree
//   tree_rings     and sum over the touched vertex and two rings
//   stroke_rings   the same, and the search begins at the last tick's triangle
//   moved_rings    the search is in the surface as it is pressed in, so the tree is refitted to what moved before
//   far_rings      as tree_rings, but no two tips are near each other: the caches hold nothing of what is asked
//   patch          search for the nearest point from the last triangle on, a ball fitted to one ring around it, its force
//   planes         the same search, up to three planes of the facets there, a proxy with friction
//   p50, p99       of stroke_rings, tick by tick by the clock, nothing taken off
// All in µs a tick; but for p50 and p99 medians over the rounds of the thread's processor time, which other programs disturb less: what they take of
// the caches does count. `linear/rings` is the median ratio of linear_whole to tree_rings in a round; `growth` is stroke_rings over that of the first
// size. Time is that of a round.
//   bench_rendering --benchmark_counters_tabular=true
// The first four sizes are those of published timings (linear search and whole model 4.8 to 30.1 µs, octree and whole model 3.8 to 21.5, octree and
// two rings 0.90 to 2.70), so ratios and growth can be compared, not times.
#include <palpate/collision/surface_tree.hpp>
#include <palpate/haptics/facet_planes.hpp>
#include <palpate/haptics/surface_fit.hpp>
#include <palpate/haptics/surface_proxy.hpp>
#include <palpate/mesh/surface_topology.hpp>
#include <palpate/region/concept.hpp>
#include <palpate/region/zone_of_influence.hpp>

#include "dented_ball.hpp"
#include "thread_time.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <vector>

namespace {

using namespace palpate;

constexpr double home_stiffness = 200.0;   // N/m, of each vertex

/// A surface that a tool presses in, vertex by vertex; as much of a body as what looks at a surface needs.
class PressedBall {
 public:
  using Scalar = double;
  using Point = Vector3<double>;
  struct Matter {
    SurfaceTopology triangles;
    SurfaceTopology const& surface() const noexcept { return triangles; }
  };

  explicit PressedBall(long vertices)
      : rest_(benchmarks::dented_ball(vertices)), matter_{{static_cast<int>(rest_.points.cols()), rest_.triangles}}, tree_(rest_), x_(rest_.points),
        v_(Matrix3X<double>::Zero(3, x_.cols())) {
    zone_.reserve(static_cast<int>(rest_.points.cols()));
    moved_.reserve(static_cast<int>(rest_.triangles.cols()));
  }

  Matrix3X<double> const& positions() const noexcept { return x_; }
  Matrix3X<double> const& velocities() const noexcept { return v_; }   // it does not move between two presses
  Matter const& tissue() const noexcept { return matter_; }
  Matrix3X<double> const& home() const noexcept { return rest_.points; }

  /// A tip 1 mm in the tissue: the i-th tick of the stroke, or one of many that are all over the ball's middle.
  static Point stroke(std::size_t i) { return pressed(std::numbers::pi / 2 + 0.4 * std::sin(1.7e-4 * double(i)), 1.9e-4 * double(i)); }
  static Point far(std::size_t i) { return pressed(std::numbers::pi / 2 + 0.5 * std::sin(2.4 * double(i)), 2.399963 * double(i)); }

  int search_linear(Point const& tip) const {
    Eigen::Index best = 0;
    (rest_.points.colwise() - tip).colwise().squaredNorm().minCoeff(&best);
    return static_cast<int>(best);
  }
  int search(Point const& tip, int hint = -1) const noexcept { return tree_.nearest_vertex(rest_.points, tip, hint); }
  int search_pressed(Point const& tip, int hint) const noexcept { return tree_.nearest_vertex(x_, tip, hint); }
  SurfacePoint<double> search_point(Point const& tip, int hint) const noexcept { return tree_.nearest(rest_.points, tip, hint); }
  int triangle_at(int vertex) const noexcept { return matter_.triangles.triangles_at(vertex)[0]; }

  /// Lets go of what was pressed, and presses the touched vertex and two rings.
  void press(int touched, Point const& tip) {
    for (int const v : zone_.particles()) x_.col(v) = rest_.points.col(v);
    zone_.clear();
    ZoneOfInfluence{.rings = 2}.select(*this, std::span(&touched, 1), zone_);
    Point const way = tip - rest_.points.col(touched);
    auto const near = zone_.particles();
    for (std::size_t k = 0; k < near.size(); ++k) x_.col(near[k]) += (k == 0 ? 1.0 : k <= 6 ? 0.5 : 0.25) * way;
  }
  template <class Visit>
  void for_each_neighbour(int vertex, Visit const& visit) const {
    for (int const t : matter_.triangles.triangles_at(vertex))
      for (int const v : matter_.triangles.corners(t)) visit(v);
  }

  /// Force on the tool [N].
  Point force_of_zone() const noexcept {
    Point sum = Point::Zero();
    for (int const v : zone_.particles()) sum += rest_.points.col(v) - x_.col(v);
    return home_stiffness * sum;
  }
  Point force_of_all() const noexcept {   // four vertices at a time, and what is left of them
    using Rows = Eigen::Array<double, 12, 1>;
    Eigen::Index const fours = x_.cols() / 4;
    Rows rows = Rows::Zero();
    for (Eigen::Index k = 0; k < fours; ++k)
      rows += Eigen::Map<Rows const>(rest_.points.data() + 12 * k) - Eigen::Map<Rows const>(x_.data() + 12 * k);
    Point sum = rows.segment<3>(0) + rows.segment<3>(3) + rows.segment<3>(6) + rows.segment<3>(9);
    for (Eigen::Index v = 4 * fours; v < x_.cols(); ++v) sum += rest_.points.col(v) - x_.col(v);
    return home_stiffness * sum;
  }

  /// Fits the tree to what is pressed now and to what was.
  void refit_moved() {
    for (int const v : zone_.particles())
      for (int const t : matter_.triangles.triangles_at(v)) moved_.add(t);
    tree_.refit(x_, moved_.particles());
    moved_.clear();
    for (int const v : zone_.particles())
      for (int const t : matter_.triangles.triangles_at(v)) moved_.add(t);
  }
  void refit_home() {
    tree_.refit(rest_.points);
    moved_.clear();
  }
  int rendered() const noexcept { return zone_.size(); }

 private:
  static Point pressed(double polar, double azimuth) { return benchmarks::on_dented_ball(polar, azimuth, -0.001); }

  TriangleMesh<double> rest_;
  Matter matter_;
  SurfaceTree<double> tree_;
  Matrix3X<double> x_;   // m, as pressed
  Matrix3X<double> v_;   // m/s
  Selection zone_, moved_;
};

double part_of(std::vector<double>& values, double part) {
  auto const at = static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

void rendering(benchmark::State& state) {
  long const vertices = state.range(0);
  PressedBall ball(vertices);
  if (ball.home().cols() != vertices) return state.SkipWithError("a size that is not in the table");
  std::size_t const few = static_cast<std::size_t>(std::clamp(400000 / vertices, 4L, 200L)), many = 2000;
  std::size_t tick = 0;
  int hint = -1;
  SurfaceFit<double> fit({.rings = 1, .stiffness = 400.0});
  SurfaceProxy<double> proxy({.stiffness = 400.0, .static_friction = 0.4, .dynamic_friction = 0.25});

  auto const render = [&](int touched, Vector3<double> const& tip, bool all) {
    ball.press(touched, tip);
    return all ? ball.force_of_all() : ball.force_of_zone();
  };
  auto const along = [&](bool refits) {
    Vector3<double> const tip = ball.stroke(tick++);
    if (refits) ball.refit_moved();
    int const touched = refits ? ball.search_pressed(tip, hint) : ball.search(tip, hint);
    hint = ball.triangle_at(touched);
    return render(touched, tip, false);
  };
  auto const on_surface = [&](auto force) {
    Vector3<double> const tip = ball.stroke(tick++);
    auto const found = ball.search_point(tip, hint);
    hint = found.triangle;
    return Vector3<double>(force(found, tip));
  };

  // Two rings render what the whole model does, whichever way the touched vertex was found.
  for (std::size_t i = 0; i < 50; ++i) {
    Vector3<double> const tip = ball.stroke(997 * i);
    int const touched = ball.search(tip);
    Vector3<double> const rings = render(touched, tip, false), whole = ball.force_of_all();
    double const way = (tip - ball.home().col(touched)).norm(), way_linear = (tip - ball.home().col(ball.search_linear(tip))).norm();
    if (ball.rendered() != 19) return state.SkipWithError("a touched vertex and two rings are not 19 vertices");
    if (!((rings - whole).norm() < 1e-9 * rings.norm()) || !(std::abs(way - way_linear) < 1e-12))
      return state.SkipWithError("the two do not render alike");
  }

  struct Way { char const* name; std::vector<double> us; };
  std::vector<Way> ways;
  for (char const* name : {"linear_whole", "tree_whole", "tree_rings", "stroke_rings", "moved_rings", "far_rings", "patch", "planes"})
    ways.push_back({name, {}});
  std::vector<double> ratios, single;
  auto const timed = [&](std::size_t which, std::size_t ticks, auto one) {
    for (std::size_t k = 0; k < ticks / 10 + 1; ++k) benchmark::DoNotOptimize(one());   // what the way before left in the caches is gone
    double const start = benchmarks::thread_time();
    for (std::size_t k = 0; k < ticks; ++k) benchmark::DoNotOptimize(one());
    ways[which].us.push_back(1e6 * (benchmarks::thread_time() - start) / double(ticks));
  };
  for (auto _ : state) {
    timed(0, few, [&] { auto const tip = ball.stroke(tick++); return render(ball.search_linear(tip), tip, true); });
    timed(1, few, [&] { auto const tip = ball.stroke(tick++); return render(ball.search(tip), tip, true); });
    timed(2, many, [&] { auto const tip = ball.stroke(tick++); return render(ball.search(tip), tip, false); });
    timed(3, many, [&] { return along(false); });
    timed(4, many, [&] { return along(true); });
    ball.press(0, ball.home().col(0));   // nothing is pressed any more
    ball.refit_home();
    timed(5, many, [&] { auto const tip = ball.far(tick++); return render(ball.search(tip), tip, false); });
    timed(6, many, [&] {
      return on_surface([&](auto const& at, auto const& tip) { return fit.fit(ball, at.triangle, at.barycentric).force(tip); });
    });
    timed(7, many, [&] { return on_surface([&](auto const& at, auto const& tip) { return proxy(facet_planes(ball, at.triangle, tip), tip); }); });
    ratios.push_back(ways[0].us.back() / ways[2].us.back());
    for (std::size_t k = 0; k < 5 * many; ++k) {
      auto const start = std::chrono::steady_clock::now();
      benchmark::DoNotOptimize(along(false));
      single.push_back(1e6 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
  }
  for (Way& way : ways) state.counters[way.name] = part_of(way.us, 0.5);
  state.counters["linear/rings"] = part_of(ratios, 0.5);
  state.counters["p50"] = part_of(single, 0.5);
  state.counters["p99"] = part_of(single, 0.99);
  static double first = 0;   // µs, of the first size
  if (first == 0) first = part_of(ways[3].us, 0.5);
  state.counters["growth"] = part_of(ways[3].us, 0.5) / first;
}
BENCHMARK(rendering)
    ->ArgName("vertices")
    ->Arg(1442)->Arg(3970)->Arg(5762)->Arg(8664)->Arg(10002)->Arg(30002)->Arg(100002)->Arg(1000002)
    ->Iterations(15)->Unit(benchmark::kMillisecond);

}  // namespace
