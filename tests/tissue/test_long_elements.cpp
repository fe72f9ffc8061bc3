// SPDX-License-Identifier: MIT
// Yardsticks: closed forms (a bar that keeps its volume, hydrostatics, Pascal's law, a membrane on springs, a relaxing spring), Maxwell and Betti's
// reciprocity, the volume that the skin encloses, lines through spheres and tori, what a run without interruption does.
#include "allocation_trap.hpp"
#include "catch.hpp"
#include "device/message.hpp"
#include "yardstick.hpp"

#include <palpate/cutting/no_cutter.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/organ.hpp>
#include <palpate/mesh/repair.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/models.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/testing/body.hpp>
#include <palpate/tool.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

using namespace palpate;
using namespace palpate_test;

namespace {

template <class S>
TriangleMesh<S> block_skin(int nx, int ny, int nz, S spacing) {
  TriangleMesh<S> skin = surface(make_block<S>(nx, ny, nz, spacing, BlockPattern::alternating));
  repair(skin);   // without the points inside
  return skin;
}

/// Of the triangles that face along an axis, or against it, what each vertex has [m²].
template <class S>
std::vector<S> areas(TriangleMesh<S> const& skin, int axis, int sign) {
  std::vector<S> area(std::size_t(skin.points.cols()), S(0));
  for (int t = 0; t < skin.triangles.cols(); ++t) {
    Vector3<S> const a = skin.points.col(skin.triangles(0, t)), b = skin.points.col(skin.triangles(1, t)), c = skin.points.col(skin.triangles(2, t));
    Vector3<S> const normal = (b - a).cross(c - a) / 2;
    for (int k = 0; k < 3; ++k)
      if (S(sign) * normal[axis] > S(0.9) * normal.norm()) area[std::size_t(skin.triangles(k, t))] += normal.norm() / 3;
  }
  return area;
}

/// Presses both ends of a block along an axis with a nominal stress [Pa].
template <class S>
void press(LongElements<S>& body, TriangleMesh<S> const& skin, int axis, S stress) {
  for (int const sign : {-1, 1}) {
    auto const area = areas(skin, axis, sign);
    for (int i = 0; i < body.size(); ++i)
      if (area[std::size_t(i)] > 0) body.apply_force(i, -S(sign) * stress * area[std::size_t(i)] * Vector3<S>::Unit(axis));
  }
}

template <class S>
double extent(LongElements<S> const& body, int axis) {
  auto const [low, high] = low_and_high(body.positions());
  return double(high[axis]) - double(low[axis]);
}

}  // namespace

TEMPLATE_TEST_CASE("long elements: a block that is pressed has Young's modulus E, keeps its volume and widens", "[tissue][long_elements]",
                   PALPATE_TEST_SCALARS) {
  using S = TestType;
  S const spacing = GENERATE(S(0.005), S(0.012));   // m, as long as the mesh's edges, and more
  double const exact = std::is_same_v<S, float> ? 2e-5 : 1e-9;
  auto const skin = block_skin<S>(13, 11, 21, S(0.005));
  LongElements body(skin, {.spacing = spacing, .young = S(5000)});
  CHECK(body.uncovered() == 0);
  for (int axis = 0; axis < 3; ++axis)
    for (double const stress : {50.0, 2500.0, -300.0}) {   // Pa
      body.reset();
      std::vector<double> rest;
      for (int k = 0; k < 3; ++k) rest.push_back(extent(body, k));
      press(body, skin, axis, S(stress));
      auto const report = body.solve_statics();
      CHECK(report.at_rest);
      double stretch = 1;   // E ln λ / λ = −stress, λ^(−1/2) the other ways: logarithmic strain, no volume lost
      for (int k = 0; k < 200; ++k) stretch -= (5000 * std::log(stretch) + stress * stretch) / (5000 / stretch + stress);
      double const uneven = spacing > S(0.01) ? 0.02 * std::abs(1 - stretch) : exact;   // where columns do not end at vertices
      CHECK(extent(body, axis) / rest[std::size_t(axis)] == Approx(stretch).margin(uneven));
      for (int other = 0; other < 3; ++other)
        if (other != axis) CHECK(extent(body, other) / rest[std::size_t(other)] == Approx(1 / std::sqrt(stretch)).margin(uneven));
      CHECK(std::abs(volume(body.mesh()) / volume(skin) - 1) < (std::is_same_v<S, float> ? 1e-5 : 1e-9));   // of the skin as it is drawn
    }
}

