// SPDX-License-Identifier: MIT
// Measured forces on a tool become a force model: fitted, judged, drawn, and kept in a file that a simulator loads.
#include "../exit_code.hpp"
#include "check.hpp"
#include "fitting.hpp"
#include "generated.hpp"
#include "options.hpp"
#include "outputs.hpp"

#include <palpate/core/detail/whole_file.hpp>
#include <palpate/core/error.hpp>
#include <palpate/fitting/measurements.hpp>

#include <cstdio>
#include <string>
#include <vector>

namespace {

using namespace fit_example;

void run_fit(Options const& options) {
  auto const measurements = palpate::read_measurements(options.data);
  FitSettings const settings{.confidence = options.confidence,
                             .seed = options.seed,
                             .source = options.source.empty() ? options.data.filename().string() + ", tissue and tool not stated" : options.source};
  std::vector<FittedModel> fits;
  std::string text;
  if (options.model == "all") {
    Comparison comparison = fit_all(measurements, settings);
    for (FittedModel const& fitted : comparison.fits) text += fitted.table;
    text += comparison_table(comparison);
    fits = std::move(comparison.fits);
  } else {
    fits.push_back(fit_model(options.model, measurements, settings));
    text = fits.front().table;
  }
  auto const written = write_outputs(options, fits, measurements);
  std::fputs(text.c_str(), stdout);
  std::printf("written to %s:", options.out.string().c_str());
  for (std::string const& name : written) std::printf(" %s", name.c_str());
  std::printf("\n");
  for (FittedModel const& fitted : fits)
    if (!fitted.undetermined.empty())
      std::fprintf(stderr, "palpate-fit: the measurements do not say what %s of the model \"%s\" is; measure at other depths, speeds or phases\n",
                   fitted.undetermined.c_str(), fitted.model.c_str());
}

}  // namespace

/// Exit codes: 0 done; 2 the input or the output can not be used, said in one line on standard error; 1 anything else.
int main(int argc, char** argv) {
  return exit_code_of("palpate-fit", [&]() -> int {
    Parsed const parsed = parse_options(argc, argv);
    if (parsed.exit_code) return *parsed.exit_code;
    Options const& options = parsed.options;
    if (!options.generate.empty())
      palpate::detail::write_whole_file(options.out, generated_text(options.generate));
    else if (!options.check.empty())
      std::fputs(check_force(options.check).c_str(), stdout);
    else
      run_fit(options);
    return 0;
  });
}
