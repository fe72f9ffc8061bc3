// SPDX-License-Identifier: MIT
// Hand, device, servo, safety chain, local model, tissue and cut in one loop: the hand is a mass, a spring and a damper that means to follow a path and
// yields to what it feels. Yardsticks: rest is rest; the energy that a sampled spring can leak, ½ K |Δx|² a tick; the limits asked for.
// PALPATE_SOAK_SESSIONS sets how many sessions (3 if not set; the long run is 100), PALPATE_SOAK_TICKS how long one is (6,000; the long run has 100,000).
#include "catch.hpp"
#include "heap_in_use.hpp"

#include "simulator/scene.hpp"

#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/device/simulated_hand.hpp>
#include <palpate/force/liver.hpp>
#include <palpate/force/organ_force.hpp>
#include <palpate/haptics/press_then_cut.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/simulator/simulator.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>

using namespace palpate;
using palpate_test::heap_in_use;

namespace {

long asked_for(char const* name, long otherwise) {
  char const* const asked = std::getenv(name);
  return asked ? std::atol(asked) : otherwise;
}

/// Touches and lifts, then punctures, draws and lifts, in 3 s.
Trajectory<double> palpate_and_cut() {
  auto const at = [](double x, double z) { return Vector3<double>(x, 0.0533, z); };
  auto path = Trajectory<double>::start(at(0.0312, 0.004));
  path.hold(0.1).line(at(0.0312, -0.006), 0.5).line(at(0.0312, 0.004), 0.4).line(at(0.0312, -0.012), 0.6).line(at(0.0612, -0.012), 1.0).line(at(0.0612, 0.012), 0.4);
  return path;
}

}  // namespace

TEST_CASE("sessions of a hand in the loop: limits hold, no contact gives energy, the tissue comes to rest, and memory stays", "[simulator][soak]") {
  long const sessions = asked_for("PALPATE_SOAK_SESSIONS", 3);
  double const seconds = static_cast<double>(asked_for("PALPATE_SOAK_TICKS", 6000)) / 1000.0;
  constexpr double stiffest = 800.0, cap = 0.9, slew = 0.5;   // N/m of liver and spring; N; N a tick

  Simulator simulator(SimulatedHand<double>(palpate_and_cut(), {.hand = firm_hand(), .quantum = 55e-6, .buttons = 1}), palpate_test::skin<double>(ZoneOfInfluence{.rings = 4, .relaxation = 1e-9}),
                      ProgressiveCutter<double>({.puncture_depth = 0.006, .snap = 5e-4}),
                      PressThenCut(ProxyForce<double>({.surface = SurfaceKind::facets, .static_friction = 0.3, .dynamic_friction = 0.2}), liver_hysteresis<double>(),
                                   OrganForce<double>{.coefficient = 1.0, .wall_normal = {1, 0, 0}}),
                      {.servo = {.safety = {.protects_a_hand = true, .max_force = cap}}});
  simulator.device().set_buttons(1);
  simulator.body().reserve(1000, 2000);
  auto const rest = simulator.mark();
  Matrix3X<double> const home = simulator.body().positions();
  std::size_t held = 0;
  Recording first;
  for (long session = 0; session < sessions; ++session) {
    CAPTURE(session);
    simulator.device().rewind();
    simulator.device().set_buttons(1);
    {
      Recording const recording = simulator.run(seconds);
      auto const& ticks = recording.ticks();
      double leak = 0.0, begin = 0.0, largest = 0.0, steepest = 0.0;
      int contacts = 0, cuts = 0;
      for (std::size_t k = 1; k < ticks.size(); ++k) {
        bool const was = ticks[k - 1].phase != CuttingPhase::no_contact, is = ticks[k].phase != CuttingPhase::no_contact;
        double const way = (ticks[k].tip - ticks[k - 1].tip).norm(), step = (ticks[k].force - ticks[k - 1].force).norm();
        if (!was && is) begin = ticks[k - 1].energy, leak = 0.0, ++contacts;
        cuts += ticks[k].phase == CuttingPhase::moving && ticks[k - 1].phase != CuttingPhase::moving;
        leak += stiffest * way * way / 2;
        if (was && !is) REQUIRE(ticks[k].energy - begin >= -leak);
        largest = std::max(largest, ticks[k].force.norm());
        if (!ticks[k].force.isZero(0)) steepest = std::max(steepest, step);
      }
      REQUIRE(contacts >= 2);
      REQUIRE(cuts == 1);
      REQUIRE(largest <= cap * (1 + 1e-12));
      REQUIRE(largest > 0.5);
      REQUIRE(steepest <= slew * (1 + 1e-9));
      REQUIRE(simulator.body().size() > home.cols());   // the same every time: a cut
      double worst = 0.0;
      for (int i = 0; i < simulator.body().size(); ++i) worst = std::max(worst, simulator.body().displacement(i).norm());
      REQUIRE(worst <= 1e-9);
    }
    simulator.restore(rest);
    REQUIRE(simulator.body().positions() == home);
    if (session == 1) held = heap_in_use();
    if (session > 1) REQUIRE(heap_in_use() <= held + 4096);   // the test framework keeps a few texts
  }
}