TEMPLATE_TEST_CASE("long elements: the pressure is hydrostatic, and the same everywhere without gravity", "[tissue][long_elements][yardstick]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const skin = block_skin<S>(13, 13, 21, S(0.005));
  LongElements body(skin, {.spacing = S(0.005), .young = S(5e5), .density = S(1050)});
  double const modulus = 2.0 / 3.0 * 5e5, kept = std::is_same_v<S, float> ? 1e-5 : 1e-9;
  std::string const scalar = std::is_same_v<S, float> ? " (float)" : "";
  auto const column_pressure = [&](double z, int axis) {   // what a column along an axis near that height shows, by its own strain
    double sum = 0;
    int count = 0, k = 0;
    auto const columns = detail::columns_through(skin, axis, 0.005);
    int before = 0;
    for (int other = 0; other < axis; ++other) before += int(detail::columns_through(skin, other, 0.005).columns.size());
    for (auto const& column : columns.columns) {
      int const at = axis == 0 ? column.line / columns.cells[0] : column.line % columns.cells[0];   // along z
      double const height = 0.0025 + 0.005 * at;
      if (std::abs(height - z) < 1e-4) sum += modulus * std::log1p(double(body.elongation(before + k)) / double(body.column_length(before + k))), ++count;
      ++k;
    }
    REQUIRE(count > 0);
    return sum / count;
  };
  SECTION("a bag that stands") {
    body.set_gravity({S(0), S(0), S(-9.81)});
    for (int i = 0; i < body.size(); ++i)
      if (skin.points(2, i) < S(1e-6)) body.nail(i);
    auto const report = body.solve_statics();
    CHECK(report.at_rest);
    for (double const z : {0.0225, 0.0475, 0.0775})
      for (int const axis : {0, 1}) {
        double const drop = column_pressure(z, axis) - column_pressure(z + 0.01, axis);
        check_yardstick({.what = "long elements, a bag that stands: pressure over 10 mm of height, by columns along " + std::string(axis == 0 ? "x" : "y") + " at " + text(z) + " m" + scalar + " [Pa]",
                         .source = "ρ g h", .expected = 1050 * 9.81 * 0.01, .ours = drop, .within = 0.01, .relative = true});
        CHECK(drop == Approx(double(body.pressure_at({0, 0, S(z)}) - body.pressure_at({0, 0, S(z + 0.01)}))).epsilon(0.01));
      }
    CHECK(column_pressure(0.0475, 0) == Approx(double(body.pressure_at({S(0.03), S(0.03), S(0.0475)}))).epsilon(0.03));
    check_yardstick({.what = "long elements, a bag that stands: change of volume over it" + scalar, .source = "incompressible", .expected = 0, .ours = double(volume(body.mesh()) / volume(skin) - 1), .within = kept});
  }
  SECTION("a bag under a press") {
    press(body, skin, 2, S(500));
    CHECK(body.solve_statics().at_rest);
    double const first = column_pressure(0.0025, 0);
    check_yardstick({.what = "long elements, a bag under a press of 500 Pa: pressure" + scalar + " [Pa]", .source = "σ/3", .expected = 500.0 / 3, .ours = first, .within = 0.01, .relative = true});   // two thirds are the columns'
    check_yardstick({.what = "long elements, a bag under a press: change of volume over it" + scalar, .source = "incompressible", .expected = 0, .ours = double(volume(body.mesh()) / volume(skin) - 1), .within = kept});
    double uneven = 0;
    for (double z = 0.0075; z < 0.1; z += 0.005)
      for (int const axis : {0, 1}) uneven = worse(uneven, std::abs(column_pressure(z, axis) / first - 1));
    check_yardstick({.what = "long elements, a bag under a press: largest difference of the pressure elsewhere over it" + scalar, .source = "the same everywhere", .expected = 0, .ours = uneven, .within = std::is_same_v<S, float> ? 1e-2 : 1e-6});
  }
}

