// SPDX-License-Identifier: MIT
// Support springs. Yardsticks: their formula in a plain loop, the tissue law battery, sums before a cut, and volumes by the divergence theorem.
#include <palpate/body/soft_body.hpp>
#include <palpate/core/random.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/node_steps.hpp>
#include <palpate/integrator/runge_kutta_4.hpp>
#include <palpate/integrator/theta_scheme.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/edges.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/testing/tissue.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/saturating_spring.hpp>
#include <palpate/tissue/supported.hpp>
#include <palpate/tissue/tensor_mass/corotated_tensor_mass.hpp>
#include <palpate/tissue/tensor_mass/tensor_mass.hpp>

#include "body/random_edits.hpp"
#include "catch.hpp"

#include <cmath>
#include <span>
#include <utility>

using namespace palpate;

namespace {

template <class S>
MassSpring<S> ball(S stiffness, S home) {
  return {make_sphere<S>(S(0.05), 8), {.mass = {.total = S(0.3)}, .link = {.stiffness = stiffness, .damping = S(0.1)}, .home = {.stiffness = home, .damping = S(0.05)}}};
}

/// Mass-spring tissue that hides what it can do besides.
struct Plain : MassSpring<double> {
  using MassSpring<double>::MassSpring;
  struct Assembly {
    MassSpring<double>::Assembly inner;
    std::span<int const> particles() const { return inner.particles(); }
    template <class X, class V, class F>
    void add_forces(X const& x, V const& v, F& f) const {
      inner.add_forces(x, v, f);
    }
  };
  void assemble(std::span<int const> moving, Assembly& assembly) const { MassSpring<double>::assemble(moving, assembly.inner); }
};

/// The last block first.
struct Backwards {
  template <class Work>
  void operator()(int n, Work const& work) const {
    for (int k = n - 1; k >= 0; --k) work(k);
  }
};

}  // namespace

static_assert(HasFusedForces<Supported<MassSpring<double>>> && HasStiffnessBlocks<Supported<MassSpring<double>>> && ReservesMemory<Supported<MassSpring<float>>> &&
              !HasFusedForces<Supported<Plain>> && !HasTangentOperator<Supported<Plain>>);
static_assert(HasTangentOperator<Supported<MassSpring<double>>> && CuttableTissue<Supported<MassSpring<double>>> && HasPotentialEnergy<Supported<MassSpring<float>>> &&
              HasStiffnessProduct<Supported<MassSpring<double>>> && HasStiffnessRowBoundsAt<Supported<MassSpring<float>>>);

TEMPLATE_TEST_CASE("supported tissue obeys the laws of its family", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const broken = [](auto const& tissue) { return testing::to_text(testing::check_tissue(tissue)); };
  CHECK(broken(Supported(ball<S>(S(50), S(0)), LinearSpring<S>{.stiffness = S(20), .damping = S(0.1)})) == "");
  CHECK(broken(Supported(ball<S>(S(50), S(3)), SaturatingSpring<S>{.stiffness = S(20), .largest_tension = S(0.1), .damping = S(0.1)})) == "");
  MassSpring<S> const block(make_block<S>(4, 4, 4, S(0.01)), {.link = {.stiffness = S(50)}});
  CHECK(broken(Supported(block, LinearSpring<S>{.stiffness = S(20)})) == "");
  MassSpring<S> const skin(make_grid<S>(5, 5, S(0.01)), {.link = {.stiffness = S(50)}});
  CHECK(broken(Supported(skin, LinearSpring<S>{.stiffness = S(20)}, {S(0.02), S(0.02), S(-0.05)})) == "");
  CHECK_THROWS_WITH(Supported(skin, LinearSpring<S>{}), says("particle 12", "centre inside the body"));
  CHECK_THROWS_AS(Supported(skin, LinearSpring<S>{}, Vector3<S>::Constant(std::numeric_limits<S>::quiet_NaN())), InvalidArgument);
  CHECK_THROWS_AS(Supported(ball<S>(S(50), S(0)), LinearSpring<S>{.stiffness = S(-1)}), InvalidArgument);
}

