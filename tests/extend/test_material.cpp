// SPDX-License-Identifier: MIT
// A material of one's own needs palpate/extend/material.hpp and nothing else. Yardstick: the battery's differences, of the law and of tissue of it.
#include <palpate/extend/material.hpp>

#include "catch.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/material/st_venant_kirchhoff.hpp>
#include <palpate/material/viscoelastic.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/testing/tissue.hpp>
#include <palpate/tissue/finite_elements.hpp>

#include <cstddef>
#include <limits>
#include <numeric>
#include <type_traits>
#include <utility>
#include <vector>

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

TEST_CASE("rubber of one's own is a solid with pressure at nodes, as docs/new_material.md makes it") {
  auto const mesh = make_block<double>(2, 2, 2, 0.01, BlockPattern::alternating);
  FiniteElements<double, CompressibleRubber<double>> tissue(
      mesh, {.density = 1000.0, .material = {.mu = 1000.0, .bulk = 1e4}, .pressure = Pressure::nodal});
  double mass = 0;
  for (int i = 0; i < tissue.size(); ++i) mass += tissue.mass(i);
  CHECK(mass == Approx(1000 * 1e-6));   // 10 mm cubed of 1000 kg/m³
}

namespace {

/// Hooke's law of Green's strain, which says neither that it is isotropic nor what of its tangent is semidefinite.
template <class T>
struct Hooke {
  StVenantKirchhoffLaw<T> law{T{} + number<T>(9000), T{} + number<T>(1000)};

  T bulk_modulus() const { return law.bulk_modulus(); }
  T energy(Tensor3<T> const& F) const { return law.energy(F); }
  Tensor3<T> stress(Tensor3<T> const& F) const { return law.stress(F); }
  Tensor3<T> stress_change(Tensor3<T> const& F, Tensor3<T> const& dF) const { return law.stress_change(F, dF); }
};
/// The same with that part, what the strain does.
template <class T>
struct StatesPart : Hooke<T> {
  Tensor3<T> semidefinite_stress_change(Tensor3<T> const& F, Tensor3<T> const& dF) const {
    Tensor3<T> const strain = symmetric_part(transpose(F) * dF);
    return F * (Tensor3<T>::diagonal(this->law.lambda * trace(strain)) + (this->law.mu + this->law.mu) * strain);
  }
};
/// The same, isotropic, with a law whose tangent is to be taken.
template <class T>
struct StatesLaw : Hooke<T> {
  static constexpr bool isotropic = true;
  StVenantKirchhoffLaw<T> tangent_law() const { return this->law; }
};

}  // namespace

// Yardstick: the dense matrix of the tetrahedra's and stars' blocks, one by one.
TEMPLATE_TEST_CASE("a material of one's own may state any of what it may, with and without nodal pressure", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const mesh = make_block<S>(3, 3, 3, S(0.01), BlockPattern::alternating);
  int const n = static_cast<int>(mesh.points.cols());
  Matrix3X<S> x = mesh.points, v = mesh.points;
  for (int i = 0; i < n; ++i) {
    Vector3<S> const p = mesh.points.col(i);
    x.col(i) += S(0.1) * Vector3<S>(p.y(), -p.z(), p.x()), v.col(i) = Vector3<S>(p.z(), p.x() * p.y() / S(0.01), -p.y());
  }
  auto const check = [&](auto const& material) {
    using M = std::remove_cvref_t<decltype(material)>;
    for (Pressure const pressure : {Pressure::element, Pressure::nodal}) {
      S const share = S(0.01);
      FiniteElements<S, M> const elastic(mesh, {.density = 1000, .material = material, .pressure = pressure}),
          damped(mesh, {.density = 1000, .material = material, .damping = {.beta = share}, .pressure = pressure});
      Matrix3X<S> expected = Matrix3X<S>::Zero(3, n), found = expected, at_once = expected;
      damped.for_each_stiffness_block(x, [&](int i, int j, Matrix<S, 3, 3> const& block) { expected.col(i) -= share * (block * v.col(j)); });
      std::vector<int> all(static_cast<std::size_t>(n));
      std::iota(all.begin(), all.end(), 0);
      typename FiniteElements<S, M>::Assembly assembly;
      damped.assemble(all, assembly), assembly.add_forces(x, v, at_once);
      for (int i = 0; i < n; ++i) {
        Vector3<S> const force = elastic.internal_force(i, x, v);
        found.col(i) = damped.internal_force(i, x, v) - force, at_once.col(i) -= force;
      }
      S const tolerance = 1000 * std::numeric_limits<S>::epsilon() * expected.norm();
      CHECK((found - expected).norm() <= tolerance);
      CHECK((at_once - expected).norm() <= tolerance);
    }
  };
  check(StatesPart<S>{}), check(StatesLaw<S>{}), check(Viscoelastic<Hooke<S>, S>{});
}

