// SPDX-License-Identifier: MIT
// Damping ratios asked for and shown. Yardsticks: the eigenvalues of the damped body as a first-order system, from dense matrices found by
// differences of a plain loop's forces, and the closed forms of one damped particle.
#include <palpate/body/damping.hpp>
#include <palpate/body/modal_view.hpp>
#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/runge_kutta_4.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/tissue/finite_elements.hpp>

#include "body/naive_twin.hpp"
#include "catch.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

using namespace palpate;
using palpate_test::GridScene;
using palpate_test::NaiveBody;
using palpate_test::Points;

namespace {

/// A grid of 20 particles; with `uneven`, of unequal masses and home springs.
struct Scene {
  GridScene grid{.nx = 5, .ny = 4};
  bool uneven = false;

  double mass(int i) const { return grid.mass / 20 * (uneven ? 0.6 + 0.04 * ((7 * i) % 20) : 1.0); }
  double home(int i) const { return grid.home * (uneven ? 0.5 + 0.05 * ((3 * i) % 20) : 1.0); }
  template <class S = double>
  MassSpring<S> tissue() const {
    auto tissue = grid.tissue<S>();
    for (int i = 0; i < tissue.size(); ++i) {
      tissue.set_mass(i, S(mass(i)));
      tissue.set_home(i, {.stiffness = S(home(i)), .damping = S(grid.home_damping)});
    }
    return tissue;
  }
};

/// M⁻¹K and M⁻¹C of a tissue's twin with its coefficients, free particles only.
struct Dense {
  Eigen::MatrixXd stiffness, damping;

  template <class Tissue>
  explicit Dense(Tissue const& tissue) {
    Points rest(3, tissue.size());
    for (int i = 0; i < tissue.size(); ++i) rest.col(i) = tissue.rest_position(i).template cast<double>();
    NaiveBody body(rest);
    std::vector<int> free;
    for (int i = 0; i < tissue.size(); ++i) {
      auto const u = static_cast<std::size_t>(i);
      body.mass[u] = tissue.mass(i);
      body.home_stiffness[u] = tissue.home(i).stiffness;
      body.home_damping[u] = tissue.home(i).damping;
      if (!tissue.nailed(i)) free.push_back(i);
    }
    for (int l = 0; l < tissue.links().size(); ++l)
      body.join(tissue.links()[l].a, tissue.links()[l].b, tissue.links()[l].law.stiffness * tissue.links()[l].weight,
                tissue.links()[l].law.damping * tissue.links()[l].weight);
    auto const n = static_cast<Eigen::Index>(3 * free.size());
    stiffness.resize(n, n), damping.resize(n, n);
    Points const still = Points::Zero(3, tissue.size());
    for (Eigen::Index c = 0; c < n; ++c) {
      Points d = still;
      d(c % 3, free[static_cast<std::size_t>(c / 3)]) = 1e-7;
      Points const ka = (body.accelerations(rest - d, still) - body.accelerations(rest + d, still)) / 2e-7;
      Points const ca = -body.accelerations(rest, d) / 1e-7;
      for (Eigen::Index r = 0; r < n; ++r) {
        stiffness(r, c) = ka(r % 3, free[static_cast<std::size_t>(r / 3)]);
        damping(r, c) = ca(r % 3, free[static_cast<std::size_t>(r / 3)]);
      }
    }
  }

  /// Least and largest −Re λ/|λ| of the damped body: 1 where it creeps, below 1 where it oscillates.
  std::array<double, 2> shown_ratios() const {
    Eigen::Index const n = stiffness.rows();
    Eigen::MatrixXd system = Eigen::MatrixXd::Zero(2 * n, 2 * n);
    system.topRightCorner(n, n).setIdentity();
    system.bottomLeftCorner(n, n) = -stiffness;
    system.bottomRightCorner(n, n) = -damping;
    Eigen::VectorXcd const values = system.eigenvalues();
    std::array<double, 2> ratios{1.0, 0.0};
    for (auto const& value : values) {
      double const ratio = -value.real() / std::abs(value);
      ratios[0] = std::min(ratios[0], ratio);
      ratios[1] = std::max(ratios[1], ratio);
    }
    return ratios;
  }
};

}  // namespace

TEST_CASE("damping proposed for at most a ratio is at most that for every mode, and not less than it says") {
  for (bool const uneven : {false, true})
    for (double const ratio : {0.0, 0.05, 0.3, 0.8}) {
      Scene scene{.uneven = uneven};
      if (uneven) scene.grid.nails = {0, 7};
      auto tissue = scene.tissue();
      auto const proposal = damping_for(tissue, ratio);
      set_damping(tissue, proposal);
      auto const [least, most] = Dense(tissue).shown_ratios();
      CAPTURE(uneven, ratio, proposal.min_ratio, least, most);
      CHECK(proposal.max_ratio == ratio);
      CHECK(most <= ratio + 1e-6);
      CHECK(least >= proposal.min_ratio - 1e-6);
      CHECK(most >= 0.95 * ratio);
      CHECK(proposal.min_ratio > 0.3 * ratio - 1e-12);
    }
}

