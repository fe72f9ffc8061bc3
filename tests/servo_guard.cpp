// SPDX-License-Identifier: MIT
#include "servo_guard.hpp"
#include "sanitizer.hpp"

#include <cstdlib>

#if defined(__GLIBC__) && !defined(PALPATE_TEST_SANITIZER)
#define PALPATE_TEST_GUARD_ABORTS 1

#include <array>
#include <atomic>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <dlfcn.h>
#include <execinfo.h>
#include <fcntl.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif

namespace palpate_test {

namespace {

constinit thread_local bool armed = false;
constinit thread_local long violations = 0;

#if defined(PALPATE_TEST_GUARD_ABORTS)

void say(char const* text) noexcept { ::syscall(SYS_write, 2, text, std::strlen(text)); }   // not write(): that is one of those guarded

[[noreturn]] void end_program(char const* call) noexcept {
  armed = false;
  say("palpate_test::ServoGuard: ");
  say(call);
  say(" in a servo tick; it was called from\n");
  std::array<void*, 32> frames;
  ::backtrace_symbols_fd(frames.data(), ::backtrace(frames.data(), static_cast<int>(frames.size())), 2);
  std::abort();
}

#endif

}  // namespace

void about_to([[maybe_unused]] char const* call) noexcept {
  if (!armed) return;
  ++violations;
#if defined(PALPATE_TEST_GUARD_ABORTS)
  end_program(call);
#endif
}

ServoGuard::ServoGuard() noexcept : armed_before_(armed) { armed = true; }
ServoGuard::~ServoGuard() { armed = armed_before_; }

long guard_violations() noexcept { return violations; }

bool guard_aborts() noexcept {
#if defined(PALPATE_TEST_GUARD_ABORTS)
  return true;
#else
  return false;
#endif
}

}  // namespace palpate_test

#if defined(PALPATE_TEST_GUARD_ABORTS)

namespace {

/// The C library's own function behind ours.
template <class Function>
class Behind {
 public:
  constexpr explicit Behind(char const* name) noexcept : name_(name) {}

  template <class... Arguments>
  auto operator()(Arguments... arguments) noexcept {
    palpate_test::about_to(name_);
    return get()(arguments...);
  }
  Function* get() noexcept {
    Function* function = function_.load(std::memory_order_relaxed);
    if (function == nullptr) {
      function = reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name_));
      function_.store(function, std::memory_order_relaxed);
    }
    return function;
  }

 private:
  char const* name_;
  std::atomic<Function*> function_{nullptr};
};

constinit Behind<int(pthread_mutex_t*)> lock("pthread_mutex_lock");
constinit Behind<int(pthread_rwlock_t*)> lock_to_read("pthread_rwlock_rdlock");
constinit Behind<int(pthread_rwlock_t*)> lock_to_write("pthread_rwlock_wrlock");
constinit Behind<int(pthread_t*, pthread_attr_t const*, void* (*)(void*), void*)> create_thread("pthread_create");
constinit Behind<int(pthread_t, void**)> join_thread("pthread_join");
constinit Behind<int(timespec const*, timespec*)> sleep_for("nanosleep");
constinit Behind<int(clockid_t, int, timespec const*, timespec*)> sleep_on("clock_nanosleep");
constinit Behind<int(useconds_t)> sleep_microseconds("usleep");
constinit Behind<ssize_t(int, void const*, size_t)> write_bytes("write");
constinit Behind<ssize_t(int, void*, size_t)> read_bytes("read");
constinit Behind<int(char const*, int, mode_t)> open_file("open");
constinit Behind<size_t(void const*, size_t, size_t, FILE*)> print_bytes("fwrite");
constinit Behind<int(char const*, FILE*)> print_text("fputs");
constinit Behind<int(char const*)> print_line("puts");
constinit Behind<int(int)> print_character("putchar");
constinit Behind<int(FILE*)> flush("fflush");
constinit Behind<int(FILE*, char const*, va_list)> print_list("vfprintf");
constinit Behind<void*(void*, size_t, int, int, int, off_t)> map_memory("mmap");
constinit Behind<int(void*, size_t)> unmap_memory("munmap");

}  // namespace

// The executable's functions come before the C library's in every look-up, from the C++ library too.
extern "C" {

int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept { return lock(mutex); }
int pthread_rwlock_rdlock(pthread_rwlock_t* mutex) noexcept { return lock_to_read(mutex); }
int pthread_rwlock_wrlock(pthread_rwlock_t* mutex) noexcept { return lock_to_write(mutex); }
int pthread_create(pthread_t* thread, pthread_attr_t const* attributes, void* (*run)(void*), void* argument) noexcept {
  return create_thread(thread, attributes, run, argument);
}
int pthread_join(pthread_t thread, void** result) { return join_thread(thread, result); }
int nanosleep(timespec const* time, timespec* left) { return sleep_for(time, left); }
int clock_nanosleep(clockid_t clock, int flags, timespec const* time, timespec* left) { return sleep_on(clock, flags, time, left); }
int usleep(useconds_t time) { return sleep_microseconds(time); }
ssize_t write(int file, void const* bytes, size_t size) { return write_bytes(file, bytes, size); }
ssize_t read(int file, void* bytes, size_t size) { return read_bytes(file, bytes, size); }
int open(char const* name, int flags, ...) {
  va_list more;
  va_start(more, flags);
  mode_t const mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(more, mode_t) : 0;
  va_end(more);
  return open_file(name, flags, mode);
}
size_t fwrite(void const* bytes, size_t size, size_t count, FILE* file) { return print_bytes(bytes, size, count, file); }
int fputs(char const* text, FILE* file) { return print_text(text, file); }
int puts(char const* text) { return print_line(text); }
int putchar(int character) { return print_character(character); }
int fflush(FILE* file) { return flush(file); }
int vfprintf(FILE* file, char const* format, va_list values) { return print_list(file, format, values); }
int printf(char const* format, ...) {
  palpate_test::about_to("printf");
  va_list values;
  va_start(values, format);
  int const count = print_list.get()(stdout, format, values);
  va_end(values);
  return count;
}
int fprintf(FILE* file, char const* format, ...) {
  palpate_test::about_to("fprintf");
  va_list values;
  va_start(values, format);
  int const count = print_list.get()(file, format, values);
  va_end(values);
  return count;
}
void* mmap(void* at, size_t size, int protection, int flags, int file, off_t from) noexcept {
  return map_memory(at, size, protection, flags, file, from);
}
int munmap(void* at, size_t size) noexcept { return unmap_memory(at, size); }

}  // extern "C"

#endif
