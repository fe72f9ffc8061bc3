// SPDX-License-Identifier: MIT
#pragma once

#include "fake_libhd/control.hpp"

#include <palpate/device/phantom.hpp>

#include <chrono>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <thread>

#include <dlfcn.h>

namespace palpate_test {

inline void* fake_function(char const* name) {
  char const* const path = std::getenv("PALPATE_LIBHD");
  void* const library = path != nullptr ? ::dlopen(path, RTLD_NOW | RTLD_LOCAL) : nullptr;
  void* const found = library != nullptr ? ::dlsym(library, name) : nullptr;
  if (found == nullptr)
    throw std::runtime_error(std::string(name) + " is not there: PALPATE_LIBHD has to name the libHD.so of the target fake_libhd; ctest sets it");
  return found;
}

/// The stand-in for libHD, as new; no device may be open.
inline fake_libhd::Control& fresh_fake() {
  reinterpret_cast<void (*)()>(fake_function("fake_libhd_reset"))();
  return *reinterpret_cast<fake_libhd::Control* (*)()>(fake_function("fake_libhd_control"))();
}

inline int advance_fake(int ticks) { return reinterpret_cast<int (*)(int)>(fake_function("palpate_advance_clock"))(ticks); }

inline palpate::Vector3<double> force_on(fake_libhd::Control const& fake, int device = 0) {
  auto const& force = fake.seen[device].force;
  return {force[0].load(), force[1].load(), force[2].load()};
}

/// Waits up to five seconds of real time.
template <class Done>
bool soon(Done done) {
  for (int k = 0; k < 5000; ++k) {
    if (done()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

}  // namespace palpate_test
