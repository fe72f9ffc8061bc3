// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/training/session.hpp>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

namespace palpate_test {

/// Three ticks: above the tissue, in it, through it; configuration, events and the hand's samples, one read of which failed.
inline palpate::Session small_session() {
  using namespace palpate;
  Session session{.seed = Seed{18446744073709551615u}, .device = {.max_force = 3.3, .rate = 1000.0, .reports_velocity = true, .buttons = 2, .continuous_force = 0.88, .mass = 0.045}};
  session.configuration.set("tissue.mass_kg", 0.1).set("cutter", "progressive").set("note", "a line of words, with a comma").set("guided", false);
  session.recording.append({.time = 0.0, .tip = {0.0312, 0.0533, 0.002}});
  session.recording.append(
      {.time = 0.001, .tip = {0.0312, 0.0533, -0.0015}, .depth = 0.0015, .phase = CuttingPhase::indenting, .force = {0, 0, 0.25}, .energy = 1e-5});
  session.recording.append({.time = 0.002, .tip = {1.0 / 3.0, -1e-7, 1e22}, .depth = 0.01, .phase = CuttingPhase::moving, .force = {-3, 0, 4}, .energy = -2.5e-5});
  session.hand = {{.position = {0.0312, 0.0533, 0.002}, .velocity = {0, 0, -3.5}},
                  {.position = {0.0312, 0.0533, -0.0015}, .velocity = {1, 2, 3}, .buttons = 3, .read = DeviceStatus::stale},
                  {.position = {std::numeric_limits<double>::quiet_NaN(), 0, 0}, .read = DeviceStatus::disconnected, .written = DeviceStatus::fault}};
  session.events = phase_events(session.recording);
  session.events.push_back({0.0015, "the teacher spoke"});
  return session;
}

/// Doubles of every magnitude, subnormal ones too.
inline palpate::Session random_session(unsigned seed, int ticks, bool hand) {
  using namespace palpate;
  std::mt19937_64 generator(seed);
  auto const any = [&] {
    for (;;) {
      double const value = std::bit_cast<double>(generator());
      if (std::isfinite(value)) return value;
    }
  };
  bool const turns = hand && seed % 4 == 0, grips = hand && (seed % 4 == 0 || seed % 6 == 0);
  Session session{.seed = Seed{generator()}, .device = {.max_force = 1.5, .rate = 500.0, .reports_velocity = hand, .reports_orientation = turns, .reports_gripper = grips}};
  if (seed % 5 == 0) session.device.max_torque = 0.2;   // N m
  if (seed % 2 == 0) {
    session.device.max_stiffness = any(), session.device.damping = datasheet(std::abs(any())), session.device.friction = reported(0.125), session.device.resolution = 0.0;
    session.device.max_stiffness.value = std::abs(session.device.max_stiffness.value);
    session.device.mass = seed % 4 == 0 ? reported(0.045) : DeviceValue(0.045);
    session.device.max_force = datasheet(3.3);
  }
  for (int i = 0; i < ticks; ++i) {
    Tick tick{.time = i / 500.0, .tip = {any(), any(), any()}, .phase = static_cast<CuttingPhase>(generator() % 3)};
    if (generator() % 2 == 0) {
      tick.depth = any();
      tick.force = {any(), any(), any()};
      tick.energy = any();
      if (seed % 5 == 0) tick.torque = {any(), any(), any()};
      if (seed % 3 == 0) tick.cut_area = any();
    }
    session.recording.append(tick);
    if (hand)
      session.hand.push_back({.position = generator() % 2 == 0 ? tick.tip : Vector3<double>(any(), any(), any()),
                              .velocity = {any(), any(), any()},
                              .orientation = turns && generator() % 2 == 0 ? Eigen::Quaternion<double>(any(), any(), any(), any()) : Eigen::Quaternion<double>::Identity(),
                              .buttons = static_cast<std::uint32_t>(generator() % 3 == 0 ? generator() : 0),
                              .gripper = grips && generator() % 2 == 0 ? any() : 1.0,
                              .read = static_cast<DeviceStatus>(generator() % 4),
                              .written = static_cast<DeviceStatus>(generator() % 4)});
  }
  session.events = phase_events(session.recording);
  return session;
}

}  // namespace palpate_test
