// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/supported.hpp>
#include <palpate/tissue/tensor_mass/corotated_tensor_mass.hpp>
#include <palpate/tissue/tensor_mass/tensor_mass.hpp>

#include <Eigen/Dense>

#include <cmath>
#include <cstdlib>
#include <numeric>
#include <utility>
#include <vector>

using namespace palpate;

namespace {

using Solid = FiniteElements<double, StableNeoHookean<double>>;

constexpr bool has_registers = simd::register_size > 0;
static_assert(HasFloatTangent<Solid> == has_registers && HasFloatTangent<TensorMass<double>> == has_registers && HasFloatTangent<CorotatedTensorMass<double>> == has_registers);
static_assert(!HasFloatTangent<FiniteElements<float, StableNeoHookean<float>>>, "is in float");
static_assert(!HasFloatTangent<Supported<Solid>>, "its springs would be left out");
static_assert(HasTangentOnCores<Solid> && !HasTangentOnCores<Supported<Solid>> && !HasTangentOnCores<CorotatedTensorMass<double>>, "whose own parts would be left out");

template <class Tissue>
Eigen::MatrixXd dense_stiffness(Tissue const& tissue, Matrix3X<double> const& x) {
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(3 * x.cols(), 3 * x.cols());
  tissue.for_each_stiffness_block(x, [&](int i, int j, Matrix<double, 3, 3> const& block) { dense.block<3, 3>(3 * i, 3 * j) += block; });
  return dense;
}

/// The largest difference of a product in float from that with the dense sum of the tetrahedra's blocks, as a share of what that has.
template <class Tissue>
double error_of_product(Tissue const& tissue, Matrix3X<double> const& x, int count) {
  if constexpr (!HasFloatTangent<Tissue>) {
    return 0;   // numbers one by one
  } else {
    std::vector<int> chosen(static_cast<std::size_t>(count));
    std::iota(chosen.begin(), chosen.end(), 0);
    typename Tissue::Assembly assembly;
    tissue.assemble(chosen, assembly);
    int const columns = static_cast<int>(assembly.particles().size());
    Matrix<double, 4, Dynamic> at = Matrix<double, 4, Dynamic>::Zero(4, columns);
    Matrix<float, 4, Dynamic> d = Matrix<float, 4, Dynamic>::Zero(4, columns), product = d;
    Eigen::VectorXd change = Eigen::VectorXd::Zero(3 * x.cols()), masses = change;
    for (int k = 0; k < columns; ++k) at.col(k).head<3>() = x.col(assembly.particles()[static_cast<std::size_t>(k)]);
    for (int k = 0; k < count; ++k) {
      d.col(k).head<3>() = Vector3<float>::Random();
      change.segment<3>(3 * k) = d.col(k).head<3>().cast<double>();
      masses.segment<3>(3 * k).setConstant(tissue.mass(k));
    }
    assembly.linearise(PaddedView<double>(at.data(), 4, columns), nullptr);
    assembly.multiply_tangent(2000.0, 0.0, 3.0, d.data(), product.data());
    Eigen::VectorXd const expected = 2000 * masses.cwiseProduct(change) + 3 * (dense_stiffness(tissue, x) * change);
    double worst = 0;
    for (int k = 0; k < count; ++k) {
      worst = std::max(worst, (product.col(k).head<3>().cast<double>() - expected.segment<3>(3 * k)).norm());
      CHECK(product(3, k) == 0);
    }
    return worst / expected.cwiseAbs().maxCoeff();
  }
}

}  // namespace

