// SPDX-License-Identifier: MIT
#include "outputs.hpp"

#include "progress.hpp"

#include <palpate/core/detail/whole_file.hpp>
#include <palpate/core/error.hpp>
#include <palpate/vtk/chart.hpp>
#include <palpate/vtk/picture.hpp>
#include <palpate/vtk/plot.hpp>
#include <palpate/vtk/series.hpp>
#include <palpate/vtk/virtual_display.hpp>

#include <cstddef>
#include <cstdio>
#include <span>
#include <system_error>
#include <vector>

namespace incision {

namespace fs = std::filesystem;
using palpate::CuttingPhase;

namespace {

/// The deepest press before the puncture, or the deepest contact at all.
Frame const& pressed_frame(std::vector<Frame> const& frames) {
  Frame const* best = &frames.front();
  for (CuttingPhase const wanted : {CuttingPhase::indenting, CuttingPhase::moving}) {
    for (Frame const& frame : frames)
      if (frame.phase == wanted && frame.depth > best->depth) best = &frame;
    if (best->depth > 0.0) break;
  }
  return *best;
}

/// Two thirds through the cut; without a cut as pressed_frame.
Frame const& cutting_frame(std::vector<Frame> const& frames) {
  std::vector<Frame const*> moving;
  for (Frame const& frame : frames)
    if (frame.phase == CuttingPhase::moving) moving.push_back(&frame);
  return moving.empty() ? pressed_frame(frames) : *moving[moving.size() * 2 / 3];
}

void write_pictures(fs::path const& folder, Organ const& organ, Hand const& hand, std::vector<Frame> const& frames, bool solid) {
  palpate::Camera const camera =
      palpate::framing(frames.front().mesh, 0.85 * hand.normal + 0.7 * hand.along.cross(hand.normal), hand.normal);
  palpate::PictureStyle style;
  style.wound_depth = solid ? 0.0 : 0.05 * organ.diagonal;
  if (solid) style.interior = style.wound;
  auto const draw = [&](char const* name, Frame const& frame) {
    palpate::PictureTool const tool{.tip = frame.tip, .axis = hand.blade(), .edge = hand.along, .length = 2.4 * hand.length};
    palpate::write_picture(folder / name, solid ? frame.drawn : frame.mesh, camera, tool, style);
  };
  draw("before.png", frames.front());
  draw("pressed.png", pressed_frame(frames));
  draw("cutting.png", cutting_frame(frames));
  draw("after.png", frames.back());
}

void write_charts(fs::path const& folder, palpate::Recording const& recording, double toughness) {
  std::vector<palpate::ForceSample> samples;
  samples.reserve(recording.ticks().size());
  for (palpate::Tick const& tick : recording.ticks()) samples.push_back({tick.time, tick.depth, tick.force.norm(), tick.phase});
  palpate::write_force_time_chart(folder / "force_time.png", samples);
  palpate::write_force_depth_chart(folder / "force_depth.png", samples);

  palpate::PlotSeries energy{.label = "given by the hand", .marks = false};
  for (palpate::Tick const& tick : recording.ticks()) {
    energy.x.push_back(tick.time);
    energy.y.push_back(1e3 * tick.energy);
  }
  std::vector<palpate::PlotSeries> series{energy};
  if (toughness > 0.0 && recording.ticks().back().cut_area > 0.0) {
    palpate::PlotSeries spent{.label = "toughness times area cut", .marks = false};
    for (palpate::Tick const& tick : recording.ticks()) spent.x.push_back(tick.time), spent.y.push_back(1e3 * toughness * tick.cut_area);
    series.push_back(spent);
  }
  palpate::write_plot(folder / "energy_time.png", series, {.title = "Energy that the hand gave", .x = {.title = "time (s)"}, .y = {.title = "energy (mJ)"}});
}

}  // namespace

OutputFolder::OutputFolder(fs::path const& folder) {
  std::error_code problem;
  for (fs::path part = fs::absolute(folder, problem).lexically_normal(); !part.empty() && !fs::exists(part, problem);
       part = part.parent_path())
    made_.push_back(part);
  fs::create_directories(folder, problem);
  if (problem || !fs::is_directory(folder))
    throw palpate::FileError(palpate::detail::message("can not make the output folder ", folder.string(), ": ",
                                                      problem ? problem.message() : std::string("a file is in its place"),
                                                      "; choose another with --out"));
  fs::path const probe = folder / ".incision-probe";
  palpate::detail::write_whole_file(probe, "x");
  fs::remove(probe, problem);
}

OutputFolder::~OutputFolder() {
  std::error_code problem;
  for (fs::path const& part : made_)
    if (!fs::is_directory(part, problem) || !fs::is_empty(part, problem) || !fs::remove(part, problem)) break;
}

std::vector<std::string> write_outputs(Options const& options, Organ const& organ, Hand const& hand, Outcome const& outcome) {
  std::vector<std::string> written{"session.csv", "tissue.pvd"};
  outcome.recording.write_csv(options.out / "session.csv");
  {
    Progress progress("writing   ");
    palpate::SeriesWriter series(options.out / "tissue.pvd");
    for (std::size_t i = 0; i < outcome.frames.size(); ++i) {
      Frame const& frame = outcome.frames[i];
      if (frame.displacement.cols() == frame.mesh.points.cols())
        series.add(frame.time, frame.mesh, frame.displacement);
      else
        series.add(frame.time, frame.mesh);
      progress.show(double(i + 1) / double(outcome.frames.size()), "series");
    }
  }
  if (!options.pictures) return written;
  palpate::VirtualDisplay const display;
  if (!display.ready()) {
    std::fprintf(stderr, "incision: no pictures: %s\n", display.problem().c_str());
    return written;
  }
  write_pictures(options.out, organ, hand, outcome.frames, outcome.solid.has_value());
  write_charts(options.out, outcome.recording, outcome.solid ? outcome.solid->toughness : 0.0);
  written.insert(written.end(), {"before.png", "pressed.png", "cutting.png", "after.png", "force_time.png", "force_depth.png", "energy_time.png"});
  return written;
}

}  // namespace incision
