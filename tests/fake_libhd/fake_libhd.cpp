// SPDX-License-Identifier: MIT
// A stand-in for libHD with a Touch and a hand behind each name: what the adapter calls, and stricter about it than the vendor's. Frames are paired
// and one a tick, parameters have types, errors are a stack, and while the scheduler runs only its thread may call. Its clock is virtual, a tick for
// each palpate_advance_clock(1), or, with PALPATE_FAKE_LIBHD_CLOCK=real or for a self-clocked run, the wall's. No motor moves.
#include "library.hpp"

#include <algorithm>
#include <chrono>
#include <clocale>
#include <cstring>
#include <limits>
#include <mutex>
#include <thread>

#include <locale.h>

using namespace fake_libhd;

namespace {

/// A parameter that may be asked for now, in this type, of the current device.
Parameter const* permitted(unsigned number, unsigned type, char const* call) {
  if (!legal(call)) return nullptr;
  Device* const device = current();
  if (device == nullptr) {
    fail(0x104, lib().current);
    return nullptr;
  }
  Parameter const* const parameter = find_parameter(number);
  if (parameter == nullptr || (number == 0x2053 && !plan().turns)) {
    fail(0x100, lib().current);
    return nullptr;
  }
  unsigned types = parameter->types;
  if (number == 0x2600 && plan().rate_is_double) types = as_double;
  if ((types & type) == 0) {
    fail(0x103, lib().current);
    return nullptr;
  }
  bool const missed = (number == 0x2052 || number == 0x2053) && plan().misses_at != 0 && lib().control.ticks.load() == plan().misses_at;
  if (parameter->of_state && (!device->in_frame || missed)) {
    fail(0x402, lib().current);
    return nullptr;
  }
  return parameter;
}

/// In this thread, whatever the program's is.
bool in_plain_locale() { return ::uselocale(nullptr) != LC_GLOBAL_LOCALE && std::strcmp(std::localeconv()->decimal_point, ".") == 0; }

template <class Real>
void get_real(unsigned number, unsigned type, Real* out, char const* call) {
  Parameter const* const parameter = permitted(number, type, call);
  if (parameter == nullptr) return;
  Device const& d = *current();
  double values[16] = {};
  switch (number) {
    case 0x2050: std::copy(d.reported.begin(), d.reported.end(), values); break;
    case 0x2051: std::copy(d.reported_velocity.begin(), d.reported_velocity.end(), values); break;
    case 0x2052: std::copy(d.transform.begin(), d.transform.end(), values); break;
    case 0x2053: values[1] = plan().turning; break;
    case 0x2100: std::copy(d.joints.begin(), d.joints.end(), values); break;
    case 0x2550:
    case 0x2551: {
      double const box[6] = {-80, -60, -35, 80, 60, 35};
      std::copy(box, box + 6, values);
      break;
    }
    case 0x2600: values[0] = lib().rate; break;
    case 0x2602: values[0] = 0.5; break;     // N/mm
    case 0x2603: values[0] = Device::max_force; break;
    case 0x2604: values[0] = 0.88; break;
    case 0x2608: values[0] = Device::ramp_rate; break;
    case 0x2609: values[0] = 0.003; break;   // N/(mm/s)
    case 0x2622: values[0] = 188.0; break;   // mN·m
    default: break;
  }
  std::uint64_t const tick = lib().control.ticks.load(), first = plan().not_a_number_from;
  if (number == 0x2050 && plan().not_a_number_ticks > 0 && tick >= first && tick < first + plan().not_a_number_ticks)
    values[1] = std::numeric_limits<double>::quiet_NaN();
  for (int k = 0; k < parameter->count; ++k) out[k] = static_cast<Real>(values[k]);
}

}  // namespace

