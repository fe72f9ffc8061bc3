// SPDX-License-Identifier: MIT
// Tensors that turn. Yardsticks: TensorMass for small strains; rotation of the whole; the sum Σ R_e K_e R_eᵀ with Eigen's polar decomposition; corotational
// finite elements, in motion; an assembly made anew after cuts.
#include "allocation_trap.hpp"
#include "catch.hpp"
#include "cutting/solid_strokes.hpp"
#include "tissue/distorted.hpp"

#include <palpate/body/pieces.hpp>
#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/models.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/testing/tissue.hpp>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/SVD>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <numeric>
#include <utility>
#include <vector>

using namespace palpate;
using namespace palpate_test;

namespace {

template <class S>
TensorMassOptions<S> soft() {
  return {.density = 1000, .material = {.young = S(1e4), .poisson = S(0.4)}};
}
template <class Tissue, class X>
Matrix3X<typename Tissue::Scalar> forces(Tissue const& tissue, X const& x) {
  Matrix3X<typename Tissue::Scalar> all(3, tissue.size()), still = 0 * all.setZero();
  for (int i = 0; i < tissue.size(); ++i) all.col(i) = tissue.internal_force(i, x, still);
  return all;
}
std::vector<int> every(auto const& tissue) {
  std::vector<int> all(static_cast<std::size_t>(tissue.size()));
  std::iota(all.begin(), all.end(), 0);
  return all;
}
/// The tangent of an assembly of all particles at x, column by column.
template <class Assembly>
Eigen::MatrixXd dense(Assembly& assembly, Matrix3X<double> const& x) {
  Matrix<double, 4, Dynamic> at = Matrix<double, 4, Dynamic>::Zero(4, x.cols()), d = at, out = at;
  at.topRows<3>() = x;
  assembly.linearise(PaddedView<double>(at.data(), 4, at.cols()), nullptr);
  Eigen::MatrixXd all(3 * x.cols(), 3 * x.cols());
  for (Eigen::Index k = 0; k < all.cols(); ++k) {
    d.setZero(), d(k % 3, k / 3) = 1;
    assembly.multiply_tangent(0, 0, 1, d.data(), out.data());
    for (Eigen::Index row = 0; row < all.rows(); ++row) all(row, k) = out(row % 3, row / 3);
  }
  return all;
}
Matrix3X<double> bent(Matrix3X<double> const& rest) {
  Matrix3X<double> x = rest;
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    double const angle = 60 * rest(0, i);
    Vector3<double> const middle(0.01 * std::sin(angle), 1.1 * rest(1, i), 0.01 * std::cos(angle));
    x.col(i) = middle + rest(2, i) * Vector3<double>(std::sin(angle), 0.1, std::cos(angle));
  }
  return x;
}

}  // namespace

TEMPLATE_TEST_CASE("tensors that turn: none of it is felt, and small strains are TensorMass's", "[tissue][tensor_mass]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const mesh = distorted<S>(4, S(0.005));
  CorotatedTensorMass<S> const tissue(mesh, soft<S>());
  TensorMass<S> const linear(mesh, soft<S>());
  Matrix<S, 3, 3> const turn = Eigen::AngleAxis<S>(S(2.1), Vector3<S>(1, 2, -1).normalized()).toRotationMatrix();
  Matrix3X<S> const turned = (turn * mesh.points).colwise() + Vector3<S>(S(0.01), 0, S(-0.02));
  S const scale = forces(linear, turned).norm();
  CHECK(forces(tissue, turned).norm() < (std::is_same_v<S, double> ? 1e-12 : 1e-4) * scale);

  std::srand(5);
  S const step = std::is_same_v<S, double> ? S(1e-9) : S(1e-6);
  Matrix3X<S> const little = mesh.points + step * Matrix3X<S>::Random(3, mesh.points.cols());
  CHECK((forces(tissue, little) - forces(linear, little)).norm() < (std::is_same_v<S, double> ? 1e-5 : 2e-2) * forces(linear, little).norm());

  Matrix3X<S> const far = turned + S(2e-3) * Matrix3X<S>::Random(3, mesh.points.cols());
  Matrix3X<S> const f = forces(tissue, far);
  Vector3<S> moment = Vector3<S>::Zero();
  for (Eigen::Index i = 0; i < f.cols(); ++i) moment += far.col(i).cross(f.col(i));
  S const digits = std::is_same_v<S, double> ? S(1e-12) : S(1e-4);
  CHECK(f.rowwise().sum().norm() < digits * f.norm());
  CHECK(moment.norm() < digits * f.norm() * S(0.02));
}

