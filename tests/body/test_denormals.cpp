// SPDX-License-Identifier: MIT
// A sheet at rest that is pressed in the middle: the motion that reaches its rim begins far below the normal range. Yardstick: IEEE 754's classes of
// numbers.
#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/runge_kutta_4.hpp>
#include <palpate/integrator/symplectic_euler.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include "catch.hpp"

#include <cmath>

using namespace palpate;

namespace {

template <class Body>
int denormal(Body const& body) {
  int count = 0;
  for (int i = 0; i < body.size(); ++i)
    for (int k = 0; k < 3; ++k) count += std::fpclassify(body.velocities()(k, i)) == FP_SUBNORMAL;
  return count;
}

}  // namespace

#if defined(__SSE2__) || defined(__aarch64__)
TEMPLATE_TEST_CASE("no velocity of a pressed sheet is a denormal number", "", LeapfrogVerlet, SymplecticEuler, RungeKutta4) {
  constexpr int n = 31;
  MassSpring<float> const tissue(make_grid<float>(n, n, 0.005F), {.mass = {.total = 0.3F}, .link = {.stiffness = 100, .damping = 0.02F}, .home = {.stiffness = 10, .damping = 0.05F}});
  SoftBody body(tissue, TestType{}, WholeBody{});
  int moved = 0;
  for (int step = 0; step < 40; ++step) {
    body.apply_force(n * n / 2, {0, 0, -0.03F});
    body.step(1e-5F);
    CHECK(denormal(body) == 0);
    moved = 0;
    for (int i = 0; i < body.size(); ++i) moved += body.velocities().col(i).norm() > 0;
  }
  CHECK(moved > 100);
  CHECK(moved < n * n);   // the rim has not heard of it, though sums of its springs alone would have
}
#endif
