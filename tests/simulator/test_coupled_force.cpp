// SPDX-License-Identifier: MIT
// Yardstick: springs in series, at what the device says of itself; the puppet's local model is written by hand.
#include "catch.hpp"

#include "simulator/puppet.hpp"

#include <palpate/haptics/coupled_force.hpp>
#include <palpate/simulator/servo_loop.hpp>

#include <algorithm>
#include <limits>

using namespace palpate;
using palpate_test::Puppet;
using palpate_test::Strings;

TEST_CASE("a servo tells a coupled force its device, and never arms on it within the tissue", "[simulator][servo_loop]") {
  Strings<double> strings;
  strings.capabilities = {.max_force = 3.0, .rate = 1000.0, .moves_a_hand = true, .max_stiffness = 400.0};
  LocalModel<double> model;
  model.phase = CuttingPhase::indenting;
  model.surface.sequence = 1;
  model.surface.patch.stiffness = 1200.0;
  ServoOptions options;
  options.safety.dead_man = 0;
  ServoLoop<Puppet<double>, CoupledForce<ProxyForce<double>>, double> servo(
      Puppet<double>(strings), CoupledForce(ProxyForce<double>({.surface = SurfaceKind::plane, .max_stiffness = 1200.0, .handover = 1})), options);
  servo.begin_session(1000.0);
  CHECK(servo.force().law().stiffness == 400.0);
  int ticks = 0;
  auto const hold = [&](double height, int count) {
    double most = 0;
    for (int k = 0; k < count; ++k) {
      strings.next.position = {0, 0, height};
      servo.read(1e-3);
      servo.respond(model, 1e-3 * ++ticks);
      most = std::max(most, strings.felt.force.norm());
    }
    return most;
  };
  CHECK(hold(-0.002, 1000) == 0.0);   // it would be 0.6 N
  CHECK(hold(0.001, 1000) == 0.0);
  for (int k = 1; k <= 20; ++k) hold(0.001 - 1e-4 * k, 20);   // 5 mm/s, 1 mm deep
  hold(-0.001, 1000);
  CHECK(strings.felt.force.z() == Approx(0.3).epsilon(1e-3));
}

TEST_CASE("after ticks in which nothing could be read a coupled force begins with its tool at the device", "[simulator][servo_loop]") {
  Strings<double> strings;
  strings.capabilities = {.max_force = 30.0, .rate = 1000.0, .moves_a_hand = false, .max_stiffness = 400.0, .max_damping = 2.0, .mass = 0.045};
  LocalModel<double> model;
  model.surface.sequence = 1;
  ServoLoop<Puppet<double>, CoupledForce<ProxyForce<double>>, double> servo(Puppet<double>(strings), CoupledForce(ProxyForce<double>({.handover = 1})));
  servo.begin_session(1000.0);
  auto const tick = [&](double height) {
    strings.next.position = {0, 0, height};
    servo.read(1e-3);
    servo.respond(model, 0.0);
    return strings.felt.force.norm();
  };
  for (int k = 0; k < 100; ++k) CHECK(tick(0.01) < 1e-9);
  for (int k = 0; k < 5; ++k) CHECK(tick(std::numeric_limits<double>::quiet_NaN()) == 0.0);
  CHECK(tick(0.05) < 1e-9);   // with the tool where it was it would be pulled with 400 N/m over 4 cm
  CHECK(servo.force().tool().position.z() == Approx(0.05));
  CHECK(tick(0.06) > 1.0);   // without a pause it is
}
