// SPDX-License-Identifier: MIT
#include "session.hpp"
#include "session_run.hpp"

namespace incision {

Outcome run_whole_body(Options const& options, Organ const& organ, Hand& hand) {
  return with_integrator(options, organ, hand, palpate::WholeBody{});
}

}  // namespace incision
