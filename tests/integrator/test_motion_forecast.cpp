// SPDX-License-Identifier: MIT
// What an implicit step is told to do before it is taken. Yardstick: the body's own step, which knows nothing of the forecast.
#include "allocation_trap.hpp"
#include "catch.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/crank_nicolson.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/motion_forecast.hpp>
#include <palpate/integrator/node_steps.hpp>
#include <palpate/integrator/theta_scheme.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/material/viscoelastic.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>
#include <vector>

using namespace palpate;

namespace {

constexpr double h = 2e-3;

template <class Tissue, class I>
auto moving(Tissue tissue, I integrator) {
  SoftBody body(std::move(tissue), integrator);
  body.set_gravity({1, 0, -9.81});
  for (int i = 0; i < body.size() / 5; ++i) body.nail(i);
  int const dragged = body.size() - 1;
  for (int k = 0; k < 20; ++k) body.step(h);
  body.drag(dragged, Vector3<double>(body.positions().col(dragged)), Vector3<double>(0.1, 0.2, -0.1));
  body.apply_force(body.size() / 2, {0.02, 0, 0.05});
  return body;
}
template <class Body>
Matrix3X<double> change_of(Body body) {
  Matrix3X<double> const before = body.velocities();
  body.step(h);
  return body.velocities() - before;
}
template <class Body>
Matrix3X<double> responses(Body const& body, auto& forecast) {
  Matrix3X<double> all = Matrix3X<double>::Zero(3, body.size());
  for (int i = 0; i < body.size(); ++i) all.col(i) = forecast.response(i);
  return all;
}
double off(Matrix3X<double> const& foreseen, Matrix3X<double> const& real) { return (foreseen - real).colwise().norm().maxCoeff() / real.colwise().norm().maxCoeff(); }

template <class Tissue, class I>
void check(Tissue const& tissue, I integrator) {
  auto const body = moving(tissue, integrator);
  Matrix3X<double> const free = change_of(body);
  auto asked = body;
  auto forecast = asked.forecast(h);
  REQUIRE(forecast.has_value());
  forecast->solve({});
  CHECK(off(responses(body, *forecast), free) < 0.01);

  std::vector const pushed{body.size() - 2, body.size() - 7};
  Vector3<double> const impulse(1e-4, -2e-5, 3e-5);   // N s
  forecast->respond([&](auto const& add) {
    for (int const i : pushed) add(i, impulse);
    add(body.size() - 1, impulse);   // which is held
  });
  double const along = forecast->along();
  auto other = body;
  double work = 0;
  for (int const i : pushed) other.apply_force(i, impulse / h), work += impulse.dot(free.col(i));
  Matrix3X<double> const response = change_of(other) - free;
  CHECK(response.norm() > 1e-3);
  CHECK(off(responses(body, *forecast), response) < 0.04);
  CHECK(along == Approx(work).epsilon(0.02).margin(2e-3 * impulse.norm() * free.norm()));

  // With springs in the step: the forces that they are said to have are those that make them have these forces.
  auto held = body;
  auto told = held.forecast(h);
  double const k = 200, c = 0.3, resists = c + h * told->end_weight() * k;
  Vector3<double> const shift(0.001, 0.002, -0.001);
  std::vector<SpringOnParticle<double>> springs;
  std::vector<Vector3<double>> force;
  for (int const i : pushed) {
    Vector3<double> const v = body.velocities().col(i);
    force.push_back(k * (shift - h * v) - c * v);
    springs.push_back({i, h * resists, h * force.back()});
  }
  told->solve(springs);
  for (std::size_t n = 0; n < pushed.size(); ++n) force[n] -= resists * told->response(pushed[n]);
  for (std::size_t n = 0; n < pushed.size(); ++n) held.apply_force(pushed[n], force[n]);
  Matrix3X<double> const before = body.positions();
  held.step(h);
  for (std::size_t n = 0; n < pushed.size(); ++n) {
    Vector3<double> const x = held.positions().col(pushed[n]) - before.col(pushed[n]), v = held.velocities().col(pushed[n]);
    CHECK((k * (shift - x) - c * v - force[n]).norm() < 0.01 * force[n].norm());
  }
}
template <class Tissue>
void check_all(Tissue const& tissue) {
  check(tissue, BackwardEuler{.tolerance = 1e-10, .max_iterations = 2000, .halvings = 0});
  check(tissue, CrankNicolson{.tolerance = 1e-10, .max_iterations = 2000, .newton_iterations = 1});
  check(tissue, ThetaScheme{.theta = 0.7, .tolerance = 1e-10, .max_iterations = 2000, .halvings = 0});
}

template <class Body>
concept Forecasts = requires(Body& body) { body.forecast(h); };

}  // namespace

