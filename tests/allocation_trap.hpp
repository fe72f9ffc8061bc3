// SPDX-License-Identifier: MIT
#pragma once

namespace palpate_test {

/// Counts the heap allocations of the calling thread since it was made.
///   AllocationCount const allocations;
///   body.step(h);
///   CHECK(allocations.count() == 0);
/// What counts    every `operator new` and, where `trap_sees_malloc()`, every malloc, calloc, realloc and aligned
///                allocation (Eigen uses malloc). Releases do not count. Other threads do not count.
/// How            `allocation_trap.cpp`, linked into the test executable, wraps glibc's malloc; under a sanitizer it uses the
///                sanitizer's own allocation hook (the thread sanitizer's does not see posix_memalign); elsewhere it replaces
///                `operator new` alone.
/// Limits         a compiler may remove an allocation whose result is not used: the trap then rightly counts none. The checks of
///                the test framework may allocate themselves: read `count()` into a variable before the first check.
class AllocationCount {
 public:
  AllocationCount() noexcept;
  long count() const noexcept;

 private:
  long start_;
};

/// True when the trap is linked in and notices an allocation: a test that relies on the trap requires this first.
bool trap_works() noexcept;

/// True when plain malloc is counted too, not `operator new` alone.
bool trap_sees_malloc() noexcept;

}  // namespace palpate_test
