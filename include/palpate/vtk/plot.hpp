// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/vtk/detail/chart_window.hpp>
#include <palpate/vtk/detail/off_screen.hpp>
#include <palpate/vtk/detail/plot_ink.hpp>
#include <palpate/vtk/plot_style.hpp>

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
#include <vector>

namespace palpate {

namespace detail {

/// Series differ by colour (Okabe and Ito's palette, told apart by colour-blind readers too, then five darker ones) and by mark, the thirteenth and later
/// ones by dashes as well.
struct SeriesLook {
  std::array<unsigned char, 3> colour;
  int mark, line;
};
inline SeriesLook look_of(std::size_t k) noexcept {
  constexpr std::array<std::array<unsigned char, 3>, plot_colours> colours{{{0, 114, 178}, {213, 94, 0}, {0, 158, 115}, {204, 121, 167}, {230, 159, 0}, {86, 180, 233},
                                                                            {0, 0, 0}, {136, 34, 85}, {128, 128, 128}, {51, 34, 136}, {122, 78, 30}, {140, 140, 30}}};
  constexpr std::array<int, 5> marks{vtkPlotPoints::CIRCLE, vtkPlotPoints::SQUARE, vtkPlotPoints::DIAMOND, vtkPlotPoints::CROSS, vtkPlotPoints::PLUS};
  return {colours[k % colours.size()], marks[k % marks.size()], k / colours.size() % 2 == 0 ? vtkPen::SOLID_LINE : vtkPen::DASH_LINE};
}

/// The frame of the axes in pixels from the lower left corner of the picture, and where the legend stands: in a corner of the frame where no line
/// comes, or to the right of a narrower frame.
struct PlotFrame {
  double left, bottom, width, height;
  int across = vtkChartLegend::CUSTOM, up = vtkChartLegend::CUSTOM;   // of the legend

  PlotFrame(std::span<PlotSeries const> series, PlotRange const& x, PlotRange const& y, PlotStyle const& style, double text_size)
      : left(0.11 * style.width), bottom(0.12 * style.height), width(0.86 * style.width), height(0.79 * style.height) {
    std::size_t letters = 0, rows = 0;
    for (PlotSeries const& one : series)
      if (!one.x.empty() && !one.label.empty()) letters = std::max(letters, one.label.size()), ++rows;
    double const wide = 40.0 + text_size * (1.5 + 0.6 * static_cast<double>(letters)), high = text_size * (1.5 + 1.6 * static_cast<double>(rows));
    for (int const vertical : {vtkChartLegend::TOP, vtkChartLegend::BOTTOM})
      for (int const horizontal : {vtkChartLegend::RIGHT, vtkChartLegend::LEFT}) {
        double const from = horizontal == vtkChartLegend::RIGHT ? width - wide : 0.0, under = vertical == vtkChartLegend::TOP ? height - high : 0.0;
        bool const free = std::none_of(series.begin(), series.end(), [&](PlotSeries const& one) {
          return crosses(one, x, y, [&](double a, double b) { return a >= from && a <= from + wide && b >= under && b <= under + high; });
        });
        if (!free || across != vtkChartLegend::CUSTOM) continue;
        across = horizontal, up = vertical;
      }
    if (across == vtkChartLegend::CUSTOM) width = 0.66 * style.width;
  }

