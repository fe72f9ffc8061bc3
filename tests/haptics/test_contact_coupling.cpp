// SPDX-License-Identifier: MIT
// Yardsticks: Newton's third law, the closed forms of one particle on a spring, and the statics of a whole body found here by Newton's
// method on springs written down once more (tests/haptics/sheet.hpp).
#include "catch.hpp"

#include "allocation_trap.hpp"
#include "device/message.hpp"
#include "haptics/sheet.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/no_cutter.hpp>
#include <palpate/haptics/contact_coupling.hpp>
#include <palpate/integrator/explicit_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/runge_kutta_4.hpp>
#include <palpate/integrator/symplectic_euler.hpp>
#include <palpate/integrator/velocity_verlet.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

using namespace palpate;
using palpate_test::message_of;
using palpate_test::Sheet;
using palpate_test::unsaid;

namespace {

/// One free particle of a mass m on a home spring: the middle of a 3 × 3 grid whose border is nailed. The links lie in the plane and are
/// next to nothing, so along z there is one spring, k_home.
template <RealScalar S>
MassSpring<S> one_particle(S mass, S home, S damping) {
  auto const skin = make_grid<S>(3, 3, S(0.01));
  MassSpring<S> tissue(skin, {.mass = {.total = 9 * mass, .lumping = Lumping::equal},
                              .link = {.stiffness = S(1e-6), .damping = 0},
                              .home = {.stiffness = home, .damping = damping}});
  tissue.nail(boundary_vertices(skin));
  return tissue;
}

/// The middle particle is the touched point.
template <class Body>
SurfaceContact<typename Body::Scalar> on_particle(Body const& body, int particle) {
  using S = typename Body::Scalar;
  SurfaceContact<S> contact;
  contact.touching = true;
  contact.triangle = body.tissue().surface().triangles_at(particle).front();
  contact.barycentric.setZero();
  contact.barycentric[body.tissue().surface().corner_of(contact.triangle, particle)] = 1;
  contact.normal = Vector3<S>::UnitZ();
  return contact;
}

constexpr int middle = 4;

}  // namespace

TEST_CASE("a coupling says which coefficient is wrong", "[haptics][coupling]") {
  double const nan = std::numeric_limits<double>::quiet_NaN(), infinite = std::numeric_limits<double>::infinity();
  CHECK(unsaid(message_of([] { ContactCoupling{.stiffness = -1}.validate(); }), "stiffness", "-1 N/m", "positive") == "");
  CHECK(unsaid(message_of([] { ContactCoupling{.stiffness = 0}.validate(); }), "stiffness", "0 N/m") == "");
  CHECK(unsaid(message_of([&] { ContactCoupling{.stiffness = infinite}.validate(); }), "stiffness", "finite") == "");
  CHECK(unsaid(message_of([&] { ContactCoupling{.damping = nan}.validate(); }), "damping", "finite") == "");
  CHECK(unsaid(message_of([] { ContactCoupling{.damping = -2}.validate(); }), "damping", "-2 N s/m") == "");
  CHECK_NOTHROW(ContactCoupling{.stiffness = 1, .damping = 0}.validate());
}

TEMPLATE_TEST_CASE("what the tool feels is what the tissue gets, with the sign changed", "[haptics][coupling]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const skin = make_grid<S>(5, 5, S(0.01));
  SoftBody body(MassSpring<S>(skin, {.mass = {.total = S(0.05)}, .link = {.stiffness = 40, .damping = S(0.01)}, .home = {.stiffness = 5}}),
                LeapfrogVerlet{}, WholeBody{});
  for (Vector3<S> const& tip : {Vector3<S>(S(0.0213), S(0.0171), S(-0.002)), Vector3<S>(S(0.02), S(0.02), S(-0.001)),
                                Vector3<S>(S(0.0152), S(0.015), S(-0.004))}) {
    Touch<S> touch;
    touch.update(body, Vector3<S>(tip.x(), tip.y(), S(0.01)));
    auto const& contact = touch.update(body, tip);
    REQUIRE(contact.touching);
    S const h = S(1e-4);
    auto twin = body;   // does the same step without the contact
    Vector3<S> const reaction = ContactCoupling{.stiffness = 500, .damping = 1}.apply(body, contact, tip, Vector3<S>::Zero(), S(0), h);
    CHECK(reaction.z() > S(0.1));
    CHECK(reaction.template head<2>().norm() == Approx(0.0).margin(1e-7));   // along the normal
    body.step(h);
    twin.step(h);
    Vector3<S> const impulse = body.momentum() - twin.momentum();
    CHECK((impulse + h * reaction).norm() <= S(std::is_same_v<S, float> ? 1e-5 : 1e-12) * h * reaction.norm());
    body.reset();
  }
}

