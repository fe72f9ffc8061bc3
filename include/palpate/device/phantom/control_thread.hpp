// SPDX-License-Identifier: MIT
#pragma once

#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>

#include <semaphore.h>
#if defined(__linux__)
#include <locale.h>
#endif

namespace palpate::detail::phantom {

/// While it lives, this thread writes and reads numbers with a point, whatever the program's locale: drivers read their files with it, and a decimal
/// comma has spoilt them.
/// Cost       two exchanges of a pointer; the first one in a process makes the locale.
/// Limits     Linux; elsewhere it does nothing.
class PlainLocale {
 public:
#if defined(__linux__)
  PlainLocale() noexcept : before_(plain() != locale_t{} ? ::uselocale(plain()) : locale_t{}) {}
  ~PlainLocale() {
    if (before_ != locale_t{}) ::uselocale(before_);
  }
#else
  PlainLocale() noexcept {}
  ~PlainLocale() {}
#endif
  PlainLocale(PlainLocale const&) = delete;
  PlainLocale& operator=(PlainLocale const&) = delete;

#if defined(__linux__)
 private:
  static locale_t plain() noexcept {
    static locale_t const made = ::newlocale(LC_ALL_MASK, "C", locale_t{});   // for ever: threads that are never joined use it
    return made;
  }
  locale_t before_;
#endif
};

/// A thread for calls that may hang: the caller waits for them, but not for ever. One job at a time, all in the same thread, where numbers are
/// written with a point (see PlainLocale).
/// A thread that must not wait, a servo's, leaves a note where `sweep` finds it and calls `wake`: that takes no lock and allocates nothing.
/// Invariant  The thread is never joined: one that hangs in a driver must not keep the program from ending.
class ControlThread {
 public:
  using Job = std::function<void()>;

  /// `sweep` runs in the thread after each `wake`, and before each job.
  explicit ControlThread(Job sweep) : shared_(std::make_shared<Shared>(std::move(sweep))) {
    std::thread([shared = shared_] { work(*shared); }).detach();
  }
  ControlThread(ControlThread const&) = delete;
  ControlThread& operator=(ControlThread const&) = delete;

  /// Runs `job` and throws what it throws. False when it, or one before it, is still under way after so many seconds; if it ends later after all,
  /// `undo` is run after it. What the two use has to live on.
  bool run(double seconds, Job job, Job undo = {}) {
    auto const until =
        std::chrono::steady_clock::now() + std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(seconds));
    std::unique_lock lock(shared_->mutex);
    if (!shared_->changed.wait_until(lock, until, [&] { return !shared_->job; })) return false;
    shared_->job = std::move(job);
    shared_->undo = nullptr;
    shared_->failure = nullptr;
    std::uint64_t const ticket = ++shared_->given;
    wake();
    if (!shared_->changed.wait_until(lock, until, [&] { return shared_->done >= ticket; })) {
      shared_->undo = undo ? std::move(undo) : Job([] {});
      return false;
    }
    if (shared_->failure) std::rethrow_exception(std::exchange(shared_->failure, nullptr));
    return true;
  }

  /// Has `sweep` run as soon as the thread is free, before anything that is asked for later; nobody waits for it or hears what it throws.
  void wake() noexcept { ::sem_post(&shared_->to_do); }

 private:
  struct Shared {
    explicit Shared(Job first) : sweep(std::move(first)) { ::sem_init(&to_do, 0, 0); }

    ::sem_t to_do;   // one for each job and each wake
    Job const sweep;
    std::mutex mutex;
    std::condition_variable changed;
    Job job, undo;   // a job stays here until it is done
    std::uint64_t given = 0, done = 0;
    std::exception_ptr failure;
  };

  static void work(Shared& shared) {
    PlainLocale const plain;
    for (;;) {
      while (::sem_wait(&shared.to_do) != 0 && errno == EINTR) {}
      try {
        shared.sweep();
      } catch (...) {
      }
      std::unique_lock lock(shared.mutex);
      if (!shared.job) continue;
      lock.unlock();
      std::exception_ptr failure;
      try {
        shared.job();
      } catch (...) {
        failure = std::current_exception();
      }
      lock.lock();
      if (shared.undo) {   // nobody waits for it any more
        lock.unlock();
        try {
          shared.undo();
        } catch (...) {
        }
        lock.lock();
        shared.undo = nullptr;
        failure = nullptr;
      }
      shared.failure = failure;
      shared.done = shared.given;
      shared.job = nullptr;
      shared.changed.notify_all();
    }
  }

  std::shared_ptr<Shared> shared_;
};

}  // namespace palpate::detail::phantom
