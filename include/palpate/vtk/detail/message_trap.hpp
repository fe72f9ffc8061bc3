// SPDX-License-Identifier: MIT
#pragma once

#include <vtkLogger.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>
#include <vtkSmartPointer.h>

#include <string>
#include <string_view>

namespace palpate::detail {

/// A VTK output window that keeps the first error and shows nothing.
class SilentOutputWindow : public vtkOutputWindow {
 public:
  vtkTypeMacro(SilentOutputWindow, vtkOutputWindow);
  static SilentOutputWindow* New() { VTK_STANDARD_NEW_BODY(SilentOutputWindow); }

  SilentOutputWindow(SilentOutputWindow const&) = delete;
  SilentOutputWindow& operator=(SilentOutputWindow const&) = delete;

  void DisplayText(char const* text) override { keep(text); }
  void DisplayErrorText(char const* text) override { keep(text); }
  void DisplayWarningText(char const* text) override { keep(text); }
  void DisplayGenericWarningText(char const* text) override { keep(text); }
  void DisplayDebugText(char const*) override {}

  std::string const& first() const noexcept { return first_; }

 protected:
  SilentOutputWindow() = default;
  ~SilentOutputWindow() override = default;

 private:
  void keep(char const* text) {
    if (first_.empty() && text != nullptr) first_ = text;
  }

  std::string first_;
};

/// The one line that a person needs of VTK's "ERROR: In file, line n\nclass (address): text\n\n": the text.
inline std::string one_line(std::string_view report) {
  bool const placed = report.substr(0, report.find('\n')).find(": In ") != std::string_view::npos;
  if (auto const end = report.find('\n'); placed && end != std::string_view::npos) report.remove_prefix(end + 1);
  if (auto const end = report.find("): "), begin = report.find("(0x"); begin < end && end != std::string_view::npos)
    report.remove_prefix(end + 3);
  std::string line;
  for (char const c : report) {
    bool const space = c == '\n' || c == '\r' || c == '\t' || c == ' ';
    if (!space)
      line += c;
    else if (!line.empty() && line.back() != ' ')
      line += ' ';
  }
  while (!line.empty() && (line.back() == ' ' || line.back() == '.')) line.pop_back();
  return line;
}

/// While it lives, what VTK would print is kept instead of shown.
/// Limits     VTK's output window and log belong to the process: one trap at a time, and not while another thread uses VTK.
class MessageTrap {
 public:
  MessageTrap() : before_(vtkOutputWindow::GetInstance()), verbosity_(vtkLogger::GetCurrentVerbosityCutoff()) {
    vtkOutputWindow::SetInstance(window_);
    vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF);
  }
  ~MessageTrap() {
    vtkLogger::SetStderrVerbosity(verbosity_);
    vtkOutputWindow::SetInstance(before_);
  }
  MessageTrap(MessageTrap const&) = delete;
  MessageTrap& operator=(MessageTrap const&) = delete;

  /// The first message in one line; empty when there was none.
  std::string message() const { return one_line(window_->first()); }

 private:
  vtkSmartPointer<vtkOutputWindow> before_;
  vtkLogger::Verbosity verbosity_;
  vtkSmartPointer<SilentOutputWindow> window_ = vtkSmartPointer<SilentOutputWindow>::New();
};

}  // namespace palpate::detail
