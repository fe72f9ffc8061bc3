// SPDX-License-Identifier: MIT
#include <palpate/body/soft_body.hpp>
#include <palpate/core/random.hpp>
#include <palpate/fitting/fit_stiffness.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/organ.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/statics/dynamic_relaxation.hpp>
#include <palpate/statics/newton_raphson.hpp>
#include <palpate/tissue/cubic_spring.hpp>
#include <palpate/tissue/linear_spring.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/saturating_spring.hpp>
#include <palpate/tissue/supported.hpp>

#include "catch.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

using namespace palpate;

namespace {

using Found = TissueCoefficients<double, LinearSpring<double>>;
using Options = MassSpringOptions<double, LinearSpring<double>>;
using Test = IndentationTest<double>;
using Curve = std::vector<IndentationPoint>;

/// Tension, its slope and its energy at an elongation.
struct Spring {
  std::function<double(double)> tension, slope, energy;
};
Spring linear(double k) {
  return {[=](double e) { return k * e; }, [=](double) { return k; }, [=](double e) { return k * e * e / 2; }};
}
Spring saturating(double k, double most) {
  return {[=](double e) { return k * e / (1 + k * std::abs(e) / most); }, [=](double e) { return k / std::pow(1 + k * std::abs(e) / most, 2); },
          [=](double e) { return most * (std::abs(e) - most / k * std::log1p(k * std::abs(e) / most)); }};
}

/// The yardstick: a synthetic experiment on the same springs, computed without the library's tissue and solvers. The total energy is minimised by
/// Newton's method with its exact Hessian, compressed links' softening included, as one dense matrix that is factored; or, for many particles, by
/// conjugate gradients on that Hessian.
class Experiment {
 public:
  Experiment(TriangleMesh<double> const& mesh, Spring link, double home, std::vector<int> const& nailed, double prestrain = 0.0)
      : rest_(mesh.points), link_(std::move(link)), home_(home), fast_(static_cast<std::size_t>(mesh.points.cols()), 0) {
    std::set<std::pair<int, int>> edges;
    for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t)
      for (int c = 0; c < 3; ++c) edges.insert(std::minmax({mesh.triangles(c, t), mesh.triangles((c + 1) % 3, t)}));
    for (auto const& [a, b] : edges) edges_.push_back({a, b, (1 - prestrain) * (rest_.col(a) - rest_.col(b)).norm()});
    for (int const i : nailed) fast_[static_cast<std::size_t>(i)] = 1;
  }

  /// The force along u on particle c at each depth.
  std::vector<double> press(int c, Vector3<double> const& u, std::vector<double> const& depths) {
    Matrix3X<double> x = rest_;
    minimise(x);
    Vector3<double> const from = x.col(c);
    fast_[static_cast<std::size_t>(c)] = 1;
    std::vector<double> forces;
    for (double const depth : depths) {
      x.col(c) = from + depth * u;
      minimise(x);
      forces.push_back(gradient(x).col(c).dot(u));
    }
    fast_[static_cast<std::size_t>(c)] = 0;
    return forces;
  }

 private:
  struct Edge {
    int a, b;
    double length;
  };

  double energy(Matrix3X<double> const& x) const {
    double sum = home_ / 2 * (x - rest_).squaredNorm();
    for (Edge const& e : edges_) sum += link_.energy((x.col(e.a) - x.col(e.b)).norm() - e.length);
    return sum;
  }
  Matrix3X<double> gradient(Matrix3X<double> const& x) const {
    Matrix3X<double> g = home_ * (x - rest_);
    for (Edge const& e : edges_) {
      Vector3<double> const d = x.col(e.a) - x.col(e.b);
      Vector3<double> const pull = link_.tension(d.norm() - e.length) * d.normalized();
      g.col(e.a) += pull, g.col(e.b) -= pull;
    }
    return g;
  }
  Matrix<double, 3, 3> block(Edge const& e, Matrix3X<double> const& x) const {
    Vector3<double> const d = x.col(e.a) - x.col(e.b), n = d.normalized();
    double const length = d.norm(), across = link_.tension(length - e.length) / length;
    return across * Matrix<double, 3, 3>::Identity() + (link_.slope(length - e.length) - across) * n * n.transpose();
  }
  void keep(Matrix3X<double>& columns) const {
    for (std::size_t i = 0; i < fast_.size(); ++i)
      if (fast_[i] != 0) columns.col(static_cast<Eigen::Index>(i)).setZero();
  }

