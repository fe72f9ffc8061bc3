// SPDX-License-Identifier: MIT
// A soft body asks no more of its policies than their concepts say. Yardstick: the closed form of a particle on its home spring.
#include <palpate/body/soft_body.hpp>
#include <palpate/extend/integrator.hpp>
#include <palpate/extend/tissue.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/velocity_verlet.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include "catch.hpp"

#include <cmath>
#include <concepts>
#include <span>

using namespace palpate;

namespace {

template <class S>
using Beads = testing::TissueArchetype<S>;
using Drift = testing::IntegratorArchetype;

static_assert(!CuttableTissue<Beads<double>> && !HasPotentialEnergy<Beads<double>> && !HasStiffnessProduct<Beads<double>> && !HasFusedForces<Beads<double>> &&
              !ReservesMemory<Beads<double>> && !HasPrestrain<Beads<double>> && !HasStiffnessRowBoundsAt<Beads<double>>);
static_assert(HasFusedForces<MassSpring<float>> && ReservesMemory<MassSpring<float>> && HasPrestrain<MassSpring<float>> && HasHomeSprings<MassSpring<float>> &&
              HasLinks<MassSpring<float>> && HasStiffnessRowBoundsAt<MassSpring<float>> && HasPotentialEnergy<MassSpring<float>>);

static_assert(!StatesStableStep<Drift> && !StatesOrder<Drift>);

/// The least region that follows the touch: what is touched, nothing else.
struct TouchedOnly {
  static constexpr bool follows_touch = true;
  double relaxation = 1e-6;
  template <class Graph>
  void select(Graph const&, std::span<int const> touched, Selection& selection) const {
    for (int const i : touched) selection.add(i);
  }
};
static_assert(Region<TouchedOnly>);

/// x(t) of 0.1 x″ + 0.2 x′ + 10 x = F from rest.
double pushed(double force, double t) {
  double const w = std::sqrt(99.0);   // ω² − (γ/2)² = 100 − 1
  return force / 10.0 * (1.0 - std::exp(-t) * (std::cos(w * t) + std::sin(w * t) / w));
}

}  // namespace

TEST_CASE("the least tissue obeys the laws that any tissue obeys") {
  CHECK(testing::to_text(testing::check_tissue(Beads<double>(make_grid<double>(4, 3, 0.01)))) == "");
}

TEST_CASE("a body of the least policies moves as the closed form says") {
  SoftBody body(Beads<double>(make_grid<double>(4, 3, 0.01)), Drift{}, TouchedOnly{});
  // v += h a(x, v), x += h v is stable while 4 - 2 h γ - h² κ ≥ 0, with κ = k/m = 100/s² and γ = c/m = 2/s: h = (√(γ² + 4 κ) - γ)/κ.
  CHECK(body.stable_step() == Approx((std::sqrt(404.0) - 2.0) / 100.0).epsilon(0).margin(0.8 / (1 << 24)));   // 24 bisections of 8/ω
  for (int k = 0; k < 10000; ++k) {
    body.apply_force(5, {0.0, 0.0, -0.02});
    body.apply_force(0, {0.0, 0.0, -0.02});   // nailed
    CHECK(body.step(1e-4).moving == 1);
  }
  CHECK(body.displacement(5).z() == Approx(pushed(-0.02, 1.0)).epsilon(2e-3));
  CHECK(body.displacement(0).norm() == 0);
  CHECK(body.reaction(0).z() == Approx(0.02));
  CHECK(body.nearest_vertex({0.011, 0.011, 0.0}) == 5);
  int moving = 1;
  for (int k = 0; k < 200000 && moving > 0; ++k) moving = body.step(1e-4).moving;
  CHECK(moving == 0);
  CHECK(body.displacement(5).norm() < 1e-6);
}

TEMPLATE_TEST_CASE("shipped integrators and regions work with the least tissue", "", WholeBody, ZoneOfInfluence) {
  SoftBody body(Beads<double>(make_grid<double>(4, 3, 0.01)), LeapfrogVerlet{}, TestType{});
  auto const saved = body.save();
  for (int k = 0; k < 1000; ++k) {
    body.apply_force(5, {0.0, 0.0, -0.02});
    body.step(1e-3);
  }
  CHECK(body.displacement(5).z() == Approx(pushed(-0.02, 1.0)).epsilon(1e-4));
  CHECK(body.displacement(6).norm() == 0);
  body.restore(saved);
  CHECK(body.displacement(5).norm() == 0);
  body.set_gravity({0.0, 0.0, -10.0});
  body.settle();
  CHECK(body.displacement(7).z() == Approx(-0.1).epsilon(1e-6));
}

TEST_CASE("a body without an integrator and a region has the usual ones") {
  auto const mesh = make_grid<double>(3, 3, 0.01);
  MassSpring<double> const tissue(mesh, {.mass = {.total = 0.1}, .link = {.stiffness = 50.0}});
  SoftBody whole(tissue);
  SoftBody damped(tissue, VelocityVerlet{});
  static_assert(std::same_as<decltype(whole), SoftBody<MassSpring<double>, LeapfrogVerlet, WholeBody>>);
  static_assert(std::same_as<decltype(damped), SoftBody<MassSpring<double>, VelocityVerlet, WholeBody>>);
  SoftBody copy(whole);
  static_assert(std::same_as<decltype(copy), decltype(whole)>);
  CHECK(copy.size() == 9);
}

TEST_CASE("an index or a zone that is none is answered in a sentence") {
  auto const mesh = make_grid<double>(3, 3, 0.01);
  MassSpring<double> const tissue(mesh, {.mass = {.total = 0.1}, .link = {.stiffness = 50.0}});
  SoftBody const body(tissue);
  for (int const i : {-1, 9, 100000}) {
    CHECK_THROWS_AS(body.is_held(i), OutOfRange);
    CHECK_THROWS_AS(body.reference_position(i), OutOfRange);
    CHECK_THROWS_AS(body.reference_normal(i), OutOfRange);
  }
  CHECK_FALSE(body.is_held(8));
  for (ZoneOfInfluence const& zone : {ZoneOfInfluence{.rings = -3}, ZoneOfInfluence{.rings = 2, .relaxation = std::nan("")},
                                      ZoneOfInfluence{.rings = 2, .relaxation = -1e-7}})
    CHECK_THROWS_AS(SoftBody(tissue, LeapfrogVerlet{}, zone), InvalidArgument);
  CHECK_NOTHROW(SoftBody(tissue, LeapfrogVerlet{}, ZoneOfInfluence{.rings = 0, .relaxation = 0.0}));
}
