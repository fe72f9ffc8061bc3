// SPDX-License-Identifier: MIT
#include "catch.hpp"
#include "yardstick.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/core/random.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/material/corotational.hpp>
#include <palpate/material/linear_elastic.hpp>
#include <palpate/material/neo_hookean.hpp>
#include <palpate/material/st_venant_kirchhoff.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/statics/newton_raphson.hpp>
#include <palpate/tissue/finite_elements.hpp>

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

using namespace palpate;
using palpate_test::check_yardstick, palpate_test::text, palpate_test::worse;

namespace {

using Vector = Eigen::VectorXd;
using Sparse = Eigen::SparseMatrix<double>;
constexpr double pi = std::numbers::pi;

template <class M>
FiniteElements<double, M> solid(TetrahedralMesh<double> const& mesh, M const& material, double density = 1000) {
  return {mesh, {.density = density, .material = material}};
}

/// The stiffness at x, 3 i + a the number of direction a at particle i.
template <class Tissue>
Sparse stiffness(Tissue const& tissue, Matrix3X<double> const& x) {
  std::vector<Eigen::Triplet<double>> entries;
  tissue.for_each_stiffness_block(x, [&](int i, int j, Matrix<double, 3, 3> const& block) {
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) entries.emplace_back(3 * i + a, 3 * j + b, block(a, b));
  });
  Sparse matrix(3 * tissue.size(), 3 * tissue.size());
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

template <class Tissue>
Sparse stiffness_at_rest(Tissue const& tissue) {
  return stiffness(tissue, tissue.rest_positions());
}

/// Linear equilibrium K u = f where single unknowns are given.
class LinearStatics {
 public:
  LinearStatics(Sparse stiffness, std::vector<bool> const& is_given) : stiffness_(std::move(stiffness)) {
    Eigen::Index const n = stiffness_.rows();
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::Index free = 0;
    for (Eigen::Index k = 0; k < n; ++k)
      if (!is_given[static_cast<std::size_t>(k)]) entries.emplace_back(static_cast<int>(k), static_cast<int>(free++), 1.0);
    choice_.resize(n, free);
    choice_.setFromTriplets(entries.begin(), entries.end());
    solver_.compute(Sparse(choice_.transpose() * stiffness_ * choice_));
  }

  /// The displacements under these loads; those that are given keep their value in `given`, which is 0 at all others.
  Vector solve(Vector const& load, Vector const& given) const {
    return given + choice_ * solver_.solve(choice_.transpose() * (load - stiffness_ * given));
  }
  /// What lies at the unknowns that are free, and back.
  Vector free_part(Vector const& all) const { return choice_.transpose() * all; }
  Vector solve_free(Vector const& load) const { return solver_.solve(load); }
  /// K u: what has to be pulled with to stay there.
  Vector reactions(Vector const& u) const { return stiffness_ * u; }

 private:
  Sparse stiffness_, choice_;
  Eigen::SimplicialLDLT<Sparse> solver_;
};

/// The value at h = 0 of the parabola in h² through three (h, value).
double extrapolated(std::array<double, 3> const& h, std::array<double, 3> const& value) {
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    double weight = 1;
    for (std::size_t j = 0; j < 3; ++j)
      if (j != i) weight *= h[j] * h[j] / (h[j] * h[j] - h[i] * h[i]);
    sum += weight * value[i];
  }
  return sum;
}

/// A rule of 14 points for a tetrahedron that is exact to degree 5: barycentric coordinates and weights, which sum to 1.
template <class Visit>
void for_each_point_of_rule(Visit visit) {
  auto const at_corners = [&](double a, double weight) {
    for (int k = 0; k < 4; ++k) {
      Eigen::Vector4d point = Eigen::Vector4d::Constant(a);
      point[k] = 1 - 3 * a;
      visit(point, weight);
    }
  };
  at_corners(0.3108859192633006, 0.1126879257180159);
  at_corners(0.0927352503108912, 0.0734930431163619);
  double const a = 0.0455037041256496;
  for (int k = 0; k < 4; ++k)
    for (int other = k + 1; other < 4; ++other) {
      Eigen::Vector4d point = Eigen::Vector4d::Constant(a);
      point[k] = point[other] = 0.5 - a;
      visit(point, 0.0425460207770815);
    }
}

/// Displacements u = Σ d sin(k·x + φ), and the body force that they are in equilibrium with:
///   −(λ + μ) ∇(∇·u) − μ Δu = Σ ((λ + μ) (d·k) k + μ k² d) sin(k·x + φ)
struct Waves {
  struct Wave {
    Vector3<double> d, k;
    double phase;
  };
  std::array<Wave, 2> waves{{{{0.02, -0.01, 0.015}, {1.5, 1.0, -0.8}, 0.3}, {{-0.01, 0.02, 0.01}, {-0.7, 1.2, 1.6}, 1.1}}};

  Vector3<double> displacement(Vector3<double> const& x) const {
    Vector3<double> sum = Vector3<double>::Zero();
    for (Wave const& w : waves) sum += std::sin(w.k.dot(x) + w.phase) * w.d;
    return sum;
  }
  Matrix<double, 3, 3> gradient(Vector3<double> const& x) const {
    Matrix<double, 3, 3> sum = Matrix<double, 3, 3>::Zero();
    for (Wave const& w : waves) sum += std::cos(w.k.dot(x) + w.phase) * w.d * w.k.transpose();
    return sum;
  }
  Vector3<double> force(Vector3<double> const& x, LameConstants<double> const& lame) const {
    Vector3<double> sum = Vector3<double>::Zero();
    for (Wave const& w : waves) sum += std::sin(w.k.dot(x) + w.phase) * ((lame.lambda + lame.mu) * w.d.dot(w.k) * w.k + lame.mu * w.k.squaredNorm() * w.d);
    return sum;
  }
};

