// SPDX-License-Identifier: MIT
#pragma once

#include "options.hpp"
#include "upper_side.hpp"

#include <palpate/device/trajectory.hpp>

#include <string>
#include <vector>

namespace incision {

/// What is cut.
struct Organ {
  std::string name;
  TriangleMesh<double> mesh;     // as it grew: without pre-tension, m
  Vector up;
  std::vector<int> underside;    // nailed, with the rim: the bed that it lies in
  double mass = 0.0;             // kg
  double diagonal = 0.0;         // m
  double puncture_depth = 0.0, cut_depth = 0.0;   // m: where the tool breaks in, and how deep it cuts
  double edge = 0.0;             // m, of a solid's lattice
  double link_stiffness = 0.0, home_stiffness = 0.0;   // N/m
  double link_damping = 0.0, home_damping = 0.0;       // N s/m
};

/// Reads or makes the organ. What was repaired in a file goes to standard error in one line. Throws palpate::Error for a mesh that can
/// not be used.
Organ prepare_organ(Options const& options);

/// How the tool moves, and from where the pictures are taken.
struct Hand {
  palpate::Trajectory<double> path;
  double seconds = 0.0;     // to simulate
  Vector middle, normal, along;
  double length = 0.0;      // m, of the stroke

  /// From the tip to the handle: held like a pen, drawn with the handle behind.
  Vector blade() const { return (0.92 * normal - 0.38 * along).normalized(); }
};

/// The scripted hand on the organ as it lies there, settled: palpates, punctures, draws a stroke and leaves; or follows the file.
/// Throws palpate::Error for an organ without room for a stroke, or a path that starts inside the organ or never touches it.
Hand prepare_hand(Options const& options, Organ const& organ, TriangleMesh<double> const& settled);

}  // namespace incision