  Matrix3X<double> step(Matrix3X<double> const& x, Matrix3X<double> const& g, double shift) const {
    Eigen::Index const n = x.cols();
    if (n <= 100) {
      Eigen::MatrixXd hessian = (home_ + shift) * Eigen::MatrixXd::Identity(3 * n, 3 * n);
      for (Edge const& e : edges_) {
        Matrix<double, 3, 3> const b = block(e, x);
        hessian.block<3, 3>(3 * e.a, 3 * e.a) += b, hessian.block<3, 3>(3 * e.b, 3 * e.b) += b;
        hessian.block<3, 3>(3 * e.a, 3 * e.b) -= b, hessian.block<3, 3>(3 * e.b, 3 * e.a) -= b;
      }
      for (Eigen::Index i = 0; i < n; ++i)
        if (fast_[static_cast<std::size_t>(i)] != 0) {
          hessian.middleRows<3>(3 * i).setZero(), hessian.middleCols<3>(3 * i).setZero();
          hessian.block<3, 3>(3 * i, 3 * i).setIdentity();
        }
      Eigen::VectorXd const p = hessian.ldlt().solve(-Eigen::Map<Eigen::VectorXd const>(g.data(), 3 * n));
      return Eigen::Map<Matrix3X<double> const>(p.data(), 3, n);
    }
    std::vector<Matrix<double, 3, 3>> blocks;
    for (Edge const& e : edges_) blocks.push_back(block(e, x));
    Matrix3X<double> p = Matrix3X<double>::Zero(3, n), r = -g, d = r, hd(3, n);
    double rr = r.squaredNorm(), const_end = 1e-20 * rr;
    for (int k = 0; k < 3000 && rr > const_end; ++k) {
      hd = (home_ + shift) * d;
      for (std::size_t e = 0; e < edges_.size(); ++e) {
        Vector3<double> const pull = blocks[e] * (d.col(edges_[e].a) - d.col(edges_[e].b));
        hd.col(edges_[e].a) += pull, hd.col(edges_[e].b) -= pull;
      }
      keep(hd);
      double const curvature = d.cwiseProduct(hd).sum();
      if (!(curvature > 0)) return k > 0 ? p : r;
      p += rr / curvature * d, r -= rr / curvature * hd;
      double const last = rr;
      rr = r.squaredNorm();
      d = r + rr / last * d;
    }
    return p;
  }

  void minimise(Matrix3X<double>& x) const {
    double shift = 0.0;
    for (int k = 0; k < 200; ++k) {
      Matrix3X<double> g = gradient(x);
      keep(g);
      if (g.cwiseAbs().maxCoeff() < 1e-12 * std::max(1e-3, home_ + link_.slope(0.0))) return;
      Matrix3X<double> const p = step(x, g, shift);
      double length = 1.0;
      bool better = false;
      for (int half = 0; half < 30 && !better; ++half, length /= 2) {
        Matrix3X<double> const trial = x + length * p;
        Matrix3X<double> there = gradient(trial);
        keep(there);
        better = energy(trial) < energy(x) || there.squaredNorm() < g.squaredNorm();
        if (better) x = trial;
      }
      if (!better && shift > 1e6) return;
      shift = better ? shift / 10 : std::max(1e-3, 10 * shift);
    }
    FAIL("the yardstick does not converge");
  }

  Matrix3X<double> rest_;
  Spring link_;
  double home_;
  std::vector<Edge> edges_;
  std::vector<char> fast_;
};

