// SPDX-License-Identifier: MIT
// Yardstick: the C library's own functions. While a tick of the servo runs, each of them that may wait ends the program and says its name, so
// these tests pass by getting to their end; that the guard does end a program is tested first, in a child process.
#include "catch.hpp"

#include "allocation_trap.hpp"
#include "forked.hpp"
#include "servo_guard.hpp"
#include "simulator/puppet.hpp"

#include <palpate/fitting/fitted_force.hpp>
#include <palpate/force/band_limited_noise.hpp>
#include <palpate/force/blade.hpp>
#include <palpate/force/cutting_force.hpp>
#include <palpate/force/exponential_contact.hpp>
#include <palpate/force/hunt_crossley_contact.hpp>
#include <palpate/force/liver.hpp>
#include <palpate/force/needle_force.hpp>
#include <palpate/force/noise.hpp>
#include <palpate/force/organ_force.hpp>
#include <palpate/force/polynomial_contact.hpp>
#include <palpate/force/speed_curve.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/haptics/coupled_force.hpp>
#include <palpate/haptics/overlay.hpp>
#include <palpate/haptics/press_then_cut.hpp>
#include <palpate/haptics/proxy_force.hpp>
#include <palpate/haptics/spring_then_tissue.hpp>
#include <palpate/simulator/servo_loop.hpp>
#include <palpate/training/guidance.hpp>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <future>
#include <iostream>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

using namespace palpate;
using palpate_test::Child;
using palpate_test::guard_aborts;
using palpate_test::guard_violations;
using palpate_test::in_child;
using palpate_test::Puppet;
using palpate_test::ServoGuard;
using palpate_test::Strings;