// Yardstick: the dense sum of the tetrahedra's blocks, one by one, in double.
TEST_CASE("a solid's tangent in float is its tangent to some rounding errors, for a body, for a part of it and after cuts", "[tissue][float_tangent]") {
  std::srand(11);
  for (auto const& [stiffness, pressure] : {std::pair{Stiffness::matrix_free, Pressure::element}, std::pair{Stiffness::assembled, Pressure::element},
                                            std::pair{Stiffness::matrix_free, Pressure::nodal}})
    for (int const cells : {1, 2, 3}) {   // 5, 40, 135 tetrahedra: packs that are not full, and an odd number of them
      auto mesh = make_block<double>(cells + 1, cells + 1, cells + 1, 0.01, BlockPattern::alternating);
      for (Eigen::Index i = 0; i < mesh.points.cols(); ++i) mesh.points.col(i) += 0.0015 * Vector3<double>::Random();
      int const n = static_cast<int>(mesh.points.cols());
      Solid tissue(mesh, {.density = 1000, .material = {.young = 3000, .poisson = 0.45}, .pressure = pressure, .stiffness = stiffness});
      Matrix3X<double> const x = mesh.points + 1e-3 * Matrix3X<double>::Random(3, n);
      CHECK(error_of_product(tissue, x, n) < 2e-6);
      CHECK(error_of_product(tissue, x, n / 2) < 2e-6);
      tissue.remove_tetrahedron(1);
      tissue.finish_edits();
      CHECK(error_of_product(tissue, x, n) < 2e-6);
    }
}

// Yardstick: the same; at rest the turned tensors are those of Hooke's law.
TEMPLATE_TEST_CASE("tensors in float are the tensors, for a body, for a part of it and after cuts", "[tissue][float_tangent]", TensorMass<double>, CorotatedTensorMass<double>) {
  std::srand(5);
  auto mesh = make_block<double>(4, 3, 3, 0.01, BlockPattern::alternating);
  for (Eigen::Index i = 0; i < mesh.points.cols(); ++i) mesh.points.col(i) += 0.0015 * Vector3<double>::Random();
  int const n = static_cast<int>(mesh.points.cols());
  TestType tissue(mesh, {.density = 1000, .material = {.young = 3000, .poisson = 0.4}});
  CHECK(error_of_product(tissue, mesh.points, n) < 2e-6);
  CHECK(error_of_product(tissue, mesh.points, n / 2) < 2e-6);
  tissue.remove_tetrahedron(1);
  tissue.finish_edits();
  CHECK(error_of_product(tissue, mesh.points, n) < 2e-6);
}

// Yardstick: a body that was never edited, of the tissue as the edits left it.
TEMPLATE_TEST_CASE("an implicit step after a cut is that of a body which was made after it", "[tissue][float_tangent]", Solid, TensorMass<double>, CorotatedTensorMass<double>) {
  auto const mesh = make_block<double>(4, 3, 3, 0.01, BlockPattern::alternating);
  TestType tissue(mesh, {.density = 1000, .material = {.young = 3000, .poisson = 0.4}});
  tissue.nail(vertices_where(mesh, [](auto const& p) { return p.x() < 1e-9; }));
  BackwardEuler const rule{.tolerance = 1e-12, .max_iterations = 1000};
  SoftBody body(tissue, rule);
  body.set_gravity({0, 0, -9.81});
  REQUIRE(body.step(0.01));
  auto edited = body.tissue();
  for (int const t : {31, 17, 2}) body.remove_tetrahedron(t), edited.remove_tetrahedron(t);
  body.finish_edits(), edited.finish_edits();
  SoftBody other(edited, rule);
  other.set_gravity({0, 0, -9.81});
  for (int i = 0; i < body.size(); ++i)
    if (!edited.nailed(i)) other.drag(i, body.positions().col(i), body.velocities().col(i)), other.release(i);
  REQUIRE(body.step(0.01));
  REQUIRE(other.step(0.01));
  CHECK((body.velocities() - other.velocities()).cwiseAbs().maxCoeff() < 1e-9 * body.velocities().cwiseAbs().maxCoeff());
}