std::vector<double> depths_to(double deepest, int count) {
  std::vector<double> depths;
  for (int k = 1; k <= count; ++k) depths.push_back(deepest * k / count);
  return depths;
}
/// Each depth so many times, with noise of a signal-to-noise ratio in dB; none where it is infinite.
Curve curve(std::vector<double> const& depths, std::vector<double> const& forces, int times = 1,
            double decibel = std::numeric_limits<double>::infinity(), std::uint64_t seed = 0) {
  Random random(Seed{seed});
  Curve points;
  for (int n = 0; n < times; ++n)
    for (std::size_t k = 0; k < depths.size(); ++k) {
      double const sigma = forces[k] * std::pow(10.0, -decibel / 20);
      points.push_back({.depth = depths[k], .force = std::max(0.0, forces[k] + (sigma > 0 ? sigma * random.normal() : 0.0)), .deviation = forces[k]});
    }
  return points;
}

double off(double found, double truth) { return std::abs(found / truth - 1); }

}  // namespace

// Yardstick: springs in parallel by hand. F = k d, of a particle on its home spring between nailed neighbours, with the straight links' part
// Σ k (1 − L/√(L² + d²)) d where they are pressed across.
TEMPLATE_TEST_CASE("a particle between nailed neighbours gives home and link stiffness of the closed form", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  double const spacing = 0.01, home = 12.0, link = 80.0;
  auto const mesh = make_grid<S>(3, 3, S(spacing));   // the middle has 6 links: 4 of one spacing, 2 diagonals
  Curve points;
  for (double const d : depths_to(0.015, 10)) {
    double const straight = 1 - spacing / std::hypot(spacing, d), diagonal = 1 - std::sqrt(2.0) * spacing / std::hypot(std::sqrt(2.0) * spacing, d);
    points.push_back({.depth = d, .force = d * (home + link * (4 * straight + 2 * diagonal))});
  }
  IndentationTest<S> const test{.particle = 4, .nailed = {0, 1, 2, 3, 5, 6, 7, 8}};
  MassSpringOptions<S, LinearSpring<S>> const guess{.link = {.stiffness = S(0.8)}, .home = {.stiffness = 1200}};
  auto const fit = fit_stiffness(mesh, guess, test, points);
  INFO(static_cast<StiffnessFit const&>(fit));
  double const tolerance = std::is_same_v<S, float> ? 1e-3 : 1e-7;
  CHECK(fit.converged);
  CHECK(fit.determined);
  CHECK(fit.stable);
  CHECK(off(fit["link.stiffness"].value, link) < tolerance);
  CHECK(off(fit["home.stiffness"].value, home) < tolerance);
  CHECK(fit.options.link.stiffness == S(fit.coefficients[0].value));
  CHECK(fit.options.home.stiffness == S(fit.coefficients[1].value));
  CHECK(fit.freedom == 8);
  CHECK(fit.r_squared > 1 - 1e-7);
}

// Yardstick: the coefficients of the experiment above, with its exact Hessian in one dense matrix; under noise of 30 dB, 50 samples
// at each depth, in ten seeds.
TEST_CASE("a flat sheet: link and home stiffness within 1 % without noise and within 5 % at 30 dB") {
  auto const mesh = make_grid<double>(9, 9, 0.01);
  auto const rim = boundary_vertices(mesh);
  double const link = 50.0, home = 8.0;
  auto const depths = depths_to(0.02, 12);
  auto const forces = Experiment(mesh, linear(link), home, rim).press(40, {0, 0, -1}, depths);
  Options const guess{.link = {.stiffness = 10.0}, .home = {.stiffness = 40.0}};
  Test const test{.point = Vector3<double>(0.041, 0.038, 0.01), .nailed = rim};

  auto const clean = fit_stiffness(mesh, guess, test, curve(depths, forces));
  INFO(static_cast<StiffnessFit const&>(clean));
  CHECK(clean.converged);
  CHECK(clean.stable);
  CHECK(off(clean["link.stiffness"].value, link) < 1e-6);
  CHECK(off(clean["home.stiffness"].value, home) < 1e-6);
  CHECK(clean.iterations <= 12);
  CHECK(clean.static_solutions <= 12 * 12);
  MassSpringOptions<float, LinearSpring<float>> const coarse{.link = {.stiffness = 10.0F}, .home = {.stiffness = 40.0F}};
  IndentationTest<float> const by_index{.particle = 40, .nailed = rim};
  auto const narrow = fit_stiffness(make_grid<float>(9, 9, 0.01F), coarse, by_index, curve(depths, forces));
  CHECK(narrow.determined);
  CHECK(off(narrow["link.stiffness"].value, link) < 0.01);
  CHECK(off(narrow["home.stiffness"].value, home) < 0.01);
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    auto const noisy = fit_stiffness(mesh, guess, test, curve(depths, forces, 50, 30.0, seed));
    INFO(static_cast<StiffnessFit const&>(noisy));
    CAPTURE(seed);
    CHECK(noisy.determined);
    CHECK(off(noisy["link.stiffness"].value, link) < 0.05);
    CHECK(off(noisy["home.stiffness"].value, home) < 0.05);
  }
}

