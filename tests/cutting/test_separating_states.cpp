// SPDX-License-Identifier: MIT
// Yardsticks: the thresholds and states that the thesis names; ProgressiveCutter, in whose place a SeparatingCutter stands; the same stroke over
// the body at rest.
#include "drawn_strokes.hpp"

#include "catch.hpp"

#include <palpate/core/random.hpp>
#include <palpate/cutting/no_cutter.hpp>
#include <palpate/cutting/separating_cutter.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/force/cutting_force.hpp>
#include <palpate/force/liver.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/components.hpp>
#include <palpate/mesh/validation.hpp>
#include <palpate/simulator/simulator.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>

using namespace palpate;

namespace {

template <class S>
using Sheet = SoftBody<MassSpring<S>, LeapfrogVerlet, WholeBody>;
using Grid = Sheet<double>;
using Scalpel = SeparatingCutter<double>;

static_assert(Cutter<SeparatingCutter<float>, Sheet<float>> && Cutter<Scalpel, Grid> &&
              Cutter<Scalpel, SoftBody<MassSpring<double>, LeapfrogVerlet, ZoneOfInfluence>>);

Grid grid(int n) { return Grid(make_tissue(make_grid<double>(n, n, 0.01))); }
Scalpel scalpel() { return Scalpel({.puncture_depth = 0.002}); }

/// Straight down at the first point, through the others in small ticks; mm on the grid. `lift` ends it.
template <class Tool>
void stroke(Grid& body, Tool& tool, std::vector<std::array<double, 2>> const& points, bool lift = true, double tick = 3e-4) {
  Points<double> path;
  for (auto const& p : points) path.push_back({p[0] * 1e-3, p[1] * 1e-3, -0.003});
  tool.advance(body, path.front() + Vector3<double>(0, 0, 0.007));
  for (auto const& tip : sampled(path, tick)) tool.advance(body, tip);
  if (lift) tool.advance(body, path.back() + Vector3<double>(0, 0, 0.007));
}

/// The same program with one type or the other.
template <class Tool>
int palpate_then_cut() {
  auto body = grid(7);
  Tool tool({.puncture_depth = 0.002});
  for (double z : {0.004, 0.0, -0.001, -0.0019, -0.001}) tool.advance(body, {0.0133, 0.0317, z});
  CHECK(tool.state() == CuttingPhase::indenting);
  CHECK(body.size() == 49);
  for (int k = 0; k <= 40; ++k) tool.advance(body, {0.0133 + 1e-3 * k, 0.0317, -0.003});
  CHECK(tool.state() == CuttingPhase::moving);
  CutReport const& report = tool.report();
  CHECK(report.particles_added > 0);
  CHECK_FALSE(tool.lips().empty());
  tool.advance(body, {0.0533, 0.0317, 0.004});
  CHECK(tool.state() == CuttingPhase::no_contact);
  tool.reset(body);
  return report.triangles_added;
}

}  // namespace

TEST_CASE("a separating cutter stands where a progressive one does") {
  CHECK(palpate_then_cut<ProgressiveCutter<double>>() > 0);
  CHECK(palpate_then_cut<SeparatingCutter<double>>() == 0);
}

TEMPLATE_TEST_CASE("the simulator takes a separating cutter by its type", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const run = [](auto cutter) {
    auto path = Trajectory<S>::start({S(0.031), S(0.062), S(0.004)});
    path.line({S(0.031), S(0.062), S(-0.009)}, 0.15).line({S(0.081), S(0.064), S(-0.009)}, 0.2).line({S(0.081), S(0.064), S(0.03)}, 0.15);
    auto body = SoftBody(make_tissue(make_grid<S>(13, 13, S(0.01))), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 3});
    Simulator simulator(ScriptedDevice<S>(path), std::move(body), std::move(cutter), CuttingForce(liver_hysteresis<S>()));
    simulator.run(0.55);
    CHECK(simulator.cutter().state() == CuttingPhase::no_contact);
    CHECK(simulator.cutter().report().particles_added > 0);
    return simulator.body().triangles().cols();
  };
  CHECK(run(SeparatingCutter<S>({.puncture_depth = S(0.006)})) == 288);
  CHECK(run(ProgressiveCutter<S>({.puncture_depth = S(0.006)})) > 288);
}

TEST_CASE("a separating cutter: puncture by force, and no threshold afterwards") {
  auto body = grid(5);
  Scalpel tool({.puncture_depth = 0.5, .puncture_force = 1.0});
  tool.advance(body, {0.01, 0.02, 0.004});
  tool.advance(body, {0.01, 0.02, -0.001}, 0.99);
  CHECK(tool.state() == CuttingPhase::indenting);
  tool.advance(body, {0.01, 0.02, -0.001}, 1.0);
  CHECK(tool.state() == CuttingPhase::moving);
  for (int k = 1; k <= 20; ++k) tool.advance(body, {0.01 + 1e-3 * k, 0.02, -1e-4});
  tool.advance(body, {0.03, 0.02, 0.004});
  CHECK(tool.report().vertex_vertex == 2);
  CHECK(body.size() == 26);
}

