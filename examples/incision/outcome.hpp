// SPDX-License-Identifier: MIT
#pragma once

#include "upper_side.hpp"

#include <palpate/core/phase.hpp>
#include <palpate/cutting/concept.hpp>
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
  palpate::Matrix3X<double> displacement;
  Vector tip = Vector::Zero();
  palpate::CuttingPhase phase = palpate::CuttingPhase::no_contact;
  double depth = 0.0;
};

/// All that came of a run.
struct Outcome {
  palpate::Recording recording;
  std::vector<Frame> frames;
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
