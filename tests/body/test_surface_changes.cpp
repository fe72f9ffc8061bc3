// SPDX-License-Identifier: MIT
// What a host needs to follow a cut. Yardstick: the surface itself, beside a copy of it that is patched by the changes alone.
#include <palpate/body/soft_body.hpp>
#include <palpate/body/surface_changes.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/cutting/separating_cutter.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/organ.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include "allocation_trap.hpp"
#include "body/random_edits.hpp"
#include "catch.hpp"
#include "cutting/drawn_strokes.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <type_traits>
#include <vector>

using namespace palpate;

namespace {

using Body = SoftBody<MassSpring<double>, LeapfrogVerlet, WholeBody>;
using Corners = std::array<int, 3>;

Corners corners_of(Body const& body, int t) { return {body.triangles()(0, t), body.triangles()(1, t), body.triangles()(2, t)}; }

/// The buffers of a host: it reads of the body what the changes name, and nothing else.
struct HostCopy {
  std::vector<Corners> triangles;
  std::vector<Vector3<double>> rest;   // where each particle is, undeformed: that tells one from another

  void patch(Body const& body, SurfaceChanges const& changes) {
    triangles.resize(static_cast<std::size_t>(changes.triangle_count));
    rest.resize(static_cast<std::size_t>(changes.particle_count));
    auto const take = [&](int t) { triangles[static_cast<std::size_t>(t)] = corners_of(body, t); };
    for (int const t : changes.triangles) take(t);
    for (int t = changes.first_triangle; t < changes.triangle_count; ++t) take(t);
    for (int i = changes.first_particle; i < changes.particle_count; ++i) rest[static_cast<std::size_t>(i)] = body.tissue().rest_position(i);
  }

  /// Why it is not the surface, or "". A separating cutter moves particles, undeformed: then where they are is not looked at.
  std::string differs_from(Body const& body, bool and_places = true) const {
    if (rest.size() != static_cast<std::size_t>(body.size())) return "particles: " + std::to_string(rest.size());
    if (triangles.size() != static_cast<std::size_t>(body.triangles().cols())) return "triangles: " + std::to_string(triangles.size());
    for (int t = 0; t < static_cast<int>(triangles.size()); ++t)
      if (triangles[static_cast<std::size_t>(t)] != corners_of(body, t)) return "triangle " + std::to_string(t);
    for (int i = 0; and_places && i < body.size(); ++i)
      if (rest[static_cast<std::size_t>(i)] != body.tissue().rest_position(i)) return "particle " + std::to_string(i);
    return {};
  }
};

/// What the record promises of itself; "" if it holds.
std::string violations(Body const& body, SurfaceChanges const& changes) {
  if (changes.particle_count != body.size() || changes.triangle_count != static_cast<int>(body.triangles().cols())) return "the counts";
  if (changes.first_particle < 0 || changes.first_particle > changes.particle_count) return "the first particle";
  if (changes.first_triangle < 0 || changes.first_triangle > changes.triangle_count) return "the first triangle";
  auto const& list = changes.triangles;
  if (std::adjacent_find(list.begin(), list.end(), [](int a, int b) { return a >= b; }) != list.end()) return "the order";
  if (!list.empty() && (list.front() < 0 || list.back() >= changes.first_triangle)) return "the range";
  return {};
}

/// Two hosts of one body: one patches after every tick, though the changes may be those of earlier ticks too; the other only before they
/// are forgotten, every so many ticks.
struct Hosts {
  Body& body;
  int every;
  bool and_places = true;
  HostCopy often, seldom;
  int tick = 0;
  std::size_t max_temporary = 0;

  Hosts(Body& followed, int forgets_every, bool places = true) : body(followed), every(forgets_every), and_places(places) { forget(); }

  void forget() {
    seldom.patch(body, body.changes());
    body.forget_changes();
  }
  void follow() {
    INFO("tick " << tick);
    SurfaceChanges const changes = body.changes();
    REQUIRE(violations(body, changes) == "");
    max_temporary = std::max(max_temporary, body.temporary_subdivisions().size());
    if (tick == 0) often = seldom;
    often.patch(body, changes);
    REQUIRE(often.differs_from(body, and_places) == "");
    if (++tick % every != 0) return;
    forget();
    REQUIRE(seldom.differs_from(body, and_places) == "");
  }
};

template <class Cutter>
constexpr bool keeps_places = std::is_same_v<Cutter, ProgressiveCutter<double>>;

/// The options that fit a mesh of such edges.
template <class Cutter>
Cutter cutter_for(double edge) {
  return Cutter({.puncture_depth = 0.2 * edge});
}

}  // namespace

