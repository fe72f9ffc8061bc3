// SPDX-License-Identifier: MIT
#pragma once

#include "fitting.hpp"

#include <filesystem>
#include <span>
#include <vector>

namespace fit_example {

/// The measurements and the fitted curve over depth: a colour for each phase, and for each speed where the model depends on it.
void draw_fit(std::filesystem::path const& file, FittedModel const& fitted);

/// What the curve misses of each measurement.
void draw_residuals(std::filesystem::path const& file, FittedModel const& fitted);

/// All curves over all measurements, the way back dashed.
void draw_comparison(std::filesystem::path const& file, std::vector<FittedModel> const& fits, std::span<palpate::Measurement const> measurements);

}  // namespace fit_example