// Yardstick: the same, for 252 and 300 particles by conjugate gradients on the exact Hessian; 100 samples at each depth, 1 s of a servo's.
TEST_CASE("a sphere and an organ pressed askew: within 1 % without noise and within 5 % at 30 dB") {
  struct Scene {
    std::string name;
    TriangleMesh<double> mesh;
  };
  for (Scene const& scene : {Scene{"sphere", make_sphere<double>(0.05, 5)}, Scene{"organ", make_organ<double>({.vertices = 300})}}) {
    CAPTURE(scene.name);
    std::vector<int> low;
    int top = 0;
    for (int i = 0; i < scene.mesh.points.cols(); ++i) {
      if (scene.mesh.points(2, i) < 0.6 * scene.mesh.points.row(2).minCoeff()) low.push_back(i);
      if (scene.mesh.points(2, i) > scene.mesh.points(2, top)) top = i;
    }
    double const link = 60.0, home = 20.0;
    Vector3<double> const u = Vector3<double>(0.1, -0.2, -1.0).normalized();
    auto const depths = depths_to(0.025, 10);
    auto const forces = Experiment(scene.mesh, linear(link), home, low).press(top, u, depths);
    Options const guess{.link = {.stiffness = 20.0}, .home = {.stiffness = 60.0}};
    Test const test{.particle = top, .direction = 3.0 * u, .nailed = low};
    auto const clean = fit_stiffness(scene.mesh, guess, test, curve(depths, forces));
    INFO(static_cast<StiffnessFit const&>(clean));
    CHECK(clean.converged);
    CHECK(clean.stable);
    CHECK(off(clean["link.stiffness"].value, link) < 1e-6);
    CHECK(off(clean["home.stiffness"].value, home) < 1e-6);
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      auto const noisy = fit_stiffness(scene.mesh, guess, test, curve(depths, forces, 100, 30.0, seed));
      INFO(static_cast<StiffnessFit const&>(noisy));
      CHECK(noisy.determined);
      CHECK(off(noisy["link.stiffness"].value, link) < 0.05);
      CHECK(off(noisy["home.stiffness"].value, home) < 0.05);
    }
    // A body of these options, held by hand, gives the curve back.
    MassSpring<double> tissue(scene.mesh, clean.options);
    tissue.nail(low);
    SoftBody body(tissue, LeapfrogVerlet{});
    body.drag(top, Vector3<double>(scene.mesh.points.col(top) + depths.back() * u));
    body.solve_statics();
    CHECK(body.reaction(top).dot(u) == Approx(forces.back()).epsilon(1e-5));
  }
}

// Yardstick: the experiment above, settled under the pre-tension first. The body shrinks and takes the touched particle along, as far as the
// ratio of the coefficients says.
TEST_CASE("pre-tension: depth counts from where the body rests with the coefficients in question") {
  auto const mesh = make_sphere<double>(0.04, 2);
  int const top = 0;
  Vector3<double> const u = -mesh.points.col(top).normalized();
  auto const depths = depths_to(0.012, 6);
  auto const forces = Experiment(mesh, linear(30.0), 25.0, {}, 0.2).press(top, u, depths);
  Options const guess{.link = {.stiffness = 60.0}, .home = {.stiffness = 10.0}, .link_prestrain = 0.2};
  auto const fit = fit_stiffness(mesh, guess, Test{.particle = top}, curve(depths, forces));
  INFO(static_cast<StiffnessFit const&>(fit));
  CHECK(fit.converged);
  CHECK(fit.iterations < 15);
  CHECK(off(fit["link.stiffness"].value, 30.0) < 1e-5);
  CHECK(off(fit["home.stiffness"].value, 25.0) < 1e-5);
  CHECK(fit.options.link_prestrain == 0.2);
}

