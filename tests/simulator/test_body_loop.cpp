// SPDX-License-Identifier: MIT
// Yardsticks: counting by hand, the closed form of a wall (force = stiffness × depth), and bodies that report what they are asked for.
#include "catch.hpp"

#include "allocation_trap.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/no_cutter.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/organ.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/simulator/body_loop.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

using namespace palpate;

namespace {

template <RealScalar S>
MassSpring<S> sheet(int n = 21, bool wall = false) {
  auto const skin = make_grid<S>(n, n, S(0.005));
  MassSpring<S> tissue(skin, {.mass = {.total = S(0.1)}, .link = {.stiffness = 80, .damping = S(0.02)}, .home = {.stiffness = 8, .damping = S(0.1)}});
  tissue.nail(boundary_vertices(skin));
  if (wall)
    for (int i = 0; i < tissue.size(); ++i) tissue.nail(i);
  return tissue;
}

/// A body that keeps the steps it was asked for, states a stable step of the test's choice, and diverges on demand.
template <RealScalar S>
struct Witness : SoftBody<MassSpring<S>, LeapfrogVerlet, WholeBody> {
  using Base = SoftBody<MassSpring<S>, LeapfrogVerlet, WholeBody>;
  explicit Witness(MassSpring<S> tissue) : Base(std::move(tissue), LeapfrogVerlet{}, WholeBody{}) {}

  StepReport<S> step(S h) {
    steps.push_back(h);
    if (diverge_at > 0 && --diverge_at == 0) return {.status = StepStatus::diverged};
    return Base::step(h);
  }
  S stable_step() {
    ++asked;
    return stated;
  }

  std::vector<S> steps;
  S stated = 1;
  int asked = 0;
  int diverge_at = 0;   // this step from now, counted from 1
};

/// Where the sheet of 21 × 21 is touched.
template <RealScalar S>
Vector3<S> over(S z) {
  return {S(0.0512), S(0.0533), z};
}

}  // namespace

TEMPLATE_TEST_CASE("a tick is split into the fewest equal steps not above the stable one", "[simulator][body_loop]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  struct Case {
    double tick, stable;
    int steps;
  };
  for (Case const c : {Case{1e-3, 2e-3, 1}, Case{1e-3, 1e-3, 1}, Case{1e-3, 0.99e-3, 2}, Case{1e-3, 5e-4, 2}, Case{1e-3, 4.9e-4, 3}, Case{1e-3, 1e-4, 10},
                       Case{1e-3, 1e-3 / 3, 3}, Case{2e-3, 1.3e-5, 154}, Case{0.01, 3e-3, 4}, Case{1e-3, std::numeric_limits<double>::infinity(), 1}}) {
    Witness<S> body(sheet<S>(3));
    body.stated = static_cast<S>(c.stable);
    BodyLoop<Witness<S>, NoCutter<S>> loop(std::move(body), NoCutter<S>{}, ContactCoupling{}, 1000);
    loop.tick({.position = Vector3<S>(0, 0, 1)}, static_cast<S>(c.tick));
    INFO(c.tick << " s in steps of at most " << c.stable << " s");
    CHECK(static_cast<int>(loop.body().steps.size()) == c.steps);
    for (S const h : loop.body().steps) CHECK(h == Approx(c.tick / c.steps).epsilon(1e-6));
    CHECK(loop.counts().steps == static_cast<std::uint64_t>(c.steps));
    CHECK(loop.counts().max_steps_a_tick == c.steps);
    CHECK(loop.counts().capped == 0);
    loop.rest(static_cast<S>(c.tick));
    CHECK(loop.counts().steps == 2 * static_cast<std::uint64_t>(c.steps));
    CHECK(loop.counts().ticks == 2);
  }
}

