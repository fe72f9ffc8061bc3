// SPDX-License-Identifier: MIT
#include "catch.hpp"
#include "volume/surfaces.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/statics/newton_raphson.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/volume/fill.hpp>

#include <Eigen/Dense>

#include <utility>

using namespace palpate;

// Yardsticks: at rest under its weight the nails carry it, sum of reactions = m g; a press is balanced by its reactions; what is let go comes back, for the material is elastic.
TEST_CASE("ten kinds of surfaces are filled, settle under their weight, are pressed and come back", "[volume][filled_body]") {
  for (auto const& [name, skin, edge, whole] : palpate_test::surfaces()) {
    auto const solid = fill(skin, {.edge = name[0] == 'a' ? edge : 1.5 * edge});
    INFO(name << ": " << to_string(solid));
    auto const box = bounding_box(solid.mesh);
    double const low = box.min().z(), height = box.sizes().z();
    FiniteElements<double, StableNeoHookean<double>> tissue(solid.mesh, {.density = 1000, .material = {20000, 0.4}, .damping = {.alpha = 20}});
    tissue.nail(vertices_where(solid.mesh, [&](auto const& p) { return p.z() < low + 0.3 * height; }));
    double mass = 0;
    for (int i = 0; i < tissue.size(); ++i) mass += tissue.mass(i);
    CHECK(mass == Approx(1000 * volume(solid.mesh)).epsilon(1e-9));
    SoftBody body(std::move(tissue), BackwardEuler{});
    body.set_gravity({0, 0, -9.81});
    body.settle(NewtonRaphson{});
    auto const carried = [&] {
      Vector3<double> sum = Vector3<double>::Zero();
      for (int i = 0; i < body.size(); ++i)
        if (body.tissue().nailed(i)) sum += body.reaction(i);
      return sum;
    };
    CHECK(carried().z() == Approx(9.81 * mass).epsilon(1e-3));
    int const touched = body.nearest_vertex({box.center().x(), box.center().y(), box.max().z()});
    Vector3<double> const at_rest = body.positions().col(touched);
    double const depth = 0.05 * height;
    for (int k = 1; k <= 20; ++k) {
      body.drag(touched, at_rest - k / 20.0 * depth * Vector3<double>::UnitZ());
      REQUIRE(body.step(0.02));
    }
    for (int k = 0; k < 30; ++k) REQUIRE(body.step(0.02));
    CHECK(body.tissue().lowest_determinant(body.positions()).value > 0);
    double const pressed = -body.reaction(touched).z();
    CHECK(pressed > 0);
    CHECK((carried() + body.reaction(touched)).z() == Approx(9.81 * mass).epsilon(0.01));
    body.release(touched);
    for (int k = 0; k < 60; ++k) REQUIRE(body.step(0.02));
    CHECK((body.positions().col(touched) - at_rest).norm() < 0.02 * depth);
  }
}
