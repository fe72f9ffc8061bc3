// SPDX-License-Identifier: MIT
#include "allocation_trap.hpp"
#include "catch.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/material/corotational.hpp>
#include <palpate/material/st_venant_kirchhoff.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/testing/tissue.hpp>
#include <palpate/tissue/finite_elements.hpp>

#include <Eigen/Dense>

#include <cmath>
#include <cstdlib>
#include <numeric>
#include <utility>
#include <vector>

using namespace palpate;

namespace {

template <class S, class M>
FiniteElements<S, M> assembled(TetrahedralMesh<S> const& mesh, Pressure pressure, RayleighDamping<S> const& damping = {}) {
  return {mesh, {.density = 1000, .material = {.young = 3000, .poisson = S(0.45)}, .damping = damping, .pressure = pressure, .stiffness = Stiffness::assembled}};
}

/// A law that is not computed for several tetrahedra at once: it says neither that it is isotropic nor what part of its tangent is semidefinite.
template <class S>
struct SingleLaw {
  StVenantKirchhoffLaw<S> inner;

  static SingleLaw of(LameConstants<S> const& lame) { return {StVenantKirchhoffLaw<S>::of(lame)}; }
  S bulk_modulus() const noexcept { return inner.bulk_modulus(); }
  S energy(Tensor3<S> const& F) const noexcept { return inner.energy(F); }
  Tensor3<S> stress(Tensor3<S> const& F) const noexcept { return inner.stress(F); }
  Tensor3<S> stress_change(Tensor3<S> const& F, Tensor3<S> const& dF) const noexcept { return inner.stress_change(F, dF); }
};

// Yardstick: the dense sum of the tetrahedra's and stars' blocks, one by one.
template <class S, class M>
void compare_with_sum() {
  std::srand(11);
  S const tolerance = std::same_as<S, float> ? S(2e-5) : S(1e-12);
  auto mesh = make_block<S>(4, 4, 4, S(0.01), BlockPattern::alternating);
  for (Eigen::Index i = 0; i < mesh.points.cols(); ++i) mesh.points.col(i) += S(0.0015) * Vector3<S>::Random();
  int const n = static_cast<int>(mesh.points.cols());
  for (Pressure const pressure : {Pressure::element, Pressure::nodal}) {
    auto const tissue = assembled<S, M>(mesh, pressure);
    Matrix3X<S> const x = mesh.points + S(2e-3) * Matrix3X<S>::Random(3, n);
    using Dense = Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic>;
    Dense dense = Dense::Zero(3 * n, 3 * n);
    tissue.for_each_stiffness_block(x, [&](int i, int j, Matrix<S, 3, 3> const& block) { dense.template block<3, 3>(3 * i, 3 * j) += block; });
    for (int const count : {n, 20}) {
      std::vector<int> chosen(static_cast<std::size_t>(count));
      std::iota(chosen.begin(), chosen.end(), 0);
      typename FiniteElements<S, M>::Assembly assembly;
      tissue.assemble(chosen, assembly);
      int const columns = static_cast<int>(assembly.particles().size());
      Matrix<S, 4, Dynamic> at = Matrix<S, 4, Dynamic>::Zero(4, columns), d = at, product = at, diagonal = at;
      Eigen::Matrix<S, Eigen::Dynamic, 1> change = Eigen::Matrix<S, Eigen::Dynamic, 1>::Zero(3 * n);
      for (int k = 0; k < columns; ++k) at.col(k).template head<3>() = x.col(assembly.particles()[static_cast<std::size_t>(k)]);
      for (int k = 0; k < count; ++k) change.template segment<3>(3 * k) = d.col(k).template head<3>() = Vector3<S>::Random();
      assembly.linearise(PaddedView<S>(at.data(), 4, columns), nullptr);
      assembly.multiply_tangent(S(0), S(0), S(2), d.data(), product.data());
      assembly.tangent_diagonal(S(0), S(0), S(2), diagonal.data());
      Eigen::Matrix<S, Eigen::Dynamic, 1> const expected = 2 * (dense * change);
      for (int k = 0; k < count; ++k) {
        CHECK((product.col(k).template head<3>() - expected.template segment<3>(3 * k)).norm() <= tolerance * expected.norm());
        CHECK(product(3, k) == S(0));
        if (pressure == Pressure::element)   // with stars the diagonal is near it
          for (int c = 0; c < 3; ++c) CHECK(std::abs(diagonal(c, k) - 2 * dense(3 * k + c, 3 * k + c)) <= tolerance * dense.norm());
      }
    }
  }
}

}  // namespace