/// Errors of displacements and of their gradients, in the mean square, of a unit cube of n³ cubes.
std::pair<double, double> errors_of_waves(int n) {
  double const young = 1000, poisson = 0.3;
  auto const lame = lame_constants(young, poisson);
  Waves const exact;
  auto const mesh = make_block<double>(n + 1, n + 1, n + 1, 1.0 / n, BlockPattern::alternating);
  auto const tissue = solid(mesh, LinearElastic<double>{young, poisson});
  auto const for_each_point = [&](auto const& visit) {
    tissue.for_each_element([&](std::array<int, 4> const& nodes, auto const& element) {
      Matrix<double, 3, 4> X;
      for (int a = 0; a < 4; ++a) X.col(a) = mesh.points.col(nodes[static_cast<std::size_t>(a)]);
      for_each_point_of_rule([&](Eigen::Vector4d const& point, double weight) { visit(nodes, X, point, weight * element.volume()); });
    });
  };
  Vector load = Vector::Zero(3 * tissue.size()), given = load;
  for_each_point([&](auto const& nodes, auto const& X, Eigen::Vector4d const& point, double volume) {
    Vector3<double> const force = exact.force(X * point, lame);
    for (int a = 0; a < 4; ++a) load.segment<3>(3 * nodes[static_cast<std::size_t>(a)]) += point[a] * volume * force;
  });
  std::vector<bool> is_given(static_cast<std::size_t>(3 * tissue.size()), false);
  for (int i = 0; i < tissue.size(); ++i)
    if (mesh.points.col(i).minCoeff() < 1e-9 || mesh.points.col(i).maxCoeff() > 1 - 1e-9) {
      given.segment<3>(3 * i) = exact.displacement(mesh.points.col(i));
      for (int a = 0; a < 3; ++a) is_given[static_cast<std::size_t>(3 * i + a)] = true;
    }
  Vector const u = LinearStatics(stiffness_at_rest(tissue), is_given).solve(load, given);
  double squared = 0, squared_gradient = 0;
  for_each_point([&](auto const& nodes, auto const& X, Eigen::Vector4d const& point, double volume) {
    Matrix<double, 3, 4> U;
    for (int a = 0; a < 4; ++a) U.col(a) = u.segment<3>(3 * nodes[static_cast<std::size_t>(a)]);
    Matrix<double, 3, 3> const gradient = (U.rightCols<3>().colwise() - U.col(0)) * Matrix<double, 3, 3>(X.template rightCols<3>().colwise() - X.col(0)).inverse();
    squared += volume * (U * point - exact.displacement(X * point)).squaredNorm();
    squared_gradient += volume * (gradient - exact.gradient(X * point)).squaredNorm();
  });
  return {std::sqrt(squared), std::sqrt(squared_gradient)};
}

/// An octant of a shell between two spheres, of three patches of n × n × n cubes each, and where its particles lie on a lattice: on the faces of a cube
/// of n, and their layer.
struct Octant {
  TetrahedralMesh<double> mesh;
  std::vector<std::array<int, 4>> lattice;
};
Octant make_octant(int n, double inner, double outer) {
  Octant octant;
  std::map<std::array<int, 4>, int> index;
  std::vector<std::array<int, 4>> tetrahedra;
  auto const patch = make_block<double>(n + 1, n + 1, n + 1, 1.0, BlockPattern::alternating);   // n is even: neighbours' diagonals agree
  for (std::size_t side = 0; side < 3; ++side)
    for (Eigen::Index t = 0; t < patch.tetrahedra.cols(); ++t) {
      auto& corners = tetrahedra.emplace_back();
      for (int c = 0; c < 4; ++c) {
        Vector3<double> const at = patch.points.col(patch.tetrahedra(c, t));
        std::array<int, 4> key{};
        key[side] = n, key[(side + 1) % 3] = static_cast<int>(at.x()), key[(side + 2) % 3] = static_cast<int>(at.y()), key[3] = static_cast<int>(at.z());
        auto const [found, is_new] = index.try_emplace(key, static_cast<int>(octant.lattice.size()));
        if (is_new) octant.lattice.push_back(key);
        corners[static_cast<std::size_t>(c)] = found->second;
      }
    }
  octant.mesh.points.resize(3, static_cast<Eigen::Index>(octant.lattice.size()));
  octant.mesh.tetrahedra.resize(4, static_cast<Eigen::Index>(tetrahedra.size()));
  for (std::size_t i = 0; i < octant.lattice.size(); ++i) {
    auto const& key = octant.lattice[i];
    Vector3<double> const direction(std::tan(pi / 4 * key[0] / n), std::tan(pi / 4 * key[1] / n), std::tan(pi / 4 * key[2] / n));
    octant.mesh.points.col(static_cast<Eigen::Index>(i)) = (inner + (outer - inner) * key[3] / n) * direction.normalized();
  }
  for (std::size_t t = 0; t < tetrahedra.size(); ++t)
    for (int c = 0; c < 4; ++c) octant.mesh.tetrahedra(c, static_cast<Eigen::Index>(t)) = tetrahedra[t][static_cast<std::size_t>(c)];
  return octant;
}

/// The mean radial displacements of a sphere's inner and outer surface under a pressure of one modulus inside, over the inner radius; outer = 2 inner.
std::pair<double, double> widening_of_sphere(int n, double poisson) {
  double const young = 1000, inner = 0.01;
  auto const octant = make_octant(n, inner, 2 * inner);
  auto const tissue = solid(octant.mesh, LinearElastic<double>{young, poisson});
  auto const& points = octant.mesh.points;
  Vector load = Vector::Zero(3 * tissue.size());
  auto const layer = [&](int i) { return octant.lattice[static_cast<std::size_t>(i)][3]; };
  for (int t = 0; t < tissue.surface().triangle_count(); ++t) {
    auto const corners = tissue.surface().corners(t);
    if (layer(corners[0]) + layer(corners[1]) + layer(corners[2]) > 0) continue;
    Vector3<double> const a = points.col(corners[0]), b = points.col(corners[1]), c = points.col(corners[2]);
    Vector3<double> const push = -young / 6 * (b - a).cross(c - a);   // its normal points out of the shell, to the centre
    for (int const i : corners) load.segment<3>(3 * i) += push;
  }
  std::vector<bool> is_given(static_cast<std::size_t>(3 * tissue.size()), false);
  for (int i = 0; i < tissue.size(); ++i)
    for (int a = 0; a < 3; ++a)   // the planes of symmetry
      is_given[static_cast<std::size_t>(3 * i + a)] = octant.lattice[static_cast<std::size_t>(i)][static_cast<std::size_t>(a)] == 0;
  Vector const u = LinearStatics(stiffness_at_rest(tissue), is_given).solve(load, Vector::Zero(load.size()));
  std::array<double, 2> sum{}, count{};
  for (int i = 0; i < tissue.size(); ++i)
    if (layer(i) == 0 || layer(i) == n) {
      auto const k = static_cast<std::size_t>(layer(i) == n);
      sum[k] += u.segment<3>(3 * i).dot(points.col(i).normalized()), count[k] += 1;
    }
  return {sum[0] / count[0] / inner, sum[1] / count[1] / inner};
}

