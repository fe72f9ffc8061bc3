// SPDX-License-Identifier: MIT
#include "options.hpp"

#include "../command_line.hpp"

#include <palpate/core/version.hpp>

#include <map>
#include <string>

namespace viewer {

Parsed parse_options(int argc, char** argv) {
  Parsed parsed;
  Options& o = parsed.options;
  std::map<std::string, TissueName> const tissues{{"soft", TissueName::soft}, {"firm", TissueName::firm}, {"solid", TissueName::solid}};
  std::map<std::string, IntegratorName> const integrators{{"leapfrog", IntegratorName::leapfrog}, {"backward-euler", IntegratorName::backward_euler}};
  std::map<std::string, Coupling> const couplings{{"loose", Coupling::loose}, {"tight", Coupling::tight}, {"proxy", Coupling::proxy}};
  std::map<std::string, Blade> const blades{{"none", Blade::none}, {"progressive", Blade::progressive}, {"separating", Blade::separating}};
  std::string tissue = "soft", integrator = "leapfrog", coupling = "loose", blade = "progressive";
  bool lock_step = false, realtime = false;

  CLI::App app{
      "A window with a liver, or your organ: the mouse is the hand. Move to go over the organ, hold the left button to press, drag to cut, turn the wheel\n"
      "to go deeper, h shows the keys. The forces are drawn, not felt: a mouse has no motors."};
  app.set_version_flag("--version", std::string("viewer (palpate ") + PALPATE_VERSION_STRING + ")");
  app.get_formatter()->column_width(34);
  app.footer("Exit codes: 0 done; 2 the input or the output folder can not be used, or there is no display, said in one line; 1 anything else.");

  auto const start = "To begin with (keys switch the last four)";
  auto* const mesh = app.add_option("--mesh", o.setup.mesh, "your organ, a closed surface: OBJ, STL, PLY, VTK; default: the library's own liver");
  mesh->group(start);
  app.add_option("--unit", o.setup.unit, "unit of the mesh file: m, cm or mm")->check(CLI::IsMember({"m", "cm", "mm"}))->needs(mesh)->capture_default_str()->group(start);
  app.add_option("--up", o.setup.up, "where its upper side looks: x, -x, y, -y, z, -z or auto (across the flattest extent)")
      ->check(CLI::IsMember({"auto", "x", "-x", "y", "-y", "z", "-z"}))->needs(mesh)->capture_default_str()->group(start);
  app.add_option("--resolution", o.setup.vertices, "vertices of the library's own liver")->check(command_line::range(500, 20000))->capture_default_str()->group(start);
  app.add_option("--tissue", tissue, "soft or firm: a skin of springs; solid: finite elements")->check(CLI::IsMember(tissues))->capture_default_str()->group(start);
  app.add_option("--integrator", integrator, "leapfrog or backward-euler")->check(CLI::IsMember(integrators))->capture_default_str()->group(start);
  app.add_option("--coupling", coupling, "loose: force curves; tight: the tissue's own reaction; proxy: a spring to the surface, with friction")
      ->check(CLI::IsMember(couplings))->capture_default_str()->group(start);
  app.add_option("--cutter", blade, "none, progressive or separating; the last for a skin of springs only")->check(CLI::IsMember(blades))->capture_default_str()->group(start);

  auto const running = "Running";
  auto* const real = app.add_flag("--realtime", realtime, "two threads by the clock; the default without --script")->group(running);
  app.add_flag("--lock-step", lock_step, "a virtual clock, the same bytes each time; the default with --script")->excludes(real)->group(running);
  app.add_option("--seconds", o.seconds, "ends by itself after so many simulated seconds; 0: when the window is closed")
      ->check(command_line::range(0.0, 36000.0))->group(running);
  app.add_option("--replay", o.replay, "plays a recording first, on an organ set up as it says; a file of text if its name ends in .csv")->group(running);
  app.add_option("--script", o.script, "plays a mouse from a file, writes its pictures and report.txt, and ends; see the README")->group(running);
  app.add_option("--out", o.out, "folder for recordings, pictures and the report")->capture_default_str()->group(running);
  app.add_option("--width", o.width, "of the window, pixels")->check(command_line::range(960, 3840))->capture_default_str()->group(running);
  app.add_option("--height", o.height, "of the window, pixels")->check(command_line::range(680, 2160))->capture_default_str()->group(running);

  parsed.exit_code = command_line::parse(app, "viewer", argc, argv, [&] {
    o.setup.tissue = tissues.at(tissue);
    o.setup.integrator = integrators.at(integrator);
    o.setup.coupling = couplings.at(coupling);
    o.setup.blade = blades.at(blade);
    o.realtime = realtime || (!lock_step && o.script.empty());
  });
  return parsed;
}

}  // namespace viewer
