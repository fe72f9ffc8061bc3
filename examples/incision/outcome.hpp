// SPDX-License-Identifier: MIT
#pragma once

#include "upper_side.hpp"

#include <palpate/core/phase.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/integrator/solve_report.hpp>
#include <palpate/simulator/recording.hpp>
#include <palpate/simulator/simulator_statistics.hpp>

#include <optional>
#include <string>
#include <vector>

namespace incision {

/// The body at one moment, for pictures and the series.
struct Frame {
  double time = 0.0;
  TriangleMesh<double> mesh;
  TriangleMesh<double> drawn{};   // of a solid, as the pictures show it: flesh turned inside out
  palpate::Matrix3X<double> displacement;
  Vector tip = Vector::Zero();
  palpate::CuttingPhase phase = palpate::CuttingPhase::no_contact;
  double depth = 0.0;
};

/// What a solid is, beside its skin.
struct Solid {
  std::string filled{};            // what the filling says of itself
  double young = 0.0, poisson = 0.0, edge = 0.0;   // Pa, -, m
  int tetrahedra = 0, tetrahedra_after = 0, nailed = 0;
  double prestrain = 0.0, toughness = 0.0, lip_friction = 0.0;   // -, J/m², N/m
  double area = 0.0;               // m², of all cuts
  palpate::VolumeCutReport cut{};
  double stable_step = 0.0;        // s, of leapfrog in the shape that was pressed last; infinite where any step is
  palpate::SolveStatistics<double> solved{};
};

/// All that came of a run.
struct Outcome {
  palpate::Recording recording;
  std::vector<Frame> frames;
  std::optional<Solid> solid;
  palpate::CutReport cut;
  int particles_before = 0, triangles_before = 0, particles_after = 0, triangles_after = 0, pieces = 0;
  std::optional<double> release;   // s, when the tool left the wound
  double cut_length = 0.0;         // m, of all cuts, in the undeformed shape
  std::optional<double> gap;       // m, largest distance between the lips, two seconds after the release
  std::string device, device_faults;   // empty for the scripted hand
  bool realtime = false;
  double wall_seconds = 0.0;       // of the simulation alone
  palpate::TickStatistics servo, body;
  palpate::BodyCounts body_counts;
};

}  // namespace incision
