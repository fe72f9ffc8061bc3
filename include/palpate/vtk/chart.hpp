// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/phase.hpp>
#include <palpate/vtk/plot.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace palpate {

/// One point of a force chart. Units: s, m, N.
struct ForceSample {
  double time = 0.0;
  double depth = 0.0;
  double force = 0.0;
  CuttingPhase phase = CuttingPhase::no_contact;
};

struct ChartStyle {
  int width = 1280;   ///< pixels
  int height = 800;
  std::string title;  ///< empty: one that says what is shown
};

namespace detail {

/// What a sample is drawn as: its phase, after the puncture by the way the tool goes. The number is that of its colour among a plot's.
enum class ForcePart { indenting, loading, unloading, no_contact = 8 };

constexpr char const* to_string(ForcePart part) noexcept {
  switch (part) {
    case ForcePart::no_contact: return "no contact";
    case ForcePart::indenting: return "indenting";
    case ForcePart::loading: return "loading";
    case ForcePart::unloading: return "unloading";
  }
  return "";
}

/// A turn counts where the tool then goes a fiftieth of the largest depth back: a hand trembles.
inline std::vector<ForcePart> parts_of(std::span<ForceSample const> samples) {
  double deepest = 0.0;
  for (ForceSample const& sample : samples)
    if (std::isfinite(sample.depth)) deepest = std::max(deepest, sample.depth);
  double const turn = deepest / 50.0;
  std::vector<ForcePart> parts(samples.size(), ForcePart::no_contact);
  bool deeper = true;
  std::size_t farthest = samples.size();   // where the present way has come to; none yet in this stroke
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples[i].phase != CuttingPhase::moving) {
      parts[i] = samples[i].phase == CuttingPhase::indenting ? ForcePart::indenting : ForcePart::no_contact;
      deeper = true;
      farthest = samples.size();
      continue;
    }
    parts[i] = deeper ? ForcePart::loading : ForcePart::unloading;
    if (!std::isfinite(samples[i].depth)) continue;
    double const ahead = farthest == samples.size() ? 0.0 : (samples[i].depth - samples[farthest].depth) * (deeper ? 1.0 : -1.0);
    if (ahead >= 0.0) {
      farthest = i;
    } else if (ahead < -turn) {
      deeper = !deeper;
      std::fill(parts.begin() + static_cast<std::ptrdiff_t>(farthest) + 1, parts.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                deeper ? ForcePart::loading : ForcePart::unloading);
      farthest = i;
    }
  }
  return parts;
}

/// A line through the samples, in the colour of their parts; a gap between two parts is bridged by the later one.
template <class X>
void write_force_chart(std::filesystem::path const& file, std::span<ForceSample const> samples, ChartStyle const& style,
                       std::string const& title, char const* x_title, X const& x) {
  if (samples.empty()) throw InvalidArgument(message("can not draw ", file.string(), ": there are no samples"));
  std::array<PlotSeries, 1 + static_cast<std::size_t>(ForcePart::no_contact)> lines;
  auto const parts = parts_of(samples);
  double low = 0.0, high = 0.0;
  for (ForceSample const& sample : samples)
    if (std::isfinite(sample.force)) low = std::min(low, sample.force), high = std::max(high, sample.force);
  if (!(high > low)) high = low + 1.0;
  for (ForcePart const part : {ForcePart::indenting, ForcePart::loading, ForcePart::unloading, ForcePart::no_contact}) {
    PlotSeries& line = lines[static_cast<std::size_t>(part)];
    line = {.label = to_string(part), .marks = false, .gaps = true};
    auto const add = [&](double across, double up) { line.x.push_back(across), line.y.push_back(up); };
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (!std::isfinite(x(samples[i])) || !std::isfinite(samples[i].force)) continue;
      bool const here = parts[i] == part;
      bool const joins = i + 1 < samples.size() && parts[i + 1] == part;   // the line begins at the end of the one before
      if (here || joins) add(x(samples[i]), samples[i].force);
      if (here && !joins) add(x(samples[i]), std::numeric_limits<double>::quiet_NaN());
    }
  }
  double const room = 0.03 * (high - low);   // so that zero is seen above the axis
  write_plot(file, lines,
             {.width = style.width, .height = style.height, .title = style.title.empty() ? title : style.title, .x = {.title = x_title},
              .y = {.title = "force (N)", .from = low - room, .to = high + room}});
}

}  // namespace detail

/// Draws force over time into a PNG file, its parts in colour: grey without contact, blue indenting, then orange on the way in and green on the way back.
/// Errors     `FileError` without a display (see `VirtualDisplay`) or when the file can not be written; none is left half-written.
inline void write_force_time_chart(std::filesystem::path const& file, std::span<ForceSample const> samples,
                                   ChartStyle const& style = {}) {
  detail::write_force_chart(file, samples, style, "Force on the hand over time", "time (s)", [](ForceSample const& sample) { return sample.time; });
}

/// Draws force over depth (in mm) into a PNG file, in the same colours: loading and unloading show as two curves that meet.
inline void write_force_depth_chart(std::filesystem::path const& file, std::span<ForceSample const> samples,
                                    ChartStyle const& style = {}) {
  detail::write_force_chart(file, samples, style, "Force on the hand over depth below the undeformed surface", "depth (mm)",
                            [](ForceSample const& sample) { return 1000.0 * sample.depth; });
}

}  // namespace palpate
