// SPDX-License-Identifier: MIT
// What a contact takes for the motion of a body without it. Yardstick: the body's own step, which knows nothing of it.
#include "catch.hpp"
#include "contact/blocks.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/contact/free_motion.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/material/viscoelastic.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/tensor_mass/tensor_mass.hpp>

#include <algorithm>
#include <type_traits>

using namespace palpate;
using namespace palpate_test;

namespace {

constexpr BackwardEuler exact{.tolerance = 1e-10, .max_iterations = 2000, .halvings = 0};

/// How far off, as a share of the largest change of velocity, after some steps under gravity, with a force on one particle and another one dragged.
template <class Body>
double off(Body body) {
  double const h = 2e-3;
  int const dragged = body.size() - 1, pushed = body.size() / 2;
  body.set_gravity({1, 0, -9.81});
  for (int i = 0; i < body.size() / 5; ++i) body.nail(i);
  for (int k = 0; k < 20; ++k) body.step(h);
  body.drag(dragged, Vector3<double>(body.positions().col(dragged)), Vector3<double>(0.1, 0.2, -0.1));
  body.apply_force(pushed, {0.02, 0, 0.05});
  detail::FreeMotion<Body> motion;
  motion.begin(body, h);
  Matrix3X<double> foreseen = body.velocities();
  Matrix3X<double> const before = foreseen;
  for (int i = 0; i < body.size(); ++i)
    if (!body.tissue().nailed(i) && i != dragged) foreseen.col(i) = motion.velocity(body, i, h);
  body.step(h);
  double worst = 0, largest = 0;
  for (int i = 0; i < body.size(); ++i) {
    if (body.tissue().nailed(i) || i == dragged) continue;
    worst = std::max(worst, (foreseen.col(i) - body.velocities().col(i)).norm());
    largest = std::max(largest, (before.col(i) - body.velocities().col(i)).norm());
  }
  CHECK(largest > 1e-4);
  return worst / largest;
}

}  // namespace

TEST_CASE("how an implicit body is taken to move is how its step moves it", "[contact]") {
  auto const mesh = block<double>(5, 4, 4, 0.01, {0, 0, 0});
  CHECK(off(solid<double>(mesh, exact, 1e4, 2.0, 5e-3)) < 0.01);
  CHECK(off(SoftBody(FiniteElements<double, StableNeoHookean<double>>(
                         mesh, {.density = 1000, .material = {.young = 1e4, .poisson = 0.45}, .damping = {.alpha = 2, .beta = 5e-3}, .pressure = Pressure::nodal}),
                     exact)) < 0.01);
  CHECK(off(SoftBody(TensorMass<double>(mesh, {.density = 1000, .material = {.young = 1e4, .poisson = 0.3}, .damping = {.alpha = 2, .beta = 5e-3}}), exact)) < 0.01);
  Viscoelastic const material{StableNeoHookean<double>{.young = 1e4, .poisson = 0.3}, {{0.3, 0.01}, {0.2, 2.0}}};
  CHECK(off(SoftBody(FiniteElements<double, std::remove_const_t<decltype(material)>>(mesh, {.density = 1000, .material = material, .damping = {.alpha = 2, .beta = 2e-3}}), exact)) < 0.01);
  CHECK(off(SoftBody(MassSpring<double>(make_sphere<double>(0.03, 4), {}), exact)) < 0.01);
}
