// SPDX-License-Identifier: MIT
#include "allocation_trap.hpp"
#include "sanitizer.hpp"
#include "servo_guard.hpp"

#include <cstddef>
#include <cstdlib>
#include <new>

namespace {

constinit thread_local long allocations = 0;

void note(char const* call) noexcept {
  ++allocations;
  palpate_test::about_to(call);
}

}  // namespace

#if defined(PALPATE_TEST_SANITIZER)

// The sanitizer owns the heap: listen to it instead of replacing anything. Declared here because gcc ships no header for it.
extern "C" int __sanitizer_install_malloc_and_free_hooks(void (*on_malloc)(void const volatile*, std::size_t),
                                                         void (*on_free)(void const volatile*));

namespace {

void on_malloc(void const volatile*, std::size_t) { note("malloc"); }
void on_free(void const volatile* block) {
  if (block != nullptr) palpate_test::about_to("free");
}

[[maybe_unused]] int const hook_installed = __sanitizer_install_malloc_and_free_hooks(on_malloc, on_free);

}  // namespace

#elif defined(__GLIBC__)

// The executable's malloc comes before glibc's in every look-up, so libstdc++'s operator new and Eigen both arrive here.
extern "C" {

void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* block);

void* malloc(std::size_t size) noexcept {
  note("malloc");
  return __libc_malloc(size);
}

void* calloc(std::size_t count, std::size_t size) noexcept {
  note("calloc");
  return __libc_calloc(count, size);
}

void* realloc(void* block, std::size_t size) noexcept {
  note("realloc");
  return __libc_realloc(block, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  note("aligned_alloc");
  return __libc_memalign(alignment, size);
}

void* memalign(std::size_t alignment, std::size_t size) noexcept {
  note("memalign");
  return __libc_memalign(alignment, size);
}

int posix_memalign(void** block, std::size_t alignment, std::size_t size) noexcept {
  note("posix_memalign");
  void* const got = __libc_memalign(alignment, size);
  if (got == nullptr) return 12;   // ENOMEM
  *block = got;
  return 0;
}

void free(void* block) noexcept {
  if (block != nullptr) palpate_test::about_to("free");
  __libc_free(block);
}

}  // extern "C"

#else

void* operator new(std::size_t size) {
  note("operator new");
  if (void* const block = std::malloc(size == 0 ? 1 : size)) return block;
  throw std::bad_alloc();
}

void operator delete(void* block) noexcept {
  if (block != nullptr) palpate_test::about_to("operator delete");
  std::free(block);
}
void operator delete(void* block, std::size_t) noexcept { ::operator delete(block); }

void* operator new(std::size_t size, std::align_val_t alignment) {
  note("operator new");
  auto const step = static_cast<std::size_t>(alignment);
  if (void* const block = std::aligned_alloc(step, (size + step) / step * step)) return block;
  throw std::bad_alloc();
}
void operator delete(void* block, std::align_val_t) noexcept { ::operator delete(block); }
void operator delete(void* block, std::size_t, std::align_val_t) noexcept { ::operator delete(block); }

#endif

namespace palpate_test {

AllocationCount::AllocationCount() noexcept : start_(allocations) {}

long AllocationCount::count() const noexcept { return allocations - start_; }

bool trap_works() noexcept {
  AllocationCount const allocated;
  void* volatile const block = ::operator new(16);   // volatile: the pair may not be optimised away
  ::operator delete(block);
  long const plain = allocated.count();
  std::align_val_t const alignment{64};
  void* volatile const aligned = ::operator new(16, alignment);
  ::operator delete(aligned, alignment);
  return plain > 0 && allocated.count() > plain;
}

bool trap_sees_malloc() noexcept {
  AllocationCount const allocated;
  void* volatile const block = std::malloc(16);
  std::free(block);
  return allocated.count() > 0;
}

}  // namespace palpate_test