TEST_CASE("damping proposed for at least a ratio is at least that for every mode, without home springs too") {
  for (double const home : {5.0, 0.0})
    for (double const ratio : {0.05, 0.3, 0.7, 1.0}) {
      Scene scene{.uneven = true};
      scene.grid.home = home;
      scene.grid.nails = {0, 4, 15, 19};
      auto tissue = scene.tissue();
      auto const proposal = damping_for(tissue, ratio, DampingGoal::at_least);
      set_damping(tissue, proposal);
      Dense const dense(tissue);
      auto const [least, most] = dense.shown_ratios();
      CAPTURE(home, ratio, proposal.max_ratio, least, most);
      CHECK(proposal.min_ratio == ratio);
      CHECK(least >= ratio - (home == 0 ? 1e-3 : 1e-6));   // flat without homes: modes without stiffness, a double root at 0
      if (proposal.max_ratio < 1) CHECK(most <= proposal.max_ratio + 1e-6);
    }
}

TEST_CASE("a particle alone on its home spring has exactly the ratio asked for") {
  // All but one nailed and no links to speak of: m x'' + c x' + k x = 0, the closed form of the impulse response.
  GridScene scene{.nx = 3, .ny = 3, .link = 1e-12, .link_damping = 0.0, .home = 0.16, .home_damping = 0.0};
  scene.mass = 9 * 0.01;   // ω = 4
  for (int i = 0; i < 9; ++i)
    if (i != 4) scene.nails.push_back(i);
  for (double const ratio : {0.1, 0.5, 1.0, 2.0}) {
    auto tissue = scene.tissue();
    set_damping(tissue, damping_for(tissue, ratio));
    CHECK(tissue.home(4).damping == Approx(2 * ratio * 4.0 * 0.01).epsilon(1e-12));
    SoftBody body(tissue, RungeKutta4{}, WholeBody{});
    auto const view = modal_view(body);
    CHECK(view.slowest.frequency == Approx(4.0).epsilon(1e-6));
    CHECK(view.slowest.damping_ratio == Approx(ratio).epsilon(1e-6));
    double const h = 1e-3, force = 1.0;
    body.apply_force(4, {0.0, 0.0, force});   // an impulse of F h, as good as at once: the middle of the first step
    for (int k = 0; k < 700; ++k) body.step(h);
    double const t = 700 * h - h / 2, speed = force * h / 0.01, root = 4 * std::sqrt(std::abs(ratio * ratio - 1)), decay = std::exp(-4 * ratio * t);
    double const exact = ratio == 1 ? speed * t * decay : speed / root * decay * (ratio > 1 ? std::sinh(root * t) : std::sin(root * t));
    CHECK(body.displacement(4).z() == Approx(exact).margin(1e-5 * speed));
  }
}

TEST_CASE("what damping costs leapfrog's stable step is what the manual says") {
  double const undamped = SoftBody(GridScene{.link_damping = 0.0, .home_damping = 0.0}.tissue(), LeapfrogVerlet{}, WholeBody{}).stable_step();
  for (double const ratio : {0.1, 0.5, 1.0})
    for (auto const goal : {DampingGoal::at_most, DampingGoal::at_least}) {
      auto tissue = GridScene{}.tissue();
      auto const proposal = damping_for(tissue, ratio, goal);
      set_damping(tissue, proposal);
      double const most = proposal.max_ratio;
      double const factor = undamped / SoftBody(tissue, LeapfrogVerlet{}, WholeBody{}).stable_step();
      CAPTURE(ratio, most);
      CHECK(factor < 1.03 * (std::sqrt(1 + 4 * most * most) + 2 * most));   // γ is raised by 5 % like κ
      CHECK(factor > 0.85 * (std::sqrt(1 + 4 * most * most) + 2 * most));
    }
}

TEST_CASE("a body damped critically at least does not swing") {
  auto tissue = Scene{.uneven = true}.tissue();
  set_damping(tissue, damping_for(tissue, 1.0, DampingGoal::at_least));
  SoftBody body(tissue, LeapfrogVerlet{}, WholeBody{});
  CHECK(modal_view(body).slowest.damping_ratio > 1 - 1e-3);
  body.drag(7, body.reference_position(7) + Vector3<double>(0, 0, 1e-4));
  body.release(7);
  double least = 0;
  while (body.time() < 3) {
    body.advance(0.01);
    least = std::min(least, body.displacement(7).z());
  }
  CHECK(least > -1e-9);
  CHECK(body.displacement(7).norm() < 1e-6);
}

