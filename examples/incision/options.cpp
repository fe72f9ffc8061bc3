// SPDX-License-Identifier: MIT
#include "options.hpp"

#include "../command_line.hpp"

#include <palpate/core/version.hpp>

#include <map>
#include <string>

namespace incision {

Parsed parse_options(int argc, char** argv) {
  Parsed parsed;
  Options& o = parsed.options;
  std::string tissue_name = "springs", coupling, integrator;
  std::map<std::string, IntegratorName> const integrators{{"leapfrog", IntegratorName::leapfrog},
                                                          {"velocity-verlet", IntegratorName::velocity_verlet},
                                                          {"symplectic-euler", IntegratorName::symplectic_euler},
                                                          {"explicit-euler", IntegratorName::explicit_euler},
                                                          {"rk4", IntegratorName::runge_kutta_4},
                                                          {"backward-euler", IntegratorName::backward_euler}};
  std::map<std::string, TissueName> const tissues{{"springs", TissueName::springs}, {"fem", TissueName::solid}};
  std::map<std::string, Coupling> const couplings{{"loose", Coupling::loose}, {"tight", Coupling::tight}};

  CLI::App app{
      "Palpates, punctures and cuts a liver with a scripted hand at 1 kHz, and writes what was felt and seen:\n"
      "session.csv, charts and pictures (PNG), and a ParaView series (tissue.pvd). Without arguments it needs no file.\n"
      "All quantities are in SI units."};
  app.set_version_flag("--version", std::string("incision (palpate ") + PALPATE_VERSION_STRING + ")");
  app.get_formatter()->column_width(38);
  app.footer("Exit codes: 0 done; 2 the input or the output folder can not be used, said in one line; 1 anything else.");

  auto const organ = "Organ and hand";
  app.add_option("--mesh", o.mesh, "surface to cut: OBJ, STL, PLY, VTK; default: the library's own liver")->group(organ);
  app.add_option("--unit", o.unit, "unit of the mesh file: m, cm or mm")->check(CLI::IsMember({"m", "cm", "mm"}))->capture_default_str()->group(organ);
  app.add_option("--up", o.up, "where the upper side looks: x, -x, y, -y, z, -z or auto (across the flattest extent)")
      ->check(CLI::IsMember({"auto", "x", "-x", "y", "-y", "z", "-z"}))->capture_default_str()->group(organ);
  app.add_option("--resolution", o.resolution, "vertices of the library's own liver")->check(command_line::range(500, 100000))->capture_default_str()->group(organ);
  auto* const tool = app.add_option("--tool", o.tool, "path of the tool tip, CSV with columns time_s,x_m,y_m,z_m; default: a stroke on the upper side");
  tool->group(organ);
  app.add_option("--device", o.device,
                 "script: the scripted hand; hd: or hd:<name>: a PHANToM or Touch through the vendor's libHD, dhd: or dhd:<index>: a device of Force Dimension through "
                 "libdhd, both found at run time; or null:, script:FILE.csv, sim:hand, sim:touch, replay:FILE, with their options: sim:touch?hand=light")
      ->capture_default_str()->excludes(tool)->group(organ);
  app.add_option("--seconds", o.seconds, "simulated time; default: the path and 2.2 s more, 10 s with a device")->check(command_line::range(0.01, longest_run))->group(organ);

  auto const tissue = "Tissue";
  auto const not_negative = command_line::range(0.0, 1e9);
  app.add_option("--tissue", tissue_name, "springs: a skin of springs; fem: a solid of finite elements")->check(CLI::IsMember(tissues))->capture_default_str()->group(tissue);
  app.add_option("--young", o.young, "Young's modulus of the solid [Pa]; default: 5000")->check(command_line::range(10.0, 1e9))->group(tissue);
  app.add_option("--poisson", o.poisson, "Poisson's ratio of the solid; default: 0.45")->check(command_line::range(0.0, 0.499))->group(tissue);
  app.add_option("--toughness", o.toughness, "what a new area costs the hand in a solid [J/m2]; default: 60")->check(command_line::range(0.0, 1e6))->group(tissue);
  app.add_option("--lip-friction", o.lip_friction, "of the lips of a cut in a solid, per length of blade in it [N/m]; default: 10")->check(command_line::range(0.0, 1e6))->group(tissue);
  app.add_option("--edge", o.edge, "edge of the solid's lattice [m]; default: a 28th of the organ's diagonal")->check(command_line::range(1e-6, 1.0))->group(tissue);
  app.add_option("--mass", o.mass, "total mass [kg]; default: 1060 kg/m3 times the enclosed volume")->check(command_line::range(1e-6, 1e6))->group(tissue);
  app.add_option("--link-stiffness", o.link_stiffness, "spring along an edge [N/m]; default: 62500/s2 times the mean mass of a particle")->check(command_line::range(1e-9, 1e9))->group(tissue);
  app.add_option("--link-damping", o.link_damping, "its damper [N s/m]; default: 6/s times that mass")->check(not_negative)->group(tissue);
  app.add_option("--home-stiffness", o.home_stiffness, "spring that holds a particle at its rest position [N/m]; default: 25000/s2 times that mass")->check(command_line::range(1e-9, 1e9))->group(tissue);
  app.add_option("--home-damping", o.home_damping, "its damper [N s/m]; default: 310/s times that mass")->check(not_negative)->group(tissue);
  app.add_option("--prestrain", o.prestrain, "pre-tension: springs, or a solid, would be this share shorter, so a wound gapes; default: 0.25, of a solid 0.08")->check(command_line::range(0.0, 0.9))->group(tissue);
  app.add_option("--zone", o.zone, "compute only so many rings around the tool; 0: the whole body")->check(command_line::range(0, 1000))->capture_default_str()->group(tissue);
  app.add_option("--integrator", integrator, "leapfrog, velocity-verlet, symplectic-euler, explicit-euler or rk4; of a solid backward-euler or leapfrog; default: leapfrog, of a solid backward-euler")->check(CLI::IsMember(integrators))->group(tissue);

  auto const force = "Cut and force";
  app.add_option("--puncture-depth", o.puncture_depth, "[m]; default: a twentieth of the organ's diagonal, at most 0.018; of a solid half an edge, and at most 0.7; at most the organ's thickness")->check(command_line::range(1e-6, 1e6))->group(force);
  app.add_option("--curve-factor", o.curve_factor, "the published liver curve, of a 4 mm probe, times this for a blade that cuts")->check(command_line::range(0.0, 1000.0))->capture_default_str()->group(force);
  app.add_option("--organ-coefficient", o.organ_coefficient, "drag of the organ on the blade, per depth [N s/m2]")->check(not_negative)->capture_default_str()->group(force);
  app.add_option("--snr", o.snr_db, "signal-to-noise ratio of the force [dB]")->check(command_line::range(0.0, 300.0))->capture_default_str()->group(force);
  app.add_option("--seed", o.seed, "of the noise in the force")->check(command_line::whole_number())->capture_default_str()->group(force);
  app.add_option("--coupling", coupling, "loose: the measured force curves; tight: the tissue's own reaction, while it is cut that of a solid alone; default: loose, of a solid tight")->check(CLI::IsMember(couplings))->group(force);

  auto const output = "Output";
  app.add_option("--out", o.out, "folder for the results")->capture_default_str()->group(output);
  app.add_flag("!--no-pictures", o.pictures, "write no PNG files")->group(output);
  app.add_flag("--realtime", o.realtime, "run servo and body on two threads by the clock instead of in lock-step")->group(output);

  parsed.exit_code = command_line::parse(app, "incision", argc, argv, [&] {
    o.tissue = tissues.at(tissue_name);
    bool const solid = o.tissue == TissueName::solid;
    for (char const* const name : {"--young", "--poisson", "--edge", "--toughness", "--lip-friction"})
      if (!solid && app.count(name) > 0) throw CLI::ValidationError(name, "springs have none; add --tissue fem");
    for (char const* const name : {"--zone", "--link-stiffness", "--link-damping", "--home-stiffness", "--home-damping"})
      if (solid && app.count(name) > 0) throw CLI::ValidationError(name, "a solid has none; leave it out, or take --tissue springs");
    if (!coupling.empty()) o.coupling = couplings.at(coupling);
    if (!integrator.empty()) o.integrator = integrators.at(integrator);
    bool const implicit = o.integrator == IntegratorName::backward_euler, leapfrog = o.integrator == IntegratorName::leapfrog;
    if (o.integrator && (solid ? !implicit && !leapfrog : implicit))
      throw CLI::ValidationError("--integrator", integrator + (solid ? " does not move a solid here; take backward-euler or leapfrog" : " goes with --tissue fem"));
  });
  return parsed;
}

}  // namespace incision
