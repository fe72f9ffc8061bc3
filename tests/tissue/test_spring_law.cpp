// SPDX-License-Identifier: MIT
// Yardsticks: the formulas of the sources, integrals by hand, and the law battery that users run on their own laws.
#include <palpate/testing/spring_law.hpp>
#include <palpate/tissue/cubic_spring.hpp>
#include <palpate/tissue/linear_spring.hpp>
#include <palpate/tissue/locking_spring.hpp>
#include <palpate/tissue/mass_spring_options.hpp>
#include <palpate/tissue/saturating_spring.hpp>

#include <palpate/core/random.hpp>

#include "catch.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <string>

using namespace palpate;

namespace {

template <class S>
struct ToeSpring {   // a user's law: neither stiffness nor energy stated
  S stiffness;
  S toe;
  S damping;
  S tension(S elongation, S /*rest_length*/) const {
    return stiffness * elongation * (1 + elongation * elongation / (toe * toe));
  }
};

struct Broken {
  double damping = 0;
  int fault = 0;
  double tension(double d, double) const {
    switch (fault) {
      case 1: return d + 0.1;                     // pulls at rest
      case 2: return d > 0.3 ? d + 0.05 : d;      // jumps
      case 3: return -d;                          // pushes when stretched
      case 4: return 1.0 / (d - 0.25) + 4.0;      // has a pole at one of the elongations tried
      default: return d;
    }
  }
  double tangent_stiffness(double, double) const { return fault == 5 ? 2.0 : fault == 0 || fault == 6 ? 1.0 : (tension(1e-7, 1) - tension(-1e-7, 1)) / 2e-7; }
  double energy(double d, double) const { return fault == 6 ? d * d : d * d / 2; }
};

struct Yielding {   // says that it is monotone, but gives way beyond 0.4
  double damping = 0;
  bool says = true;
  double tension(double d, double) const { return d > 0.4 ? 0.8 - d : d; }
  bool monotone(double) const { return says; }
};

/// T by the formula of the source, dT/dδ by a difference of it in long double, ∫T by the midpoint rule.
template <class S, class Law, class Formula>
void check_against(Law const& law, Formula formula, std::initializer_list<double> elongations) {
  bool const single = std::same_as<S, float>;
  for (double const d : elongations) {
    CAPTURE(d);
    long double const h = 1e-6L, e = d;
    double const slope = static_cast<double>((formula(e + h) - formula(e - h)) / (2 * h));
    long double work = 0;
    int const pieces = 20000;
    for (int k = 0; k < pieces; ++k) work += formula(e * (k + 0.5L) / pieces) * e / pieces;
    CHECK(double(law.tension(S(d), S(1))) == Approx(static_cast<double>(formula(e))).epsilon(single ? 1e-5 : 1e-12));
    CHECK(double(law.tangent_stiffness(S(d), S(1))) == Approx(slope).epsilon(single ? 1e-4 : 1e-6));
    CHECK(double(law.energy(S(d), S(1))) == Approx(static_cast<double>(work)).epsilon(single ? 2e-5 : 1e-7));
  }
}

std::string faults(Broken const& law) { return testing::to_text(testing::check_spring_law(law, 1.0)); }

}  // namespace

TEMPLATE_TEST_CASE("shipped and user laws obey the laws of springs", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  for (S const length : {S(0.002), S(0.1), S(3)}) {
    CHECK(testing::to_text(testing::check_spring_law(LinearSpring<S>{.stiffness = S(80), .damping = S(0.1)}, length)) == "");
    CHECK(testing::to_text(testing::check_spring_law(
              SaturatingSpring<S>{.stiffness = S(80), .largest_tension = S(20) * length, .damping = S(0.1)}, length)) == "");
    for (double const guard : {0.0, 0.5, 0.9})
      CHECK(testing::to_text(testing::check_spring_law(LockingSpring<S>{.stiffness = S(80), .largest_tension = S(23) * length, .damping = S(0.1),
                                                                        .guard = S(guard)}, length)) == "");
    CHECK(testing::to_text(testing::check_spring_law(
              CubicSpring<S>{.stiffness = S(80), .quadratic = S(60) / length, .cubic = S(20) / (length * length)}, length)) == "");
    CHECK(testing::to_text(testing::check_spring_law(CubicSpring<S>{.stiffness = S(80), .quadratic = S(-60) / length,
                                                                    .cubic = S(20) / (length * length), .damping = S(1)}, length)) == "");
    CHECK(testing::to_text(testing::check_spring_law(ToeSpring<S>{S(50), length / 5, S(0)}, length)) == "");
  }
}

TEST_CASE("the battery names each fault of a law") {
  CHECK(faults({}) == "");
  CHECK_THAT(faults({.damping = -1}), says("damping is -1 N s/m", "not negative"));
  CHECK_THAT(faults({.fault = 1}), says("tension(0, L) is 0.1 N", "at rest"));
  CHECK_THAT(faults({.fault = 2}), says("tension jumps by 0.05"));
  CHECK_THAT(faults({.fault = 3}), says("must pull", "push"));
  CHECK_THAT(faults({.fault = 4}), says("tension(0.25, 1) is not finite"));
  CHECK_THAT(faults({.fault = 5}), says("tangent_stiffness(-0.484375, 1) is 2 N/m", "grows by 1"));
  CHECK_THAT(faults({.fault = 6}), says("does a work of"));
  std::string const yields = testing::to_text(testing::check_spring_law(Yielding{}, 1.0));
  CHECK_THAT(yields, says("tension goes from ", "but monotone(1) is true"));
  CHECK(testing::to_text(testing::check_spring_law(Yielding{.says = false}, 1.0)) == "");
}