TEMPLATE_TEST_CASE("a material of one's own may fade, in its own scalar", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Viscoelastic const material{CompressibleRubber<S>{1000, 10000}, {{S(0.3), S(0.1)}}};
  CHECK(std::is_same_v<decltype(material), Viscoelastic<CompressibleRubber<S>, S> const>);
  FiniteElements<S, std::remove_const_t<decltype(material)>> const tissue(make_block<S>(2, 2, 2, S(0.01)), {.density = 1000, .material = material});
  CHECK(tissue.size() == 8);
}

namespace {

/// Rubber of the library's scalars alone: not of packs, so it is computed one tetrahedron after the other.
template <RealScalar S>
struct RubberOfScalars : CompressibleRubber<S> {};
static_assert(!detail::IsLawOfNumbers<RubberOfScalars<double>, double, simd::Lanes<double>>);

}  // namespace

// Yardstick: the same law in packs.
TEMPLATE_TEST_CASE("a material of one's own may be a template of RealScalar, and fade", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const mesh = make_block<S>(3, 3, 3, S(0.01), BlockPattern::alternating);
  auto const bend = [&](auto const& law) {
    Viscoelastic const material{law, {{S(0.3), S(0.1)}}};
    using Faded = std::remove_const_t<decltype(material)>;
    CHECK(std::is_same_v<Faded, Viscoelastic<std::remove_cvref_t<decltype(law)>, S>>);
    FiniteElements<S, Faded> tissue(mesh, {.density = 1000, .material = material});
    tissue.nail(0), tissue.nail(1), tissue.nail(3);
    SoftBody body(std::move(tissue), BackwardEuler{.tolerance = 1e-5});
    for (int k = 0; k < 20; ++k) {
      body.apply_force(26, {0, 0, S(-0.02)});
      CHECK(body.step(S(0.002)));
    }
    return Matrix3X<S>(body.positions());
  };
  auto const in_packs = bend(CompressibleRubber<S>{1000, 10000}), one_by_one = bend(RubberOfScalars<S>{{1000, 10000}});
  CHECK((in_packs - mesh.points).norm() > S(1e-4));
  CHECK((in_packs - one_by_one).norm() < S(1e-3) * (in_packs - mesh.points).norm());
}

TEST_CASE("a material that is wrong is told so") {
  struct Slack : testing::MaterialArchetype<double> {   // its stress is twice the gradient of its energy
    Tensor3<double> stress(Tensor3<double> const& F) const { return 2.0 * testing::MaterialArchetype<double>::stress(F); }
  };
  CHECK_THAT(testing::to_text(testing::check_material<double>(Slack{})), says("stress", "energy"));
  struct Nothing : testing::MaterialArchetype<double> {
    Tensor3<double> semidefinite_stress_change(Tensor3<double> const&, Tensor3<double> const& d) const { return 0.0 * d; }
  };
  CHECK_THAT(testing::to_text(testing::check_material<double>(Nothing{})), says("at F = 1 semidefinite_stress_change must be stress_change"));
  struct Skewed : testing::MaterialArchetype<double> {
    Tensor3<double> semidefinite_stress_change(Tensor3<double> const& F, Tensor3<double> const& d) const {
      return stress_change(F, d) + (F.xy * 1000.0) * Tensor3<double>{0, d.xx, 0, 0, 0, 0, 0, 0, 0};
    }
  };
  CHECK_THAT(testing::to_text(testing::check_material<double>(Skewed{})), says("semidefinite_stress_change must be symmetric"));
}
