// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/fitting/measurements.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fit_example {

inline constexpr std::array<std::string_view, 6> model_names{"linear", "polynomial", "exponential", "hunt-crossley", "needle", "network"};

struct FitSettings {
  double confidence = 0.95;
  std::uint64_t seed = 0;
  std::string source;
};

/// A fit of any model, as tables, charts and files take it.
struct FittedModel {
  std::string model;
  std::string table;                  ///< for people
  std::string preset{};               ///< the text of its force file; a simulator takes it
  std::vector<palpate::Measurement> used{};
  std::vector<double> residuals{};    ///< N, measured minus model
  std::size_t coefficients = 0;
  double rms = 0.0, r_squared = 0.0;
  double cross_validated_rms = 0.0;   ///< N; NaN without
  std::string undetermined{};         ///< the coefficients that the measurements do not tell from zero or from others; empty: none
  bool comparable = true;             ///< nothing can take a coefficient's place: then the force may be right where a coefficient is not
  bool converged = true;
  std::function<double(palpate::Measurement const&)> force{};   ///< [N], at a depth, speed and phase that were measured
};

/// Fits the model of a name. A network is one of depth and phase where there is a way back, else one of depth.
/// Throws InvalidArgument where the measurements do not allow it.
FittedModel fit_model(std::string_view name, std::span<palpate::Measurement const> measurements, FitSettings const& settings);

/// All models that the measurements allow, the smallest cross-validated error first, and why the others are left out.
struct Comparison {
  std::vector<FittedModel> fits;
  std::vector<std::string> left_out;
};
Comparison fit_all(std::span<palpate::Measurement const> measurements, FitSettings const& settings);

std::string comparison_table(Comparison const& comparison);

}  // namespace fit_example