TEST_CASE("long elements: fluid that is pumped in lifts a skin as a membrane on springs", "[tissue][long_elements]") {
  // A slab, its bottom and two long rims of its top nailed: σ w″ − (2E/3L) w + p = 0, w = 0 at the rims: w = w₀ (1 − cosh κy / cosh κb) / (1 − 1 / cosh κb).
  double const thick = 0.01, tension = 3.0, young = 20.0;
  auto const skin = block_skin<double>(41, 21, 5, 0.0025);
  LongElements body(skin, {.spacing = 0.0025, .young = young, .surface_tension = tension});
  for (int i = 0; i < body.size(); ++i) {
    double const y = skin.points(1, i), z = skin.points(2, i);
    if (z < 1e-6 || (z > thick - 1e-6 && std::min(y, 0.05 - y) < 0.0026)) body.nail(i);
  }
  body.set_kept_volume(body.volume() * 1.001);
  CHECK(body.solve_statics().at_rest);
  CHECK(body.volume() == Approx(body.kept_volume()).epsilon(1e-9));
  double const half = 0.025 - 0.00125, kappa = std::sqrt(2 * young / (3 * thick * tension));   // to the middle of the nailed columns
  int const columns_before = int(detail::columns_through(skin, 0, 0.0025).columns.size() + detail::columns_through(skin, 1, 0.0025).columns.size());
  auto const along_z = detail::columns_through(skin, 2, 0.0025);
  double lifted = 0, middle = 0;
  std::vector<std::pair<double, double>> profile;
  for (std::size_t k = 0; k < along_z.columns.size(); ++k) {
    int const line = along_z.columns[k].line;
    double const x = 0.00125 + 0.0025 * (line % along_z.cells[0]), y = 0.00125 + 0.0025 * (line / along_z.cells[0]) - 0.025;
    double const w = body.elongation(columns_before + int(k));
    if (std::abs(x - 0.05125) < 1e-6) profile.emplace_back(y, w);
    if (std::abs(x - 0.05125) < 1e-6 && std::abs(y) < 0.0013) middle = w;
    lifted += w;
  }
  REQUIRE(profile.size() == 20);
  CHECK(lifted > 0);
  double const shape_middle = 1 - std::cosh(kappa * 0.00125) / std::cosh(kappa * half);
  for (auto const& [y, w] : profile) CHECK(w / middle == Approx((1 - std::cosh(kappa * y) / std::cosh(kappa * half)) / shape_middle).margin(0.02));
}

