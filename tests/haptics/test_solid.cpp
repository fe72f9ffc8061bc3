// SPDX-License-Identifier: MIT
// What is felt of sheets and skins, felt of elastic solids: a block and a ball of tetrahedra that deform. Yardsticks: the stiffness of the same tetrahedra by
// Hooke's law, written down once more (tests/haptics/solid.hpp), Newton's statics, balances of forces and of energy, closed forms of planes and balls.
#include "catch.hpp"
#include "haptics/solid.hpp"

#include <palpate/core/random.hpp>
#include <palpate/cutting/no_cutter.hpp>
#include <palpate/device/limit.hpp>
#include <palpate/device/simulated_hand.hpp>
#include <palpate/device/trajectory.hpp>
#include <palpate/haptics/coupled_force.hpp>
#include <palpate/haptics/facet_planes.hpp>
#include <palpate/haptics/passivity.hpp>
#include <palpate/haptics/patch_handover.hpp>
#include <palpate/haptics/plane_handover.hpp>
#include <palpate/haptics/proxy_force.hpp>
#include <palpate/haptics/surface_fit.hpp>
#include <palpate/haptics/surface_proxy.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/simulator/body_loop.hpp>
#include <palpate/statics/newton_raphson.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

using namespace palpate;
using palpate_test::Solid;
using palpate_test::solid_ball;
using palpate_test::solid_block;

namespace {

using Vector = Vector3<double>;

/// A tip that is led over a solid in lock-step, and the work that is done with it.
template <class I, class R>
struct Palpation {
  BodyLoop<SoftBody<Solid::Tissue, I, R>, NoCutter<double>> loop;
  double stiffness;   // N/m, of the contact
  Vector tip;
  LocalModel<double> model{};
  double work = 0;   // J, of the hand
  double least = 0;  // J, of the work less the energy of the tissue

  Palpation(Solid const& solid, I integrator, R region, Vector const& from, ContactCoupling const& coupling = {.stiffness = 2000.0, .damping = 2.0})
      : loop(solid.body(integrator, region), NoCutter<double>{}, coupling, 100), stiffness(coupling.stiffness), tip(from) {}

  auto& body() { return loop.body(); }
  SurfaceContact<double> const& contact() const { return loop.cutter().contact(); }
  double energy() { return body().potential_energy() + body().kinetic_energy(); }
  /// How far the tip is below the touched point as it is now.
  double gap() {
    auto const corners = body().tissue().surface().corners(contact().triangle);
    Vector point = Vector::Zero();
    for (std::size_t c = 0; c < 3; ++c) point += contact().barycentric[static_cast<int>(c)] * body().positions().col(corners[c]);
    return (point - tip).dot(contact().normal);
  }
  void to(Vector const& next, double h) {
    model = loop.tick({.position = next, .velocity = (next - tip) / h}, h);
    work -= model.tissue_force.dot(next - tip);
    tip = next;
    least = std::min(least, work - energy());
  }
  Palpation& line(Vector const& end, int ticks, double h = 1e-3) {
    Vector const begin = tip;
    for (int k = 1; k <= ticks; ++k) to(begin + (end - begin) * (double(k) / ticks), h);
    return *this;
  }
  Palpation& wait(int ticks, double h = 0.005) {
    for (int k = 0; k < ticks; ++k) to(tip, h);
    return *this;
  }
};

/// A local model where the surface is nearest to a point, as plane or ball; its distance and normal there.
SurfacePatch<double> patch_at(auto& body, Vector const& p, SurfaceFit<double>& fit) {
  auto const nearest = body.nearest_point(p);
  return fit.fit(body, nearest.triangle, nearest.barycentric);
}

/// By how much the force on a tip that stays may change in a tick while this patch becomes that in so many.
double share_of(SurfacePatch<double> const& from, SurfacePatch<double> const& to, Vector const& tip, int ticks) {
  double const deep = std::max(std::abs(from.distance(tip)), std::abs(to.distance(tip))), stiff = std::max(from.stiffness, to.stiffness);
  double const turn = std::acos(std::min(1.0, from.normal_at(tip).dot(to.normal_at(tip))));
  return (stiff * std::abs(from.distance(tip) - to.distance(tip)) + deep * std::abs(from.stiffness - to.stiffness) + stiff * deep * turn) / ticks;
}

Vector const on_top(0.0031, 0.0021, 0.0);   // a place on top of the block, in the middle of nothing

}  // namespace

// Yardsticks: for a little way the contact's spring in series with Hooke's stiffness of the point; for a long one Newton's statics under the same force. At
// rest the nails bear what the tool presses with.
TEST_CASE("what a tip feels of a solid at rest is the static solution, and the nails bear it", "[haptics][solid]") {
  auto const settled = [](Solid const& solid, Vector const& from, double depth, auto region) {
    Palpation at(solid, BackwardEuler{}, region, from + Vector(0, 0, 2e-4));
    at.line(from - Vector(0, 0, depth), 40).wait(800);
    REQUIRE(at.contact().touching);
    Vector const force = at.model.tissue_force, n = at.contact().normal;
    auto const corners = at.body().tissue().surface().corners(at.contact().triangle);
    double const hooke = solid.stiffness_at(corners, at.contact().barycentric, n);
    INFO(depth << " m deep: " << force.norm() << " N, " << hooke << " N/m by Hooke's law");
    if (depth < 1e-4) CHECK(force.norm() == Approx(at.contact().depth / (1 / hooke + 1 / at.stiffness)).epsilon(5e-3));
    CHECK(force.dot(n) == Approx(at.stiffness * at.gap()).epsilon(1e-3));
    Vector nails = Vector::Zero();
    for (int const i : solid.base()) nails += at.body().reaction(i);
    CHECK((nails - force).norm() < 1e-3 * force.norm());   // up under the tissue, and up on the tool: the tissue is pressed between the two
    auto rests = solid.body(BackwardEuler{}, WholeBody{});
    for (std::size_t c = 0; c < 3; ++c) rests.apply_force(corners[c], -at.contact().barycentric[static_cast<int>(c)] * force);
    rests.solve_statics(NewtonRaphson{}, 1e-9);
    CHECK((rests.positions() - at.body().positions()).cwiseAbs().maxCoeff() < 2e-3 * depth);
    return force.norm();
  };
  for (double const depth : {5e-5, 4e-3}) {
    double const whole = settled(solid_block(), on_top, depth, WholeBody{});
    CHECK(settled(solid_block(), on_top, depth, ZoneOfInfluence{.rings = 12}) == Approx(whole).epsilon(1e-6));
    settled(solid_ball(5), {0, 0, 0.02}, depth, WholeBody{});
  }
}