TEMPLATE_TEST_CASE("a contact never pulls", "[haptics][coupling]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  SoftBody body(one_particle<S>(S(0.001), 10, S(0.1)), LeapfrogVerlet{}, WholeBody{});
  auto contact = on_particle(body, middle);
  ContactCoupling const coupling{.stiffness = 1000, .damping = 5};
  Vector3<S> const at = body.positions().col(middle);
  S const h = S(1e-3);
  CHECK(coupling.apply(body, contact, Vector3<S>(at + Vector3<S>(0, 0, S(1e-3))), Vector3<S>::Zero(), S(0), h).isZero(0));   // above
  CHECK(coupling.apply(body, contact, at, Vector3<S>(0, 0, 1), S(0), h).isZero(0));   // leaves faster than the tissue can follow
  CHECK(coupling.apply(body, contact, Vector3<S>(at - Vector3<S>(0, 0, S(1e-4))), Vector3<S>(0, 0, 1), S(0), h).isZero(0));
  contact.touching = false;
  CHECK(coupling.apply(body, contact, Vector3<S>(at - Vector3<S>(0, 0, S(1e-3))), Vector3<S>::Zero(), S(0), h).isZero(0));
  body.step(h);
  CHECK(body.displacement(middle).isZero(0));   // nothing of all this reached the tissue
}

TEMPLATE_TEST_CASE("at rest the force is stiffness times gap, in series with the tissue", "[haptics][coupling]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  // One particle on k_home under a contact k, tip held at depth d: f = k g and f = k_home u, g + u = d, so f = d k k_home/(k + k_home).
  S const home = 60, d = S(0.004);
  for (S const mass : {S(1e-5), S(1e-3), S(0.1)})
    for (double const stiffness : {50.0, 2000.0, 1e6}) {
      SoftBody body(one_particle<S>(mass, home, S(1.2) * std::sqrt(home * mass)), LeapfrogVerlet{}, WholeBody{});
      auto const contact = on_particle(body, middle);
      Vector3<S> const tip = body.positions().col(middle) - Vector3<S>(0, 0, d);
      ContactCoupling const coupling{.stiffness = stiffness, .damping = 0.5};
      S const h = std::min(S(1e-3), S(0.95) * body.stable_step());
      Vector3<S> force = Vector3<S>::Zero();
      int const steps = static_cast<int>(S(40) * std::sqrt(mass / home) / h) + 4000;
      for (int k = 0; k < steps; ++k) {
        force = coupling.apply(body, contact, tip, Vector3<S>::Zero(), S(0), h);
        body.step(h);
      }
      S const k = static_cast<S>(stiffness);
      INFO("mass " << mass << " kg, contact " << stiffness << " N/m, step " << h << " s");
      S const expected = d * k * home / (k + home);
      // float: k g is the difference of coordinates of 0.02 m, known to 1e-9 m, times k.
      double const tolerance = std::is_same_v<S, float> ? 2e-3 : 1e-7;   // the links count for 1e-8
      CHECK(force.z() == Approx(double(expected)).epsilon(tolerance).margin(std::is_same_v<S, float> ? stiffness * 4e-9 : 0.0));
      S const gap = body.positions()(2, middle) - tip.z();
      CHECK(force.z() == Approx(double(k * gap)).epsilon(tolerance).margin(std::is_same_v<S, float> ? stiffness * 4e-9 : 1e-9));
      CHECK(-body.displacement(middle).z() == Approx(double(expected / home)).epsilon(tolerance).margin(1e-8));
    }
}

