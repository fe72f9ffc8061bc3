// SPDX-License-Identifier: MIT
// A hand palpates tissue that is elsewhere: what delay, jitter and loss of the network between them do, on a virtual clock.
//   grid       energy given to the hand is never more than a sampled spring leaks, and a hand that rests is quiet
//   silence    the force is frozen, fades, and comes back or has to be touched anew
//   stiffness  a force that comes over the network alone is stable up to b/(T/2 + T_d), one at the hand's side up to 2 b/T
//   deadband   messages saved against the error that is felt
//   surface    plane or ball, and how often it is told, under a tool that slides
#include "../album.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/no_cutter.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/device/simulated_hand.hpp>
#include <palpate/force/concept.hpp>
#include <palpate/haptics/filtered_wall.hpp>
#include <palpate/haptics/proxy_force.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/network/network_simulation.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace palpate;
using Vector = Vector3<double>;

bool is_whole = false;   // --all: the whole grid

constexpr double servo = 1000.0, T = 1.0 / servo, spring = 500.0;   // Hz, s, N/m of SurfaceThenTissue

/// A sheet of 7 × 7 cm, its edge nailed, and so many times as stiff.
auto sheet(double times = 1.0) {
  auto const skin = make_grid<double>(15, 15, 0.005);
  MassSpring<double> tissue(
      skin, {.mass = {.total = 0.05}, .link = {.stiffness = times * 80.0, .damping = 0.2}, .home = {.stiffness = times * 8.0, .damping = 0.1}});
  tissue.nail(boundary_vertices(skin));
  return SoftBody(std::move(tissue), LeapfrogVerlet{});
}

// --- grid -----------------------------------------------------------------------------------------------------------------

struct Link {
  double delay = 0.0, jitter = 0.0, loss = 0.0;   // ms each way, ms, share
};
struct Control {
  double by_force = 11.0, by_chain = 11.0;   // N s/m: the most that SurfaceThenTissue adds, and the passivity controller behind it
  double times = 1.0;                        // as stiff, spring and tissue
};
constexpr Control none{0.0, 0.0}, chain_only{0.0, 11.0}, controlled{}, softer{0.0, 0.0, 0.25};
constexpr double debt = 1e-3;   // J, at which SurfaceThenTissue damps with all it may

/// A press of 15 mm that is held for 2 s; what came of it.
struct Press {
  double least = 0.0;        // J, taken so far or by a contact
  double leak = 0.0;         // J, Σ K |Δx|²/2 while there is a force
  double trembles = 0.0, force_trembles = 0.0;   // m, N: peak to peak in the last 200 ms of the hold
  double step = 0.0, most = 0.0;                 // N in a tick, N
  double inside = 0.0;       // m, proxy behind its surface
  double late = 0.0;         // s, the latest answer
  double felt = 0.0;         // share of the hold with a force
  std::vector<double> time, height;
};