namespace {

/// What a run under the guard was like.
struct GuardedRun {
  int ticks = 0, felt = 0;
  long violations = 0;
};

/// Any force model behind one type, so that the servo is compiled once for all of them.
template <class S>
struct AnyForce {
  virtual ~AnyForce() = default;
  virtual Vector3<S> answer(ToolContact<S> const& contact) noexcept = 0;
};

template <class S, class Force>
struct ThisForce final : AnyForce<S> {
  explicit ThisForce(Force given) : force(std::move(given)) {}
  Vector3<S> answer(ToolContact<S> const& contact) noexcept override { return force(contact); }
  Force force;
};

template <class S>
struct ForceBehind {
  AnyForce<S>* force;
  Vector3<S> operator()(ToolContact<S> const& contact) noexcept { return force->answer(contact); }
};

/// Ticks of a servo on contacts made by hand: into the tissue, through it, along, out, and with values that are no numbers.
template <class S, class Force>
GuardedRun guarded_contacts(Force force, bool moves_a_hand = false) {
  Strings<S> strings;
  strings.capabilities.moves_a_hand = moves_a_hand;
  ServoLoop<Puppet<S>, Force, S> servo{Puppet<S>(strings), std::move(force)};
  servo.begin_session();
  GuardedRun run;
  long const before = guard_violations();
  for (; run.ticks < 400; ++run.ticks) {
    int const k = run.ticks;
    LocalModel<S> model;
    model.phase = k < 20 || k > 380 ? CuttingPhase::no_contact : k < 150 ? CuttingPhase::indenting : CuttingPhase::moving;
    model.tissue_force = {S(0), S(0), S(0.2)};
    model.restorations = k < 300 ? 0u : 1u;
    model.time = k < 320 || k > 350 ? 1e-3 * k : 0.0;   // in between it is too old for a device that moves a hand
    if (k < 150) {
      model.surface.patch.stiffness = S(500);
      model.surface.patch.curvature = S(20);
      model.surface.planes.try_add({{S(0), S(0), S(1)}, S(0)});
      model.surface.planes.try_add({{S(-0.6), S(0), S(0.8)}, S(-0.003)});   // it runs into that
      model.surface.sequence = static_cast<std::uint64_t>(1 + k / 10);
    }
    S const depth = S(k < 250 ? 4e-5 * (k - 20) : 4e-5 * (480 - k));
    strings.next.position = {S(1e-4 * k), S(0), k == 200 ? std::numeric_limits<S>::quiet_NaN() : -depth};
    ServoGuard const guard;
    servo.read(S(1e-3));
    Tick const tick = servo.respond(model, 1e-3 * k);
    if (!tick.force.isZero(0)) ++run.felt;
  }
  run.violations = guard_violations() - before;
  return run;
}

template <class S, class Force>
GuardedRun guarded_force(Force force) {
  ThisForce<S, Force> any(std::move(force));
  return guarded_contacts<S>(ForceBehind<S>{&any});
}

/// The same for what answers to the surface.
struct AnySurfaceForce {
  virtual ~AnySurfaceForce() = default;
  virtual Vector3<double> answer(LocalModel<double> const& local, ToolMotion<double> const& motion) noexcept = 0;
  virtual void begin(double servo_rate, double model_rate) = 0;
};

template <class Force>
struct ThisSurfaceForce final : AnySurfaceForce {
  explicit ThisSurfaceForce(Force given) : force(std::move(given)) {}
  Vector3<double> answer(LocalModel<double> const& local, ToolMotion<double> const& motion) noexcept override { return force.on_surface(local, motion); }
  void begin(double servo_rate, double model_rate) override { force.begin_session(servo_rate, model_rate); }
  Force force;
};

struct SurfaceForceBehind {
  AnySurfaceForce* force;
  Vector3<double> on_surface(LocalModel<double> const& local, ToolMotion<double> const& motion) noexcept { return force->answer(local, motion); }
  SurfaceKind surface_kind() const noexcept { return SurfaceKind::facets; }
  void begin_session(double servo_rate, double model_rate) { force->begin(servo_rate, model_rate); }
};

/// A force model that does on tick 100 what it must not.
struct Offender {
  std::function<void()> deed;
  int ticks = 0;
  Vector3<double> operator()(ToolContact<double> const&) noexcept {
    if (++ticks == 100) deed();
    return Vector3<double>::Zero();
  }
};

Child offence(std::function<void()> const& deed) {
  return in_child([&] { guarded_force<double>(Offender{deed}); });
}

/// The first line that a child which was ended by the guard has said.
std::string guard_said(Child const& child) {
  if (!child.aborted) return "not ended, exit status " + std::to_string(child.code) + ": " + child.said;
  return child.said.substr(0, child.said.find('\n'));
}

std::string in_a_tick(std::string const& call) { return "palpate_test::ServoGuard: " + call + " in a servo tick; it was called from"; }

}  // namespace

TEST_CASE("the guard ends a program that allocates, releases, locks, sleeps or writes in a tick", "[simulator][servo_guard]") {
  if (!guard_aborts()) {   // a sanitizer has these functions: allocations and releases are counted
    auto const run = guarded_force<double>(Offender{[] {
      void* volatile block = std::malloc(1000);   // volatile: a compiler may leave out what nobody sees
      std::free(block);
    }});
    CHECK(run.violations == 2);
    return;
  }
  REQUIRE(in_child([] {}).code == 0);
  void* volatile block = nullptr;
  CHECK(guard_said(offence([&] { block = std::malloc(1000); })) == in_a_tick("malloc"));
  CHECK(guard_said(offence([&] { block = std::calloc(10, 100); })) == in_a_tick("calloc"));
  CHECK(guard_said(offence([&] { block = std::aligned_alloc(64, 128); })) == in_a_tick("aligned_alloc"));
  CHECK(guard_said(offence([&] { block = ::operator new(8); })) == in_a_tick("malloc"));
  block = std::malloc(1000);
  CHECK(guard_said(offence([&] { std::free(block); })) == in_a_tick("free"));
  CHECK(guard_said(offence([&] { block = std::realloc(block, 2000); })) == in_a_tick("realloc"));
  std::free(block);
  auto last_owner = std::make_shared<int>(1);
  CHECK(guard_said(offence([&] { last_owner.reset(); })) == in_a_tick("free"));
  std::mutex mutex;
  CHECK(guard_said(offence([&] { std::lock_guard const lock(mutex); })) == in_a_tick("pthread_mutex_lock"));
  CHECK(guard_said(offence([] { std::this_thread::sleep_for(std::chrono::microseconds(1)); })) == in_a_tick("nanosleep"));
  CHECK(guard_said(offence([] { std::puts("a tick"); })) == in_a_tick("puts"));
  CHECK(guard_said(offence([] { std::printf("%d ticks\n", 1); })).rfind("palpate_test::ServoGuard: ", 0) == 0);
  CHECK(guard_said(offence([] { std::cout << "a tick" << std::flush; })).rfind("palpate_test::ServoGuard: ", 0) == 0);
  CHECK(guard_said(offence([] { std::vector<double> grown(100); })) == in_a_tick("malloc"));
  Matrix3X<double> const points = Matrix3X<double>::Random(3, 50);
  Vector3<double> kept;
  CHECK(guard_said(offence([&] { kept = Matrix3X<double>(2 * points).col(7); })) == in_a_tick("malloc"));   // a temporary of Eigen
  CHECK(guard_said(offence([] { throw 1; })).rfind(in_a_tick("malloc"), 0) == 0);   // out of noexcept: it would end the program anyway
}