TEST_CASE("before they are forgotten the changes are the whole body") {
  Body body(make_tissue(make_grid<double>(5, 4, 0.01)));
  HostCopy copy;
  SurfaceChanges const changes = body.changes();
  CHECK(changes.first_particle == 0);
  CHECK(changes.first_triangle == 0);
  CHECK(changes.triangles.empty());
  copy.patch(body, changes);
  CHECK(copy.differs_from(body) == "");
  body.forget_changes();
  CHECK(body.changes().first_particle == 20);
  CHECK(body.changes().first_triangle == 24);
  body.insert_in_triangle(3, {0.3, 0.3, 0.4});
  CHECK(body.changes().first_triangle == 24);
  CHECK(body.changes().triangle_count == 26);
  REQUIRE(body.changes().triangles.size() == 1);
  CHECK(body.changes().triangles[0] == 3);
}

TEMPLATE_TEST_CASE("a copy that is patched by the changes alone is the surface after every tick", "", ProgressiveCutter<double>, SeparatingCutter<double>) {
  int const every = GENERATE(1, 7);
  CAPTURE(every);
  Random random(Seed{61});
  for (auto const& mesh : {make_grid<double>(12, 12, 0.01), make_organ<double>({.vertices = 400})}) {
    Body body(make_tissue(mesh));
    double const edge = body.mean_edge();
    int const particles = body.size();
    Hosts hosts(body, every, keeps_places<TestType>);
    auto cutter = cutter_for<TestType>(edge);
    for (int stroke = 0; stroke < 8; ++stroke) {
      for (auto const& tip : stroke_along<double>(mesh, random, edge, 6, (stroke % 2 == 0 ? 0.07 : 0.9) * edge)) {
        cutter.advance(body, tip);
        hosts.follow();
      }
      cutter.reset(body);
      hosts.follow();
    }
    CHECK(body.size() > particles + 20);
  }
}

TEST_CASE("the changes of two blades that cross each other's way") {
  int const every = GENERATE(1, 7);
  double const step = GENERATE(0.0004, 0.003);
  CAPTURE(every, step);
  auto const grid = make_grid<double>(9, 9, 0.01);
  Body body(make_tissue(grid));
  Hosts hosts(body, every);
  std::vector<Points<double>> const lines{{{-0.005, 0.0353, 0}, {0.085, 0.0357, 0}}, {{0.0413, 0.085, 0}, {0.0423, -0.005, 0}}};
  std::vector<Points<double>> tips;
  for (auto const& line : lines) tips.push_back(stroke_over(grid, sampled(line, step), 0.003, 0.003));
  std::vector<ProgressiveCutter<double>> blades(2, ProgressiveCutter<double>({.puncture_depth = 0.002, .snap = 5e-4}));
  for (std::size_t i = 0; i < std::max(tips[0].size(), tips[1].size()); ++i) {
    for (std::size_t k = 0; k < 2; ++k)
      if (i < tips[k].size()) blades[k].advance(body, tips[k][i]);
    hosts.follow();
  }
  CHECK(hosts.max_temporary == 2);
  CHECK(body.temporary_subdivisions().empty());
}

TEMPLATE_TEST_CASE("the changes when a tool is taken away or a body restored in mid-cut", "", ProgressiveCutter<double>, SeparatingCutter<double>) {
  int const every = GENERATE(1, 7);
  CAPTURE(every);
  Body body(make_tissue(make_grid<double>(9, 9, 0.01)));
  auto const whole = body.save();
  Hosts hosts(body, every, keeps_places<TestType>);
  auto cutter = cutter_for<TestType>(0.01);
  auto const draw = [&](double from, double to, double y) {
    for (double const z : {0.004, 0.001, -0.003}) {
      cutter.advance(body, {from, y, z});
      hosts.follow();
    }
    for (int k = 1; k <= 40; ++k) {
      cutter.advance(body, {from + (to - from) * k / 40, y, -0.003});
      hosts.follow();
    }
    CHECK(cutter.state() == CuttingPhase::moving);
    CHECK(body.size() > 81);
  };
  draw(0.0123, 0.0477, 0.0333);
  cutter.reset(body);
  hosts.follow();
  draw(0.0123, 0.0477, 0.0533);
  auto const half = body.save();
  auto const restore = [&](auto const& state) {
    body.restore(state);
    CHECK(body.changes().first_particle == 0);
    CHECK(body.changes().first_triangle == 0);
    CHECK(body.changes().triangles.empty());
    hosts.follow();
    cutter.advance(body, {0.0477, 0.0533, 0.004});
    hosts.follow();
  };
  for (int k = 1; k <= 20; ++k) {
    cutter.advance(body, {0.0477 + 0.001 * k, 0.0533, -0.003});
    hosts.follow();
  }
  restore(half);
  draw(0.0123, 0.0477, 0.0133);
  restore(whole);
  CHECK(body.size() == 81);
  draw(0.0477, 0.0123, 0.0333);
  restore(half);
}

