// SPDX-License-Identifier: MIT
#pragma once

// The yardstick of the tests in this folder and beside it: springs, home springs and their motion written down once more, plainly
// and without a line of the library. Everything is double.

#include <Eigen/Dense>

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace palpate_test {

using Points = Eigen::Matrix<double, 3, Eigen::Dynamic>;

/// m_i a_i = −Σ (k (|d| − L) + c (v_i − v_j)·n) n − k_i (x_i − X_i) − c_i v_i + f_i + m_i g; nailed particles stand still.
struct NaiveBody {
  struct Edge {
    int a, b;
    double rest_length, stiffness, damping;
  };

  Points home, x, v, force;   // force: applied from outside
  std::vector<double> mass, home_stiffness, home_damping;
  std::vector<char> fixed;
  std::vector<Edge> edges;
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();

  explicit NaiveBody(Points const& points) : home(points), x(points), v(points), force(points) {
    v.setZero();
    force.setZero();
    auto const n = static_cast<std::size_t>(points.cols());
    mass.assign(n, 1.0);
    home_stiffness.assign(n, 0.0);
    home_damping.assign(n, 0.0);
    fixed.assign(n, 0);
  }

  int size() const { return static_cast<int>(home.cols()); }

  void join(int a, int b, double stiffness, double damping, double prestrain = 0.0) {
    edges.push_back({a, b, (1.0 - prestrain) * (home.col(a) - home.col(b)).norm(), stiffness, damping});
  }

  Points forces(Points const& at, Points const& speed) const {
    Points f = force;
    for (int i = 0; i < size(); ++i) {
      auto const u = static_cast<std::size_t>(i);
      f.col(i) += mass[u] * gravity - home_stiffness[u] * (at.col(i) - home.col(i)) - home_damping[u] * speed.col(i);
    }
    for (Edge const& e : edges) {
      Eigen::Vector3d const d = at.col(e.a) - at.col(e.b);
      Eigen::Vector3d const n = d / d.norm();
      Eigen::Vector3d const pull =
          (e.stiffness * (d.norm() - e.rest_length) + e.damping * n.dot(speed.col(e.a) - speed.col(e.b))) * n;
      f.col(e.a) -= pull;
      f.col(e.b) += pull;
    }
    return f;
  }

  Points accelerations(Points const& at, Points const& speed) const {
    Points a = forces(at, speed);
    for (int i = 0; i < size(); ++i) {
      auto const u = static_cast<std::size_t>(i);
      if (fixed[u])
        a.col(i).setZero();
      else
        a.col(i) /= mass[u];
    }
    return a;
  }

  double energy(Points const& at) const {
    double sum = 0.0;
    for (int i = 0; i < size(); ++i)
      sum += home_stiffness[static_cast<std::size_t>(i)] / 2 * (at.col(i) - home.col(i)).squaredNorm();
    for (Edge const& e : edges) sum += e.stiffness / 2 * std::pow((at.col(e.a) - at.col(e.b)).norm() - e.rest_length, 2);
    return sum;
  }

  /// One long step of Gragg, Bulirsch and Stoer: the midpoint rule with 2, 4, … 12 parts, extrapolated to order 12.
  /// Not one of the library's methods. Nailed particles may carry a velocity of zero only.
  void advance(double step) {
    constexpr int rows = 6;
    std::array<Points, rows> table_x, table_v;
    for (int row = 0; row < rows; ++row) {
      int const parts = 2 * (row + 1);
      double const h = step / parts;
      Points last_x = x, last_v = v;
      Points now_x = x + h * v, now_v = v + h * accelerations(x, v);
      for (int k = 1; k < parts; ++k) {
        Points const next_x = last_x + 2 * h * now_v;
        Points const next_v = last_v + 2 * h * accelerations(now_x, now_v);
        last_x = now_x, last_v = now_v;
        now_x = next_x, now_v = next_v;
      }
      auto const r = static_cast<std::size_t>(row);
      table_x[r] = (last_x + now_x + h * now_v) / 2;
      table_v[r] = (last_v + now_v + h * accelerations(now_x, now_v)) / 2;
      for (int k = row - 1; k >= 0; --k) {   // Neville's scheme in h²
        auto const c = static_cast<std::size_t>(k);
        double const ratio = std::pow(static_cast<double>(parts) / (2.0 * (k + 1)), 2) - 1.0;
        table_x[c] = (table_x[c + 1] + (table_x[c + 1] - table_x[c]) / ratio).eval();
        table_v[c] = (table_v[c + 1] + (table_v[c + 1] - table_v[c]) / ratio).eval();
      }
    }
    x = table_x[0];
    v = table_v[0];
  }

  void advance(double duration, int steps) {
    for (int k = 0; k < steps; ++k) advance(duration / steps);
  }
};

/// nx × ny particles, `spacing` apart, each square with its sides and the diagonal from lower left to upper right.
inline NaiveBody naive_grid(int nx, int ny, double spacing, double stiffness, double damping, double prestrain = 0.0) {
  Points points(3, nx * ny);
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) points.col(j * nx + i) << i * spacing, j * spacing, 0.0;
  NaiveBody body(points);
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      int const a = j * nx + i;
      if (i + 1 < nx) body.join(a, a + 1, stiffness, damping, prestrain);
      if (j + 1 < ny) body.join(a, a + nx, stiffness, damping, prestrain);
      if (i + 1 < nx && j + 1 < ny) body.join(a, a + nx + 1, stiffness, damping, prestrain);
    }
  return body;
}

/// The particles on the border of an nx × ny grid.
inline std::vector<int> grid_border(int nx, int ny) {
  std::vector<int> border;
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i)
      if (i == 0 || j == 0 || i == nx - 1 || j == ny - 1) border.push_back(j * nx + i);
  return border;
}

}  // namespace palpate_test