Press press(HandOptions const& hand, Link const& link, Control const& control, std::uint64_t seed = 1) {
  Impairment const way{.delay = 1e-3 * link.delay, .jitter = 1e-3 * link.jitter, .loss = link.loss, .burst = 2.0, .seed = seed};
  NetworkSimulationOptions options{.up = way, .down = way, .servo = {.safety = {.slew = 500.0, .damping = control.by_chain}}};
  options.down.seed = seed + 1;
  constexpr double pressed = 0.6, let_go = 2.6, end = 3.4;   // s
  Vector const above(0.0362, 0.0383, 0.005), below(0.0362, 0.0383, -0.015);
  auto path = Trajectory<double>::start(above).hold(0.1).line(below, 0.5, Pace::minimum_jerk).hold(2.0).line({0.0362, 0.0383, 0.01}, 0.4, Pace::minimum_jerk).hold(1.0);
  NetworkSimulation simulation(SimulatedHand<double>(std::move(path), {.hand = hand}), sheet(control.times), NoCutter<double>{},
                               SurfaceThenTissue<double>({.surface = {.max_stiffness = control.times * spring}, .damping = control.by_force, .debt = debt}), options);
  Press is;
  Vector tip = above, force(0, 0, 0);
  double low = 1.0, high = -1.0, least = 1e9, most = -1e9;
  int felt = 0, ticks = 0;
  Recording const recording = simulation.run(end, [&](Tick const& tick) {
    auto const& surface = simulation.force().surface();
    if (surface.stiffness > 0.0) is.inside = std::min(is.inside, surface.distance(simulation.force().proxy().position()));
    if (!is_zero(tick.force)) is.leak += spring * (tick.tip - tip).squaredNorm() / 2;
    is.step = std::max(is.step, (tick.force - force).norm());
    is.most = std::max(is.most, tick.force.norm());
    is.least = std::min(is.least, tick.energy);
    is.late = std::max(is.late, simulation.remote().latency());
    tip = tick.tip, force = tick.force;
    if (tick.time > pressed && tick.time < let_go) ++ticks, felt += is_zero(tick.force) ? 0 : 1;
    if (tick.time > let_go - 0.2 && tick.time < let_go) {
      low = std::min(low, tip.z()), high = std::max(high, tip.z());
      least = std::min(least, force.z()), most = std::max(most, force.z());
    }
    is.time.push_back(tick.time), is.height.push_back(tick.tip.z());
  });
  is.trembles = high - low, is.force_trembles = most - least, is.felt = static_cast<double>(felt) / ticks;
  for (ContactEnergy const& contact : contact_energies(recording)) is.least = std::min(is.least, contact.energy);
  return is;
}

constexpr std::array<double, 6> delays{0.0, 5.0, 10.0, 20.0, 50.0, 100.0};

void grid() {
  std::printf("grid: a hand presses 15 mm, holds for 2 s and lets go; delay each way\n");
  std::printf("%8s %7s %6s %6s %9s %9s %11s %11s %9s %9s %10s %7s\n", "delay", "jitter", "loss", "hand", "latest", "felt", "least E", "bound", "tremble", "tremble", "step",
              "inside");
  std::printf("%8s %7s %6s %6s %9s %9s %11s %11s %9s %9s %10s %7s\n", "[ms]", "[ms]", "[%]", "", "[ms]", "[%]", "[mJ]", "[mJ]", "[mm]", "[N]", "[N/tick]", "[m]");
  int cells = 0, kept = 0, whole = 0, parts = 0, nothing = 0, place = 0;
  double worst = 0.0, worst_step = 0.0, worst_inside = 0.0, worst_tremble = 0.0;
  for (double const delay : delays)
    for (double const jitter : {0.0, 5.0, 10.0})
      for (double const loss : {0.0, 0.01, 0.1, 0.3}) {
        int const d = place / 12, j = place / 4 % 3, l = place % 4;
        ++place;
        if (!is_whole && (d + j + l) % 3 != 0) continue;
        for (auto const& [name, hand] : {std::pair{"light", light_hand()}, {"normal", normal_hand()}, {"firm", firm_hand()}}) {
          if (!is_whole && hand.stiffness != light_hand().stiffness) continue;
          Press const is = press(hand, {delay, jitter, loss}, controlled);
          double const bound = is.leak + debt;
          std::printf("%8.0f %7.0f %6.0f %6s %9.0f %9.0f %11.4f %11.4f %9.4f %9.4f %10.3f %7.0e\n", delay, jitter, 100 * loss, name, 1e3 * is.late, 100 * is.felt, 1e3 * is.least,
                      1e3 * bound, 1e3 * is.trembles, is.force_trembles, is.step, is.inside + 0.0);
          ++cells;
          kept += is.least >= -bound ? 1 : 0;
          (is.felt > 0.99 ? whole : is.felt > 0.0 ? parts : nothing) += 1;
          worst = std::min(worst, is.least), worst_step = std::max(worst_step, is.step), worst_inside = std::min(worst_inside, is.inside),
          worst_tremble = std::max(worst_tremble, is.trembles);
        }
      }
  std::printf("grid: %d presses, %d within the bound; least energy %.4f mJ, largest tremble %.3f mm, largest step %.3f N, proxy inside %.0e m\n", cells, kept,
              1e3 * worst, 1e3 * worst_tremble, worst_step, worst_inside + 0.0);
  std::printf("grid: the hold is felt throughout in %d presses, in part in %d, not at all in %d\n\n", whole, parts, nothing);
}

