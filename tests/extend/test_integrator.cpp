// SPDX-License-Identifier: MIT
// An integrator of one's own needs palpate/extend/integrator.hpp and nothing else. Yardstick: the battery's extrapolated reference.
#include <palpate/extend/integrator.hpp>

#include "catch.hpp"

/// Heun's rule: a step of explicit Euler, then with the mean of the slopes at both ends.
struct Heun {
  static constexpr int order = 2;   // optional

  template <class System>
  void step(System& system, typename System::Scalar h) const {
    auto&& x = palpate::wide(system.positions());   // wide: in a body the columns are padded, and these compute through
    auto&& v = palpate::wide(system.velocities());
    auto&& a = palpate::wide(system.scratch(0));
    auto&& b = palpate::wide(system.scratch(1));
    system.acceleration(x, v, a);
    x += h * v;
    v += h * a;
    system.acceleration(x, v, b);
    x += h * h / 2 * a;   // x + h (v + v + h a)/2
    v += h / 2 * (b - a);
  }
};
static_assert(palpate::Integrator<Heun> && palpate::Integrator<Heun, float> && palpate::StatesOrder<Heun>);

static_assert(!palpate::StatesStableStep<Heun> && !palpate::ImplicitIntegrator<Heun> && !palpate::StatesOrder<palpate::testing::IntegratorArchetype>);

using namespace palpate;

namespace {

struct Boast : testing::IntegratorArchetype {
  static constexpr int order = 2;
};

}  // namespace

TEST_CASE("an integrator of one's own keeps the laws of integrators") {
  CHECK(testing::to_text(testing::check_integrator(Heun{})) == "");
  CHECK(testing::measured_order(Heun{}) == Approx(2).margin(0.1));
  CHECK(testing::to_text(testing::check_integrator(testing::IntegratorArchetype{})) == "");
}

TEST_CASE("an integrator that is wrong is told so") {
  CHECK_THAT(testing::to_text(testing::check_integrator(Boast{})), says("the order is 2"));
}