// Yardstick: the experiment with the law's formulas written out above.
TEST_CASE("a law with more coefficients: the largest tension of a spring that gives way") {
  using Law = SaturatingSpring<double>;
  auto const mesh = make_grid<double>(7, 7, 0.01);
  auto const rim = boundary_vertices(mesh);
  auto const depths = depths_to(0.03, 10);
  auto const forces = Experiment(mesh, saturating(90.0, 0.4), 5.0, rim).press(24, {0, 0, 1}, depths);
  MassSpringOptions<double, Law> const guess{.link = {.stiffness = 30.0, .largest_tension = 2.0}, .home = {.stiffness = 15.0}};
  TissueCoefficients<double, Law> const all{.link = {{"stiffness", "N/m", &Law::stiffness}, {"largest_tension", "N", &Law::largest_tension}}};
  Test const test{.particle = 24, .direction = {0, 0, 1}, .nailed = rim};
  auto const fit = fit_stiffness(mesh, guess, test, curve(depths, forces), all);
  INFO(static_cast<StiffnessFit const&>(fit));
  CHECK(off(fit["link.stiffness"].value, 90.0) < 1e-5);
  CHECK(off(fit["link.largest_tension"].value, 0.4) < 1e-5);
  CHECK(off(fit["home.stiffness"].value, 5.0) < 1e-5);
  auto known = guess;
  known.link.stiffness = 90.0;
  auto const one = fit_stiffness(mesh, known, test, curve(depths, forces),
                                 TissueCoefficients<double, Law>{.link = {{"largest_tension", "N", &Law::largest_tension}}},
                                 StiffnessFitOptions<NewtonRaphson<>>{});
  CHECK(one.coefficients.size() == 2);
  CHECK(off(one["link.largest_tension"].value, 0.4) < 1e-5);
}

// Yardstick: springs in parallel by hand: a particle on its home spring, a support spring towards the centre, and four nailed links in a plane,
// of two stiffnesses, pressed across by d.
TEST_CASE("tissue of one's own: a support spring, and two kinds of links") {
  TriangleMesh<double> mesh;
  double const a = 0.02;
  mesh.points = (Matrix3X<double>(3, 5) << 0, a, 0, -a, 0, 0, 0, a, 0, -a, 0, 0, 0, 0, 0).finished();
  mesh.triangles = (Matrix<int, 3, Dynamic>(3, 4) << 0, 0, 0, 0, 1, 2, 3, 4, 2, 3, 4, 1).finished();
  Vector3<double> const centre(0, 0, -0.1);
  auto const build = [&](std::span<double const> k) {
    MassSpring<double> tissue(mesh, {.link = {.stiffness = k[0]}});
    for (int const end : {2, 4}) tissue.set_link(tissue.links().find(0, end), {.stiffness = k[1]});
    return Supported(tissue, LinearSpring<double>{.stiffness = k[2]}, centre);
  };
  double const truth[] = {150.0, 40.0, 10.0};
  // The support is weighed by mass: by hand, the middle of a fan lumped by area has 1/3 of it, the others 1/6, so 5/3 of the mean.
  Curve points;
  for (double const d : depths_to(0.02, 8))
    points.push_back({.depth = d, .force = 2 * (truth[0] + truth[1]) * d * (1 - a / std::hypot(a, d)) + 5.0 / 3 * truth[2] * d});
  auto const sum = fit_stiffness(build, {{"one", "N/m", 60.0}, {"other", "N/m", 60.0}, {"support", "N/m", 60.0}},
                                 Test{.particle = 0, .nailed = {1, 2, 3, 4}}, points);
  INFO(sum);
  CHECK_FALSE(sum.determined);   // they act alike
  CHECK(sum["one"].high > 1e6);
  CHECK(sum["one"].value + sum["other"].value == Approx(truth[0] + truth[1]).epsilon(1e-5));
  auto const half = [&](std::span<double const> k) { return build(std::vector<double>{k[0], truth[1], k[1]}); };
  auto const fit = fit_stiffness(half, {{"one", "N/m", 60.0}, {"support", "N/m", 60.0}}, Test{.particle = 0, .nailed = {1, 2, 3, 4}}, points);
  INFO(fit);
  CHECK(fit.determined);
  CHECK(off(fit["one"].value, truth[0]) < 1e-6);
  CHECK(off(fit["support"].value, truth[2]) < 1e-6);
}

