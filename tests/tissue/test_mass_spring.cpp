// SPDX-License-Identifier: MIT
// Yardsticks: a plain loop over springs (body/naive_body.hpp), areas and volumes by hand, and the tissue law battery.
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/testing/tissue.hpp>
#include <palpate/tissue/cubic_spring.hpp>
#include <palpate/tissue/locking_spring.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/saturating_spring.hpp>

#include "body/naive_body.hpp"
#include "catch.hpp"

#include <array>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

using namespace palpate;
using palpate_test::naive_grid;
using palpate_test::NaiveBody;

namespace {

struct ToeSpring {
  double stiffness;
  double toe;
  double damping;
  double tension(double elongation, double) const { return stiffness * elongation * (1 + elongation * elongation / (toe * toe)); }
};

/// A grid of 5 × 4 whose every coefficient is another, in the library and in the plain loop.
struct Uneven {
  NaiveBody plain = naive_grid(5, 4, 0.01, 1.0, 1.0, 0.05);
  MassSpring<double> tissue{make_grid<double>(5, 4, 0.01), {.link_prestrain = 0.05}};

  Uneven() {
    Random random(Seed{3});
    for (auto& edge : plain.edges) {
      edge.stiffness = random.uniform(20.0, 80.0);
      edge.damping = random.uniform(0.0, 0.2);
      tissue.set_link(tissue.links().find(edge.a, edge.b), {.stiffness = edge.stiffness, .damping = edge.damping});
    }
    for (int i = 0; i < 20; ++i) {
      auto const u = static_cast<std::size_t>(i);
      plain.mass[u] = random.uniform(1e-3, 3e-3);
      plain.home_stiffness[u] = random.uniform(0.0, 5.0);
      plain.home_damping[u] = random.uniform(0.0, 0.1);
      tissue.set_mass(i, plain.mass[u]);
      tissue.set_home(i, {.stiffness = plain.home_stiffness[u], .damping = plain.home_damping[u]});
    }
    for (Eigen::Index k = 0; k < plain.x.size(); ++k) {
      plain.x.data()[k] += random.uniform(-0.003, 0.003);
      plain.v.data()[k] = random.uniform(-0.1, 0.1);
    }
  }
};

std::string broken(auto const& tissue, testing::TissueChecks const& checks = {}) {
  return testing::to_text(testing::check_tissue(tissue, checks));
}

}  // namespace

TEST_CASE("forces and energy are those of a plain loop over springs that are all different") {
  Uneven body;
  MassSpring<double> const& tissue = body.tissue;
  palpate_test::Points const expected = body.plain.forces(body.plain.x, body.plain.v);
  for (int i = 0; i < 20; ++i) CHECK((tissue.internal_force(i, body.plain.x, body.plain.v) - expected.col(i)).norm() < 1e-14);
  testing::detail::WholeTissue<MassSpring<double>> whole(tissue);
  CHECK((whole.forces(body.plain.x, body.plain.v) - expected).cwiseAbs().maxCoeff() < 1e-14);
  CHECK(tissue.potential_energy(body.plain.x) == Approx(body.plain.energy(body.plain.x)).epsilon(1e-13));
  CHECK(tissue.total_mass() == Approx(std::accumulate(body.plain.mass.begin(), body.plain.mass.end(), 0.0)).epsilon(1e-14));
}

TEST_CASE("a part of the body feels the same forces as the whole, bordered by the rest") {
  Uneven body;
  palpate_test::Points const expected = body.plain.forces(body.plain.x, body.plain.v);
  std::vector<int> const part{7, 3, 12, 0, 13};
  MassSpring<double>::Assembly assembly;
  for (int round = 0; round < 2; ++round) {   // built anew it forgets the part before
    body.tissue.assemble(std::vector<int>{1, 2, 3, 4, 5, 6, 19}, assembly);
    body.tissue.assemble(part, assembly);
  }
  REQUIRE(assembly.moving() == 5);
  auto const particles = assembly.particles();
  Matrix3X<double> x(3, particles.size()), v = x, f = Matrix3X<double>::Zero(3, static_cast<Eigen::Index>(particles.size()));
  for (std::size_t k = 0; k < particles.size(); ++k) {
    x.col(static_cast<Eigen::Index>(k)) = body.plain.x.col(particles[k]);
    v.col(static_cast<Eigen::Index>(k)) = body.plain.v.col(particles[k]);
  }
  assembly.add_forces(x, v, f);
  for (int k = 0; k < 5; ++k) {
    CHECK(particles[static_cast<std::size_t>(k)] == part[static_cast<std::size_t>(k)]);
    CHECK((f.col(k) - expected.col(part[static_cast<std::size_t>(k)])).norm() < 1e-14);
  }
}

