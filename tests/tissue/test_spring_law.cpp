// SPDX-License-Identifier: MIT
// Yardsticks: the formulas of the sources, integrals by hand, and the law battery that users run on their own laws.
#include <palpate/testing/spring_law.hpp>
#include <palpate/tissue/linear_spring.hpp>
#include <palpate/tissue/mass_spring_options.hpp>
#include <palpate/tissue/saturating_spring.hpp>

#include "catch.hpp"

#include <cmath>

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

std::string faults(Broken const& law) { return testing::to_text(testing::check_spring_law(law, 1.0)); }

}  // namespace

TEMPLATE_TEST_CASE("shipped and user laws obey the laws of springs", "", float, double) {
  using S = TestType;
  for (S const length : {S(0.002), S(0.1), S(3)}) {
    CHECK(testing::to_text(testing::check_spring_law(LinearSpring<S>{.stiffness = S(80), .damping = S(0.1)}, length)) == "");
    CHECK(testing::to_text(testing::check_spring_law(
              SaturatingSpring<S>{.stiffness = S(80), .largest_tension = S(20) * length, .damping = S(0.1)}, length)) == "");
    CHECK(testing::to_text(testing::check_spring_law(ToeSpring<S>{S(50), length / 5, S(0)}, length)) == "");
  }
}

TEST_CASE("the battery names each fault of a law") {
  CHECK(faults({}) == "");
  CHECK_THAT(faults({.damping = -1}), Catch::Contains("damping is -1 N s/m; it must be finite and not negative"));
  CHECK_THAT(faults({.fault = 1}), Catch::Contains("tension(0, L) is 0.1 N; a link at rest must not pull"));
  CHECK_THAT(faults({.fault = 2}), Catch::Contains("tension jumps by 0.05"));
  CHECK_THAT(faults({.fault = 3}), Catch::Contains("a short stretch must pull and a short compression push"));
  CHECK_THAT(faults({.fault = 4}), Catch::Contains("tension(0.25, 1) is not finite"));
  CHECK_THAT(faults({.fault = 5}), Catch::Contains("tangent_stiffness(-0.484375, 1) is 2 N/m; the tension grows by 1"));
  CHECK_THAT(faults({.fault = 6}), Catch::Contains("J; the tension does a work of"));
}

TEMPLATE_TEST_CASE("a saturating spring is d/(a|d| + b): soft at the end, never stronger than its largest tension", "", float, double) {
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
}

TEMPLATE_TEST_CASE("stiffness and energy of a law that states neither are found from its tension", "", float, double) {
  using S = TestType;
  bool const single = std::same_as<S, float>;
  ToeSpring<S> const spring{S(50), S(0.002), S(0)};
  for (double const d : {-0.001, 0.0, 0.0005, 0.003}) {
    CHECK(double(tangent_stiffness_of(spring, S(d), S(0.01))) == Approx(50 * (1 + 3 * d * d / 4e-6)).epsilon(single ? 5e-3 : 1e-6));
    CHECK(double(energy_of(spring, S(d), S(0.01))) == Approx(25 * d * d * (1 + d * d / 8e-6)).epsilon(single ? 1e-5 : 1e-12));
  }
}
