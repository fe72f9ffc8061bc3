// SPDX-License-Identifier: MIT
// Tools at bodies that take long implicit steps: what is felt settles in some steps, and is the same at any step. Yardstick: Newton's statics under the force
// that is felt.
#include "catch.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/no_cutter.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/crank_nicolson.hpp>
#include <palpate/integrator/theta_scheme.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/simulator/body_tool.hpp>
#include <palpate/statics/newton_raphson.hpp>
#include <palpate/tissue/finite_elements.hpp>

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <utility>
#include <vector>

using namespace palpate;

namespace {

/// A block of 1,024 tetrahedra on nails, into which a tool is pushed by 2 mm in 0.3 s, and held there.
template <class Integrator, class Region = WholeBody>
struct Pressed {
  static auto block(Integrator integrator, Region region) {
    auto const mesh = make_block<double>(9, 9, 5, 0.005, BlockPattern::alternating);
    FiniteElements<double, StableNeoHookean<double>> tissue(mesh, {.density = 1000.0, .material = {.young = 1e4, .poisson = 0.4}, .damping = {.beta = 0.01}});
    tissue.nail(vertices_where(mesh, [](Vector3<double> const& p) { return p.z() < 1e-9; }));
    return SoftBody(std::move(tissue), integrator, region);
  }

  explicit Pressed(Integrator integrator, Region region = {}) : body(block(integrator, region)) {}

  Vector3<double> run(double until, double h) {
    Vector3<double> force = Vector3<double>::Zero();
    for (; time < until - h / 2; time += h) {
      bool const moves = time < 0.3 - h / 2;
      ToolPose<double> pose{.position = {0.0213, 0.0207, 0.023 - 0.005 * std::min(1.0, (time + h) / 0.3)}};
      pose.velocity = {0, 0, moves ? -0.005 / 0.3 : 0.0};
      tip = pose.position;
      tool.advance(body, pose, 0);
      tool.push(body, 1, 1, h);
      body.step(h);
      force = tool.model(body, false).tissue_force;
    }
    return force;
  }

  decltype(block(Integrator{}, Region{})) body;
  BodyTool<decltype(body), NoCutter<double>> tool{NoCutter<double>{}, ContactCoupling{}};
  Vector3<double> tip = Vector3<double>::Zero();
  double time = 0;
};

template <class Integrator, class Region = WholeBody>
void check_coupling(Integrator integrator, std::initializer_list<double> steps, Region region = {}) {
  for (double const h : steps) {
    Pressed at(integrator, region);
    Vector3<double> const force = at.run(0.45, h);
    auto const& contact = at.tool.cutter().contact();
    auto const corners = at.body.tissue().surface().corners(contact.triangle);
    auto rests = at.body;
    for (int c = 0; c < 3; ++c) rests.apply_force(corners[static_cast<std::size_t>(c)], -contact.barycentric[c] * force);
    rests.solve_statics(NewtonRaphson{}, 1e-9);
    Vector3<double> point = Vector3<double>::Zero();
    for (int c = 0; c < 3; ++c) point += contact.barycentric[c] * rests.positions().col(corners[static_cast<std::size_t>(c)]);
    double const by_statics = ContactCoupling{}.stiffness * (point - at.tip).dot(contact.normal);
    CAPTURE(h, force.transpose(), by_statics);
    CHECK(force.norm() > 0.1);
    CHECK(force.norm() == Approx(by_statics).epsilon(0.01));
  }
}

}  // namespace

TEST_CASE("0.15 s after a tip has stopped the hand feels the static solution, in steps of 1 to 20 ms", "[haptics][implicit]") {
  check_coupling(BackwardEuler{}, {0.001, 0.005, 0.01, 0.02});
  check_coupling(CrankNicolson{}, {0.005, 0.01});
  check_coupling(ThetaScheme{.theta = 0.7}, {0.005, 0.01});
  check_coupling(BackwardEuler{}, {0.005, 0.01, 0.02}, ZoneOfInfluence{.rings = 30});   // all of the body, once it is touched
}

TEMPLATE_TEST_CASE("a body restored under a tool gives the same bytes again, in long implicit steps", "[haptics][implicit]", WholeBody, ZoneOfInfluence) {
  Pressed<BackwardEuler, TestType> at(BackwardEuler{});
  at.run(0.25, 0.005);
  auto const saved = at.body.save();
  auto const go = [&] {   // from outside, with a tool that knows nothing
    BodyTool<decltype(at.body), NoCutter<double>> tool{NoCutter<double>{}, ContactCoupling{}};
    std::vector<Vector3<double>> felt;
    for (int k = 0; k < 10; ++k) {
      tool.advance(at.body, {.position = at.tip + Vector3<double>(0, 0, 0.005 - 1e-3 * k)}, 0);
      tool.push(at.body, 1, 1, 0.005);
      at.body.step(0.005);
      felt.push_back(tool.model(at.body, false).tissue_force);
    }
    return felt;
  };
  auto const once = go();
  CHECK(once.back().norm() > 0.05);
  at.body.restore(saved);
  CHECK(go() == once);
}
