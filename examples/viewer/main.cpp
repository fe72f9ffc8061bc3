// SPDX-License-Identifier: MIT
// A window in which the mouse palpates and cuts a liver.
#include "../exit_code.hpp"
#include "engine.hpp"
#include "options.hpp"
#include "script.hpp"
#include "window.hpp"

#include <palpate/core/error.hpp>
#include <palpate/vtk/virtual_display.hpp>

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <system_error>
#include <vector>

namespace {

void run(viewer::Options const& options) {
  using namespace viewer;
  bool const scripted = !options.script.empty();
  std::vector<Step> script;
  if (scripted) {
    script = read_script(options.script);
    std::error_code problem;
    std::filesystem::create_directories(options.out, problem);
    if (problem) throw palpate::FileError("can not make the folder " + options.out.string() + ": " + problem.message() +
                                          "; choose another with --out");
  }
  std::optional<Recorded> recorded;
  if (!options.replay.empty()) recorded = read_recorded(options.replay);

  std::optional<palpate::VirtualDisplay> display;
  if (scripted) display.emplace();
  if (scripted ? !display->ready() : !palpate::display_available())
    throw palpate::FileError(scripted ? display->problem() : "there is no display for a window; log in with one, or see --script");

  Engine engine(recorded ? setup_of(recorded->mouse, options.setup) : options.setup, options.out, options.realtime);
  if (recorded) engine.play(std::move(*recorded));
  PictureClock pictures;
  {
    Window window(engine, options.width, options.height, options.realtime);
    if (options.realtime) engine.start();
    if (scripted)
      play(script, engine, window, options.out, options.realtime);
    else
      window.run(options.seconds);
    engine.stop();
    pictures = window.pictures();
  }
  engine.finish();
  for (auto const& file : engine.written()) std::printf("recorded %s\n", file.string().c_str());
  Live const live = engine.live();
  auto const count = [](std::uint64_t ticks) { return static_cast<unsigned long long>(ticks); };
  std::printf("ran %.2f s, servo ", live.time);
  if (options.realtime) std::printf("%.0f Hz, ", live.servo.rate);
  std::printf("p99 %.0f us, late ticks %llu of %llu%s%s\n", 1e6 * live.servo.p99, count(live.servo.late), count(live.servo.ticks),
              live.note.empty() ? "" : "; ", live.note.c_str());
  if (pictures.count() > 0 || pictures.is_plain())
    std::printf("drew %.0f pictures a second%s\n", pictures.mean_rate(), pictures.is_plain() ? ", plain: there is no graphics card" : "");
}

}  // namespace

/// Exit codes: 0 done; 2 the input or the output folder can not be used, or there is no display, said in one line on standard error; 1 anything else.
int main(int argc, char** argv) {
  return exit_code_of("viewer", [&]() -> int {
    viewer::Parsed const parsed = viewer::parse_options(argc, argv);
    if (parsed.exit_code) return *parsed.exit_code;
    run(parsed.options);
    return 0;
  });
}