TEST_CASE("a separating cutter refuses a tip that is not finite, options without meaning and a body of tetrahedra") {
  auto body = grid(4);
  auto tool = scalpel();
  double const nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(tool.advance(body, {nan, 0.0, 0.0}), InvalidArgument);
  CHECK_THROWS_AS(Scalpel({.puncture_depth = -1.0}), InvalidArgument);
  CHECK_THROWS_AS(Scalpel({.puncture_force = nan}), InvalidArgument);
  CHECK_THROWS_AS(Scalpel({.tip_radius = -1.0}), InvalidArgument);
  SoftBody block(MassSpring<double>(make_block<double>(3, 3, 3, 0.01), {}));
  CHECK_THROWS_AS(tool.advance(block, {0.01, 0.01, 0.03}), InvalidArgument);
}

TEST_CASE("a blade that stays within an edge for many ticks cuts nothing; then it goes on") {
  auto body = grid(7);
  auto tool = scalpel();
  Random random(Seed{5});
  stroke(body, tool, {{10, 30}}, false);
  for (int k = 0; k < 2000; ++k) tool.advance(body, {0.01 + random.uniform(-0.004, 0.004), 0.03 + random.uniform(-0.004, 0.004), -0.003});
  CHECK(tool.state() == CuttingPhase::moving);
  CHECK(body.size() == 49);
  for (int k = 0; k <= 400; ++k)   // a trembling hand: 0.3 mm, a tick of 0.1 mm
    tool.advance(body, {0.01 + 1e-4 * k + random.uniform(-3e-4, 3e-4), 0.03 + random.uniform(-3e-4, 3e-4), -0.003});
  tool.advance(body, {0.05, 0.03, 0.004});
  CHECK(tool.report().vertex_vertex == 4);
  CHECK(tool.report().particles_added == 3);
  CHECK(tool.report().largest_move < 0.004);
}

TEST_CASE("a stroke that leaves over the border and comes back elsewhere does not cut the corner between") {
  auto body = grid(7);
  auto tool = scalpel();
  // In from the left border's middle, out again, round the upper left corner outside, in over the upper border.
  stroke(body, tool, {{20, 30}, {-15, 30}, {-15, 75}, {30, 75}, {30, 40}}, true);
  CHECK(connected_components(body.rest_mesh()).size() == 1);
  // (20,30) → (0,30): two edges, two doubled. (30,60) → (30,40): two edges, two doubled.
  CHECK(tool.report().vertex_vertex == 4);
  CHECK(tool.report().particles_added == 4);
}

TEST_CASE("nailed particles stay nailed where they are, their copies too, and held ones are not moved") {
  auto const mesh = make_grid<double>(7, 7, 0.01);
  auto tissue = make_tissue(mesh);
  for (int i = 0; i < 7; ++i) tissue.nail(3 * 7 + i);
  Grid body(std::move(tissue));
  auto tool = scalpel();
  testing::CutInvariants const before(body, {.moves_vertices = true});
  stroke(body, tool, {{10, 31}, {50, 31}});
  CHECK(testing::to_text(before.check(body)) == "");
  CHECK(tool.report().vertex_vertex == 4);
  CHECK(tool.report().particles_moved == 0);
  for (auto const& [a, b] : tool.lips()) CHECK((body.tissue().nailed(a) && body.tissue().nailed(b)));
  auto other = grid(7);
  for (int i = 0; i < 7; ++i) other.hold(3 * 7 + i);
  auto second = scalpel();
  stroke(other, second, {{10, 31}, {50, 31}});
  CHECK(second.report().vertex_vertex == 4);
  CHECK(second.report().particles_moved == 0);
}

