// SPDX-License-Identifier: MIT
// After the first step a body does not allocate. Yardstick: the count of the allocation trap.
#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/dormand_prince.hpp>
#include <palpate/integrator/explicit_euler.hpp>
#include <palpate/integrator/explicit_midpoint.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/runge_kutta_4.hpp>
#include <palpate/integrator/stoermer_verlet.hpp>
#include <palpate/integrator/symplectic_euler.hpp>
#include <palpate/integrator/velocity_verlet.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/saturating_spring.hpp>

#include "allocation_trap.hpp"
#include "catch.hpp"

#include <concepts>
#include <type_traits>
#include <utility>

using namespace palpate;

namespace {

/// A touch that wanders over the body, a hand that holds and lets go, queries and reports: the allocations of all that.
template <class Body>
long allocations_of(Body& body) {
  using S = typename Body::Scalar;
  body.apply_force(0, {S(0), S(0), S(1e-3)});
  body.step(S(1e-4));
  palpate_test::AllocationCount const allocations;
  for (int k = 0; k < 400; ++k) {
    int const touched = (k * 37) % body.size();
    body.apply_force(touched, {S(0), S(1e-3), S(-1e-2)});
    body.apply_force((touched + 1) % body.size(), {S(0), S(0), S(0)});
    body.apply_force(body.nearest_vertex({S(0.01), S(0.02), S(0.03)}), {S(1e-3), S(0), S(0)});
    if (k % 50 == 10) body.hold(5);
    if (k % 50 == 20) body.drag(5, body.positions().col(5));
    if (k % 50 == 40) body.release(5);
    if (k == 200) body.set_gravity({S(0), S(0), S(-1)});
    if (k == 300) body.reset();
    body.step(S(1e-4));
    body.nearest_point({S(0.01), S(-0.02), S(0.03)});
    body.reaction(5);
  }
  return allocations.count();
}

}  // namespace

TEMPLATE_PRODUCT_TEST_CASE("stepping allocates nothing after the first step", "", std::pair,
                           ((ExplicitEuler, WholeBody), (SymplecticEuler, WholeBody), (StoermerVerlet, WholeBody), (LeapfrogVerlet, WholeBody),
                            (VelocityVerlet, WholeBody), (ExplicitMidpoint, WholeBody), (RungeKutta4, WholeBody), (DormandPrince, WholeBody),
                            (StoermerVerlet, ZoneOfInfluence), (LeapfrogVerlet, ZoneOfInfluence), (ExplicitMidpoint, ZoneOfInfluence),
                            (RungeKutta4, ZoneOfInfluence), (DormandPrince, ZoneOfInfluence))) {
  REQUIRE(palpate_test::trap_works());
  using I = typename TestType::first_type;
  using R = typename TestType::second_type;
  using S = std::conditional_t<std::same_as<R, WholeBody>, double, float>;
  MassSpringOptions<S, LinearSpring<S>> const options{
      .mass = {.total = S(0.1)}, .link = {.stiffness = S(10), .damping = S(0.01)}, .home = {.stiffness = S(1), .damping = S(0.01)}};
  SoftBody surface(MassSpring<S>(make_sphere<S>(S(0.05), 6), options), I{}, R{});
  CHECK(allocations_of(surface) == 0);
  SoftBody volume(MassSpring<S>(make_block<S>(4, 4, 6, S(0.01)), options), I{}, R{});
  CHECK(allocations_of(volume) == 0);
}

TEST_CASE("a user's law does not allocate either") {
  SoftBody body(MassSpring<double, SaturatingSpring<double>>(make_sphere<double>(0.05, 6),
                                                             {.mass = {.total = 0.1}, .link = {.stiffness = 10.0, .largest_tension = 0.1, .damping = 0.01}, .home = {.stiffness = 1.0}}),
                LeapfrogVerlet{}, ZoneOfInfluence{.rings = 3});
  CHECK(allocations_of(body) == 0);
}