// Yardstick: Hooke's stiffness of the touched point where all nodes outside so many rings are fixed: the fewer rings, the stiffer.
TEST_CASE("in a zone a solid is as stiff as with all else nailed, and let go it comes home and sleeps", "[haptics][solid]") {
  Solid const solid = solid_block(6);
  double before = std::numeric_limits<double>::infinity();
  for (int const rings : {1, 2, 3, 4}) {
    Palpation at(solid, BackwardEuler{}, ZoneOfInfluence{.rings = rings}, on_top + Vector(0, 0, 1e-4));
    at.line(on_top - Vector(0, 0, 5e-5), 30).wait(300);
    REQUIRE(at.contact().touching);
    auto const corners = at.body().tissue().surface().corners(at.contact().triangle);
    std::vector<char> moves(static_cast<std::size_t>(at.body().size()), 0);
    for (int const c : corners) moves[static_cast<std::size_t>(c)] = 1;
    for (int ring = 0; ring < rings; ++ring) moves = solid.around(moves);
    double const hooke = solid.stiffness_at(corners, at.contact().barycentric, at.contact().normal, moves);
    CAPTURE(rings, hooke);
    CHECK(at.model.tissue_force.norm() == Approx(5e-5 / (1 / hooke + 1 / at.stiffness)).epsilon(5e-3));
    CHECK(hooke < 0.999 * before);
    before = hooke;
    at.line(on_top + Vector(0, 0, 0.002), 50);
    CHECK_FALSE(at.contact().touching);
    int moving = 1;
    for (int k = 0; k < 2000 && moving > 0; ++k) moving = at.body().step(0.02).moving;
    CHECK(moving == 0);
    CHECK((at.body().positions() - solid.mesh.points).cwiseAbs().maxCoeff() < 1.01e-5 * at.body().mean_edge());   // where a zone lets a particle stop
  }
}

// Yardstick: the hand's work, Σ F·Δx, is never less than the energy of the tissue; pressed slowly and at rest it is that and the energy of the contact's
// spring, k g²/2, and little for its damper. Leapfrog takes nothing itself.
TEST_CASE("the work of a hand that presses a solid and lets go covers what the solid stores at every tick", "[haptics][solid]") {
  auto const press = [](auto integrator, auto region, double slack) {
    Palpation at(solid_block(), integrator, region, on_top + Vector(0, 0, 5e-4));
    at.line(on_top - Vector(0, 0, 0.004), 400);
    double const spring = at.stiffness * at.gap() * at.gap() / 2, stored = at.energy() + spring;
    INFO("work " << at.work << " J, stored " << stored << " J, of that in the spring " << spring << " J, in motion " << at.body().kinetic_energy() << " J");
    CHECK(stored > 3e-4);
    CHECK(at.work >= stored * (1 - 1e-3));
    CHECK(at.work <= stored * (1 + slack));
    at.wait(100, 1e-3);
    CHECK(at.least > -1e-9);
    double const deepest = at.work;
    at.line(on_top + Vector(0, 0, 0.002), 50).wait(200, 1e-3);
    CHECK_FALSE(at.contact().touching);
    CHECK(at.work < 0.9 * deepest);   // something came back
    CHECK(at.work > 0.0);             // not all
    CHECK(at.least > -1e-9);
    CHECK(at.energy() <= at.work);
  };
  press(BackwardEuler{}, WholeBody{}, 0.05);
  press(BackwardEuler{}, ZoneOfInfluence{.rings = 2}, 0.05);
  press(LeapfrogVerlet{}, WholeBody{}, 0.05);
  press(LeapfrogVerlet{}, ZoneOfInfluence{.rings = 2}, 0.05);
}

// Yardstick: the bar of the textbook, F = E A δ/L and F δ/2, exact for linear tetrahedra where ν = 0.
TEST_CASE("a solid in a grasp pulls with Young's modulus, and let go it gives no more than the grasp put in", "[haptics][solid]") {
  Solid solid = solid_block();
  solid.poisson = 0.0;
  double const height = 0.04, stretch = 1e-3, expected = solid.young * 0.04 * 0.04 * stretch;
  for (double const sign : {1.0, -1.0}) {
    auto body = solid.body(BackwardEuler{}, WholeBody{});
    std::vector<int> top;
    for (int i = 0; i < body.size(); ++i)
      if (solid.mesh.points(2, i) > -1e-9) top.push_back(i);
    double work = 0, force = 0, least = 0;
    for (int k = 1; k <= 300; ++k) {
      double const rise = sign * stretch * height * std::min(k, 200) / 200, way = k <= 200 ? sign * stretch * height / 200 : 0.0;
      for (int const i : top) body.drag(i, Vector(solid.mesh.points.col(i)) + Vector(0, 0, rise), {0, 0, way / 0.005});
      body.step(0.005);
      double const last = force;
      force = 0;
      for (int const i : top) force += body.reaction(i).z();
      work += (last + force) / 2 * way;
    }
    CHECK(force == Approx(sign * expected).epsilon(2e-3));
    CHECK(work == Approx(expected * stretch * height / 2).epsilon(0.05));
    CHECK(body.potential_energy() == Approx(expected * stretch * height / 2).epsilon(2e-3));
    Vector nails = Vector::Zero();
    for (int const i : solid.base()) nails += body.reaction(i);
    CHECK((nails + Vector(0, 0, force)).norm() < 1e-3 * expected);
    for (int const i : top) body.drag(i, body.positions().col(i)), body.release(i);
    for (int k = 0; k < 400; ++k) {
      body.step(1e-3);
      least = std::min(least, work - body.potential_energy() - body.kinetic_energy());
    }
    CHECK(least > -1e-3 * work);
    CHECK(body.potential_energy() + body.kinetic_energy() < 0.9 * work);
  }
}

namespace {

struct BallSlide {
  double jump = 0, step = 0, error = 0;   // N: from a patch to the next at the same tip, the largest in a tick, from the ball's own force
};

/// A tool slides 1 mm below the sphere that a solid ball's nodes lie on. The patch that is fitted to the solid is there a frame later.
BallSlide slide_over(auto& body, double speed, int frame, bool curved, int blend) {
  constexpr double radius = 0.02, deep = 0.001, stiffness = 500.0;
  PatchHandover<double> handover({.ticks = blend});
  SurfaceFit<double> fit({.rings = 1, .stiffness = stiffness});
  auto const normal = [&](int tick) {
    double const angle = std::max(0, tick) * 0.001 * speed / (radius - deep);
    return Vector(0.6 * std::sin(angle), 0.8 * std::sin(angle), std::cos(angle));
  };
  BallSlide felt;
  SurfacePatch<double> last;
  Vector force = Vector::Zero();
  std::uint64_t sequence = 0;
  for (int tick = -5 * frame; tick < 8 * frame; ++tick) {
    Vector const tip = (radius - deep) * normal(tick);
    if (tick % frame == 0) {
      auto patch = patch_at(body, radius * normal(tick - frame), fit).anchored_at(radius * normal(tick - frame));
      if (!curved) patch.curvature = 0;
      handover.take(patch, ++sequence, tip);
      body.step(1e-3 * frame);
    }
    auto const now = handover(tip);
    Vector const pulls = now.force(tip);
    if (tick > 0) {
      felt.jump = std::max(felt.jump, (pulls - last.force(tip)).norm());
      felt.step = std::max(felt.step, (pulls - force).norm());
      felt.error = std::max(felt.error, (last.force(tip) - stiffness * deep * normal(tick)).norm());
    }
    last = now;
    force = pulls;
  }
  return felt;
}

}  // namespace