TEST_CASE("the guard is this thread's alone, and off where it is not wanted", "[simulator][servo_guard][threads]") {
  auto const elsewhere = in_child([] {
    long const before = guard_violations();
    std::atomic<int> done{0};
    auto const other = std::async(std::launch::async, [&] {
      while (done.load() == 0) std::this_thread::yield();
      for (int i = 0; i < 100; ++i) delete new int volatile(i);
      done.store(2);
    });
    {
      ServoGuard const guard;
      {
        ServoGuard const again;
      }
      done.store(1);
      while (done.load() == 1) std::this_thread::yield();
    }
    std::vector<int> const allowed(100);
    other.wait();
    if (guard_violations() != before || allowed.size() != 100) std::abort();
  });
  CHECK(elsewhere.code == 0);
}

TEMPLATE_TEST_CASE("no force model of the library waits in a tick", "[simulator][servo_guard][realtime]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  REQUIRE(palpate_test::trap_works());
  struct Named {
    char const* name;
    GuardedRun run;
  };
  std::vector<Named> all;
  auto const check = [&](char const* name, auto force) { all.push_back({name, guarded_force<S>(std::move(force))}); };
  check("NoForce", NoForce{});
  check("TissueReaction", TissueReaction{});
  check("SpringThenTissue", SpringThenTissue<S>());
  check("IndentationSpring", CuttingForce(IndentationSpring<S>{}));
  check("PolynomialContact", CuttingForce(PolynomialContact<S>{.linear = S(100), .cubic = S(1e6)}));
  check("ExponentialContact", CuttingForce(ExponentialContact<S>{.scale = S(0.1), .rate = S(100)}));
  check("HuntCrossleyContact", CuttingForce(HuntCrossleyContact<S>{.stiffness = S(1000), .damping = S(1)}));
  check("liver_loading", CuttingForce(liver_loading<S>()));
  check("liver_hysteresis", CuttingForce(liver_hysteresis<S>(), CurveJoin<S>{}));
  check("scaled and bladed", CuttingForce(scaled(bladed(liver_loading<S>(), BladeFactors<S>{.width_ratio = S(2)}), S(2))));
  check("OrganForce and OrganFriction", CuttingForce(liver_loading<S>(), OrganForce<S>{.coefficient = S(2)}, liver_friction<S>()));
  check("OrganWalls", CuttingForce(liver_loading<S>(), OrganWalls<S>({{.coefficient = S(100)}, {.coefficient = S(50), .wall_normal = {0, 1, 0}}})));
  check("SpeedCurve", CuttingForce(SpeedCurve(Network<S, 2, 3, 1>{}, {S(0), S(0.02)}, {S(0), S(0.1)})));
  check("NeedleForce", CuttingForce(NeedleForce<S>({.linear = 100.0, .cutting = 0.5, .friction = {.dynamic = 10.0, .holding = 20.0}})));
  check("WhiteGaussianNoise", CuttingForce(liver_hysteresis<S>(), WhiteGaussianNoise<S>({.seed = 7})));
  check("BandLimitedNoise", CuttingForce(liver_hysteresis<S>(), BandLimitedNoise<S>({.seed = 7})));
  for (char const* const model : {"linear", "polynomial", "exponential", "hunt-crossley", "needle"}) {
    std::string const name = model;
    std::vector<std::pair<std::string, double>> coefficients{{"k", 100.0}};
    if (name == "polynomial") coefficients = {{"k1", 100.0}, {"k2", 0.0}, {"k3", 1e6}};
    if (name == "exponential") coefficients = {{"a", 0.1}, {"b", 100.0}};
    if (name == "hunt-crossley") coefficients = {{"k", 1000.0}, {"n", 1.5}, {"mu", 1.0}};
    if (name == "needle") coefficients = {{"a1", 100.0}, {"a2", 0.0}, {"cutting", 0.5}, {"dynamic", 10.0}, {"viscous", 1.0}};
    check(model, FittedForce<S>(ForcePreset{name, coefficients, {0.0, 0.005}, {0.0, 0.01}, "by hand"}));   // also beyond what was measured
  }
  check("FittedForce of a network", FittedForce<S>(liver_hysteresis<double>(), {0.0, 0.001}, "the thesis"));
  for (auto const& [name, run] : all) {
    CAPTURE(name, run.felt);
    CHECK(run.ticks == 400);
    CHECK(run.violations == 0);
    CHECK(run.felt >= (&name == &all.front().name ? 0 : 50));   // NoForce is the first
  }
}

