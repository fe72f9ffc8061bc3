// SPDX-License-Identifier: MIT
#pragma once

#include "fitting.hpp"
#include "options.hpp"

#include <span>
#include <string>
#include <vector>

namespace fit_example {

/// Writes presets and charts: force.json, fit.png and residuals.png of one fit; with the model "all" force_<model>.json of each and comparison.png.
/// Makes the folder. Every file is there as a whole or not at all; without a display the charts are left out with one line on standard error.
/// Returns the names of what was written. Throws FileError.
std::vector<std::string> write_outputs(Options const& options, std::vector<FittedModel> const& fits,
                                       std::span<palpate::Measurement const> measurements);

}  // namespace fit_example
