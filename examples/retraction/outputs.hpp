// SPDX-License-Identifier: MIT
#pragma once

#include "options.hpp"
#include "scene.hpp"

#include <palpate/volume/embedded_surface.hpp>
#include <palpate/vtk/series.hpp>
#include <palpate/vtk/virtual_display.hpp>

#include <memory>
#include <string>
#include <vector>

namespace retraction {

/// The tools, where they are.
struct Tools {
  palpate::RodContact<double> const &left, &right;   // hooks
  Vector tip;                                        // of the scalpel
};

/// Writes what is to be seen, moment by moment, into the output folder. Without a display pictures are left out with one line on standard error.
class Outputs {
 public:
  Outputs(Options const& options, Organ const& organ);

  /// The organ's fine skin, its wound and the three tools, seen from above; the camera is that of the first picture.
  void draw(std::string const& name, Body const& body, Tools const& tools);
  /// A frame of the series: displacement, stress and strain energy of each tetrahedron.
  void add_frame(double time, Body const& body);
  /// The names of what was written.
  std::string written() const;
  void wrote(std::string const& name) { written_.push_back(name); }

 private:
  Options options_;
  palpate::EmbeddedSurface<double> skin_;
  palpate::VirtualDisplay display_;
  std::unique_ptr<palpate::SeriesWriter> series_;
  std::vector<std::string> written_;
};

}  // namespace retraction