TEST_CASE("support springs pull along the line to the centre, in proportion to mass") {
  auto plain = ball<double>(50.0, 3.0);
  plain.set_mass(4, 0.02);
  Vector3<double> const centre(0.001, -0.002, 0.003);
  Supported const tissue(plain, LinearSpring<double>{.stiffness = 20.0, .damping = 0.3}, centre);
  Random random(Seed{3});
  Matrix3X<double> x = plain.rest_positions(), v = x;
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    x.data()[k] += random.uniform(-0.004, 0.004);
    v.data()[k] = random.uniform(-0.1, 0.1);
  }
  double const mean = plain.total_mass() / plain.size();
  testing::detail::WholeTissue whole(tissue);
  Matrix3X<double> const forces = whole.forces(x, v);
  double energy = plain.potential_energy(x);
  for (int i = 0; i < plain.size(); ++i) {
    Vector3<double> const d = x.col(i) - centre, n = d.normalized();
    double const stretch = d.norm() - (plain.rest_position(i) - centre).norm(), share = plain.mass(i) / mean;
    Vector3<double> const expected = plain.internal_force(i, x, v) - share * (20.0 * stretch + 0.3 * n.dot(v.col(i))) * n;
    CHECK((tissue.internal_force(i, x, v) - expected).norm() < 1e-14);
    CHECK((forces.col(i) - expected).norm() < 1e-13);
    energy += share * 10.0 * stretch * stretch;
  }
  CHECK(tissue.potential_energy(x) == Approx(energy).epsilon(1e-13));
  // Row bounds at x: no unit displacements give more.
  for (int trial = 0; trial < 20; ++trial) {
    Matrix3X<double> step(3, plain.size()), y = Matrix3X<double>::Zero(3, plain.size());
    for (Eigen::Index k = 0; k < step.size(); ++k) step.data()[k] = random.uniform(-1.0, 1.0);
    step.colwise().normalize();
    tissue.add_stiffness_product(x, step, y);
    for (int i = 0; i < plain.size(); ++i) REQUIRE(y.col(i).norm() <= tissue.stiffness_bound(i, x) * (1 + 1e-12));
  }
  Matrix3X<double> at_centre = x;
  at_centre.col(0) = centre;
  CHECK(whole.forces(at_centre, v).allFinite());
}

TEMPLATE_TEST_CASE("support springs join the fused step of the tissue, block by block", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  int const side = GENERATE(12, 80);   // 80: two blocks
  auto const tissue = [&](S damping) {
    MassSpring<S> springs(make_grid<S>(side, side, S(0.005)), {.mass = {.total = S(3)}, .link = {.stiffness = S(100)}, .home = {.stiffness = S(10)}});
    springs.nail(side / 2);
    return Supported(std::move(springs), LinearSpring<S>{.stiffness = S(300), .damping = damping}, {S(0.1), S(0.15), S(-0.2)});
  };
  SoftBody body(tissue(S(0.1)), LeapfrogVerlet{}, WholeBody{}), fresh(tissue(S(0)), LeapfrogVerlet{}, WholeBody{});
  SoftBody backwards(tissue(S(0.1)), LeapfrogVerlet{}, WholeBody{}, Backwards{});
  auto const live = [&](auto& one) {
    one.set_gravity({S(0), S(0), S(-9.81)});
    for (int k = 0; k < 30; ++k) {
      for (int i = 3; i < one.size(); i += 41) one.apply_force(i, {S(0.02), S(0), S(0.05)});
      REQUIRE(one.step(S(1e-4)));
    }
  };
  live(body), live(backwards);
  CHECK(body.positions() == backwards.positions());
  CHECK(body.velocities() == backwards.velocities());

  // A step from rest without damping is v⁺ = h a(x), with the force on each particle as the formula has it.
  S const h = S(1e-5);
  Matrix3X<S> const x = body.positions(), still = Matrix3X<S>::Zero(3, x.cols());
  for (int i = 0; i < fresh.size(); ++i)
    if (!fresh.tissue().nailed(i)) fresh.drag(i, x.col(i)), fresh.release(i);
  REQUIRE(fresh.step(h));
  S worst = 0, largest = 0;
  for (int i = 0; i < fresh.size(); ++i) {
    if (fresh.tissue().nailed(i)) continue;
    Vector3<S> const a = fresh.tissue().internal_force(i, x, still) / fresh.tissue().mass(i);
    worst = std::max(worst, (fresh.velocities().col(i) / h - a).norm()), largest = std::max(largest, a.norm());
  }
  CHECK(largest > S(0.1));
  CHECK(worst < (std::same_as<S, float> ? S(2e-2) : S(1e-10)) * largest);
}

