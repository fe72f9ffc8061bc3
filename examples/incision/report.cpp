// SPDX-License-Identifier: MIT
#include "report.hpp"

#include <palpate/simulator/budget.hpp>

#include <chrono>
#include <cstdarg>
#include <cstddef>
#include <cstdio>
#include <optional>

namespace incision {

namespace {

[[gnu::format(printf, 2, 3)]] void line(std::string& text, char const* format, ...) {
  char buffer[512];
  va_list values;
  va_start(values, format);
  std::vsnprintf(buffer, sizeof buffer, format, values);
  va_end(values);
  text += buffer;
  text += '\n';
}

double microseconds(palpate::DurationHistogram::Duration duration) { return std::chrono::duration<double, std::micro>(duration).count(); }

/// The last tick before a cut ended deep in the organ: a tool that is lifted ends it near the surface.
std::optional<palpate::Tick> passed_through(Organ const& organ, Outcome const& outcome) {
  auto const& ticks = outcome.recording.ticks();
  for (std::size_t i = 1; i < ticks.size(); ++i)
    if (ticks[i - 1].phase == palpate::CuttingPhase::moving && ticks[i].phase == palpate::CuttingPhase::no_contact &&
        ticks[i - 1].depth > organ.puncture_depth && (ticks[i].tip - ticks[i - 1].tip).norm() < organ.puncture_depth)
      return ticks[i - 1];
  return std::nullopt;
}

}  // namespace

std::string summary(Options const& options, Organ const& organ, Hand const& hand, Outcome const& outcome,
                    std::vector<std::string> const& written) {
  std::string text;
  double const simulated = outcome.recording.ticks().empty() ? 0.0 : hand.seconds;
  double deepest = 0.0;
  bool punctured = false;
  bool const did_cut = outcome.cut.particles_added > 0 || (outcome.solid && outcome.solid->area > 0);
  for (palpate::Tick const& tick : outcome.recording.ticks()) {
    deepest = tick.depth > deepest ? tick.depth : deepest;
    punctured = punctured || tick.phase == palpate::CuttingPhase::moving;
  }

  line(text, "organ         %s: %d vertices, %d triangles, %.0f mm across, %.3f kg", organ.name.c_str(), outcome.particles_before,
       outcome.triangles_before, 1000.0 * organ.diagonal, organ.mass);
  if (outcome.solid) {
    Solid const& solid = *outcome.solid;
    line(text, "tissue        finite elements, stable neo-Hooke, E %.4g Pa, nu %.3g; edge %.2f mm; pre-tension %.0f %%; %d particles nailed", solid.young, solid.poisson, 1000.0 * solid.edge,
         100.0 * solid.prestrain, solid.nailed);
    line(text, "filled        %s", solid.filled.c_str());
    if (solid.solved.steps > 0)
      line(text, "steps         implicit, of any size; conjugate gradients %.1f iterations a step; %lld of %lld ended at their budget, %lld halved",
           double(solid.solved.iterations) / double(solid.solved.steps), solid.solved.unconverged, solid.solved.steps, solid.solved.halved);
    else
      line(text, "steps         explicit, stable up to %.3g ms", 1000.0 * solid.stable_step);
  } else
    line(text, "tissue        link %.3g N/m, %.3g N s/m; home %.3g N/m, %.3g N s/m; pre-tension %.0f %%; %zu particles nailed", organ.link_stiffness,
       organ.link_damping, organ.home_stiffness, organ.home_damping, 100.0 * options.prestrain.value_or(default_prestrain), organ.underside.size());
  line(text, "session       %.2f s of simulated time in %.2f s: %.1f times real time", simulated, outcome.wall_seconds,
       simulated / outcome.wall_seconds);
  if (!outcome.device.empty()) line(text, "device        %s", outcome.device.c_str());
  if (!outcome.device_faults.empty()) line(text, "note          the device reported: %s", outcome.device_faults.c_str());
  if (outcome.realtime)
    line(text, "rates         servo %.1f Hz (%llu late, %llu skipped), body %.1f Hz", outcome.servo.rate(),
         static_cast<unsigned long long>(outcome.servo.overruns()), static_cast<unsigned long long>(outcome.servo.skipped()),
         outcome.body.rate());
  else
    line(text, "rates         servo and body 1000 Hz of simulated time, %.0f ticks/s reached",
         double(outcome.recording.ticks().size()) / outcome.wall_seconds);
  line(text, "servo tick    p50 %.1f us, p99 %.1f us", microseconds(outcome.servo.compute().p50()), microseconds(outcome.servo.compute().p99()));
  line(text, "body step     p50 %.1f us, p99 %.1f us a tick; %.1f steps a tick, at most %d%s", microseconds(outcome.body.compute().p50()),
       microseconds(outcome.body.compute().p99()), double(outcome.body_counts.steps) / double(outcome.body.ticks() > 0 ? outcome.body.ticks() : 1),
       outcome.body_counts.max_steps_a_tick, outcome.body_counts.diverged > 0 ? "; THE BODY DIVERGED" : "");
  if (outcome.solid && outcome.solid->area > 0) {
    Solid const& solid = *outcome.solid;
    line(text, "cut           %.2f cm2, both lips %.2f cm2; %d tetrahedra and %d particles added; %d edges divided, %d crossings went to an end of theirs", 1e4 * solid.area,
         1e4 * solid.cut.lip_area, solid.tetrahedra_after - solid.tetrahedra, outcome.particles_after - outcome.particles_before, solid.cut.edges_divided, solid.cut.snapped);
    line(text, "toughness     %.4g J/m2 and %.3g N/m along the lips; the area cost %.2f mJ of the %.2f mJ that the hand gave", solid.toughness, solid.lip_friction,
         1e3 * solid.toughness * solid.area, 1e3 * outcome.recording.ticks().back().energy);
  } else if (outcome.solid && punctured)
    line(text, "cut           none: the blade went less far than the mesh resolves");
  else if (outcome.cut.particles_added > 0)
    line(text, "cut           %.1f mm long; %d particles and %d triangles added; crossings V-P %d, V-V %d, P-V %d, P-P %d", 1000.0 * outcome.cut_length, outcome.cut.particles_added,
         outcome.cut.triangles_added, outcome.cut.vertex_edge, outcome.cut.vertex_vertex, outcome.cut.edge_vertex, outcome.cut.edge_edge);
  else if (punctured)
    line(text, "cut           none: the tool punctured at a vertex and did not cut as far as the next edge");
  else
    line(text, "cut           none: the tool did not puncture (puncture depth %.1f mm)", 1000.0 * organ.puncture_depth);
  line(text, "pieces        %d", outcome.pieces);
  line(text, "largest force %.3f N, deepest point %.1f mm", outcome.recording.largest_force(), 1000.0 * deepest);
  for (std::string const& note : {lag_text(outcome.body_counts), inverted_text(outcome.body_counts), to_text(outcome.recording.saturation())})
    if (!note.empty()) line(text, "note          %s", note.substr(0, note.size() - 1).c_str());
  if (auto const passed = passed_through(organ, outcome))
    line(text, "note          the tool came out of the organ on another side at %.3f s, %.1f mm below where it went in; the cut ends there", passed->time,
         1000.0 * passed->depth);
  if (options.coupling == Coupling::tight && !outcome.solid && outcome.cut.particles_added > 0)
    line(text, "note          tight coupling: 0 N while the tissue is cut; springs do not resist a blade");
  if (outcome.body_counts.diverged > 0)
    line(text, "wound gap     not measured: the body diverged");
  else if (outcome.gap && did_cut && !(*outcome.gap > 1e-5))
    line(text, "wound gap     0 mm: the wound does not open; without pre-tension (--prestrain), or cut along less than two edges, it stays closed");
  else if (outcome.gap && did_cut)
    line(text, "wound gap     %.2f mm, two seconds after the release", 1000.0 * *outcome.gap);
  else if (outcome.release && !outcome.gap)
    line(text, "wound gap     not measured: the run ends less than two seconds after the release");
  std::string names;
  for (std::string const& name : written) names += (names.empty() ? "" : ", ") + name;
  line(text, "written       %s: %s", options.out.string().c_str(), names.c_str());
  return text;
}

}  // namespace incision