TEMPLATE_TEST_CASE("long elements: what a force does elsewhere it does the other way round, and a step goes h/(h + τ) of the way", "[tissue][long_elements]",
                   PALPATE_TEST_SCALARS) {
  using S = TestType;
  LongElements body(make_organ<S>({.vertices = 500}), {.spacing = S(0.015), .young = S(5000), .surface_tension = S(1), .return_time = S(0.02)});
  double const rounding = std::is_same_v<S, float> ? 2e-2 : 1e-5;
  auto const moved = [&](int pushed, Vector3<S> const& force, int seen) {
    body.reset();
    body.apply_force(pushed, force);
    CHECK(body.solve_statics().at_rest);
    return Vector3<S>(body.displacement(seen));
  };
  S const small = std::is_same_v<S, float> ? S(3e-2) : S(1e-5);   // N
  for (auto const& [i, j] : {std::pair(3, 200), std::pair(100, 101), std::pair(400, 30)}) {
    Vector3<S> const one(S(0.6), S(-0.5), S(0.7)), two(S(-0.2), S(0.9), S(0.3));
    double const there = double(moved(i, small * one, j).dot(two)), back = double(moved(j, small * two, i).dot(one));
    double const scale = double(moved(i, small * one, i).norm());
    CHECK(std::abs(there - back) < rounding * scale);
  }
  Vector3<S> const far = moved(7, Vector3<S>(small, 0, small), 7);
  double left = double(far.norm());
  for (int k = 0; k < 20; ++k) {
    CHECK(body.step(S(5e-3)));
    left *= 0.02 / (0.02 + 5e-3);   // implicit Euler of K e + τ K ė = 0
    CHECK(double(body.displacement(7).norm()) == Approx(left).epsilon(std::is_same_v<S, float> ? 0.05 : 5e-3));   // float: 1 % of strain is not quite linear
  }
  for (int k = 0; k < 400; ++k) {
    body.apply_force(7, {small, 0, small});
    CHECK(body.step(S(5e-3)));
  }
  CHECK(double(Vector3<S>(body.displacement(7) - far).norm()) < rounding * double(far.norm()));
  // What a push adds to the predicted velocity is not more than mobility says, and what is predicted without one happens.
  for (int k = 0; k < 3; ++k) body.step(S(5e-3));
  S const h = S(1e-3);
  Vector3<S> const speed = body.velocities().col(7), predicted = speed + h * body.predicted_acceleration(7, h);
  S const most = h * body.mobility(7, 7, h);
  CHECK(double(body.mobility(7, 30, h)) == Approx(double(body.mobility(30, 7, h))).epsilon(1e-3).margin(1e-3));
  auto const state = body.save();
  CHECK(body.step(h));
  CHECK(Vector3<S>(body.velocities().col(7) - predicted).norm() <= S(rounding) * predicted.norm());
  for (int c = 0; c < 3; ++c) {
    body.restore(state);
    body.apply_force(7, small * Vector3<S>::Unit(c));
    Vector3<S> const pushed = speed + h * body.predicted_acceleration(7, h);   // as a second tool sees it
    CHECK(body.step(h));
    CHECK(Vector3<S>(body.velocities().col(7) - pushed).norm() <= S(rounding) * pushed.norm());
    S const faster = Vector3<S>(body.velocities().col(7) - predicted).norm();
    CHECK(faster <= S(1.001) * small * most);
    CHECK(faster >= S(0.1) * small * most);
  }
}

TEST_CASE("long elements: deep presses keep the volume and no column vanishes; a step allocates nothing", "[tissue][long_elements]") {
  REQUIRE(trap_works());
  auto const organ = make_organ<double>({.vertices = 800});
  LongElements body(organ, {.spacing = 0.012, .young = 3000});
  body.set_gravity({0, 0, -9.81});
  int const top = body.nearest_vertex({0, 0, 1});
  for (int i = 0; i < body.size(); ++i)
    if (organ.points(2, i) < organ.points.row(2).minCoeff() + 0.01) body.nail(i);
  body.step(1e-3);
  body.apply_force(top, {0, 0, -1});
  body.step(1e-3);
  body.predicted_acceleration(top, 1e-3), body.mobility(top, top, 1e-3);
  AllocationCount const allocations;
  bool all = true;
  for (int k = 0; k < 300; ++k) {
    body.apply_force(top, {0, 0, -8.0});
    body.predicted_acceleration(top, 1e-3);
    body.nearest_point({0, 0, 0.1});
    all = all && body.mobility(top, (top + k) % body.size(), 1e-3) < 1e9 && body.step(1e-3);
  }
  long const allocated = allocations.count();
  CHECK(all);
  CHECK(allocated == 0);
  CHECK(body.displacement(top)[2] < -0.01);
  CHECK(body.volume() == Approx(body.kept_volume()).epsilon(1e-4));
  for (int i = 0; i < body.columns(); ++i) CHECK(body.elongation(i) > -body.column_length(i));
  for (int i = 0; i < body.size(); ++i)
    if (body.tissue().nailed(i)) CHECK(body.displacement(i).norm() == 0);
}

