// SPDX-License-Identifier: MIT
// The parts of both sides, one by one: what the server copies, follows and answers, what the deadband leaves out, what a bad network does.
#include "allocation_trap.hpp"
#include "catch.hpp"
#include "servo_guard.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/no_cutter.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/network/hand_reporter.hpp>
#include <palpate/network/impaired_link.hpp>
#include <palpate/network/local_surface.hpp>
#include <palpate/network/protocol.hpp>
#include <palpate/network/surface_then_tissue.hpp>
#include <palpate/network/tissue_node.hpp>
#include <palpate/network/weber_deadband.hpp>
#include <palpate/simulator/servo_loop.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

using namespace palpate;

namespace {

auto sheet(bool nailed = false) {
  auto const skin = make_grid<double>(21, 21, 0.005);
  MassSpring<double> tissue(skin, {.mass = {.total = 0.1}, .link = {.stiffness = 80.0, .damping = 0.2}, .home = {.stiffness = 8.0, .damping = 0.1}});
  if (nailed) {
    std::vector<int> all;
    for (int v = 0; v < 441; ++v) all.push_back(v);
    tissue.nail(all);
  } else {
    tissue.nail(boundary_vertices(skin));
  }
  return SoftBody(std::move(tissue), LeapfrogVerlet{});
}
auto ball(int frequency) {
  MassSpring<double> tissue(make_sphere<double>(0.03, frequency), {.mass = {.total = 0.1}, .link = {.stiffness = 80.0}, .home = {.stiffness = 8.0}});
  return SoftBody(std::move(tissue), LeapfrogVerlet{});
}
HandReport at(double x, double y, double z, std::uint64_t sequence, double time = 0.0) { return {.sequence = sequence, .time = time, .position = {x, y, z}}; }

}  // namespace

// Yardstick: the fit to the whole body, which the copy stands for.
TEST_CASE("a copied piece of a surface gives the fit of the body itself", "[network]") {
  auto body = ball(10);
  LocalSurface<double> piece;
  for (int const triangle : {0, 17, 400, 1000}) {
    piece.capture(body, triangle);
    Vector3<double> const inside(0.2, 0.3, 0.5);
    Vector3<double> p = Vector3<double>::Zero();
    auto const corners = body.tissue().surface().corners(triangle);
    for (std::size_t k = 0; k < 3; ++k) p += inside[static_cast<Eigen::Index>(k)] * body.positions().col(corners[k]);
    auto const nearest = piece.nearest(Vector3<double>(1.02 * p));
    SurfaceFit<double> whole({.curved = true}), copied({.curved = true});
    auto const there = body.nearest_point(Vector3<double>(1.02 * p));
    REQUIRE(nearest.triangle >= 0);
    CHECK((nearest.barycentric - there.barycentric).norm() < 1e-12);
    whole.fit(body, there.triangle, there.barycentric);
    copied.fit(piece, nearest.triangle, nearest.barycentric);
    CHECK((whole.patch().point - copied.patch().point).norm() < 1e-15);
    CHECK((whole.patch().normal - copied.patch().normal).norm() < 1e-12);
    CHECK(whole.patch().curvature == Approx(copied.patch().curvature).epsilon(1e-9));
    CHECK(copied.patch().curvature == Approx(1.0 / 0.03).epsilon(0.05));   // of the ball
  }
}

TEST_CASE("a copy of a large surface keeps to its room, and allocates nothing", "[network]") {
  REQUIRE(palpate_test::trap_works());
  auto body = ball(20);
  LocalSurface<double> piece;
  SurfaceTracker<double> tracker;
  palpate_test::AllocationCount const allocations;
  piece.capture(body, 5);
  LocalSurface<double> const copy = piece;
  auto const patch = tracker.look(copy, Vector3<double>(0, 0, 0.04), 0.001, 500.0, 0.005);
  long const count = allocations.count();
  CHECK(count == 0);
  CHECK(patch.valid());
  CHECK(piece.positions().cols() == LocalSurface<double>::max_vertices);
  CHECK(piece.triangle_count() <= LocalSurface<double>::max_triangles);
  CHECK(piece.triangle_count() > 96);
  for (int k = 0; k < 3; ++k)   // the touched triangle's corners have all their triangles
    CHECK(piece.triangles_at(k).size() == body.tissue().surface().triangles_at(body.tissue().surface().corners(5)[static_cast<std::size_t>(k)]).size());
  piece.capture(body, -1);
  CHECK(piece.is_empty());
  CHECK(tracker.look(piece, Vector3<double>(0, 0, 0.04), 0.0, 500.0, 0.0).stiffness == 0.0);
}