TEST_CASE("a tick takes no more steps than it may, and says so", "[simulator][body_loop]") {
  for (double const stable : {1e-6, 0.0}) {   // 0: the integrator stands no step at all
    Witness<double> body(sheet<double>(3));
    body.stated = stable;
    BodyLoop<Witness<double>, NoCutter<double>> loop(std::move(body), NoCutter<double>{}, ContactCoupling{}, 7);
    for (int k = 0; k < 3; ++k) loop.tick({.position = {0, 0, 1}}, 1e-3);
    CHECK(loop.body().steps.size() == 21);
    for (double const h : loop.body().steps) CHECK(h == Approx(stable > 0 ? stable : 1e-3 / 7));   // it lags, it does not diverge
    CHECK(loop.counts().capped == 3);
    CHECK(loop.counts().max_steps_a_tick == 7);
    CHECK(loop.counts().max_steps_wanted == (stable > 0 ? 1000 : 1000000000));
    CHECK(loop.counts().seconds == Approx(3e-3));
    CHECK(loop.counts().lag == Approx(stable > 0 ? 3 * (1e-3 - 7e-6) : 0.0));
  }
}

// Yardstick: the time that the body itself has counted.
TEMPLATE_TEST_CASE("what ticks leave out is how far the body is behind", "[simulator][body_loop]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Witness<S> body(sheet<S>(3));
  body.stated = S(3e-4);   // four steps a tick
  BodyLoop<Witness<S>, NoCutter<S>> loop(std::move(body), NoCutter<S>{}, ContactCoupling{}, 4);
  auto const behind = [&] { return loop.counts().seconds - static_cast<double>(loop.body().time()); };
  for (int k = 0; k < 100; ++k) loop.rest(S(1e-3));
  CHECK(loop.counts().lag == 0.0);
  loop.body().diverge_at = 2;   // three of four steps are missing
  loop.rest(S(1e-3));
  CHECK(loop.counts().lag == Approx(7.5e-4));
  CHECK(loop.counts().lag == Approx(behind()).margin(1e-6));
  loop.rest(S(2e-3));   // seven wanted, four taken
  CHECK(loop.counts().max_steps_wanted == 7);
  CHECK(loop.counts().lag == Approx(7.5e-4 + 2e-3 - 4 * 3e-4));
  CHECK(loop.counts().lag == Approx(behind()).margin(1e-6));
  loop.leave_out(0.01);
  CHECK(loop.counts().lag == Approx(behind()).margin(1e-6));
}

TEST_CASE("the stable step is found anew when the tissue was edited and when its guarded ticks are over, and only then", "[simulator][body_loop]") {
  Witness<double> start(sheet<double>());
  start.stated = 1e-4;
  BodyLoop<Witness<double>, ProgressiveCutter<double>> loop(std::move(start), ProgressiveCutter<double>({.puncture_depth = 0.003, .snap = 2e-4}),
                                                            ContactCoupling{}, 100);
  auto& body = loop.body();
  CHECK(body.asked == 1);
  int edits = 0;
  auto revision = body.tissue().revision();
  auto const advance = [&](Vector3<double> const& tip) {
    loop.tick({.position = tip}, 1e-3);
    if (body.tissue().revision() != revision) ++edits;
    revision = body.tissue().revision();
  };
  for (int k = 0; k <= 60; ++k) advance(over(0.002 - 1e-4 * k));
  CHECK(loop.cutter().state() == CuttingPhase::moving);
  CHECK(edits == 1);   // the puncture
  for (int k = 0; k <= 200; ++k) advance(over(-0.004) + Vector3<double>(1e-4 * k, 0, 0));
  CHECK(edits > 5);
  CHECK(body.asked == 1 + 2 * edits);
  CHECK(loop.counts().stable_steps == static_cast<std::uint64_t>(1 + 2 * edits));
}

TEST_CASE("what a real cut makes of the stable step is what the body itself says", "[simulator][body_loop]") {
  using Body = SoftBody<MassSpring<double>, LeapfrogVerlet, WholeBody>;
  BodyLoop<Body, ProgressiveCutter<double>> loop(Body(sheet<double>()), ProgressiveCutter<double>({.puncture_depth = 0.003, .snap = 5e-4}),
                                                 ContactCoupling{}, 100);
  double const before = loop.stable_step();
  for (int k = 0; k <= 60; ++k) loop.tick({.position = over(0.002 - 1e-4 * k)}, 1e-3);
  for (int k = 0; k <= 300; ++k) loop.tick({.position = over(-0.004) + Vector3<double>(1e-4 * k, 0, 0)}, 1e-3);
  CHECK(loop.stable_step() < before);   // particles of a cut are lighter
  Body fresh = loop.body();
  CHECK(fresh.stable_step() == Approx(loop.stable_step()).epsilon(0.03));
  CHECK(loop.counts().diverged == 0);
  CHECK(loop.body().positions().allFinite());
}