// Yardstick: M + h²K and the residual in it, dense and in double, K of the solid at rest. Eigenvalues of the scaled matrix differ by up to 10⁵: conjugate
// gradients in float end at some 10⁻⁴ of it, and say less.
TEST_CASE("the residual that an implicit step reports is the one that it has, however stiff the solid and long the step", "[tissue][float_tangent]") {
  double const gravity = 9.81;
  auto const mesh = make_block<double>(6, 6, 6, 0.005, BlockPattern::alternating);
  auto const stiffness = GENERATE(Stiffness::matrix_free, Stiffness::assembled);
  auto const pressure = GENERATE(Pressure::element, Pressure::nodal);
  for (auto const& [young, h] : {std::pair{1e3, 1e-3}, std::pair{1e5, 1e-2}, std::pair{1e7, 0.1}})
    for (double const tolerance : {1e-2, 1e-4, 1e-6, 1e-8}) {
      Solid tissue(mesh, {.density = 1000, .material = {.young = young, .poisson = 0.45}, .pressure = pressure, .stiffness = stiffness});
      tissue.nail(vertices_where(mesh, [](auto const& p) { return p.z() < 1e-9; }));
      Eigen::MatrixXd const K = dense_stiffness(tissue, mesh.points);
      std::vector<Eigen::Index> moves;
      Eigen::VectorXd push = Eigen::VectorXd::Zero(K.rows());
      Eigen::MatrixXd A = h * h * K;
      for (int i = 0; i < tissue.size(); ++i)
        for (Eigen::Index k = 3 * i; k < 3 * i + 3; ++k) {
          A(k, k) += tissue.mass(i);
          if (!tissue.nailed(i)) moves.push_back(k);
          if (k % 3 == 2) push[k] = -h * tissue.mass(i) * gravity;
        }
      SoftBody body(std::move(tissue), BackwardEuler{.tolerance = tolerance, .max_iterations = 2000, .halvings = 0});
      body.set_gravity({0, 0, -gravity});
      auto const report = body.step(h);
      REQUIRE(report);
      CHECK(report.solve.converged);
      Matrix3X<double> const v = body.velocities();
      Eigen::VectorXd const change = v.reshaped();
      Eigen::VectorXd const inverse = A.diagonal()(moves).cwiseInverse(), right = push(moves);
      auto const size = [&](Eigen::VectorXd const& r) { return std::sqrt(r.cwiseProduct(r).dot(inverse)); };
      double const left = size((push - A * change)(moves)) / size(right);
      INFO(young << " Pa, " << h << " s, " << tolerance);
      double const off = pressure == Pressure::nodal ? 0.05 : 0.02;   // its scale leaves out some of the diagonal
      CHECK(left <= (1 + off) * tolerance);
      CHECK(std::abs(left - report.solve.residual) <= off * left);
    }
}

// Yardstick: M + h²K, dense and in double. Nothing holds the block: it moves by its mass alone, 10⁻⁷ of the diagonal, of which float knows nothing.
TEST_CASE("a stiff solid that nothing holds moves in a long step as its mass has it", "[tissue][float_tangent]") {
  std::srand(7);
  double const h = 0.01;
  auto mesh = make_block<double>(4, 4, 4, 0.006, BlockPattern::alternating);
  for (Eigen::Index i = 0; i < mesh.points.cols(); ++i) mesh.points.col(i) += 6e-4 * Vector3<double>::Random();
  auto const stiffness = GENERATE(Stiffness::matrix_free, Stiffness::assembled);
  auto const pressure = GENERATE(Pressure::element, Pressure::nodal);
  for (double const young : {1e8, 1e9, 1e10}) {
    Solid tissue(mesh, {.density = 1000, .material = {.young = young, .poisson = 0.45}, .pressure = pressure, .stiffness = stiffness});
    Matrix3X<double> push = Matrix3X<double>::Random(3, tissue.size());
    Eigen::MatrixXd A = h * h * dense_stiffness(tissue, mesh.points);
    for (int i = 0; i < tissue.size(); ++i) push.col(i) *= tissue.mass(i), A.diagonal().segment<3>(3 * i).array() += tissue.mass(i);
    Eigen::VectorXd const right = h * push.reshaped();
    SoftBody body(std::move(tissue), BackwardEuler{.tolerance = 1e-3, .max_iterations = 400, .halvings = 0});
    for (int i = 0; i < push.cols(); ++i) body.apply_force(i, push.col(i));
    auto const report = body.step(h);
    REQUIRE(report);
    INFO(young << " Pa, " << report.solve.iterations << " iterations");
    CHECK(report.solve.converged);
    Matrix3X<double> const v = body.velocities();
    Eigen::VectorXd const exact = A.ldlt().solve(right), error = v.reshaped() - exact;
    CHECK(error.dot(A * error) <= 1e-4 * exact.dot(A * exact));
  }
}
