// SPDX-License-Identifier: MIT
#pragma once

#include "tissue/yardstick.hpp"

#include <palpate/material/linear_elastic.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/tissue/finite_elements.hpp>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include <algorithm>
#include <string>
#include <vector>

namespace palpate_test {

/// The stiffness at rest as a sparse matrix without the rows and columns of fixed particles.
template <class Tissue>
Eigen::SparseMatrix<double> stiffness_at_rest(Tissue const& tissue, palpate::Matrix3X<double> const& rest, std::vector<int> const& place, int free) {
  std::vector<Eigen::Triplet<double>> entries;
  tissue.for_each_stiffness_block(rest, [&](int i, int j, palpate::Matrix<double, 3, 3> const& block) {
    int const row = place[static_cast<std::size_t>(i)], column = place[static_cast<std::size_t>(j)];
    if (row < 0 || column < 0) return;
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) entries.emplace_back(3 * row + a, 3 * column + b, block(a, b));
  });
  Eigen::SparseMatrix<double> matrix(3 * free, 3 * free);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

/// What a cantilever of 10 x 1 x 1 with `through` cubes through its height bends at its tip under a small load there, over Timoshenko's beam.
template <class Material = palpate::LinearElastic<double>>
double tip_over_timoshenko(int through, double poisson, palpate::BlockPattern pattern, palpate::SolidOptions<double, Material> options = {}) {
  using namespace palpate;
  double const young = 1000, height = 0.01, length = 10 * height;
  auto const mesh = make_block<double>(10 * through + 1, through + 1, through + 1, height / through, pattern);
  options.density = 1000, options.material = {young, poisson};
  FiniteElements<double, Material> const tissue(mesh, options);
  std::vector<int> place(static_cast<std::size_t>(tissue.size()), -1);
  int free = 0;
  for (int i = 0; i < tissue.size(); ++i)
    if (mesh.points(0, i) > 1e-9) place[static_cast<std::size_t>(i)] = free++;
  Eigen::VectorXd load = Eigen::VectorXd::Zero(3 * free), area = load;
  double sum = 0;
  for (int t = 0; t < tissue.surface().triangle_count(); ++t) {   // shared over the end face by area
    auto const corners = tissue.surface().corners(t);
    Vector3<double> const a = mesh.points.col(corners[0]), b = mesh.points.col(corners[1]), c = mesh.points.col(corners[2]);
    if (std::min({a.x(), b.x(), c.x()}) < length - 1e-9) continue;
    double const share = (b - a).cross(c - a).norm() / 6;
    for (int const i : corners) load[3 * place[static_cast<std::size_t>(i)] + 2] += share, sum += share;
  }
  load /= sum;   // 1 N
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> const solver(stiffness_at_rest(tissue, mesh.points, place, free));
  double const tip = load.dot(solver.solve(load));
  double const inertia = height * height * height * height / 12, shear = young / (2 * (1 + poisson));
  return tip / (length * length * length / (3 * young * inertia) + length / (5.0 / 6 * shear * height * height));
}

/// What such beams were found to bend elsewhere, by elements alone and with nodal pressure.
struct Cantilever {
  int through;
  double poisson;
  palpate::BlockPattern pattern;
  double plain, nodal;
};
inline constexpr Cantilever cantilevers[] = {
    {2, 0.3, palpate::BlockPattern::alternating, 0.67, 0.74},  {4, 0.3, palpate::BlockPattern::alternating, 0.89, 0.91},
    {6, 0.3, palpate::BlockPattern::alternating, 0.94, 0.95},  {2, 0.49, palpate::BlockPattern::alternating, 0.60, 0.64},
    {4, 0.49, palpate::BlockPattern::alternating, 0.83, 0.86}, {6, 0.49, palpate::BlockPattern::alternating, 0.90, 0.92},
    {2, 0.49, palpate::BlockPattern::kuhn, 0.104, 0.579},      {4, 0.49, palpate::BlockPattern::kuhn, 0.288, 0.830}};

inline std::string to_text(Cantilever const& beam) {
  return "cantilever 10 × 1 × 1, " + std::to_string(beam.through) + (beam.pattern == palpate::BlockPattern::kuhn ? " cubes of Kuhn" : " alternating cubes") +
         " through its height, ν = " + text(beam.poisson) + ": tip over Timoshenko's";
}

}  // namespace palpate_test