// Yardstick: the ball of 30 mm itself, offset by the tool's radius.
TEST_CASE("between two ticks of the body the surface follows a tool that slides over it", "[network]") {
  auto body = ball(20);
  LocalSurface<double> piece;
  auto const start = body.nearest_point(Vector3<double>(0.04, 0, 0));
  piece.capture(body, start.triangle);
  SurfaceTracker<double> tracker;
  auto const held = tracker.look(piece, Vector3<double>(0.031, 0, 0), 0.001, 500.0, 0.0);
  SurfacePatch<double> plane = held;
  plane.curvature = 0.0;
  double worst = 0.0, worst_of_held = 0.0;
  for (int k = 0; k <= 10; ++k) {   // 5 mm along, as a hand of 0.5 m/s goes in 10 ms
    double const angle = 0.0005 * k / 0.03;
    Vector3<double> const tip = 0.031 * Vector3<double>(std::cos(angle), std::sin(angle), 0);
    worst = std::max(worst, std::abs(tracker.look(piece, tip, 0.001, 500.0, 0.0).distance(tip)));
    worst_of_held = std::max(worst_of_held, std::abs(plane.distance(tip)));
  }
  CHECK(worst < 4e-5);            // the facets are up to 0.03 mm inside the ball
  CHECK(worst_of_held > 3.5e-4);   // a plane that stays is 0.4 mm off: (5 mm)²/(2 · 31 mm)
}

// Yardstick: a nailed sheet is a wall, F = K d of the contact.
TEST_CASE("a node answers a hand with the force of the contact, and tells what it answers", "[network]") {
  TissueNode node(sheet(true), NoCutter<double>{}, {.coupling = {.stiffness = 700.0, .damping = 0.0}});
  node.hand_came();
  for (std::uint64_t k = 1; k <= 10; ++k) {
    node.take(at(0.052, 0.051, 0.003 - 0.0005 * static_cast<double>(k), k, 0.01 * static_cast<double>(k)), 0.01 * static_cast<double>(k));
    TissueAnswer const& answer = node.tick(0.01, 0.01 * static_cast<double>(k));
    CHECK(answer.valid());
    CHECK(answer.stamp.hand == k);
    CHECK(answer.stamp.hand_time == 0.01 * static_cast<double>(k));
  }
  for (int k = 0; k < 3; ++k) node.tick(0.01, 0.1);
  CHECK(node.last().force.z() == Approx(700.0 * 0.002).epsilon(1e-9));
  CHECK(node.last().phase == CuttingPhase::indenting);
  CHECK(node.captured().stiffness == 700.0);
  REQUIRE(node.shown());
  CHECK(node.shown()->position.z() == Approx(0.0).margin(1e-12));   // the tool that is drawn is on the sheet, 2 mm above the tip
}

