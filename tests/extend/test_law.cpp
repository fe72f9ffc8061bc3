// SPDX-License-Identifier: MIT
// A spring law of one's own needs palpate/extend/law.hpp and nothing else. Yardstick: the battery's differences and quadrature, of the law and of
// tissue of it.
#include <palpate/extend/law.hpp>

#include "catch.hpp"

#include <palpate/mesh/grid.hpp>
#include <palpate/testing/tissue.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <cmath>

/// Collagen, as Fung has it: soft at first, then exponentially stiffer, T = k a (exp(δ/a) − 1).
template <palpate::RealScalar Scalar>
struct FungSpring {
  Scalar stiffness = 50;         // N/m, k: at rest
  Scalar toe = Scalar(0.005);    // m, a: where it has grown e-fold
  Scalar damping = 0;            // N·s/m

  Scalar tension(Scalar elongation, Scalar /*rest_length*/) const { return stiffness * toe * std::expm1(elongation / toe); }

  // optional
  Scalar tangent_stiffness(Scalar elongation, Scalar) const { return stiffness * std::exp(elongation / toe); }
  Scalar energy(Scalar elongation, Scalar) const { return stiffness * toe * (toe * std::expm1(elongation / toe) - elongation); }
  bool monotone(Scalar) const { return true; }
};
static_assert(palpate::SpringLaw<FungSpring<double>, double> && palpate::StatesStiffness<FungSpring<double>, double> &&
              palpate::StatesEnergy<FungSpring<double>, double> && palpate::StatesMonotony<FungSpring<double>, double>);

static_assert(palpate::HasStiffness<FungSpring<float>, float> && !palpate::HasStiffness<palpate::testing::LawArchetype<double>, double>);
static_assert(!palpate::StatesStiffness<palpate::testing::LawArchetype<double>, double> && !palpate::StatesEnergy<palpate::testing::LawArchetype<double>, double>);

using namespace palpate;

TEMPLATE_TEST_CASE("a law of one's own keeps the laws of springs", "", PALPATE_TEST_SCALARS) {
  CHECK(testing::to_text(testing::check_spring_law(FungSpring<TestType>{}, TestType(0.01))) == "");
  CHECK(testing::to_text(testing::check_spring_law(testing::LawArchetype<TestType>{}, TestType(0.01))) == "");
}

TEMPLATE_TEST_CASE("tissue of a law of one's own keeps the laws of tissue", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  MassSpring<S, FungSpring<S>> const tissue(make_grid<S>(4, 4, S(0.01)), {.mass = {.total = S(0.1)}, .link = {.stiffness = S(80), .damping = S(0.1)}});
  CHECK(testing::to_text(testing::check_tissue(tissue, {.isolated = true})) == "");
}

TEST_CASE("a law that is wrong is told so") {
  struct Slack : FungSpring<double> {   // its energy is that of a linear spring
    double energy(double elongation, double) const { return stiffness * elongation * elongation / 2; }
  };
  CHECK_THAT(testing::to_text(testing::check_spring_law(Slack{}, 0.01)), says("energy(", "the tension does a work of"));
  struct Divides : FungSpring<double> {   // 0/0 at rest, where an implicit step asks
    double tangent_stiffness(double elongation, double length) const { return elongation == 0 ? std::nan("") : FungSpring<double>::tangent_stiffness(elongation, length); }
  };
  CHECK_THAT(testing::to_text(testing::check_spring_law(Divides{}, 0.01)), says("tangent_stiffness(0, 0.01) is", "finite"));
  struct Charged : FungSpring<double> {
    double energy(double elongation, double length) const { return elongation == 0 ? 1 : FungSpring<double>::energy(elongation, length); }
  };
  CHECK_THAT(testing::to_text(testing::check_spring_law(Charged{}, 0.01)), says("energy(0, 0.01) is 1 J"));
}
