// SPDX-License-Identifier: MIT
// A device of one's own needs palpate/extend/device.hpp and nothing else. Yardstick: the battery, which sums up velocities, and Hooke's law.
#include <palpate/extend/device.hpp>

#include "catch.hpp"

#include <palpate/cutting/no_cutter.hpp>
#include <palpate/extend/force.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <cmath>
#include <utility>

/// A hand that goes up and down by 10 mm, once a second.
class Pendulum {
 public:
  palpate::Capabilities capabilities() const { return {.max_force = 3.3, .rate = 1000.0, .reports_velocity = true, .moves_a_hand = false}; }   // N, Hz

  palpate::DeviceStatus read(palpate::DeviceState<double>& state) noexcept {
    double const turn = 6.283185307179586, t = 1e-3 * static_cast<double>(tick_++);
    state.position = {0.021, 0.02, 0.01 * std::cos(turn * t)};             // m
    state.velocity = {0.0, 0.0, -0.01 * turn * std::sin(turn * t)};        // m/s
    return palpate::DeviceStatus::ok;
  }
  palpate::DeviceStatus write(palpate::Wrench<double> const& wrench) noexcept {
    felt_ = wrench.force;                                                  // N
    return palpate::DeviceStatus::ok;
  }

  palpate::DeviceDescription description() const { return {.model = "pendulum"}; }   // optional

 private:
  long tick_ = 0;
  palpate::Vector3<double> felt_ = palpate::Vector3<double>::Zero();
};
static_assert(palpate::HapticDevice<Pendulum> && palpate::DescribesItself<Pendulum>);

static_assert(!palpate::OpensAndCloses<Pendulum> && !palpate::DescribesItself<palpate::testing::DeviceArchetype<double>>);

using namespace palpate;

TEST_CASE("a device of one's own keeps the laws of devices") {
  Pendulum pendulum;
  CHECK(testing::to_text(testing::check_device(pendulum, {.force = 3.0})) == "");
  testing::DeviceArchetype<double> least;
  CHECK(testing::to_text(testing::check_device(least)) == "");
  testing::DeviceArchetype<float> single;
  CHECK(testing::to_text(testing::check_device<float>(single)) == "");
}

TEST_CASE("a device and a force of one's own make a simulator") {
  MassSpring<double> tissue(make_grid<double>(5, 5, 0.01), {.mass = {.total = 0.1}, .link = {.stiffness = 50.0, .damping = 0.1}});
  tissue.nail({0, 4, 20, 24});
  Simulator simulator(Pendulum{}, SoftBody(std::move(tissue)), NoCutter<double>{}, testing::ForceArchetype<double>{});
  CHECK(simulator.run(1.0).largest_force() == Approx(100.0 * 0.01).epsilon(1e-9));   // N/m · m, at the lowest place, half a second in
}

TEST_CASE("a device that is wrong is told so") {
  struct Millimetres : Pendulum {
    DeviceStatus read(DeviceState<double>& state) noexcept {
      auto const status = Pendulum::read(state);
      state.velocity *= 1000.0;
      return status;
    }
  } device;
  CHECK_THAT(testing::to_text(testing::check_device(device)), says("velocities do not fit positions", "m/s"));
}