TEST_CASE("a hand that falls silent or leaves takes its tool with it, and comes back from elsewhere", "[network]") {
  TissueNode node(sheet(true), ProgressiveCutter<double>({.puncture_depth = 0.0005}), {.hand_silent_after = 0.1});
  node.take(at(0.052, 0.051, 0.004, 1), 0.0);
  node.tick(0.01, 0.01);
  node.take(at(0.052, 0.051, -0.0002, 2), 0.02);
  CHECK(node.tick(0.01, 0.02).phase == CuttingPhase::indenting);
  CHECK(node.tick(0.01, 0.11).phase == CuttingPhase::indenting);   // silent for 90 ms: frozen
  TissueAnswer const gone = node.tick(0.01, 0.13);
  CHECK(gone.stamp.hand == 0);
  CHECK_FALSE(node.shown());
  CHECK(node.captured().stiffness == 0.0);
  node.take(at(0.060, 0.061, -0.004, 3), 0.2);   // far inside: placed there, nothing is cut on the way
  std::size_t const revision = node.body().topology_revision();
  CHECK(node.tick(0.01, 0.2).phase == CuttingPhase::no_contact);
  CHECK(node.body().topology_revision() == revision);
  node.hand_left();
  CHECK(node.tick(0.01, 0.21).stamp.hand == 0);
  node.hand_came();
  node.take(at(0.052, 0.051, 0.004, 1), 0.22);   // another connection counts from 1
  CHECK(node.tick(0.01, 0.22).stamp.hand == 1);
}

TEST_CASE("samples that come late, and answers to nobody, change nothing", "[network]") {
  TissueNode node(sheet(true), NoCutter<double>{});
  CHECK(node.tick(0.01, 0.0).stamp.hand == 0);
  node.take(at(0.052, 0.051, 0.004, 5), 0.0);
  node.take(at(0.052, 0.051, -0.004, 4), 0.0);
  CHECK(node.tick(0.01, 0.01).stamp.hand == 5);
  CHECK(node.last().phase == CuttingPhase::no_contact);
}

TEST_CASE("a body that flies away is told as diverged, in numbers that may be sent", "[network]") {
  TissueNode node(sheet(), NoCutter<double>{});
  node.body().apply_force(220, Vector3<double>(0, 0, 1e200));
  for (int k = 1; k < 20; ++k) {
    node.take(at(0.052, 0.051, 0.001, static_cast<std::uint64_t>(k)), 0.01 * k);
    CHECK(node.tick(0.01, 0.01 * k).valid());
  }
}

// Yardstick: the force on a hand that comes after, of a body that nobody has touched before it.
TEST_CASE("a hand that leaps about and says absurd speeds does not spoil the tissue for the next one", "[network]") {
  auto const felt = [](TissueNode<decltype(sheet()), NoCutter<double>>& node, double begun) {
    node.hand_came();
    for (int k = 1; k <= 200; ++k) {
      double const now = begun + 0.01 * k;
      node.take(at(0.052, 0.051, std::max(0.01 - 0.0002 * k, -0.003), static_cast<std::uint64_t>(k), 0.01 * k), now);
      node.tick(0.01, now);
    }
    return node.last().force.z();
  };
  TissueNode untouched(sheet(), NoCutter<double>{}), attacked(sheet(), NoCutter<double>{});
  double const right = felt(untouched, 0.0);
  CHECK(right > 0.05);
  attacked.hand_came();
  for (int k = 1; k <= 2000; ++k) {
    double const now = 0.001 * k, side = k % 2 == 0 ? 1.0 : -1.0;
    HandReport report = at(0.05 + 0.02 * side, 0.05, 0.05 * side, static_cast<std::uint64_t>(k), k < 1000 ? now : 1e6 * k);   // and any time
    report.velocity = {0, 0, -1e7 * side};
    attacked.take(report, now);
    if (k % 10 == 0) CHECK(attacked.tick(0.01, now).valid());
  }
  for (int k = 1; k <= 150; ++k) attacked.tick(0.01, 2.0 + 0.01 * k);   // nobody is there
  CHECK(felt(attacked, 4.0) == Approx(right).epsilon(0.02));
}

