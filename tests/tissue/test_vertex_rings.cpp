// SPDX-License-Identifier: MIT
// Yardsticks: the source's u_r = s_r F on rings found here by breadth first; the exponential return; two springs in series under a tool; brute force for
// the nearest vertex; what is the same however time is divided, whichever way the body lies, and after a restore to the byte.
#include "allocation_trap.hpp"
#include "catch.hpp"
#include "device/message.hpp"

#include <palpate/body/concept.hpp>
#include <palpate/cutting/no_cutter.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/models.hpp>
#include <palpate/simulator/body_loop.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/testing/body.hpp>
#include <palpate/tool/blunt_tool.hpp>
#include <palpate/tool/built_in_shapes.hpp>

#include <Eigen/Geometry>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <queue>
#include <utility>
#include <vector>

using namespace palpate;
using namespace palpate_test;

static_assert(SimulatedBody<VertexRings<double>> && SimulatedBody<VertexRings<float>>);
static_assert(SearchableBody<VertexRings<double>> && StatesMobility<VertexRings<float>>);

namespace {

template <class S>
VertexRingsOptions<S> soft(S return_time = S(0.01)) {
  return {.slopes = {S(-5e-3), S(-2.5e-3), S(-1e-3)}, .return_time = return_time};
}
template <class S>
VertexRings<S> ball(int frequency = 8, S return_time = S(0.01)) {
  return VertexRings<S>(make_sphere<S>(S(0.1), frequency), soft<S>(return_time));
}

/// How many edges each vertex is from one, by triangles alone.
template <class Body>
std::vector<int> edges_from(Body const& body, int from) {
  auto const n = static_cast<std::size_t>(body.size());
  std::vector<std::vector<int>> beside(n);
  auto const triangles = body.triangles();
  for (int t = 0; t < triangles.cols(); ++t)
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        if (a != b) beside[static_cast<std::size_t>(triangles(a, t))].push_back(triangles(b, t));
  std::vector<int> edges(n, 1000);
  std::queue<int> next;
  edges[static_cast<std::size_t>(from)] = 0, next.push(from);
  for (; !next.empty(); next.pop())
    for (int const i : beside[static_cast<std::size_t>(next.front())])
      if (edges[static_cast<std::size_t>(i)] == 1000) edges[static_cast<std::size_t>(i)] = edges[static_cast<std::size_t>(next.front())] + 1, next.push(i);
  return edges;
}

template <class Body>
int nearest_by_all(Body const& body, typename Body::Vector const& p) {
  int best = 0;
  auto const x = body.positions();
  for (int i = 1; i < body.size(); ++i)
    if ((x.col(i) - p).squaredNorm() < (x.col(best) - p).squaredNorm()) best = i;
  return best;
}

template <class S>
Vector3<S> any_vector() {
  return Vector3<S>::Random();
}
template <class S>
S limit() {
  return 100 * std::numeric_limits<S>::epsilon();
}

template <class Body>
bool are_same(Body const& a, Body const& b) {
  return a.positions() == b.positions() && a.velocities() == b.velocities();
}

/// A tip that comes down on a place, from 1 mm above it to `depth`, and stays.
struct Press {
  double depth, top;
  std::uint64_t tick = 0;
  Capabilities capabilities() const { return {.max_force = 20.0, .rate = 1000.0}; }
  DeviceStatus read(DeviceState<double>& state) noexcept {
    double const t = 1e-3 * static_cast<double>(tick++);
    state.position = {0, 0, top + 0.001 - (depth + 0.001) * std::min(1.0, t / 0.2)};
    return DeviceStatus::ok;
  }
  DeviceStatus write(Wrench<double> const&) noexcept { return DeviceStatus::ok; }
};

}  // namespace