TEST_CASE("tensors that turn keep the laws of tissues", "[tissue][tensor_mass]") {
  CorotatedTensorMass<double> const tissue(distorted<double>(3, 0.01),
                                           {.density = 1000, .material = {.young = 3000, .poisson = 0.4}, .damping = {.beta = 1e-3}});
  CHECK(testing::to_text(testing::check_tissue(tissue, {.displacement = 0.05})) == "");
}

TEST_CASE("the rows of tensors are the sum of the turned ones, also after cuts", "[tissue][tensor_mass]") {
  SoftBody body(CorotatedTensorMass<double>(make_block<double>(4, 3, 3, 0.005, BlockPattern::alternating), soft<double>()), BackwardEuler{});
  CorotatedTensorMass<double>::Assembly followed;
  body.tissue().assemble(every(body.tissue()), followed);
  VolumeCutter<double> knife;
  for (int tick = 0; tick <= 20; ++tick) {
    double const y = -0.002 + 0.014 * tick / 20;
    knife.advance(body, {{0.0063, y, 0.003}, {0.0071, y, 0.02}});
    body.tissue().follow_edits(every(body.tissue()), followed);
  }
  auto const& tissue = body.tissue();
  REQUIRE(tissue.size() > 40);
  CorotatedTensorMass<double>::Assembly anew;
  tissue.assemble(every(tissue), anew);
  Matrix3X<double> const x = bent(tissue.rest_positions());
  Eigen::MatrixXd const k = dense(anew, x);
  CHECK(dense(followed, x) == k);
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(k.rows(), k.cols());
  for (int e = 0; e < tissue.tetrahedra(); ++e) {
    auto const& element = tissue.list().elements[static_cast<std::size_t>(e)];
    auto const& nodes = tissue.list().nodes[static_cast<std::size_t>(e)];
    NodeColumns<double, 4> now, rest;
    for (int a = 0; a < 4; ++a) now.col(a) = x.col(nodes[static_cast<std::size_t>(a)]), rest.col(a) = tissue.rest_position(nodes[static_cast<std::size_t>(a)]);
    Matrix<double, 3, 3> const edges = now.rightCols<3>().colwise() - now.col(0), at_rest = rest.rightCols<3>().colwise() - rest.col(0);
    Eigen::JacobiSVD<Matrix<double, 3, 3>> const svd(edges * at_rest.inverse(), Eigen::ComputeFullU | Eigen::ComputeFullV);
    Matrix<double, 3, 3> const turn = svd.matrixU() * svd.matrixV().transpose();
    REQUIRE(turn.determinant() > 0);
    auto const own = element.stiffness(rest);
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b)
        sum.block<3, 3>(3 * nodes[static_cast<std::size_t>(a)], 3 * nodes[static_cast<std::size_t>(b)]) +=
            turn * own.block<3, 3>(3 * a, 3 * b) * turn.transpose();
  }
  CHECK((sum - k).norm() < 1e-12 * k.norm());
  CHECK(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(k, Eigen::EigenvaluesOnly).eigenvalues().minCoeff() > -1e-12 * k.norm());
}