// Yardstick: by hand, the corner of a block held by its home spring and nailed neighbours; F = k d where they are all but slack.
TEST_CASE("a volume, and a home stiffness alone") {
  auto const mesh = make_block<double>(2, 2, 2, 0.01);
  std::vector<int> others;
  for (int i = 1; i < mesh.points.cols(); ++i) others.push_back(i);
  Curve points;
  for (double const d : depths_to(0.01, 5)) points.push_back({.depth = d, .force = 33.0 * d});
  MassSpringOptions<double, LinearSpring<double>> const guess{.link = {.stiffness = 1e-9}, .home = {.stiffness = 1.0}};
  auto const fit = fit_stiffness(mesh, guess, Test{.particle = 0, .nailed = others}, points, Found{.link = {}});
  CHECK(fit.coefficients.size() == 1);
  CHECK(off(fit["home.stiffness"].value, 33.0) < 1e-8);
}

// Yardstick: the share of intervals that hold the truth: 95 %, of 200 seeds between 90 and 99 % (3.2 standard deviations).
TEST_CASE("intervals hold the truth about 95 times in 100") {
  double const spacing = 0.01, home = 12.0, link = 80.0;
  auto const mesh = make_grid<double>(3, 3, spacing);
  auto const depths = depths_to(0.015, 10);
  std::vector<double> forces;
  for (double const d : depths) {
    double const straight = 1 - spacing / std::hypot(spacing, d), diagonal = 1 - std::sqrt(2.0) * spacing / std::hypot(std::sqrt(2.0) * spacing, d);
    forces.push_back(d * (home + link * (4 * straight + 2 * diagonal)));
  }
  int held[2] = {0, 0};
  int const seeds = 200;
  for (std::uint64_t seed = 0; seed < seeds; ++seed) {
    auto const fit = fit_stiffness(mesh, Options{.link = {.stiffness = 70.0}, .home = {.stiffness = 10.0}},
                                   Test{.particle = 4, .nailed = {0, 1, 2, 3, 5, 6, 7, 8}}, curve(depths, forces, 2, 30.0, seed));
    for (std::size_t k = 0; k < 2; ++k) {
      double const truth = k == 0 ? link : home;
      if (fit.coefficients[k].low <= truth && truth <= fit.coefficients[k].high) ++held[k];
    }
  }
  for (int const count : held) {
    CAPTURE(count);
    CHECK(count >= 0.90 * seeds);
    CHECK(count <= 0.99 * seeds);
  }
}

// Yardstick: the closed form of the first case, at 900 depths of a ramp instead of ten.
TEST_CASE("a curve sampled at every depth is computed at forty") {
  double const spacing = 0.01, home = 12.0, link = 80.0;
  auto const mesh = make_grid<double>(3, 3, spacing);
  Curve points;
  for (double const d : depths_to(0.015, 900)) {
    double const straight = 1 - spacing / std::hypot(spacing, d), diagonal = 1 - std::sqrt(2.0) * spacing / std::hypot(std::sqrt(2.0) * spacing, d);
    points.push_back({.depth = d, .force = d * (home + link * (4 * straight + 2 * diagonal))});
  }
  auto const fit = fit_stiffness(mesh, Options{.link = {.stiffness = 10.0}, .home = {.stiffness = 100.0}},
                                 Test{.particle = 4, .nailed = {0, 1, 2, 3, 5, 6, 7, 8}}, points);
  INFO(static_cast<StiffnessFit const&>(fit));
  CHECK(fit.residuals.size() == 900);
  CHECK(off(fit["link.stiffness"].value, link) < 1e-4);
  CHECK(off(fit["home.stiffness"].value, home) < 1e-4);
}

