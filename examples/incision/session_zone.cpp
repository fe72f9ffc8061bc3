// SPDX-License-Identifier: MIT
#include "session.hpp"
#include "session_run.hpp"

namespace incision {

Outcome run_zone(Options const& options, Organ const& organ, Hand& hand) {
  return with_integrator(options, organ, hand, palpate::ZoneOfInfluence{.rings = options.zone});
}

}  // namespace incision