TEMPLATE_TEST_CASE("a locking spring is d/(ad + b) up to its guard, and its tangent from there", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  LockingSpring<S> const spring{.stiffness = S(80), .largest_tension = S(2), .damping = S(0), .guard = S(0.75)};
  long double const a = 0.5L, b = 1.0L / 80, pole = -b / a, guard = 0.75L * pole;
  auto const printed = [&](long double d) { return d / (a * d + b); };
  auto const guarded = [&](long double d) {
    return d > guard ? printed(d) : printed(guard) + (d - guard) * b / ((a * guard + b) * (a * guard + b));
  };
  check_against<S>(spring, guarded, {-1.0, -0.1, double(pole), -0.02, -0.0185, -0.01, -0.0001, 0.0003, 0.005, 0.1, 3.0});
  for (double const d : {-1.0, double(pole), 0.0, 10.0}) CHECK(std::isfinite(spring.tension(S(d), S(1))));
  CHECK(spring.tension(S(1e6), S(1)) <= S(2));
  // C¹ at the guard: value and slope from both sides, and no more slope than k/(1 − g)².
  S const g = S(guard), near = S(1e-5) * g;
  CHECK(double(spring.tension(g - near, S(1))) == Approx(double(spring.tension(g + near, S(1)))).epsilon(2e-4));
  CHECK(double(spring.tangent_stiffness(g - near, S(1))) == Approx(double(spring.tangent_stiffness(g + near, S(1)))).epsilon(2e-4));
  CHECK(double(spring.tangent_stiffness(S(-1), S(1))) == Approx(80.0 * 16));
  CHECK_FALSE(LockingSpring<S>{.guard = S(1)}.monotone(S(1)));
  CHECK_FALSE(LockingSpring<S>{.guard = S(-0.1)}.monotone(S(1)));
  CHECK_FALSE(LockingSpring<S>{.largest_tension = S(-1)}.monotone(S(1)));
}

TEMPLATE_TEST_CASE("a cubic spring is its polynomial", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  CubicSpring<S> const spring{.stiffness = S(80), .quadratic = S(-300), .cubic = S(5000), .damping = S(0)};
  check_against<S>(spring, [](long double d) { return 80 * d - 300 * d * d + 5000 * d * d * d; }, {-0.2, -0.03, -1e-4, 2e-4, 0.05, 0.3});
}

TEST_CASE("a cubic spring says where it is monotone") {
  // Yardstick: the least slope over a fine grid of elongations from −L on.
  Random random(Seed{7});
  int yes = 0, no = 0;
  for (int k = 0; k < 500; ++k) {
    CubicSpring<double> const law{.stiffness = 1.0, .quadratic = random.uniform(-3.0, 3.0), .cubic = random.uniform(-0.3, 3.0)};
    double const length = random.uniform(0.05, 3.0);
    double least = 1.0;
    for (int m = 0; m <= 4000; ++m) least = std::min(least, law.tangent_stiffness(-length + m * (length + 30.0) / 4000, length));
    if (std::abs(least) < 1e-3) continue;   // the grid can not tell
    CAPTURE(law.quadratic, law.cubic, length, least);
    CHECK(law.monotone(length) == (least > 0));
    ++(least > 0 ? yes : no);
  }
  CHECK((yes > 50 && no > 50));
}

TEMPLATE_TEST_CASE("a saturating spring is d/(a|d| + b): soft at the end, never stronger than its largest tension", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  SaturatingSpring<S> const spring{.stiffness = S(80), .largest_tension = S(2), .damping = S(0)};
  double const a = 0.5, b = 1.0 / 80;
  for (double const d : {-0.3, -0.01, 0.0, 0.002, 0.05, 1.0, 1e4}) {
    CHECK(double(spring.tension(S(d), S(1))) == Approx(d / (a * std::abs(d) + b)).epsilon(1e-5));
    CHECK(double(spring.tangent_stiffness(S(d), S(1))) == Approx(b / std::pow(a * std::abs(d) + b, 2)).epsilon(1e-5));
    // ∫ s/(as + b) ds = d/a − (b/a²) ln(1 + a d/b)
    double const length = std::abs(d);
    CHECK(double(spring.energy(S(d), S(1))) == Approx(length / a - b / (a * a) * std::log1p(a * length / b)).epsilon(1e-3).margin(1e-7));
    CHECK(std::abs(spring.tension(S(d), S(1))) <= S(2));
  }
  // With s = |d|/r, r = b/a, the energy is T r (s²/2 − s³/3 + …): what is left of a small s has its digits.
  double const reach = 2.0 / 80;
  for (double const s : {1e-9, 1e-5, 1e-3, 0.0199, 0.0201, 0.3}) {
    double exact = s - std::log1p(s);
    if (s < 0.1) {
      exact = 0;
      for (int n = 12; n >= 2; --n) exact += (n % 2 == 0 ? 1 : -1) * std::pow(s, n) / n;
    }
    CHECK(double(spring.energy(S(s * reach), S(1))) == Approx(2 * reach * exact).epsilon(std::same_as<S, float> ? 1e-4 : 1e-11).margin(0));
  }
}

TEMPLATE_TEST_CASE("stiffness and energy of a law that states neither are found from its tension", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  bool const single = std::same_as<S, float>;
  ToeSpring<S> const spring{S(50), S(0.002), S(0)};
  for (double const d : {-0.001, 0.0, 0.0005, 0.003}) {
    CHECK(double(tangent_stiffness_of(spring, S(d), S(0.01))) == Approx(50 * (1 + 3 * d * d / 4e-6)).epsilon(single ? 5e-3 : 1e-6));
    CHECK(double(energy_of(spring, S(d), S(0.01))) == Approx(25 * d * d * (1 + d * d / 8e-6)).epsilon(single ? 1e-5 : 1e-12));
  }
}
