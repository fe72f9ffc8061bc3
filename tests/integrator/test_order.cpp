// SPDX-License-Identifier: MIT
// Yardsticks: the closed forms of one damped particle, and an extrapolated midpoint reference that uses none of these integrators.
#include <palpate/testing/integrator.hpp>

#include "catch.hpp"
#include "integrators.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <regex>
#include <set>
#include <string>
#include <tuple>

using namespace palpate;

namespace {

struct Midpoint {   // of a user: no remembered acceleration, no stable step, matrices instead of scratch
  static constexpr int order = 2;

  template <class System>
  void step(System& system, typename System::Scalar h) const {
    using Matrix = typename System::Matrix;
    Matrix const x = system.positions();
    Matrix const v = system.velocities();
    Matrix const half_v = v + h / 2 * system.acceleration(x, v);
    system.positions() = x + h * half_v;
    system.velocities() = v + h * system.acceleration(x + h / 2 * v, half_v);
  }
};

struct PlainLeapfrog {   // forgets that damping belongs into the middle of the step: first order, although it says 2
  static constexpr int order = 2;

  template <class System>
  void step(System& system, typename System::Scalar h) const {
    system.positions() += h / 2 * system.velocities();
    typename System::Matrix const a = system.acceleration(system.positions(), system.velocities());
    system.velocities() += h * a;
    system.positions() += h / 2 * system.velocities();
  }
};

struct PlainStoermer {   // damping by the velocity of the step before, v = (x − x₋)/h: half a step late
  template <class System>
  void step(System& system, typename System::Scalar h) const {
    typename System::Matrix const a = system.acceleration(system.positions(), system.velocities());
    if (system.remembers())
      system.velocities() += h * a;
    else
      system.velocities() += h / 2 * a;   // (x₁ − x₀)/h
    system.positions() += h * system.velocities();
    system.previous_acceleration() = a;
  }
};

struct PlainVelocityVerlet {   // damping at the end of the step by the velocity of its start
  template <class System>
  void step(System& system, typename System::Scalar h) const {
    using Matrix = typename System::Matrix;
    Matrix const a = system.acceleration(system.positions(), system.velocities());
    system.positions() += h * system.velocities() + h * h / 2 * a;
    Matrix const later = system.acceleration(system.positions(), system.velocities());
    system.velocities() += h / 2 * (a + later);
  }
};

struct LinearisedCrankNicolson : CrankNicolson {   // one Newton iteration with a tangent that is not quite the derivative
  LinearisedCrankNicolson() : CrankNicolson{.newton_iterations = 1} {}
};

struct Restless : Midpoint {   // moves without time
  template <class System>
  void step(System& system, typename System::Scalar h) const {
    Midpoint::step(system, h);
    system.positions() *= 1 + 1e-15;
  }
};

struct Boastful : LeapfrogVerlet {   // states twice its stable step
  template <RealScalar Scalar>
  Scalar stable_step(ModalBounds<Scalar> const& modes) const {
    return 2 * LeapfrogVerlet::stable_step(modes);
  }
};

/// Particles on home springs, one a column, each with its own damping ratio.
template <RealScalar S>
struct HomeSprings {
  using Scalar = S;
  using Matrix = Matrix3X<S>;

  explicit HomeSprings(std::array<double, 5> const& ratios) : x(3, 5), v(3, 5), memory(Matrix::Zero(3, 5)) {
    x.setZero();
    v.setZero();
    v.row(2).setConstant(S(0.5));
    for (int i = 0; i < 5; ++i) damping[i] = S(2 * ratios[static_cast<std::size_t>(i)] * 4.0 * 0.01);
    for (auto& columns : unused) columns.setConstant(3, 5, std::numeric_limits<S>::quiet_NaN());
  }
  Matrix& positions() { return x; }
  Matrix& velocities() { return v; }
  template <class X, class V>
  Matrix acceleration(X const& at, V const& speed) const {
    return (-S(0.16) * at - speed * damping.asDiagonal()) / S(0.01);
  }
  template <class X, class V, class Out>
  void acceleration(X const& at, V const& speed, Out&& out) const {
    out = acceleration(at, speed);
  }
  void linearise() {}
  template <class D, class Out>
  void multiply_tangent(S m, S c, S k, D const& d, Out&& out) const {
    out = d * (Eigen::Matrix<S, 5, 1>::Constant(m * S(0.01) + k * S(0.16)) + c * damping).asDiagonal();
  }
  template <class Out>
  void tangent_diagonal(S m, S c, S k, Out&& out) const {
    multiply_tangent(m, c, k, Matrix::Ones(3, 5), out);
  }
  Matrix& scratch(int k) { return unused[k]; }
  Matrix& previous_acceleration() { return memory; }
  bool remembers() const { return any_step; }