TEMPLATE_TEST_CASE("mass-spring tissue obeys the laws of its family", "", float, double) {
  using S = TestType;
  MassSpringOptions<S, LinearSpring<S>> linear{.mass = {.total = S(0.1)}, .link = {.stiffness = S(50), .damping = S(0.1)}};
  MassSpringOptions<S, SaturatingSpring<S>> soft{.mass = {.total = S(0.1)},
                                                 .link = {.stiffness = S(50), .largest_tension = S(0.1), .damping = S(0.1)}};
  auto const grid = make_grid<S>(6, 5, S(0.01));
  auto const ball = make_sphere<S>(S(0.05), 3);
  auto const block = make_block<S>(3, 4, 3, S(0.01));
  CHECK(broken(MassSpring<S>(grid, linear), {.isolated = true}) == "");
  CHECK(broken(MassSpring<S>(ball, linear), {.isolated = true}) == "");
  CHECK(broken(MassSpring<S>(block, linear), {.isolated = true}) == "");
  CHECK(broken(MassSpring<S, SaturatingSpring<S>>(grid, soft), {.isolated = true}) == "");
  CHECK(broken(MassSpring<S, SaturatingSpring<S>>(block, soft), {.isolated = true}) == "");
  // Noise of 0.1 edges carries some of these links past their guard, and all of them along the bend.
  MassSpringOptions<S, LockingSpring<S>> locking{
      .mass = {.total = S(0.1)}, .link = {.stiffness = S(50), .largest_tension = S(0.05), .damping = S(0.1), .guard = S(0.8)}};
  MassSpringOptions<S, CubicSpring<S>> cubic{
      .mass = {.total = S(0.1)}, .link = {.stiffness = S(50), .quadratic = S(2e3), .cubic = S(1e6), .damping = S(0.1)}};
  CHECK(broken(MassSpring<S, LockingSpring<S>>(grid, locking), {.isolated = true}) == "");
  CHECK(broken(MassSpring<S, LockingSpring<S>>(block, locking), {.isolated = true}) == "");
  CHECK(broken(MassSpring<S, CubicSpring<S>>(grid, cubic), {.isolated = true}) == "");
  CHECK(broken(MassSpring<S, CubicSpring<S>>(block, cubic), {.isolated = true}) == "");
  linear.home = {.stiffness = S(5), .damping = S(0.05)};
  soft.home = linear.home;
  CHECK(broken(MassSpring<S>(ball, linear)) == "");
  linear.link_prestrain = soft.link_prestrain = S(0.1);
  CHECK(broken(MassSpring<S>(ball, linear), {.relaxed_at_rest = false}) == "");
  CHECK(broken(MassSpring<S, SaturatingSpring<S>>(grid, soft), {.relaxed_at_rest = false}) == "");
}

TEST_CASE("tissue of a user's law, without stiffness and energy, obeys the laws too") {
  MassSpring<double, ToeSpring> const tissue(make_grid<double>(5, 5, 0.01),
                                             {.link = {.stiffness = 50.0, .toe = 0.002, .damping = 0.05}});
  CHECK(broken(tissue, {.isolated = true}) == "");
}

namespace {

/// Tissue with a fault: what is forwarded, and what is wrong.
struct Faulty : MassSpring<double> {
  using MassSpring::MassSpring;
  template <class X>
  double potential_energy(X const& x) const {
    return 1.1 * MassSpring::potential_energy(x);
  }
  double stiffness_bound(int) const { return 0.0; }
};

}  // namespace

