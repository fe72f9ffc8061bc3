// SPDX-License-Identifier: MIT
#pragma once

#include "control.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace fake_libhd {

using Triple = std::array<double, 3>;

inline Triple operator+(Triple const& a, Triple const& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
inline Triple operator*(double s, Triple const& a) { return {s * a[0], s * a[1], s * a[2]}; }
inline double norm(Triple const& a) { return std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]); }

/// Where the tip of a Touch is for its three joints, and back: two links of 133.35 mm on a turret. mm, rad.
///   x = −sin θ₁ r,  y = L sin θ₂ − L cos θ₃ + L − 110,  z = cos θ₁ r − L − 35,  r = L cos θ₂ + L sin θ₃
struct Kinematics {
  static constexpr double link = 133.35, height = 110.0, depth = 35.0;

  static Triple tip(Triple const& joint) {
    double const r = link * std::cos(joint[1]) + link * std::sin(joint[2]);
    return {-std::sin(joint[0]) * r, link * std::sin(joint[1]) - link * std::cos(joint[2]) + link - height, std::cos(joint[0]) * r - link - depth};
  }
  static Triple joints(Triple const& tip) {
    double const ahead = tip[2] + link + depth, r = std::hypot(tip[0], ahead), up = tip[1] + height - link;
    double const reach = std::min(std::hypot(r, up), 2 * link), direction = std::atan2(up, r), opening = std::acos(reach / (2 * link));
    return {std::atan2(-tip[0], ahead), direction + opening, direction - opening + std::acos(-1.0) / 2};
  }
};

/// Where the hand wants to be, in mm about the middle of the workspace: it palpates at y = 0 and below, comes back, goes in, draws a stroke to the
/// right and leaves. From rest to rest between the points, with the smallest jerk.
inline Triple wanted(double seconds) {
  struct Point {
    double time;
    Triple place;
  };
  static constexpr Point path[] = {{0.6, {-25, 25, 0}}, {1.5, {-25, -9, 0}}, {1.7, {-25, -9, 0}}, {2.4, {-25, 8, 0}},
                                   {3.4, {-25, -16, 0}}, {6.4, {25, -16, 0}}, {7.2, {25, 30, 0}}};
  Point before{0.0, path[0].place};
  for (Point const& point : path) {
    if (seconds < point.time) {
      double const u = (seconds - before.time) / (point.time - before.time), s = u * u * u * (10 - u * (15 - 6 * u));
      return (1 - s) * before.place + s * point.place;
    }
    before = point;
  }
  return before.place;
}

/// A Touch in a hand: a mass on a spring, with a firm grip.
struct Device {
  static constexpr double mass = 0.2, stiffness = 1500.0, damping = 30.0;   // kg, N/m, N·s/m
  static constexpr double max_force = 3.3, ramp_rate = 15.0, off_time = 0.1;   // N, N/s, s

  bool open = false, gone = false, in_frame = false;
  std::uint64_t framed_in = 0;        // tick + 1
  bool motors = false, ramping = true, clamping = true, one_frame = true;
  Triple tip = wanted(0.0), velocity{};   // mm, mm/s
  Triple force{}, torque{};           // N, N·m: set in this frame
  bool force_set = false;
  Triple felt{};                      // N, held from frame to frame
  double since_on = 0.0, off_for = 0.0, script = -1.0;   // s
  unsigned calibration = 0x5000;
  bool off_by_jump = false;

  // Latched at the frame's beginning.
  Triple reported{}, reported_velocity{}, joints{};
  std::array<double, 16> transform{};

  void begin(Plan const& plan) {
    if (motors && script < 0.0) script = plan.script_begins;   // the hand begins when it could feel something
    joints = Kinematics::joints(tip);
    for (double& joint : joints) joint = plan.encoder * std::round(joint / plan.encoder);
    reported = Kinematics::tip(joints);
    if (off_by_jump) reported[0] += plan.jump;
    reported_velocity = velocity;
    // Tilted like a pen, turned with the turret, and as far from orthogonal as real ones are.
    double const ct = std::cos(0.5), st = std::sin(0.5), cy = std::cos(-joints[0]), sy = std::sin(-joints[0]);
    double const rows[3][3] = {{cy * 1.0002, sy * st, sy * ct}, {0.0, ct, -st}, {-sy, cy * st, cy * ct * 0.9999}};
    for (std::size_t r = 0; r < 3; ++r) {
      for (std::size_t c = 0; c < 3; ++c) transform[plan.transform_by_rows ? 4 * r + c : 4 * c + r] = rows[r][c];
      transform[plan.transform_by_rows ? 4 * r + 3 : 12 + r] = reported[r];
      transform[plan.transform_by_rows ? 12 + r : 4 * r + 3] = 0.0;
    }
    transform[15] = 1.0;
    force = torque = {};
    force_set = false;
  }

  /// What the motors make of the frame; false: more than they may give.
  bool end(double h) {
    bool const on = motors && off_for <= 0.0;
    since_on = on ? since_on + h : 0.0;
    Triple out = on ? force : Triple{};
    bool within = true;
    if (double const size = norm(out); size > max_force * (1 + 1e-9)) {
      if (clamping) {
        out = (max_force / size) * out;
      } else {
        within = false;
        off_for = off_time;
        out = {};
      }
    }
    if (double const size = norm(out), most = ramp_rate * since_on; ramping && size > most) out = (most / size) * out;
    felt = out;
    return within;
  }

  /// One tick of the hand.
  void move(Plan const& plan, double h) {
    off_for = std::max(0.0, off_for - h);
    if (!motors) felt = {};
    if (plan.hand_is_held) {
      velocity = {};
      return;
    }
    double const now = std::max(0.0, script);
    Triple const here = wanted(now), next = wanted(now + h), speed = (1 / h) * (next + -1.0 * here);
    for (std::size_t k = 0; k < 3; ++k) {
      double const pull = felt[k] - 1e-3 * (stiffness * (tip[k] - next[k]) + damping * (velocity[k] - (script < 0.0 ? 0.0 : speed[k])));
      velocity[k] += 1e3 * h * pull / mass;
      tip[k] += h * velocity[k];
    }
    if (script >= 0.0) script += h;
  }
};

}  // namespace fake_libhd
