// SPDX-License-Identifier: MIT
// Yardstick: the same integrator with matrices of its own, which share no memory with what it is given.
#include "catch.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <limits>

using namespace palpate;

namespace {

struct Apart {
  template <class System>
  void step(System& system, typename System::Scalar h) const {
    typename System::Matrix const x = system.positions(), v = system.velocities();
    typename System::Matrix const a = system.acceleration(x, v);
    system.velocities() = v + h * a;
    system.positions() = x + h * system.velocities();
  }
};

struct InPlace {   // the velocities' memory takes the accelerations
  template <class System>
  void step(System& system, typename System::Scalar h) const {
    auto&& a = padded_view(system.scratch(0));
    a = padded_view(system.velocities());
    system.acceleration(padded_view(system.positions()), a, a);
    padded_view(system.velocities()) += h * a;
    padded_view(system.positions()) += h * padded_view(system.velocities());
  }
};

template <class S, class Integrator, class Region>
Matrix3X<S> moved(Integrator integrator, Region region) {
  auto const grid = make_grid<S>(9, 8, S(0.01));
  SoftBody body(MassSpring<S>(grid, {.mass = {.total = S(0.1)}, .link = {.stiffness = S(60), .damping = S(0.05)}, .home = {.stiffness = S(4), .damping = S(0.02)}}),
                integrator, region);
  for (int k = 0; k < 50; ++k) {
    body.apply_force(31, Vector3<S>(S(0.01), S(0.02), S(-0.1)));
    REQUIRE(body.step(S(5e-4)));
  }
  return body.positions();
}

}  // namespace

TEMPLATE_TEST_CASE("accelerations may be written over the velocities they come from", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  CHECK((moved<S>(Apart{}, WholeBody{}) - moved<S>(InPlace{}, WholeBody{})).cwiseAbs().maxCoeff() < S(20) * std::numeric_limits<S>::epsilon());
  CHECK((moved<S>(Apart{}, ZoneOfInfluence{.rings = 2}) - moved<S>(InPlace{}, ZoneOfInfluence{.rings = 2})).cwiseAbs().maxCoeff() <
        S(20) * std::numeric_limits<S>::epsilon());
}
