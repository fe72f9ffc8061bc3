// SPDX-License-Identifier: MIT
#include "options.hpp"

#include "../command_line.hpp"

#include <palpate/core/version.hpp>

#include <string>

namespace retraction {

Parsed parse_options(int argc, char** argv) {
  Parsed parsed;
  Options& o = parsed.options;
  CLI::App app{
      "Two hooks draw the tissue of a liver apart while a scalpel cuts between them: three hands at one solid.\n"
      "Writes what each hand felt (CSV), pictures (PNG), and a ParaView series (retraction.pvd)."};
  app.set_version_flag("--version", std::string("retraction (palpate ") + PALPATE_VERSION_STRING + ")");
  app.get_formatter()->column_width(34);
  app.footer("Exit codes: 0 done; 2 the arguments or the output folder can not be used, said in one line; 1 anything else.");
  app.add_flag("--realtime", o.realtime, "a servo thread at 1 kHz for each hand, the body at its own rate; default: lock-step, the same bytes each time");
  app.add_option("--body-rate", o.body_rate, "rate of the body in real time [Hz]")->check(command_line::range(30.0, 2000.0))->capture_default_str();
  app.add_option("--out", o.out, "folder for the results")->capture_default_str();
  app.add_flag("!--no-pictures", o.pictures, "write no PNG files");
  parsed.exit_code = command_line::parse(app, "retraction", argc, argv, [] {});
  return parsed;
}

}  // namespace retraction
