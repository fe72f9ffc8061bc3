// SPDX-License-Identifier: MIT
#include "charts.hpp"

#include <palpate/vtk/detail/chart_window.hpp>

#include <vtkAxis.h>
#include <vtkPen.h>
#include <vtkPlotLine.h>
#include <vtkStringArray.h>
#include <vtkTextProperty.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace viewer {

namespace {

constexpr int text_size = 12;

/// The smallest of 1, 2, 5, 10, 20 … that is not below the value.
double round_up(double value) {
  double const decade = std::pow(10.0, std::floor(std::log10(value)));
  for (double const step : {1.0, 2.0, 5.0})
    if (value <= step * decade * (1.0 + 1e-9)) return step * decade;
  return 10.0 * decade;
}

}  // namespace

LiveChart::LiveChart(std::string const& title, Colour const& colour) {
  chart_->SetAutoSize(false);
  chart_->SetLayoutStrategy(vtkChart::AXES_TO_RECT);   // both charts' axes lie one below the other, however long their labels
  chart_->SetInteractive(false);
  chart_->SetShowLegend(false);
  chart_->SetTitle(title);
  chart_->GetTitleProperties()->SetFontSize(13);
  chart_->GetTitleProperties()->SetColor(0.20, 0.24, 0.28);
  times_->SetName("time [s]");
  values_->SetName(title.c_str());
  table_->AddColumn(times_);
  table_->AddColumn(values_);
  line_ = chart_->AddPlot(vtkChart::LINE);
  auto const byte = [](double share) { return static_cast<unsigned char>(std::lround(255.0 * share)); };
  line_->SetColor(byte(colour[0]), byte(colour[1]), byte(colour[2]), 255);
  line_->SetWidth(2.2f);
  for (int const side : {vtkAxis::BOTTOM, vtkAxis::LEFT}) {
    vtkAxis* const axis = chart_->GetAxis(side);
    palpate::detail::dress_axis(axis, side == vtkAxis::BOTTOM ? "time [s]" : "", text_size);
    axis->GetLabelProperties()->SetColor(0.35, 0.40, 0.45);
    axis->GetTitleProperties()->SetColor(0.35, 0.40, 0.45);
    axis->GetPen()->SetColor(150, 158, 165, 255);
    axis->SetNumberOfTicks(side == vtkAxis::BOTTOM ? 6 : 5);
  }
}

void LiveChart::place(Box const& box) {
  constexpr double left = 52.0, below = 42.0, right = 16.0, above = 30.0;   // pixels, for the letters
  chart_->SetSize(vtkRectf(static_cast<float>(box.x + left), static_cast<float>(box.y + below), static_cast<float>(box.width - left - right),
                           static_cast<float>(box.height - below - above)));
}

void LiveChart::show(std::vector<double> const& times, std::vector<double> const& values, double now, double lowest, double at_least) {
  double low = lowest, high = at_least;
  times_->SetNumberOfValues(static_cast<vtkIdType>(times.size()));
  values_->SetNumberOfValues(static_cast<vtkIdType>(values.size()));
  for (std::size_t i = 0; i < values.size(); ++i) {
    times_->SetValue(static_cast<vtkIdType>(i), times[i]);
    values_->SetValue(static_cast<vtkIdType>(i), values[i]);
    low = std::min(low, values[i]);
    high = std::max(high, values[i]);
  }
  high = round_up(1.05 * high);
  double const step = round_up((high - low) / 5.0);
  low = low < -0.05 * high ? std::floor(low / step) * step : 0.0;   // what a pressed organ gives back may be a trifle more
  times_->Modified();
  values_->Modified();
  table_->Modified();
  line_->SetVisible(values.size() > 1);
  if (values.size() > 1) line_->SetInputData(table_, 0, 1);
  double const end = std::max(now, chart_seconds);
  chart_->GetAxis(vtkAxis::BOTTOM)->SetRange(end - chart_seconds, end);
  vtkAxis* const up = chart_->GetAxis(vtkAxis::LEFT);
  up->SetRange(low - 0.02 * (high - low), high);
  vtkNew<vtkDoubleArray> ticks;
  vtkNew<vtkStringArray> labels;
  for (double k = std::round(low / step); k * step <= high * (1.0 + 1e-9); k += 1.0) {
    char text[32];
    std::snprintf(text, sizeof text, "%g", k * step);
    ticks->InsertNextValue(k * step);
    labels->InsertNextValue(text);
  }
  up->SetCustomTickPositions(ticks, labels);
  chart_->RecalculateBounds();
}

std::array<double, 2> LiveChart::pixel(double time, double value) const {
  auto const along = [](vtkAxis* axis, int component, double at) {
    double const share = (at - axis->GetMinimum()) / (axis->GetMaximum() - axis->GetMinimum());
    return axis->GetPoint1()[component] + share * (axis->GetPoint2()[component] - axis->GetPoint1()[component]);
  };
  return {along(chart_->GetAxis(vtkAxis::BOTTOM), 0, time), along(chart_->GetAxis(vtkAxis::LEFT), 1, value)};
}

void Charts::add_to(vtkContextScene* scene) {
  force_.add_to(scene);
  energy_.add_to(scene);
}

void Charts::place(Layout const& layout) {
  force_.place(layout.force_chart);
  energy_.place(layout.energy_chart);
}

void Charts::show(Live const& live) {
  std::vector<double> times, forces, energies;
  for (ChartSample const& sample : live.chart) {
    times.push_back(sample.time);
    forces.push_back(sample.force);
    energies.push_back(1000.0 * sample.energy);
  }
  force_.show(times, forces, live.time, 0.0, 0.9);
  energy_.show(times, energies, live.time, 0.0, 4.5);
}

}  // namespace viewer