/// A beam of 20 x 1 with `through` cubes through its height and one through its width, which matters not where nu = 0; nothing moves sideways.
struct PlaneBeam {
  static constexpr double height = 0.01, length = 20 * height;
  int through;
  double width = height / through, inertia = width * height * height * height / 12;   // m, m⁴
  TetrahedralMesh<double> mesh = make_block<double>(20 * through + 1, 2, through + 1, width, BlockPattern::alternating);

  /// Unknowns that stay where they are: all at the clamped end, and all that point sideways.
  std::vector<bool> given() const {
    std::vector<bool> is_given;
    for (Eigen::Index i = 0; i < mesh.points.cols(); ++i)
      for (int a = 0; a < 3; ++a) is_given.push_back(a == 1 || mesh.points(0, i) < 1e-9);
    return is_given;
  }
  /// What part of the end face belongs to a particle.
  double share_of_end(int i) const {
    if (mesh.points(0, i) < length - 1e-9) return 0;
    double const z = mesh.points(2, i);
    return (z < 1e-9 || z > height - 1e-9 ? 0.25 : 0.5) / through;
  }
};

/// Equilibrium under dead loads, by Newton's method with the elements' own tangents and a factorisation.
template <class Tissue>
void equilibrate(Tissue const& tissue, Vector const& load, std::vector<bool> const& is_given, Vector& x) {
  auto const gather = [&](Vector const& all, std::array<int, 4> const& nodes) {
    Matrix<double, 3, 4> columns;
    for (int a = 0; a < 4; ++a) columns.col(a) = all.segment<3>(3 * nodes[static_cast<std::size_t>(a)]);
    return columns;
  };
  double last = 1;
  for (int k = 0; k < 40; ++k) {
    std::vector<Eigen::Triplet<double>> entries;
    Vector force = load;
    tissue.for_each_element([&](std::array<int, 4> const& nodes, auto const& element) {
      Matrix<double, 3, 4> const own = gather(x, nodes), pull = element.force(own);
      Matrix<double, 12, 12> const stiffness = element.stiffness(own);
      for (int a = 0; a < 12; ++a) {
        int const row = 3 * nodes[static_cast<std::size_t>(a / 3)] + a % 3;
        force[row] += pull(a % 3, a / 3);
        if (is_given[static_cast<std::size_t>(row)]) continue;
        for (int b = 0; b < 12; ++b) {
          int const column = 3 * nodes[static_cast<std::size_t>(b / 3)] + b % 3;
          if (!is_given[static_cast<std::size_t>(column)]) entries.emplace_back(row, column, stiffness(a, b));
        }
      }
    });
    Sparse matrix(x.size(), x.size());
    matrix.setFromTriplets(entries.begin(), entries.end());
    Vector const change = LinearStatics(matrix, is_given).solve(force, Vector::Zero(x.size()));
    x += change;
    double const now = change.lpNorm<Eigen::Infinity>() / PlaneBeam::length;
    if (now < 1e-9) return;
    last = now;
  }
  FAIL("no equilibrium: the last change was " << last << " lengths");
}

/// Deflection and shortening of such a beam's tip over its length, under the loads alpha E I / L² = 1 and 2.
std::array<std::array<double, 2>, 2> large_deflections(int through) {
  double const young = 1e5;
  PlaneBeam const beam{through};
  auto const tissue = solid(beam.mesh, StVenantKirchhoff<double>{young, 0.0});
  auto const is_given = beam.given();
  Vector x = beam.mesh.points.reshaped();
  Vector const rest = x;
  std::array<std::array<double, 2>, 2> result{};
  for (int alpha = 1; alpha <= 2; ++alpha) {
    Vector load = Vector::Zero(x.size());
    for (int i = 0; i < tissue.size(); ++i) load[3 * i + 2] = -alpha * young * beam.inertia / (beam.length * beam.length) * beam.share_of_end(i);
    equilibrate(tissue, load, is_given, x);
    auto& [deflection, shortening] = result[static_cast<std::size_t>(alpha - 1)];
    for (int i = 0; i < tissue.size(); ++i) {
      deflection -= beam.share_of_end(i) * (x - rest)[3 * i + 2] / beam.length;
      shortening -= beam.share_of_end(i) * (x - rest)[3 * i] / beam.length;
    }
  }
  return result;
}

/// beta L of the slowest bending mode of that beam: omega² = (E I/(rho A)) beta⁴.
double wave_number(int through) {
  double const young = 1e5, density = 1000;
  PlaneBeam const beam{through};
  auto const tissue = solid(beam.mesh, LinearElastic<double>{young, 0.0}, density);
  LinearStatics const statics(stiffness_at_rest(tissue), beam.given());
  Vector all_masses(3 * tissue.size());
  for (int i = 0; i < tissue.size(); ++i) all_masses.segment<3>(3 * i).setConstant(tissue.mass(i));
  Vector const masses = statics.free_part(all_masses);
  Vector mode = Vector::Ones(masses.size());
  double squared = 0;
  for (int k = 0; k < 30; ++k) {   // the next mode is 6.3 times as fast: a digit and a half each
    mode /= std::sqrt(mode.dot(masses.cwiseProduct(mode)));
    Vector const next = statics.solve_free(masses.cwiseProduct(mode));
    double const before = squared;
    squared = 1 / mode.dot(masses.cwiseProduct(next));
    mode = next;
    if (std::abs(squared - before) < 1e-10 * squared) break;
  }
  double const mass_of_length = density * beam.width * beam.height;
  return beam.length * std::pow(squared * mass_of_length / (young * beam.inertia), 0.25);
}

/// A disc of tissue that a rigid body presses from above, its axis in the middle: a slice of it, whose two sides move alike, along r and z.
/// Its lower face slides on a table, its rim is free; `size` its radius and its height over the radius a that touches.
class PressedDisc {
 public:
  static constexpr double a = 0.01, young = 1000, poisson = 0.3, modulus = young / (1 - poisson * poisson);   // m, Pa, 1, Pa: of the half-space