void over_delay(drawing::Album& album) {
  drawing::Picture energy("network_energy", "Energy that the rendered force has given a light hand at most", "delay each way [ms]", "energy given, from 0.001 mJ on [mJ]");
  energy.y().logarithmic = true, energy.y().from = 0.001, energy.y().to = 100.0;
  drawing::Picture height("network_control", "A light hand presses, holds and lets go, 50 ms each way", "time [s]", "height of the tip [mm]");
  height.y().from = -15.0, height.y().to = 5.0, height.x().to = 3.0;
  struct Way {
    char const* name;
    Control control;
    drawing::Colour colour;
  };
  Way const ways[] = {{"no control", none, drawing::pink},
                      {"a quarter of the stiffness", softer, drawing::orange},
                      {"passivity controller", chain_only, drawing::green},
                      {"damped, and controller", controlled, drawing::blue}};
  std::printf("control: a light hand, no jitter, no loss\n%8s  %-28s %12s %12s %12s %12s\n", "delay", "", "given [mJ]", "tremble [mm]", "force [N]", "step [N]");
  for (Way const& way : ways) {
    auto& line = energy.line(way.colour, way.name);
    line.marks = true;
    for (double const delay : delays) {
      Press const is = press(light_hand(), {.delay = delay}, way.control);
      double const given = std::max(0.0, -is.least);
      drawing::add(line, delay, std::max(1e3 * given, 0.001));
      std::printf("%8.0f  %-28s %12.4f %12.4f %12.3f %12.3f\n", delay, way.name, 1e3 * given, 1e3 * is.trembles, is.most, is.step);
      if (delay == 50.0) {
        auto& curve = height.line(way.colour, way.name);
        for (std::size_t k = 0; k < is.time.size(); k += 4) drawing::add(curve, is.time[k], 1e3 * is.height[k]);
      }
    }
  }
  std::printf("\n");
  album.charts.push_back(std::move(energy));
  album.charts.push_back(std::move(height));
}

// --- silence --------------------------------------------------------------------------------------------------------------