// Yardsticks: the table of haptics/README.md, 3 K (v τ)²/2R and the turn; the sphere itself.
TEST_CASE("C4-L1 C4-L2 C4-L3: late planes of a solid ball jump as those of a sphere, balls fitted to it have its force and no step", "[haptics][solid]") {
  auto body = solid_ball(7).body(BackwardEuler{}, WholeBody{});
  struct Row {
    double speed;
    int rate;
    double jump, blended, ball, error;
  };
  for (Row const& row : {Row{0.05, 30, 0.118, 0.0043, 0.0013, 0.175}, Row{0.10, 30, 0.446, 0.0170, 0.0026, 0.627},
                         Row{0.10, 60, 0.116, 0.0085, 0.0026, 0.174}, Row{0.10, 120, 0.034, 0.0042, 0.0026, 0.057}}) {
    int const frame = 1000 / row.rate;
    auto const plane = slide_over(body, row.speed, frame, false, 1), blended = slide_over(body, row.speed, frame, false, frame);
    auto const ball = slide_over(body, row.speed, frame, true, frame);
    CAPTURE(row.speed, row.rate);
    CHECK(plane.jump == Approx(row.jump).epsilon(0.1));
    CHECK(blended.step == Approx(row.blended).epsilon(0.1));
    CHECK(ball.step == Approx(row.ball).epsilon(0.1));
    CHECK(plane.error == Approx(row.error).epsilon(0.1));
    CHECK(ball.error < 1e-9);   // N; what a fit of six steps leaves of 20 mm
    CHECK(ball.jump < 1e-9);
  }
  CHECK(std::log2(slide_over(body, 0.1, 32, false, 1).jump / slide_over(body, 0.1, 16, false, 1).jump) == Approx(1.9).margin(0.1));
  Palpation flat(solid_block(), BackwardEuler{}, WholeBody{}, Vector(0, 0, 0.01));   // and on the block's top a plane: K d
  SurfaceFit<double> fit;
  for (double x = -0.009; x < 0.0095; x += 0.0011) {
    auto const patch = patch_at(flat.body(), {x, 0.3 * x, 0.0}, fit);
    CHECK((patch.force({x, 0.3 * x, -0.001}) - Vector(0, 0, 0.5)).norm() < 1e-12);
  }
}

// Yardstick: the same patches, handed over at once: the steps that are left are an N-th part of those and what the tip's way makes.
TEST_CASE("C4-L1 C4-L8: on a solid that is dabbed and stroked, models of 60 Hz a frame late give no step with a hand-over", "[haptics][solid]") {
  constexpr int frame = 16;
  constexpr double stiffness = 500.0;
  auto const stroke = [](auto integrator, Solid const& solid, Vector const& top) {
    Palpation at(solid, integrator, WholeBody{}, top + Vector(-0.008, 0, 0.003), {.stiffness = stiffness, .damping = 1.0});
    at.loop.sense_surface(SurfaceKind::ball);
    PatchHandover<double> smooth({.ticks = frame}), sudden({.ticks = 1});
    std::vector<SurfacePatch<double>> seen(2);   // this one is known to the servo, that one comes next
    Vector felt = Vector::Zero(), abrupt = Vector::Zero();
    double largest = 0, without = 0, beyond = 0, strongest = 0, share = 0;
    std::uint64_t sequence = 0;
    int contacts = 0;
    bool touched = false;
    for (int k = 0; k < 800; ++k) {
      double const t = 1e-3 * k;
      Vector const tip = top + Vector(-0.008 + 0.02 * t, 0.002 * std::sin(9 * t), 0.001 - 0.003 * std::sin(12 * t));
      Vector const way = tip - at.tip;
      at.to(tip, 1e-3);
      if (at.contact().touching && !touched) ++contacts;
      touched = at.contact().touching;
      if (k % frame == 0) {
        seen = {seen[1], at.model.surface.patch};
        ++sequence;
        if (sequence > 2) {
          SurfacePatch<double> const now = smooth(tip);   // a tick more for both
          sudden(tip);
          smooth.take(seen[0], sequence, tip);
          sudden.take(seen[0], sequence, tip);
          SurfacePatch<double> to = seen[0], from = now;
          if (!(to.stiffness > 0)) to = now, to.stiffness = 0;
          if (!(from.stiffness > 0)) from = to, from.stiffness = 0;
          share = share_of(from, to, tip, frame);
        }
      }
      Vector const next = smooth(tip).force(tip), at_once = sudden(tip).force(tip);
      double const step = (next - felt).norm();
      if (sequence > 2 && k > 4 * frame) {
        largest = std::max(largest, step), without = std::max(without, (at_once - abrupt).norm());
        beyond = std::max(beyond, step - 2 * share - 2 * stiffness * way.norm());
        strongest = std::max(strongest, next.norm());
      }
      felt = next, abrupt = at_once;
    }
    CAPTURE(largest, without, beyond, strongest, contacts);
    CHECK(contacts >= 2);
    CHECK(strongest > 0.05);
    CHECK(beyond <= 1e-9);
    CHECK(largest < without / 2);
  };
  stroke(BackwardEuler{}, solid_block(), {0, 0, 0});
  stroke(LeapfrogVerlet{}, solid_block(), {0, 0, 0});
  stroke(BackwardEuler{}, solid_ball(5), {0, 0, 0.0195});
}

// Yardstick: to the bit, what was felt before.
TEST_CASE("C4-L4: a solid that rests gives the same model again, and the force changes by no bit", "[haptics][solid]") {
  auto const rest = [](auto integrator, auto region, Solid const& solid, Vector const& top) {
    auto body = solid.body(integrator, region);
    SurfaceFit<double> fit;
    PatchHandover<double> handover({.ticks = 16});
    Vector const tip = top - Vector(0, 0, 0.001);
    std::uint64_t sequence = 0;
    handover.take(patch_at(body, top, fit), ++sequence, tip);
    for (int k = 0; k < 20; ++k) handover(tip);
    Vector const felt = handover(tip).force(tip);
    CHECK(felt.norm() == Approx(0.5).epsilon(0.05));
    bool same = true;
    for (int k = 0; k < 100; ++k) {
      body.step(1e-3);
      if (k % 16 == 0) handover.take(patch_at(body, top, fit), ++sequence, tip);
      same = same && handover(tip).force(tip) == felt;
    }
    CHECK(same);
    CHECK(sequence == 8);
  };
  for (Solid const& solid : {solid_block(), solid_ball(5)}) {
    Vector const top(0.0007, 0.0003, solid.mesh.points.row(2).maxCoeff());
    rest(LeapfrogVerlet{}, ZoneOfInfluence{.rings = 2}, solid, top);
    rest(BackwardEuler{}, ZoneOfInfluence{.rings = 2}, solid, top);
  }
}

