// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include <palpate/material/st_venant_kirchhoff.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/solid_fields.hpp>

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

using namespace palpate;

// Yardstick: Cauchy's stress of a St. Venant-Kirchhoff solid stretched along x alone by l: F = diag(l, 1, 1), E_xx = (l² − 1)/2,
// P = F (lambda E_xx 1 + 2 mu E), sigma = P Fᵀ / l; and turned by R: R sigma Rᵀ.
TEST_CASE("stress, energy and change of volume of a stretched and turned block are those of the closed form", "[tissue][solid_fields]") {
  double const young = 3000, poisson = 0.3, l = 1.2;
  double const lambda = young * poisson / ((1 + poisson) * (1 - 2 * poisson)), mu = young / (2 * (1 + poisson));
  auto const mesh = make_block<double>(3, 3, 3, 0.01, BlockPattern::alternating);
  FiniteElements<double, StVenantKirchhoff<double>> const tissue(mesh, {.density = 1000, .material = {young, poisson}});
  double const strain = (l * l - 1) / 2;
  Eigen::Matrix3d sigma = Eigen::Matrix3d::Zero();
  sigma(0, 0) = l * (lambda + 2 * mu) * strain;
  sigma(1, 1) = sigma(2, 2) = lambda * strain / l;
  Eigen::Matrix3d const turn = Eigen::AngleAxisd(0.7, Vector3<double>(1, 2, -1).normalized()).toRotationMatrix();
  Matrix3X<double> const x = turn * Vector3<double>(l, 1, 1).asDiagonal() * mesh.points;
  Eigen::Matrix3d const turned = turn * sigma * turn.transpose();
  auto const fields = solid_fields(tissue, x);
  REQUIRE(fields.stress.cols() == mesh.tetrahedra.cols());
  double worst = 0;
  for (Eigen::Index t = 0; t < fields.stress.cols(); ++t) {
    Matrix<double, 6, 1> expected;
    expected << turned(0, 0), turned(1, 1), turned(2, 2), turned(0, 1), turned(1, 2), turned(2, 0);
    worst = std::max(worst, (fields.stress.col(t) - expected).cwiseAbs().maxCoeff());
  }
  CHECK(worst < 1e-9 * sigma.norm());
  CHECK(fields.von_mises.minCoeff() == Approx(sigma(0, 0) - sigma(1, 1)).epsilon(1e-10));
  CHECK(fields.von_mises.maxCoeff() == Approx(sigma(0, 0) - sigma(1, 1)).epsilon(1e-10));
  CHECK(fields.energy_density.mean() == Approx((lambda / 2 + mu) * strain * strain).epsilon(1e-10));
  CHECK(fields.determinant.minCoeff() == Approx(l).epsilon(1e-12));
  CHECK_THROWS_WITH(solid_fields(tissue, Matrix3X<double>(3, 5)), Catch::Contains("27 particles and 5 positions"));
}

// Yardstick: pure shear of tau has the von Mises stress sqrt(3) tau, a pressure none.
TEST_CASE("von Mises stress of pure shear and of a pressure", "[tissue][solid_fields]") {
  Tensor3<double> shear{};
  shear.xy = shear.yx = 7;
  CHECK(von_mises_stress(shear) == Approx(7 * std::sqrt(3.0)));
  CHECK(von_mises_stress(Tensor3<double>::diagonal(-5)) == 0);
}

// Yardstick: forces are minus the slope of the energy, and at any shape the virtual work of the stress over the current volume, sum V J sigma : grad du, is
// that of the forces.
TEST_CASE("with nodal pressure stress does the work of the forces and the energies add up", "[tissue][solid_fields]") {
  auto const mesh = make_block<double>(3, 4, 3, 0.01, BlockPattern::alternating);
  FiniteElements<double, StableNeoHookean<double>> tissue(mesh, {.density = 1000, .material = {3000, 0.45}, .pressure = Pressure::nodal});
  tissue.set_material(std::vector<int>{0, 1, 2, 3}, {30000, 0.4});
  std::srand(5);
  Matrix3X<double> const x = mesh.points + 1e-3 * Matrix3X<double>::Random(3, mesh.points.cols()), d = Matrix3X<double>::Random(3, mesh.points.cols());
  double sum = 0, work = 0;
  for (int t = 0; t < tissue.tetrahedra(); ++t) {
    sum += tissue.strain_energy(t, x);
    auto const& nodes = tissue.list().nodes[static_cast<std::size_t>(t)];
    Eigen::Matrix3d now, change, rest;
    for (int k = 0; k < 3; ++k) {
      auto const from = [&](Matrix3X<double> const& columns) { return Vector3<double>(columns.col(nodes[static_cast<std::size_t>(k + 1)]) - columns.col(nodes[0])); };
      now.col(k) = from(x), change.col(k) = from(d), rest.col(k) = from(mesh.points);
    }
    auto const s = tissue.cauchy_stress(t, x);
    Eigen::Matrix3d sigma;
    sigma << s.xx, s.xy, s.xz, s.yx, s.yy, s.yz, s.zx, s.zy, s.zz;
    work += now.determinant() / 6 * sigma.cwiseProduct(change * now.inverse()).sum();
  }
  CHECK(sum == Approx(tissue.potential_energy(x)).epsilon(1e-12));
  double const h = 1e-6;
  double const slope = (tissue.potential_energy(Matrix3X<double>(x + h * d)) - tissue.potential_energy(Matrix3X<double>(x - h * d))) / (2 * h);
  CHECK(work == Approx(slope).epsilon(1e-6));
  CHECK_THROWS_AS(tissue.cauchy_stress(-1, x), OutOfRange);
  CHECK_THROWS_AS(tissue.strain_energy(tissue.tetrahedra(), x), OutOfRange);
}