TEST_CASE("the battery catches tissue that breaks the laws") {
  Faulty const tissue(make_grid<double>(5, 5, 0.01), {.link = {.stiffness = 50.0, .damping = 0.05}, .home = {.stiffness = 1.0}});
  std::string const text = broken(tissue, {.isolated = true});
  CHECK_THAT(text, says("force must be -gradient"));
  CHECK_THAT(text, says("stiffness_bound(0) is 0 N/m"));
  CHECK_THAT(text, says("the internal forces have a sum"));   // home springs
  CHECK_THAT(broken(MassSpring<double>(make_grid<double>(5, 5, 0.01), {.link_prestrain = 0.1})),
             says("is not free of force"));
}

TEMPLATE_TEST_CASE("mass is shared equally, or by area, or by volume", "", float, double) {
  using S = TestType;
  auto const grid = make_grid<S>(4, 3, S(0.5));   // 6 squares, 12 triangles
  MassSpring<S> const equal(grid, {.mass = {.total = S(0.6), .lumping = Lumping::equal}});
  for (int i = 0; i < 12; ++i) CHECK(double(equal.mass(i)) == Approx(0.05));

  // By hand: a third of each triangle goes to each corner; 12 triangles weigh 0.6/12 each.
  MassSpring<S> const by_area(grid, {.mass = {.total = S(0.6)}});
  double const third = 0.6 / 12 / 3;
  int const triangles[12] = {2, 3, 3, 1, 3, 6, 6, 3, 1, 3, 3, 2};
  for (int i = 0; i < 12; ++i) CHECK(double(by_area.mass(i)) == Approx(third * triangles[i]));
  CHECK(double(by_area.total_mass()) == Approx(0.6));

  // A cube of six tetrahedra around its diagonal: its two ends are in all six, the other corners in two.
  MassSpring<S> const cube(make_block<S>(2, 2, 2, S(0.1)), {.mass = {.total = S(2.4)}});
  for (int i = 0; i < 8; ++i) CHECK(double(cube.mass(i)) == Approx(i == 0 || i == 7 ? 0.6 : 0.2));
  MassSpring<S> const even(make_block<S>(2, 2, 2, S(0.1)), {.mass = {.total = S(2.4), .lumping = Lumping::equal}});
  for (int i = 0; i < 8; ++i) CHECK(double(even.mass(i)) == Approx(0.3));
}

TEMPLATE_TEST_CASE("one link per edge, shortened by the pre-tension", "", float, double) {
  using S = TestType;
  auto const check = [](auto const& mesh) {
    MassSpring<S> const tissue(mesh, {.link_prestrain = S(0.2)});
    auto const sides = edges(mesh);
    REQUIRE(tissue.links().size() == static_cast<int>(sides.size()));
    for (auto const& [a, b] : sides) {
      int const l = tissue.links().find(a, b);
      REQUIRE(l >= 0);
      CHECK(double(tissue.links()[l].rest_length) == Approx(0.8 * double((mesh.points.col(a) - mesh.points.col(b)).norm())).epsilon(1e-6));
      CHECK(tissue.links()[l].weight == S(1));
    }
  };
  check(make_sphere<S>(S(0.1), 4));
  check(make_block<S>(3, 3, 3, S(0.1)));
}

TEST_CASE("particles in one place feel no link, and nothing becomes NaN") {
  MassSpring<double> const tissue(make_grid<double>(3, 3, 0.1), {.link = {.stiffness = 10.0, .damping = 1.0}, .home = {.stiffness = 1.0}});
  Matrix3X<double> const x = Matrix3X<double>::Constant(3, 9, 0.05), v = Matrix3X<double>::Random(3, 9);
  testing::detail::WholeTissue<MassSpring<double>> whole(tissue);
  Matrix3X<double> const f = whole.forces(x, v);
  CHECK(f.allFinite());
  for (int i = 0; i < 9; ++i) {
    CHECK((f.col(i) + (x.col(i) - tissue.rest_position(i))).norm() < 1e-15);   // the home spring alone
    CHECK(tissue.internal_force(i, x, v).allFinite());
  }
  CHECK(std::isfinite(tissue.potential_energy(x)));
  Matrix3X<double> y = Matrix3X<double>::Zero(3, 9);
  tissue.add_stiffness_product(x, v, y);
  tissue.add_damping_product(x, v, y);
  CHECK(y.allFinite());
}