  Matrix x, v, memory;
  Eigen::Matrix<S, 5, 1> damping;
  Matrix unused[12];
  bool any_step = false;
};

/// TwoParticles after a time, by Gragg's midpoint rule with 2, 4, … 12 parts, extrapolated to order 12.
std::array<Matrix3X<double>, 2> exact_after(double time) {
  constexpr int rows = 6;
  Matrix3X<double> table_x[rows], table_v[rows];
  testing::TwoParticles start;
  for (int row = 0; row < rows; ++row) {
    int const parts = 2 * (row + 1);
    double const h = time / parts;
    Matrix3X<double> last_x = start.positions(), last_v = start.velocities();
    Matrix3X<double> x = last_x + h * last_v, v = last_v + h * start.acceleration(last_x, last_v);
    for (int k = 1; k < parts; ++k) {
      Matrix3X<double> const next_x = last_x + 2 * h * v, next_v = last_v + 2 * h * start.acceleration(x, v);
      last_x = x, last_v = v;
      x = next_x, v = next_v;
    }
    table_x[row] = (last_x + x + h * v) / 2;
    table_v[row] = (last_v + v + h * start.acceleration(x, v)) / 2;
    for (int k = row - 1; k >= 0; --k) {
      double const ratio = std::pow(static_cast<double>(row + 1) / (k + 1), 2) - 1;
      table_x[k] = (table_x[k + 1] + (table_x[k + 1] - table_x[k]) / ratio).eval();
      table_v[k] = (table_v[k + 1] + (table_v[k + 1] - table_v[k]) / ratio).eval();
    }
  }
  return {table_x[0], table_v[0]};
}

/// log₂ of the ratio of the errors of one step of h and of h/2 on TwoParticles, of positions and of velocities.
template <class I>
std::array<double, 2> local_orders(I const& integrator, double h) {
  double error[2][2];
  for (int half = 0; half < 2; ++half, h /= 2) {
    testing::TwoParticles system;
    auto const [x, v] = exact_after(h);
    system.advance(integrator, h);
    error[half][0] = (system.positions() - x).norm();
    error[half][1] = (system.velocities() - v).norm();
  }
  return {std::log2(error[0][0] / error[1][0]), std::log2(error[0][1] / error[1][1])};
}

/// Distance of TwoParticles from where they should be after a second with 64 steps.
template <class I>
double global_error(I const& integrator) {
  return testing::measured_error(integrator, 1.0 / 64);
}

template <class I>
void print_orders(char const* name) {
  std::array<double, 2> const local = local_orders(I{}, 1.0 / 64);
  std::printf("| %s | %.2f | %.2f | %.2f | %.1e |\n", name, local[0], local[1], testing::measured_order(I{}), global_error(I{}));
}

/// Impulse response of m x″ + d x′ + k x = 0, x(0) = 0, x′(0) = 0.5, ω = 4.
double impulse_response(double ratio, double t) {
  double const decay = std::exp(-ratio * 4.0 * t);
  if (ratio > 1) return 0.5 / (4 * std::sqrt(ratio * ratio - 1)) * decay * std::sinh(4 * std::sqrt(ratio * ratio - 1) * t);
  if (ratio == 1) return 0.5 * t * decay;
  return 0.5 / (4 * std::sqrt(1 - ratio * ratio)) * decay * std::sin(4 * std::sqrt(1 - ratio * ratio) * t);
}

}  // namespace