TEST_CASE("mass, home spring and links of a split particle are shared by area") {
  auto body = grid(5);
  double const whole = body.tissue().mass(12), home = body.tissue().home(12).stiffness;
  auto tool = scalpel();
  stroke(body, tool, {{10, 20}, {20, 20}, {20, 30}});
  REQUIRE(tool.lips().size() == 1);
  auto const [a, b] = tool.lips().front();
  CHECK(body.tissue().mass(a) + body.tissue().mass(b) == Approx(whole).epsilon(1e-14));
  CHECK(body.tissue().home(a).stiffness + body.tissue().home(b).stiffness == Approx(home).epsilon(1e-14));
  auto const mesh = body.rest_mesh();
  auto const area = [&](int p) {
    double sum = 0;
    for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
      auto const c = mesh.triangles.col(t);
      Vector3<double> const e = mesh.points.col(c[1]) - mesh.points.col(c[0]), f = mesh.points.col(c[2]) - mesh.points.col(c[0]);
      if (c[0] == p || c[1] == p || c[2] == p) sum += e.cross(f).norm() / 2;
    }
    return sum;
  };
  CHECK(body.tissue().mass(a) / body.tissue().mass(b) == Approx(area(a) / area(b)).epsilon(1e-12));
  CHECK(body.tissue().home(a).stiffness / body.tissue().home(b).stiffness == Approx(area(a) / area(b)).epsilon(1e-12));
  auto const& links = body.tissue().links();
  double sum = 0;
  for (int l = 0; l < links.size(); ++l) sum += links[l].weight;
  CHECK(sum == Approx(56.0).epsilon(1e-12));   // edges of the grid: 20 + 20 + 16
}

TEST_CASE("a body restored under a separating cutter is a new one to it") {
  auto body = grid(7);
  auto const whole = body.save();
  auto tool = scalpel();
  stroke(body, tool, {{10, 30}, {50, 30}}, false);
  CHECK(body.size() > 49);
  body.restore(whole);
  tool.advance(body, {0.05, 0.0302, -0.003});
  CHECK(tool.state() == CuttingPhase::no_contact);
  CHECK(tool.lips().empty());
  stroke(body, tool, {{10, 30}, {50, 30}});
  auto fresh = grid(7);
  auto other = scalpel();
  stroke(fresh, other, {{10, 30}, {50, 30}});
  CHECK(body.rest_mesh().points == fresh.rest_mesh().points);
  CHECK(body.triangles() == fresh.triangles());
}

TEST_CASE("reset ends a separating cut at the vertex nearest to the blade") {
  auto body = grid(7);
  auto tool = scalpel();
  stroke(body, tool, {{10, 30}, {50, 30}}, false);
  tool.reset(body);
  CHECK(tool.state() == CuttingPhase::no_contact);
  CHECK(tool.report().vertex_vertex == 4);
  CHECK_NOTHROW(body.save());
  tool.advance(body, {0.05, 0.03, -0.003});
  CHECK(tool.state() == CuttingPhase::no_contact);   // from inside
}

TEST_CASE("a progressive and a separating cutter cut at once") {
  auto body = grid(9);
  auto tool = scalpel();
  ProgressiveCutter<double> other({.puncture_depth = 0.002});
  stroke(body, tool, {{10, 20}, {20, 20}}, false);
  other.advance(body, {0.0333, 0.0657, 0.004});
  for (int k = 0; k < 20; ++k) other.advance(body, {0.0333 + 2e-4 * k, 0.0657, -0.003});
  REQUIRE(body.temporary_subdivisions().size() == 1);
  for (int k = 0; k <= 40; ++k) {
    tool.advance(body, {0.02 + 1e-3 * k, 0.02, -0.003});
    other.advance(body, {0.0371 + 5e-4 * k, 0.0657, -0.003});
    CHECK(body.temporary_subdivisions().size() == 1);   // there again after its blade's tick
    for (MeshDefect const& defect : validate(body.rest_mesh()))
      CHECK((defect.kind == MeshDefectKind::duplicate_vertex || defect.kind == MeshDefectKind::open_border));   // lips, the sheet's border
  }
  CHECK(tool.report().vertex_vertex == 4);
  CHECK(other.report().particles_added >= 6);
  other.reset(body);
  tool.advance(body, {0.06, 0.02, -0.003});
  tool.advance(body, {0.06, 0.02, 0.004});
  CHECK(tool.report().vertex_vertex == 5);
}

TEST_CASE("separating and progressive cutters in one body, one after the other") {
  Random random(Seed{77});
  auto const mesh = make_grid<double>(12, 12, 0.01);
  Grid body(make_tissue(mesh));
  auto const point = [&] { return std::array<double, 2>{random.uniform(5.0, 105.0), random.uniform(5.0, 105.0)}; };
  for (int k = 0; k < 30; ++k) {
    CAPTURE(k);
    bool const separates = k % 2 == 0;
    testing::CutInvariants const before(body, {.moves_vertices = separates});
    std::vector<std::array<double, 2>> const path{point(), point()};
    double const tick = 1e-3 * random.uniform(0.5, 12.0);
    if (separates) {
      auto tool = scalpel();
      stroke(body, tool, path, true, tick);
    } else {
      ProgressiveCutter<double> tool({.puncture_depth = 0.002});
      stroke(body, tool, path, true, tick);
    }
    REQUIRE(testing::to_text(before.check(body)) == "");
  }
  CHECK(body.size() > 200);
}