TEMPLATE_TEST_CASE("a nailed surface is a wall: force is stiffness times depth, from the first tick", "[haptics][coupling]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto tissue = one_particle<S>(S(0.001), 10, S(0.1));
  tissue.nail(middle);
  SoftBody body(std::move(tissue), LeapfrogVerlet{}, WholeBody{});
  auto const contact = on_particle(body, middle);
  Vector3<S> const tip = body.positions().col(middle) - Vector3<S>(0, 0, S(0.003));
  for (int tick = 0; tick < 3; ++tick) {
    Vector3<S> const f = ContactCoupling{.stiffness = 700, .damping = 3}.apply(body, contact, tip, Vector3<S>::Zero(), S(0), S(1e-3));
    CHECK(f.z() == Approx(2.1).epsilon(1e-5));
    body.step(S(1e-3));
    CHECK(body.displacement(middle).isZero(0));
    CHECK(body.reaction(middle).z() == Approx(2.1).epsilon(1e-5));   // the nail bears what the tool presses with
  }
  // A tip of radius r touches where its centre is r above the surface.
  Vector3<S> const f = ContactCoupling{.stiffness = 700, .damping = 3}.apply(body, contact, tip, Vector3<S>::Zero(), S(0.002), S(1e-3));
  CHECK(f.z() == Approx(3.5).epsilon(1e-5));
  // A damper adds c v, and h k v for where the tip will be at the end of the step.
  Vector3<S> const v(0, 0, S(-0.1));
  Vector3<S> const moving = ContactCoupling{.stiffness = 700, .damping = 3}.apply(body, contact, tip, v, S(0), S(1e-3));
  CHECK(moving.z() == Approx(2.1 + 0.3 + 0.07).epsilon(1e-5));
}

namespace {

struct Trial {
  double mass, home, damping, stiffness, contact_damping, share;   // share of the stable step
};

/// A tip comes down onto the particle with 0.2 m/s, goes back a little, comes again and stands still for twenty times the slowest
/// time constant. Returns the largest speed of the particle after that.
template <class IntegratorType>
double speed_at_rest(IntegratorType integrator, Trial const& t, bool& diverged) {
  SoftBody body(one_particle<double>(t.mass, t.home, t.damping), integrator, WholeBody{});
  auto const contact = on_particle(body, middle);
  ContactCoupling const coupling{.stiffness = t.stiffness, .damping = t.contact_damping};
  double const h = std::min(1e-3, t.share * body.stable_step());
  Vector3<double> const at = body.positions().col(middle);
  double z = 0.001;
  auto const press = [&](double target_speed, double until) {
    for (int k = 0; k < 100000 && (target_speed < 0 ? z > until : z < until); ++k) {
      z += target_speed * h;
      coupling.apply(body, contact, Vector3<double>(at.x(), at.y(), z), Vector3<double>(0, 0, target_speed), 0.0, h);
      if (!body.step(h)) diverged = true;
    }
  };
  press(-0.2, -0.004);
  press(0.05, -0.003);
  press(-0.05, -0.004);
  double const stiffness = t.home + t.stiffness, damping = t.damping + t.contact_damping;
  double const settle = 20 * std::max({damping / stiffness, 2 * t.mass / damping, std::sqrt(t.mass / t.home), 20 * h});
  for (double time = 0; time < settle; time += h) {
    coupling.apply(body, contact, Vector3<double>(at.x(), at.y(), z), Vector3<double>::Zero(), 0.0, h);
    if (!body.step(h)) diverged = true;
  }
  double largest = 0;
  for (int k = 0; k < 200; ++k) {
    coupling.apply(body, contact, Vector3<double>(at.x(), at.y(), z), Vector3<double>::Zero(), 0.0, h);
    if (!body.step(h)) diverged = true;
    largest = std::max(largest, body.velocities().col(middle).norm());
  }
  return largest;
}

}  // namespace

TEST_CASE("no contact is too stiff and no particle too light, up to the body's own stable step", "[haptics][coupling]") {
  for (double const mass : {1e-6, 1e-4, 1e-2})
    for (double const home : {0.5, 50.0})
      for (double const share : {0.3, 0.99})
        for (auto const& [stiffness, contact_damping] :
             {std::array{10.0, 0.0}, std::array{10.0, 0.5}, std::array{2000.0, 2.0}, std::array{2000.0, 50.0}, std::array{1e6, 0.0},
              std::array{1e6, 50.0}}) {
          Trial const t{mass, home, 2 * std::sqrt(mass * home), stiffness, contact_damping, share};
          INFO("mass " << mass << " kg, home " << home << " N/m, contact " << stiffness << " N/m and " << contact_damping << " N s/m, step "
                       << share << " of the stable one");
          bool diverged = false;
          double const tolerance = 1e-6;   // m/s; the tip came with 0.2
          CHECK(speed_at_rest(LeapfrogVerlet{}, t, diverged) < tolerance);
          CHECK(speed_at_rest(VelocityVerlet{}, t, diverged) < tolerance);
          CHECK(speed_at_rest(SymplecticEuler{}, t, diverged) < tolerance);
          CHECK(speed_at_rest(RungeKutta4{}, t, diverged) < tolerance);
          CHECK_FALSE(diverged);
          // Explicit Euler moves a particle one step after it was pushed: under a stiff contact it trembles, but within bounds.
          CHECK(speed_at_rest(ExplicitEuler{}, t, diverged) < 2.0);
          CHECK_FALSE(diverged);
        }
}