TEST_CASE("no force that answers to the surface waits in a tick", "[simulator][servo_guard][realtime]") {
  REQUIRE(palpate_test::trap_works());
  auto const check = [](char const* name, auto force) {
    CAPTURE(name);
    ThisSurfaceForce any(std::move(force));
    auto const run = guarded_contacts<double>(SurfaceForceBehind{&any});
    CHECK(run.ticks == 400);
    CHECK(run.violations == 0);
    CHECK(run.felt > 100);
  };
  auto const proxy = [](SurfaceKind kind) { return ProxyForce<double>({.surface = kind, .static_friction = 0.3, .dynamic_friction = 0.2}); };
  for (SurfaceKind const kind : {SurfaceKind::plane, SurfaceKind::ball, SurfaceKind::facets}) check("ProxyForce", proxy(kind));
  PressThenCut const cut(proxy(SurfaceKind::facets), liver_hysteresis<double>());
  check("PressThenCut", cut);
  check("CoupledForce", CoupledForce(cut, {.stiffness = 400.0, .damping = 1.0}));
  check("CoupledForce of a force model", CoupledForce(CuttingForce(liver_hysteresis<double>()), {.stiffness = 400.0, .damping = 1.0}, WindowedVelocity<double, 8>{}));
}

TEMPLATE_TEST_CASE("all that protects a hand does not wait in a tick", "[simulator][servo_guard][realtime]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  TissueReaction reaction;
  ThisForce<S, TissueReaction> any(reaction);
  auto const run = guarded_contacts<S>(ForceBehind<S>{&any}, true);
  CHECK(run.ticks == 400);
  CHECK(run.violations == 0);
  CHECK(run.felt > 50);
}

TEMPLATE_TEST_CASE("guidance laid over a force does not wait in a tick", "[simulator][servo_guard][realtime]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Matrix3X<double> path(3, 3);
  path.col(0) = Vector3<double>(0.0, 0.01, 0.0);
  path.col(1) = Vector3<double>(0.02, 0.01, 0.0);
  path.col(2) = Vector3<double>(0.02, 0.03, 0.0);
  PathGuidance<S> guidance{GuidePath<S>(path)};
  guidance.arm();
  auto const run = guarded_contacts<S>(Overlaid(CuttingForce(liver_hysteresis<S>()), guidance));
  CHECK(run.violations == 0);
  CHECK(run.felt > 380);   // in free space too
}
