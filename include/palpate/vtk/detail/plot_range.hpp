// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/vtk/detail/chart_window.hpp>
#include <palpate/vtk/plot_axis.hpp>

#include <vtkAxis.h>
#include <vtkDoubleArray.h>
#include <vtkNew.h>
#include <vtkStringArray.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

namespace palpate::detail {

/// What an axis shows: grows with the points, then is rounded to whole ticks. A logarithmic axis is drawn as a plain one of decades.
class PlotRange {
 public:
  explicit PlotRange(PlotAxis const& axis) : logarithmic_(axis.logarithmic) {
    if (axis.from == axis.to) return;
    given_ = true;
    low_ = place(std::min(axis.from, axis.to));
    high_ = place(std::max(axis.from, axis.to));
  }

  double place(double value) const { return logarithmic_ ? std::log10(value) : value; }
  bool fits(double value) const {
    double const at = place(value);
    return std::isfinite(at) && (!given_ || (at >= low_ && at <= high_));
  }
  void include(double value) {
    any_ = true;
    if (given_) return;
    low_ = std::min(low_, place(value));
    high_ = std::max(high_, place(value));
  }
  bool is_empty() const { return !any_; }

  /// Whole ticks on both sides; at most nine of them.
  void round() {
    double const span = high_ - low_;
    if (logarithmic_) {
      tick_ = std::max(1.0, std::ceil(span / 8));
    } else {
      double const rough = span > 0 ? span / 6 : std::max(1e-12, std::abs(low_));
      double const decade = std::pow(10.0, std::floor(std::log10(rough)));
      tick_ = decade * (rough > 5 * decade ? 10 : rough > 2 * decade ? 5 : rough > decade ? 2 : 1);
    }
    if (given_) return;
    low_ = tick_ * std::floor(low_ / tick_ + 1e-9);
    high_ = tick_ * std::ceil(high_ / tick_ - 1e-9);
    if (!(high_ > low_)) high_ = low_ + tick_;
  }

  void put_on(vtkAxis* axis, std::string const& title, int text_size) const {
    vtkNew<vtkDoubleArray> places;
    vtkNew<vtkStringArray> labels;
    for (double k = std::ceil(low_ / tick_ - 1e-9); k * tick_ <= high_ + 1e-9 * tick_; ++k) {
      char text[32];
      if (logarithmic_)
        std::snprintf(text, sizeof text, "1e%d", static_cast<int>(std::lround(k * tick_)));
      else
        std::snprintf(text, sizeof text, "%g", k == 0 ? 0.0 : k * tick_);
      places->InsertNextValue(k * tick_);
      labels->InsertNextValue(logarithmic_ && std::lround(k * tick_) == 0 ? "1" : text);
    }
    dress_axis(axis, title, text_size);
    axis->SetRange(low_, high_);
    axis->SetCustomTickPositions(places, labels);
  }

 private:
  bool logarithmic_, given_ = false, any_ = false;
  double low_ = std::numeric_limits<double>::infinity(), high_ = -std::numeric_limits<double>::infinity(), tick_ = 1;
};

}  // namespace palpate::detail
