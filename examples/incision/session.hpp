// SPDX-License-Identifier: MIT
#pragma once

#include "options.hpp"
#include "outcome.hpp"
#include "scene.hpp"

namespace incision {

/// Builds the simulator that the options ask for and runs it, in lock-step or in real time. `hand` is worked out on the settled body.
/// Throws palpate::Error for what can not be used.
Outcome run_session(Options const& options, Organ const& organ, Hand& hand);

/// The parts of run_session, each compiled in a file of its own: springs for five integrators, whole or a zone, and a solid for two.
Outcome run_whole_body(Options const& options, Organ const& organ, Hand& hand);
Outcome run_solid(Options const& options, Organ const& organ, Hand& hand);
Outcome run_zone(Options const& options, Organ const& organ, Hand& hand);

}  // namespace incision
