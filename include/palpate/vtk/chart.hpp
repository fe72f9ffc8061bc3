// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/phase.hpp>
#include <palpate/vtk/detail/chart_window.hpp>
#include <palpate/vtk/detail/off_screen.hpp>

#include <vtkAxis.h>
#include <vtkChartLegend.h>
#include <vtkChartXY.h>
#include <vtkDoubleArray.h>
#include <vtkNew.h>
#include <vtkPlot.h>
#include <vtkTable.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace palpate {

/// One point of a force chart. Units: s, m, N.
struct ForceSample {
  double time = 0.0;
  double depth = 0.0;
  double force = 0.0;
  CuttingPhase phase = CuttingPhase::no_contact;
};

struct ChartStyle {
  int width = 1280;   ///< pixels
  int height = 800;
  std::string title;  ///< empty: one that says what is shown
};

namespace detail {

struct Colour {
  unsigned char red, green, blue;
};

constexpr Colour colour_of(CuttingPhase phase) noexcept {
  switch (phase) {   // told apart by colour-blind readers too (Okabe and Ito's palette)
    case CuttingPhase::no_contact: return {153, 153, 153};
    case CuttingPhase::indenting: return {0, 114, 178};
    case CuttingPhase::moving: return {213, 94, 0};
  }
  return {0, 0, 0};
}

/// A line through the samples, in the colour of their phases; gaps between two runs of a phase are bridged by the later one.
template <class X>
void write_force_chart(std::filesystem::path const& file, std::span<ForceSample const> samples, ChartStyle const& style,
                       std::string const& title, char const* x_title, int legend, X const& x) {
  if (samples.empty()) throw InvalidArgument(message("can not draw ", file.string(), ": there are no samples"));
  require_chart_size(style.width, style.height);
  require_display(file);

  ChartWindow window(style.width, style.height);
  vtkChartXY* const chart = window.chart();

  int const text_size = std::max(10, style.height / 36);
  window.set_title(style.title.empty() ? title : style.title, text_size);
  chart->SetShowLegend(true);
  chart->GetLegend()->SetLabelSize(text_size);
  chart->GetLegend()->SetHorizontalAlignment(legend);
  chart->GetLegend()->SetVerticalAlignment(vtkChartLegend::TOP);

  double largest_force = 0.0, smallest_x = x(samples.front()), largest_x = smallest_x;
  for (CuttingPhase const phase : {CuttingPhase::no_contact, CuttingPhase::indenting, CuttingPhase::moving}) {
    vtkNew<vtkDoubleArray> across, up;
    across->SetName(x_title);
    up->SetName(to_string(phase));
    constexpr double gap = std::numeric_limits<double>::quiet_NaN();
    for (std::size_t i = 0; i < samples.size(); ++i) {
      ForceSample const& sample = samples[i];
      if (!std::isfinite(x(sample)) || !std::isfinite(sample.force)) continue;
      smallest_x = std::min(smallest_x, x(sample));
      largest_x = std::max(largest_x, x(sample));
      largest_force = std::max(largest_force, sample.force);
      bool const here = sample.phase == phase;
      bool const joins = i + 1 < samples.size() && samples[i + 1].phase == phase;   // the line begins at the end of the one before
      if (here || joins) {
        across->InsertNextValue(x(sample));
        up->InsertNextValue(sample.force);
      }
      if (here && !joins) {
        across->InsertNextValue(x(sample));
        up->InsertNextValue(gap);
      }
    }
    if (up->GetNumberOfValues() < 2) continue;
    vtkNew<vtkTable> table;
    table->AddColumn(across);
    table->AddColumn(up);
    vtkPlot* const line = chart->AddPlot(vtkChart::LINE);
    line->SetInputData(table, 0, 1);
    Colour const colour = colour_of(phase);
    line->SetColor(colour.red, colour.green, colour.blue, 255);
    line->SetWidth(static_cast<float>(std::max(1.5, style.height / 400.0)));
    line->SetLabel(to_string(phase));
  }

  dress_axis(chart->GetAxis(vtkAxis::BOTTOM), x_title, text_size);
  dress_axis(chart->GetAxis(vtkAxis::LEFT), "force [N]", text_size);
  if (!(largest_x > smallest_x)) largest_x = smallest_x + 1e-3;
  double const height = largest_force > 0.0 ? largest_force : 1.0;
  chart->GetAxis(vtkAxis::BOTTOM)->SetRange(smallest_x, largest_x);
  chart->GetAxis(vtkAxis::LEFT)->SetRange(-0.02 * height, 1.08 * height);   // zero is seen above the axis
  window.write(file);
}

}  // namespace detail

/// Draws force over time into a PNG file, the phases of the cut in colour: grey without contact, blue indenting, orange moving.
/// Errors     `FileError` without a display (see `VirtualDisplay`) or when the file can not be written; none is left half-written.
inline void write_force_time_chart(std::filesystem::path const& file, std::span<ForceSample const> samples,
                                   ChartStyle const& style = {}) {
  detail::write_force_chart(file, samples, style, "Force on the hand over time", "time [s]",
                            vtkChartLegend::RIGHT,   // the force is largest early, at the puncture
                            [](ForceSample const& sample) { return sample.time; });
}

/// Draws force over depth (in mm) into a PNG file, in the same colours: loading and unloading show as a loop.
inline void write_force_depth_chart(std::filesystem::path const& file, std::span<ForceSample const> samples,
                                    ChartStyle const& style = {}) {
  detail::write_force_chart(file, samples, style, "Force on the hand over depth below the undeformed surface", "depth [mm]",
                            vtkChartLegend::LEFT,
                            [](ForceSample const& sample) { return 1000.0 * sample.depth; });
}

}  // namespace palpate
