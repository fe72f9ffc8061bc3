// SPDX-License-Identifier: MIT
// The lips of cuts, closed again. Yardsticks: weight, and the depth that bears it; the uncut body under pressure, which a closed cut must not weaken; momentum,
// angular momentum and energy of a free body.
#include "allocation_trap.hpp"
#include "catch.hpp"
#include "contact/blocks.hpp"
#include "cutting/solid_strokes.hpp"

#include <palpate/body/pieces.hpp>
#include <palpate/contact/self_contact.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/symplectic_euler.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <type_traits>
#include <vector>

using namespace palpate;
using namespace palpate_test;

namespace {

/// Cuts through the block along a plane z = const, as far as x.
template <class Body>
void cut_level(Body& body, double z, double as_far_as) {
  VolumeCutter<double> knife;
  stroke(knife, body, Place(-0.1, -0.1, z), Place(-0.1, 0.1, z), Place(0.1 + as_far_as, 0, 0), 60);
}
template <class Body>
Place angular_momentum(Body const& body) {
  Place sum = Place::Zero();
  for (int i = 0; i < body.size(); ++i) sum += body.tissue().mass(i) * Place(body.positions().col(i)).cross(Place(body.velocities().col(i)));
  return sum;
}
template <class Body>
double energy(Body const& body) {
  return body.kinetic_energy() + body.potential_energy();
}

}  // namespace

TEMPLATE_TEST_CASE("a block cut in two rests on its own lower half, as deep as its weight asks", "[contact]", LeapfrogVerlet, BackwardEuler) {
  auto body = solid<double>(block<double>(4, 4, 5, 0.01, {-0.015, -0.015, -0.02}), TestType{}, 2e4);
  for (int i = 0; i < body.size(); ++i)
    if (body.positions()(2, i) < -0.019) body.nail(i);
  cut_level(body, 0.005, 0.1);
  REQUIRE(pieces(body) == 2);
  SelfContact contact(body, {.friction = 0.3}), at_once(body, {.parted_for = 0});
  double const h = std::is_same_v<TestType, BackwardEuler> ? 1e-3 : 1e-4, weight = 1000 * 9.81 * 0.03 * 0.03 * 0.015;
  auto const run = [&](double seconds) {
    for (double t = 0; t < seconds; t += h) {
      contact.apply(body, h);
      REQUIRE(body.advance(h));
    }
  };
  run(0.02);
  at_once.apply(body, h);
  for (auto const& one : {contact, at_once})
    CHECK(std::ranges::all_of(one.regions(), [](auto const& region) { return region.pressure == 0; }));   // fresh: nothing has parted them
  body.set_gravity({0, 0, 1});   // for a moment
  run(0.05);
  body.set_gravity({0, 0, -9.81});
  run(0.8);
  double volume = 0, area = 0;
  Place force = Place::Zero();
  for (auto const& one : contact.regions()) volume += one.volume, area += one.area, force += one.force();
  CHECK(volume == Approx(weight * contact.options().depth / contact.options().pressure).epsilon(0.02));
  CHECK(area == Approx(9e-4).epsilon(0.02));
  CHECK(force.norm() == Approx(weight).epsilon(0.01));
}