TEST_CASE("tissue that can do no more than a tissue must can be supported too") {
  auto const sheet = [](auto tissue) { return Supported(std::move(tissue), LinearSpring<double>{.stiffness = 20.0, .damping = 0.1}, {0.05, 0.05, -0.1}); };
  MassSpringOptions<double, LinearSpring<double>> const options{.link = {.stiffness = 50.0}, .home = {.stiffness = 3.0}};
  SoftBody plain(sheet(Plain(make_grid<double>(9, 9, 0.01), options)), LeapfrogVerlet{}, WholeBody{});
  SoftBody body(sheet(MassSpring<double>(make_grid<double>(9, 9, 0.01), options)), LeapfrogVerlet{}, WholeBody{});
  for (int k = 0; k < 50; ++k) {
    plain.apply_force(40, {0.0, 0.0, -0.1}), body.apply_force(40, {0.0, 0.0, -0.1});
    REQUIRE(plain.step(1e-3));
    REQUIRE(body.step(1e-3));
  }
  CHECK(body.displacement(40).z() < -1e-4);
  CHECK((plain.positions() - body.positions()).cwiseAbs().maxCoeff() < 1e-14);
  CHECK(testing::to_text(testing::check_tissue(plain.tissue())) == "");
}

TEMPLATE_TEST_CASE("a supported solid swings about its supports by every integrator", "", (FiniteElements<double, StableNeoHookean<double>>), TensorMass<double>,
                   CorotatedTensorMass<double>) {
  // Shifted by 2 mm and let go. Yardstick: the classic Runge-Kutta method, with the forces that the tissue states particle by particle; of implicit steps the same
  // ones without the energy that they compare.
  auto const mesh = make_block<double>(3, 3, 3, 0.01, BlockPattern::alternating);
  auto const swing = [&](auto const& integrator, double h, auto const&... region) {
    Supported tissue(TestType(mesh, {.density = 1000, .material = {.young = 5e3, .poisson = 0.45}}), LinearSpring<double>{.stiffness = 20}, Vector3<double>(0.0103, 0.0102, 0.0101));
    SoftBody body(std::move(tissue), integrator, region...);
    for (int i = 0; i < body.size(); ++i) body.drag(i, mesh.points.col(i) + Vector3<double>(0.002, 0, 0));
    for (int i = 0; i < body.size(); ++i) body.release(i);
    for (int step = 0; step < std::lround(0.02 / h); ++step) REQUIRE(body.step(h));
    return Matrix3X<double>(body.positions() - mesh.points);
  };
  Matrix3X<double> const exact = swing(RungeKutta4{}, 2e-4), implicit = swing(ThetaScheme{.theta = 1.0, .tolerance = 1e-9, .halvings = 0}, 2e-4);
  REQUIRE(exact.row(0).mean() < -0.0015);
  REQUIRE((implicit - exact).cwiseAbs().maxCoeff() < 2e-4);
  CHECK((swing(BackwardEuler{.tolerance = 1e-9}, 2e-4) - implicit).cwiseAbs().maxCoeff() < 1e-7);
  CHECK((swing(NodeSteps{.theta = 1.0, .tolerance = 1e-9}, 2e-4) - implicit).cwiseAbs().maxCoeff() < 1e-5);
  CHECK((swing(LeapfrogVerlet{}, 2e-4) - exact).cwiseAbs().maxCoeff() < 1e-5);
}

