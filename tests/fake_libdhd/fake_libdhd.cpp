// SPDX-License-Identifier: MIT
// A stand-in for libdhd with a hand that follows a curve: what the adapter calls, and stricter about it than the vendor's. Ids are not indices, calls
// need an open device, forces need motors that are on and stay below the limit. Its clock is a millisecond a sample. No motor moves.
#include "control.hpp"

#include <cmath>
#include <cstddef>
#include <limits>

#define PALPATE_FAKE_EXPORT __attribute__((visibility("default")))

using fake_libdhd::Call;

namespace {

constexpr int first_id = 3;

fake_libdhd::Control control;
int index_open = -1;
int last_code = 0;

void violate(char const* what) {
  ++control.violations;
  control.violation = what;
}

int fail(int code) {
  last_code = code;
  return -1;
}

bool is_gone() { return control.plan.vanishes_at > 0 && control.samples >= control.plan.vanishes_at; }

/// 0, or the error that the plan or the rules have for this call.
int refusal(Call call, char id) {
  ++control.calls;
  if (!control.open || id != first_id + index_open) {
    violate("a call for a device that is not open");
    return fail(15);
  }
  if (is_gone()) return fail(2);
  auto const& plan = control.plan;
  if (call != Call::none && call == plan.fails && control.samples >= plan.fails_from && control.samples < plan.fails_until) return fail(plan.code);
  return 0;
}

}  // namespace

extern "C" {

PALPATE_FAKE_EXPORT fake_libdhd::Control* fake_libdhd_control() { return &control; }
PALPATE_FAKE_EXPORT void fake_libdhd_reset() {
  control = {};
  index_open = -1;
  last_code = 0;
}

PALPATE_FAKE_EXPORT int dhdOpenID(char index) {
  ++control.calls;
  if (control.plan.fails == Call::open) return fail(control.plan.code);
  if (index < 0 || index >= control.plan.devices) return fail(5);
  if (control.open && index == index_open) return first_id + index;   // as the vendor's
  if (control.open) violate("the stand-in knows one open device at a time");
  index_open = index;
  control.open = true;
  control.motors = false;
  control.samples = 0;
  if (control.opens == 0) control.limit = control.plan.limit;   // for the library's life, not the device's
  ++control.opens;
  return first_id + index;
}

PALPATE_FAKE_EXPORT int dhdClose(char id) {
  ++control.calls;
  if (!control.open || id != first_id + index_open) {
    violate("a device is closed that is not open");
    return fail(15);
  }
  if (control.motors && !is_gone()) violate("a device is closed with its motors on");
  control.open = control.motors = false;
  ++control.closes;
  return 0;
}

PALPATE_FAKE_EXPORT int dhdEnableForce(unsigned char on, char id) {
  if (int const code = refusal(on != 0 ? Call::enable : Call::none, id)) return code;
  if (on > 1) violate("the motors are switched neither on nor off");
  control.motors = on != 0;
  control.first_sent = -1.0;
  for (double& force : control.force) force = 0.0;
  for (double& torque : control.torque) torque = 0.0;
  return 0;
}

PALPATE_FAKE_EXPORT int dhdGetStatus(int* values, char id) {
  if (int const code = refusal(Call::status, id)) return code;
  for (int k = 0; k < 17; ++k) values[k] = 0;
  values[0] = values[1] = values[2] = 1;
  values[3] = control.plan.uncalibrated ? 1 : 0;
  values[5] = control.motors && control.plan.off_by == 0 ? 1 : 0;
  values[9] = control.plan.in_error ? 1 : 0;
  values[14] = control.plan.off_by;
  return 0;
}

PALPATE_FAKE_EXPORT int dhdGetPositionAndOrientationFrame(double* x, double* y, double* z, double (*rows)[3], char id) {
  ++control.samples;
  if (int const code = refusal(Call::pose, id)) return code;
  auto const& plan = control.plan;
  bool const repeated = plan.repeats_from > 0 && control.samples >= plan.repeats_from && control.samples < plan.repeats_from + plan.repeats;
  double const t = 1e-3 * static_cast<double>(control.samples), w[3] = {6.0, 9.0, 4.0}, a[3] = {0.02, 0.01, 0.03};
  if (!repeated)
    for (std::size_t k = 0; k < 3; ++k) {
      control.position[k] = a[k] * std::sin(w[k] * t);
      control.velocity[k] = a[k] * w[k] * std::cos(w[k] * t);
    }
  if (plan.jumps_at > 0 && control.samples >= plan.jumps_at && !repeated) control.position[1] += 0.02;
  long const since = control.samples - plan.not_a_number_from;
  bool const broken = since >= 0 && since < plan.not_a_number;
  *x = control.position[0];
  *y = broken ? std::numeric_limits<double>::quiet_NaN() : control.position[1];
  *z = control.position[2];
  double const quarter[3][3] = {{0, -1, 0}, {1, 0, 0}, {0, 0, 1}};   // about z, which is up
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) rows[row][column] = quarter[row][column];
  return repeated ? 1 : 0;
}

