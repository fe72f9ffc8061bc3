// SPDX-License-Identifier: MIT
#include "options.hpp"

#include "fitting.hpp"

#include "../command_line.hpp"

#include <palpate/core/version.hpp>

#include <cstdlib>
#include <string>
#include <vector>

namespace fit_example {

Parsed parse_options(int argc, char** argv) {
  Parsed parsed;
  Options& o = parsed.options;

  CLI::App app{
      "Fits force models to measured forces on a tool, and writes what a simulator needs of them: a preset (force.json) and charts (PNG).\n"
      "Measurements are lines depth_m,speed_m_s,phase,force_N. All quantities are in SI units.\n"
      "No force of this library is validated for a patient or for the outcome of a training."};
  app.set_version_flag("--version", std::string("palpate-fit (palpate ") + PALPATE_VERSION_STRING + ")");
  app.get_formatter()->column_width(38);
  app.footer("Exit codes: 0 done; 2 the input or the output can not be used, said in one line; 1 anything else.");

  std::vector<std::string> models(model_names.begin(), model_names.end());
  models.emplace_back("all");
  CLI::Validator const share([](std::string& text) {
    double const value = std::strtod(text.c_str(), nullptr);
    return value > 0.0 && value < 1.0 ? std::string() : "give a share between 0 and 1, for example 0.95, not " + text;   // also for a NaN
  }, "", "");

  auto const fit = "Fit";
  app.add_option("data", o.data, "measurements, CSV")->group(fit);
  app.add_option("--model", o.model, "linear, polynomial, exponential, hunt-crossley, needle, network, or all that the data allow")
      ->check(CLI::IsMember(models))->capture_default_str()->group(fit);
  app.add_option("--source", o.source, "what was measured, on what, with what: \"liver, pig, scalpel of 0.4 mm\"; kept in the preset")->group(fit);
  app.add_option("--confidence", o.confidence, "of the intervals of the coefficients")->check(share)->capture_default_str()->group(fit);
  app.add_option("--seed", o.seed, "of the cross-validation and of a network's first weights")->check(command_line::whole_number())->capture_default_str()->group(fit);

  auto const others = "Instead of a fit";
  auto* const generate = app.add_option("--generate", o.generate, "write a data set to try: liver, of published weights, or needle, made up")
                             ->check(CLI::IsMember({"liver", "needle"}))->group(others);
  auto* const check = app.add_option("--check", o.check, "load a preset, press and cut a small sheet with it, say what was felt")->group(others);

  auto const output = "Output";
  app.add_option("--out", o.out, "folder of the results, default palpate-fit-out; with --generate the file, default generated_<which>.csv")
      ->group(output);
  app.add_flag("!--no-pictures", o.pictures, "write no PNG files")->group(output);

  parsed.exit_code = command_line::parse(app, "palpate-fit", argc, argv, [&] {
    if (int const asked = int(!o.data.empty()) + int(generate->count() > 0) + int(check->count() > 0); asked != 1)
      throw CLI::ValidationError("what to do", asked == 0 ? "give a file of measurements, or --generate, or --check"
                                                          : "give a file of measurements or --generate or --check, one of them");
    if (o.out.empty()) o.out = o.generate.empty() ? "palpate-fit-out" : "generated_" + o.generate + ".csv";
  });
  return parsed;
}

}  // namespace fit_example
