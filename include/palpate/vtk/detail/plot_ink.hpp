// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/vtk/detail/chart_window.hpp>
#include <palpate/vtk/plot_style.hpp>

#include <vtkAxis.h>
#include <vtkBrush.h>
#include <vtkContext2D.h>
#include <vtkContextItem.h>
#include <vtkDoubleArray.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPen.h>
#include <vtkStringArray.h>
#include <vtkTextProperty.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

namespace palpate::detail {

/// What VTK's charts can not draw: powers of ten with their exponents raised, and arrow heads on lines. In pixels from the lower left corner.
class PlotInk : public vtkContextItem {
 public:
  vtkTypeMacro(PlotInk, vtkContextItem);
  static PlotInk* New() { VTK_STANDARD_NEW_BODY(PlotInk); }

  struct Power {
    float x, y;   ///< where the label is centred, or ends when it stands to the left of an axis
    int exponent;
    bool ends;
  };
  struct Arrow {
    std::array<float, 2> middle, way;   ///< way of length 1
    std::array<unsigned char, 3> colour;
  };
  int text_size = 14;
  std::vector<Power> powers{};
  std::vector<Arrow> arrows{};

  bool Paint(vtkContext2D* painter) override {
    auto const size = static_cast<float>(text_size);
    for (Power const& power : powers) {
      std::string const ten = power.exponent == 0 ? "1" : "10", raised = power.exponent == 0 ? "" : exponent_text(power.exponent);
      float const wide = width(painter, ten, text_size), small = raised.empty() ? 0.0F : width(painter, raised, text_size * 7 / 10);
      float const left = power.ends ? power.x - wide - small : power.x - (wide + small) / 2;
      write(painter, ten, left, power.y, text_size);
      if (!raised.empty()) write(painter, raised, left + wide, power.y + 0.4F * size, text_size * 7 / 10);
    }
    for (Arrow const& arrow : arrows) {
      auto const [x, y] = arrow.middle;
      float const along = 0.5F * size, aside = 0.3F * size;
      painter->GetPen()->SetColor(arrow.colour[0], arrow.colour[1], arrow.colour[2], 255);
      painter->GetPen()->SetLineType(vtkPen::SOLID_LINE);
      painter->GetBrush()->SetColor(arrow.colour[0], arrow.colour[1], arrow.colour[2], 255);
      std::array<float, 6> corners{x + along * arrow.way[0], y + along * arrow.way[1],
                                   x - along * arrow.way[0] - aside * arrow.way[1], y - along * arrow.way[1] + aside * arrow.way[0],
                                   x - along * arrow.way[0] + aside * arrow.way[1], y - along * arrow.way[1] - aside * arrow.way[0]};
      painter->DrawPolygon(corners.data(), 3);
    }
    return true;
  }

 protected:
  PlotInk() = default;

 private:
  static std::string exponent_text(int exponent) { return (exponent < 0 ? "\xE2\x88\x92" : "") + std::to_string(std::abs(exponent)); }   // a minus sign

  static void letters(vtkContext2D* painter, int points) {
    painter->GetTextProp()->SetFontSize(points);
    painter->GetTextProp()->SetColor(0.0, 0.0, 0.0);
    painter->GetTextProp()->SetOpacity(1.0);
    painter->GetTextProp()->SetOrientation(0.0);
    painter->GetTextProp()->SetJustificationToLeft();
    painter->GetTextProp()->SetVerticalJustificationToBottom();
  }
  static float width(vtkContext2D* painter, std::string const& text, int points) {
    letters(painter, points);
    std::array<float, 4> box{};
    painter->ComputeStringBounds(text.c_str(), box.data());
    return box[2] + 1.0F;
  }
  static void write(vtkContext2D* painter, std::string const& text, float x, float y, int points) {
    letters(painter, points);
    float const space = width(painter, ' ' + text, points) - width(painter, text, points);
    painter->DrawString(std::round(x - space), std::round(y), (' ' + text + ' ').c_str());   // without spaces a stroke at an edge shows at the other edge too
  }
};

/// What an axis shows: grows with the points, then is rounded to whole ticks. A logarithmic axis is drawn as a plain one of decades.
class PlotRange {
 public:
  explicit PlotRange(PlotAxis const& axis) : logarithmic_(axis.logarithmic) {
    if (axis.from == axis.to) return;
    given_ = true;
    low_ = place(std::min(axis.from, axis.to));
    high_ = place(std::max(axis.from, axis.to));
    if (!std::isfinite(low_) || !std::isfinite(high_) || !std::isfinite(high_ - low_))
      throw InvalidArgument(message("the axis \"", axis.title, "\" goes from ", axis.from, " to ", axis.to, "; give finite ends, above 0 where it is logarithmic"));
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

  /// Whole ticks on both sides; at most nine of them. Values that differ by rounding are one.
  void round() {
    double const size = std::max(std::abs(low_), std::abs(high_)), span = high_ - low_ > 1e-9 * size ? high_ - low_ : 0;
    if (!std::isfinite(span)) throw InvalidArgument(message("values from ", low_, " to ", high_, " have no place on one axis"));
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

  /// Where a value lies between the ends of the axis: 0 … 1.
  double share(double value) const { return (place(value) - low_) / (high_ - low_); }

  /// The powers of ten of a logarithmic axis are drawn by `ink`: at (x, y) begins the axis, `way` [pixels] leads to its end.
  void put_on(vtkAxis* axis, std::string const& title, PlotInk& ink, std::array<float, 2> begin, std::array<float, 2> way) const {
    float const gap = 0.5F * static_cast<float>(ink.text_size);
    vtkNew<vtkDoubleArray> places;
    vtkNew<vtkStringArray> labels;
    int const digits = std::max(6, 2 + static_cast<int>(std::log10(std::max({std::abs(low_), std::abs(high_), tick_}) / tick_)));
    for (double k = std::ceil(low_ / tick_ - 1e-9); k * tick_ <= high_ + 1e-9 * tick_; ++k) {
      char text[32];
      if (logarithmic_) {
        auto const at = static_cast<float>((k * tick_ - low_) / (high_ - low_));
        bool const up = way[1] > way[0];
        int const exponent = static_cast<int>(std::lround(k * tick_));
        ink.powers.push_back({begin[0] + at * way[0] - (up ? gap : 0.0F), begin[1] + at * way[1] - (up ? gap : 7.0F + 2.3F * gap), exponent, up});
        std::snprintf(text, sizeof text, "1e%d", exponent);   // not seen, keeps the place
      } else {
        std::snprintf(text, sizeof text, "%.*g", digits, k == 0 ? 0.0 : k * tick_);
      }
      places->InsertNextValue(k * tick_);
      labels->InsertNextValue(text);
    }
    dress_axis(axis, title, ink.text_size);
    if (logarithmic_) axis->GetLabelProperties()->SetOpacity(0.0);
    axis->SetRange(low_, high_);
    axis->SetCustomTickPositions(places, labels);
  }

 private:
  bool logarithmic_, given_ = false, any_ = false;
  double low_ = std::numeric_limits<double>::infinity(), high_ = -std::numeric_limits<double>::infinity(), tick_ = 1;
};

}  // namespace palpate::detail
