// SPDX-License-Identifier: MIT
// An integrator of one's own needs palpate/extend/integrator.hpp and nothing else. Yardstick: the battery's extrapolated reference, and the closed form
// of a particle on a spring.
#include <palpate/extend/integrator.hpp>

#include "catch.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/extend/tissue.hpp>
#include <palpate/integrator/runge_kutta_4.hpp>
#include <palpate/mesh/grid.hpp>

#include <cmath>

/// Heun's rule: a step of explicit Euler, then with the mean of the slopes at both ends.
struct Heun {
  static constexpr int order = 2;   // optional

  template <class System>
  void step(System& system, typename System::Scalar h) const {
    auto&& x = palpate::padded_view(system.positions());   // wide: in a body the columns are padded, and these compute through
    auto&& v = palpate::padded_view(system.velocities());
    auto&& a = palpate::padded_view(system.scratch(0));
    auto&& b = palpate::padded_view(system.scratch(1));
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

struct BoastOfKutta : RungeKutta4 {   // of errors below 1e-8 m at 1/128 s
  static constexpr int order = 5;
};

template <int Columns>
struct Gragg {   // the midpoint rule in 2, 4, 6, … parts of a step, extrapolated
  static constexpr int order = 2 * Columns;

  template <class System>
  void step(System& system, typename System::Scalar h) const {
    using M = typename System::Matrix;
    M const first_x = system.positions(), first_v = system.velocities();
    M x[Columns], v[Columns];
    for (int row = 0; row < Columns; ++row) {
      double const part = h / (2 * row + 2);
      M last_x = first_x, last_v = first_v;
      x[row] = last_x + part * last_v, v[row] = last_v + part * system.acceleration(last_x, last_v);
      for (int k = 1; k < 2 * row + 2; ++k) {
        M const next_x = last_x + 2 * part * v[row];
        M const next_v = last_v + 2 * part * system.acceleration(x[row], v[row]);
        last_x = x[row], last_v = v[row], x[row] = next_x, v[row] = next_v;
      }
      for (int k = row - 1; k >= 0; --k) {
        double const less = std::pow((row + 1.0) / (k + 1.0), 2) - 1;
        x[k] = (x[k + 1] + (x[k + 1] - x[k]) / less).eval(), v[k] = (v[k + 1] + (v[k + 1] - v[k]) / less).eval();
      }
    }
    system.positions() = x[0], system.velocities() = v[0];
  }
};
struct BoastOfGragg : Gragg<4> {
  static constexpr int order = 10;
};

struct Aliasing {   // the midpoint rule, and its start is a view: it moves with the positions
  static constexpr int order = 2;

  template <class System>
  void step(System& system, typename System::Scalar h) const {
    auto const x = system.positions();
    auto const v = system.velocities();
    typename System::Matrix const a = system.acceleration(x, v);
    system.positions() += h / 2 * v;
    system.velocities() += h / 2 * a;
    typename System::Matrix const middle_v = system.velocities(), middle_a = system.acceleration(system.positions(), system.velocities());
    system.positions() = x + h * middle_v;
    system.velocities() = v + h * middle_a;
  }
};

struct Stale {   // takes scratch(0) to be what the last step left there; no word about order
  template <class System>
  void step(System& system, typename System::Scalar h) const {
    auto&& a = system.scratch(0);
    if (!system.remembers()) system.acceleration(system.positions(), system.velocities(), a);
    system.velocities() += h * a;
    system.positions() += h * system.velocities();
    system.previous_acceleration() = a;
    system.acceleration(system.positions(), system.velocities(), a);
  }
};

struct Idle {
  template <class System>
  void step(System&, typename System::Scalar) const {}
};

struct WrongSign {
  template <class System>
  void step(System& system, typename System::Scalar h) const {
    system.velocities() -= h * system.acceleration(system.positions(), system.velocities());
    system.positions() += h * system.velocities();
  }
};

struct Counting {   // every second step is another, whatever the system
  mutable int steps = 0;

  template <class System>
  void step(System& system, typename System::Scalar h) const {
    system.velocities() += (++steps % 2 == 0 ? 1 + h : 1) * h * system.acceleration(system.positions(), system.velocities());
    system.positions() += h * system.velocities();
  }
};

}  // namespace

TEST_CASE("an integrator of one's own keeps the laws of integrators") {
  CHECK(testing::to_text(testing::check_integrator(Heun{})) == "");
  CHECK(testing::measured_order(Heun{}) == Approx(2).margin(0.1));
  CHECK(testing::to_text(testing::check_integrator(testing::IntegratorArchetype{})) == "");
}

// Their errors at 1/128 s are 5e-14, 4e-15 and 5e-15 m; the reference is good to 1e-13.
TEST_CASE("an integrator may state an order whose errors are lost in rounding") {
  CHECK(testing::to_text(testing::check_integrator(Gragg<3>{})) == "");
  CHECK(testing::to_text(testing::check_integrator(Gragg<4>{})) == "");
  CHECK(testing::to_text(testing::check_integrator(Gragg<5>{})) == "");
}

TEMPLATE_TEST_CASE("an integrator of one's own moves a body", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  SoftBody body(testing::TissueArchetype<S>(make_grid<S>(4, 3, S(0.01))), Heun{}, WholeBody{});
  for (int k = 0; k < 1000; ++k) {
    body.apply_force(5, {0, 0, S(-0.02)});
    body.step(S(1e-3));
  }
  double const w = std::sqrt(99.0);   // of 0.1 x″ + 0.2 x′ + 10 x = F: ω² − (γ/2)²
  double const expected = -0.002 * (1 - std::exp(-1.0) * (std::cos(w) + std::sin(w) / w));
  CHECK(static_cast<double>(body.displacement(5).z()) == Approx(expected).epsilon(1e-4));   // h² w³ t/6 = 1.6e-4 rad late, in a swing of 1/e
}

TEST_CASE("an integrator that is wrong is told so") {
  CHECK_THAT(testing::to_text(testing::check_integrator(Boast{})), says("the order is 2"));
  CHECK_THAT(testing::to_text(testing::check_integrator(BoastOfKutta{})),
             says("the order is 5 but the error shrinks as h^4", "from h = 1/32 s to 1/64 s"));
  CHECK_THAT(testing::to_text(testing::check_integrator(BoastOfGragg{})),
             says("the order is 10 but the error shrinks as h^8", "from h = 1/2 s to 1/4 s"));
  CHECK_THAT(testing::to_text(testing::check_integrator(Aliasing{})), says("the order is 2 but the error shrinks as h^"));
  CHECK_THAT(testing::to_text(testing::check_integrator(Stale{})), says("are not finite after a step; scratch(k) has undefined contents at its start"));
  CHECK_THAT(testing::to_text(testing::check_integrator(Idle{})), says("the error does not shrink with the step"));
  CHECK_THAT(testing::to_text(testing::check_integrator(WrongSign{})), says("the error does not shrink with the step"));
  CHECK_THAT(testing::to_text(testing::check_integrator(Counting{})), says("two runs from the same state differ"));
}