void silence(drawing::Album& album) {
  drawing::Picture chart("network_silence", "Nothing is heard from 1 s on, while a hand holds; 20 ms each way", "time [s]", "force [N]");
  chart.x().from = 0.8, chart.x().to = 4.0, chart.y().to = 2.0;
  std::printf("silence: nothing arrives from 1 s on; the hand holds until 2.2 s, lifts, and presses again at 3 s\n");
  std::printf("%8s %8s %6s %11s %10s %10s %12s %10s %9s\n", "delay", "silent", "way", "before [N]", "0 N after", "back after", "at 2.15 [N]", "again [N]", "step [N]");
  struct Curve {
    double seconds;
    char const* way;
    drawing::Colour colour;
    char const* label;
  };
  Curve const curves[] = {{0.2, "down", drawing::blue, "0.2 s, answers"}, {0.2, "both", drawing::orange, "0.2 s, both ways"}, {10.0, "both", drawing::black, "for ever"}};
  for (double const delay : {20.0, 0.0, 50.0})
    for (double const seconds : {0.05, 0.15, 0.2, 0.4, 10.0})
      for (char const* way : {"up", "down", "both"}) {
        if (!is_whole && delay != 20.0) continue;
        std::vector<std::pair<double, double>> const times{{1.0, 1.0 + seconds}};
        NetworkSimulationOptions options{.up = {.delay = 1e-3 * delay}, .down = {.delay = 1e-3 * delay}, .servo = {.safety = {.slew = 500.0, .damping = 11.0}}};
        if (std::strcmp(way, "down") != 0) options.up.silences = times;
        if (std::strcmp(way, "up") != 0) options.down.silences = times;
        Vector const above(0.0362, 0.0383, 0.005), below(0.0362, 0.0383, -0.015);
        auto path = Trajectory<double>::start(above).hold(0.1).line(below, 0.5, Pace::minimum_jerk).hold(1.6).line({0.0362, 0.0383, 0.01}, 0.4, Pace::minimum_jerk).hold(0.4);
        path.line(below, 0.5, Pace::minimum_jerk).hold(1.0);
        NetworkSimulation simulation(SimulatedHand<double>(std::move(path), {.hand = normal_hand()}), sheet(), NoCutter<double>{}, SurfaceThenTissue<double>{}, options);
        drawing::Picture* picture = nullptr;
        Curve const* curve = nullptr;
        for (Curve const& one : curves)
          if (delay == 20.0 && one.seconds == seconds && std::strcmp(one.way, way) == 0) picture = &chart, curve = &one;
        auto* line = picture != nullptr ? &(seconds > 1.0 ? picture->dashes(curve->colour, curve->label) : picture->line(curve->colour, curve->label)) : nullptr;
        double before = 0.0, gone = -1.0, back = -1.0, held = 0.0, again = 0.0, step = 0.0;
        Vector last(0, 0, 0);
        int tick_number = 0;
        simulation.run(4.4, [&](Tick const& tick) {
          double const force = tick.force.norm();
          step = std::max(step, (tick.force - last).norm());
          last = tick.force;
          if (tick.time < 1.0) before = force;
          if (tick.time > 1.0 && tick.time < 2.15 && gone < 0.0 && force == 0.0) gone = tick.time - 1.0;
          if (tick.time >= 1.0 + seconds && tick.time < 2.15 && back < 0.0 && std::abs(force - before) < 0.1 * before) back = tick.time - 1.0 - seconds;
          if (tick.time < 2.15) held = force;
          if (tick.time > 4.3) again = force;
          if (line != nullptr && tick_number % 4 == 0 && tick.time >= 0.8) drawing::add(*line, tick.time, force);
          ++tick_number;
        });
        auto const text = [](double value, char const* without) {
          char buffer[32];
          std::snprintf(buffer, sizeof buffer, "%.3f", value);
          return std::string(value < 0.0 ? without : buffer);
        };
        bool const came_back = held > 0.9 * before;
        std::printf("%8.0f %8.2f %6s %11.3f %10s %10s %12.3f %10.3f %9.3f\n", delay, seconds, way, before, text(gone, "-").c_str(), text(came_back ? back : -1.0, "-").c_str(),
                    held, again, step);
      }
  std::printf("\n");
  album.charts.push_back(std::move(chart));
}

// --- stiffness ------------------------------------------------------------------------------------------------------------

constexpr double mass = 0.075, damping = 0.5;   // kg, N s/m of a device that nobody damps

/// Nothing but what came over the network.
struct LateForce {
  Vector operator()(ToolContact<double> const& contact) noexcept { return contact.phase == CuttingPhase::indenting ? contact.tissue_force : Vector(Vector::Zero()); }
};
auto rigid() {
  auto const skin = make_grid<double>(5, 5, 0.01);
  MassSpring<double> tissue(skin, {.mass = {.total = 0.1}, .link = {.stiffness = 50.0, .damping = 0.1}, .home = {.stiffness = 5.0, .damping = 0.1}});
  for (int v = 0; v < 25; ++v) tissue.nail(v);
  return SoftBody(std::move(tissue), LeapfrogVerlet{});
}
struct Swing {
  double early, late, energy;   // m peak to peak, J
  bool is_quiet() const { return late < 1e-6 || late < 0.95 * early; }
};

