// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/vtk/detail/chart_window.hpp>
#include <palpate/vtk/detail/off_screen.hpp>
#include <palpate/vtk/detail/plot_range.hpp>
#include <palpate/vtk/plot_axis.hpp>

#include <vtkAxis.h>
#include <vtkBrush.h>
#include <vtkChartLegend.h>
#include <vtkChartXY.h>
#include <vtkDoubleArray.h>
#include <vtkNew.h>
#include <vtkPen.h>
#include <vtkPlotPoints.h>
#include <vtkTable.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace palpate {

/// Values over values. A series without points is left out, and the others keep the colours and marks they have with it.
struct PlotSeries {
  std::string label{};
  std::vector<double> x{}, y{};
  bool lines = true;   ///< joins the points in their order
  bool marks = true;
};

struct PlotStyle {
  int width = 1280;   ///< pixels
  int height = 800;
  std::string title{};
  PlotAxis x{}, y{};
};

namespace detail {

/// Series differ by colour (Okabe and Ito's palette, told apart by colour-blind readers too) and by mark, the eighth and later ones by dashes as well.
struct SeriesLook {
  std::array<unsigned char, 3> colour;
  int mark, line;
};
inline SeriesLook look_of(std::size_t k) noexcept {
  constexpr std::array<std::array<unsigned char, 3>, 7> colours{
      {{0, 114, 178}, {213, 94, 0}, {0, 158, 115}, {204, 121, 167}, {230, 159, 0}, {86, 180, 233}, {0, 0, 0}}};
  constexpr std::array<int, 5> marks{vtkPlotPoints::CIRCLE, vtkPlotPoints::SQUARE, vtkPlotPoints::DIAMOND, vtkPlotPoints::CROSS, vtkPlotPoints::PLUS};
  return {colours[k % colours.size()], marks[k % marks.size()], k / colours.size() % 2 == 0 ? vtkPen::SOLID_LINE : vtkPen::DASH_LINE};
}

/// The frame of the axes, as shares of the picture from its left and lower edge; the legend stands to the right of it.
inline constexpr double plot_left = 0.11, plot_right = 0.77, plot_bottom = 0.12, plot_top = 0.91;

}  // namespace detail

/// Draws series into a PNG file, with a legend beside them. Points that are not finite or do not fit an axis are left out, and their line goes on to the next.
/// Errors     `InvalidArgument` when x and y of a series differ in number, or no point is left; `FileError` without a display (see
///            `VirtualDisplay`) or when the file can not be written; none is left half-written.
inline void write_plot(std::filesystem::path const& file, std::span<PlotSeries const> series, PlotStyle const& style = {}) {
  detail::require_chart_size(style.width, style.height);
  detail::PlotRange across(style.x), up(style.y);
  for (PlotSeries const& one : series) {
    if (one.x.size() != one.y.size())
      throw InvalidArgument(detail::message("the series '", one.label, "' has ", one.x.size(), " values across and ", one.y.size(), " up; give as many"));
    for (std::size_t k = 0; k < one.x.size(); ++k)
      if (across.fits(one.x[k]) && up.fits(one.y[k])) across.include(one.x[k]), up.include(one.y[k]);
  }
  if (across.is_empty()) throw InvalidArgument(detail::message("can not draw ", file.string(), ": no point is left"));
  across.round(), up.round();
  detail::require_display(file);

  detail::ChartWindow window(style.width, style.height);
  vtkChartXY* const chart = window.chart();
  chart->SetAutoSize(false);
  chart->SetLayoutStrategy(vtkChart::AXES_TO_RECT);
  auto const width = static_cast<float>(style.width), height = static_cast<float>(style.height);
  chart->SetSize(vtkRectf(static_cast<float>(detail::plot_left) * width, static_cast<float>(detail::plot_bottom) * height,
                          static_cast<float>(detail::plot_right - detail::plot_left) * width,
                          static_cast<float>(detail::plot_top - detail::plot_bottom) * height));
  int const text_size = std::max(10, style.height / 40);
  if (!style.title.empty()) window.set_title(style.title, text_size);

  for (std::size_t s = 0; s < series.size(); ++s) {
    PlotSeries const& one = series[s];
    vtkNew<vtkDoubleArray> x, y;
    x->SetName("x");
    y->SetName(one.label.empty() ? "y" : one.label.c_str());
    for (std::size_t k = 0; k < one.x.size(); ++k)
      if (across.fits(one.x[k]) && up.fits(one.y[k])) {
        x->InsertNextValue(across.place(one.x[k]));
        y->InsertNextValue(up.place(one.y[k]));
      }
    if (x->GetNumberOfValues() == 0) continue;
    if (x->GetNumberOfValues() == 1) {   // VTK draws no single points
      x->InsertNextValue(x->GetValue(0));
      y->InsertNextValue(y->GetValue(0));
    }
    vtkNew<vtkTable> table;
    table->AddColumn(x);
    table->AddColumn(y);
    auto* const plot = vtkPlotPoints::SafeDownCast(chart->AddPlot(one.lines ? vtkChart::LINE : vtkChart::POINTS));
    detail::SeriesLook const look = detail::look_of(s);
    plot->SetInputData(table, 0, 1);
    plot->SetColor(look.colour[0], look.colour[1], look.colour[2], 255);
    plot->SetWidth(static_cast<float>(std::max(1.5, style.height / 400.0)));
    plot->GetPen()->SetLineType(look.line);
    plot->SetMarkerStyle(one.marks ? look.mark : vtkPlotPoints::NONE);
    plot->SetMarkerSize(static_cast<float>(style.height / 70.0));
    plot->SetLabel(one.label);
  }

  across.put_on(chart->GetAxis(vtkAxis::BOTTOM), style.x.title, text_size);
  up.put_on(chart->GetAxis(vtkAxis::LEFT), style.y.title, text_size);
  chart->SetShowLegend(true);
  chart->GetLegend()->SetLabelSize(text_size);
  chart->GetLegend()->SetInline(false);
  chart->GetLegend()->SetDragEnabled(false);
  chart->GetLegend()->SetHorizontalAlignment(vtkChartLegend::CUSTOM);
  chart->GetLegend()->SetVerticalAlignment(vtkChartLegend::CUSTOM);
  chart->GetLegend()->SetPoint(static_cast<float>(detail::plot_right + 0.01) * width, static_cast<float>(detail::plot_bottom) * height);
  chart->GetLegend()->GetPen()->SetOpacity(0);
  window.write(file);
}

}  // namespace palpate