  /// `inside` cells over a: at its edge, where a punch's pressure is singular, the smallest, a/inside².
  explicit PressedDisc(double size, int inside = 10) : inside_(inside) {
    std::vector<double> down;
    for (int k = 0; k <= inside; ++k) radii_.push_back(a * (1 - std::pow(static_cast<double>(inside - k) / inside, 2)));
    while (radii_.back() < size * a) radii_.push_back(a + a * std::pow(static_cast<double>(static_cast<int>(radii_.size()) - inside) / inside, 2));
    for (int k = 0; k == 0 || down.back() < size * a; ++k) down.push_back(a * std::pow(static_cast<double>(k) / inside, 2));
    radii_.back() = down.back() = size * a;
    columns_ = static_cast<int>(radii_.size()), rows_ = static_cast<int>(down.size());
    // Kuhn's tetrahedra have an edge across the slice each: what is alike on both sides is not sheared. On the axis the sides are one.
    auto const block = make_block<double>(columns_, 2, rows_, 1.0);
    std::vector<int> index(static_cast<std::size_t>(block.points.cols()));
    TetrahedralMesh<double> mesh;
    std::vector<Eigen::Triplet<double>> entries;
    mesh.points.resize(3, block.points.cols() - rows_);
    int count = 0;
    for (int k = 0; k < rows_; ++k)
      for (int j = 0; j < 2; ++j)
        for (int i = 0; i < columns_; ++i) {
          auto const at = static_cast<std::size_t>((2 * k + j) * columns_ + i);
          if (i == 0 && j == 1) {
            index[at] = index[at - static_cast<std::size_t>(columns_)];
            continue;
          }
          index[at] = count;
          double const angle = (j - 0.5) * slice, r = radii_[static_cast<std::size_t>(i)];
          mesh.points.col(count) << r * std::cos(angle), r * std::sin(angle), -down[static_cast<std::size_t>(rows_ - 1 - k)];
          entries.emplace_back(3 * count, unknown(i, k, 0), std::cos(angle));
          entries.emplace_back(3 * count + 1, unknown(i, k, 0), std::sin(angle));
          entries.emplace_back(3 * count + 2, unknown(i, k, 1), 1.0);
          ++count;
        }
    mesh.tetrahedra.resize(4, block.tetrahedra.cols());
    Eigen::Index kept = 0;
    for (Eigen::Index t = 0; t < block.tetrahedra.cols(); ++t) {
      Eigen::Vector4i corners;
      for (int c = 0; c < 4; ++c) corners[c] = index[static_cast<std::size_t>(block.tetrahedra(c, t))];
      auto sorted = corners;
      std::sort(sorted.begin(), sorted.end());
      if (std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end()) mesh.tetrahedra.col(kept++) = corners;
    }
    mesh.tetrahedra.conservativeResize(4, kept);
    Sparse alike(3 * count, 2 * columns_ * rows_);
    alike.setFromTriplets(entries.begin(), entries.end());
    stiffness_ = alike.transpose() * stiffness_at_rest(solid(mesh, LinearElastic<double>{young, poisson})) * alike;
  }

  /// The force [N] of a body that has come down by `depth` [m] and whose lower side is gap(r) above its lowest point. Its first touch is r <= a.
  template <class Gap>
  double force(double depth, Gap const& gap) const {
    std::vector<bool> touches(static_cast<std::size_t>(columns_));
    for (int i = 0; i < columns_; ++i) touches[static_cast<std::size_t>(i)] = i <= inside_;
    for (int round = 0; round < 30; ++round) {
      std::vector<bool> is_given(static_cast<std::size_t>(stiffness_.rows()), false);
      Vector given = Vector::Zero(stiffness_.rows());
      for (int k = 0; k < rows_; ++k) is_given[static_cast<std::size_t>(unknown(0, k, 0))] = true;
      for (int i = 0; i < columns_; ++i) is_given[static_cast<std::size_t>(unknown(i, 0, 1))] = true;
      auto const top = [&](int i) { return unknown(i, rows_ - 1, 1); };
      for (int i = 0; i < columns_; ++i)
        if (touches[static_cast<std::size_t>(i)]) is_given[static_cast<std::size_t>(top(i))] = true, given[top(i)] = gap(radii_[static_cast<std::size_t>(i)]) - depth;
      LinearStatics const statics(stiffness_, is_given);
      Vector const u = statics.solve(Vector::Zero(given.size()), given), pull = statics.reactions(u);
      double sum = 0;
      bool changes = false;
      for (int i = 0; i < columns_; ++i) {
        auto const k = static_cast<std::size_t>(i);
        bool const stays = touches[k] ? pull[top(i)] < 0 : u[top(i)] > gap(radii_[k]) - depth;
        if (touches[k]) sum -= pull[top(i)];
        if (stays != touches[k]) touches[k] = stays, changes = true;
      }
      if (!changes) return sum * 2 * pi / slice;
    }
    FAIL("what touches does not come to an end");
    return 0;
  }

 private:
  static constexpr double slice = 0.02;   // rad
  int unknown(int i, int k, int a_) const { return 2 * (k * columns_ + i) + a_; }

  std::vector<double> radii_;
  int inside_, columns_ = 0, rows_ = 0;
  Sparse stiffness_;
};

/// A slice of a long cylinder about z that is twisted by `twist` [rad/m] and kept at its length: its upper side is its lower one, turned and lifted. One layer of
/// prisms on `rings` rings of triangles, each prism three tetrahedra.
class TwistedSlice {
 public:
  static constexpr double a = 0.01, young = 6000, twist = 20;   // m, Pa, rad/m

  explicit TwistedSlice(int rings) : count_(1 + 3 * rings * (rings + 1)), height_(a / rings) {
    auto const at = [](int ring, int k) { return ring == 0 ? 0 : 1 + 3 * ring * (ring - 1) + k % (6 * ring); };
    rest_.points.resize(3, 2 * count_);
    rest_.points.leftCols(count_).setZero();
    for (int ring = 1; ring <= rings; ++ring)
      for (int k = 0; k < 6 * ring; ++k) rest_.points.col(at(ring, k)) = a * ring / rings * Vector3<double>(std::cos(pi * k / (3 * ring)), std::sin(pi * k / (3 * ring)), 0);
    rest_.points.rightCols(count_) = rest_.points.leftCols(count_).colwise() + Vector3<double>(0, 0, height_);
    std::vector<std::array<int, 4>> tetrahedra;
    auto const prism = [&](std::array<int, 3> v) {
      std::sort(v.begin(), v.end());   // so that neighbours divide their side alike
      for (std::array<int, 4> corners : {std::array{v[0], v[1], v[2], v[2] + count_}, {v[0], v[1], v[1] + count_, v[2] + count_}, {v[0], v[0] + count_, v[1] + count_, v[2] + count_}}) {
        auto const edge = [&](std::size_t k) { return Vector3<double>(rest_.points.col(corners[k]) - rest_.points.col(corners[0])); };
        if (edge(1).cross(edge(2)).dot(edge(3)) < 0) std::swap(corners[2], corners[3]);
        tetrahedra.push_back(corners);
      }
    };
    for (int ring = 1; ring <= rings; ++ring)
      for (int side = 0; side < 6; ++side)
        for (int k = 0; k < ring; ++k) {
          prism({at(ring - 1, side * (ring - 1) + k), at(ring, side * ring + k), at(ring, side * ring + k + 1)});
          if (k + 1 < ring) prism({at(ring - 1, side * (ring - 1) + k), at(ring, side * ring + k + 1), at(ring - 1, side * (ring - 1) + k + 1)});
        }
    rest_.tetrahedra.resize(4, std::ssize(tetrahedra));
    for (std::size_t t = 0; t < tetrahedra.size(); ++t) rest_.tetrahedra.col(static_cast<Eigen::Index>(t)) = Eigen::Map<Eigen::Vector4i const>(tetrahedra[t].data());

    turn_ = Eigen::AngleAxisd(twist * height_, Vector3<double>::UnitZ()).toRotationMatrix();
    std::vector<Eigen::Triplet<double>> entries;
    int free = 0;
    for (int k = 0; k < 3 * count_; ++k) {
      if (k < 3 || k == 4) continue;   // the axis stays, and a particle beside it does not go round
      entries.emplace_back(k, free, 1.0);
      for (int b = 0; b < 3; ++b) entries.emplace_back(3 * (count_ + k / 3) + b, free, turn_(b, k % 3));
      ++free;
    }
    alike_.resize(6 * count_, free);
    alike_.setFromTriplets(entries.begin(), entries.end());
  }

