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

/// What a sample is drawn as: its phase, after the puncture by the way the tool goes.
enum class ForcePart { no_contact, indenting, loading, unloading };

constexpr char const* to_string(ForcePart part) noexcept {
  switch (part) {
    case ForcePart::no_contact: return "no contact";
    case ForcePart::indenting: return "indenting";
    case ForcePart::loading: return "loading";
    case ForcePart::unloading: return "unloading";
  }
  return "";
}

constexpr Colour colour_of(ForcePart part) noexcept {
  switch (part) {   // told apart by colour-blind readers too (Okabe and Ito's palette)
    case ForcePart::no_contact: return {153, 153, 153};
    case ForcePart::indenting: return {0, 114, 178};
    case ForcePart::loading: return {213, 94, 0};
    case ForcePart::unloading: return {0, 158, 115};
  }
  return {0, 0, 0};
}

/// A turn counts where the tool then goes a fiftieth of the largest depth back: a hand trembles.
inline std::vector<ForcePart> parts_of(std::span<ForceSample const> samples) {
  double deepest = 0.0;
  for (ForceSample const& sample : samples)
    if (std::isfinite(sample.depth)) deepest = std::max(deepest, sample.depth);
  double const turn = deepest / 50.0;
  std::vector<ForcePart> parts(samples.size(), ForcePart::no_contact);
  bool deeper = true;
  std::size_t farthest = samples.size();   // where the present way has come to; none yet in this stroke
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples[i].phase != CuttingPhase::moving) {
      parts[i] = samples[i].phase == CuttingPhase::indenting ? ForcePart::indenting : ForcePart::no_contact;
      deeper = true;
      farthest = samples.size();
      continue;
    }
    parts[i] = deeper ? ForcePart::loading : ForcePart::unloading;
    if (!std::isfinite(samples[i].depth)) continue;
    double const ahead = farthest == samples.size() ? 0.0 : (samples[i].depth - samples[farthest].depth) * (deeper ? 1.0 : -1.0);
    if (ahead >= 0.0) {
      farthest = i;
    } else if (ahead < -turn) {
      deeper = !deeper;
      std::fill(parts.begin() + static_cast<std::ptrdiff_t>(farthest) + 1, parts.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                deeper ? ForcePart::loading : ForcePart::unloading);
      farthest = i;
    }
  }
  return parts;
}

/// A line through the samples, in the colour of their parts; gaps between two runs of a phase are bridged by the later one.
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
  auto const parts = parts_of(samples);
  for (ForcePart const part : {ForcePart::no_contact, ForcePart::indenting, ForcePart::loading, ForcePart::unloading}) {
    vtkNew<vtkDoubleArray> across, up;
    across->SetName(x_title);
    up->SetName(to_string(part));
    constexpr double gap = std::numeric_limits<double>::quiet_NaN();
    for (std::size_t i = 0; i < samples.size(); ++i) {
      ForceSample const& sample = samples[i];
      if (!std::isfinite(x(sample)) || !std::isfinite(sample.force)) continue;
      smallest_x = std::min(smallest_x, x(sample));
      largest_x = std::max(largest_x, x(sample));
      largest_force = std::max(largest_force, sample.force);
      bool const here = parts[i] == part;
      bool const joins = i + 1 < samples.size() && parts[i + 1] == part;   // the line begins at the end of the one before
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
    Colour const colour = colour_of(part);
    line->SetColor(colour.red, colour.green, colour.blue, 255);
    line->SetWidth(static_cast<float>(std::max(1.5, style.height / 400.0)));
    line->SetLabel(to_string(part));
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

/// Draws force over time into a PNG file, its parts in colour: grey without contact, blue indenting, then orange on the way in and green on the way back.
/// Errors     `FileError` without a display (see `VirtualDisplay`) or when the file can not be written; none is left half-written.
inline void write_force_time_chart(std::filesystem::path const& file, std::span<ForceSample const> samples,
                                   ChartStyle const& style = {}) {
  detail::write_force_chart(file, samples, style, "Force on the hand over time", "time [s]",
                            vtkChartLegend::RIGHT,   // the force is largest early, at the puncture
                            [](ForceSample const& sample) { return sample.time; });
}

/// Draws force over depth (in mm) into a PNG file, in the same colours: loading and unloading show as two curves that meet.
inline void write_force_depth_chart(std::filesystem::path const& file, std::span<ForceSample const> samples,
                                    ChartStyle const& style = {}) {
  detail::write_force_chart(file, samples, style, "Force on the hand over depth below the undeformed surface", "depth [mm]",
                            vtkChartLegend::LEFT,
                            [](ForceSample const& sample) { return 1000.0 * sample.depth; });
}

}  // namespace palpate