TEST_CASE("a step that is forecast is the step that is taken, with impulses and with springs", "[implicit]") {
  auto const mesh = make_block<double>(5, 4, 4, 0.01, BlockPattern::alternating);
  check_all(FiniteElements<double, StableNeoHookean<double>>(mesh, {.density = 1000, .material = {.young = 1e4, .poisson = 0.4}, .damping = {.alpha = 2, .beta = 5e-3}}));
  Viscoelastic const material{StableNeoHookean<double>{.young = 1e4, .poisson = 0.3}, {{0.3, 0.01}, {0.2, 2.0}}};
  check_all(FiniteElements<double, std::remove_const_t<decltype(material)>>(mesh, {.density = 1000, .material = material, .damping = {.alpha = 2, .beta = 2e-3}}));
  check_all(MassSpring<double>(make_sphere<double>(0.03, 4), {}));
}

TEST_CASE("who asks for a forecast changes nothing, and it allocates nothing", "[implicit]") {
  auto const make = [] {
    FiniteElements<double, StableNeoHookean<double>> tissue(make_block<double>(5, 4, 4, 0.01), {.density = 1000, .material = {.young = 1e4, .poisson = 0.4}});
    return moving(std::move(tissue), BackwardEuler{});
  };
  auto asked = make(), other = make();
  for (int k = 0; k < 2; ++k) {   // the second time every memory is there
    palpate_test::AllocationCount const allocations;
    auto forecast = asked.forecast(h);
    forecast->respond([](auto const& add) { add(60, Vector3<double>(1e-4, 0, 0)); });
    forecast->solve({});
    asked.step(h);
    if (k == 1) CHECK(allocations.count() == 0);
    other.step(h);
  }
  CHECK(asked.positions() == other.positions());
  CHECK(asked.velocities() == other.velocities());
}

// Yardstick: the forecast, and the step, of a body that was never asked before.
TEST_CASE("what a second tool is told in a step counts what the first has pressed with", "[implicit]") {
  FiniteElements<double, StableNeoHookean<double>> tissue(make_block<double>(5, 4, 4, 0.01), {.density = 1000, .material = {.young = 1e4, .poisson = 0.4}});
  auto asked = moving(std::move(tissue), BackwardEuler{});
  auto other = asked;
  auto const told = [](auto& body) {
    auto forecast = body.forecast(h);
    forecast->respond([](auto const& add) { add(60, Vector3<double>(1e-4, 2e-4, 0)); });
    return forecast->along();
  };
  double const before = told(asked);
  for (auto* body : {&asked, &other}) {
    body->apply_force(60, {0.5, 0, -0.2});
    body->apply_force(body->size() / 2, {-0.02, 0, 0});   // which had one already
  }
  CHECK(std::abs(told(other) - before) > 0.01 * std::abs(before));
  CHECK(told(asked) == Approx(told(other)).epsilon(1e-9));
  asked.step(h), other.step(h);
  CHECK(asked.positions() == other.positions());
}