TEMPLATE_TEST_CASE("a force moves the touched vertex and two rings by s_r F, and nothing else", "[tissue][vertex_rings]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  std::srand(3);
  auto body = ball<S>();
  for (int const touched : {0, 11, 100, body.size() - 1}) {   // five neighbours, and six
    Vector3<S> const on_hand = 2 * any_vector<S>();   // F
    auto const edges = edges_from(body, touched);
    body.apply_force(touched, -on_hand);
    CHECK(body.solve_statics());
    int moved = 0;
    for (int i = 0; i < body.size(); ++i) {
      int const r = edges[static_cast<std::size_t>(i)];
      Vector3<S> const u = r < 3 ? Vector3<S>(soft<S>().slopes[static_cast<std::size_t>(r)] * on_hand) : Vector3<S>(Vector3<S>::Zero());
      CHECK((body.displacement(i) - u).norm() <= limit<S>() * u.norm());
      CHECK((body.positions().col(i) - body.reference_position(i) - u).norm() <= limit<S>());
      CHECK(body.compliance(touched, i) == (r < 3 ? -soft<S>().slopes[static_cast<std::size_t>(r)] : S(0)));
      moved += r < 3;
    }
    CHECK(static_cast<int>(body.away().size()) == moved);
    CHECK((body.home_force(touched) - on_hand).norm() <= limit<S>() * on_hand.norm());   // the spring of the touched vertex renders F
    body.reset();
    CHECK(body.positions() == body.rest_mesh().points);
  }
}

TEMPLATE_TEST_CASE("a vertex goes to its place and home again exponentially, however time is divided", "[tissue][vertex_rings]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Vector3<S> const force(S(0.3), S(-0.1), -1);
  S const tau = S(0.02), full = S(5e-3) * force.norm();
  for (int const parts : {1, 7, 40}) {
    auto body = ball<S>(4, tau);
    int const i = 12;
    int wrong = 0;
    for (int k = 0; k < parts; ++k) {
      body.apply_force(i, force);
      wrong += body.step(S(0.04) / S(parts)).moving != 18;   // one of its neighbours has five
    }
    CHECK(wrong == 0);
    CHECK(body.displacement(i).norm() == Approx(full * (1 - std::exp(S(-2)))).epsilon(100 * limit<S>()));
    S const pressed = body.displacement(i).norm();
    for (int k = 0; k < parts; ++k) body.step(S(0.1) / S(parts));
    CHECK(body.displacement(i).norm() == Approx(pressed * std::exp(S(-5))).epsilon(100 * limit<S>()));
    CHECK(body.velocities().col(i).dot(force) < 0);
    int steps = 0;
    while (body.step(S(0.01)).moving > 0 && steps < 50) ++steps;
    CHECK(steps < 50);
    CHECK(body.positions() == body.rest_mesh().points);
    CHECK(body.velocities().isZero(0));
    CHECK(body.stable_step() > 1e9);
  }
  auto at_once = ball<S>(4, S(0));
  at_once.apply_force(12, force);
  at_once.step(S(1e-3));
  CHECK(at_once.displacement(12).norm() == Approx(full));
  CHECK(at_once.step(S(1e-3)).moving == 0);
}

TEMPLATE_TEST_CASE("forces on vertex rings add up, act both ways alike, lose energy, and turn with the body", "[tissue][vertex_rings]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  std::srand(5);
  auto body = ball<S>(6), turned = body;
  auto mesh = make_sphere<S>(S(0.1), 6);
  Eigen::Quaternion<S> const turn = Eigen::Quaternion<S>::UnitRandom();
  Vector3<S> const shift = S(0.2) * any_vector<S>();
  mesh.points = (turn.toRotationMatrix() * mesh.points).eval().colwise() + shift;
  VertexRings<S> other(mesh, soft<S>());
  std::vector<std::pair<int, Vector3<S>>> forces;
  for (int k = 0; k < 6; ++k) forces.emplace_back(std::rand() % body.size(), any_vector<S>());
  for (auto const& [i, f] : forces) {
    body.apply_force(i, f), other.apply_force(i, turn * f);
    for (auto const& [j, g] : forces) CHECK(body.compliance(i, j) == body.compliance(j, i));
  }
  body.solve_statics(), other.solve_statics();
  for (int i = 0; i < body.size(); ++i) {
    Vector3<S> sum = Vector3<S>::Zero();
    for (auto const& [j, f] : forces) sum += body.compliance(i, j) * f;
    CHECK((body.displacement(i) - sum).norm() <= limit<S>() * S(0.1));
    CHECK((other.displacement(i) - turn * sum).norm() <= limit<S>() * S(0.1));
  }
  auto const energy = [&] {
    S sum = 0;
    for (int i = 0; i < body.size(); ++i) sum += body.home_stiffness() / 2 * body.displacement(i).squaredNorm();
    return sum;
  };
  for (S last = energy(); last > 0;) {
    body.step(S(5e-3));
    S const now = energy();
    CHECK(now < last);
    last = now;
  }
}

