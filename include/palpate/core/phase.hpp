// SPDX-License-Identifier: MIT
#pragma once

namespace palpate {

/// Where a cutting tool is in its stroke: no contact → indenting → moving → no contact (\cite zheng2006, ch. 3).
/// Below the puncture threshold the tissue is only palpated (indenting); after the puncture the tool cuts (moving) until it leaves the surface.
enum class CuttingPhase { no_contact, indenting, moving };

constexpr char const* to_string(CuttingPhase phase) noexcept {
  switch (phase) {
    case CuttingPhase::no_contact: return "no contact";
    case CuttingPhase::indenting: return "indenting";
    case CuttingPhase::moving: return "moving";
  }
  return "unknown";
}

}  // namespace palpate