extern "C" {

PALPATE_FAKE_EXPORT unsigned hdInitDevice(char const* name) {
  Library& l = lib();
  if (!legal("hdInitDevice")) return nobody;
  l.control.inits.fetch_add(1);
  l.control.init_in_plain_locale.store(in_plain_locale());
  if (plan().init_milliseconds > 0) std::this_thread::sleep_for(std::chrono::milliseconds(plan().init_milliseconds));
  if (plan().init_failures != 0) {
    if (plan().init_failures > 0) --plan().init_failures;
    fail(plan().init_error, nobody);
    return nobody;
  }
  if (plan().password != nullptr && !l.licensed) {
    fail(0x600, nobody);
    return nobody;
  }
  if (std::strcmp(std::localeconv()->decimal_point, ".") != 0) {   // its file of the device can not be read then
    fail(0x300, nobody);
    return nobody;
  }
  unsigned index = nobody;
  if (name == nullptr) {
    if (plan().takes_no_name) index = 0;
  } else {
    for (unsigned i = 0; i < 4; ++i)
      if (plan().names[i] != nullptr && std::strcmp(plan().names[i], name) == 0) index = i;
  }
  if (index == nobody) {
    fail(0x303, nobody);
    return nobody;
  }
  Device& device = l.devices[index];
  if (device.open) {
    fail(0x301, index);
    return nobody;
  }
  device = Device{};
  device.open = true;
  device.calibration = plan().calibration;
  device.off_by_jump = plan().jump != 0.0 && plan().calibration != 0x5000;
  l.current = index;
  return index;
}

PALPATE_FAKE_EXPORT void hdDisableDevice(unsigned handle) {
  Library& l = lib();
  if (!legal("hdDisableDevice")) return;
  if (l.running.load()) violate("a device is disabled while the scheduler runs");
  l.control.disables.fetch_add(1);
  if (handle >= 4 || !l.devices[handle].open) return fail(0x104, handle);
  l.devices[handle].open = false;
  for (std::size_t k = 0; k < 3; ++k) l.control.seen[handle].force[k].store(0.0);
  l.control.seen[handle].motors.store(false);
}

PALPATE_FAKE_EXPORT void hdMakeCurrentDevice(unsigned handle) {
  if (!legal("hdMakeCurrentDevice")) return;
  if (handle >= 4 || !lib().devices[handle].open) return fail(0x104, handle);
  lib().current = handle;
}
PALPATE_FAKE_EXPORT unsigned hdGetCurrentDevice() { return lib().current; }

PALPATE_FAKE_EXPORT void hdBeginFrame(unsigned handle) {
  Library& l = lib();
  if (!legal("hdBeginFrame")) return;
  if (handle >= 4 || !l.devices[handle].open) return fail(0x104, handle);
  Device& device = l.devices[handle];
  std::uint64_t const tick = l.control.ticks.load();
  if (device.in_frame || (device.one_frame && device.framed_in == tick + 1 && l.running.load())) {
    violate("a second frame in one tick");
    return fail(0x400, handle);
  }
  l.current = handle;
  device.in_frame = true;
  device.framed_in = tick + 1;
  if (device.gone) return fail(0x302, handle);
  device.begin(plan());
}

PALPATE_FAKE_EXPORT void hdEndFrame(unsigned handle) {
  Library& l = lib();
  if (!legal("hdEndFrame")) return;
  if (handle >= 4 || !l.devices[handle].open) return fail(0x104, handle);
  Device& device = l.devices[handle];
  if (!device.in_frame) {
    violate("a frame ends that was not begun");
    return fail(0x401, handle);
  }
  device.in_frame = false;
  l.control.seen[handle].frames.fetch_add(1);
  if (device.gone) return fail(0x302, handle);
  if (!device.end(1.0 / l.rate)) fail(0x201, handle);
}

PALPATE_FAKE_EXPORT Entry hdGetError() {
  Library& l = lib();
  std::lock_guard const lock(l.errors_mutex);
  return l.error_count > 0 ? l.errors[--l.error_count] : Entry{0, 0, nobody};
}
PALPATE_FAKE_EXPORT char const* hdGetErrorString(Code code) { return words(code); }

static void switched(unsigned capability, bool on, char const* call) {
  if (!legal(call)) return;
  Device* const device = current();
  if (device == nullptr) return fail(0x104, lib().current);
  switch (capability) {
    case 0x4000:
      if (on && !device->motors) device->since_on = 0.0;
      device->motors = on;
      break;
    case 0x4001: device->clamping = on; break;
    case 0x4002: device->ramping = on; break;
    case 0x4003: break;
    case 0x4004: device->one_frame = on; break;
    default: fail(0x100, lib().current);
  }
}
PALPATE_FAKE_EXPORT void hdEnable(unsigned capability) { switched(capability, true, "hdEnable"); }
PALPATE_FAKE_EXPORT void hdDisable(unsigned capability) { switched(capability, false, "hdDisable"); }
PALPATE_FAKE_EXPORT unsigned char hdIsEnabled(unsigned capability) {
  Device* const device = legal("hdIsEnabled") ? current() : nullptr;
  return device != nullptr && capability == 0x4000 && device->motors ? 1 : 0;
}

PALPATE_FAKE_EXPORT void hdGetBooleanv(unsigned number, unsigned char* out) {
  if (permitted(number, as_truth, "hdGetBooleanv") != nullptr) *out = 0;
}
PALPATE_FAKE_EXPORT void hdGetIntegerv(unsigned number, int* out) {
  if (permitted(number, as_integer, "hdGetIntegerv") == nullptr) return;
  switch (number) {
    case 0x2000: *out = current()->script >= 0.0 ? 1 : 0; break;   // a hand that works holds the first button
    case 0x2553: *out = 6; break;
    case 0x2554: *out = plan().output_degrees; break;
    case 0x2555: *out = plan().styles; break;
    case 0x2600:
    case 0x2601: *out = static_cast<int>(lib().rate); break;
    default: *out = 0;
  }
}
PALPATE_FAKE_EXPORT void hdGetFloatv(unsigned number, float* out) { get_real(number, as_float, out, "hdGetFloatv"); }
PALPATE_FAKE_EXPORT void hdGetDoublev(unsigned number, double* out) { get_real(number, as_double, out, "hdGetDoublev"); }
PALPATE_FAKE_EXPORT void hdGetLongv(unsigned number, long* out) {
  if (Parameter const* const parameter = permitted(number, as_long, "hdGetLongv")) std::fill(out, out + parameter->count, 0L);
}
PALPATE_FAKE_EXPORT char const* hdGetString(unsigned number) {
  if (permitted(number, as_text, "hdGetString") == nullptr) return nullptr;
  switch (number) {
    case 0x2501: return "Touch, not a real one";
    case 0x2502: return "palpate's stand-in for libHD";
    case 0x2503: return "palpate";
    case 0x2504: return "0";
    default: return "1";
  }
}
PALPATE_FAKE_EXPORT void hdSetDoublev(unsigned number, double const* in) {
  if (permitted(number, as_double, "hdSetDoublev") == nullptr) return;
  Device& device = *current();
  if (number == 0x2700) {
    device.force = {in[0], in[1], in[2]};
    device.force_set = true;
  } else if (number == 0x2701 && plan().output_degrees == 6) {
    device.torque = {1e-3 * in[0], 1e-3 * in[1], 1e-3 * in[2]};
  } else {
    fail(0x102, lib().current);
  }
}
PALPATE_FAKE_EXPORT unsigned hdCheckCalibration() {
  Device* const device = legal("hdCheckCalibration") ? current() : nullptr;
  if (device == nullptr) {
    fail(0x104, lib().current);
    return 0x5002;
  }
  if (device->calibration == 0x5002 && plan().styles == 4 && plan().in_inkwell) device->calibration = 0x5001;
  return device->calibration;
}
PALPATE_FAKE_EXPORT void hdUpdateCalibration(unsigned style) {
  Library& l = lib();
  Device* const device = legal("hdUpdateCalibration") ? current() : nullptr;
  if (device == nullptr) return fail(0x104, l.current);
  if ((static_cast<unsigned>(plan().styles) & style) == 0) return fail(0x101, l.current);
  if (style == 1 && l.running.load()) return fail(0x102, l.current);
  Seen& seen = l.control.seen[l.current];
  seen.calibrations.fetch_add(1);
  l.control.calibration_in_plain_locale.store(in_plain_locale());
  if (norm(device->felt) > 0.0) seen.calibrations_under_force.fetch_add(1);
  if ((style == 4 && !plan().in_inkwell) || !plan().calibration_helps) return;
  device->calibration = 0x5000;
  device->off_by_jump = false;
}

PALPATE_FAKE_EXPORT unsigned char hdDeploymentLicense(char const*, char const*, char const* password) {
  lib().control.calls.fetch_add(1);
  lib().licensed = plan().password != nullptr && std::strcmp(password, plan().password) == 0;
  return lib().licensed ? 1 : 0;
}

}  // extern "C"