TEST_CASE("nailed vertices stay, and forces on them move nothing", "[tissue][vertex_rings]") {
  VertexRings<double> body(make_grid<double>(7, 7, 0.01), soft<double>());
  body.nail(23), body.nail(0);
  body.apply_force(24, {0, 0, -1}), body.apply_force(0, {0, 0, -1});
  body.solve_statics();
  CHECK(body.displacement(24)[2] == -5e-3);
  CHECK(body.displacement(25)[2] == -2.5e-3);
  CHECK(body.displacement(23).norm() == 0);
  CHECK(body.displacement(1).norm() == 0);
  CHECK(body.tissue().revision() == 2);
}

TEMPLATE_TEST_CASE("the nearest vertex of the deforming surface is that of a search through all", "[tissue][vertex_rings]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  std::srand(11);
  auto body = ball<S>(5, S(1));   // 252 vertices
  int wrong = 0, hint = -1, pressed_in = 0;
  for (int k = 0; k < 100000; ++k) {
    if (k % 5 == 0) {
      body.apply_force(std::rand() % body.size(), S(k % 500 == 0 ? 400 : 60) * any_vector<S>());   // some 0.1 m, a whole radius
      body.step(S(0.05));
    }
    if (k % 7000 == 6999) body.reset();
    Vector3<S> const p = S(k % 2 == 0 ? 0.12 : 0.1) * (k % 3 == 0 ? Vector3<S>(any_vector<S>().normalized()) : any_vector<S>());
    int const found = body.nearest_vertex(p, hint);
    int const best = nearest_by_all(body, p);
    wrong += found != best && (body.positions().col(found) - p).squaredNorm() > (body.positions().col(best) - p).squaredNorm();
    wrong += found > best && (body.positions().col(found) - p).squaredNorm() == (body.positions().col(best) - p).squaredNorm();
    hint = k % 4 == 0 ? -1 : body.tissue().surface().triangles_at(found)[0];
    pressed_in += body.displacement(found).norm() > S(0.01);
  }
  CHECK(wrong == 0);
  CHECK(pressed_in > 5000);
  CHECK(body.nearest_vertex(Vector3<S>::Constant(std::numeric_limits<S>::quiet_NaN())) == -1);
}

TEMPLATE_TEST_CASE("a step of vertex rings costs what is touched, and allocates nothing", "[tissue][vertex_rings]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  REQUIRE(trap_works());
  auto small = ball<S>(4), large = ball<S>(40);   // 162, 16,002 vertices
  for (auto* body : {&small, &large}) {
    int most = 0;
    AllocationCount const allocations;
    for (int k = 0; k < 300; ++k) {
      Vector3<S> const p(S(0.09), S(1e-3) * std::sin(S(0.01) * S(k)), 0);
      int const touched = body->nearest_vertex(p);
      body->apply_force(touched, {-1, 0, 0});
      most = std::max(most, body->step(S(1e-3)).moving);
    }
    long const count = allocations.count();
    CHECK(count == 0);
    CHECK(most < 60);
  }
}

TEMPLATE_TEST_CASE("a tool that slides over vertex rings feels them, and allocates nothing", "[tissue][vertex_rings]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto body = ball<S>(16);
  BodyLoop loop(std::move(body), NoCutter<S>(), ContactCoupling{}, 100);
  auto const tip = [](int k) {   // comes down on the ball in 50 ticks, then slides 45 mm at 10 mm/s
    S const angle = S(1e-4) * S(std::max(0, k - 50)), r = S(0.1) - S(0.003) * std::min(S(1), (S(k) - S(10)) / 40);
    return Vector3<S>(r * std::sin(angle), S(0.3) * r * std::sin(angle), r * std::cos(angle));
  };
  int k = 0;
  for (; k < 100; ++k) loop.tick({tip(k)}, S(1e-3));
  S least = 1e9, most = 0;
  std::size_t away = 0;
  AllocationCount const allocations;
  for (; k < 4500; ++k) {
    S const force = loop.tick({tip(k)}, S(1e-3)).tissue_force.norm();
    least = std::min(least, force), most = std::max(most, force), away = std::max(away, loop.body().away().size());
  }
  long const count = allocations.count();
  CHECK(count == 0);
  // Between a vertex, and the middle of a triangle, each in series with the coupling; the facets are up to 0.2 mm inside the sphere.
  CHECK(least > S(0.8) * S(0.0028) / S(5e-3 + 5e-4));
  CHECK(most < S(1.2) * S(0.003) / S(10e-3 / 3 + 5e-4));
  CHECK(away < 120);
}

