// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace palpate_test {

/// Bytes that the program holds of the heap; 0 where nobody counts them, as under a sanitizer.
inline std::size_t heap_in_use() {
#if defined(__GLIBC__) && (__GLIBC__ > 2 || __GLIBC_MINOR__ >= 33)
  return ::mallinfo2().uordblks;
#else
  return 0;
#endif
}

}  // namespace palpate_test