TEST_CASE("the settled reaction of a sheet is the one Newton's method finds", "[haptics][coupling]") {
  Sheet const sheet;
  SoftBody body(sheet.tissue(), LeapfrogVerlet{}, WholeBody{});
  for (double const stiffness : {200.0, 2000.0}) {
    body.reset();
    double const depth = 0.006;
    Vector3<double> const home(0.0212, 0.0193, 0.0);
    NoCutter<double> tool;
    tool.advance(body, home + Vector3<double>(0, 0, 0.002));
    tool.advance(body, home - Vector3<double>(0, 0, 1e-5));
    REQUIRE(tool.contact().touching);
    ContactCoupling const coupling{.stiffness = stiffness, .damping = 1};
    double const h = std::min(1e-3, 0.9 * body.stable_step());
    // The same material point stays touched: its place in the plane is fixed by the sheet's symmetry only nearly, so it is kept here.
    SurfaceContact<double> const contact = tool.contact();
    Vector3<double> const tip = home - Vector3<double>(0, 0, depth);
    Vector3<double> force = Vector3<double>::Zero();
    for (int k = 0; k < 60000; ++k) {
      force = coupling.apply(body, contact, tip, Vector3<double>::Zero(), 0.0, h);
      body.step(h);
    }
    auto const corners = body.tissue().surface().corners(contact.triangle);
    Sheet::Rest const expected = sheet.equilibrium(corners, contact.barycentric, tip.z(), stiffness);
    double z = 0;
    for (std::size_t c = 0; c < 3; ++c) z += contact.barycentric[static_cast<int>(c)] * body.positions()(2, corners[c]);
    INFO("contact " << stiffness << " N/m: " << expected.force << " N");
    CHECK(expected.force > 0.05);
    CHECK(force.z() == Approx(expected.force).epsilon(1e-6));
    CHECK(z == Approx(expected.touched.z()).epsilon(1e-6));
  }
}

TEST_CASE("gravity and other forces on the touched particle are seen by the contact", "[haptics][coupling]") {
  // One particle, tip just below where it hangs without the contact: equilibrium of f = k g, k_home, m g and a pull p, all along z.
  double const mass = 0.002, home = 30, k = 1500, d = 0.003, pull = 0.05, g = 9.81;
  SoftBody body(one_particle<double>(mass, home, 0.3), LeapfrogVerlet{}, WholeBody{});
  body.set_gravity({0, 0, g});   // upwards, onto the tool
  auto const contact = on_particle(body, middle);
  Vector3<double> const tip = body.positions().col(middle) - Vector3<double>(0, 0, d);
  ContactCoupling const coupling{.stiffness = k, .damping = 1};
  double force = 0;
  for (int step = 0; step < 8000; ++step) {
    body.apply_force(middle, {0, 0, pull});
    force = coupling.apply(body, contact, tip, Vector3<double>::Zero(), 0.0, 1e-3).z();
    body.step(1e-3);
  }
  // k (u + d) = −home u + m g + p with u the displacement along z.
  double const u = (mass * g + pull - k * d) / (k + home);
  CHECK(force == Approx(k * (u + d)).epsilon(1e-7));
}

TEST_CASE("a contact allocates nothing and throws nothing", "[haptics][coupling]") {
  REQUIRE(palpate_test::trap_works());
  SoftBody body(Sheet{}.tissue(), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 3});
  NoCutter<double> tool;
  tool.advance(body, {0.0212, 0.0193, 0.002});
  ContactCoupling const coupling;
  auto const tick = [&](int k) {
    Vector3<double> const tip(0.0212 + 1e-6 * k, 0.0193, -1e-5 * k);
    tool.advance(body, tip);
    coupling.apply(body, tool.contact(), tip, {1e-3, 0, -1e-2}, 0.0, 1e-3);
    body.step(1e-3);
  };
  for (int k = 1; k < 50; ++k) tick(k);
  palpate_test::AllocationCount const allocations;
  for (int k = 50; k < 300; ++k) tick(k);
  long const count = allocations.count();
  CHECK(count == 0);

  // What would be an infinite force is none: the body must not be fed with it.
  double const huge = std::numeric_limits<double>::max();
  CHECK(coupling.apply(body, tool.contact(), {0.02, 0.02, -huge}, {0, 0, -huge}, 0.0, 1e-3).isZero(0));
}