TEST_CASE("long elements: a skin that is pulled out far holds, and comes back when it is let go", "[tissue][long_elements]") {
  // Yardstick: the work of a force that grows a little is what the energy grows by; at last the rest shape.
  LongElements body(make_sphere<double>(0.05, 12), {.spacing = 0.01, .young = 5000});
  for (int i = 0; i < body.size(); ++i)
    if (body.reference_position(i)[2] < -0.04) body.nail(i);
  body.step(1e-3);
  int const top = body.nearest_vertex({0, 0, 1});
  auto const pulled = [&](double force) {
    auto one = body;
    one.apply_force(top, {0, 0, force});
    one.solve_statics();
    return one;
  };
  for (double const force : {0.3, 0.6, 1.0, 1.5}) {
    auto const less = pulled(force * 0.999), more = pulled(force * 1.001);
    CAPTURE(force, less.displacement(top)[2]);
    CHECK(less.displacement(top)[2] < 1.5);
    CHECK(more.elastic_energy() - less.elastic_energy() == Approx(force * (more.displacement(top) - less.displacement(top))[2]).epsilon(2e-3));
  }
  auto const far = pulled(1.0);
  double longest = 0;
  for (int i = 0; i < far.columns(); ++i) longest = std::max(longest, 1 + far.elongation(i) / far.column_length(i));
  CHECK(longest > 2.5);
  for (int k = 0; k < 500; ++k) {
    body.apply_force(top, {0, 0, 1.5});
    REQUIRE(body.step(1e-3));
  }
  CHECK(body.displacement(top)[2] > 0.2);
  for (int k = 0; k < 2000; ++k) body.step(1e-3);
  for (int i = 0; i < body.size(); ++i) CHECK(body.displacement(i).norm() < 1e-6);
}

TEMPLATE_TEST_CASE("long elements: saved and restored to the byte", "[tissue][long_elements]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const organ = make_organ<S>({.vertices = 400});
  LongElementsOptions<S> const options{.spacing = S(0.02), .young = S(3000)};
  LongElements body(organ, options), other(organ, options);
  body.set_gravity({0, 0, S(-9.81)});
  body.nail(0), body.nail(5);
  auto const go = [](auto& on, int from, int to) {
    for (int k = from; k < to; ++k) {
      on.apply_force(k, {S(0.01), S(0.2), S(-0.1)});
      CHECK(on.step(S(1e-3)));
    }
  };
  go(body, 10, 20);
  body.apply_force(3, {S(0.1), 0, 0});   // waits for the next step
  auto const middle = body.save();
  go(body, 20, 40);
  Matrix3X<S> const x = body.positions(), v = body.velocities();
  other.restore(middle);
  go(other, 20, 40);
  CHECK((other.positions() == x && other.velocities() == v));
  auto asked = body;
  for (auto* one : {&body, &asked}) one->apply_force(60, {0, S(0.3), 0});
  asked.predicted_acceleration(60, S(1e-3));   // changes nothing, whatever is nailed then
  for (auto* one : {&body, &asked}) one->nail(30), go(*one, 40, 50);
  CHECK(body.positions() == asked.positions());
  body.restore(middle);
  go(body, 20, 40);
  CHECK((body.positions() == x && body.velocities() == v));
  CHECK(body.restorations() == 1);
  LongElements<S> finer(organ, {.spacing = S(0.01), .young = S(3000)});   // as many vertices, more columns
  CHECK_THROWS_AS(body.restore(finer.save()), InvalidArgument);
  auto larger = organ;
  larger.points *= S(2);
  LongElements<S> const twice_as_large(larger, {.spacing = S(0.04), .young = S(3000)});   // as many of both
  REQUIRE(twice_as_large.size() == body.size());
  CHECK_THROWS_WITH(body.restore(twice_as_large.save()), says("m across with edges of", "it is another body's"));
  CHECK((body.positions() == x && body.restorations() == 1));
}