TEST_CASE("a body that stays diverged is restored after a while, and says so", "[network]") {
  TissueNode node(sheet(), NoCutter<double>{}, {.restores_after = 0.5});
  std::uint64_t const before = node.body().restorations();
  int diverged = 0;
  for (int k = 1; k <= 300; ++k) {
    double const now = 0.01 * k;
    if (k > 100 && k < 170) node.body().apply_force(220, Vector3<double>(0, 0, 1e200));
    node.take(at(0.052, 0.051, std::max(0.005 - 0.0002 * k, -0.001), static_cast<std::uint64_t>(k), now), now);
    TissueAnswer const& answer = node.tick(0.01, now);
    CHECK(answer.valid());
    diverged += answer.diverged ? 1 : 0;
    if (k == 100) CHECK(answer.force.z() > 0.01);
    if (k == 148) CHECK(answer.restorations == before);
    if (k == 160) CHECK(answer.restorations == before + 1);
  }
  CHECK(diverged > 40);
  CHECK(node.body().positions().allFinite());
  CHECK_FALSE(node.last().diverged);
}

// Yardstick: Weber's law as it is defined, |ΔF| ≤ max(k F, floor).
TEST_CASE("a deadband leaves out what is within Weber's fraction, and never for longer than keep_alive", "[network]") {
  WeberDeadband deadband({.fraction = 0.1, .floor = 0.01, .keep_alive = 0.02});
  CHECK(deadband(0.0, 1.0, 0.0));            // the first
  CHECK_FALSE(deadband(0.1, 1.0, 0.001));    // exactly k F
  CHECK(deadband(0.1001, 1.0, 0.002));
  CHECK_FALSE(deadband(0.01, 0.0, 0.003));   // exactly the floor
  CHECK(deadband(0.0101, 0.0, 0.004));
  CHECK_FALSE(deadband(0.0, 1.0, 0.0239));
  CHECK(deadband(0.0, 1.0, 0.0241));
  CHECK(deadband(0.0, 1.0, 0.0242, true));
  CHECK(deadband(std::nan(""), 1.0, 0.0243));   // what cannot be compared is sent
  CHECK(deadband.sent() == 6);
  CHECK(deadband.left_out() == 3);
  WeberDeadband everything;
  for (int k = 0; k < 5; ++k) CHECK(everything(0.0, 1.0, 1e-9 * k));
  CHECK_THROWS_WITH(WeberDeadband({.fraction = 10.0}), Catch::Matchers::Contains(".fraction is 10"));
  CHECK_THROWS_WITH(WeberDeadband({.keep_alive = 1.0}), Catch::Matchers::Contains(".keep_alive is 1 s") && Catch::Matchers::Contains("0.1 s without news"));
}

