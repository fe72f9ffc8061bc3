// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/whole_file.hpp>
#include <palpate/core/error.hpp>
#include <palpate/vtk/detail/message_trap.hpp>
#include <palpate/vtk/virtual_display.hpp>

#include <vtkAutoInit.h>
#include <vtkNew.h>
#include <vtkPNGWriter.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkUnsignedCharArray.h>
#include <vtkWindowToImageFilter.h>

#include <filesystem>

// VTK's drawing code is chosen when a program is linked; these lines save each program from choosing.
VTK_MODULE_INIT(vtkRenderingOpenGL2)
VTK_MODULE_INIT(vtkRenderingContextOpenGL2)
VTK_MODULE_INIT(vtkRenderingFreeType)

namespace palpate::detail {

inline void require_display(std::filesystem::path const& file) {
  if (!display_available())
    throw FileError(message("can not draw ", file.string(), ": there is no X display; set DISPLAY or keep a VirtualDisplay alive"));
}

/// What the window shows, as a PNG file that is there as a whole or not at all.
inline void write_png(std::filesystem::path const& file, vtkRenderWindow* window) {
  MessageTrap const trap;
  window->Render();
  vtkNew<vtkWindowToImageFilter> image;
  image->SetInput(window);
  image->SetInputBufferTypeToRGB();
  image->ReadFrontBufferOff();
  vtkNew<vtkPNGWriter> png;
  png->WriteToMemoryOn();
  png->SetInputConnection(image->GetOutputPort());
  png->Write();
  vtkUnsignedCharArray* const bytes = png->GetResult();
  if (bytes == nullptr || bytes->GetNumberOfValues() == 0)
    throw FileError(message("can not draw ", file.string(), ": ",
                            trap.message().empty() ? std::string("OpenGL gave no picture") : trap.message()));
  write_whole_file(file, {reinterpret_cast<char const*>(bytes->GetPointer(0)), static_cast<std::size_t>(bytes->GetNumberOfValues())});
}

/// What a renderer shows, likewise, of this many pixels.
inline void write_png(std::filesystem::path const& file, vtkRenderer* renderer, int width, int height) {
  vtkNew<vtkRenderWindow> window;
  window->SetOffScreenRendering(1);
  window->SetMultiSamples(8);
  window->SetSize(width, height);
  window->AddRenderer(renderer);
  write_png(file, window);
}

}  // namespace palpate::detail