TEMPLATE_TEST_CASE("vertex rings go on the same to the byte after a restore", "[tissue][vertex_rings]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  std::srand(17);
  auto body = ball<S>(5);
  auto const tick = [&](int k) {
    Vector3<S> const way(std::cos(S(0.03) * S(k)), std::sin(S(0.03) * S(k)), S(0.2));
    auto const touched = body.nearest_point(S(0.1) * way);
    for (int const i : body.tissue().surface().corners(touched.triangle)) body.apply_force(i, S(-0.4) * way);
    body.step(S(1e-3));
  };
  body.nail(3);
  for (int k = 0; k < 60; ++k) tick(k);
  body.apply_force(50, {1, 2, 3});
  auto const saved = body.save();
  std::size_t const restorations = body.restorations();
  for (int k = 60; k < 130; ++k) tick(k);
  auto const first = body;
  body.nail(7), body.apply_force(9, {4, 0, 0}), body.step(S(0.1));
  body.restore(saved);
  CHECK(body.restorations() == restorations + 1);
  auto small = ball<S>(3);
  CHECK_THROWS_WITH(small.restore(saved), says("can not be restored", "it is another body's"));
  CHECK_FALSE(body.tissue().nailed(7));
  CHECK(body.tissue().nailed(3));
  for (int k = 60; k < 130; ++k) tick(k);
  CHECK(are_same(body, first));
}

TEST_CASE("a tool of a simulator presses vertex rings as two springs in series", "[tissue][vertex_rings]") {
  for (double const tau : {0.0, 1e-4, 1e-3, 0.01, 0.1})
    for (double const contact : {500.0, 2000.0, 50000.0})
      for (bool const on_vertex : {true, false}) {
        auto body = ball<double>(8, tau);
        // Over a vertex, and over the middle of a triangle.
        int const top = body.nearest_vertex({0, 0, 1});
        int const triangle = body.tissue().surface().triangles_at(top)[0];
        Vector3<double> normal = body.reference_position(top).normalized();
        double give = 5e-3;
        if (!on_vertex) {
          normal.setZero();
          for (int const i : body.tissue().surface().corners(triangle)) normal += body.reference_position(i) / 3;
          give = (3 * 5e-3 + 6 * 2.5e-3) / 9;
        }
        double const top_z = on_vertex ? 0.1 : normal.norm();
        auto mesh = body.rest_mesh();   // turned so that the tool comes down on that place
        mesh.points = Eigen::Quaterniond::FromTwoVectors(normal, Vector3<double>::UnitZ()).toRotationMatrix() * mesh.points;
        Simulator simulator(Press{.depth = 0.003, .top = top_z}, VertexRings<double>(mesh, soft<double>(tau)), NoCutter<double>(),
                            TissueReaction{}, SimulatorOptions{.coupling = {.stiffness = contact}});
        auto const mark = simulator.mark();
        double most = 0, least = 1e9;
        simulator.run(0.5 + 20 * tau, [&](Tick const& tick) {
          if (tick.time < 0.4 + 19 * tau) return;
          most = std::max(most, tick.force[2]), least = std::min(least, tick.force[2]);
        });
        double const expected = 0.003 / (give + 1 / contact);
        INFO(tau << " s, " << contact << " N/m, vertex " << on_vertex << ": " << least << " to " << most << " N, expected " << expected);
        CHECK(least == Approx(expected).epsilon(1e-3));
        CHECK(most == Approx(expected).epsilon(1e-3));
        CHECK(simulator.statistics().body_counts.diverged == 0);
        simulator.restore(mark);
        CHECK(simulator.body().restorations() == 1);
        CHECK(simulator.body().positions() == mesh.points);
      }
}

