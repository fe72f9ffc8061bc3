// SPDX-License-Identifier: MIT
// Two hooks draw the tissue of a liver apart while a scalpel cuts between them: three tools in three hands, one simulator, one solid. README.md is the lesson.
#include "../exit_code.hpp"
#include "options.hpp"
#include "outputs.hpp"
#include "scene.hpp"
#include "vibration.hpp"

#include <palpate/core/error.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <limits>
#include <span>
#include <string>
#include <system_error>

namespace retraction {

namespace {

using palpate::Tick;

double milliseconds(palpate::DurationHistogram::Duration time) { return 1e-6 * static_cast<double>(time.count()); }

/// m, how long the wound is along x in the undeformed solid.
double wound_length(Body const& body) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  auto const& surface = body.tissue().surface();
  for (int t = 0; t < surface.triangle_count(); ++t)
    if (body.tissue().is_wound(t))
      for (int const corner : surface.corners(t)) {
        double const x = body.tissue().rest_position(corner).x();
        low = std::min(low, x), high = std::max(high, x);
      }
  return std::max(0.0, high - low);
}

int run(Options const& options) {
  std::error_code problem;
  std::filesystem::create_directories(options.out, problem);
  if (problem || !std::filesystem::is_directory(options.out))
    throw palpate::FileError(palpate::detail::message("can not make the output folder ", options.out.string(), "; choose another with --out"));

  Plan const plan;
  Organ const organ(plan);
  auto simulator = make_simulator(plan, organ, options.body_rate);
  Outputs outputs(options, organ);
  auto const draw = [&](char const* name, Vector const& tip) {
    outputs.draw(name, simulator.body(), {simulator.tool<0>().rods(), simulator.tool<1>().rods(), tip});
  };

  palpate::ToolRecordings session({});
  if (options.realtime) {
    session = simulator.run_realtime(plan.end());
    draw("after", session.recording(2).ticks().back().tip);
    outputs.add_frame(plan.end(), simulator.body());
  } else {
    auto const at = [](Tick const& tick, double time) { return std::abs(tick.time - time) < 0.5e-3; };
    std::size_t count = 0;
    session = simulator.run(plan.end(), [&](std::span<Tick const> ticks) {
      Tick const& now = ticks[2];
      if (at(now, 0)) draw("before", now.tip);
      if (at(now, plan.drawn())) draw("drawn", now.tip);
      if (at(now, plan.cutting() + 0.6 * plan.cut_in)) draw("cutting", now.tip);
      if (at(now, plan.end() - 1e-3)) draw("after", now.tip);
      if (count++ % 200 == 0) outputs.add_frame(now.time, simulator.body());
    });
  }

  Body const& body = simulator.body();
  auto const statistics = simulator.statistics<0>();
  std::printf("tissue      %d tetrahedra of finite elements, %d particles, implicit steps\n", static_cast<int>(organ.solid.tetrahedra.cols()), static_cast<int>(organ.solid.points.cols()));
  std::printf("tools       %zu: two hooks, %d of them hold; a scalpel\n", session.recordings().size(),
              (simulator.tool<0>().hooked() ? 1 : 0) + (simulator.tool<1>().hooked() ? 1 : 0));
  std::printf("cut         %.1f mm long, %.2f cm2 of one wall, %d tetrahedra now\n", 1e3 * wound_length(body), 1e4 * simulator.tool<2>().area(), body.tissue().tetrahedra());
  constexpr std::array names{"left hook", "right hook", "scalpel"};
  for (std::size_t k = 0; k < names.size(); ++k) {
    palpate::Recording const& felt = session.recording(k);
    auto const at_rest = ticks_from(felt.ticks(), plan.at_rest());
    double const mean = felt.mean_force(plan.at_rest(), plan.end()).norm(), trembles = rms_above(at_rest, 30.0, 1000.0);
    std::printf("%-11s largest %.3f N; at rest mean %.3f N, above 30 Hz rms %.6f N (%.4f %%)\n", names[k], felt.largest_force(), mean, trembles, 100 * trembles / mean);
    std::string file = std::string(names[k]) + ".csv";
    std::replace(file.begin(), file.end(), ' ', '_');
    felt.write_csv(options.out / file);
    outputs.wrote(file);
  }
  double const period = options.realtime ? 1e3 / options.body_rate : 1.0, mean = milliseconds(statistics.body.compute().mean());
  std::printf("servo       1 kHz: p50 %.2f us, p99 %.2f us\n", 1e3 * milliseconds(statistics.servo.compute().p50()), 1e3 * milliseconds(statistics.servo.compute().p99()));
  std::printf("body        mean %.2f ms, p99 %.2f ms of a tick of %.0f ms: %.0f %% of real time%s\n", mean, milliseconds(statistics.body.compute().p99()), period, 100 * mean / period,
              options.realtime ? "" : " (in lock-step)");
  if (options.realtime) std::printf("lag         %.1f ms behind the hands after %.1f s\n", 1e3 * statistics.body_counts.lag, plan.end());
  std::printf("written     %s: %s\n", options.out.string().c_str(), outputs.written().c_str());
  return 0;
}

}  // namespace

}  // namespace retraction

/// Exit codes: 0 done; 2 the arguments or the output folder can not be used, said in one line on standard error; 1 anything else.
int main(int argc, char** argv) {
  using namespace retraction;
  return exit_code_of("retraction", [&]() -> int {
    Parsed const parsed = parse_options(argc, argv);
    return parsed.exit_code ? *parsed.exit_code : run(parsed.options);
  });
}
