// SPDX-License-Identifier: MIT
// Draws the pictures of docs/forces.md, one of each force model, and prints the numbers that the page quotes.
#include "pictures.hpp"

#include <palpate/core/error.hpp>
#include <palpate/vtk/virtual_display.hpp>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <system_error>

namespace {

constexpr char const* usage = "usage: forces FOLDER";

void draw_all(std::filesystem::path const& folder) {
  palpate::VirtualDisplay const display;
  if (!display.ready()) throw palpate::FileError("no pictures can be drawn: " + display.problem());
  std::error_code problem;
  std::filesystem::create_directories(folder, problem);
  if (problem || !std::filesystem::is_directory(folder))
    throw palpate::FileError(palpate::detail::message("can not make the folder ", folder.string(), ": ",
                                                      problem ? problem.message() : std::string("a file is in its place"), "; choose another"));
  for (auto const picture : {forces::contact_laws, forces::hunt_crossley, forces::puncture, forces::liver_loop, forces::domain_guard, forces::blade,
                             forces::speed_network, forces::organ_over_depth, forces::organ_over_speed, forces::noise_spectra, forces::noise_in_time,
                             forces::needle}) {
    forces::Picture const drawn = picture();
    palpate::write_plot(folder / (drawn.name() + ".png"), drawn.series(), drawn.style());
    std::printf("%s\n%s", drawn.name().c_str(), drawn.numbers().c_str());
  }
}

}  // namespace

/// Exit codes: 0 done; 2 the arguments can not be used, or no pictures can be drawn; 1 anything else.
int main(int argc, char** argv) {
  std::string folder;
  for (int k = 1; k < argc; ++k) {
    std::string const argument = argv[k];
    if (argument == "--help") {
      std::printf("%s\n", usage);
      return 0;
    }
    if (!folder.empty() || argument.empty() || argument.front() == '-')
      return std::fprintf(stderr, "forces: what is \"%s\"?\n%s\n", argument.c_str(), usage), 2;
    folder = argument;
  }
  if (folder.empty()) return std::fprintf(stderr, "forces: say in which folder the pictures go\n%s\n", usage), 2;
  try {
    draw_all(folder);
    return 0;
  } catch (palpate::Error const& error) {
    std::fprintf(stderr, "forces: %s\n", error.what());
    return 2;
  } catch (std::exception const& error) {
    std::fprintf(stderr, "forces: stopped: %s\n", error.what());
    return 1;
  }
}