TEMPLATE_TEST_CASE("the modal view shows the fastest and slowest mode and their ratios", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  double const exact = std::same_as<S, float> ? 2e-3 : 1e-5;
  for (bool const uneven : {false, true})
    for (double const ratio : {0.1, 0.7}) {
      Scene scene{.uneven = uneven};
      if (uneven) scene.grid.nails = {3, 11};
      auto tissue = scene.template tissue<S>();
      set_damping(tissue, damping_for(tissue, S(ratio)));
      Dense const dense(tissue);
      Eigen::EigenSolver<Eigen::MatrixXd> const solved(dense.stiffness);
      Eigen::VectorXd const values = solved.eigenvalues().real();
      SoftBody body(tissue, LeapfrogVerlet{}, WholeBody{});
      auto const view = modal_view(body);
      CAPTURE(uneven, ratio);
      CHECK((view.fastest.converged && view.slowest.converged));
      CHECK(view.fastest.frequency == Approx(std::sqrt(values.maxCoeff())).epsilon(exact));
      CHECK(view.slowest.frequency == Approx(std::sqrt(values.minCoeff())).epsilon(exact));
      if (!uneven) {   // equal homes: the slowest modes are all of the home springs alone
        CHECK(view.slowest.damping_ratio == Approx(ratio).epsilon(10 * exact));
        CHECK(view.fastest.damping_ratio == Approx(ratio).epsilon(0.03));   // the fastest frequency was 2.5 % high
      }
    }
}

TEST_CASE("the slowest mode of a larger body, a free body, a nailed one") {
  auto tissue = GridScene{.nx = 16, .ny = 12, .home = 0.3, .nails = palpate_test::grid_border(16, 12)}.tissue();
  Eigen::VectorXd const values = Dense(tissue).stiffness.eigenvalues().real();
  SoftBody body(tissue, LeapfrogVerlet{}, WholeBody{});
  CHECK(modal_view(body).fastest.frequency == Approx(std::sqrt(values.maxCoeff())).epsilon(1e-4));
  CHECK(modal_view(body).slowest.frequency == Approx(std::sqrt(values.minCoeff())).epsilon(1e-3));

  SoftBody free(GridScene{.home = 0.0, .home_damping = 0.0}.tissue(), LeapfrogVerlet{}, WholeBody{});
  CHECK(modal_view(free).slowest.frequency < 1e-3 * modal_view(free).fastest.frequency);
  GridScene all{.nx = 3, .ny = 3};
  for (int i = 0; i < 9; ++i) all.nails.push_back(i);
  SoftBody fixed(all.tissue(), LeapfrogVerlet{}, WholeBody{});
  CHECK(modal_view(fixed).fastest.frequency == 0);
  CHECK(damping_for(fixed.tissue(), 0.5).min_ratio == 0.5);
}

// Yardstick: Euler and Bernoulli's clamped beam, which tetrahedra are stiffer than; a free body, which has no slowest frequency but 0.
TEMPLATE_TEST_CASE("a mode that the iterations or digits do not show is an upper bound, and says so", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const mesh = make_block<S>(61, 2, 2, S(0.005), BlockPattern::alternating);
  FiniteElements<S, StableNeoHookean<S>> beam(mesh, {.density = 1000, .material = {.young = 5000, .poisson = S(0.3)}});
  auto const free = modal_view(SoftBody(beam, BackwardEuler{}));
  CHECK(free.fastest.converged);
  CHECK_FALSE(free.slowest.converged);
  CHECK(free.slowest.frequency > 0);
  CHECK(free.slowest.frequency < S(0.01) * free.fastest.frequency);
  beam.nail(vertices_where(mesh, [](auto const& p) { return p.x() < S(1e-6); }));
  auto const clamped = modal_view(SoftBody(beam, BackwardEuler{}));
  double const closed_form = 1.8751 * 1.8751 * std::sqrt(5000.0 / 1000.0 * 0.005 * 0.005 / 12) / (0.3 * 0.3);   // sqrt(E I/(rho A))/L²
  CHECK(clamped.fastest.converged);
  CHECK_FALSE(clamped.slowest.converged);
  CHECK(clamped.slowest.frequency > closed_form);
  CHECK(std::isfinite(clamped.slowest.damping_ratio));
}

TEST_CASE("a bad ratio and damping of another tissue are refused in a sentence") {
  auto tissue = GridScene{}.tissue();
  CHECK_THROWS_WITH(damping_for(tissue, -0.1), says("ratio is -0.1", "not negative"));
  auto const other = damping_for(GridScene{.nx = 3, .ny = 3}.tissue(), 0.5);
  CHECK_THROWS_WITH(set_damping(tissue, other), says("9 particles and 16 links", "20 and 43"));
}
