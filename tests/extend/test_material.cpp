// SPDX-License-Identifier: MIT
// A material of one's own needs palpate/extend/material.hpp and nothing else. Yardstick: the battery's differences, of the law and of tissue of it.
#include <palpate/extend/material.hpp>

#include "catch.hpp"

#include <palpate/mesh/block.hpp>
#include <palpate/testing/tissue.hpp>
#include <palpate/tissue/finite_elements.hpp>

/// Rubber that can be compressed: ψ = μ/2 (F : F − 3) − μ (J − 1) + κ/2 (J − 1)², J = det F.
template <class T>
struct CompressibleRubber {
  T mu{}, bulk{};   // Pa; Hooke's law at small strain with mu and lambda = bulk - mu

  static constexpr bool isotropic = true;
  T bulk_modulus() const { return bulk - palpate::number<T>(1.0 / 3) * mu; }   // lambda + 2 mu / 3

  T energy(palpate::Tensor3<T> const& F) const {
    T const half = palpate::number<T>(0.5), volume = determinant(F, cofactor(F)) - palpate::number<T>(1);
    return half * mu * (double_contraction(F, F) - palpate::number<T>(3)) + (half * bulk * volume - mu) * volume;
  }
  palpate::Tensor3<T> stress(palpate::Tensor3<T> const& F) const {
    auto const cof = cofactor(F);
    return mu * F + (bulk * (determinant(F, cof) - palpate::number<T>(1)) - mu) * cof;
  }
  palpate::Tensor3<T> stress_change(palpate::Tensor3<T> const& F, palpate::Tensor3<T> const& dF) const {
    auto const cof = cofactor(F);
    return mu * dF + (bulk * double_contraction(cof, dF)) * cof + (bulk * (determinant(F, cof) - palpate::number<T>(1)) - mu) * cofactor_change(F, dF);
  }
};
static_assert(palpate::MaterialLaw<CompressibleRubber<double>, double> && palpate::IsIsotropicLaw<CompressibleRubber<double>> &&
              palpate::HasBulkModulus<CompressibleRubber<double>, double>);
static_assert(palpate::detail::IsLawOfNumbers<CompressibleRubber<double>, double, palpate::simd::Lanes<double>>, "computed in packs");

static_assert(palpate::Material<palpate::testing::MaterialArchetype<float>, float> && !palpate::IsIsotropicLaw<palpate::testing::MaterialArchetype<double>> &&
              !palpate::HasBulkModulus<palpate::testing::MaterialArchetype<double>, double>);

using namespace palpate;

TEMPLATE_TEST_CASE("a material of one's own keeps the laws of materials", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  double const mu = 1000, lambda = 9000;
  CHECK(testing::to_text(testing::check_material<S>(CompressibleRubber<S>{S(mu), S(lambda + mu)},
                                                    {.young = mu * (3 * lambda + 2 * mu) / (lambda + mu), .poisson = lambda / (2 * (lambda + mu))})) == "");
  CHECK(testing::to_text(testing::check_material<S>(testing::MaterialArchetype<S>{})) == "");
}

TEMPLATE_TEST_CASE("solids of a material of one's own keep the laws of tissue", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const mesh = make_block<S>(3, 3, 3, S(0.01), BlockPattern::alternating);
  auto const check = [](auto const& tissue) { CHECK(testing::to_text(testing::check_tissue(tissue, {.displacement = 0.05, .isolated = true})) == ""); };
  check(FiniteElements<S, CompressibleRubber<S>>(mesh, {.density = S(1000), .material = {.mu = S(1000), .bulk = S(1e4)}}));
  check(FiniteElements<S, CompressibleRubber<S>>(mesh, {.density = S(1000), .material = {.mu = S(1000), .bulk = S(1e4)}, .pressure = Pressure::nodal}));
  check(FiniteElements<S, testing::MaterialArchetype<S>>(mesh, {.density = S(1000), .material = {}}));
}

TEST_CASE("a material that is wrong is told so") {
  struct Slack : testing::MaterialArchetype<double> {   // its stress is twice the gradient of its energy
    Tensor3<double> stress(Tensor3<double> const& F) const { return 2.0 * testing::MaterialArchetype<double>::stress(F); }
  };
  CHECK_THAT(testing::to_text(testing::check_material<double>(Slack{})), says("stress", "energy"));
}
