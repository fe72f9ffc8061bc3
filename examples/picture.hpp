// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/vtk/plot_style.hpp>

#include <cstddef>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

/// What the programs share that draw the pictures of a page of the manual.
namespace drawing {

/// In the order of write_plot's palette.
enum Colour : std::size_t { blue, orange, green, pink, yellow, sky, black, colours = palpate::plot_colours };

/// One chart: what is drawn, and the numbers that the page with it quotes.
class Picture {
 public:
  Picture(std::string name, std::string title, std::string across, std::string up) : name_(std::move(name)), series_(3 * colours) {
    style_.width = 1000, style_.height = 560;
    style_.title = std::move(title);
    style_.x.title = std::move(across), style_.y.title = std::move(up);
  }

  // write_plot gives the second twelve series dashes; each is labelled once.
  palpate::PlotSeries& line(Colour colour, std::string label) { return add(colour, std::move(label), true, false); }
  palpate::PlotSeries& dashes(Colour colour, std::string label) { return add(colours + colour, std::move(label), true, false); }
  palpate::PlotSeries& dots(Colour colour, std::string label) { return add(2 * colours + colour, std::move(label), false, true); }

  palpate::PlotAxis& x() { return style_.x; }
  palpate::PlotAxis& y() { return style_.y; }

  void quote(char const* format, auto... values) {
    char text[256];
    std::snprintf(text, sizeof text, format, values...);
    numbers_ += "  " + std::string(text) + '\n';
  }

  std::string const& name() const { return name_; }
  std::string const& numbers() const { return numbers_; }
  std::vector<palpate::PlotSeries> const& series() const { return series_; }
  palpate::PlotStyle const& style() const { return style_; }

 private:
  palpate::PlotSeries& add(std::size_t place, std::string label, bool lines, bool marks) {
    palpate::PlotSeries& series = series_[place];
    series.label = std::move(label);
    series.lines = lines, series.marks = marks;
    return series;
  }

  std::string name_, numbers_;
  std::vector<palpate::PlotSeries> series_;
  palpate::PlotStyle style_;
};

/// Adds a point, both in the units of the axes.
inline void add(palpate::PlotSeries& series, double x, double y) { series.x.push_back(x), series.y.push_back(y); }

/// value(x) at evenly spaced places.
template <class Value>
void sample(palpate::PlotSeries& series, double from, double to, double unit, Value value, int steps = 400) {
  for (int k = 0; k <= steps; ++k) {
    double const x = from + (to - from) * k / steps;
    add(series, unit * x, value(x));
  }
}

}  // namespace drawing