// Yardstick: at a tip that stays the force changes in a tick by no more than the N-th part of what the next model changes.
TEST_CASE("C4-L5: models of a solid that is pressed may come at any time, twice and in any order", "[haptics][solid]") {
  constexpr int ticks = 33;
  Palpation at(solid_block(), BackwardEuler{}, WholeBody{}, on_top + Vector(0, 0, 0.001), {.stiffness = 500.0, .damping = 1.0});
  at.loop.sense_surface(SurfaceKind::ball);
  std::vector<SurfaceModel<double>> models;
  for (int k = 0; k < 600; ++k) {
    at.to(on_top + Vector(0.003 * std::sin(0.01 * k), 0.002 * std::sin(0.013 * k), 1e-3 - 5e-3 * std::min(1.0, k / 50.0) + 0.002 * std::sin(0.021 * k)), 1e-3);
    if (at.model.phase == CuttingPhase::indenting) models.push_back(at.model.surface);
  }
  REQUIRE(models.size() > 400);
  Random random(Seed{3});
  double strongest = 0;
  for (int round = 0; round < 20; ++round) {
    PatchHandover<double> handover({.ticks = ticks});
    Vector const tip = on_top - Vector(0, 0, 0.006);
    std::size_t newest = random.below(40), next = newest;
    handover.take(models[newest].patch, models[newest].sequence, tip);
    SurfacePatch<double> none = models[newest].patch, last = none;
    none.stiffness = 0;
    double allowed = share_of(none, last, tip, ticks);
    last = handover(tip);
    for (std::size_t k = 0; k + 100 < models.size(); ++k) {
      if (k == next && newest < k) {
        newest = k;
        allowed = share_of(last, models[newest].patch, tip, ticks);
        REQUIRE(handover.take(models[newest].patch, models[newest].sequence, tip));
        REQUIRE_FALSE(handover.take(models[newest].patch, models[newest].sequence, tip));
        REQUIRE_FALSE(handover.take(models[newest - 1].patch, models[newest - 1].sequence, tip));
      }
      if (k >= next) next = k + 1 + random.below(100);
      SurfacePatch<double> const now = handover(tip);
      REQUIRE((now.force(tip) - last.force(tip)).norm() <= allowed * (1 + 1e-9) + 1e-12);
      last = now;
    }
    strongest = std::max(strongest, last.force(tip).norm());
    for (int k = 0; k < ticks; ++k) handover(tip);
    CHECK(handover(tip) == models[newest].patch);   // after N ticks it is the newest, exactly
    CHECK(handover.dropped() > 0);
  }
  CHECK(strongest > 0.5);
}

// Yardstick: a quarter turn of the normal from the top of the block to its side, in even parts; half a turn to its underside is another contact.
TEST_CASE("C4-L6: from the top of a solid to its side the normal turns evenly, its underside is another contact", "[haptics][solid]") {
  Solid slab = solid_block();
  slab.mesh.points.row(2) /= 10;   // 4 mm thick
  auto body = slab.body(BackwardEuler{}, WholeBody{});
  auto cube = solid_block().body(BackwardEuler{}, WholeBody{});
  SurfaceFit<double> flat({.rings = 0, .curved = false});
  double const angle = std::acos(0.0);
  PatchHandover<double> turns({.ticks = 30});
  Vector const edge(0.019, 0, -0.001);
  turns.take(patch_at(cube, {0.001, 0.002, 0}, flat), 1, {0, 0, 0.001});
  turns.take(patch_at(cube, {0.02, 0.002, -0.021}, flat), 2, edge);
  for (int k = 1; k <= 30; ++k) {
    auto const now = turns(edge);
    CHECK((now.normal_at(edge) - Vector(std::sin(angle * k / 30), 0, std::cos(angle * k / 30))).norm() < 1e-9);
    CHECK(now.force(edge).norm() == Approx(0.5));
  }
  PatchHandover<double> other({.ticks = 40});
  Vector const tip(0.001, 0.002, -0.001);   // 1 mm below the top, 3 mm above the underside
  other.take(patch_at(body, {0.001, 0.002, 0}, flat), 1, {0.001, 0.002, 0.001});
  other(tip);
  other.take(patch_at(body, {0.001, 0.002, -0.004}, flat), 2, tip);
  for (int k = 1; k <= 40; ++k) {
    double const expected = k < 20 ? 0.5 * (1 - k / 20.0) : -1.5 * (k / 20.0 - 1);
    Vector const force = other(tip).force(tip);
    CHECK((force - Vector(0, 0, expected)).norm() < 1e-9);
  }
}

// Yardstick: the spring's energy ½ K (d₂² − d₁²) = 0.75 mJ, which comes from nowhere when a solid that is lifted as a whole comes 1 mm up under the tip.
TEST_CASE("C4-L7: a solid that rises under the tip gives the hand energy, which the observer finds, and the step is shared by the ticks", "[haptics][solid]") {
  Solid solid = solid_block();
  std::vector<int> const base = solid.base();
  solid.nailed_below = -1.0;   // held instead
  for (int const ticks : {1, 33}) {
    auto body = solid.body(BackwardEuler{}, WholeBody{});
    for (int const i : base) body.hold(i);
    SurfaceFit<double> fit({.stiffness = 500.0});
    PatchHandover<double> handover({.ticks = ticks});
    PassivityController<double> observer({.max_damping = 0.0});
    double largest = 0, height = 0.0005;
    Vector last = Vector::Zero();
    auto const tick = [&] {
      Vector const tip = on_top + Vector(0, 0, height), force = handover(tip).force(tip);
      observer(tip, force);
      observer.sent(force);
      largest = std::max(largest, (force - last).norm());
      last = force;
    };
    handover.take(patch_at(body, on_top, fit), 1, on_top + Vector(0, 0, height));
    for (; height > -0.001; height -= 1e-7) tick();
    CHECK(observer.energy() == Approx(0.5 * 500 * 1e-6).epsilon(1e-3));
    for (int const i : base) body.drag(i, Vector(solid.mesh.points.col(i)) + Vector(0, 0, 0.001));
    body.solve_statics(NewtonRaphson{}, 1e-9);
    CHECK(body.potential_energy() < 1e-12);   // as a whole
    handover.take(patch_at(body, on_top + Vector(0, 0, 0.001), fit), 2, on_top + Vector(0, 0, height));
    largest = 0;
    for (int k = 0; k < 40; ++k) tick();
    CHECK(largest == Approx(0.5 / ticks).epsilon(5e-3));
    CHECK(last.z() == Approx(1.0).epsilon(1e-3));
    for (; height < 0.0015; height += 1e-7) tick();
    CHECK(observer.energy() == Approx(-0.75e-3).epsilon(1e-3));
  }
}