TEST_CASE("long elements: a finger at 1 kHz feels what the statics say, and a rod steadily", "[tissue][long_elements]") {
  auto const organ = make_organ<double>({.vertices = 800});
  for (double const tau : {0.0, 0.005, 0.05})
    for (double const contact : {300.0, 3000.0}) {
      LongElements body(organ, {.spacing = 0.012, .young = 4000, .surface_tension = 2, .return_time = tau});
      int const touched = body.nearest_vertex({0, 0, 1});
      Vector3<double> const home = body.reference_position(touched), out = body.reference_normal(touched);
      auto alone = body;
      ScriptedDevice<double> const finger({{0.0, home + 0.002 * out}, {0.3, home - 0.006 * out}, {2.0, home - 0.006 * out}});
      Simulator simulator(finger, std::move(body), NoCutter<double>(), TissueReaction{}, SimulatorOptions{.coupling = {.stiffness = contact}});
      auto const mark = simulator.mark();
      double most = 0, least = 1e9;
      simulator.run(1.0 + 10 * tau, [&](Tick const& tick) {
        if (tick.time > 0.9 + 10 * tau) most = std::max(most, tick.force.dot(out)), least = std::min(least, tick.force.dot(out));
      });
      INFO(tau << " s, " << contact << " N/m: " << least << " to " << most << " N");
      CHECK(least > 0.1);
      CHECK(most == Approx(least).epsilon(1e-3));
      CHECK(simulator.statistics().body_counts.diverged == 0);
      Vector3<double> const moved = simulator.body().displacement(touched);
      alone.apply_force(touched, -most * out);
      CHECK(alone.solve_statics().at_rest);
      CHECK(Vector3<double>(alone.displacement(touched) - moved).norm() < 0.02 * moved.norm());
      CHECK(std::abs(simulator.body().volume() / simulator.body().kept_volume() - 1) < 1e-9);
      simulator.restore(mark);
      CHECK(simulator.body().displacement(touched).norm() == 0);
    }
  auto const skin = block_skin<double>(13, 13, 9, 0.005);
  LongElements slab(skin, {.spacing = 0.005, .young = 4000});
  for (int i = 0; i < slab.size(); ++i)
    if (skin.points(2, i) < 1e-6) slab.nail(i);
  Vector3<double> const above(0.031, 0.0293, 0.046), in(0.031, 0.0293, 0.036);
  ScriptedDevice<double> const hand({{0.0, above}, {0.4, in}, {2.0, in}});
  Simulator simulator(hand, std::move(slab), BluntTool<double>(make_probe_shape<double>({.radius = 0.003})), TissueReaction{});
  double most = 0, least = 1e9;
  simulator.run(1.0, [&](Tick const& tick) {
    if (tick.time > 0.8) most = std::max(most, tick.force[2]), least = std::min(least, tick.force[2]);
  });
  CHECK(least > 0.05);
  CHECK(most < 1.05 * least);
}

TEST_CASE("columns through a surface: their volume, both parts of a torus, lines through vertices and edges", "[tissue][long_elements]") {
  auto const volume_of = [](auto const& mesh, int axis, double spacing) {
    auto const made = detail::columns_through(mesh, axis, spacing);
    double sum = 0;
    for (auto const& column : made.columns) sum += column.length() * made.width[0] * made.width[1];
    return sum;
  };
  auto const sphere = make_sphere<double>(0.05, 20);
  for (int axis = 0; axis < 3; ++axis) CHECK(volume_of(sphere, axis, 0.002) == Approx(volume(sphere)).epsilon(0.01));
  auto const block = block_skin<double>(5, 7, 9, 0.01);   // lines in the middle of cells of 0.02 meet vertices, edges and diagonals
  for (int axis = 0; axis < 3; ++axis)
    for (double const spacing : {0.02, 0.01, 0.005, 0.0123}) {
      auto const made = detail::columns_through(block, axis, spacing);
      CHECK(made.columns.size() == std::size_t(made.cells[0]) * std::size_t(made.cells[1]));
      CHECK(volume_of(block, axis, spacing) == Approx(volume(block)).epsilon(1e-12));
    }
  TriangleMesh<double> two = sphere;   // beside each other along x: a line along x has two columns
  auto const n = sphere.points.cols(), m = sphere.triangles.cols();
  two.points.conservativeResize(3, 2 * n), two.triangles.conservativeResize(3, 2 * m);
  two.points.rightCols(n) = sphere.points.colwise() + Vector3<double>(0.2, 0, 0);
  two.triangles.rightCols(m) = sphere.triangles.array() + int(n);
  auto const along_x = detail::columns_through(two, 0, 0.005);
  std::size_t const middle = std::size_t(along_x.cells[1] / 2 * along_x.cells[0] + along_x.cells[0] / 2);
  CHECK(along_x.of_line(int(middle)).size() == 2);
  TriangleMesh<double> open = sphere;
  open.triangles.conservativeResize(3, m - 40);
  CHECK_THROWS_AS(detail::columns_through(open, 0, 0.002), InvalidMesh);
}