// Yardstick: the headers themselves, those that state a stable step, and the types in them that step.
TEST_CASE("the tests' list of integrators has all that the headers declare") {
  auto const text_of = [](std::filesystem::path const& path) {
    std::ifstream file(path);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  std::filesystem::path const root = std::filesystem::path(__FILE__).parent_path() / ".." / "..";
  std::string const list = text_of(root / "tests" / "integrators.hpp");
  std::regex const declared("\n(?:struct|class) (\\w+) \\{");
  std::set<std::string> names;
  for (auto const& header : std::filesystem::directory_iterator(root / "include" / "palpate" / "integrator")) {
    if (!header.is_regular_file() || header.path().filename() == "concept.hpp") continue;
    std::string const text = text_of(header.path());
    if (text.find("stable_step(") == std::string::npos) continue;
    for (std::sregex_iterator name(text.begin(), text.end(), declared), end; name != end; ++name)
      if (auto const from = static_cast<std::size_t>(name->position()) + 1; text.substr(from, text.find("\n};", from) - from).find(" step(S& ") != std::string::npos)
        names.insert((*name)[1]);
  }
  for (auto const& name : names) {
    CAPTURE(name);
    CHECK(list.find("palpate::" + name) != std::string::npos);
  }
  CHECK(names.size() == std::tuple_size_v<AllIntegrators>);
}

TEMPLATE_LIST_TEST_CASE("every integrator obeys the laws of its family", "", AllIntegrators) {
  CHECK(testing::to_text(testing::check_integrator(TestType{})) == "");
}

TEST_CASE("an integrator of a user's obeys them as well") { CHECK(testing::to_text(testing::check_integrator(Midpoint{})) == ""); }

TEMPLATE_TEST_CASE("the measured global order is the stated one, damped and from the first step on", "", ExplicitEuler, SymplecticEuler,
                   StoermerVerlet, LeapfrogVerlet, VelocityVerlet, ExplicitMidpoint, RungeKutta4, BackwardEuler, CrankNicolson) {
  double const order = testing::measured_order(TestType{});
  CHECK(order > TestType::order - 0.1);
  CHECK(order < TestType::order + 0.1);
}

TEMPLATE_TEST_CASE_SIG("the measured local order, of positions and of velocities", "", ((class I, int X, int V), I, X, V),
                       (ExplicitEuler, 2, 2), (SymplecticEuler, 2, 2), (StoermerVerlet, 3, 2), (LeapfrogVerlet, 3, 3), (VelocityVerlet, 3, 3),
                       (ExplicitMidpoint, 3, 3), (RungeKutta4, 5, 5), (BackwardEuler, 2, 2), (CrankNicolson, 3, 3)) {
  // One step from exact values, its memory empty: global errors are one order lower. Störmer's first velocity step is Euler's.
  std::array<double, 2> const order = local_orders(I{}, 1.0 / 64);
  CHECK(order[0] == Approx(X).margin(0.15));
  CHECK(order[1] == Approx(V).margin(0.15));
}

TEST_CASE("the formula behind Dormand and Prince's steps has order 5, local error 6") {
  DormandPrince const loose{.relative = 1e9};   // every step is one inner step
  CHECK(testing::measured_order(loose, 1.0 / 64) == Approx(5.0).margin(0.2));
  std::array<double, 2> const order = local_orders(loose, 1.0 / 16);
  CHECK(order[0] > 5.8);
  CHECK(order[1] > 5.8);
}

TEST_CASE("Dormand and Prince's steps meet their tolerance whatever the step asked for") {
  Matrix3X<double> const exact = testing::TwoParticles::reference_positions();
  for (double const relative : {1e-4, 1e-6, 1e-8, 1e-10})
    for (int const steps : {1, 7, 100}) {
      testing::TwoParticles system;
      for (int k = 0; k < steps; ++k) system.advance(DormandPrince{.relative = relative}, 1.0 / steps);
      CAPTURE(relative, steps);
      CHECK((system.positions() - exact).norm() < 20 * relative + 1e-12);
    }
  CHECK(testing::to_text(testing::check_integrator(DormandPrince{.relative = 1e-11})) == "");   // no smaller for a smaller step
}

TEST_CASE("Dormand and Prince's step gives up with a position that is not a number") {
  testing::TwoParticles few, poles;
  few.advance(DormandPrince{.relative = 1e-12, .max_inner_steps = 3}, 1.0);
  CHECK(!few.positions().allFinite());
  poles.velocities().setConstant(std::numeric_limits<double>::infinity());
  poles.advance(DormandPrince{}, 1.0);
  CHECK(!poles.positions().allFinite());
}

TEST_CASE("damping at the wrong time level costs the Verlet forms an order, and digits") {
  CHECK(testing::measured_order(PlainLeapfrog{}) == Approx(1.0).margin(0.1));
  CHECK(testing::measured_order(PlainStoermer{}) == Approx(1.0).margin(0.1));
  CHECK(testing::measured_order(PlainVelocityVerlet{}) == Approx(1.0).margin(0.1));
  // Errors after a second with 64 steps.
  CHECK(global_error(PlainLeapfrog{}) > 10 * global_error(LeapfrogVerlet{}));
  CHECK(global_error(PlainStoermer{}) > 10 * global_error(StoermerVerlet{}));
  CHECK(global_error(PlainVelocityVerlet{}) > 10 * global_error(VelocityVerlet{}));
}

TEST_CASE("the table of orders and errors in docs/integrators.md", "[.table]") {
  print_orders<ExplicitEuler>("ExplicitEuler"), print_orders<SymplecticEuler>("SymplecticEuler"), print_orders<StoermerVerlet>("StoermerVerlet");
  print_orders<LeapfrogVerlet>("LeapfrogVerlet"), print_orders<VelocityVerlet>("VelocityVerlet"), print_orders<ExplicitMidpoint>("ExplicitMidpoint");
  print_orders<RungeKutta4>("RungeKutta4"), print_orders<BackwardEuler>("BackwardEuler"), print_orders<CrankNicolson>("CrankNicolson");
  print_orders<LinearisedCrankNicolson>("CrankNicolson, one iteration"), print_orders<PlainStoermer>("plain Stoermer"), print_orders<PlainLeapfrog>("plain leapfrog");
  print_orders<PlainVelocityVerlet>("plain velocity Verlet");
}

TEST_CASE("Crank and Nicolson's step needs its second Newton iteration for its second order") {
  CHECK(testing::measured_order(LinearisedCrankNicolson{}) == Approx(1.0).margin(0.2));
  CHECK(global_error(LinearisedCrankNicolson{}) > 3 * global_error(CrankNicolson{}));
}

TEST_CASE("the laws catch integrators that break them") {
  CHECK_THAT(testing::to_text(testing::check_integrator(PlainLeapfrog{})), says("the order is 2 but the error shrinks as h^1.0"));
  CHECK_THAT(testing::to_text(testing::check_integrator(Restless{})), says("a step of zero moves the particles"));
  CHECK_THAT(testing::to_text(testing::check_integrator(Boastful{})), says("stable_step({1, 0, 0}) is 4 s, but the mode"));
}

TEMPLATE_PRODUCT_TEST_CASE("one particle on its home spring follows the closed forms, from overdamped to undamped", "", std::pair,
                           ((ExplicitEuler, double), (SymplecticEuler, double), (StoermerVerlet, double), (LeapfrogVerlet, double),
                            (VelocityVerlet, double), (ExplicitMidpoint, double), (RungeKutta4, double), (DormandPrince, double),
                            (BackwardEuler, double), (CrankNicolson, double), (CrankNicolson, float),
                            (StoermerVerlet, float), (LeapfrogVerlet, float), (VelocityVerlet, float), (ExplicitMidpoint, float),
                            (RungeKutta4, float), (DormandPrince, float))) {
  using I = typename TestType::first_type;
  using S = typename TestType::second_type;
  std::array<double, 5> const ratios{2.0, 1.0, 0.5, 0.1, 0.0};
  double const h = std::same_as<S, float> ? 1.0 / 128 : 1.0 / 1024;
  HomeSprings<S> particles(ratios);
  // Global error C h^order with C ≈ ω^order t/2 or less for these motions of amplitude 1/8; an adaptive method's is its tolerance.
  double tolerance = std::same_as<S, float> ? 1e-6 : 1e-13;
  if constexpr (requires { I::order; })
    tolerance = std::max(tolerance, 0.5 * std::pow(4 * h, I::order));
  else
    tolerance = std::max(tolerance, I{}.relative);
  int const steps = static_cast<int>(2.0 / h);
  for (int n = 1; n <= steps; ++n) {
    I{}.step(particles, S(h));
    particles.any_step = true;
    if (n % (steps / 16) != 0) continue;
    for (int i = 0; i < 5; ++i) {
      CAPTURE(n * h, ratios[static_cast<std::size_t>(i)]);
      CHECK(double(particles.x(2, i)) == Approx(impulse_response(ratios[static_cast<std::size_t>(i)], n * h)).margin(tolerance));
    }
  }
}