TEST_CASE("a bar of turned tensors that falls far moves as corotational finite elements do, whole, in a zone and cut", "[tissue][tensor_mass]") {
  auto const mesh = make_block<double>(13, 3, 3, 0.005, BlockPattern::alternating);
  auto const check = [&](auto region, bool cuts) {
    auto const held = [](auto tissue) {
      for (int i = 0; i < tissue.size(); ++i)
        if (tissue.rest_position(i)[0] < 1e-6) tissue.nail(i);
      return tissue;
    };
    BackwardEuler const rule{.tolerance = 1e-10, .max_iterations = 600, .newton_iterations = 8};
    SoftBody tensors(held(CorotatedTensorMass<double>(mesh, {.density = 1000, .material = {.young = 2e4, .poisson = 0.3}})), rule, region);
    SoftBody elements(held(FiniteElements<double, Corotational<double>>(mesh, {.density = 1000, .material = {.young = 2e4, .poisson = 0.3}})), rule, region);
    SoftBody once(held(CorotatedTensorMass<double>(mesh, {.density = 1000, .material = {.young = 2e4, .poisson = 0.3}})), BackwardEuler{}, region);
    int const tip = tensors.size() - 1;
    VolumeCutter<double> one, two;
    for (int step = 0; step < 60; ++step) {
      if (cuts && step >= 30 && step < 50) {
        double const y = -0.002 + 0.014 * (step - 30) / 20;
        BladeSegment<double> const blade{{0.0313, y, 0.003}, {0.0321, y, 0.02}};
        one.advance(tensors, blade), two.advance(elements, blade);
      }
      tensors.apply_force(tip, {0, 0, -0.012}), elements.apply_force(tip, {0, 0, -0.012}), once.apply_force(tip, {0, 0, -0.012});
      REQUIRE(tensors.step(2e-3));
      REQUIRE(elements.step(2e-3));
      REQUIRE(once.step(2e-3));
    }
    double const fallen = elements.displacement(tip).norm();
    CAPTURE(fallen);
    CHECK(fallen > (cuts ? 0.004 : 0.01));
    REQUIRE(tensors.size() == elements.size());
    CHECK((tensors.positions() - elements.positions()).cwiseAbs().maxCoeff() < 1e-4 * fallen);
    if (!cuts) CHECK((once.positions() - elements.positions()).cwiseAbs().maxCoeff() < 0.03 * fallen);
  };
  check(WholeBody{}, false);
  check(ZoneOfInfluence{.rings = 9}, false);
  check(WholeBody{}, true);
}

TEST_CASE("turned tensors: saved and restored to the byte, parts that go on alone, steps without memory", "[tissue][tensor_mass]") {
  SoftBody body(CorotatedTensorMass<double>(make_block<double>(5, 5, 5, 0.005, BlockPattern::alternating), soft<double>()), BackwardEuler{});
  for (int i = 0; i < 25; ++i) body.nail(i);
  VolumeCutter<double> knife;
  stroke(knife, body, Place(0.0071, -0.003, 0.0063), Place(0.0083, -0.003, 0.03), Place(0, 0.012, 0), 20);
  for (int step = 0; step < 10; ++step) body.step(1e-3);
  auto const saved = body.save();
  auto const go_on = [&] {
    VolumeCutter<double> again;
    for (int tick = 0; tick <= 20; ++tick) {
      double const x = -0.003 + 0.0006 * tick;
      again.advance(body, {{x, 0.0061, 0.0063}, {x, 0.0073, 0.03}});
      body.apply_force(body.size() - 1, {0.01, 0, 0.05});
      REQUIRE(body.step(1e-3));
    }
    return Matrix3X<double>(body.positions());
  };
  auto const first = go_on();
  body.restore(saved);
  CHECK(go_on() == first);
  auto const parts = pieces_of(body);
  REQUIRE(parts.size() >= 1);
  auto part = part_of(body, parts[0]);
  CHECK(part.step(1e-3));
  REQUIRE(trap_works());
  body.step(1e-3);
  AllocationCount const allocations;
  for (int step = 0; step < 10; ++step) body.step(1e-3);
  long const count = allocations.count();
  CHECK(count == 0);
}
