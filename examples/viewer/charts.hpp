// SPDX-License-Identifier: MIT
#pragma once

#include "layout.hpp"
#include "live.hpp"
#include "scene.hpp"

#include <vtkChartXY.h>
#include <vtkContextScene.h>
#include <vtkDoubleArray.h>
#include <vtkNew.h>
#include <vtkPlot.h>
#include <vtkTable.h>

#include <string>
#include <vector>

namespace viewer {

/// One quantity over the last seconds.
class LiveChart {
 public:
  LiveChart(std::string const& title, Colour const& colour);

  void add_to(vtkContextScene* scene) { scene->AddItem(chart_); }
  void place(Box const& box);
  /// `at_least` is the range that is always seen.
  void show(std::vector<double> const& times, std::vector<double> const& values, double now, double lowest, double at_least);

  /// Where in the window [pixels] a point of the chart is drawn.
  std::array<double, 2> pixel(double time, double value) const;

 private:
  vtkNew<vtkChartXY> chart_;
  vtkNew<vtkTable> table_;
  vtkNew<vtkDoubleArray> times_, values_;
  vtkPlot* line_;
};

class Charts {
 public:
  void add_to(vtkContextScene* scene);
  void place(Layout const& layout);
  void show(Live const& live);
  LiveChart const& force() const noexcept { return force_; }
  LiveChart const& energy() const noexcept { return energy_; }

 private:
  LiveChart force_{"force on the hand [N]", colours::force};
  LiveChart energy_{"energy taken from the hand [mJ]", colours::energy};
};

}  // namespace viewer