  /// Moment and axial force over those of an incompressible cylinder at small twist, pi mu twist a^4/2 and -pi mu twist^2 a^4/4.
  std::array<double, 2> moment_and_pull(double poisson) const {
    FiniteElements<double, NeoHookean<double>> const tissue(rest_, {.density = 1000, .material = {young, poisson}, .pressure = Pressure::nodal});
    Matrix3X<double> x = tied(rest_.points);
    Vector force(6 * count_);
    auto const pull = [&] {
      for (int i = 0; i < 2 * count_; ++i) force.segment<3>(3 * i) = tissue.internal_force(i, x, Matrix3X<double>::Zero(3, 2 * count_).eval());
      return Vector(alike_.transpose() * force);
    };
    double first = 0;
    for (int round = 0; round < 100; ++round) {
      Vector const left = pull();
      if (round == 0) first = force.norm();
      if (left.norm() < 1e-7 * first) break;
      REQUIRE(round < 99);
      Vector const step = alike_ * Eigen::SimplicialLDLT<Sparse>(Sparse(alike_.transpose() * stiffness(tissue, x) * alike_)).solve(left);
      Matrix3X<double> const before = x;
      double const energy = tissue.potential_energy(x);
      for (double share = 1; share > 1e-6; share /= 2) {
        x = tied(before + share * step.reshaped(3, 2 * count_));
        if (tissue.potential_energy(x) <= energy * (1 + 1e-14)) break;
      }
    }
    double moment = 0, along = 0;
    for (int i = count_; i < 2 * count_; ++i) {
      Vector3<double> const hold = -force.segment<3>(3 * i);
      moment += x(0, i) * hold.y() - x(1, i) * hold.x(), along += hold.z();
    }
    double const mu = young / (2 * (1 + poisson)), fourth = std::pow(a, 4);
    return {moment / (pi * mu * twist * fourth / 2), along / (-pi * mu * twist * twist * fourth / 4)};
  }

 private:
  Matrix3X<double> tied(Matrix3X<double> x) const {
    x.rightCols(count_) = (turn_ * x.leftCols(count_)).colwise() + Vector3<double>(0, 0, height_);
    return x;
  }

  int count_;   // of a side
  double height_;
  TetrahedralMesh<double> rest_;
  Eigen::Matrix3d turn_;
  Sparse alike_;
};

/// Starts a body from positions, at rest or with velocities.
template <class Body>
void start(Body& body, Matrix3X<double> const& x, Matrix3X<double> const& v) {
  auto state = body.save();
  for (int i = 0; i < body.size(); ++i) state.particles.position[i] = x.col(i), state.particles.velocity[i] = v.col(i);
  body.restore(state);
}
template <class Body>
void start(Body& body, Matrix3X<double> const& x) {
  start(body, x, Matrix3X<double>::Zero(3, x.cols()));
}

/// The least det F of all tetrahedra.
template <class Tissue>
double least_volume(Tissue const& tissue, Matrix3X<double> const& x) {
  double least = 1e9;
  tissue.for_each_element([&](std::array<int, 4> const& nodes, auto const& element) {
    auto const at = [&](std::size_t k) { return Vector3<double>(x.col(nodes[k]) - x.col(nodes[0])); };
    least = std::min(least, at(1).cross(at(2)).dot(at(3)) / (6 * element.volume()));
  });
  return least;
}

template <class Body>
bool is_finite_everywhere(Body const& body) {
  return Matrix3X<double>(body.positions()).allFinite() && Matrix3X<double>(body.velocities()).allFinite();
}

template <class M>
void check_that_it_comes_back(std::string const& name, M const& material, double h) {
  double const edge = 0.01;
  double lost = 0;
  auto const mesh = make_block<double>(4, 4, 4, edge, BlockPattern::alternating);
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Random random(Seed{seed});
    Matrix3X<double> noise(3, mesh.points.cols());
    for (double& number : noise.reshaped()) number = random.uniform(-edge, edge);
    auto const recovers = [&](std::string const& from, Matrix3X<double> const& x) {
      CAPTURE(seed, from);
      SoftBody body(solid(mesh, material), BackwardEuler{});
      start(body, x);
      CHECK(least_volume(body.tissue(), x) < 1e-6);
      double const energy = body.potential_energy();
      for (int k = 0; k < 1000 && !(body.potential_energy() < 1e-6 * energy); ++k) REQUIRE(body.step(h));
      CHECK(body.potential_energy() < 1e-6 * energy);
      lost = worse(lost, 1 - least_volume(body.tissue(), body.positions()));
      CHECK(body.kinetic_energy() < 1e-2 * energy);   // it may turn on
    };
    recovers("flat", Eigen::Vector3d(1, 1, 0).asDiagonal() * mesh.points);
    recovers("nearly flat", Eigen::Vector3d(1, 1, 0).asDiagonal() * mesh.points + 1e-3 * noise);
    recovers("a point with noise", 1e-3 * noise);
    recovers("at random", mesh.points + noise);
  }
  check_yardstick({.what = "flattened, collapsed or at random, 12 runs, " + name + ": least J back at rest", .source = "the shape at rest", .expected = 1, .ours = 1 - lost, .within = 0.01});
}

