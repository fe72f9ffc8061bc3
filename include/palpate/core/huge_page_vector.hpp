// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <new>
#include <vector>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace palpate {

namespace detail {

/// Memory aligned for any register. From 4 MiB on it is asked to stand in pages of 2 MiB: a cut through a large body reads a little here and
/// there, and would wait for the address of another small page almost each time. A system that has no such pages gives those it has.
template <class T>
struct LargePages {
  using value_type = T;

  LargePages() = default;
  template <class Other>
  explicit(false) LargePages(LargePages<Other> const&) noexcept {}

  T* allocate(std::size_t count) {
    std::size_t const bytes = count * sizeof(T);
    void* const memory = ::operator new(bytes, alignment(bytes));
#ifdef MADV_HUGEPAGE
    if (bytes >= least) madvise(memory, bytes / page * page, MADV_HUGEPAGE);   // a wish: nothing depends on the answer
#endif
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, std::size_t count) noexcept { ::operator delete(memory, alignment(count * sizeof(T))); }

  friend bool operator==(LargePages const&, LargePages const&) noexcept { return true; }

 private:
  static constexpr std::size_t page = std::size_t(1) << 21, least = 2 * page;   // bytes

  static std::align_val_t alignment(std::size_t bytes) noexcept { return std::align_val_t{bytes >= least ? page : 64}; }
};

}  // namespace detail

/// A vector that may become as large as a body: one element for each particle, triangle or spring.
template <class T>
using HugePageVector = std::vector<T, detail::LargePages<T>>;

}  // namespace palpate
