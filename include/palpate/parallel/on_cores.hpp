// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/execution.hpp>
#include <palpate/core/serial.hpp>

#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>
#include <tbb/task_arena.h>

#include <memory>

namespace palpate {

/// An Execution on some cores at once, by oneTBB: the last policy of a SoftBody.
///
///   SoftBody body(std::move(tissue), LeapfrogVerlet{}, WholeBody{}, OnCores(2));
///
/// The result is that of Serial to the bit, whatever the number: see MassSpringLayout. Bodies of up to 4,096 moving particles are one block, which
/// the calling thread walks by itself.
/// Errors     InvalidArgument for fewer than one core.
/// Limits     for the thread that moves the body, not for a servo: oneTBB takes memory and waits for its threads.
class OnCores {
 public:
  explicit OnCores(int cores) {
    if (cores < 1) throw InvalidArgument(detail::message("a body on ", cores, " cores; give at least 1"));
    arena_ = std::make_shared<tbb::task_arena>(cores);
  }

  template <class Work>
  void operator()(int n, Work const& work) const {
    if (n <= 1) return Serial{}(n, work);
    arena_->execute([&] { tbb::parallel_for(0, n, work, tbb::simple_partitioner{}); });
  }

 private:
  std::shared_ptr<tbb::task_arena> arena_;   // copies share the threads
};

static_assert(Execution<OnCores>);

}  // namespace palpate
