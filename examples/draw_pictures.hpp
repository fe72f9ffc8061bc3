// SPDX-License-Identifier: MIT
#pragma once

#include "exit_code.hpp"
#include "picture.hpp"

#include <palpate/core/error.hpp>
#include <palpate/vtk/plot.hpp>
#include <palpate/vtk/virtual_display.hpp>

#include <cstdio>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <system_error>

namespace drawing {

/// Draws each picture into a file of its name, and prints its numbers.
inline void draw_all(std::initializer_list<Picture (*)()> pictures, std::filesystem::path const& folder) {
  palpate::VirtualDisplay const display;
  if (!display.ready()) throw palpate::FileError("no pictures can be drawn: " + display.problem());
  std::error_code problem;
  std::filesystem::create_directories(folder, problem);
  if (problem || !std::filesystem::is_directory(folder))
    throw palpate::FileError(palpate::detail::message("can not make the folder ", folder.string(), ": ",
                                                      problem ? problem.message() : std::string("a file is in its place"), "; choose another"));
  for (auto const picture : pictures) {
    Picture const drawn = picture();
    palpate::write_plot(folder / (drawn.name() + ".png"), drawn.series(), drawn.style());
    std::printf("%s\n%s", drawn.name().c_str(), drawn.numbers().c_str());
  }
}

/// The program: NAME FOLDER. Exit codes: 0 done; 2 the arguments can not be used, or no pictures can be drawn; 1 anything else.
inline int draw_pictures(char const* name, int argc, char** argv, std::initializer_list<Picture (*)()> pictures) {
  std::string folder;
  for (int k = 1; k < argc; ++k) {
    std::string const argument = argv[k];
    if (argument == "--help") {
      std::printf("usage: %s FOLDER\n", name);
      return 0;
    }
    if (!folder.empty() || argument.empty() || argument.front() == '-')
      return std::fprintf(stderr, "%s: what is \"%s\"?\nusage: %s FOLDER\n", name, argument.c_str(), name), 2;
    folder = argument;
  }
  if (folder.empty()) return std::fprintf(stderr, "%s: say in which folder the pictures go\nusage: %s FOLDER\n", name, name), 2;
  return exit_code_of(name, [&]() -> int {
    draw_all(pictures, folder);
    return 0;
  });
}

}  // namespace drawing