PALPATE_FAKE_EXPORT int dhdGetLinearVelocity(double* x, double* y, double* z, char id) {
  if (int const code = refusal(Call::velocity, id)) return code;
  *x = control.velocity[0], *y = control.velocity[1], *z = control.velocity[2];
  return 0;
}
PALPATE_FAKE_EXPORT int dhdGetAngularVelocityRad(double* x, double* y, double* z, char id) {
  if (int const code = refusal(Call::none, id)) return code;
  if (!control.plan.wrist) violate("a wrist's velocity is asked for where there is none");
  *x = 0.1, *y = 0.2, *z = 0.3;
  return 0;
}
PALPATE_FAKE_EXPORT unsigned dhdGetButtonMask(char id) { return refusal(Call::none, id) == 0 ? 1u : 0u; }

PALPATE_FAKE_EXPORT int dhdSetForceAndTorqueAndGripperForce(double fx, double fy, double fz, double tx, double ty, double tz, double grip, char id) {
  if (int const code = refusal(Call::forces, id)) return code;
  double const force[3] = {fx, fy, fz}, torque[3] = {tx, ty, tz};
  double const norm = std::hypot(fx, fy, fz), turning = std::hypot(tx, ty, tz);
  if (!control.motors) {
    violate("a force is sent while the motors are off");
    return fail(19);
  }
  if (!std::isfinite(norm) || !std::isfinite(turning) || grip != 0.0) violate("a force is not finite, or the gripper's");
  if (turning != 0.0 && !control.plan.active_wrist) violate("a torque is sent to a wrist without motors");
  if (control.limit >= 0.0 && norm > control.limit * (1.0 + 1e-12)) violate("a force is above the limit");
  if (control.first_sent < 0.0) control.first_sent = norm;
  ++control.sent;
  for (std::size_t k = 0; k < 3; ++k) {
    control.force[k] = control.plan.off_by == 0 ? force[k] : 0.0;
    control.torque[k] = control.plan.off_by == 0 ? torque[k] : 0.0;
  }
  return norm > control.plan.saturates_at ? 2 : 0;
}

PALPATE_FAKE_EXPORT double dhdGetMaxForce(char id) { return refusal(Call::none, id) == 0 ? control.limit : -1.0; }
PALPATE_FAKE_EXPORT int dhdSetMaxForce(double limit, char id) {
  if (int const code = refusal(Call::none, id)) return code;
  control.limit = limit;
  return 0;
}
PALPATE_FAKE_EXPORT bool dhdHasWrist(char id) { return refusal(Call::none, id) == 0 && control.plan.wrist; }
PALPATE_FAKE_EXPORT bool dhdHasActiveWrist(char id) { return refusal(Call::none, id) == 0 && control.plan.active_wrist; }
PALPATE_FAKE_EXPORT char const* dhdGetSystemName(char id) { return refusal(Call::none, id) == 0 ? control.plan.model : nullptr; }
PALPATE_FAKE_EXPORT int dhdGetSerialNumber(unsigned short* serial, char id) {
  if (int const code = refusal(Call::none, id)) return code;
  *serial = 4711;
  return 0;
}
PALPATE_FAKE_EXPORT void dhdGetSDKVersion(int* major, int* minor, int* release, int* revision) {
  *major = 3, *minor = 17, *release = 5, *revision = 0;
}

PALPATE_FAKE_EXPORT int dhdErrorGetLast() { return last_code; }
PALPATE_FAKE_EXPORT char const* dhdErrorGetStr(int code) {
  switch (code) {
    case 2: return "communication error";
    case 5: return "no device found";
    case 8: return "geometry error";
    case 15: return "invalid index";
    case 20: return "device in use";
    default: return "another error";
  }
}

}  // extern "C"