TEST_CASE("wrong options are refused with the value and the remedy") {
  auto const skin = make_grid<double>(3, 3, 1.0);
  double const nan = std::numeric_limits<double>::quiet_NaN();
  using T = MassSpring<double>;
  CHECK_THROWS_WITH(T(skin, {.mass = {.total = 0.0}}), says("the total mass is 0 kg", "positive"));
  CHECK_THROWS_WITH(T(skin, {.mass = {.total = nan}}), says("total mass is nan kg", "finite"));
  CHECK_THROWS_WITH(T(skin, {.link = {.stiffness = 0.0}}), says("the link stiffness is 0 N/m at rest", "positive"));
  CHECK_THROWS_WITH(T(skin, {.link = {.stiffness = 1.0, .damping = -0.5}}), says("link damping is -0.5 N s/m", "not negative"));
  CHECK_THROWS_WITH(T(skin, {.home = {.stiffness = -2.0}}), says("home stiffness is -2 N/m", "not negative"));
  CHECK_THROWS_WITH(T(skin, {.home = {.damping = nan}}), says("home damping is nan N s/m", "finite"));
  CHECK_THROWS_WITH(T(skin, {.link_prestrain = 1.0}), says("link_prestrain is 1", "below 1"));
  CHECK_THROWS_WITH(T(skin, {.link_prestrain = -0.1}), says("link_prestrain is -0.1", "below 1"));
  CHECK_THROWS_WITH((MassSpring<double, SaturatingSpring<double>>(skin, {.link = {.stiffness = 1.0, .largest_tension = 0.0}})),
                    says("SaturatingSpring: .largest_tension is 0 N", "finite number above zero"));
  CHECK_THROWS_WITH((MassSpring<double, CubicSpring<double>>(skin, {.link = {.stiffness = 1.0, .quadratic = 2.0}})), says("link of 1 m", "from -1 m on", "coefficients"));
  CHECK_THROWS_WITH((MassSpring<double, LockingSpring<double>>(skin, {.link = {.guard = 1.0}})), says("LockingSpring: .guard is 1", "0 to below 1"));
  CHECK_THROWS_WITH((MassSpring<double, LockingSpring<double>>(skin, {.link = {.largest_tension = -1.0}})), says("LockingSpring: .largest_tension is -1 N"));
  double const infinity = std::numeric_limits<double>::infinity();   // LinearSpring is that
  CHECK_THROWS_WITH((MassSpring<double, LockingSpring<double>>(skin, {.link = {.largest_tension = infinity}})), says("LockingSpring: .largest_tension is inf N"));

  T tissue(skin, {});
  std::size_t const revision = tissue.revision();
  CHECK_THROWS_WITH(tissue.nail(9), says("particle index 9", "0 … 8"));
  CHECK_THROWS_WITH(tissue.nail(std::vector<int>{1, -1}), says("particle index -1", "0 … 8"));
  CHECK_FALSE(tissue.nailed(1));
  CHECK_THROWS_WITH(tissue.set_mass(2, -1.0), says("particle mass is -1 kg", "positive"));
  CHECK_THROWS_AS(tissue.set_home(-1, {}), OutOfRange);
  CHECK_THROWS_AS(tissue.set_link(1000, {}), OutOfRange);
  CHECK_THROWS_AS(tissue.set_link(0, {.stiffness = nan}), InvalidArgument);
  CHECK(tissue.revision() == revision);
}

TEST_CASE("nails go in and come out") {
  MassSpring<double> tissue(make_grid<double>(3, 3, 1.0), {});
  tissue.nail({0, 4});
  CHECK((tissue.nailed(0) && tissue.nailed(4) && !tissue.nailed(1)));
  tissue.unnail(4);
  CHECK_FALSE(tissue.nailed(4));
}
