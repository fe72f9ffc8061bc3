// SPDX-License-Identifier: MIT
#include "options.hpp"

#include "../command_line.hpp"

#include <palpate/core/version.hpp>

#include <cmath>
#include <string>

namespace palpation {

Parsed parse_options(int argc, char** argv) {
  Parsed parsed;
  Options& o = parsed.options;
  CLI::App app{
      "Presses a soft organ along a line, with and without a hard nodule inside, and shows where the finger meets it:\n"
      "palpation.csv, a chart of force over place, a section coloured by stress (PNG), and a ParaView series (palpation.pvd).\n"
      "Without arguments it needs no file. All quantities are in SI units."};
  app.set_version_flag("--version", std::string("palpation (palpate ") + PALPATE_VERSION_STRING + ")");
  app.get_formatter()->column_width(34);
  app.footer("Exit codes: 0 done; 2 the input or the output folder can not be used, said in one line; 1 anything else.");
  app.add_option("--mesh", o.mesh, "closed surface of the organ: OBJ, STL, PLY, VTK; default: the library's own liver");
  app.add_option("--unit", o.unit, "unit of the mesh file: m, cm or mm")->check(CLI::IsMember({"m", "cm", "mm"}))->capture_default_str();
  app.add_option("--edge", o.edge, "edge of the lattice [m]")->check(command_line::range(1e-6, 1.0))->capture_default_str();
  app.add_option("--young", o.young, "Young's modulus of the organ [Pa]")->check(command_line::range(10.0, 1e9))->capture_default_str();
  app.add_option("--poisson", o.poisson, "Poisson's ratio of organ and nodule")->check(command_line::range(0.0, 0.49))->capture_default_str();
  app.add_option("--nodule", o.nodule, "x,y,z,r,young: a ball's middle and radius [m] and its Young's modulus [Pa]; default: 14 mm below the middle of the line, 8 mm, 20 times the organ's")
      ->delimiter(',')->expected(5);
  app.add_option("--places", o.places, "how many places are pressed, evenly along the line")->check(command_line::range(3, 1000))->capture_default_str();
  app.add_option("--depth", o.depth, "how deep each is pressed in the middle of the pad [m]")->check(command_line::range(1e-6, 1.0))->capture_default_str();
  app.add_option("--pad", o.pad, "radius of the finger's pad [m]")->check(command_line::range(1e-6, 1.0))->capture_default_str();
  app.add_option("--out", o.out, "folder for the results")->capture_default_str();
  app.add_flag("!--no-pictures", o.pictures, "write no PNG files");
  parsed.exit_code = command_line::parse(app, "palpation", argc, argv, [&] {
    if (o.nodule.empty()) return;
    for (double const value : o.nodule)
      if (!std::isfinite(value)) throw CLI::ValidationError("--nodule", "all five numbers have to be finite");
    if (!(o.nodule[3] > 0)) throw CLI::ValidationError("--nodule", "the radius, the fourth number, has to be positive");
    if (!(o.nodule[4] >= 10 && o.nodule[4] <= 1e10)) throw CLI::ValidationError("--nodule", "Young's modulus, the fifth number, is in Pa, from 10 to 1e10");
  });
  return parsed;
}

}  // namespace palpation
