// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>

namespace palpate {

/// Does work(0) … work(n − 1), in any order or at once, and returns when all are done; the parts of the work do not touch each other.
template <class E>
concept Execution = std::copyable<E> && requires(E const& run, void (*work)(int)) { run(1, work); };

}  // namespace palpate