namespace {

/// A block with a groove along y in its top, z = slope · |x|, the same on both sides.
Solid grooved(double slope) {
  Solid solid = solid_block(7);
  for (Eigen::Index i = 0; i < solid.mesh.points.cols(); ++i) solid.mesh.points(2, i) += slope * std::abs(solid.mesh.points(0, i)) * (1 + solid.mesh.points(2, i) / 0.04);
  return solid;
}

/// A cube of 4 cm around the origin without the eighth where x, y and z are above zero: an inner corner, and edges that stick out.
Solid cornered() {
  Solid solid{make_block<double>(7, 7, 7, 0.04 / 6, BlockPattern::alternating), -0.0199};
  auto& mesh = solid.mesh;
  mesh.points.array() -= 0.02;
  std::vector<int> place(static_cast<std::size_t>(mesh.points.cols()), -1);
  int points = 0;
  Eigen::Index kept = 0;
  for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t) {
    Vector middle = Vector::Zero();
    for (int c = 0; c < 4; ++c) middle += mesh.points.col(mesh.tetrahedra(c, t)) / 4;
    if (middle.minCoeff() > 0) continue;
    mesh.tetrahedra.col(kept++) = mesh.tetrahedra.col(t);
    for (int c = 0; c < 4; ++c) place[static_cast<std::size_t>(mesh.tetrahedra(c, t))] = 0;
  }
  mesh.tetrahedra.conservativeResize(4, kept);
  for (std::size_t i = 0; i < place.size(); ++i)
    if (place[i] == 0) mesh.points.col(place[i] = points++) = Vector(mesh.points.col(static_cast<Eigen::Index>(i)));
  mesh.points.conservativeResize(3, points);
  for (Eigen::Index t = 0; t < kept; ++t)
    for (int c = 0; c < 4; ++c) mesh.tetrahedra(c, t) = place[static_cast<std::size_t>(mesh.tetrahedra(c, t))];
  return solid;
}

PlaneSet<double> planes_at(auto& body, Vector const& tip) { return facet_planes(body, body.nearest_point(tip).triangle, tip, 0.0, tip); }

}  // namespace

// Yardstick: the bottom line of the groove, which both sides hold the tip on; the plane alone that it is deepest in throws it from side to side.
TEST_CASE("C4-L9: in a groove of a solid that yields the force does not change sides", "[haptics][solid]") {
  constexpr double stiffness = 500.0;
  Solid firm = grooved(0.75);
  firm.young = 1e5;   // the contact presses one side at a time: what is much softer than it goes aside itself
  Palpation at(firm, BackwardEuler{}, ZoneOfInfluence{.rings = 3}, {0.0002, 0.001, 0.003}, {.stiffness = stiffness, .damping = 1.0});
  at.loop.sense_surface(SurfaceKind::facets);
  PlaneHandover<double> handover({.ticks = 16});
  SurfaceProxy<double> proxy({.stiffness = stiffness});
  double aside = 0, alone_aside = 0, deepest_force = 0;
  int two = 0, models = 0;
  for (int k = 0; k < 900; ++k) {
    Vector const tip(1.5e-4 * std::sin(0.05 * k), 0.001 + 0.002 * std::sin(0.004 * k), k < 200 ? 0.003 - 2.5e-5 * k : -0.002);
    at.to(tip, 1e-3);
    auto const& planes = at.model.surface.planes;
    if (k % 16 == 0) handover.take(planes, at.model.surface.stiffness(), static_cast<std::uint64_t>(k + 1), tip);
    auto const felt = handover(tip);
    Vector const force = proxy(felt, tip, handover.stiffness());
    if (k < 300) continue;
    ++models;
    if (planes.count() >= 2) ++two;
    int deep = 0;
    for (int i = 1; i < felt.count(); ++i)
      if (felt[i].distance(tip) < felt[deep].distance(tip)) deep = i;
    aside = std::max(aside, std::abs(force.x()) / force.z());
    if (felt.count() > 0) alone_aside = std::max(alone_aside, std::abs(felt[deep].normal.x()) / felt[deep].normal.z());
    deepest_force = std::max(deepest_force, force.norm());
  }
  CAPTURE(aside, alone_aside, deepest_force, two, models);
  CHECK(two == models);
  CHECK(deepest_force > 0.01);
  CHECK(aside < 0.3);
  CHECK(alone_aside > 0.5);
}

// Yardsticks by hand, of a solid whose faces are known; of one that is pressed, the conditions of Karush, Kuhn and Tucker, and a spring's own slope.
TEST_CASE("C2-P1 C2-P2 C2-P3 C2-P4 C2-P5 C2-P7: on a face, in an edge and in a corner of a solid the proxy is the nearest point in front", "[haptics][solid]") {
  Solid const solid = cornered();
  auto body = solid.body(BackwardEuler{}, WholeBody{});
  struct Case {
    Vector tip, point;
    int planes;
  };
  double const mm = 1e-3;
  for (Case const& c : {Case{{-mm, -2 * mm, -3 * mm}, {0, 0, 0}, 3}, Case{{mm, -2 * mm, -3 * mm}, {mm, 0, 0}, 2}, Case{{mm, 2 * mm, -3 * mm}, {mm, 2 * mm, 0}, 1}}) {
    auto const found = planes_at(body, c.tip).project(c.tip);
    CHECK(found.count == c.planes);
    CHECK((found.point - c.point).norm() < 1e-12);
    SurfaceProxy<double> proxy({.stiffness = 500.0});
    CHECK((proxy(planes_at(body, c.tip), c.tip) - 500.0 * (c.point - c.tip)).norm() < 1e-9);
  }
  // The facets around a node of a face lie in one plane up to what statics leave of it: together they push as one.
  auto settled = solid.body(BackwardEuler{}, WholeBody{});
  for (int const i : solid.base()) settled.drag(i, Vector(solid.mesh.points.col(i)) + Vector(1e-4, 0, 0));   // nailed there: it is carried aside as a whole
  settled.solve_statics(NewtonRaphson{}, 1e-9);
  int node = -1;
  for (int i = 0; i < settled.size(); ++i)
    if ((Vector(solid.mesh.points.col(i)) - Vector(0.04 / 3, 0.04 / 3, 0)).norm() < 1e-9) node = i;
  REQUIRE(node >= 0);
  PlaneSet<double> coincide;
  for (int const t : settled.tissue().surface().triangles_at(node)) {
    auto const c = settled.tissue().surface().corners(t);
    Vector const a = settled.positions().col(c[0]), b = settled.positions().col(c[1]), d = settled.positions().col(c[2]), n = (b - a).cross(d - a).normalized();
    coincide.try_add({n, n.dot(a)});
  }
  CHECK(coincide.count() >= 4);
  Vector const below(0.013, 0.0135, -0.002);
  CHECK((coincide.project(below).point - Vector(0.013, 0.0135, 0)).norm() < 1e-6);

  // Pressed into the corner the three faces bend.
  Solid firm = solid;
  firm.young = 1e5;
  Palpation at(firm, BackwardEuler{}, WholeBody{}, {0.002, 0.0018, 0.002}, {.stiffness = 500.0, .damping = 1.0});
  at.loop.sense_surface(SurfaceKind::facets);
  at.line({-0.002, -0.0018, -0.0025}, 100).wait(50, 1e-3);
  REQUIRE(at.contact().touching);
  Random random(Seed{4});
  int most = 0;
  double steepest = 0;
  for (int round = 0; round < 200; ++round) {
    Vector const tip = at.tip + 1e-3 * Vector(random.normal(), random.normal(), random.normal());
    auto const planes = planes_at(at.body(), tip);
    REQUIRE(planes.count() > 0);
    auto const held = planes.project(tip);
    most = std::max(most, held.count);
    Vector pushed = tip;
    for (int k = 0; k < held.count; ++k) {
      auto const i = static_cast<std::size_t>(k);
      REQUIRE(held.multiplier[i] >= -1e-12);
      REQUIRE(std::abs(planes[held.active[i]].distance(held.point)) < 1e-12);
      pushed += held.multiplier[i] * planes[held.active[i]].normal;
    }
    REQUIRE((pushed - held.point).norm() < 1e-12);
    for (int k = 0; k < 200; ++k) {
      Vector const other = held.point + 2e-3 * Vector(random.normal(), random.normal(), random.normal());
      bool in_front = true;
      for (int i = 0; i < planes.count(); ++i) in_front = in_front && planes[i].distance(other) >= 0;
      REQUIRE((!in_front || (other - tip).norm() >= (held.point - tip).norm() - 1e-12));
    }
    Vector const near = tip + 1e-5 * Vector(random.normal(), random.normal(), random.normal());
    steepest = std::max(steepest, ((planes.project(near).point - near) - (held.point - tip)).norm() / (near - tip).norm());
  }
  CHECK(most == 3);
  CHECK(steepest <= 1 + 1e-9);
  CHECK(steepest > 0.9);
}