TEMPLATE_TEST_CASE("an assembled stiffness is the sum of the elements', for a body and for a part of it", "[tissue][stiffness_rows]", PALPATE_TEST_SCALARS) {
  compare_with_sum<TestType, StableNeoHookean<TestType>>();
  compare_with_sum<TestType, IsotropicMaterial<SingleLaw, TestType>>();
}

TEMPLATE_TEST_CASE("a solid with an assembled stiffness keeps the laws of tissues", "[tissue][stiffness_rows]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const mesh = make_block<S>(3, 3, 3, S(0.01), BlockPattern::alternating);
  for (Pressure const pressure : {Pressure::element, Pressure::nodal}) {
    CHECK(testing::check_tissue(assembled<S, StableNeoHookean<S>>(mesh, pressure, {.alpha = 3, .beta = S(1e-3)}), {.displacement = 0.05}) == testing::Violations{});
    CHECK(testing::check_tissue(assembled<S, Corotational<S>>(mesh, pressure), {.displacement = 0.05}) == testing::Violations{});
  }
}

// Yardstick: steps without the matrix, which solve the same equations to the same residual.
TEST_CASE("implicit steps with an assembled stiffness go where those without it do, and allocate nothing", "[tissue][stiffness_rows]") {
  auto const mesh = make_block<double>(9, 4, 4, 0.01, BlockPattern::alternating);
  auto const fixed = vertices_where(mesh, [](auto const& p) { return p.x() < 1e-6; });
  auto const body_of = [&](Stiffness stiffness, auto const& region) {
    FiniteElements tissue(mesh, SolidOptions<double, StableNeoHookean<double>>{.density = 1000, .material = {.young = 5000, .poisson = 0.45}, .stiffness = stiffness});
    tissue.nail(vertices_where(mesh, [](auto const& p) { return p.x() < 1e-6; }));
    SoftBody body(std::move(tissue), BackwardEuler{.tolerance = 1e-10, .max_iterations = 2000}, region);
    body.step(0.01);
    return body;
  };
  auto const compare = [&](auto with, auto without) {
    int const first = with.nearest_vertex({0.08, 0.03, 0.03}), second = with.nearest_vertex({0.04, 0.0, 0.03});
    auto const push = [&](auto& body) {   // a zone goes from one to the other
      for (int k = 0; k < 20; ++k) {
        body.apply_force(k < 10 ? first : second, {0, 0, -0.05});
        body.step(0.01);
      }
    };
    for (auto* body : {&with, &without}) body->apply_force(first, {0, 0, -0.05}), body->step(0.01);
    auto const allocations = [&](auto& body) {
      palpate_test::AllocationCount const count;
      push(body);
      return count.count();
    };
    CHECK(allocations(with) == 0);   // where a zone is larger than any before too
    CHECK(allocations(without) == 0);
    double const moved = (without.positions() - mesh.points).norm();
    CHECK(moved > 1e-3);
    CHECK((with.positions() - without.positions()).norm() <= 1e-6 * moved);
  };
  compare(body_of(Stiffness::assembled, WholeBody{}), body_of(Stiffness::matrix_free, WholeBody{}));
  compare(body_of(Stiffness::assembled, ZoneOfInfluence{.rings = 3}), body_of(Stiffness::matrix_free, ZoneOfInfluence{.rings = 3}));
}