/// A light push, that of 1 mm of the spring, holds the device against a rigid body whose contact has the stiffness K; so many ticks late, at least one.
template <class Force>
Swing lean(double stiffness, int ticks, double control, Force force, double seconds = 0.0) {
  if (seconds == 0.0) seconds = 3.0 + 0.05 * ticks;   // slow swings are watched for longer
  int const up = (ticks + 2) / 2, down = ticks + 1 - up;   // the contact's force is that of the end of its tick: one ahead
  NetworkSimulationOptions options{.body_rate = servo,
                                   .surface_rate = servo,
                                   .server = {.coupling = {.stiffness = stiffness, .damping = 0.0}},
                                   .servo = {.safety = {.max_stiffness = std::numeric_limits<double>::infinity(), .stale_after = 0.1, .damping = control}}};
  options.up.delay = (up - 0.5) * T, options.down.delay = down > 0 ? (down - 0.5) * T : 0.0;   // so that they come in the tick meant
  constexpr double weak = 0.5, wait = 0.6;   // N/m, of the hand; s, until the surface is known
  Vector const at(0.0203, 0.0206, 0.00005);
  auto path = Trajectory<double>::start(at).hold(wait).line({at.x(), at.y(), -stiffness * 0.001 / weak}, 0.05).hold(30.0);
  NetworkSimulation simulation(SimulatedHand<double>(std::move(path), {.hand = {.mass = 0.0, .damping = 0.0, .stiffness = weak}, .max_force = 1000.0, .mass = mass, .damping = damping}),
                               rigid(), NoCutter<double>{}, std::move(force), options);
  double low[2] = {1.0, 1.0}, high[2] = {-1.0, -1.0};
  Recording const recording = simulation.run(wait + seconds, [&](Tick const& tick) {
    double const share = (tick.time - wait) / seconds;
    int const which = share > 0.4 && share < 0.55 ? 0 : share > 0.85 ? 1 : -1;
    if (which >= 0) low[which] = std::min(low[which], tick.tip.z()), high[which] = std::max(high[which], tick.tip.z());
  });
  return {high[0] - low[0], high[1] - low[1], recording.ticks().back().energy};
}

template <class Force>
double stiffest(int ticks, double control, Force const& force, double low, double high, double seconds = 0.0) {
  for (int k = 0; k < 6; ++k) {
    double const middle = std::sqrt(low * high);
    (lean(middle, ticks, control, force, seconds).is_quiet() ? low : high) = middle;
  }
  return low;
}

