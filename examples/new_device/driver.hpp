// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

// A driver as makers ship them, made up: C functions, millimetres, z up, an error number. Yours takes its place.
inline int maker_is_open = 0;
inline int maker_motors = 0;
inline long maker_samples = 0;
inline double maker_force[3] = {0, 0, 0};   // N

inline int maker_open() { return maker_is_open = 1, 0; }
inline void maker_close() { maker_is_open = maker_motors = 0; }
inline char const* maker_serial() { return "0042"; }
inline int maker_enable_motors(int on) { return maker_is_open == 0 ? 3 : (maker_motors = on, 0); }
/// 0: a new sample; 1: the last one again; 2: the cable; 3: not open.
inline int maker_get(double position_mm[3], double velocity_mm_s[3], int* buttons) {
  if (maker_is_open == 0) return 3;
  double const t = static_cast<double>(maker_samples++) / 1000.0;   // a hand that swings to the right and back
  position_mm[0] = 30 * std::sin(t), position_mm[1] = 0, position_mm[2] = 10;
  velocity_mm_s[0] = 30 * std::cos(t), velocity_mm_s[1] = velocity_mm_s[2] = 0;
  *buttons = 0;
  return 0;
}
inline int maker_set_force(double const force_n[3]) {
  if (maker_is_open == 0) return 3;
  for (int axis = 0; axis < 3; ++axis) maker_force[axis] = maker_motors != 0 ? force_n[axis] : 0;
  return 0;
}
