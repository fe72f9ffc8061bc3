// SPDX-License-Identifier: MIT
#pragma once

namespace palpate_test {

/// While one lives, its thread must not do what a servo tick must not: allocate, release, lock, sleep, read, write, print, map memory, start a
/// thread. A call that does ends the program with a message that names it and the addresses it came from.
///   { ServoGuard const guard; servo.read(h); }
/// How        `servo_guard.cpp` and `allocation_trap.cpp`, linked into the test executable, stand before the C library's functions. Releasing
///            counts too: it takes the heap's lock as much as allocating does, and the last owner of anything large gives pages back.
/// Limits     Not seen: a system call made without the C library, a call within the C library, inlined code that spins. Where
///            `guard_aborts()` is false (sanitizers have the C library's functions to themselves), allocations and releases are counted,
///            the rest is not seen. A guard within a guard changes nothing.
class ServoGuard {
 public:
  ServoGuard() noexcept;
  ~ServoGuard();
  ServoGuard(ServoGuard const&) = delete;
  ServoGuard& operator=(ServoGuard const&) = delete;

 private:
  bool armed_before_;
};

/// Does a forbidden call end the program, or is it counted?
bool guard_aborts() noexcept;
/// Forbidden calls of this thread so far, where they are counted.
long guard_violations() noexcept;
/// For the functions that stand before those of the C library: `call` is about to happen.
void about_to(char const* call) noexcept;

}  // namespace palpate_test