// Light particles at the tip of a wound, pulled apart by links with a hundred times the home spring's stiffness, turn within a tick. The
// yardstick is what the tissue can do at most: its lips part by no more than the pre-tension takes from the organ's half width.
TEST_CASE("a stiff organ under pre-tension is cut without diverging", "[simulator][body_loop]") {
  auto const mesh = make_organ<double>();
  MassSpring<double> tissue(mesh, {.mass = {.total = 0.645},
                                   .link = {.stiffness = 1000, .damping = 0.00193},
                                   .home = {.stiffness = 8.06, .damping = 0.0999},
                                   .link_prestrain = 0.25});
  for (int i = 0; i < tissue.size(); ++i)
    if (mesh.points(2, i) < 0) tissue.nail(i);
  using Body = SoftBody<MassSpring<double>, LeapfrogVerlet, WholeBody>;
  BodyLoop<Body, ProgressiveCutter<double>> loop(Body(std::move(tissue)), ProgressiveCutter<double>({.puncture_depth = 0.004}), ContactCoupling{},
                                                 100);
  Vector3<double> const over_it(-0.0334, -0.0122, 0.049), in(-0.032, -0.0087, 0.0215), end(0.026, 0.006, 0.018);
  double farthest = 0;
  for (int k = 1; k <= 300; ++k) loop.tick({.position = over_it + k / 300.0 * (in - over_it)}, 1e-3);
  for (int k = 1; k <= 1200; ++k) {
    loop.tick({.position = in + k / 3000.0 * (end - in)}, 1e-3);
    for (int i = 0; i < loop.body().size(); ++i)
      farthest = std::max(farthest, (loop.body().positions().col(i) - loop.body().reference_position(i)).norm());
  }
  CHECK(loop.cutter().state() == CuttingPhase::moving);
  CHECK(loop.cutter().report().particles_added > 5);
  CHECK(loop.cutter().contact().normal.z() > 0.9);
  CHECK(loop.counts().diverged == 0);
  CHECK(farthest < 0.25 * 0.2 / 2);   // the organ is 0.2 m across
}

TEMPLATE_TEST_CASE("a wall answers stiffness times the mean depth of the tick", "[simulator][body_loop]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Witness<S> body(sheet<S>(21, true));
  body.stated = S(0.25e-3);   // four steps
  BodyLoop<Witness<S>, NoCutter<S>> loop(std::move(body), NoCutter<S>{}, ContactCoupling{.stiffness = 500, .damping = 0}, 100);
  CHECK(loop.tick({.position = over(S(0.001))}, S(1e-3)).phase == CuttingPhase::no_contact);
  // The tip moves evenly from +1 mm to −2 mm: 0.25, −0.5, −1.25, −2 mm at the ends of the steps; above the surface it does not pull.
  LocalModel<S> model = loop.tick({.position = over(S(-0.002))}, S(1e-3));
  CHECK(model.phase == CuttingPhase::indenting);
  CHECK(model.tissue_force.z() == Approx(500 * (0.0005 + 0.00125 + 0.002) / 4).epsilon(1e-4));
  CHECK(model.depth(over(S(-0.002))) == Approx(0.002).epsilon(1e-4));
  CHECK(model.normal == Vector3<S>(0, 0, 1));
  model = loop.tick({.position = over(S(-0.002))}, S(1e-3));
  CHECK(model.tissue_force.z() == Approx(1.0).epsilon(1e-4));
  // With a velocity v the spring is where it will be at the end of the step: h k v more.
  model = loop.tick({.position = over(S(-0.002)), .velocity = Vector3<S>(0, 0, S(-0.1))}, S(1e-3));
  CHECK(model.tissue_force.z() == Approx(1.0 + 0.25e-3 * 500 * 0.1).epsilon(1e-4));
  model = loop.tick({.position = over(S(0.001))}, S(1e-3));
  CHECK(model.phase == CuttingPhase::no_contact);
  CHECK(model.tissue_force.isZero(0));
}