// Yardsticks: the zone's own step, a body that was never asked, and one that was restored.
TEST_CASE("in a zone of influence the particles that move already are foreseen", "[implicit]") {
  FiniteElements<double, StableNeoHookean<double>> tissue(make_block<double>(7, 7, 5, 0.01, BlockPattern::alternating),
                                                          {.density = 1000, .material = {.young = 1e4, .poisson = 0.4}, .damping = {.alpha = 2, .beta = 5e-3}});
  int const pressed = tissue.size() - 25, beside = pressed + 1;
  SoftBody body(std::move(tissue), BackwardEuler{.tolerance = 1e-10, .max_iterations = 2000, .halvings = 0}, ZoneOfInfluence{.rings = 2});
  CHECK(!body.forecast(h).has_value());   // nothing moves yet
  auto const press = [&](auto& on) { on.apply_force(pressed, {0.02, 0, -0.1}); };
  for (int k = 0; k < 5; ++k) press(body), body.step(h);
  auto const saved = body.save();
  auto never_asked = body;
  auto restored = body;
  for (int k = 0; k < 3; ++k) press(restored), restored.step(h);
  restored.restore(saved);
  double along[2];
  Matrix3X<double> foreseen = Matrix3X<double>::Zero(3, body.size());
  auto const ask = [&](auto& one, double& told) {
    auto forecast = one.forecast(h);
    REQUIRE(forecast.has_value());
    CHECK((forecast->moves(pressed) && forecast->moves(beside) && !forecast->moves(0)));
    forecast->respond([&](auto const& add) { add(pressed, Vector3<double>(0, 0, 1e-4)); });
    told = forecast->along();
    forecast->solve({});
    for (int i = 0; i < one.size(); ++i) foreseen.col(i) = forecast->response(i);
  };
  for (auto* one : {&body, &never_asked, &restored}) press(*one);
  ask(restored, along[1]), ask(body, along[0]);
  CHECK(along[0] == along[1]);
  for (auto* one : {&body, &never_asked, &restored}) one->apply_force(pressed, {0.003, 0.001, -0.007});   // another tool
  ask(restored, along[1]), ask(body, along[0]);
  CHECK(along[0] == along[1]);
  Matrix3X<double> const before = body.velocities();
  for (auto* one : {&body, &never_asked, &restored}) REQUIRE(one->step(h));
  Matrix3X<double> const change = body.velocities() - before;
  CHECK((foreseen - change).norm() < 0.01 * change.norm());
  CHECK(body.positions() == never_asked.positions());
  CHECK(body.positions() == restored.positions());
  body.insert_on_edge(pressed, beside, 0.5), body.finish_edits();
  CHECK(!body.forecast(h).has_value());
}

// Yardstick: a body that has never moved elsewhere. What had moved before was taken for a column of what moves now, some behind the last.
TEST_CASE("after restore() nothing is left of the zone that moved before", "[implicit]") {
  FiniteElements<double, StableNeoHookean<double>> tissue(make_block<double>(12, 4, 4, 0.01), {.density = 1000, .material = {.young = 1e4, .poisson = 0.4}});
  SoftBody body(std::move(tissue), BackwardEuler{}, ZoneOfInfluence{.rings = 1});
  int const pressed = 17, far = body.size() - 1;
  auto const press = [&](auto& on, int where) { on.apply_force(where, {0.001, 0, -0.01}), on.step(h); };
  for (int k = 0; k < 3; ++k) press(body, pressed);
  auto other = body;
  auto const saved = body.save();
  body.apply_force(pressed + 5, {0, 0, 1e-3});
  for (int k = 0; k < 3; ++k) press(body, far), press(body, pressed + 6);
  for (auto* one : {&body, &other}) one->restore(saved);
  for (auto* one : {&body, &other}) {
    one->hold(far), one->apply_force(far, {0, 0, 5}), one->apply_force(pressed, {0, 0, -0.01});
    auto forecast = one->forecast(h);
    REQUIRE(forecast.has_value());
    CHECK((forecast->moves(pressed) && !forecast->moves(far) && !forecast->moves(far - 1)));
    one->step(h);
  }
  CHECK(body.positions() == other.positions());
  CHECK(body.velocities() == other.velocities());
}

TEST_CASE("forecasts are for integrators that say what weight a step's end has", "[implicit]") {
  using Tissue = MassSpring<double>;
  STATIC_REQUIRE(Forecasts<SoftBody<Tissue, BackwardEuler, WholeBody>>);
  STATIC_REQUIRE(Forecasts<SoftBody<Tissue, BackwardEuler, ZoneOfInfluence>>);
  STATIC_REQUIRE(!Forecasts<SoftBody<Tissue, LeapfrogVerlet, WholeBody>>);
  STATIC_REQUIRE(!Forecasts<SoftBody<Tissue, NodeSteps, WholeBody>>);
  MassSpring<double> tissue(make_sphere<double>(0.03, 4), {});
  for (int i = 0; i < tissue.size(); ++i) tissue.nail(i);
  SoftBody nailed(std::move(tissue), BackwardEuler{});
  CHECK(!nailed.forecast(h).has_value());   // nothing moves
}