TEST_CASE("a rod, longer than a point, presses vertex rings out of its way, and the force is steady", "[tissue][vertex_rings]") {
  double const radius = 0.003;
  for (double const tau : {0.0, 1e-3, 0.01, 0.1}) {
    VertexRings<double> body(make_grid<double>(13, 13, 0.005), soft<double>(tau));
    Vector3<double> const above(0.031, 0.0293, 0.006), in(0.031, 0.0293, -0.002);
    Simulator simulator(ScriptedDevice<double>({{0.0, above}, {0.4, in}, {2.0, in}}), std::move(body),
                        BluntTool<double>(make_probe_shape<double>({.radius = radius})), TissueReaction{});
    double most = 0, least = 1e9;
    simulator.run(1.0 + 5 * tau, [&](Tick const& tick) {
      if (tick.time > 0.8 + 5 * tau) most = std::max(most, tick.force[2]), least = std::min(least, tick.force[2]);
    });
    INFO(tau << " s: " << least << " to " << most << " N");
    CHECK(least > 0.5);
    CHECK(most < 1.01 * least);
    double nearest = 1;   // of the surface to the axis, which goes up from `in`
    auto const x = simulator.body().positions();
    for (int t = 0; t < simulator.body().triangles().cols(); ++t)
      for (int a = 0; a <= 20; ++a)
        for (int b = 0; a + b <= 20; ++b) {
          auto const c = simulator.body().tissue().surface().corners(t);
          Vector3<double> const p = (a * x.col(c[0]) + b * x.col(c[1]) + (20 - a - b) * x.col(c[2])) / 20.0;
          nearest = std::min(nearest, (p - in - Vector3<double>(0, 0, std::max(0.0, p[2] - in[2]))).norm());
        }
    CHECK(nearest > 0.95 * radius);
  }
}

TEST_CASE("vertex rings say what is wrong with slopes, forces, steps and meshes", "[tissue][vertex_rings]") {
  auto const mesh = make_grid<double>(4, 4, 0.01);
  auto const made = [&](std::array<double, 3> slopes, double tau = 0.01) { return [=] { VertexRings<double>(mesh, {.slopes = slopes, .return_time = tau}); }; };
  using palpate_test::message_of;
  CHECK(message_of(made({-1e-3, -2e-3, -5e-3})).find("slope 1 is -0.002 m/N, and slope 0 is -0.001 m/N; give |s_0| > |s_1| > |s_2|") != std::string::npos);
  CHECK(message_of(made({-5e-3, -2e-3, -2e-3})).find("slope 2 is -0.002 m/N") != std::string::npos);
  CHECK(message_of(made({5e-3, -2e-3, -1e-3})).find("slope 0 is 0.005 m/N; give a number between -1 and 0") != std::string::npos);
  CHECK(message_of(made({-1, -2e-3, -1e-3})).find("slope 0 is -1 m/N") != std::string::npos);
  CHECK(message_of(made({-5e-3, -2e-3, std::nan("")})).find("slope 2 is nan m/N") != std::string::npos);
  CHECK(message_of(made({-5e-3, -2e-3, -1e-3}, -1)).find("return_time is -1 s") != std::string::npos);
  VertexRings<double> body(mesh, soft<double>());
  CHECK_THROWS_AS(body.apply_force(16, {0, 0, 1}), OutOfRange);
  CHECK_THROWS_AS(body.apply_force(-1, {0, 0, 1}), OutOfRange);
  CHECK_THROWS_AS(body.apply_force(1, {0, 0, std::nan("")}), InvalidArgument);
  CHECK_THROWS_AS(body.step(-1), InvalidArgument);
  CHECK_THROWS_AS(body.displacement(16), OutOfRange);
  CHECK_THROWS_AS(VertexRings<double>(TriangleMesh<double>{}, soft<double>()), InvalidMesh);
  body.apply_force(5, {0, 0, 1});
  body.step(1e-3);
  auto const before = body;
  body.apply_force(9, {0, 0, 1e200});
  auto const report = body.step(1e-3);
  CHECK_FALSE(report);
  CHECK(report.vertex >= 0);
  CHECK(are_same(body, before));
  CHECK(body.step(1e-3));
  CHECK(body.displacement(9).norm() < 1);
}

TEMPLATE_TEST_CASE("vertex rings keep the laws of bodies", "[tissue][vertex_rings]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  VertexRings<S> body(make_sphere<S>(S(0.05), 8), {.slopes = {S(-5e-3), S(-2.5e-3), S(-1e-3)}});
  body.nail(3);
  CHECK(testing::to_text(testing::check_body(body)) == "");
}