TEST_CASE("a body is never punctured by a force it has not felt yet", "[simulator][body_loop]") {
  // A wall of 1000 N/m and a scalpel that needs 2 N: at 2.05 mm it has pressed with 2.05 N, and punctures in the tick after.
  Witness<double> body(sheet<double>(21, true));
  BodyLoop<Witness<double>, ProgressiveCutter<double>> loop(
      std::move(body), ProgressiveCutter<double>({.puncture_depth = 1.0, .puncture_force = 2.0}), ContactCoupling{.stiffness = 1000, .damping = 0}, 1);
  loop.tick({.position = over(0.001)}, 1e-3);
  int tick = 0;
  for (; loop.cutter().state() != CuttingPhase::moving && tick < 100; ++tick) loop.tick({.position = over(-1e-4 * tick - 5e-5)}, 1e-3);
  CHECK(tick - 1 == 21);   // tick 20 presses with 2.05 N
}

TEST_CASE("a diverged step silences the hand until the tool has left and the body moves again", "[simulator][body_loop]") {
  Witness<double> body(sheet<double>());
  body.stated = 1e-4;
  BodyLoop<Witness<double>, NoCutter<double>> loop(std::move(body), NoCutter<double>{}, ContactCoupling{}, 100);
  CHECK_FALSE(loop.tick({.position = over(0.001)}, 1e-3).diverged);
  CHECK_FALSE(loop.tick({.position = over(-0.001)}, 1e-3).diverged);
  loop.body().steps.clear();
  loop.body().diverge_at = 4;
  CHECK(loop.tick({.position = over(-0.002)}, 1e-3).diverged);
  CHECK(loop.body().steps.size() == 4);   // the rest of the tick is left out
  CHECK(loop.counts().diverged == 1);
  CHECK(loop.tick({.position = over(-0.002)}, 1e-3).diverged);   // all is well again, but the tool is still inside
  CHECK(loop.body().steps.size() == 14);
  CHECK_FALSE(loop.tick({.position = over(0.002)}, 1e-3).diverged);
  CHECK_FALSE(loop.tick({.position = over(-0.002)}, 1e-3).diverged);
  loop.tick({.position = over(0.002)}, 1e-3);
  loop.body().diverge_at = 1;
  CHECK(loop.tick({.position = over(0.002)}, 1e-3).diverged);   // without contact as well
  CHECK(loop.counts().diverged == 2);
}

// By hand: pushed sideways by a jump the wall would answer 2000 N/m times what is below its surface; placed there, the tool has touched nothing.
TEST_CASE("a tool that was placed anew touches and cuts nothing on its way, and begins a stroke when it comes from outside", "[simulator][body_loop]") {
  Witness<double> body(sheet<double>());
  body.stated = 1e-4;   // 1 ms is too much for it once it is cut
  BodyLoop<Witness<double>, ProgressiveCutter<double>> loop(std::move(body), ProgressiveCutter<double>({.puncture_depth = 0.003, .snap = 2e-4}), ContactCoupling{}, 100);
  auto const move = [&](Vector3<double> const& from, Vector3<double> const& to, int ticks, std::uint64_t pose_discontinuities) {
    for (int k = 1; k <= ticks; ++k) loop.tick({.position = from + (to - from) * (double(k) / ticks)}, 1e-3, pose_discontinuities);
  };
  Vector3<double> const begin = over(0.002), in = over(-0.004), end = in + Vector3<double>(0.01, 0, 0), beside = end + Vector3<double>(0, 0.02, 0);
  move(begin, in, 60, 0), move(in, end, 100, 0);
  REQUIRE(loop.cutter().state() == CuttingPhase::moving);
  auto const pieces = loop.body().size();
  LocalModel<double> const there = loop.tick({.position = beside}, 1e-3, 1);
  CHECK(there.phase == CuttingPhase::no_contact);
  CHECK(there.tissue_force.isZero(0));
  CHECK(loop.cutter().report().particles_added > 0);   // the stroke that ended
  int const ended = loop.body().size();
  CHECK(std::abs(ended - pieces) <= 2);   // its end is tidied up, and that is all
  move(beside, beside - Vector3<double>(0.005, 0, 0), 50, 1);
  CHECK(loop.body().size() == ended);
  CHECK(loop.cutter().state() == CuttingPhase::no_contact);
  move(beside, beside + Vector3<double>(0, 0, 0.01), 20, 1);   // out,
  move(beside + Vector3<double>(0, 0, 0.01), beside, 100, 1);  // in again,
  CHECK(loop.cutter().state() == CuttingPhase::moving);
  move(beside, beside - Vector3<double>(0.01, 0, 0), 100, 1);
  CHECK(loop.body().size() > ended + 2);
  for (int i = ended; i < loop.body().size(); ++i) CHECK(loop.body().reference_position(i).y() > 0.0533 + 0.02 - 0.005);   // and cuts there
}