/// What blocks resist more than the half-space, as parts of its force: the first of `size` times the radius that touches, each next twice as large.
template <std::size_t count>
void check_excess(std::string const& name, std::string const& source, int size, std::array<double, count> const& excess) {
  CAPTURE(excess);
  for (std::size_t k = 1; k < count; ++k)
    check_yardstick({.what = name + ", block of " + std::to_string(size << k) + " a: excess over that of half the block", .source = "inverse of the size", .expected = 0.5,
                     .ours = excess[k] / excess[k - 1], .within = 0.1});
  check_yardstick({.what = name + ": extrapolated force over the half-space's", .source = source, .expected = 1, .ours = 1 + 2 * excess[count - 1] - excess[count - 2], .within = 0.01, .relative = true});
}

/// A number of the environment, for runs that take longer.
int asked(char const* variable, int otherwise) {
  char const* const text = std::getenv(variable);
  return text != nullptr ? std::stoi(text) : otherwise;
}

}  // namespace

// Yardstick: the theory of linear elements, for displacements whose body force is a closed form: errors of u fall with h², of its gradient with h.
TEST_CASE("the errors of a linear solid fall with the square of its edges, those of its strains with the edges", "[tissue][finite_elements][yardstick]") {
  std::array<int, 5> const meshes{3, 4, 6, 8, 12};
  std::array<std::pair<double, double>, 5> errors;
  for (std::size_t k = 0; k < meshes.size(); ++k) {
    errors[k] = errors_of_waves(meshes[k]);
    if (k == 0) continue;
    double const refinement = std::log(static_cast<double>(meshes[k]) / meshes[k - 1]);
    double const order = std::log(errors[k - 1].first / errors[k].first) / refinement, order_of_gradient = std::log(errors[k - 1].second / errors[k].second) / refinement;
    std::string const cubes = ", " + std::to_string(meshes[k - 1]) + " to " + std::to_string(meshes[k]) + " cubes along an edge";
    check_yardstick({.what = "order of the displacements" + cubes, .source = "theory of linear elements", .expected = 2, .ours = order, .within = 0.15});
    check_yardstick({.what = "order of their gradient" + cubes, .source = "theory of linear elements", .expected = 1, .ours = order_of_gradient, .within = 0.15});
  }
}

// Yardstick: Lamé's thick sphere, u(r) = p a³/(E (b³ − a³)) ((1 − 2ν) r + (1 + ν) b³/(2 r²)): with b = 2a, p = E, ν = 0.3 it is 0.8 a at a and 0.3 a at b.
TEST_CASE("a thick sphere under pressure widens by Lame's formula", "[tissue][finite_elements][yardstick]") {
  std::array<int, 3> const meshes{4, 6, 8};
  std::array<double, 3> h{}, inside{}, outside{};
  for (std::size_t k = 0; k < 3; ++k) {
    h[k] = 1.0 / meshes[k];
    std::tie(inside[k], outside[k]) = widening_of_sphere(meshes[k], 0.3);
  }
  CAPTURE(inside, outside);
  std::string const sphere = "thick sphere, b = 2a, p = E, ν = 0.3, extrapolated: ";
  check_yardstick({.what = sphere + "u(a)/a", .source = "Lamé", .expected = 0.8, .ours = extrapolated(h, inside), .within = 0.01, .relative = true});
  check_yardstick({.what = sphere + "u(b)/a", .source = "Lamé", .expected = 0.3, .ours = extrapolated(h, outside), .within = 0.01, .relative = true});
}

// Yardstick: the elastica under a tip load P, its length kept: P L²/(E I) = 1 bends the tip down by 0.30172 L and back by 0.05643 L, 2 by 0.49346 L and
// 0.16064 L; the solid beam is 20 times as long as high. A factorisation of the elements' tangents finds the equilibrium.
TEST_CASE("a slender beam bends far like the elastica", "[tissue][finite_elements][yardstick]") {
  std::array<int, 3> const meshes{4, 6, 8};
  std::array<double, 3> h{};
  std::array<std::array<std::array<double, 2>, 2>, 3> found{};
  for (std::size_t k = 0; k < 3; ++k) h[k] = 1.0 / meshes[k], found[k] = large_deflections(meshes[k]);
  double const expected[2][2] = {{0.30172, 0.05643}, {0.49346, 0.16064}};
  for (std::size_t alpha = 0; alpha < 2; ++alpha)
    for (std::size_t a = 0; a < 2; ++a) {
      std::array<double, 3> const values{found[0][alpha][a], found[1][alpha][a], found[2][alpha][a]};
      CAPTURE(values);
      check_yardstick({.what = "beam 20 × 1 × 1, P L²/(E I) = " + std::to_string(alpha + 1) + ", ν = 0, extrapolated: " + (a == 0 ? "w/L down" : "u/L drawn in"), .source = "elastica",
                       .expected = expected[alpha][a], .ours = extrapolated(h, values), .within = 0.01, .relative = true});
    }
}

// Yardstick: an incompressible cylinder of neo-Hooke that is twisted by tau [rad/m] and kept at its length resists with the moment pi mu tau a^4/2 and pushes with
// pi mu tau^2 a^4/4 (Rivlin). Extrapolated over three meshes, then from Poisson's ratios of 0.45 and 0.49 to 1/2.
TEST_CASE("a twisted cylinder resists and pushes like Rivlin's", "[tissue][finite_elements][yardstick]") {
  std::array<int, 3> const meshes{4, 6, 8};
  std::array<double, 3> h{};
  std::array<std::array<std::array<double, 2>, 3>, 2> found{};
  for (std::size_t k = 0; k < 3; ++k) {
    TwistedSlice const slice(meshes[k]);
    h[k] = 1.0 / meshes[k], found[0][k] = slice.moment_and_pull(0.45), found[1][k] = slice.moment_and_pull(0.49);
  }
  for (std::size_t a = 0; a < 2; ++a) {
    auto const at = [&](std::size_t ratio) { return extrapolated(h, {found[ratio][0][a], found[ratio][1][a], found[ratio][2][a]}); };
    CAPTURE(at(0), at(1));
    check_yardstick({.what = std::string("twisted cylinder of neo-Hooke, nodal pressure, extrapolated: ") + (a == 0 ? "M/(πμτa⁴/2)" : "N/(−πμτ²a⁴/4)"), .source = "Rivlin", .expected = 1,
                     .ours = at(1) + (at(1) - at(0)) * 0.02 / 0.08, .within = 0.01, .relative = true});   // 1 - 2 nu is 0.1 and 0.02
  }
}