// Yardstick: the side it came from: the force never pulls it on through.
TEST_CASE("C2-P6: a plate of tissue of 0.1 mm is not passed at 1 m/s", "[haptics][solid]") {
  Solid plate{make_block<double>(9, 9, 2, 0.005, BlockPattern::alternating), -1.0};
  plate.mesh.points.colwise() -= Vector(0.02, 0.02, 0);
  plate.mesh.points.row(2) *= 0.0001 / 0.005;
  plate.young = 1e6;
  for (double const aside : {0.0, 0.006}) {
    auto tissue = plate.tissue();
    for (int i = 0; i < tissue.size(); ++i)
      if (plate.mesh.points.col(i).head<2>().cwiseAbs().maxCoeff() > 0.0199) tissue.nail(i);
    BodyLoop loop(SoftBody(std::move(tissue), BackwardEuler{}, WholeBody{}), NoCutter<double>{}, ContactCoupling{.stiffness = 500.0, .damping = 0.5}, 100);
    loop.sense_surface(SurfaceKind::plane);
    ProxyForce<double> force({.surface = SurfaceKind::plane, .max_stiffness = 500.0, .handover = 1});
    force.begin_session(1000.0, 1000.0);
    double least = 0, most = 0;
    for (int k = 0; k < 14; ++k) {
      Vector const tip(0.0011 + aside, 0.0007, 0.0045 - 1e-3 * k);
      auto const model = loop.tick({.position = tip, .velocity = {0, 0, -1.0}}, 1e-3);
      Vector const felt = force.on_surface(model, {.tip = tip, .velocity = {0, 0, -1.0}, .continues = true});
      CHECK(loop.cutter().contact().touching == (tip.z() < 1e-4));
      if (loop.cutter().contact().touching) CHECK(loop.cutter().contact().normal.z() == Approx(1.0));
      least = std::min(least, felt.z()), most = std::max(most, felt.z());
    }
    CHECK(least >= 0.0);
    CHECK(most > 0.3);
  }
}

// Yardstick: K d, what was felt before: at the edge of a solid's top the force is let go, never turned inward, and a hand-over shares the fall.
TEST_CASE("C2-P8: over the outer edge of a solid the force is let go, not turned", "[haptics][solid]") {
  constexpr double stiffness = 500.0;
  for (int const ticks : {1, 20}) {
    Palpation at(solid_block(), BackwardEuler{}, WholeBody{}, {0.0091, 0.0013, 0.001}, {.stiffness = stiffness, .damping = 1.0});
    at.loop.sense_surface(SurfaceKind::plane);
    ProxyForce<double> force({.surface = SurfaceKind::plane, .max_stiffness = stiffness, .release = 0.0, .handover = ticks});
    force.begin_session(1000.0, 1000.0);
    Vector last = Vector::Zero();
    double fall = 0, strongest = 0, inward = 0, after = 1e9;
    int beyond = 0;
    for (int k = 0; k < 500; ++k) {
      Vector const tip = k < 100 ? Vector(0.0091, 0.0013, 0.001 - 3e-5 * k) : Vector(0.0091 + 5e-5 * (k - 100), 0.0013, -0.002);
      Vector const velocity = (tip - at.tip) / 1e-3;
      at.to(tip, 1e-3);
      Vector const felt = force.on_surface(at.model, {.tip = tip, .velocity = velocity, .continues = true});
      strongest = std::max(strongest, felt.norm());
      fall = std::max(fall, (last - felt).norm());
      if (tip.x() > 0.0205) inward = std::max(inward, -felt.x());
      if (tip.x() > 0.0225) ++beyond, after = felt.norm();
      last = felt;
    }
    CAPTURE(ticks, strongest, fall, inward, after);
    CHECK(strongest > 0.04);
    CHECK(beyond > 50);
    CHECK(after == 0.0);
    CHECK(inward < 1e-9);
    CHECK(fall <= 1.1 * strongest / (ticks == 1 ? 1 : ticks / 2) + stiffness * 5e-5);
  }
}