// Yardstick: the corners of every triangle before.
TEST_CASE("an edit lists the triangles that it gives other corners, and no others") {
  Random random(Seed{62});
  Body body(make_tissue(make_grid<double>(7, 7, 0.01)));
  auto const& surface = body.tissue().surface();
  for (int k = 0; k < 300; ++k) {
    Matrix<int, 3, Dynamic> const before = body.triangles();
    int const particles = body.size();
    body.forget_changes();
    bool const splits = k % 3 == 2;
    int p = -1;
    if (splits)
      p = palpate_test::random_split(body, surface, random)[0];
    else
      palpate_test::random_insertion(body, surface, random);
    SurfaceChanges const changes = body.changes();
    CHECK(changes.first_particle == particles);
    CHECK(changes.first_triangle == before.cols());
    std::vector<int> expected;
    for (int t = 0; t < before.cols(); ++t)
      if (before.col(t) != body.triangles().col(t)) expected.push_back(t);
    REQUIRE(std::vector<int>(changes.triangles.begin(), changes.triangles.end()) == expected);
    if (!splits || k % 2 == 0) continue;
    body.forget_changes();
    body.merge_last_particle(p);
    SurfaceChanges const back = body.changes();
    CHECK(back.first_particle == particles);
    REQUIRE(std::vector<int>(back.triangles.begin(), back.triangles.end()) == expected);
    CHECK(before == body.triangles());
  }
}

TEST_CASE("on a surface of 100,000 triangles a tick is told in a few") {
  auto const grid = make_grid<double>(225, 225, 0.001);
  Body body(make_tissue(grid));
  REQUIRE(body.triangles().cols() == 100352);
  body.forget_changes();
  ProgressiveCutter<double> cutter({.puncture_depth = 2e-4});
  int within = 0, crossing = 0;
  std::size_t max_listed = 0;
  int max_added = 0;
  CutReport before;
  for (auto const& tip : stroke_over<double>(grid, sampled<double>({{0.1003, 0.0707, 0}, {0.1203, 0.0767, 0}, {0.1153, 0.0857, 0}}, 3e-5), 4e-4, 4e-4)) {
    Matrix<int, 3, Dynamic> const triangles = body.triangles();
    cutter.advance(body, tip);
    SurfaceChanges const changes = body.changes();
    CutReport const& now = cutter.report();
    int const crossed = now.vertex_edge + now.vertex_vertex + now.edge_vertex + now.edge_edge - before.vertex_edge - before.vertex_vertex - before.edge_vertex - before.edge_edge;
    before = now;
    if (triangles.cols() == body.triangles().cols() && triangles == body.triangles()) {
      ++within;
      CHECK(changes.first_particle == body.size());
      CHECK(changes.first_triangle == triangles.cols());
      CHECK(changes.triangle_count == triangles.cols());
      CHECK(changes.triangles.empty());
    } else if (crossed == 1) {
      ++crossing;
      max_listed = std::max(max_listed, changes.triangles.size());
      max_added = std::max(max_added, changes.triangle_count - changes.first_triangle);
    }
    body.forget_changes();
  }
  INFO("at most " << max_listed << " listed and " << max_added << " new in " << crossing << " ticks, " << within << " without a change");
  CHECK(within > 500);
  CHECK(crossing > 30);
  CHECK(max_listed <= 12);
  CHECK(max_added <= 6);
}

TEST_CASE("changes that nobody forgets stay bounded, and still patch the copy from then") {
  Random random(Seed{63});
  Body body(make_tissue(make_grid<double>(6, 6, 0.01)));
  auto const& surface = body.tissue().surface();
  HostCopy copy;
  copy.patch(body, body.changes());
  body.forget_changes();
  for (int k = 0; k < 3000; ++k) {
    if (k % 4 == 3) {
      auto const [p, last] = palpate_test::random_split(body, surface, random);
      if (k % 8 == 3) body.merge_last_particle(p);
    } else {
      palpate_test::random_insertion(body, surface, random);
    }
    REQUIRE(body.changes().triangles.size() <= 50);
  }
  CHECK(body.changes().triangles.size() == 50);
  CHECK(violations(body, body.changes()) == "");
  copy.patch(body, body.changes());
  CHECK(copy.differs_from(body) == "");
}

TEST_CASE("on a reserved body recording, telling and forgetting the changes allocates nothing") {
  REQUIRE(palpate_test::trap_works());
  int const every = GENERATE(1, 1000000);
  CAPTURE(every);
  auto const grid = make_grid<double>(20, 20, 0.01);
  ProgressiveCutter<double> cutter({.puncture_depth = 0.002});
  auto const allocations = [&] {
    Body body(make_tissue(grid));
    body.reserve(4 * body.size(), 4 * static_cast<int>(body.triangles().cols()));
    body.forget_changes();
    long count = 0;
    int tick = 0;
    for (double const y : {0.0313, 0.0717, 0.1157}) {
      auto const tips = stroke_over<double>(grid, sampled<double>({{0.0213, y, 0}, {0.1713, y + 0.01, 0}}, 0.001), 0.003, 0.003);
      for (auto const& tip : tips) {
        palpate_test::AllocationCount const allocated;
        cutter.advance(body, tip);
        body.changes();
        if (++tick % every == 0) body.forget_changes();
        count += allocated.count();
      }
    }
    CHECK(body.size() > 500);
    return count;
  };
  INFO("the first time " << allocations());
  CHECK(allocations() == 0);
}
