// SPDX-License-Identifier: MIT
// A hard nodule in a soft organ, found by pressing along a line. README.md is the lesson.
#include "../exit_code.hpp"
#include "options.hpp"
#include "organ.hpp"
#include "outputs.hpp"
#include "pressing.hpp"

#include <palpate/core/error.hpp>

#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <system_error>

/// Exit codes: 0 done; 2 the input or the output folder can not be used, said in one line on standard error; 1 anything else.
int main(int argc, char** argv) {
  using namespace palpation;
  return exit_code_of("palpation", [&]() -> int {
    Parsed const parsed = parse_options(argc, argv);
    if (parsed.exit_code) return *parsed.exit_code;
    Options const& options = parsed.options;
    Organ const organ = prepare_organ(options);
    std::error_code problem;
    std::filesystem::create_directories(options.out, problem);
    if (problem || !std::filesystem::is_directory(options.out))
      throw palpate::FileError(palpate::detail::message("can not make the output folder ", options.out.string(), "; choose another with --out"));

    auto const tell = [&](char const* what) {
      return [what, &organ](std::size_t done) {
        if (isatty(fileno(stderr)) != 0) std::fprintf(stderr, "\r%s %zu of %zu%s", what, done, organ.places.size(), done == organ.places.size() ? "\n" : "");
      };
    };
    auto const with = press(options, organ, true, tell("with nodule   "));
    auto const without = press(options, organ, false, tell("without       "));
    auto const written = write_outputs(options, organ, with, without);

    std::size_t found = 0, nearest = 0;
    for (std::size_t k = 0; k < with.size(); ++k) {
      if (with[k].force / without[k].force > with[found].force / without[found].force) found = k;
      if ((organ.places[k].point - organ.nodule).norm() < (organ.places[nearest].point - organ.nodule).norm()) nearest = k;
    }
    std::printf("organ         %s, E %g Pa, nu %g\n", organ.name.c_str(), options.young, options.poisson);
    std::printf("filled        %s\n", organ.filled.c_str());
    std::printf("nodule        at (%.1f, %.1f, %.1f) mm, radius %.1f mm, E %g Pa: %zu tetrahedra; %.1f mm below the skin\n", 1e3 * organ.nodule.x(), 1e3 * organ.nodule.y(),
                1e3 * organ.nodule.z(), 1e3 * organ.nodule_radius, organ.nodule_young, organ.hard.size(), 1e3 * (organ.places[nearest].point - organ.nodule).norm());
    std::printf("pressed       %zu places, %.1f mm deep, a pad of %.1f mm\n", with.size(), 1e3 * options.depth, 1e3 * options.pad);
    std::printf("found         at %.1f mm of the line: %.3f N, without the nodule %.3f N, %.0f %% more; the nodule is at %.1f mm\n", 1e3 * organ.places[found].along, with[found].force,
                without[found].force, 100 * (with[found].force / without[found].force - 1), 1e3 * organ.places[nearest].along);
    std::string names;
    for (std::string const& name : written) names += (names.empty() ? "" : ", ") + name;
    std::printf("written       %s: %s\n", options.out.string().c_str(), names.c_str());
    return 0;
  });
}
