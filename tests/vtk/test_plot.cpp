// SPDX-License-Identifier: MIT
// Yardstick: where a value belongs on its axis, worked out by hand, and the pixels that VTK's reader finds there.
#include "catch.hpp"
#include "scratch_folder.hpp"
#include "skip.hpp"

#include <palpate/vtk/plot.hpp>
#include <palpate/vtk/virtual_display.hpp>

#include <vtkAxis.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGReader.h>
#include <vtkStringArray.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

using namespace palpate;

namespace {

/// How many pixels within `reach` of a point of the frame, in shares of the frame from its lower left corner, have this colour.
int pixels_at(std::filesystem::path const& file, double across, double up, int reach, std::array<int, 3> const& colour, double right = 0.97) {
  vtkNew<vtkPNGReader> reader;
  reader->SetFileName(file.string().c_str());
  reader->Update();
  auto* const image = reader->GetOutput();
  int const width = image->GetDimensions()[0], height = image->GetDimensions()[1];
  int const x = static_cast<int>(std::lround((0.11 + (right - 0.11) * across) * width));
  int const y = static_cast<int>(std::lround((0.12 + (0.91 - 0.12) * up) * height));
  int found = 0;
  for (int row = y - reach; row <= y + reach; ++row)
    for (int column = x - reach; column <= x + reach; ++column) {
      bool same = true;
      for (int c = 0; c < 3; ++c)
        same = same && std::abs(image->GetScalarComponentAsDouble(column, row, 0, c) - colour[static_cast<std::size_t>(c)]) <= 12;
      found += same;
    }
  return found;
}

constexpr std::array<int, 3> blue{0, 114, 178}, orange{213, 94, 0}, green{0, 158, 115};

}  // namespace

TEST_CASE("a point is drawn where its value belongs on logarithmic and plain axes", "[vtk][plot]") {
  VirtualDisplay const display;
  if (!display.ready()) PALPATE_SKIP(display.problem());
  ScratchFolder const folder;
  // Decades 1e-4 … 1 across: 1e-3 lies at a quarter, 0.1 at three quarters. Up 0 … 10.
  std::vector<PlotSeries> const series{{"first", {1e-3}, {2.5}, false},
                                       {"left out", {}, {}, false},
                                       {"third", {0.1, 0.1, -1.0, std::numeric_limits<double>::quiet_NaN(), 0.1}, {7.5, 99.0, 5.0, 5.0, std::numeric_limits<double>::infinity()}, false}};
  PlotStyle style;
  style.title = "Yardstick";
  style.x = {"time [s]", true, 1e-4, 1.0};
  style.y = {"depth [mm]", false, 0.0, 10.0};
  auto const file = folder.path() / "plot.png";
  write_plot(file, series, style);
  CHECK(pixels_at(file, 0.25, 0.25, 4, blue) > 20);
  CHECK(pixels_at(file, 0.75, 0.75, 4, green) > 20);   // the third series keeps its colour, the second has no point
  CHECK(pixels_at(file, 0.5, 0.5, 60, blue) == 0);
  CHECK(pixels_at(file, 0.5, 0.5, 60, green) == 0);
  CHECK(pixels_at(file, 0.75, 0.75, 4, blue) == 0);

  // A line joins its points: half way between decades 1e-4 and 1 and between 0 and 10 is the middle.
  write_plot(file, std::vector<PlotSeries>{{"line", {1e-4, 1.0}, {0.0, 10.0}, true, false}}, style);
  CHECK(pixels_at(file, 0.5, 0.5, 4, blue) > 4);
  CHECK(pixels_at(file, 0.3, 0.7, 20, blue) == 0);
}

TEST_CASE("without limits an axis is rounded to whole decades and whole ticks", "[vtk][plot]") {
  VirtualDisplay const display;
  if (!display.ready()) PALPATE_SKIP(display.problem());
  ScratchFolder const folder;
  auto const file = folder.path() / "plot.png";
  // 3e-3 … 20: decades 1e-3 … 1e2, so 0.1^½ is the middle. 1.2 … 8.7: ticks of 2, so 0 … 10 and 5 is the middle.
  write_plot(file, std::vector<PlotSeries>{{"ends", {3e-3, 20.0}, {1.2, 8.7}, false}, {"middle", {std::sqrt(0.1)}, {5.0}, false}}, {.x = {"x", true}, .y = {"y"}});
  CHECK(pixels_at(file, 0.5, 0.5, 4, orange) > 20);
}

TEST_CASE("the legend stands in a corner without lines, or beside the frame", "[vtk][plot]") {
  VirtualDisplay const display;
  if (!display.ready()) PALPATE_SKIP(display.problem());
  ScratchFolder const folder;
  auto const file = folder.path() / "plot.png";
  // A rising line leaves the upper left corner free: the frame is wide, and the legend's sample of the line is drawn there.
  PlotSeries line{"rising", {0.0, 10.0}, {0.0, 10.0}, true, false};
  write_plot(file, std::vector{line});
  CHECK(pixels_at(file, 0.5, 0.5, 4, blue) > 4);
  CHECK(pixels_at(file, 0.05, 0.95, 30, blue) > 20);
  CHECK(pixels_at(file, 0.95, 0.05, 30, blue) == 0);
  // A line through all four corners leaves none: the frame ends at 0.77, and the legend stands to the right of its lower end.
  line.x = {0.0, 10.0, 10.0, 0.0, 0.0, 10.0}, line.y = {0.0, 0.0, 10.0, 10.0, 0.0, 10.0};
  write_plot(file, std::vector{line});
  CHECK(pixels_at(file, 0.5, 0.5, 4, blue, 0.77) > 4);
  CHECK(pixels_at(file, 1.07, 0.03, 30, blue, 0.77) > 20);
}