// Yardsticks: the mean and the bounds of an even distribution; the stationary share and the mean length of Gilbert's chain.
TEST_CASE("a bad network delays as it is told, loses nothing and keeps the order", "[network]") {
  constexpr int messages = 100000;
  std::array<std::byte, 4> bytes{};
  auto const run = [&](Impairment const& impairment, double period, auto const& use) {
    ImpairedLink link(impairment);
    int next = 0;
    for (int k = 0; k < messages || next < messages; ++k) {
      double const now = period * k;
      if (k < messages) {
        detail::network::put(bytes.data(), static_cast<std::uint32_t>(k));
        link.send(bytes, now);
      }
      link.receive(now, [&](std::span<std::byte const> got) {
        CHECK(detail::network::taken<std::uint32_t>(got.data()) == static_cast<std::uint32_t>(next));
        use(now - period * next);
        ++next;
      });
      REQUIRE(k < 3 * messages);
    }
    return link;
  };
  double least = 1.0, most = 0.0, sum = 0.0;
  constexpr double finely = 1e-5;   // s, between two looks
  ImpairedLink apart({.delay = 0.02, .jitter = 0.005, .seed = 1});
  for (int k = 0; k < 1000; ++k) {   // so far apart that none waits for another
    double const sent = 0.03 * k;
    apart.send(bytes, sent);
    for (int n = 0; n < 3000; ++n)
      apart.receive(sent + finely * n, [&](std::span<std::byte const>) {
        double const delay = finely * n;
        least = std::min(least, delay), most = std::max(most, delay), sum += delay;
      });
  }
  CHECK(least == Approx(0.015).margin(5e-5));
  CHECK(most == Approx(0.025).margin(5e-5));
  CHECK(sum / 1000 == Approx(0.02).margin(3e-4));   // 3 standard errors of 0.01/sqrt(12)/sqrt(1000)
  ImpairedLink const lossy = run({.delay = 0.001, .loss = 0.1, .burst = 4.0, .seed = 2}, 0.001, [](double) {});
  CHECK(static_cast<double>(lossy.lost()) / messages == Approx(0.1).epsilon(0.05));
  CHECK(lossy.messages() == messages);
  ImpairedLink bursts({.loss = 0.1, .burst = 4.0, .seed = 3});
  int begun = 0;
  bool was_lost = false;
  for (int k = 0; k < messages; ++k) {
    auto const before = bursts.lost();
    bursts.send(bytes, 1.0 * k);
    bool const is_lost = bursts.lost() > before;
    begun += is_lost && !was_lost ? 1 : 0;
    was_lost = is_lost;
    bursts.receive(1.0 * k, [](std::span<std::byte const>) {});
  }
  CHECK(static_cast<double>(bursts.lost()) / begun == Approx(4.0).epsilon(0.05));
  CHECK(lossy.bytes() == 4u * messages);
  double longest = 0.0;
  ImpairedLink silent({.delay = 0.01, .silences = {{0.5, 0.7}}});
  for (int k = 0; k < 1000; ++k) {
    silent.send(bytes, 0.001 * k);
    silent.receive(0.001 * k, [&](std::span<std::byte const>) {
      if (0.001 * k > 0.5 && 0.001 * k < 0.7) longest = 1.0;
    });
  }
  CHECK(longest == 0.0);
  CHECK_THROWS_WITH(ImpairedLink({.silences = {{1.0, 2.0}, {0.5, 1.2}}}), says(".silences is 0.5 s", "times that rise"));
  CHECK_THROWS_WITH(ImpairedLink({.silences = {{1.0, 0.2}}}), says(".silences is 0.2 s", "times that rise"));
}

TEST_CASE("the same seed gives the same times, whatever is sent", "[network]") {
  auto const times = [](std::uint64_t seed, std::byte what) {
    ImpairedLink link({.delay = 0.01, .jitter = 0.01, .loss = 0.3, .burst = 2.0, .seed = seed});
    std::vector<int> arrivals;
    std::array<std::byte, 7> bytes{};
    bytes.fill(what);
    for (int k = 0; k < 2000; ++k) {
      link.send(bytes, 0.001 * k);
      link.receive(0.001 * k, [&](std::span<std::byte const>) { arrivals.push_back(k); });
    }
    return arrivals;
  };
  CHECK(times(1, std::byte{0}) == times(1, std::byte{9}));
  CHECK(times(1, std::byte{0}) != times(2, std::byte{0}));
}

TEST_CASE("an impairment that cannot be is refused with the value", "[network]") {
  CHECK_THROWS_WITH(ImpairedLink({.loss = 30.0}), Catch::Matchers::Contains(".loss is 30"));
  CHECK_THROWS_WITH(ImpairedLink({.delay = -1.0}), Catch::Matchers::Contains(".delay is -1 s"));
  CHECK_THROWS_WITH(ImpairedLink({.burst = 0.5}), Catch::Matchers::Contains(".burst is 0.5"));
  CHECK_THROWS_WITH(ImpairedLink({.loss = 0.9}), Catch::Matchers::Contains("longer bursts"));
  CHECK_THROWS_WITH(TissueNode(sheet(), NoCutter<double>{}, {.surface = SurfaceKind::facets}), Catch::Matchers::Contains("neither plane nor ball"));
  CHECK_THROWS_WITH(TissueNode(sheet(), NoCutter<double>{}, {.hand_silent_after = 0.0}), Catch::Matchers::Contains(".hand_silent_after is 0 s"));
}