// Yardstick: beta L of a clamped beam's first mode is the root 1.8751 of cos(x) cosh(x) = -1. A beam of 20 x 1 is below by 0.1 %: it shears and turns.
TEST_CASE("a slender cantilever swings at the frequency of the closed form", "[tissue][finite_elements][yardstick]") {
  std::array<int, 3> const meshes{4, 6, 8};
  std::array<double, 3> h{}, found{};
  for (std::size_t k = 0; k < 3; ++k) h[k] = 1.0 / meshes[k], found[k] = wave_number(meshes[k]);
  CAPTURE(found);
  check_yardstick({.what = "beam 20 × 1, ν = 0, first swing, extrapolated: βL", .source = "cos βL cosh βL = −1", .expected = 1.8751, .ours = extrapolated(h, found), .within = 0.003, .relative = true});
}

// Yardstick: what nothing holds moves and turns in six ways without frequency.
TEST_CASE("a free block has six modes of no frequency, then those that strain it", "[tissue][finite_elements][yardstick]") {
  auto const mesh = make_block<double>(5, 4, 3, 0.01, BlockPattern::alternating);
  auto const tissue = solid(mesh, StableNeoHookean<double>{3000, 0.45});
  Eigen::MatrixXd const stiffness(stiffness_at_rest(tissue));
  Vector by_root(stiffness.rows());
  for (int i = 0; i < tissue.size(); ++i) by_root.segment<3>(3 * i).setConstant(1 / std::sqrt(tissue.mass(i)));
  Vector const squared = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(by_root.asDiagonal() * stiffness * by_root.asDiagonal(), Eigen::EigenvaluesOnly).eigenvalues();
  check_yardstick({.what = "free block, six modes: ω² over the largest", .source = "rigid motion", .expected = 0,
                   .ours = squared.head(6).cwiseAbs().maxCoeff<Eigen::PropagateNaN>() / squared.tail(1)[0], .within = 1e-11});
  CHECK(squared[6] > 1e-3 * squared.tail(1)[0]);
}

// Yardstick: a half-space resists a flat round punch by 2 a E* d. A block of height and radius H does so more by a part that falls with a/H: what is left at
// twice the size is half, and what the two largest extrapolate to is the half-space. Errors of the mesh fall with the square of its cells.
TEST_CASE("a flat punch finds the half-space's stiffness as the block grows", "[tissue][finite_elements][yardstick]") {
  double const a = PressedDisc::a, depth = 0.1 * a;
  std::array<double, 4> excess{};
  for (std::size_t k = 0; k < 4; ++k) {
    auto const found = [&](int cells) {
      PressedDisc const disc(std::pow(2.0, 2 + static_cast<int>(k)), cells);
      return disc.force(depth, [&](double r) { return r < 1.001 * a ? 0.0 : a; }) / (2 * a * PressedDisc::modulus * depth) - 1;
    };
    excess[k] = (4 * found(10) - found(5)) / 3;
  }
  check_excess("flat punch, ν = 0.3", "2 a E* δ", 4, excess);
  CHECK(std::abs(excess[3]) < 0.05);
}

// Yardstick: Hertz, (4/3) E* sqrt(R) d^1.5 on a half-space; the block's share as above.
TEST_CASE("a ball finds Hertz's force as the block grows", "[tissue][finite_elements][yardstick]") {
  double const a = PressedDisc::a, radius = 10 * a, depth = a * a / radius;
  std::array<double, 3> excess{};
  for (std::size_t k = 0; k < 3; ++k) {
    double const force = PressedDisc(std::pow(2.0, 3 + static_cast<int>(k))).force(depth, [&](double r) { return r * r / (2 * radius); });
    excess[k] = force / (4.0 / 3 * PressedDisc::modulus * std::sqrt(radius) * std::pow(depth, 1.5)) - 1;
  }
  check_excess("ball, ν = 0.3, depth a²/R, R = 10 a", "Hertz, (4/3) E* √R δ^1.5", 8, excess);
}

// Yardstick: the only shape without energy is the one at rest, moved and turned.
TEST_CASE("a solid that is flat, collapsed or in disorder comes back", "[tissue][finite_elements][inversion][yardstick]") {
  check_that_it_comes_back("stable neo-Hooke", StableNeoHookean<double>{5000, 0.3}, 0.01);
  check_that_it_comes_back("corotational", Corotational<double>{5000, 0.3}, 0.01);
}

// Yardstick: where it was nailed it has one shape without energy.
TEST_CASE("a beam that was twisted twice and is let go at one end comes back", "[tissue][finite_elements][inversion][yardstick]") {
  auto const untwists = [&](std::string const& name, auto const& material) {
    double const edge = 0.01, length = 20 * edge;
    auto const mesh = make_block<double>(21, 4, 4, edge, BlockPattern::alternating);
    auto tissue = solid(mesh, material);
    for (int i = 0; i < tissue.size(); ++i)
      if (mesh.points(0, i) < 1e-9) tissue.nail(i);
    SoftBody body(std::move(tissue), BackwardEuler{});
    Matrix3X<double> x = mesh.points;
    Vector3<double> const axis(0, 1.5 * edge, 1.5 * edge);
    for (Eigen::Index i = 0; i < x.cols(); ++i) x.col(i) = axis + Eigen::AngleAxisd(4 * pi * x(0, i) / length, Vector3<double>::UnitX()) * (x.col(i) - axis);
    start(body, x);
    double const energy = body.potential_energy();
    auto const is_back = [&] { return (body.positions() - mesh.points).cwiseAbs().maxCoeff() < 1e-2 * edge && body.kinetic_energy() < 1e-6 * energy; };
    for (int k = 0; k < 2000 && !is_back(); ++k) REQUIRE(body.step(0.01));
    CHECK(is_back());
    check_yardstick({.what = "two full twists, let go at one end, " + name + ": least J back at rest", .source = "the shape at rest", .expected = 1,
                     .ours = least_volume(body.tissue(), body.positions()), .within = 0.01});
  };
  untwists("stable neo-Hooke", StableNeoHookean<double>{5000, 0.45});
  untwists("corotational", Corotational<double>{5000, 0.45});
}