void stiffness(drawing::Album& album) {
  drawing::Picture chart("network_stiffness", "The stiffest that a device of 0.5 N s/m stands at a rigid body", "delay there and back [ms]", "stiffness [N/m]");
  chart.x().logarithmic = chart.y().logarithmic = true, chart.y().from = 1.0, chart.y().to = 10000.0, chart.x().from = 0.5, chart.x().to = 200.0;
  auto &rule = chart.dashes(drawing::black, "b/(T/2 + t)"), &late = chart.dots(drawing::pink, "over the network alone");
  auto &plane = chart.dots(drawing::blue, "plane at the hand's side");
  auto& calm = chart.dots(drawing::green, "over the network, controlled: 16 x");
  for (int ticks = 1; ticks <= 120; ++ticks) drawing::add(rule, ticks, stable_wall_estimate(damping, T, ticks * T));
  std::printf("stiffness: device of %.3f kg and %.1f N s/m at a rigid body, N/m\n", mass, damping);
  std::printf("%10s %10s %10s %10s %8s %22s %22s %12s %14s\n", "T_d [ms]", "rule", "exact", "found", "ratio", "swing at 0.9 [mm]", "swing at 1.1 [mm]", "plane here", "16 x, damped");
  for (int const ticks : {1, 4, 10, 20, 50, 100}) {
    double const estimate = stable_wall_estimate(damping, T, ticks * T), exact = stable_wall(mass, damping, T, TickDelay{ticks});
    double const found = stiffest(ticks, 0.0, LateForce{}, 0.85 * exact, 1.15 * exact);
    Swing const below = lean(0.9 * exact, ticks, 0.0, LateForce{}), above = lean(1.1 * exact, ticks, 0.0, LateForce{});
    double const here = stiffest(ticks, 0.0, ProxyForce<double>({.surface = SurfaceKind::plane, .max_stiffness = 1e6, .handover = 1}), 850.0, 1150.0, 2.0);
    double worst = 0.0;
    for (double const times : {4.0, 16.0}) worst = std::max(worst, lean(times * exact, ticks, mass / (4.0 * T), LateForce{}, 2.5).late);
    std::printf("%10d %10.2f %10.2f %10.2f %8.3f %10.4f -> %8.4f %10.4f -> %8.4f %12.1f %11.4f mm\n", ticks, estimate, exact, found, found / exact, 1e3 * below.early,
                1e3 * below.late, 1e3 * above.early, 1e3 * above.late, here, 1e3 * worst);
    drawing::add(late, ticks, found), drawing::add(plane, ticks, here);
    if (worst < 0.0005) drawing::add(calm, ticks, 16.0 * exact);
  }
  std::printf("stiffness: 2 b/T is %.1f N/m\n\n", 2.0 * damping / T);
  album.charts.push_back(std::move(chart));
}

// --- deadband -------------------------------------------------------------------------------------------------------------

void deadband(drawing::Album& album) {
  drawing::Picture messages("network_messages", "Messages over the deadband's fraction", "Weber fraction k [%]", "messages [1/s]");
  messages.y().from = 0.0, messages.y().to = 1000.0;
  drawing::Picture errors("network_error", "What the deadband changes of the force", "Weber fraction k [%]", "share of the force [%]");
  auto &up = messages.line(drawing::blue, "from the hand"), &down = messages.line(drawing::orange, "to the hand");
  auto &rms = errors.line(drawing::blue, "root mean square"), &most = errors.line(drawing::orange, "largest while it slides");
  auto& noticed = errors.dashes(drawing::black, "just noticeable");
  for (auto* line : {&up, &down, &rms, &most}) line->marks = true;
  std::printf("deadband: a scripted tool presses 3 to 9 mm and slides for 4 s; 5 ms each way, floor %.3f N\n", WeberDeadbandOptions{}.floor);
  std::printf("%8s %10s %10s %10s %10s %11s %11s %11s %12s\n", "k [%]", "up [1/s]", "down [1/s]", "up [kB/s]", "dn [kB/s]", "rms [N]", "most [N]", "rms [%]", "sliding [%]");
  std::vector<Vector> without;
  constexpr double seconds = 5.0;
  for (double const fraction : {0.0, 0.02, 0.05, 0.1, 0.15, 0.2}) {
    NetworkSimulationOptions options{.up = {.delay = 0.005}, .down = {.delay = 0.005}, .deadband = {.fraction = fraction}};
    options.server.deadband.fraction = fraction;
    auto path = Trajectory<double>::start({0.025, 0.0383, 0.005}).line({0.025, 0.0383, -0.006}, 0.5, Pace::minimum_jerk);
    auto wave = Trajectory<double>::start({0.025, 0.0383, -0.006});
    for (int k = 1; k <= 400; ++k) {
      double const t = k / 100.0;
      wave.line({0.025 + 0.02 * t / 4.0, 0.0383, -0.006 - 0.003 * std::sin(2 * std::numbers::pi * 0.75 * t)}, 0.01);
    }
    path.then(wave).line({0.045, 0.0383, 0.005}, 0.5, Pace::minimum_jerk);
    NetworkSimulation simulation(ScriptedDevice<double>(std::move(path)), sheet(), NoCutter<double>{}, SurfaceThenTissue<double>{}, options);
    Recording const recording = simulation.run(seconds);
    double square = 0.0, forces = 0.0, worst = 0.0, worst_share = 0.0;
    for (std::size_t k = 0; k < recording.ticks().size(); ++k) {
      Vector const force = recording.ticks()[k].force;
      if (fraction == 0.0) without.push_back(force);
      double const off = (force - without[k]).norm(), here = without[k].norm();
      square += off * off, forces += here * here;
      worst = std::max(worst, off);
      if (recording.ticks()[k].time > 0.7 && recording.ticks()[k].time < 4.5) worst_share = std::max(worst_share, off / here);
    }
    NetworkCounts const counts = simulation.counts();
    double const share = std::sqrt(square / forces), per = 1.0 / seconds;
    std::printf("%8.0f %10.0f %10.0f %10.1f %10.1f %11.4f %11.4f %11.2f %12.2f\n", 100 * fraction, per * static_cast<double>(counts.sent_up), per * static_cast<double>(counts.sent_down),
                1e-3 * per * static_cast<double>(counts.bytes_up), 1e-3 * per * static_cast<double>(counts.bytes_down),
                std::sqrt(square / static_cast<double>(without.size())), worst, 100 * share, 100 * worst_share);
    drawing::add(up, 100 * fraction, per * static_cast<double>(counts.sent_up)), drawing::add(down, 100 * fraction, per * static_cast<double>(counts.sent_down));
    drawing::add(rms, 100 * fraction, 100 * share), drawing::add(most, 100 * fraction, 100 * worst_share);
    drawing::add(noticed, 100 * fraction, 100 * force_just_noticeable_difference);
  }
  std::printf("deadband: a hand notices a change of %.0f %%\n\n", 100 * force_just_noticeable_difference);
  album.charts.push_back(std::move(messages));
  album.charts.push_back(std::move(errors));
}

