// SPDX-License-Identifier: MIT
#include "report.hpp"

#include <palpate/core/detail/whole_file.hpp>

#include <vtkCamera.h>

#include <initializer_list>
#include <sstream>

namespace viewer {

void Report::add(std::string const& name, Window const& window) {
  std::ostringstream out;
  out.precision(9);
  auto const line = [&](char const* what, std::initializer_list<double> values) {
    out << what;
    for (double const value : values) out << ' ' << value;
    out << '\n';
  };
  auto const vector = [&](char const* what, Vector const& v) { line(what, {v.x(), v.y(), v.z()}); };
  Live const& live = window.live();
  Moment const& now = live.now;
  Box const& scene = window.layout().scene;
  vtkCamera* const camera = window.scene().renderer()->GetActiveCamera();
  out << "shot " << name << '\n';
  line("time", {live.time});
  line("scene", {scene.x, scene.y, scene.width, scene.height});
  vector("camera", Vector(camera->GetPosition()));
  vector("target", Vector(camera->GetFocalPoint()));
  vector("up", Vector(camera->GetViewUp()));
  line("view_angle", {camera->GetViewAngle()});
  vector("tip", now.tick.tip);
  line("touches", {now.touches ? 1.0 : 0.0});
  vector("proxy", now.proxy);
  vector("force", now.tick.force);
  line("arrow_per_newton", {arrow_per_newton});
  line("depth", {now.tick.depth});
  line("energy", {now.energy});
  HookMoment const& hook = live.hook;
  vector("hook_place", window.hook().place);
  vector("hook", hook.tick.tip);
  vector("hook_force", hook.tick.force);
  line("hooked", {hook.is_hooked ? 1.0 : 0.0});
  line("hook_parked", {hook.is_parked() ? 1.0 : 0.0});
  line("triangles", {static_cast<double>(live.triangles)});
  line("pieces", {static_cast<double>(live.wound.pieces)});
  line("cut_area", {live.wound.area});
  line("uncut", {live.is_uncut ? 1.0 : 0.0});
  out << "phase " << to_string(now.tick.phase) << '\n';
  auto const chart = [&](char const* what, LiveChart const& of, double value) {
    auto const origin = of.pixel(live.time - 1.0, 0.0), one = of.pixel(live.time, 1.0);
    line(what, {live.chart.empty() ? 0.0 : live.chart.back().time, value, origin[0], origin[1], one[0], one[1]});
  };
  chart("force_chart", window.charts().force(), live.chart.empty() ? 0.0 : live.chart.back().force);
  chart("energy_chart", window.charts().energy(), live.chart.empty() ? 0.0 : 1000.0 * live.chart.back().energy);
  out << "note " << live.note << "\nend\n";
  text_ += out.str();
}

void Report::write(std::filesystem::path const& file) const { palpate::detail::write_whole_file(file, text_); }

}  // namespace viewer