namespace {

/// Promises a step that it does not stand.
struct Boaster : SoftBody<MassSpring<double>, LeapfrogVerlet, WholeBody> {
  using SoftBody::SoftBody;
  double stable_step() const { return 1.0; }
  double guaranteed_stable_step() const { return 1.0; }
};

}  // namespace

TEST_CASE("a body that really diverges ends in no number that is not finite", "[simulator][body_loop]") {
  BodyLoop<Boaster, NoCutter<double>> loop(Boaster(sheet<double>()), NoCutter<double>{}, ContactCoupling{.stiffness = 1e6}, 1);   // 1 step of 50 ms
  bool diverged = false;
  for (int k = 0; k < 400; ++k) {
    LocalModel<double> const model = loop.tick({.position = over(0.002 - 2e-5 * k), .velocity = {0, 0, -4e-4}}, 0.05);
    CHECK(model.tissue_force.allFinite());
    CHECK(model.home_point.allFinite());
    diverged = diverged || model.diverged;
  }
  CHECK(loop.counts().capped == 0);
  CHECK(loop.counts().diverged > 0);
  CHECK(diverged);
  CHECK(loop.body().positions().allFinite());
  CHECK(loop.body().velocities().allFinite());
}

namespace {

/// The least a cutter can be: no interest in the force.
struct Needle {
  template <class Body>
  void advance(Body& body, ToolPose<double> const& tool) {
    touch.update(body, tool.position);
  }
  SurfaceContact<double> const& contact() const { return touch.contact(); }
  CuttingPhase state() const { return contact().touching ? CuttingPhase::indenting : CuttingPhase::no_contact; }
  CutReport const& report() const { return cuts; }
  double tip_radius() const { return touch.tip_radius(); }

  Touch<double> touch{0.0};
  CutReport cuts;
};

}  // namespace

TEST_CASE("a cutter of the least kind is enough", "[simulator][body_loop]") {
  Witness<double> body(sheet<double>(21, true));
  BodyLoop<Witness<double>, Needle> loop(std::move(body), Needle{}, ContactCoupling{.stiffness = 100, .damping = 0}, 10);
  loop.tick({.position = over(0.001)}, 1e-3);
  loop.tick({.position = over(-0.001)}, 1e-3);
  LocalModel<double> const model = loop.tick({.position = over(-0.001)}, 1e-3);
  CHECK(model.tissue_force.z() == Approx(0.1));
  CHECK(model.tip_radius == 0.0);
}

TEMPLATE_TEST_CASE("a tick of palpation allocates nothing", "[simulator][body_loop]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  REQUIRE(palpate_test::trap_works());
  auto const run = [](auto region) {
    using Body = SoftBody<MassSpring<S>, LeapfrogVerlet, decltype(region)>;
    BodyLoop<Body, NoCutter<S>> loop(Body(sheet<S>(), LeapfrogVerlet{}, region), NoCutter<S>{}, ContactCoupling{}, 100);
    auto const press = [&](int from, int to) {
      for (int k = from; k < to; ++k)
        loop.tick({.position = over(S(0.002) - S(0.006) * std::sin(S(0.01) * S(k))) + Vector3<S>(S(2e-5) * S(k), 0, 0)}, S(1e-3));
    };
    press(0, 300);
    palpate_test::AllocationCount const allocations;
    press(300, 1000);
    return allocations.count();
  };
  CHECK(run(WholeBody{}) == 0);
  CHECK(run(ZoneOfInfluence{.rings = 4}) == 0);
}