  /// Is a point of the series, or of a line that joins its points, where inside(pixels across, pixels up) says so?
  bool crosses(PlotSeries const& one, PlotRange const& x, PlotRange const& y, auto const& inside) const {
    double before[2] = {-1.0, -1.0};
    for (std::size_t k = 0; k < one.x.size(); ++k) {
      if (one.gaps && std::isnan(one.y[k])) before[0] = -1.0;
      if (!x.fits(one.x[k]) || !y.fits(one.y[k])) continue;
      double const a = x.share(one.x[k]) * width, b = y.share(one.y[k]) * height;
      int const steps = one.lines && before[0] >= 0.0 ? 1 + static_cast<int>(std::hypot(a - before[0], b - before[1]) / 4.0) : 1;
      for (int s = 1; s <= steps; ++s) {
        double const share = steps == 1 ? 1.0 : static_cast<double>(s) / steps;
        if (inside(share == 1.0 ? a : before[0] + share * (a - before[0]), share == 1.0 ? b : before[1] + share * (b - before[1]))) return true;
      }
      before[0] = a, before[1] = b;
    }
    return false;
  }
};

/// Two heads on a line, at a third and at two thirds of its length.
inline void add_arrows(PlotInk& ink, PlotSeries const& one, PlotRange const& x, PlotRange const& y, PlotFrame const& frame, std::array<unsigned char, 3> colour) {
  struct Stretch {
    double left, bottom, across, up, length;
  };
  std::vector<Stretch> pieces;
  double length = 0.0, gone = 0.0, before[2] = {-1.0, -1.0};
  for (std::size_t k = 0; k < one.x.size(); ++k) {
    if (one.gaps && std::isnan(one.y[k])) before[0] = -1.0;
    if (!x.fits(one.x[k]) || !y.fits(one.y[k])) continue;
    double const left = frame.left + x.share(one.x[k]) * frame.width, bottom = frame.bottom + y.share(one.y[k]) * frame.height;
    if (before[0] >= 0.0) {
      pieces.push_back({before[0], before[1], left - before[0], bottom - before[1], std::hypot(left - before[0], bottom - before[1])});
      length += pieces.back().length;
    }
    before[0] = left, before[1] = bottom;
  }
  for (Stretch const& piece : pieces) {
    for (double const at : {length / 3.0, 2.0 * length / 3.0})
      if (double const share = (at - gone) / piece.length; share > 0.0 && share <= 1.0)
        ink.arrows.push_back({{static_cast<float>(piece.left + share * piece.across), static_cast<float>(piece.bottom + share * piece.up)},
                              {static_cast<float>(piece.across / piece.length), static_cast<float>(piece.up / piece.length)},
                              colour});
    gone += piece.length;
  }
}

}  // namespace detail

/// Draws series into a PNG file, with a legend in a free corner, or beside them. Points that are not finite or do not fit an axis are left out, and
/// their line goes on to the next; see PlotSeries::gaps.
/// Errors     `InvalidArgument` when x and y of a series differ in number, no point is left, or an axis has an end that it can not show; `FileError` without a
///            display (see `VirtualDisplay`) or when the file can not be written; none is left half-written.
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
  int const text_size = std::max(10, style.height / 40);
  detail::PlotFrame const frame(series, across, up, style, text_size);
  auto const left = static_cast<float>(frame.left), bottom = static_cast<float>(frame.bottom), width = static_cast<float>(frame.width),
             height = static_cast<float>(frame.height);
  chart->SetSize(vtkRectf(left, bottom, width, height));
  vtkNew<detail::PlotInk> ink;
  ink->text_size = text_size;
  if (!style.title.empty()) window.set_title(style.title, text_size);

  for (std::size_t s = 0; s < series.size(); ++s) {
    PlotSeries const& one = series[s];
    vtkNew<vtkDoubleArray> x, y;
    x->SetName("x");
    y->SetName(one.label.empty() ? "y" : one.label.c_str());
    for (std::size_t k = 0; k < one.x.size(); ++k)
      if (across.fits(one.x[k]) && (up.fits(one.y[k]) || (one.gaps && std::isnan(one.y[k])))) {
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
    if (one.arrows) detail::add_arrows(*ink, one, across, up, frame, look.colour);
  }

  across.put_on(chart->GetAxis(vtkAxis::BOTTOM), style.x.title, *ink, {left, bottom}, {width, 0.0F});
  up.put_on(chart->GetAxis(vtkAxis::LEFT), style.y.title, *ink, {left, bottom}, {0.0F, height});
  window.add(ink);
  chart->SetShowLegend(true);
  chart->GetLegend()->SetLabelSize(text_size);
  chart->GetLegend()->SetSymbolWidth(40);   // so that dashes are seen
  chart->GetLegend()->SetInline(frame.across != vtkChartLegend::CUSTOM);
  chart->GetLegend()->SetDragEnabled(false);
  chart->GetLegend()->SetHorizontalAlignment(frame.across);
  chart->GetLegend()->SetVerticalAlignment(frame.up);
  if (frame.across == vtkChartLegend::CUSTOM) chart->GetLegend()->SetPoint(left + width + 0.01F * static_cast<float>(style.width), bottom);
  chart->GetLegend()->GetPen()->SetOpacity(0);
  chart->GetLegend()->GetBrush()->SetOpacity(0);
  window.write(file);
}

}  // namespace palpate