// --- surface --------------------------------------------------------------------------------------------------------------

/// A rigid dome of 40 mm radius.
constexpr double dome_radius = 0.04;
auto dome() {
  auto mesh = make_grid<double>(33, 33, 0.0015);
  for (auto p : mesh.points.colwise()) {
    p -= Vector(0.024, 0.024, 0.0);
    p.z() = std::sqrt(dome_radius * dome_radius - p.x() * p.x() - p.y() * p.y());
  }
  MassSpring<double> tissue(mesh, {.mass = {.total = 0.1}, .link = {.stiffness = 50.0, .damping = 0.1}, .home = {.stiffness = 5.0, .damping = 0.1}});
  for (int v = 0; v < 33 * 33; ++v) tissue.nail(v);
  return SoftBody(std::move(tissue), LeapfrogVerlet{});
}

void surface(drawing::Album& album) {
  drawing::Picture chart("network_surface", "A tool slides over a dome at 0.2 m/s, 1 mm deep: error of the force", "surfaces told [1/s]", "largest error [%]");
  chart.y().logarithmic = true, chart.x().from = 0.0, chart.x().to = 600.0, chart.y().from = 0.1, chart.y().to = 1000.0;
  auto &plane = chart.line(drawing::orange, "plane"), &ball = chart.line(drawing::blue, "ball"), &late = chart.dashes(drawing::orange, "plane, 20 ms each way"),
       &ball_late = chart.dashes(drawing::blue, "ball, 20 ms each way");
  for (auto* line : {&plane, &ball, &late, &ball_late}) line->marks = true;
  std::printf("surface: a tool slides over a rigid dome of %.0f mm at 0.2 m/s, 1 mm deep at %.0f N/m; body at 50 Hz\n", 1e3 * dome_radius, spring);
  std::printf("%8s %8s %10s %12s %12s %12s\n", "delay", "kind", "rate [Hz]", "rms [%]", "most [%]", "step [N]");
  for (double const delay : {0.0, 0.02})
    for (SurfaceKind const kind : {SurfaceKind::plane, SurfaceKind::ball})
      for (double const rate : {50.0, 100.0, 200.0, 500.0}) {
        double const radius = dome_radius - 0.001;
        Vector const from(-0.45 * radius, 0.0003, radius * std::sqrt(1 - 0.45 * 0.45));
        NetworkSimulationOptions options{.body_rate = 50.0, .surface_rate = rate, .up = {.delay = delay}, .down = {.delay = delay}};
        options.server.surface = kind;
        auto path = Trajectory<double>::start(1.2 * from).hold(0.2).line(from, 0.2, Pace::minimum_jerk).hold(0.2);
        double const angle = 2 * std::asin(0.45);
        path.arc({0.0, 0.0003, 0.0}, {0, 1, 0}, angle, angle * radius / 0.2).hold(0.1);
        double const starts = 0.65, ends = 0.6 + angle * radius / 0.2;
        NetworkSimulation simulation(ScriptedDevice<double>(std::move(path)), dome(), NoCutter<double>{},
                                     ProxyForce<double>({.surface = kind, .max_stiffness = spring, .handover = static_cast<int>(servo / rate)}), options);
        double square = 0.0, most = 0.0, step = 0.0;
        int count = 0;
        Vector last(0, 0, 0);
        simulation.run(ends, [&](Tick const& tick) {
          Vector const truth = spring * (dome_radius - tick.tip.norm()) * tick.tip.normalized();
          if (tick.time > starts) {
            double const off = (tick.force - truth).norm() / truth.norm();
            square += off * off, ++count;
            most = std::max(most, off), step = std::max(step, (tick.force - last).norm());
          }
          last = tick.force;
        });
        std::printf("%8.0f %8s %10.0f %12.2f %12.2f %12.4f\n", 1e3 * delay, kind == SurfaceKind::plane ? "plane" : "ball", rate, 100 * std::sqrt(square / count), 100 * most, step);
        auto& line = kind == SurfaceKind::plane ? (delay > 0.0 ? late : plane) : delay > 0.0 ? ball_late : ball;
        drawing::add(line, rate, 100 * most);
      }
  std::printf("\n");
  album.charts.push_back(std::move(chart));
}

