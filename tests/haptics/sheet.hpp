// SPDX-License-Identifier: MIT
#pragma once

#include "body/naive_body.hpp"

#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/edges.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

namespace palpate_test {

/// A patch of skin with a nailed border, and its equilibrium under a tool, found by Newton's method on the springs of naive_body.hpp:
/// nothing of it uses the library's forces, integrators or contact.
struct Sheet {
  palpate::TriangleMesh<double> skin = palpate::make_grid<double>(9, 9, 0.005);
  double mass = 0.05, link = 60.0, home = 4.0;
  double link_damping = 0.02, home_damping = 0.05;

  palpate::MassSpring<double> tissue() const {
    palpate::MassSpring<double> t(skin, {.mass = {.total = mass, .lumping = palpate::Lumping::equal},
                                         .link = {.stiffness = link, .damping = link_damping},
                                         .home = {.stiffness = home, .damping = home_damping}});
    t.nail(palpate::boundary_vertices(skin));
    return t;
  }

  struct Rest {
    double force;             // N, of the contact
    Eigen::Vector3d touched;  // m, the touched point
  };

  /// A spring k [N/m] along z between the point with weights b of three particles, and a tip at the height tip_z [m]; it only pushes.
  Rest equilibrium(std::array<int, 3> const& corners, Eigen::Vector3d const& b, double tip_z, double k) const {
    NaiveBody body(skin.points);
    for (auto const& [i, j] : palpate::edges(skin)) body.join(i, j, link, link_damping);
    std::fill(body.home_stiffness.begin(), body.home_stiffness.end(), home);
    for (int const i : palpate::boundary_vertices(skin)) body.fixed[static_cast<std::size_t>(i)] = 1;
    std::vector<int> free;
    for (int i = 0; i < body.size(); ++i)
      if (body.fixed[static_cast<std::size_t>(i)] == 0) free.push_back(i);
    auto const n = static_cast<Eigen::Index>(3 * free.size());
    Eigen::Matrix3Xd x = body.home;
    Eigen::Matrix3Xd const still = Eigen::Matrix3Xd::Zero(3, x.cols());
    double force = 0;
    auto const touched = [&](Eigen::Matrix3Xd const& at) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (int c = 0; c < 3; ++c) sum += b[c] * at.col(corners[static_cast<std::size_t>(c)]);
      return sum;
    };
    auto const residual = [&](Eigen::Matrix3Xd const& at) {
      Eigen::Matrix3Xd f = body.forces(at, still);
      force = std::max(0.0, k * (touched(at).z() - tip_z));
      for (int c = 0; c < 3; ++c) f(2, corners[static_cast<std::size_t>(c)]) -= b[c] * force;
      Eigen::VectorXd r(n);
      for (std::size_t i = 0; i < free.size(); ++i) r.segment<3>(static_cast<Eigen::Index>(3 * i)) = f.col(free[i]);
      return r;
    };
    for (int iteration = 0; iteration < 60; ++iteration) {
      Eigen::VectorXd const r = residual(x);
      if (r.norm() < 1e-12) break;
      Eigen::MatrixXd tangent(n, n);
      for (Eigen::Index c = 0; c < n; ++c) {
        Eigen::Matrix3Xd ahead = x, behind = x;
        ahead(c % 3, free[static_cast<std::size_t>(c / 3)]) += 1e-7;
        behind(c % 3, free[static_cast<std::size_t>(c / 3)]) -= 1e-7;
        tangent.col(c) = (residual(ahead) - residual(behind)) / 2e-7;
      }
      Eigen::VectorXd const dx = -tangent.partialPivLu().solve(r);
      double share = 1.0;   // halved until the residual falls
      for (int halving = 0; halving < 30; ++halving, share /= 2) {
        Eigen::Matrix3Xd next = x;
        for (std::size_t i = 0; i < free.size(); ++i) next.col(free[i]) += share * dx.segment<3>(static_cast<Eigen::Index>(3 * i));
        if (residual(next).norm() < r.norm()) {
          x = next;
          break;
        }
      }
    }
    if (!(residual(x).norm() < 1e-9)) return {-1.0, Eigen::Vector3d::Zero()};   // fails every comparison
    return {force, touched(x)};
  }
};

}  // namespace palpate_test
