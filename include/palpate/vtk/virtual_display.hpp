// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#if defined(__unix__) && !defined(__APPLE__)
#define PALPATE_VTK_HAS_X11 1
#include <dlfcn.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#endif

namespace palpate {

namespace detail {

/// A connection to the X display that DISPLAY names, where there is one.
class DisplayConnection {
 public:
#ifdef PALPATE_VTK_HAS_X11
  DisplayConnection() {
    // VTK has loaded X's library; looked up at run time, a VTK that draws otherwise needs no X to build.
    library_ = dlopen("libX11.so.6", RTLD_LAZY);
    if (library_ == nullptr) return;
    auto const open = reinterpret_cast<void* (*)(char const*)>(dlsym(library_, "XOpenDisplay"));
    if (open != nullptr) display_ = open(nullptr);
  }
  DisplayConnection(DisplayConnection const&) = delete;
  DisplayConnection& operator=(DisplayConnection const&) = delete;
  ~DisplayConnection() {
    if (library_ == nullptr) return;
    auto const close = reinterpret_cast<int (*)(void*)>(dlsym(library_, "XCloseDisplay"));
    if (display_ != nullptr && close != nullptr) close(display_);
    dlclose(library_);
  }

  /// Also where VTK draws without X.
  bool can_draw() const noexcept { return library_ == nullptr || display_ != nullptr; }

 private:
  void* library_ = nullptr;
  void* display_ = nullptr;
#else
  bool can_draw() const noexcept { return true; }
#endif
};

}  // namespace detail

/// Whether pictures can be drawn now. VTK on Linux draws through an X display, also off screen, and ends the program when
/// there is none: ask first. True on systems that draw without X.
inline bool display_available() { return detail::DisplayConnection().can_draw(); }

/// A display for drawing where none is: an X server without a screen (Xvfb), as long as this object lives.
///   VirtualDisplay const display;
///   if (display.ready()) write_picture(…);
/// Where a display is there already, it stays connected to that: a server starts anew when its last window closes, and what is drawn meanwhile ends the
/// program (`xvfb-run` without -noreset). DISPLAY is set for this process and set back at the end; close every VTK
/// window before, since X ends a program whose server goes away. The server ends with this process, however that ends.
/// Limits     one at a time, made while no other thread reads the environment.
class VirtualDisplay {
 public:
  VirtualDisplay() {
    connection_.emplace();
    ready_ = connection_->can_draw();
#ifdef PALPATE_VTK_HAS_X11
    if (!ready_) start();
#endif
  }
  VirtualDisplay(VirtualDisplay const&) = delete;
  VirtualDisplay& operator=(VirtualDisplay const&) = delete;
  ~VirtualDisplay() {
    connection_.reset();   // before its server goes
#ifdef PALPATE_VTK_HAS_X11
    stop();
#endif
  }

  /// Is there a display now, this one or another?
  bool ready() const noexcept { return ready_; }
  /// Why not, in one line with what to do; empty when ready.
  std::string const& problem() const noexcept { return problem_; }

 private:
  std::optional<detail::DisplayConnection> connection_;
  bool ready_ = false;
  std::string problem_;

#ifdef PALPATE_VTK_HAS_X11
  void start() {
    int answer[2], lifeline[2];
    if (pipe(answer) != 0) return fail("no pipe to Xvfb could be made");
    if (pipe(lifeline) != 0) {
      close(answer[0]);
      close(answer[1]);
      return fail("no pipe to Xvfb could be made");
    }
    std::string const number = std::to_string(answer[1]);
    char const* const command[] = {"Xvfb",    "-displayfd", number.c_str(), "-screen", "0", "1920x1440x24",
                                   "-nolisten", "tcp",      "-noreset",     nullptr};
    server_ = fork();
    if (server_ == 0) watch(command, answer, lifeline);
    close(answer[1]);
    close(lifeline[0]);
    lifeline_ = lifeline[1];
    fcntl(lifeline_, F_SETFD, FD_CLOEXEC);
    std::string const display = server_ > 0 ? read_number(answer[0]) : "";
    close(answer[0]);
    if (display.empty()) {
      stop();
      return fail("Xvfb did not start");
    }
    if (char const* const before = std::getenv("DISPLAY")) before_ = before;
    had_display_ = std::getenv("DISPLAY") != nullptr;
    set_display_ = true;
    setenv("DISPLAY", (":" + display).c_str(), 1);
    connection_.emplace();
    ready_ = connection_->can_draw();
    if (!ready_) {
      stop();
      fail("Xvfb started and does not answer");
    }
  }

  /// In the child: runs the server in a child of its own and ends it when the lifeline's other end is closed, which the
  /// system does when our process ends. Only calls that are allowed after fork().
  [[noreturn]] static void watch(char const* const* command, int const (&answer)[2], int const (&lifeline)[2]) {
    setpgid(0, 0);   // Ctrl-C at the terminal reaches the program, and the program's end reaches us
    close(answer[0]);
    close(lifeline[1]);
    pid_t const server = fork();
    if (server == 0) {
      close(lifeline[0]);
      int const nowhere = open("/dev/null", O_RDWR);
      for (int stream = 0; stream < 3; ++stream) dup2(nowhere, stream);
      execvp(command[0], const_cast<char* const*>(command));
      _exit(127);
    }
    close(answer[1]);
    char byte = 0;
    while (read(lifeline[0], &byte, 1) < 0 && errno == EINTR) {
    }
    if (server > 0) {
      kill(server, SIGTERM);
      while (waitpid(server, nullptr, 0) < 0 && errno == EINTR) {
      }
    }
    _exit(0);
  }

  /// The display's number, which the server writes when it is ready; empty when it ends or is silent for 20 s.
  static std::string read_number(int answer) {
    std::string number;
    for (;;) {
      pollfd waiting{answer, POLLIN, 0};
      int const events = poll(&waiting, 1, 20000);
      if (events < 0 && errno == EINTR) continue;
      char byte = 0;
      if (events <= 0 || read(answer, &byte, 1) != 1) return {};
      if (byte == '\n') return number;
      number += byte;
    }
  }

  void stop() noexcept {
    if (set_display_) {
      if (had_display_)
        setenv("DISPLAY", before_.c_str(), 1);
      else
        unsetenv("DISPLAY");
      set_display_ = false;
    }
    if (lifeline_ >= 0) close(lifeline_);
    lifeline_ = -1;
    if (server_ > 0)
      while (waitpid(server_, nullptr, 0) < 0 && errno == EINTR) {
      }
    server_ = -1;
  }

  void fail(char const* reason) {
    problem_ = std::string("there is no X display to draw pictures on, and ") + reason +
               "; set DISPLAY or install Xvfb (Debian: apt-get install xvfb)";
  }

  pid_t server_ = -1;
  int lifeline_ = -1;
  bool set_display_ = false, had_display_ = false;
  std::string before_;
#endif
};

}  // namespace palpate
