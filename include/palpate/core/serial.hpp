// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/execution.hpp>

namespace palpate {

/// Does work(0) … work(n − 1), one after the other. The least an Execution can be.
struct Serial {
  template <class Work>
  void operator()(int n, Work const& work) const {
    for (int k = 0; k < n; ++k) work(k);
  }
};

}  // namespace palpate