TEMPLATE_TEST_CASE("a slit that is closed bears what the uncut block bears", "[contact]", BackwardEuler) {
  auto const mesh = block<double>(5, 7, 5, 0.005, {-0.01, -0.015, -0.01});
  std::array<double, 4> borne{};
  for (std::size_t which = 0; which < 4; ++which) {
    auto body = solid<double>(mesh, TestType{}, 2e4, 5);
    if (which > 0) cut_level(body, 0.0007, 0.004);
    std::vector<int> top;
    for (int i = 0; i < body.size(); ++i) {
      if (body.positions()(2, i) < -0.0099) body.nail(i);
      if (body.positions()(2, i) > 0.0099) top.push_back(i), body.hold(i);
    }
    SelfContact contact(body, {.pressure = 2e4, .depth = which == 2 ? 2.5e-3 : 0.6e-3});
    double const h = 1e-3;
    auto const press = [&](double to, double seconds) {
      std::vector<Place> from;
      for (int const i : top) from.push_back(body.positions().col(i));
      double const rest = 0.01;
      for (double t = h; t < seconds + h / 2; t += h) {
        for (std::size_t k = 0; k < top.size(); ++k) {
          Place goal = from[k];
          goal[2] += (rest + to - from[k][2]) * std::min(1.0, 2 * t / seconds);
          body.drag(top[k], goal);
        }
        if (which >= 2) contact.apply(body, h);
        REQUIRE(body.step(h));
      }
    };
    press(0.002, 0.1);
    press(-0.002, 0.2);
    for (int const i : top) borne[which] += body.reaction(i)[2];
  }
  CAPTURE(borne);
  CHECK(std::abs(borne[1]) < 0.7 * std::abs(borne[0]));   // without contact
  double const soft = 1 - borne[2] / borne[0], stiff = 1 - borne[3] / borne[0];
  CHECK(soft > 0);
  CHECK(soft < 0.07);
  CHECK(stiff > 0);
  CHECK(stiff < soft / 2);
}

TEST_CASE("what a cut gives a body is at most what the cut frees", "[contact]") {
  for (double const stretch : {0.004, -0.003}) {   // m: a wound that gapes, and one that closes at once
    auto body = solid<double>(block<double>(5, 5, 5, 0.005, {-0.01, -0.01, -0.01}), LeapfrogVerlet{}, 2e4, 0, 0);
    for (int i = 0; i < body.size(); ++i) {
      Place x = body.positions().col(i);
      body.hold(i);
      if (x[2] > 0.0099 || x[2] < -0.0099) body.nail(i);
      x[2] *= 1 + stretch / 0.02;
      body.drag(i, x), body.release(i);
    }
    double const before = body.potential_energy();
    cut_level(body, 0.0013, 0.005);
    SelfContact contact(body, {.pressure = 2e4, .friction = 0});
    double most = 0, gained = 0;
    double const h = 2.5e-5;
    for (int k = 0; k < 4000; ++k) {
      contact.apply(body, h);
      REQUIRE(body.step(h));
      most = std::max(most, energy(body) / before), gained = std::max(gained, body.kinetic_energy() / before);
    }
    CAPTURE(stretch, most, gained, before);
    CHECK(gained > 1e-3);
    CHECK(most < 1.001);
  }
}

TEST_CASE("lips that clap together keep momentum and make no energy", "[contact]") {
  auto body = solid<double>(block<double>(6, 4, 5, 0.005, {-0.0125, -0.0075, -0.01}), SymplecticEuler{}, 2e4, 0, 0);
  cut_level(body, 0.0013, 0.005);
  for (int i = 0; i < body.size(); ++i) {   // a mouth that opens; then it claps, and opens again
    Place const x = body.positions().col(i);
    throw_particle(body, i, Place(0.1, 0.2, -0.1) + Place(0, 0, (x[2] > 0.0013 ? 0.6 : -0.6) * std::max(0.0, 0.005 - x[0]) / 0.0175) + Place(0, 0, 2).cross(x));
  }
  SelfContact contact(body, {.pressure = 2e4, .friction = 0.3});
  double const begun = energy(body), h = 2e-5;
  Place const start = momentum(body), spin = angular_momentum(body);
  int pressed = 0;
  double most = 0;
  for (int k = 0; k < 15000; ++k) {
    contact.apply(body, h);
    REQUIRE(body.step(h));
    pressed += std::ranges::any_of(contact.regions(), [](auto const& one) { return one.pressure > 0; });
    most = std::max(most, energy(body) / begun);
  }
  CHECK(pressed > 1000);
  CHECK((momentum(body) - start).norm() < 1e-11 * start.norm());
  CHECK((angular_momentum(body) - spin).norm() < 1e-9 * spin.norm());
  CHECK(most < 1.005);   // that integrator's own energy sways by h
}