// --- the same again -------------------------------------------------------------------------------------------------------

void repeats() {
  auto const text = [](std::uint64_t seed) {
    Impairment const way{.delay = 0.01, .jitter = 0.005, .loss = 0.05, .burst = 2.0, .seed = seed};
    NetworkSimulationOptions options{.up = way, .down = way};
    options.down.seed = seed + 1;
    auto path = Trajectory<double>::start({0.0362, 0.0383, 0.005}).tap({0.0, 0.0, -0.02}, 1.0);
    NetworkSimulation simulation(SimulatedHand<double>(std::move(path)), sheet(), NoCutter<double>{}, SurfaceThenTissue<double>{}, options);
    return simulation.run(1.0).to_csv();
  };
  std::string const once = text(1);
  std::printf("repeats: the same seed gives the same bytes: %s; another seed others: %s\n", once == text(1) ? "yes" : "no", once != text(5) ? "yes" : "no");
}

drawing::Album example() {
  drawing::Album album;
  grid();
  over_delay(album);
  silence(album);
  stiffness(album);
  deadband(album);
  surface(album);
  repeats();
  return album;
}

}  // namespace

/// network [--all] [FOLDER]
int main(int argc, char** argv) {
  std::vector<char*> rest;
  for (int k = 0; k < argc; ++k) {
    if (k > 0 && std::strcmp(argv[k], "--all") == 0)
      is_whole = true;
    else
      rest.push_back(argv[k]);
  }
  return drawing::run_example("network", static_cast<int>(rest.size()), rest.data(), example);
}
