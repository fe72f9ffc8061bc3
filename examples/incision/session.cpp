// SPDX-License-Identifier: MIT
#include "session.hpp"

namespace incision {

Outcome run_session(Options const& options, Organ const& organ, Hand& hand) {
  if (options.tissue == TissueName::solid) return run_solid(options, organ, hand);
  return options.zone > 0 ? run_zone(options, organ, hand) : run_whole_body(options, organ, hand);
}

}  // namespace incision
