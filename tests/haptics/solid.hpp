// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/soft_body.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/tissue/finite_elements.hpp>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace palpate_test {

/// An elastic solid, nailed below a height, and the stiffness of the same tetrahedra by Hooke's law, written down once more: nothing of it uses the
/// library's materials, forces, integrators or contact.
struct Solid {
  palpate::TetrahedralMesh<double> mesh;
  double nailed_below = -0.0399;   // m
  double young = 3000.0, poisson = 0.4, density = 1000.0;   // Pa, 1, kg/m³

  using Tissue = palpate::FiniteElements<double, palpate::StableNeoHookean<double>>;

  std::vector<int> base() const {
    std::vector<int> some;
    for (int i = 0; i < mesh.points.cols(); ++i)
      if (mesh.points(2, i) < nailed_below) some.push_back(i);
    return some;
  }
  Tissue tissue() const {
    Tissue t(mesh, {.density = density, .material = {.young = young, .poisson = poisson}});
    t.nail(base());
    return t;
  }
  template <class I, class R>
  auto body(I integrator, R region) const {
    return palpate::SoftBody(tissue(), integrator, region);
  }

  /// Nodes that share a tetrahedron with one of these, and they themselves.
  std::vector<char> around(std::vector<char> const& some) const {
    std::vector<char> more = some;
    for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t) {
      bool any = false;
      for (int c = 0; c < 4; ++c) any = any || some[static_cast<std::size_t>(mesh.tetrahedra(c, t))] != 0;
      if (any)
        for (int c = 0; c < 4; ++c) more[static_cast<std::size_t>(mesh.tetrahedra(c, t))] = 1;
    }
    return more;
  }

  /// How stiff a point of a triangle is along n [N/m], for a little way: corners with these weights share the force, and only nodes that `moves` marks move.
  double stiffness_at(std::array<int, 3> const& corners, Eigen::Vector3d const& weights, Eigen::Vector3d const& n, std::vector<char> moves) const {
    for (int const i : base()) moves[static_cast<std::size_t>(i)] = 0;
    std::vector<int> place(moves.size(), -1);
    int free = 0;
    for (std::size_t i = 0; i < moves.size(); ++i)
      if (moves[i] != 0) place[i] = free++;
    double const lambda = poisson * young / ((1 + poisson) * (1 - 2 * poisson)), mu = young / (2 * (1 + poisson));
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(3 * free, 3 * free);
    for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t) {
      Eigen::Matrix4d edges;   // rows: 1, x, y, z of the four corners; its inverse has the gradients of the shape functions
      for (int c = 0; c < 4; ++c) edges.col(c) << 1.0, mesh.points.col(mesh.tetrahedra(c, t));
      Eigen::Matrix4d const inverse = edges.inverse();
      double const volume = edges.determinant() / 6;
      for (int a = 0; a < 4; ++a)
        for (int b = 0; b < 4; ++b) {
          int const row = place[static_cast<std::size_t>(mesh.tetrahedra(a, t))], column = place[static_cast<std::size_t>(mesh.tetrahedra(b, t))];
          if (row < 0 || column < 0) continue;
          Eigen::Vector3d const g = inverse.block<1, 3>(a, 1).transpose(), h = inverse.block<1, 3>(b, 1).transpose();
          matrix.block<3, 3>(3 * row, 3 * column) +=
              volume * (lambda * g * h.transpose() + mu * h * g.transpose() + mu * g.dot(h) * Eigen::Matrix3d::Identity());
        }
    }
    Eigen::VectorXd load = Eigen::VectorXd::Zero(3 * free);
    for (std::size_t c = 0; c < 3; ++c)
      if (int const at = place[static_cast<std::size_t>(corners[c])]; at >= 0) load.segment<3>(3 * at) += weights[static_cast<int>(c)] * n;
    return 1 / load.dot(matrix.llt().solve(load));
  }
  double stiffness_at(std::array<int, 3> const& corners, Eigen::Vector3d const& weights, Eigen::Vector3d const& n) const {
    return stiffness_at(corners, weights, n, std::vector<char>(static_cast<std::size_t>(mesh.points.cols()), 1));
  }
};

/// A cube of tissue of 4 cm, its top at z = 0 around the origin, nailed at its bottom.
inline Solid solid_block(int n = 5) {
  Solid solid{palpate::make_block<double>(n, n, n, 0.04 / (n - 1), palpate::BlockPattern::alternating)};
  solid.mesh.points.colwise() -= Eigen::Vector3d(0.02, 0.02, 0.04);
  return solid;
}

/// A ball of tissue around the origin, its surface's nodes on the sphere, nailed at its bottom: a block whose shells are pulled onto spheres.
inline Solid solid_ball(int n = 7, double radius = 0.02) {
  Solid solid{palpate::make_block<double>(n, n, n, 2.0 / (n - 1), palpate::BlockPattern::alternating), -0.7 * radius};
  for (Eigen::Index i = 0; i < solid.mesh.points.cols(); ++i) {
    Eigen::Vector3d const p = Eigen::Vector3d(solid.mesh.points.col(i)) - Eigen::Vector3d::Ones(), q = p.cwiseAbs2();
    for (int a = 0; a < 3; ++a) {   // of the six sides of a cube onto a sphere, evenly
      double const b = q[(a + 1) % 3], c = q[(a + 2) % 3];
      solid.mesh.points(a, i) = radius * p[a] * std::sqrt(1 - b / 2 - c / 2 + b * c / 3);
    }
  }
  return solid;
}

}  // namespace palpate_test
