// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <ostream>
#include <string_view>

namespace palpate {

/// What every preset has to say; a recording carries it along.
inline constexpr std::string_view force_disclaimer = "No force of this library is validated for a patient or for the outcome of a training.";

/// What is known of the measurement behind a preset force. What no source supports is not a preset.
/// Units      speeds [m/s], depths [m].
struct TissuePreset {
  std::string_view name;      ///< the function that makes it, in force/liver.hpp
  std::string_view tissue;
  std::string_view species;   ///< "not stated" where the source does not
  std::string_view tool;
  double slowest = 0.0;       ///< measured at speeds from here
  double fastest = 0.0;       ///< to here
  double shallowest = 0.0;    ///< and at depths from here
  double deepest = 0.0;       ///< to here; beyond, the force is a continuation, not a measurement
  std::string_view source;
  std::string_view limits;
};

inline constexpr std::array<TissuePreset, 4> tissue_presets{{
    {"liver_loading", "liver", "not stated", "indentation probe of 4 mm diameter", 0.69096e-3 / 60, 6.096e-3 / 60, 0.0, 0.02283,
     "Zheng 2006, table 6-1: weights of a 1-5-1 network trained on a published indentation test; mean squared error 5.018e-5 N²",
     "No cutting force. From 21 mm on it differs from liver_hysteresis by up to 0.25 N."},
    {"liver_hysteresis", "liver", "not stated", "indentation probe of 4 mm diameter", 0.69096e-3 / 60, 6.096e-3 / 60, 0.0, 0.02283,
     "Zheng 2006, table 6-2: weights of a 2-5-1 network trained on the loading and unloading of the same test; mean squared error 1.232e-4 N²",
     "No cutting force. Below 1.8 mm the network's unloading exceeds its loading by up to 2 mN."},
    {"liver_spring", "liver", "not stated", "scalpel", 0.001, 0.001, 0.0, 0.018,
     "Zheng 2006, ch. 6.4, after a published cutting test: punctured at about 3 N and 18 mm",
     "One number of one test: a straight line to it. Another experiment than the liver curves, which read 0.36 N at 18 mm."},
    {"liver_friction", "liver", "not stated", "scalpel", 0.001, 0.001, 0.016, 0.021,
     "Zheng 2006, ch. 6.5, coefficient fitted to the same cutting test: 180 N/m of depth at 1 mm/s, read as friction",
     "One speed: that it hardly depends on speed is an assumption, made because the damper that the thesis prints is unsafe."},
}};

/// The preset of a name, or null.
constexpr TissuePreset const* find_tissue_preset(std::string_view name) noexcept {
  for (TissuePreset const& preset : tissue_presets)
    if (preset.name == name) return &preset;
  return nullptr;
}

/// What is known of it, a line a fact.
inline std::ostream& operator<<(std::ostream& out, TissuePreset const& preset) {
  out << preset.name << ": " << preset.tissue << ", species " << preset.species << "\n  tool    " << preset.tool << "\n  speed   ";
  if (preset.slowest < preset.fastest) out << preset.slowest * 1000 << " to ";
  return out << preset.fastest * 1000 << " mm/s\n  depth   " << preset.shallowest * 1000 << " to " << preset.deepest * 1000 << " mm\n  source  " << preset.source
             << "\n  limits  " << preset.limits << '\n'
             << "  " << force_disclaimer << '\n';
}

}  // namespace palpate
