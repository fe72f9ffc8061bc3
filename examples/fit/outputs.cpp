// SPDX-License-Identifier: MIT
#include "outputs.hpp"

#include "charts.hpp"

#include <palpate/core/detail/whole_file.hpp>
#include <palpate/core/error.hpp>
#include <palpate/vtk/virtual_display.hpp>

#include <cstdio>
#include <filesystem>
#include <system_error>

namespace fit_example {

namespace fs = std::filesystem;

namespace {

void make_folder(fs::path const& folder) {
  std::error_code problem;
  fs::create_directories(folder, problem);
  if (problem || !fs::is_directory(folder))
    throw palpate::FileError(palpate::detail::message("can not make the output folder ", folder.string(), ": ",
                                                      problem ? problem.message() : std::string("a file is in its place"),
                                                      "; choose another with --out"));
}

}  // namespace

std::vector<std::string> write_outputs(Options const& options, std::vector<FittedModel> const& fits,
                                       std::span<palpate::Measurement const> measurements) {
  make_folder(options.out);
  bool const all = options.model == "all";
  std::vector<std::string> written;
  for (FittedModel const& fitted : fits) {
    written.push_back(all ? "force_" + fitted.model + ".json" : "force.json");
    palpate::detail::write_whole_file(options.out / written.back(), fitted.preset);
  }
  if (!options.pictures) return written;
  palpate::VirtualDisplay const display;
  if (!display.ready()) {
    std::fprintf(stderr, "palpate-fit: no pictures: %s\n", display.problem().c_str());
    return written;
  }
  if (all) {
    draw_comparison(options.out / "comparison.png", fits, measurements);
    written.emplace_back("comparison.png");
  } else {
    draw_fit(options.out / "fit.png", fits.front());
    draw_residuals(options.out / "residuals.png", fits.front());
    written.insert(written.end(), {"fit.png", "residuals.png"});
  }
  return written;
}

}  // namespace fit_example