// Yardstick: by hand, the links of a flat sheet act in the third order of the depth: at a hundredth of an edge they give 1e-4 of the force.
TEST_CASE("a flat sheet pressed little says nothing of its links") {
  auto const mesh = make_grid<double>(3, 3, 0.01);
  std::vector<double> forces;
  auto const depths = depths_to(1e-4, 10);
  for (double const d : depths) forces.push_back(12.0 * d);
  auto const fit = fit_stiffness(mesh, Options{.link = {.stiffness = 10.0}, .home = {.stiffness = 100.0}},
                                 Test{.particle = 4, .nailed = {0, 1, 2, 3, 5, 6, 7, 8}}, curve(depths, forces, 20, 30.0, 3));
  INFO(static_cast<StiffnessFit const&>(fit));
  CHECK_FALSE(fit.determined);
  CHECK_FALSE(fit["link.stiffness"].determined);
  CHECK(fit["home.stiffness"].determined);
  CHECK(off(fit["home.stiffness"].value, 12.0) < 0.02);
  std::ostringstream text;
  text << std::fixed << fit;
  CHECK(text.str().find("link.stiffness") != std::string::npos);
  CHECK(text.str().find("N/m   not determined\n") != std::string::npos);
  CHECK(text.str().find("(95 % confidence)") != std::string::npos);
  CHECK(text.str().find("These measurements do not determine every coefficient: press deeper") != std::string::npos);
  CHECK_THROWS_WITH(fit["home"], says("no coefficient home", "link.stiffness"));
}

// Yardstick: the closed form with links alone, with and without noise.
TEST_CASE("a home stiffness that the data do not ask for comes out near nothing, and not determined") {
  double const spacing = 0.01, link = 80.0;
  auto const depths = depths_to(0.015, 10);
  std::vector<double> forces;
  for (double const d : depths) {
    double const straight = 1 - spacing / std::hypot(spacing, d), diagonal = 1 - std::sqrt(2.0) * spacing / std::hypot(std::sqrt(2.0) * spacing, d);
    forces.push_back(d * link * (4 * straight + 2 * diagonal));
  }
  for (double const decibel : {std::numeric_limits<double>::infinity(), 30.0}) {
    auto const fit = fit_stiffness(make_grid<double>(3, 3, spacing), Options{.link = {.stiffness = 10.0}, .home = {.stiffness = 10.0}},
                                   Test{.particle = 4, .nailed = {0, 1, 2, 3, 5, 6, 7, 8}}, curve(depths, forces, 10, decibel, 1));
    INFO(static_cast<StiffnessFit const&>(fit));
    CAPTURE(decibel);
    CHECK(fit.converged);
    CHECK(fit["link.stiffness"].determined);
    CHECK(off(fit["link.stiffness"].value, link) < (decibel > 30.0 ? 1e-5 : 0.05));
    CHECK_FALSE(fit["home.stiffness"].determined);
    CHECK(fit["home.stiffness"].value < 0.02 * link);
  }
}

// Yardstick: Euler's buckling, by hand: links under pressure with next to no home springs fall out of their line, and the flat strip is a saddle.
TEST_CASE("a body that would buckle is called unstable") {
  auto const mesh = make_grid<double>(5, 3, 0.01);
  Test const test{.particle = 9, .direction = {-1, 0, 0}, .nailed = {0, 5, 10}};
  auto const at = [&](double home) {
    Options const options{.link = {.stiffness = 100.0}, .home = {.stiffness = home}};
    auto const depths = depths_to(0.005, 4);
    auto const forces = Experiment(mesh, linear(100.0), 1e3, test.nailed).press(9, test.direction, depths);
    return fit_stiffness(mesh, options, test, curve(depths, forces), Found{.home_stiffness = false});
  };
  CHECK(at(1e3).stable);
  auto const flat = at(1e-3);
  CHECK_FALSE(flat.stable);
  std::ostringstream text;
  text << flat;
  CHECK(text.str().find("The body does not rest stably at some depth") != std::string::npos);
}