TEST_CASE("inside a volume nothing is supported") {
  Supported const block(MassSpring<double>(make_block<double>(3, 3, 5, 0.01), {}), LinearSpring<double>{});
  int inside = 0;
  for (int i = 0; i < block.size(); ++i) inside += block.support_weight(i) == 0 ? 1 : 0;
  CHECK(inside == 3);   // 3 × 3 × 5 points less the shell
}

TEST_CASE("cuts keep links on edges and the support of the whole") {
  Random random(Seed{21});
  Supported tissue(ball<double>(50.0, 3.0), LinearSpring<double>{.stiffness = 20.0});
  auto const total = [&] {
    double sum = 0;
    for (int i = 0; i < tissue.size(); ++i) sum += tissue.support_weight(i);
    return sum;
  };
  int const before = tissue.size();
  REQUIRE(total() == Approx(before));
  for (int k = 0; k < 60; ++k) {
    if (k % 4 != 3)
      palpate_test::random_insertion(tissue, tissue.surface(), random);
    else
      palpate_test::random_split(tissue, tissue.surface(), random);
    REQUIRE(total() == Approx(before).epsilon(1e-12));
  }
  CHECK(tissue.size() == before + 60);
  TriangleMesh<double> const mesh{tissue.rest_positions(), tissue.surface().triangles()};
  CHECK(tissue.links().size() == static_cast<int>(edges(mesh).size()));
  CHECK(testing::to_text(testing::check_tissue(tissue)) == "");
}

TEST_CASE("a supported body moves in a zone and is cut like any other") {
  SoftBody body(Supported(ball<double>(50.0, 3.0), LinearSpring<double>{.stiffness = 20.0, .damping = 0.05}), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 1});
  SoftBody whole(Supported(ball<double>(50.0, 3.0), LinearSpring<double>{.stiffness = 20.0, .damping = 0.05}), LeapfrogVerlet{}, WholeBody{});
  int const pole = body.nearest_vertex({0.0, 0.0, 1.0});
  int const n = body.insert_in_triangle(0, {0.3, 0.3, 0.4});
  CHECK(body.tissue().support_weight(n) > 0);
  for (int k = 0; k < 20; ++k) {
    body.apply_force(pole, {0.0, 0.0, -0.1});
    whole.apply_force(pole, {0.0, 0.0, -0.1});
    CHECK(body.step(1e-4).moving < body.size() / 4);
    REQUIRE(whole.step(1e-4));
  }
  CHECK(body.displacement(pole).z() == Approx(whole.displacement(pole).z()).epsilon(1e-3));
}

TEST_CASE("support springs lessen the change of volume at equal depth") {
  // Pressed in at one pole, or squeezed between two.
  auto const loss = [](auto tissue, bool squeeze) {
    SoftBody body(std::move(tissue), LeapfrogVerlet{}, WholeBody{});
    double const before = volume(body.mesh());
    for (double const side : {1.0, -1.0}) {
      if (side < 0 && !squeeze) continue;
      int const pole = body.nearest_vertex({0.0, 0.0, side});
      body.drag(pole, body.positions().col(pole) - Vector3<double>(0.0, 0.0, 0.015 * side));
    }
    body.settle(1e-7);
    return (before - volume(body.mesh())) / before;
  };
  auto const supported = [](double stiffness) { return Supported(ball<double>(50.0, 3.0), LinearSpring<double>{.stiffness = stiffness}); };
  for (bool const squeeze : {false, true}) {
    double const plain = loss(ball<double>(50.0, 3.0), squeeze);
    double const some = loss(supported(20.0), squeeze), more = loss(supported(100.0), squeeze);
    CAPTURE(squeeze, plain, some, more);
    CHECK(plain > 0.01);
    CHECK(some < 0.5 * plain);
    CHECK(more < 0.5 * some);
    CHECK(more > 0);
  }
}