// Yardstick: the solid at rest: one that flies as a whole carries the proxy in its friction, and the force is the same.
TEST_CASE("C2-P9: a solid that moves carries the proxy", "[haptics][solid]") {
  Solid solid = solid_block();
  solid.nailed_below = -1.0;
  Vector const flies(0.03, -0.02, 0.05);   // m/s, for 200 ms: 12 mm
  auto const feel = [&](bool moves) {
    auto body = solid.body(LeapfrogVerlet{}, WholeBody{});
    auto state = body.save();
    for (int i = 0; i < body.size(); ++i) state.particles.velocity[i] = moves ? flies : Vector(Vector::Zero());
    body.restore(state);
    int const triangle = body.nearest_point(on_top).triangle;
    Vector const weights(0.2, 0.5, 0.3);
    SurfaceFit<double> fit;
    ProxyForce<double> force({.surface = SurfaceKind::plane, .max_stiffness = 500.0, .static_friction = 0.5, .dynamic_friction = 0.3, .handover = 1});
    force.begin_session(1000.0, 1000.0);
    LocalModel<double> model;
    model.phase = CuttingPhase::indenting;
    std::vector<Vector> felt;
    for (int k = 0; k < 200; ++k) {
      model.surface.patch = fit.fit(body, triangle, weights);
      model.surface.sequence = static_cast<std::uint64_t>(k + 1);
      Vector const tip = on_top + Vector(4e-6 * k, 0, -0.001) + (moves ? 1e-3 * k : 0.0) * flies;
      felt.push_back(force.on_surface(model, {.tip = tip, .velocity = flies, .seconds = 0.001, .continues = true}));
      body.step(1e-3);
    }
    return felt;
  };
  auto const rests = feel(false), moving = feel(true);
  double worst = 0;
  for (std::size_t k = 0; k < rests.size(); ++k) worst = std::max(worst, (rests[k] - moving[k]).norm());
  CHECK(rests.back().z() == Approx(0.5));
  CHECK(-rests.back().x() == Approx(0.3 * 0.5).epsilon(1e-6));   // it has stuck first, and slides at last
  CHECK(rests[60].x() == Approx(-500.0 * 60 * 4e-6).epsilon(1e-6));
  CHECK(worst < 1e-7);
}

namespace {

/// A hand that presses a solid through a proxy, holds and lets the device go; the body ticks with the servo, or `every` so many ticks and a frame late.
struct Held {
  double stiffness = 400.0;      // N/m, of contact and proxy
  int every = 1;
  double max_damping = 0.0;      // N·s/m; 0: observed alone
  double device_damping = 0.0;   // N·s/m, that the controller knows of
  double before = 0.0;           // J, taken beforehand
  double lets_go_at = 0.7;       // s
  double max_force = 1e9;        // N
  bool elastic = true;           // the controller is told what the proxy's spring holds
  double young = 3000.0;
  double press = 0.01;           // m, that the hand means to go below the surface

  double least = 0, end = 0;                // J, taken from the hand: the least, and at the end
  double taken = 0;                         // J, the most
  double sum_sent = 0, sum_wanted = 0;      // J, added up beside it
  double swing = 0, strongest = 0;          // m peak to peak over the last 150 ms of holding; N
  double out = 0;                           // J, of the device's motion when it is in the air again
  double largest_damping = 0;
  std::uint64_t damped = 0;
  int first_damped = -1;
  bool still_touching = false;

  template <class I, class R>
  Held& run(I integrator, R region, double seconds = 1.0) {
    Solid solid = solid_block();
    solid.young = young;
    BodyLoop loop(solid.body(integrator, region), NoCutter<double>{}, ContactCoupling{.stiffness = stiffness, .damping = 1.0}, 100);
    ProxyForce<double> proxy({.surface = SurfaceKind::ball, .max_stiffness = stiffness});
    loop.sense_surface(proxy.surface_kind());
    proxy.begin_session(1000.0, 1000.0 / every);
    SimulatedHand<double> device(Trajectory<double>::start(on_top + Vector(0, 0, 0.005)).line(on_top - Vector(0, 0, press), 0.3).hold(10.0),
                                 {.hand = {.mass = 0.15, .damping = 2.0, .stiffness = 100.0, .lets_go_at = lets_go_at}, .max_force = max_force, .mass = 0.075, .damping = 0.1});
    PassivityController<double> controller({.max_damping = max_damping, .device_damping = device_damping});
    DeviceState<double> state;
    device.read(state);
    controller(state.position + Vector(0, 0, before), Vector::Zero());
    controller.sent({0, 0, 1});
    controller(state.position, Vector::Zero());
    controller.sent(Vector::Zero());
    double const begin = controller.energy();
    LocalModel<double> model, next;
    Vector last = state.position, sent = Vector::Zero(), wanted = Vector::Zero(), seen = state.position;
    double low = 1, high = -1;
    for (int k = 0; k < static_cast<int>(1000 * seconds); ++k) {
      if (k > 0) device.read(state);
      if (k % every == 0) {
        if (every > 1) model = next;   // it took a frame
        next = loop.tick({.position = state.position, .velocity = (state.position - seen) / (1e-3 * every)}, 1e-3 * every);
        seen = state.position;
        if (every == 1) model = next;
      }
      sum_sent -= sent.dot(state.position - last), sum_wanted -= wanted.dot(state.position - last), last = state.position;
      wanted = proxy.on_surface(model, {.tip = state.position, .velocity = state.velocity, .seconds = 1e-3, .continues = true});
      double const stored = elastic ? (proxy.proxy().position() - state.position).squaredNorm() * stiffness / 2 : 0.0;
      sent = limited(controller(state.position, wanted, stored), max_force);
      controller.sent(sent);
      device.write({.force = sent});
      largest_damping = std::max(largest_damping, controller.damping());
      if (first_damped < 0 && controller.damped() > 0) first_damped = k;
      least = std::min(least, controller.energy() - begin), taken = std::max(taken, controller.energy() - begin);
      strongest = std::max(strongest, sent.norm());
      double const t = 1e-3 * k;
      if (t > lets_go_at - 0.15 && t < lets_go_at) low = std::min(low, state.position.z()), high = std::max(high, state.position.z());
    }
    swing = high - low;
    end = controller.energy() - begin;
    damped = controller.damped();
    out = 0.075 / 2 * device.velocity().squaredNorm();
    still_touching = loop.cutter().contact().touching;
    return *this;
  }
};

}  // namespace

// Yardstick: the printed losses of walls of this stiffness with a damping of 11 N·s/m (haptics/test_passivity_walls.cpp), 0.08 and 0.84 mJ, and what the same
// solid gives without the controller. Slow pressing and holding needs none, up to 1 kN/m.
TEST_CASE("C8-O2 C8-O3 C8-O4: a hand that presses a solid, holds and lets go gets no more than it gave", "[haptics][solid]") {
  auto const press = [](Held hand, double bound, auto integrator, auto region) {
    Held alone = hand, damped = hand;
    alone.max_damping = 0.0, damped.max_damping = 11.0;
    alone.run(integrator, region), damped.run(integrator, region);
    CAPTURE(hand.stiffness, hand.every, alone.least, damped.least, alone.swing, damped.swing);
    CHECK(damped.taken > 1e-4);
    CHECK(damped.least > -bound);
    CHECK(damped.largest_damping <= 11.0);
    if (hand.every == 1) CHECK(alone.least < 3 * damped.least - 3e-4);
    if (hand.stiffness < 1001) {
      CHECK(damped.first_damped >= 700);   // when the hand has let go
      CHECK(damped.strongest > 0.3);
    }
    if (hand.stiffness > 4999 && hand.every == 1) {   // it shakes
      CHECK(alone.swing > 4e-3);
      CHECK(damped.swing < alone.swing / 5);
    }
  };
  press({.stiffness = 190.0}, 1e-5, BackwardEuler{}, WholeBody{});
  press({.stiffness = 1000.0}, 1e-5, LeapfrogVerlet{}, ZoneOfInfluence{.rings = 2});
  press({.stiffness = 2000.0}, 0.08e-3, LeapfrogVerlet{}, WholeBody{});
  press({.stiffness = 2000.0, .every = 16}, 0.08e-3, LeapfrogVerlet{}, WholeBody{});
  press({.stiffness = 5000.0, .young = 3e4}, 0.84e-3, BackwardEuler{}, ZoneOfInfluence{.rings = 2});
  press({.stiffness = 3000.0, .every = 16}, 0.84e-3, BackwardEuler{}, WholeBody{});
}