TEST_CASE("long elements: what they refuse", "[tissue][long_elements]") {
  auto const sphere = make_sphere<double>(0.05, 6);
  using Options = LongElementsOptions<double>;
  auto const refused = [&](Options const& options) { return message_of([&] { LongElements<double>(sphere, options); }); };
  CHECK(unsaid(refused({.young = 5000.0}), "spacing is 0 m", "positive") == "");
  CHECK(unsaid(refused({.spacing = 0.01, .young = -3.0}), "young is -3 Pa") == "");
  CHECK(unsaid(refused({.spacing = 0.01, .young = 5.0}), "young is 5 Pa", "kPa times 1,000") == "");
  CHECK(unsaid(refused({.spacing = 0.01, .young = 5000.0, .density = 1.06}), "density is 1.06 kg/m3", "g/cm3 times 1,000") == "");
  CHECK(unsaid(refused({.spacing = 0.01, .young = 5000.0, .surface_tension = -1.0}), "surface_tension is -1 N/m") == "");
  CHECK(unsaid(refused({.spacing = 0.01, .young = 5000.0, .return_time = -1.0}), "return_time is -1 s") == "");
  CHECK(unsaid(refused({.spacing = 0.01, .young = 5000.0, .iterations = 0}), "iterations is 0") == "");
  CHECK(unsaid(refused({.spacing = 10.0, .young = 5000.0}), "a spacing of 10 m is wider than the surface") == "");   // mm for m
  CHECK(unsaid(refused({.spacing = 1e-5, .young = 5000.0}), "a spacing of 1e-05 m makes more than 1000000 columns") == "");
  CHECK(unsaid(refused({.spacing = 1e-300, .young = 5000.0}), "a spacing of 1e-300 m makes more than 1000000 columns") == "");
  TriangleMesh<double> open = sphere;
  open.triangles.conservativeResize(3, open.triangles.cols() - 1);
  CHECK_THROWS_AS((LongElements<double>(open, {.spacing = 0.01, .young = 5000.0})), InvalidMesh);
  TriangleMesh<double> inward = sphere;
  inward.triangles.row(0).swap(inward.triangles.row(1));
  CHECK_THROWS_AS((LongElements<double>(inward, {.spacing = 0.01, .young = 5000.0})), InvalidMesh);
  LongElements<double> body(sphere, {.spacing = 0.01, .young = 5000.0});
  CHECK_THROWS_AS(body.nail(-1), OutOfRange);
  CHECK_THROWS_AS(body.apply_force(body.size(), {0, 0, 1}), OutOfRange);
  CHECK_THROWS_AS(body.apply_force(0, {0, 0, std::nan("")}), InvalidArgument);
  CHECK_THROWS_AS(body.step(-1), InvalidArgument);
  CHECK_THROWS_AS(body.set_kept_volume(0), InvalidArgument);
  CHECK_THROWS_AS(body.set_gravity({0, std::nan(""), 0}), InvalidArgument);
  body.apply_force(3, {0, 0, 1.5e308}), body.apply_force(3, {0, 0, 1.5e308});   // which add up to infinity
  CHECK_FALSE(body.step(1e-3));
  CHECK(body.displacement(3).norm() == 0);
  body.apply_force(3, {0, 0, -1e9});   // too much for a real body: it stays finite, and comes back
  CHECK(body.step(1e-3));
  CHECK(is_finite(body.positions()));
  CHECK(body.solve_statics().at_rest);
  CHECK(body.displacement(3).norm() < 1e-9);
}

TEMPLATE_TEST_CASE("long elements keep the laws of bodies", "[tissue][long_elements]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  LongElements<S> body(make_sphere<S>(S(0.05), 8), {.spacing = S(0.015), .young = S(5000)});
  for (int const i : {3, 30, 40}) body.nail(i);
  body.step(S(1e-3));   // nails are known from the next step on
  CHECK(testing::to_text(testing::check_body(body)) == "");
}