// Yardstick: at F = 0 the stable law's stress is 0, m F and l cof F; the corotational law's is finite.
TEST_CASE("a solid that is one point stays finite", "[tissue][finite_elements][inversion]") {
  auto const mesh = make_block<double>(4, 4, 4, 0.01, BlockPattern::alternating);
  Matrix3X<double> const point = Matrix3X<double>::Constant(3, mesh.points.cols(), 0.25);
  SoftBody stable(solid(mesh, StableNeoHookean<double>{5000, 0.45}), BackwardEuler{});
  start(stable, point);
  for (int k = 0; k < 10; ++k) {
    CHECK(stable.step(0.01));
    CHECK((stable.positions() - point).cwiseAbs().maxCoeff() == 0);
  }
  SoftBody corotational(solid(mesh, Corotational<double>{5000, 0.45}), BackwardEuler{});
  start(corotational, point);
  for (int k = 0; k < 10; ++k) {
    corotational.step(0.01);
    CHECK(is_finite_everywhere(corotational));
  }
}

// Yardstick: a body that nothing acts on keeps its energy, momentum and angular momentum; leapfrog keeps the last two to rounding and an energy that differs
// from the body's by h². PALPATE_SOLID_STEPS sets how many steps.
TEST_CASE("an undamped solid keeps its energy and momenta for long", "[tissue][finite_elements][long][yardstick]") {
  int const steps = asked("PALPATE_SOLID_STEPS", 10000);
  auto const mesh = make_block<double>(4, 4, 4, 0.01, BlockPattern::alternating);
  SoftBody body(solid(mesh, StableNeoHookean<double>{5000, 0.45}), LeapfrogVerlet{});
  Matrix3X<double> const squeezed = Eigen::Vector3d(1.1, 0.95, 1.0).asDiagonal() * mesh.points;
  Matrix3X<double> v(3, mesh.points.cols());
  for (Eigen::Index i = 0; i < v.cols(); ++i) v.col(i) = Vector3<double>(0.01, 0, 0) + Vector3<double>(0, 1, 5).cross(Vector3<double>(squeezed.col(i)));
  start(body, squeezed, v);
  auto const angular_momentum = [&] {
    Vector3<double> sum = Vector3<double>::Zero();
    for (int i = 0; i < body.size(); ++i) sum += body.tissue().mass(i) * Vector3<double>(body.positions().col(i)).cross(Vector3<double>(body.velocities().col(i)));
    return sum;
  };
  double const h = 0.2 * body.stable_step(), energy = body.kinetic_energy() + body.potential_energy();
  Vector3<double> const momentum = body.momentum(), spin = angular_momentum();
  double worst = 0, early = 0, late = 0;
  for (int k = 0; k < steps; ++k) {
    REQUIRE(body.step(h));
    if (k % 5 != 0) continue;
    double const now = body.kinetic_energy() + body.potential_energy() - energy;
    worst = std::max(worst, std::abs(now));
    if (k < steps / 4) early += now / (steps / 20.0);
    if (k >= steps - steps / 4) late += now / (steps / 20.0);
  }
  std::string const over = ", " + std::to_string(steps) + " leapfrog steps";
  check_yardstick({.what = "energy" + over + ": largest error over it", .source = "conserved", .expected = 0, .ours = worst / energy, .within = 0.01});
  check_yardstick({.what = "energy" + over + ": mean of the last quarter less that of the first, over it", .source = "no drift", .expected = 0, .ours = (late - early) / energy, .within = 1e-3});
  check_yardstick({.what = "momentum" + over + ": change over it", .source = "conserved", .expected = 0, .ours = (body.momentum() - momentum).norm() / momentum.norm(), .within = 1e-12});
  check_yardstick({.what = "angular momentum" + over + ": change over it", .source = "conserved", .expected = 0, .ours = (angular_momentum() - spin).norm() / spin.norm(), .within = 1e-12});
}

// Yardstick: what the report promises: a step that was taken leaves finite numbers, one that was not leaves the state before. PALPATE_SOLID_RANDOM sets how
// many meshes.
TEST_CASE("random solids under random forces stay finite, or the report says that they do not", "[tissue][finite_elements][long]") {
  int const meshes = asked("PALPATE_SOLID_RANDOM", 100);
  int steps = 0;
  auto const tries = [&](Random& random, auto tissue, auto const& integrator, double size, double h_of_stable, double h) {
    SoftBody body(std::move(tissue), integrator);
    double const stable = body.stable_step();
    if (std::isfinite(stable)) h = h_of_stable * stable;
    for (int k = 0; k < 8; ++k) {
      for (int i = 0; i < body.size(); ++i)
        body.apply_force(i, size * Vector3<double>(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)));
      Matrix3X<double> const before = body.positions();
      auto const report = body.step(h);
      ++steps;
      REQUIRE(is_finite_everywhere(body));
      if (report) continue;
      REQUIRE(report.particle >= 0);
      REQUIRE((body.positions() - before).cwiseAbs().maxCoeff() <= 1e-6);
      break;
    }
  };
  for (int seed = 1; seed <= meshes; ++seed) {
    CAPTURE(seed);
    Random random(Seed{static_cast<std::uint64_t>(seed)});
    double const edge = std::pow(10.0, random.uniform(-3.0, 0.0)), young = std::pow(10.0, random.uniform(1.0, 10.0)), poisson = random.uniform(-0.95, 0.499);
    double const density = std::pow(10.0, random.uniform(1.0, 4.0)), size = young * edge * edge * std::pow(10.0, random.uniform(-4.0, 2.0));
    double const h_of_stable = random.uniform(0.1, 2.0), h = std::pow(10.0, random.uniform(-4.0, 0.0));
    auto const points = [&] { return static_cast<int>(2 + random.below(3)); };
    int const nx = points(), ny = points(), nz = points();
    auto mesh = make_block<double>(nx, ny, nz, edge, random.below(2) == 0 ? BlockPattern::kuhn : BlockPattern::alternating);
    for (double& number : mesh.points.reshaped()) number += 0.15 * edge * random.uniform(-1.0, 1.0);
    auto const with = [&](auto const& material) {
      auto tissue = solid(mesh, material, density);
      for (int i = 0; i < tissue.size(); ++i)
        if (random.below(8) == 0) tissue.nail(i);
      if (random.below(2) == 0)
        tries(random, std::move(tissue), LeapfrogVerlet{}, size, h_of_stable, h);
      else
        tries(random, std::move(tissue), BackwardEuler{}, size, h_of_stable, h);
    };
    switch (random.below(5)) {
      case 0: with(LinearElastic<double>{young, poisson}); break;
      case 1: with(Corotational<double>{young, poisson}); break;
      case 2: with(StVenantKirchhoff<double>{young, poisson}); break;
      case 3: with(NeoHookean<double>{young, poisson}); break;
      default: with(StableNeoHookean<double>{young, poisson});
    }
  }
  CHECK(steps > 2 * meshes);
}