// Yardsticks: the reservoir of 5 mJ, beyond which 5 J are nothing, and the sum of what was sent, added up beside it.
TEST_CASE("C8-O5 C8-O7: 5 J taken beforehand do not hide a solid that shakes, and what is counted is what was sent", "[haptics][solid]") {
  Held fresh{.stiffness = 5000.0, .max_damping = 11.0}, rich{.stiffness = 5000.0, .max_damping = 11.0, .before = 5.0}, alone{.stiffness = 5000.0};
  fresh.run(LeapfrogVerlet{}, WholeBody{}), rich.run(LeapfrogVerlet{}, WholeBody{}), alone.run(LeapfrogVerlet{}, WholeBody{});
  CAPTURE(fresh.least, rich.least, alone.least);
  CHECK(rich.least > -0.005 + 1.2 * fresh.least);
  CHECK(alone.least < -0.05);
  CHECK(rich.least > 0.2 * alone.least);
  CHECK(rich.first_damped >= fresh.first_damped);
  CHECK(fresh.first_damped > 0);
  Held weak{.stiffness = 5000.0, .max_damping = 11.0, .max_force = 0.3};
  weak.run(LeapfrogVerlet{}, WholeBody{});
  CHECK(weak.strongest <= 0.3 * (1 + 1e-12));
  CHECK(weak.end == Approx(weak.sum_sent).epsilon(1e-9));
  CHECK(std::abs(weak.end - weak.sum_wanted) > 1e-3);
}

// Yardsticks: −K v T d, what a held spring leaks at constant speed where samples meet the surface; in front of the surface nothing, to the bit.
TEST_CASE("C8-O1 C8-O6: over a solid that rests the observer finds the leak of a held spring, and in front of it nothing", "[haptics][solid]") {
  auto const leak = [](double stiffness, double speed, double depth) {
    auto body = solid_block().body(BackwardEuler{}, ZoneOfInfluence{});
    SurfaceFit<double> fit({.stiffness = stiffness});
    PatchHandover<double> handover({.ticks = 16});
    PassivityController<double> observer({.max_damping = 0.0, .reservoir = 1.0});
    int const ticks = static_cast<int>(depth / (speed * 1e-3)) + 4;
    std::uint64_t sequence = 0;
    for (int k = -ticks; k <= ticks; ++k) {
      Vector const tip = on_top + Vector(0, 0, speed * 1e-3 * std::abs(k) - depth);
      body.step(1e-3);
      if ((k + ticks) % 16 == 0) handover.take(patch_at(body, on_top, fit), ++sequence, tip);
      Vector const force = handover(tip).force(tip);
      observer(tip, force);
      observer.sent(force);
    }
    return observer.energy();
  };
  CHECK(leak(1000, 0.1, 0.010) == Approx(-1e-3).epsilon(1e-6));
  CHECK(leak(500, 0.05, 0.005) == Approx(-0.125e-3).epsilon(1e-6));

  for (SurfaceKind const kind : {SurfaceKind::plane, SurfaceKind::ball, SurfaceKind::facets}) {
    Palpation at(solid_block(), BackwardEuler{}, WholeBody{}, on_top + Vector(0, 0, 0.006), {.stiffness = 500.0});
    at.loop.sense_surface(kind);
    ProxyForce<double> force({.surface = kind, .max_stiffness = 500.0});
    force.begin_session(1000.0, 60.0);
    PassivityController<double> controller;
    bool nothing = true;
    int models = 0;
    for (int k = 0; k < 300; ++k) {
      at.to(on_top + Vector(0.004 * std::sin(0.02 * k), 0, 0.0031 + 0.003 * std::cos(0.03 * k)), 1e-3);
      if (at.model.surface.stiffness() > 0) ++models;
      Vector const felt = force.on_surface(at.model, {.tip = at.tip, .seconds = 1e-3, .continues = true}), sent = controller(at.tip, felt);
      controller.sent(sent);
      nothing = nothing && felt == Vector(0, 0, 0) && sent == felt && controller.energy() == 0.0;
    }
    CHECK(nothing);
    CHECK(models > 100);   // the surface was there
  }
}

// Yardstick: springs in series: the coupling, the contact and Hooke's stiffness of the solid; K_c times what the tool lags.
TEST_CASE("C7-V1: at rest on a solid a coupled proxy is three springs in series", "[haptics][solid]") {
  Solid const solid = solid_block();
  double const coupling = 300.0, contact = 500.0, depth = 1e-4;
  Palpation at(solid, BackwardEuler{}, WholeBody{}, on_top + Vector(0, 0, 1e-3), {.stiffness = contact, .damping = 1.0});
  at.loop.sense_surface(SurfaceKind::plane);
  CoupledForce force(ProxyForce<double>({.surface = SurfaceKind::plane, .max_stiffness = contact, .handover = 1}), {.stiffness = coupling});
  force.begin_session(200.0, 200.0);
  Vector felt = Vector::Zero(), hand = at.tip;
  for (int k = 0; k < 900; ++k) {
    hand = on_top + Vector(0, 0, std::max(1e-3 - 1e-5 * k, -depth));
    felt = force.on_surface(at.model, {.tip = hand, .seconds = 0.005, .continues = true});
    at.to(force.tool().position, 0.005);
  }
  REQUIRE(at.contact().touching);
  auto const corners = at.body().tissue().surface().corners(at.contact().triangle);
  double const hooke = solid.stiffness_at(corners, at.contact().barycentric, at.contact().normal);
  CHECK(felt.z() == Approx(depth / (1 / coupling + 1 / contact + 1 / hooke)).epsilon(0.01));
  CHECK((felt - coupling * (force.tool().position - hand)).norm() < 1e-3 * felt.norm());
  CHECK(felt.z() == Approx(at.model.tissue_force.z()).epsilon(0.01));   // what the hand feels is what the tissue gets
}