TEST_CASE("a wound under pre-tension opens across the blade, behind it") {
  auto const skin = make_grid<double>(11, 11, 0.01);
  auto tissue = make_tissue(skin, 0.1);
  tissue.nail(boundary_vertices(skin));
  Grid body(std::move(tissue));
  auto tool = scalpel();
  tool.advance(body, {0.022, 0.052, 0.004});
  double ahead = 0;
  for (int k = 0; k <= 500; ++k) {
    Vector3<double> const tip(0.022 + 1e-4 * k, 0.052, -0.003);
    tool.advance(body, tip);
    double const h = body.stable_step();
    for (double t = 0; t < 1e-3; t += h) REQUIRE(body.step(std::min(h, 1e-3)));
    for (auto const& [a, b] : tool.lips()) ahead = std::max(ahead, body.tissue().rest_position(a).x() - tip.x());
  }
  REQUIRE(tool.state() == CuttingPhase::moving);
  REQUIRE(tool.lips().size() >= 3);
  CHECK(ahead < 0.005);
  for (auto const& [a, b] : tool.lips()) {
    Vector3<double> const gap = body.positions().col(a) - body.positions().col(b);
    CHECK(std::abs(gap.y()) > 3 * std::abs(gap.x()));
    CHECK(gap.norm() > 2e-4);
  }
}

namespace {

/// Where the material point that rests nearest to `point` is now, and the smooth normal there: every triangle tried.
template <class Body>
std::array<Vector3<double>, 2> place_of(Body const& body, Vector3<double> const& point) {
  auto const rest = body.rest_mesh();
  SurfacePoint<double> const on = SurfaceTree<double>(rest).nearest(rest.points, point);
  std::array<Vector3<double>, 2> at{Vector3<double>::Zero(), Vector3<double>::Zero()};
  for (int k = 0; k < 3; ++k) {
    int const i = rest.triangles(k, on.triangle);
    at[0] += on.barycentric[k] * body.positions().col(i);
    at[1] += on.barycentric[k] * body.reference_normal(i);
  }
  at[1].normalize();
  return at;
}

TriangleMesh<double> cut_along(Grid body, Points<double> const& path, bool shaken) {
  Scalpel tool({.puncture_depth = 1.0, .puncture_force = 1.0});
  testing::CutInvariants const before(body, {.moves_vertices = true});
  int tick = 0;
  auto const advance = [&](Vector3<double> const& point, double height, double force) {
    if (shaken) {
      ++tick;
      body.set_gravity({8 * std::sin(0.3 * tick), 6 * std::cos(0.4 * tick), -2});
      double const h = std::min(1e-3, 0.9 * body.stable_step());
      for (int i = 0; i < 5; ++i) REQUIRE(body.step(h));
    }
    auto const at = place_of(body, point);
    tool.advance(body, at[0] + height * at[1], force);
    REQUIRE(testing::to_text(before.check(body)) == "");
  };
  advance(path.front(), 0.002, 0.0);
  for (auto const& point : path) advance(point, -1e-12, 2.0);
  advance(path.back(), 1.0, 0.0);
  CHECK(tool.state() == CuttingPhase::no_contact);
  CHECK(tool.report().vertex_vertex > 3);
  return body.rest_mesh();
}

}  // namespace

TEST_CASE("a separating cut is the same however the body moves") {
  Random random(Seed{61});
  for (auto const& mesh : {make_grid<double>(14, 14, 0.01), make_sphere<double>(0.06, 5)}) {
    double const edge = mean_edge_length(mesh);
    Vector3<double> const centre = mesh.points.rowwise().mean();
    for (int k = 0; k < 8; ++k) {
      CAPTURE(k, mesh.points.cols());
      auto const off = [&] { return Vector3<double>{random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-0.3, 0.3)}; };
      Vector3<double> const top = centre + Vector3<double>(0, 0, centre.z() == 0.0 && mesh.points.cols() == 196 ? 0.0 : 0.05);
      double const tick = edge * random.uniform(0.1, 1.5);
      Points<double> const path = sampled<double>({top + 2 * edge * off() - Vector3<double>(3 * edge, 0, 0), top + 2 * edge * off(),
                                                   top + 2 * edge * off() + Vector3<double>(3 * edge, 0, 0)}, tick);
      Grid const body(make_tissue(mesh));
      auto const still = cut_along(body, path, false), moved = cut_along(body, path, true);
      REQUIRE(still.points.cols() == moved.points.cols());
      CHECK(still.triangles == moved.triangles);
      CHECK((still.points - moved.points).cwiseAbs().maxCoeff() < 1e-9);
    }
  }
}