TEST_CASE("what lies on itself after a cut is borne while it slides on, by a triangle and more", "[contact]") {
  auto body = solid<double>(block<double>(6, 4, 5, 0.005, {-0.0125, -0.0075, -0.01}), BackwardEuler{}, 2e4);
  for (int i = 0; i < body.size(); ++i)
    if (body.positions()(2, i) < -0.0099) body.nail(i);
  cut_level(body, 0.0013, 0.1);
  SelfContact contact(body, {.friction = 0});
  double const h = 1e-3;
  double const weight = 1000 * 9.81 * 0.025 * 0.015 * (0.01 - 0.0013);
  double least = 1, most = 0;
  for (int k = 0; k < 440; ++k) {
    body.set_gravity(k < 50 ? Place(0, 0, 1) : Place(k < 200 ? 0.0 : 0.3, 0, -9.81));
    contact.apply(body, h);
    REQUIRE(body.step(h));
    double pressed = 0;
    for (auto const& one : contact.regions()) pressed += one.force().norm();
    if (k > 190) least = std::min(least, pressed), most = std::max(most, pressed);
  }
  int const last = body.size() - 1;
  CHECK(body.positions()(0, last) - body.tissue().rest_position(last)[0] > 0.008);
  CHECK(least > 0.98 * weight);
  CHECK(most < 1.02 * weight);
}

TEST_CASE("a piece that was cut off presses nothing where it is laid aside, nor does a flap that is folded back", "[contact]") {
  auto put = [](auto& body, int i, Place const& at) { body.hold(i), body.drag(i, at), body.release(i); };
  auto const pressed = [](auto const& contact) {
    double sum = 0;
    for (auto const& one : contact.regions()) sum += one.force().norm();
    return sum;
  };
  auto body = solid<double>(block<double>(4, 4, 5, 0.01, {-0.015, -0.015, -0.02}), BackwardEuler{}, 2e4);
  cut_level(body, 0.005, 0.1);
  SelfContact contact(body);
  std::vector<int> upper = pieces_of(body)[1];
  if (body.tissue().rest_position(upper[0])[2] < 0.004) upper = pieces_of(body)[0];
  auto const lay = [&](Place const& by) {
    for (int const i : upper) put(body, i, Place(body.tissue().rest_position(i) + by));
  };
  for (Place const& by : {Place(0, 0, 0.05), Place(0.1, 0, 0), Place(0.1, 0, -0.03), Place(0.04, 0, -0.002), Place(0, 0, 0.05), Place(0, 0, -5e-4)}) {
    lay(by);
    for (int k = 0; k < 15; ++k) contact.apply(body, 1e-3);
    CHECK((pressed(contact) > 0) == (by[2] == -5e-4));   // back on its twin from above it does
  }
  auto flap = solid<double>(block<double>(9, 4, 4, 0.005, {-0.02, -0.0075, -0.0075}), BackwardEuler{}, 2e4);
  cut_level(flap, 0.0031, 0.005);
  SelfContact folded(flap);
  for (double const turned : {40.0, 60.0, 100.0, 140.0, 170.0, 190.0, 225.0, 260.0}) {
    double const by = turned * std::numbers::pi / 180, back = 0.0049;
    for (int i = 0; i < flap.size(); ++i) {
      Place const x = flap.tissue().rest_position(i);
      bool const is_below = std::ranges::any_of(flap.tissue().topology().tetrahedra_at(i), [&](int t) {
        return std::ranges::any_of(flap.tissue().topology().corners(t), [&](int c) { return flap.tissue().rest_position(c)[2] < 0.003; });
      });
      if (x[0] < back && !is_below) put(flap, i, Place(back + (x[0] - back) * std::cos(by) + (x[2] - 0.0031) * std::sin(by), x[1], 0.0031 - (x[0] - back) * std::sin(by) + (x[2] - 0.0031) * std::cos(by)));
    }
    for (int k = 0; k < 15; ++k) folded.apply(flap, 1e-3);
    CHECK(pressed(folded) == 0);
  }
}