TEST_CASE("what makes no test is refused with the reason") {
  auto const mesh = make_grid<double>(3, 3, 0.01);
  Options const guess{.link = {.stiffness = 10.0}, .home = {.stiffness = 10.0}};
  Test const test{.particle = 4, .nailed = {0, 1, 2, 3, 5, 6, 7, 8}};
  Curve const good{{.depth = 0.01, .force = 1.0}, {.depth = 0.02, .force = 2.0}, {.depth = 0.03, .force = 4.0}};
  auto const with = [&](auto const& change) {
    Curve bad = good;
    change(bad);
    return fit_stiffness(mesh, guess, test, bad);
  };
  double const infinite = std::numeric_limits<double>::infinity();
  CHECK_NOTHROW(fit_stiffness(mesh, guess, test, good));
  CHECK_THROWS_WITH(with([](Curve& c) { c.pop_back(); }), says("2 measurements at 2 depths", "more measurements than coefficients"));
  CHECK_THROWS_AS(with([](Curve& c) { c[0].depth = c[1].depth = 0.03; }), InvalidArgument);
  CHECK_THROWS_WITH(with([](Curve& c) { c[1].depth = 0.0; }), says("measurement 1", "0 m", "depths above 0"));
  CHECK_THROWS_AS(with([&](Curve& c) { c[1].depth = infinite; }), InvalidArgument);
  CHECK_THROWS_WITH(with([](Curve& c) { c[2].force = -1.0; }), says("measurement 2", "-1 N", "0 or more"));
  CHECK_THROWS_AS(with([](Curve& c) { c[2].force = std::nan(""); }), InvalidArgument);
  CHECK_THROWS_WITH(with([](Curve& c) { c[0].deviation = 0.0; }), says("measurement 0", "deviation of 0", "above 0"));
  CHECK_THROWS_WITH(with([](Curve& c) { c[0].force = c[1].force = c[2].force = 0.0; }), says("0 N", "with contact"));
  CHECK_THROWS_WITH(fit_stiffness(mesh, guess, Test{.particle = 3, .nailed = {3}}, good), says("particle 3", "another one"));
  CHECK_THROWS_WITH(fit_stiffness(mesh, guess, Test{}, good), says("not given", ".particle", ".point"));
  CHECK_THROWS_AS(fit_stiffness(mesh, guess, Test{.particle = 9}, good), OutOfRange);
  CHECK_THROWS_AS(fit_stiffness(mesh, guess, Test{.particle = 4, .nailed = {9}}, good), OutOfRange);
  CHECK_THROWS_AS(fit_stiffness(mesh, guess, Test{.particle = 4, .direction = {0, infinite, 0}}, good), InvalidArgument);
  CHECK_THROWS_WITH(fit_stiffness(mesh, Options{.link = {.stiffness = 10.0}}, test, good), says("home.stiffness", "0 N/m", "above 0"));
  CHECK_THROWS_AS(fit_stiffness(mesh, guess, test, good, Found{.link = {}, .home_stiffness = false}), InvalidArgument);
  CHECK_THROWS_AS(fit_stiffness(mesh, guess, test, good, Found{.link = {{"none", "N/m", nullptr}}}), InvalidArgument);
  CHECK_THROWS_AS(fit_stiffness(mesh, guess, test, good, {}, StiffnessFitOptions<>{.confidence = 1.0}), InvalidArgument);
  CHECK_THROWS_AS(fit_stiffness(mesh, guess, test, good, {}, StiffnessFitOptions<>{.max_depths = 1}), InvalidArgument);
  try {
    fit_stiffness(mesh, guess, Test{.particle = 4, .nailed = {0, 8}}, good, {}, StiffnessFitOptions<>{.solver = {.iterations = 1}});
    FAIL("a solver that may take one step finds no rest");
  } catch (Error const& error) {
    CHECK(std::string(error.what()).find("fit_stiffness: pressed 0.01 m deep the body comes to no rest; the largest imbalance is ") == 0);
  }
}
