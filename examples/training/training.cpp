// SPDX-License-Identifier: MIT
// An expert's stroke is recorded; a novice, whose hand trembles and goes beside it, repeats it without and with guidance; both are scored.
#include "../exit_code.hpp"
#include "charts.hpp"
#include "hand.hpp"

#include <palpate/palpate.hpp>
#include <palpate/training.hpp>
#include <palpate/vtk/virtual_display.hpp>

#include <cstdio>
#include <filesystem>
#include <numbers>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace {

using namespace palpate;
using training::Flaws;
using training::Hand;
using training::Path;
using training::Vector;

constexpr Seed seed{7};
constexpr double puncture_depth = 0.006;   // m

/// Down through the skin, 4 cm along an arc 9 mm deep, and up; `pace` times as long as the expert needs.
Path stroke(double pace) {
  Vector const start(0.03, 0.04, 0.008), centre(0.05, 0.02, -0.009), along = Vector(0.02, 0.02, 0.0);
  Vector const end = centre + along;
  return Path::start(start)
      .hold(0.3 * pace)
      .line({start.x(), start.y(), centre.z()}, 1.2 * pace, Pace::minimum_jerk)
      .arc(centre, Vector::UnitZ(), -0.5 * std::numbers::pi, 2.4 * pace, Pace::minimum_jerk)
      .line({end.x(), end.y(), start.z()}, 1.0 * pace, Pace::minimum_jerk)
      .hold(0.3 * pace);
}

auto skin() {
  auto const mesh = make_grid<double>(21, 21, 0.005);   // 10 cm x 10 cm, at z = 0
  MassSpring<double> tissue(mesh, {.mass = {.total = 0.1}, .link = {.stiffness = 80.0, .damping = 0.2}, .home = {.stiffness = 8.0, .damping = 0.1}});
  tissue.nail(boundary_vertices(mesh));
  return SoftBody(std::move(tissue), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 4});
}

/// The published liver curves, eight times as strong, so that cutting is felt beside the 1 N of the puncture.
auto tissue_force() {
  return CuttingForce(scaled(liver_hysteresis<double>(), 8.0), CurveJoin<double>{.reversal_depth = 0.001},
                      WhiteGaussianNoise<double>({.snr_db = 30.0, .seed = seed.value}));
}

Configuration configuration(std::string const& who) {
  return Configuration{}.set("who", who).set("scene", "skin of golden program 05").set("cutter.puncture_depth_m", puncture_depth);
}

/// What a person did, and the same with the tissue's force alone: guidance is no fault of the hand.
struct Run {
  Session session{};
  Session tissue{};
};

template <class Device, class Force, class Guide>
Run run(std::string const& who, Device device, Force force, double seconds, Guide guide_force) {
  Simulator simulator(RecordedDevice(std::move(device), static_cast<std::size_t>(seconds * 1000.0) + 1), skin(),
                      ProgressiveCutter<double>({.puncture_depth = puncture_depth, .snap = 5e-4}), std::move(force));
  Recording tissue;
  Recording recording = simulator.run(seconds, [&](Tick tick) {
    tick.force -= guide_force(simulator);
    tissue.append(tick);
  });
  Run result{.session = make_session(std::move(recording), simulator.device(), configuration(who), seed)};
  result.tissue = result.session;
  result.tissue.recording = std::move(tissue);
  return result;
}

template <class Device>
Run run(std::string const& who, Device device, double seconds) {
  return run(who, std::move(device), tissue_force(), seconds, [](auto&) -> Vector { return Vector::Zero(); });
}

void print(char const* who, Comparison const& found, Score const& points) {
  std::printf(
      "%-8s deviation mean %.2f largest %.2f mm  missed %.2f mm  force %.3f N  jerk e^%.1f  time %+.0f %%  depth %.2f mm  "
      "overshoot %.2f mm  contacts %d\n",
      who, 1e3 * found.mean_deviation, 1e3 * found.largest_deviation, 1e3 * found.missed, found.rms_force_difference, found.excess_jerk,
      100.0 * found.excess_time, 1e3 * found.mean_depth_error, 1e3 * found.overshoot, found.unintended_contacts);
  std::printf("%-8s score %.1f:", who, points.total);
  for (auto const& line : points.lines) std::printf("  %s %.0f", to_string(line.part), line.points);
  std::printf("\n");
}

int train(std::filesystem::path const& folder) {
  std::error_code problem;
  std::filesystem::create_directories(folder, problem);
  if (problem) throw FileError("can not make the folder " + folder.string() + ": " + problem.message() + "; choose another");
  VirtualDisplay const display;
  if (!display.ready()) throw FileError("no pictures can be drawn: " + display.problem());

  Path const shown = stroke(1.0), slower = stroke(1.15);
  Run const expert = run("expert", Hand(shown, {.tremor = 0.00005, .seed = Seed{2}}), shown.duration());
  Flaws const flaws{.offset = {-0.001, 0.004, 0.001}, .tremor = 0.0003, .seed = Seed{3}};
  Run const novice = run("novice", Hand(slower, flaws), slower.duration());

  GuidanceOptions const options{.stiffness = 1500.0, .damping = 6.0, .dead_band = 0.0005, .fade = 0.0005, .max_force = 2.0, .arm_time = 0.3};
  if (options.stiffness > passive_wall(Hand::damping, options.damping, 0.001)) throw Error("this guidance would not be passive for this hand");
  PathGuidance<double> const guide(GuidePath<double>(expert.session.recording), options);
  Run const guided = run("guided", Hand(slower, flaws), Overlaid(tissue_force(), guide), slower.duration(),
                         [](auto& simulator) -> Vector { return simulator.force().over().force(); });

  for (auto const& [name, one] : {std::pair("expert", &expert), {"novice", &novice}, {"guided", &guided}}) {
    write_session(folder / (std::string(name) + ".session"), one->session);
    write_session_csv(folder / (std::string(name) + ".csv"), one->session);
  }
  Session const kept = read_session(folder / "expert.session");
  Run const again = run("expert", replay(kept, configuration("expert"), seed), static_cast<double>(kept.recording.ticks().size()) / kept.device.rate);
  bool const same = to_bytes(again.session) == to_bytes(expert.session);
  std::printf("expert   %zu ticks, replayed from expert.session: %s\n", kept.recording.ticks().size(), same ? "the same bytes" : "DIFFERS");

  ComparisonOptions const how{.still = 0.002};   // a tremor is no work
  Comparison const alone = compare(expert.tissue, novice.tissue, how), held = compare(expert.tissue, guided.tissue, how);
  print("novice", alone, score(alone));
  print("guided", held, score(held));
  training::write_charts(folder, {{"novice", &novice.tissue, &alone}, {"guided", &guided.tissue, &held}, {"expert", &expert.tissue}});
  return same ? 0 : 1;
}

constexpr char const* usage = "usage: training FOLDER";

}  // namespace

/// Exit codes: 0 done; 2 the arguments can not be used, or no pictures can be drawn; 1 the replay differs, or anything else.
int main(int argc, char** argv) {
  if (argc > 2) return std::fprintf(stderr, "training: takes one folder; \"%s\" is one argument more\n%s\n", argv[2], usage), 2;
  std::string const folder = argc == 2 ? argv[1] : "";
  if (folder == "--help") return std::printf("%s\n", usage), 0;
  if (folder.empty() || folder.front() == '-') return std::fprintf(stderr, "training: say in which folder the files go\n%s\n", usage), 2;
  return exit_code_of("training", [&]() -> int {
    return train(folder);
  });
}
