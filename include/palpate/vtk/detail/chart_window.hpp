// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/vtk/detail/message_trap.hpp>
#include <palpate/vtk/detail/off_screen.hpp>

#include <vtkAbstractContextItem.h>
#include <vtkAxis.h>
#include <vtkChartXY.h>
#include <vtkContextScene.h>
#include <vtkContextView.h>
#include <vtkNew.h>
#include <vtkPen.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkTextProperty.h>

#include <filesystem>
#include <string>

namespace palpate::detail {

inline void require_chart_size(int width, int height) {
  if (width < 64 || height < 64 || width > 16384 || height > 16384)
    throw InvalidArgument(message("a chart of ", width, " x ", height, " pixels; give 64 … 16384"));
}

/// Names an axis, and gives it the letters and the light grid of all charts; its range is the caller's.
inline void dress_axis(vtkAxis* axis, std::string const& title, int text_size) {
  axis->SetTitle(title);
  axis->GetTitleProperties()->SetFontSize(text_size);
  axis->GetTitleProperties()->BoldOff();
  axis->GetLabelProperties()->SetFontSize(text_size);
  axis->GetGridPen()->SetColor(225, 225, 225, 255);
  axis->SetBehavior(vtkAxis::FIXED);
}

/// A white window that nobody sees, with an empty chart. While it lives, what VTK would print is kept (see MessageTrap).
/// Needs a display: see require_display.
class ChartWindow {
 public:
  ChartWindow(int width, int height) {
    view_->GetRenderWindow()->SetOffScreenRendering(1);
    view_->GetRenderWindow()->SetMultiSamples(8);
    view_->GetRenderWindow()->SetSize(width, height);
    view_->GetRenderer()->SetBackground(1.0, 1.0, 1.0);
    view_->GetScene()->AddItem(chart_);
  }

  vtkChartXY* chart() { return chart_; }

  /// Over the chart.
  void add(vtkAbstractContextItem* item) { view_->GetScene()->AddItem(item); }

  void set_title(std::string const& title, int text_size) {
    chart_->SetTitle(title);
    chart_->GetTitleProperties()->SetFontSize(text_size * 5 / 4);
  }

  void write(std::filesystem::path const& file) { write_png(file, view_->GetRenderWindow()); }

 private:
  MessageTrap trap_;
  vtkNew<vtkContextView> view_;
  vtkNew<vtkChartXY> chart_;
};

}  // namespace palpate::detail
