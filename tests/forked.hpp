// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#if __has_include(<sys/wait.h>)
#include <csignal>
#include <chrono>
#include <cstddef>
#include <exception>
#include <thread>
#include <sys/wait.h>
#include <unistd.h>
#endif

namespace palpate_test {

/// What became of a child process.
struct Child {
  bool ran = false;        ///< false where processes can not be forked
  bool aborted = false;    ///< ended by SIGABRT
  int code = -1;           ///< exit status if it ended by itself: 0, or 3 for an exception
  std::string said;        ///< what it wrote to standard error
};

/// Runs `body` in a copy of this process, in which no handler of the test framework is left: for what ends a program or can not be undone.
/// Standard output is dropped.
template <class Function>
Child in_child([[maybe_unused]] Function body) {
  Child child;
#if __has_include(<sys/wait.h>)
  int ends[2];
  if (::pipe(ends) != 0) return child;
  ::pid_t const id = ::fork();
  if (id < 0) return child;
  if (id == 0) {
    std::signal(SIGABRT, SIG_DFL);
    ::dup2(ends[1], 2);
    ::close(1);
    ::close(ends[0]);
    ::close(ends[1]);
    int code = 0;
    try {
      body();
    } catch (...) {
      code = 3;
    }
    ::_exit(code);
  }
  ::close(ends[1]);
  char buffer[512];
  for (::ssize_t got = 0; (got = ::read(ends[0], buffer, sizeof buffer)) > 0;) child.said.append(buffer, static_cast<std::size_t>(got));
  ::close(ends[0]);
  int status = 0;
  child.ran = ::waitpid(id, &status, 0) == id;
  child.aborted = WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT;
  if (WIFEXITED(status)) child.code = WEXITSTATUS(status);
#endif
  return child;
}

/// Stops this whole process once, as a debugger or a shell does, and lets it go on after a while. For a child only, and to be made before it has
/// threads: a shell would notice its own program's stop.
class Stopper {
 public:
  explicit Stopper([[maybe_unused]] int milliseconds) {
#if __has_include(<sys/wait.h>)
    int ends[2];
    if (::pipe(ends) != 0) return;
    ::pid_t const here = ::getpid();
    helper_ = ::fork();
    if (helper_ == 0) {
      char byte = 0;
      ::close(ends[1]);
      if (::read(ends[0], &byte, 1) == 1) {
        ::kill(here, SIGSTOP);
        std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
        ::kill(here, SIGCONT);
      }
      ::_exit(0);
    }
    ::close(ends[0]);
    tell_ = ends[1];
#endif
  }
  ~Stopper() {
#if __has_include(<sys/wait.h>)
    if (tell_ >= 0) ::close(tell_);
    if (helper_ > 0) ::waitpid(helper_, nullptr, 0);
#endif
  }
  Stopper(Stopper const&) = delete;
  Stopper& operator=(Stopper const&) = delete;

  /// Soon, not within the call.
  bool stop() noexcept {
#if __has_include(<sys/wait.h>)
    return helper_ > 0 && ::write(tell_, "s", 1) == 1;
#else
    return false;
#endif
  }

 private:
  int tell_ = -1;
  int helper_ = -1;   // its process
};

}  // namespace palpate_test