TEST_CASE("arrows on a line show its direction, exponents are raised", "[vtk][plot]") {
  VirtualDisplay const display;
  if (!display.ready()) PALPATE_SKIP(display.problem());
  ScratchFolder const folder;
  auto const file = folder.path() / "plot.png";
  // From left to right at half the height: heads at a third and two thirds, blunt on the left and pointed on the right.
  PlotSeries line{"way", {}, {}, true, false};
  for (int k = 0; k <= 300; ++k) line.x.push_back(0.01 * k), line.y.push_back(0.5);
  PlotStyle style;
  style.x.from = 0.0, style.x.to = 3.0, style.y.from = 0.0, style.y.to = 1.0;
  write_plot(file, std::vector{line}, style);
  int const plain = pixels_at(file, 0.5, 0.5, 8, blue);
  line.arrows = true;
  write_plot(file, std::vector{line}, style);
  double const aside = 7.0 / (0.86 * 1280);
  CHECK(pixels_at(file, 0.5, 0.5, 8, blue) == plain);
  for (double const at : {1.0 / 3, 2.0 / 3}) {
    CHECK(pixels_at(file, at, 0.5, 8, blue) > plain + 20);
    CHECK(pixels_at(file, at - aside, 0.5, 3, blue) > pixels_at(file, at + aside, 0.5, 3, blue) + 10);
  }
  // The label of 10^-2 and of 1 under a logarithmic axis: both have black pixels where their digits belong, and nothing between them has.
  style.x = {"", true, 1e-2, 1.0};
  write_plot(file, std::vector<PlotSeries>{{"one", {0.1}, {0.5}}}, style);
  constexpr std::array<int, 3> black{0, 0, 0};
  for (double const at : {0.0, 0.5, 1.0}) CHECK(pixels_at(file, at, -0.035, 14, black) > 5);
  CHECK(pixels_at(file, 0.25, -0.035, 14, black) == 0);
}

TEST_CASE("values that differ by rounding, or little beside their size, have ticks like any", "[vtk][plot]") {
  VirtualDisplay const display;
  if (!display.ready()) PALPATE_SKIP(display.problem());
  ScratchFolder const folder;
  auto const file = folder.path() / "plot.png";
  double const above = std::nextafter(0.1, 1.0);
  write_plot(file, std::vector<PlotSeries>{{"flat", {0.0, 1.0, 2.0, 3.0}, {0.1, 0.1, above, 0.1}}});   // it ends
  CHECK(std::filesystem::exists(file));
  auto const labels = [](double from, double to) {
    palpate::detail::PlotRange range({.title = ""});
    range.include(from), range.include(to), range.round();
    vtkNew<vtkAxis> axis;
    vtkNew<palpate::detail::PlotInk> ink;
    range.put_on(axis, "", *ink, {0, 0}, {1, 0});
    std::vector<std::string> texts;
    for (vtkIdType k = 0; k < axis->GetTickLabels()->GetNumberOfValues(); ++k) texts.push_back(axis->GetTickLabels()->GetValue(k));
    return texts;
  };
  CHECK(labels(101300, 101303) == std::vector<std::string>{"101300", "101300.5", "101301", "101301.5", "101302", "101302.5", "101303"});
  CHECK(labels(0, 0.3) == std::vector<std::string>{"0", "0.05", "0.1", "0.15", "0.2", "0.25", "0.3"});
  CHECK(labels(0.1, above) == labels(0.1, 0.1));
}

TEST_CASE("what can not be drawn is refused", "[vtk][plot][error]") {
  VirtualDisplay const display;
  ScratchFolder const folder;
  auto const file = folder.path() / "plot.png";
  CHECK_THROWS_AS(write_plot(file, std::vector<PlotSeries>{}), InvalidArgument);
  CHECK_THROWS_AS(write_plot(file, std::vector<PlotSeries>{{"one", {1.0}, {1.0, 2.0}}}), InvalidArgument);
  CHECK_THROWS_AS(write_plot(file, std::vector<PlotSeries>{{"below", {-1.0}, {1.0}}}, {.x = {"x", true}}), InvalidArgument);
  CHECK_THROWS_AS(write_plot(file, std::vector<PlotSeries>{{"one", {1.0}, {1.0}}}, {.width = 3}), InvalidArgument);
  std::vector<PlotSeries> const some{{"some", {1.0, 2.0, 3.0}, {1.0, 2.0, 4.0}}};
  double const infinite = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
  for (PlotAxis const& axis : {PlotAxis{.title = "up", .logarithmic = true, .from = 0, .to = 10}, {.title = "up", .from = 0, .to = infinite}, {.title = "up", .from = nan, .to = 1}, {.title = "up", .from = -1e308, .to = 1e308}}) {
    CHECK_THROWS_WITH(write_plot(file, some, {.y = axis}), Catch::Matchers::Contains("the axis \"up\" goes from"));
    CHECK_THROWS_AS(write_plot(file, some, {.x = axis}), InvalidArgument);
  }
  CHECK_THROWS_AS(write_plot(file, std::vector<PlotSeries>{{"far", {1.0, 2.0}, {-1e308, 1e308}}}), InvalidArgument);
  CHECK_FALSE(std::filesystem::exists(file));
  CHECK_THROWS_AS(write_plot(folder.write("file", "x") / "plot.png", std::vector<PlotSeries>{{"one", {1.0}, {1.0}}}), FileError);
}
