// SPDX-License-Identifier: MIT
// The main job: a liver is palpated, punctured, cut and released under a scripted hand.
#include "../exit_code.hpp"
#include "options.hpp"
#include "outputs.hpp"
#include "report.hpp"
#include "scene.hpp"
#include "session.hpp"

#include <palpate/core/error.hpp>

#include <cstdio>

/// Exit codes: 0 done; 2 the input or the output folder can not be used, said in one line on standard error; 1 anything else.
int main(int argc, char** argv) {
  using namespace incision;
  return exit_code_of("incision", [&]() -> int {
    Parsed const parsed = parse_options(argc, argv);
    if (parsed.exit_code) return *parsed.exit_code;
    Options const& options = parsed.options;

    Organ const organ = prepare_organ(options);
    OutputFolder const folder(options.out);
    Hand hand{.path = palpate::Trajectory<double>::start(Vector::Zero()), .middle = Vector::Zero(), .normal = organ.up, .along = Vector::UnitX()};
    Outcome const outcome = run_session(options, organ, hand);
    auto const written = write_outputs(options, organ, hand, outcome);
    std::fputs(summary(options, organ, hand, outcome, written).c_str(), stdout);
    return outcome.body_counts.diverged > 0 ? 1 : 0;
  });
}
