// SPDX-License-Identifier: MIT
#pragma once

#include "run.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

namespace work_precision {

/// What a scene's paths are compared with.
struct Reference {
  std::vector<Matrix3X<double>> displacement;   // at the end of each interval
  double largest = 0;                           // m, largest displacement of any particle
  double own_error = 0;                         // an estimate, as a share of `largest`
  std::string source;
  std::optional<Matrix3X<double>> balance;      // where it comes to rest, for a load that stays

  /// Of all particles and ends of intervals the largest distance, as a share of the largest displacement.
  double error_of(std::vector<Matrix3X<double>> const& path) const {
    double error = 0;
    for (std::size_t k = 0; k < path.size(); ++k) error = std::max(error, (path[k] - displacement[k]).colwise().norm().maxCoeff());
    return error / largest;
  }
  /// The same of the last shape against the balance.
  double static_error_of(std::vector<Matrix3X<double>> const& path) const {
    return (path.back() - *balance).colwise().norm().maxCoeff() / balance->colwise().norm().maxCoeff();
  }
};

/// The closed form where there is one; else Dormand and Prince's method with a tight tolerance, its own error being how far it moves when tolerance
/// and steps are halved. For a load that stays also the balance, by Newton and Raphson's method.
Reference reference_of(Scene const& scene);

}  // namespace work_precision