// Yardstick: what the server's own tissue answers; the contact is as stiff as the surface that is sent.
TEST_CASE("the surface that is sent presses a tool of any radius at rest as the tissue does", "[network]") {
  for (double const radius : {0.0, 0.005}) {
    CAPTURE(radius);
    TissueNode node(sheet(), NoCutter<double>({.tip_radius = radius}));
    SurfaceNode<double> fast;
    HandReport hand;
    std::uint64_t sequence = 0;
    for (int k = 0; k < 500; ++k) {
      double const now = 0.001 * k, depth = std::min(0.010, 5e-5 * k);
      hand = at(0.052, 0.051, radius + 0.001 - depth, ++sequence, now);
      node.take(hand, now);
      node.tick(0.001, now);
    }
    double const tissue = node.last().force.norm();
    CHECK(tissue > 0.3);
    CHECK(fast.look(node.captured(), hand, 0.499, 0.001).patch.force(hand.position).norm() == Approx(tissue).epsilon(0.15));   // the point nearest to the tip, on triangles of 5 mm
  }
}

// Yardstick: what docs/network.md says of silence: what is not heard of for 0.1 s fades. The surface alone is no news of a body that stands still.
TEST_CASE("the surface of a body that stands still is not sent on, and that of one that goes again is", "[network]") {
  TissueNode node(sheet(), NoCutter<double>{});
  SurfaceNode<double> fast;
  std::uint64_t sequence = 0;
  auto const report = [&](double now) { return at(0.052, 0.051, -0.003 + 0.002 * std::sin(40 * now), ++sequence, now); };
  auto const sent = [&](double from, double until, bool ticks) {
    int count = 0;
    for (double now = from; now < until; now += 0.001) {
      HandReport const hand = report(now);
      node.take(hand, now);
      if (ticks) node.tick(0.001, now);
      fast.look(node.captured(), hand, now, 0.0015);
      count += fast.is_worth_sending(now);
    }
    return count;
  };
  CHECK(sent(0.0, 0.3, true) > 5);
  CHECK(sent(0.301, 0.395, false) > 1);   // a tick or two late is news still
  CHECK(sent(0.405, 2.0, false) == 0);
  CHECK(sent(2.0, 2.3, true) > 5);
}

// The servo's tick and all that it is given: a guard ends the program where one allocates, locks, waits, reads or writes. The clock's part is bench_network's.
TEST_CASE("C5-N4: the servo's tick on a network allocates and locks nothing, whatever arrives", "[network]") {
  TissueNode node(sheet(), NoCutter<double>{});
  SurfaceNode<double> fast;
  ServoLoop<ScriptedDevice<double>, SurfaceThenTissue<double>, double> servo(ScriptedDevice<double>({{0.0, {0.052, 0.051, 0.004}}, {0.3, {0.052, 0.051, -0.003}}, {0.7, {0.056, 0.051, 0.004}}}),
                                                                             SurfaceThenTissue<double>({.surface = {.static_friction = 0.3, .dynamic_friction = 0.2}}));
  servo.begin_session(100.0);
  RemoteTissue remote;
  HandReporter reporter({.fraction = 0.05});
  HandReport last;
  double most = 0.0;
  long const violations = palpate_test::guard_violations();
  for (int k = 0; k < 800; ++k) {
    double const now = 0.001 * k;
    if (k % 10 == 0) node.tick(0.01, now);
    palpate_test::ServoGuard const guard;
    servo.read(0.001);
    remote.placed(servo.pose_discontinuities());
    if (auto const report = reporter(servo.tool(), servo.pose_discontinuities(), remote, now)) last = *report, node.take(last, now);
    if (k % 10 == 0 && node.is_worth_sending(now)) remote.take(node.last(), now);
    fast.look(node.captured(), last, now, 0.015);
    if (fast.is_worth_sending(now)) {
      SurfaceAnswer answer = fast.look(node.captured(), last, now, 0.015);
      remote.take(answer, now);
      answer.patch.stiffness = 1e7, answer.stamp.sequence += k % 3 == 0 ? 0 : 1;
      if (k % 50 == 0) remote.take(answer, now);
    }
    most = std::max(most, servo.respond(remote.model(), now).force.norm());
  }
  CHECK(palpate_test::guard_violations() == violations);
  CHECK(most > 0.02);
}