TEST_CASE("a wound of two crossing cuts that is pressed together bears and comes to rest", "[contact]") {
  std::array<double, 3> borne{};
  for (std::size_t which = 0; which < 3; ++which) {   // uncut, cut without contact, with it
    auto body = solid<double>(block<double>(6, 6, 5, 0.005, {-0.0125, -0.0125, -0.01}), BackwardEuler{}, 2e4, 5);
    if (which > 0) {
      VolumeCutter<double> one, other;
      stroke(one, body, Place(0.0007, -0.1, -0.003), Place(0.0007, 0.1, -0.003), Place(0, 0, 0.1), 60);
      one.lift(body);
      stroke(other, body, Place(-0.1, 0.0011, -0.003), Place(0.1, 0.0011, -0.003), Place(0, 0, 0.1), 60);
    }
    std::vector<int> sides;
    for (int i = 0; i < body.size(); ++i)
      if (Place const x = body.tissue().rest_position(i); std::max(std::abs(x[0]), std::abs(x[1])) > 0.0124) sides.push_back(i), body.hold(i);
    SelfContact contact(body, {.pressure = 2e4});
    double now = 0;
    for (double const to : {0.15, -0.12}) {
      double const from = now;
      for (int k = 1; k <= 300; ++k) {
        now = from + (to - from) * std::min(1.0, k / 100.0);
        for (int const i : sides) {
          Place const x = body.tissue().rest_position(i);
          body.drag(i, Place(x[0] * (1 + now), x[1] * (1 + now), x[2]));
        }
        if (which == 2) contact.apply(body, 1e-3);
        REQUIRE(body.step(1e-3));
      }
    }
    CHECK(body.velocities().colwise().norm().maxCoeff() < 1e-6);
    for (int const i : sides)
      if (body.tissue().rest_position(i)[0] > 0.0124) borne[which] += body.reaction(i)[0];
  }
  CAPTURE(borne);
  CHECK(borne[1] / borne[0] < 0.85);
  CHECK(borne[2] / borne[0] > borne[1] / borne[0] + 0.04);
  CHECK(borne[2] / borne[0] < 1);
}

TEMPLATE_TEST_CASE("closed lips go on as they did after they are restored, and allocate nothing", "[contact]", LeapfrogVerlet, BackwardEuler) {
  REQUIRE(trap_works());
  auto body = solid<double>(block<double>(5, 4, 5, 0.005, {-0.01, -0.0075, -0.01}), TestType{}, 1e4, 1);
  for (int i = 0; i < body.size(); ++i)
    if (body.positions()(2, i) < -0.0099) body.nail(i);
  cut_level(body, 0.0013, 0.005);
  SelfContact contact(body, {.friction = 0.4});
  double const h = std::is_same_v<TestType, BackwardEuler> ? 1e-3 : 1e-4;
  auto const advance = [&](double seconds) {
    for (double t = h / 2; t < seconds; t += h) contact.apply(body, h), body.advance(h);
  };
  body.set_gravity({0, 0, 3}), advance(0.04);
  body.set_gravity({1, 0, -9.81}), advance(0.005);
  auto const early = body.save();
  auto const parted = contact.save();
  advance(0.1);
  REQUIRE(std::ranges::any_of(contact.regions(), [](auto const& one) { return one.pressure > 0; }));
  Matrix3X<double> const once = body.positions();
  body.restore(early), contact.restore(parted, body);
  advance(0.1);
  CHECK((body.positions() - once).cwiseAbs().maxCoeff() == 0);
  auto const saved = body.save();
  auto const anchors = contact.save();
  advance(0.02);
  Matrix3X<double> const later = body.positions();
  body.restore(saved), contact.restore(anchors, body);
  advance(h);
  AllocationCount const allocations;
  advance(0.02 - h);
  CHECK(allocations.count() == 0);
  CHECK((body.positions() - later).cwiseAbs().maxCoeff() == 0);
}
