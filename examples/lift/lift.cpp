// SPDX-License-Identifier: MIT
// A lobe lies on another organ, and covers a vessel on it. A hook comes under its free end, goes in, lifts it off,
// holds it, lets it down again, and is drawn out.
//   always at rest   hand + root + lower organ = weight of the lobe
//   while it is up   the lower organ bears nothing
#include "../album.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/no_cutter.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/scene/scene_tool.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tool/hook.hpp>
#include <palpate/volume/embedded_surface.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

namespace {

using namespace palpate;
using Vector = Vector3<double>;
using Mesh = TriangleMesh<double>;

constexpr double g = 9.81, pi = std::numbers::pi, rate = 200.0;   // m/s², 1, Hz of the bodies
constexpr double root = -0.052, length = 0.104;                   // m, of the lobe, along x
constexpr double angle = 0.95;                                    // rad, by which it is turned up
constexpr double come = 0.3, press = 0.2, lift = 0.8, hold = 0.7, wait = 0.2, leave = 0.2, rest = 0.6;   // s, one after the other; let down as it was lifted
constexpr double hooked = come + press, up = hooked + lift, held = up + hold, down = held + lift, let_go = down + wait, end = let_go + leave + rest;
constexpr double deep = 0.004;                                    // m, that the hook presses in
Vector const eye = Vector(0.95, -0.75, 0.62).normalized();        // from where it is looked at

auto flesh(TetrahedralMesh<double> const& mesh, double young) {
  return SoftBody(FiniteElements<double, StableNeoHookean<double>>(
                      mesh, {.density = 1000.0, .material = {.young = young, .poisson = 0.4}, .damping = {.alpha = 8.0, .beta = 2e-3}}),
                  BackwardEuler{});
}
/// The lower organ: 7 × 6 cm, its upper side domed and highest at 0.
TetrahedralMesh<double> loaf() {
  auto mesh = make_block<double>(7, 6, 3, 1.0, BlockPattern::alternating);
  for (auto p : mesh.points.colwise()) {
    p = Vector(0.035 * (p.x() / 3 - 1), 0.030 * (p.y() / 2.5 - 1), 0.015 * p.z());
    p.z() *= 1 - 0.20 * p.x() * p.x() / (0.035 * 0.035) - 0.20 * p.y() * p.y() / (0.030 * 0.030);
    p.z() -= 0.030;
  }
  return mesh;
}
/// The upper one: thinner and narrower to its free end.
TetrahedralMesh<double> lobe() {
  auto mesh = make_block<double>(11, 5, 3, 1.0, BlockPattern::alternating);
  for (auto p : mesh.points.colwise()) {
    double const along = p.x() / 10, across = p.y() / 2 - 1;
    p = Vector(root + length * along, 0.024 * across * (1 - 0.35 * along * along * along), 0.0005 + 0.005 * p.z() * (1 - 0.35 * along));
  }
  return mesh;
}
/// A tube across the lower organ, half in it: rings of vertices, the first of each the highest.
constexpr int rings = 41, sides = 12;
Mesh tube() {
  Mesh mesh{Matrix3X<double>(3, rings * sides), Matrix<int, 3, Dynamic>(3, 2 * (rings - 1) * sides)};
  for (int r = 0; r < rings; ++r)
    for (int s = 0; s < sides; ++s) {
      double const y = -0.020 + 0.040 * r / (rings - 1), x = 0.012 + 0.004 * std::sin(pi * y / 0.020), turn = 2 * pi * s / sides;
      double const z = -0.006 * x * x / (0.035 * 0.035) - 0.006 * y * y / (0.030 * 0.030);
      mesh.points.col(r * sides + s) = Vector(x + 0.0022 * std::sin(turn), y, z + 0.0022 * std::cos(turn) - 0.001);
      if (r + 1 == rings) continue;
      int const a = r * sides + s, b = r * sides + (s + 1) % sides, t = 2 * (r * sides + s);
      mesh.triangles.col(t) << a, a + sides, b;
      mesh.triangles.col(t + 1) << b, a + sides, b + sides;
    }
  return mesh;
}
auto two_organs() {
  auto const below = loaf(), above = lobe();
  auto lower = flesh(below, 5e3), upper = flesh(above, 1e4);
  for (int const i : vertices_where(below, [](Vector const& p) { return p.z() < -0.0299; })) lower.nail(i);
  for (int const i : vertices_where(above, [](Vector const& p) { return p.x() < root + 1e-4; })) upper.nail(i);
  upper.set_gravity({0, 0, -g});
  Scene scene(std::move(lower), std::move(upper));
  scene.touch<1, 0>({.pressure = 3e3, .depth = 4e-3, .friction = 0.3});
  return scene;
}

/// The hook comes to the end of the lobe from below, goes in, and turns with it about its root. Its shaft leads out and up.
ScriptedDevice<double> hand(Vector const& at) {
  using enum Pace;
  Eigen::Quaterniond const up_and_out = Eigen::AngleAxisd(pi / 2, Vector::UnitZ()) * Eigen::AngleAxisd(pi, Vector::UnitX());
  auto const turned = [&](double by) { return Eigen::AngleAxisd(by, -Vector::UnitY()) * up_and_out; };
  Vector const away = at - Vector(0, 0, 0.015), tip = at + Vector(0, 0, deep), pivot(root, 0, tip.z());
  auto path = Trajectory<double>::start(away);
  path.line(tip, come, minimum_jerk).hold(press).arc(pivot, -Vector::UnitY(), angle, lift, minimum_jerk).hold(hold);
  path.arc(pivot, Vector::UnitY(), angle, lift, minimum_jerk).hold(wait).line(away, leave, minimum_jerk);
  std::vector<TimedOrientation> turns;   // as minimum_jerk does
  for (double const begin : {hooked, held})
    for (int k = 0; k <= 40; ++k) {
      double const s = k / 40.0, share = s * s * s * (10 - 15 * s + 6 * s * s);
      turns.push_back({begin + s * lift, turned(angle * (begin < held ? share : 1 - share))});
    }
  return ScriptedDevice<double>(std::move(path), {.orientation = std::move(turns)});
}

/// How much of the vessel is seen past the lobe, along its highest line [m].
double seen(EmbeddedSurface<double> const& vessel, Mesh const& cover) {
  double sum = 0;
  for (int r = 0; r + 1 < rings; ++r) {
    Vector const a = vessel.points().col(r * sides), b = vessel.points().col((r + 1) * sides), from = (a + b) / 2;
    bool const is_hidden = std::ranges::any_of(cover.triangles.colwise(), [&](auto const& t) {
      Matrix<double, 3, 3> corners;
      for (int k = 0; k < 3; ++k) corners.col(k) = cover.points.col(t[k]) - from;
      Vector const weights = corners.inverse() * eye;   // the way to the eye is a sum of the ways to the corners
      return weights.minCoeff() >= 0;
    });
    if (!is_hidden) sum += (b - a).norm();
  }
  return sum;
}

template <class SimulatorType>
drawing::View view(char const* name, SimulatorType const& simulator, EmbeddedSurface<double> const& vessel) {
  auto const& tool = simulator.template tool<0>().template on<1>().rods();
  auto const& pose = tool.pose();
  Mesh hook = rods_picture(tool.shape().rods, 12, pose.opening);
  hook.points = (pose.orientation.toRotationMatrix() * hook.points).colwise() + pose.position;
  return {.name = name,
          .mesh = simulator.body().template body<0>().mesh(),
          .from = eye,
          .colour = {0.80, 0.62, 0.45},
          .parts = {{simulator.body().template body<1>().mesh(), {0.56, 0.20, 0.16}}, {vessel.mesh(), {0.16, 0.28, 0.66}}, {hook, {0.62, 0.66, 0.70}}}};
}

drawing::Album example() {
  auto scene = two_organs();
  for (int k = 0; k < 160; ++k) scene.advance(1 / rate);
  auto const last = vertices_where(lobe(), [](Vector const& p) { return p.x() > root + 0.85 * length && p.z() < 0.0006; });   // two rows, from below
  Vector middle(0, 0, 0);
  for (int const i : last) middle += Vector(scene.body<1>().positions().col(i)) / static_cast<double>(last.size());
  auto const nailed = vertices_where(lobe(), [](Vector const& p) { return p.x() < root + 1e-4; });
  EmbeddedSurface<double> vessel(tube(), loaf());
  double const weight = scene.body<1>().total_mass() * g;
  std::printf("two organs of %td and %td tetrahedra; the upper one weighs %.4f N\nthe vessel below it is %.1f mm long\n\n", loaf().tetrahedra.cols(),
              lobe().tetrahedra.cols(), weight, 1e3 * seen(vessel, {}));

  Hook<double> const hook({.shape = {.radius = 0.0015, .point = 0.012, .shaft = 0.05, .bend = 2.0}, .friction = 0.5});
  Simulator simulator(std::move(scene), SimulatorOptions{.body_rate = rate}, Tool(hand(middle), PerBody(NoCutter<double>(), hook), TissueReaction{}));
  drawing::Picture chart("lift_forces", "A lobe is lifted off another organ, and let down again", "time [s]", "force [N]");
  auto &by_hand = chart.line(drawing::blue, "hand"), &by_root = chart.line(drawing::green, "root"), &by_lower = chart.line(drawing::orange, "lower organ");
  auto& all = chart.dashes(drawing::black, "weight of the lobe");
  drawing::Album album;
  std::printf("%8s %10s %10s %10s %10s %10s  %s\n", "time [s]", "hand [N]", "root [N]", "lower [N]", "sum [N]", "seen [mm]", "the hand");
  int tick = 0;
  simulator.run(end + 0.01, [&](std::span<Tick const> ticks) {
    if (tick++ % 20 != 0) return;
    double const t = ticks[0].time, felt = -ticks[0].force.z() + 0.0;   // not −0
    auto const& now = simulator.body();
    auto const& above = now.body<1>();
    double held_by_root = 0;
    double const borne = now.contact<1, 0>().force().z();
    for (int const i : nailed) held_by_root += above.reaction(i).z();
    vessel.update(now.body<0>().positions());
    drawing::add(by_hand, t, felt), drawing::add(by_root, t, held_by_root), drawing::add(by_lower, t, borne), drawing::add(all, t, weight);
    if (tick % 100 != 1) return;
    char const* does = "comes";
    for (auto const& [since, what] : {std::pair{come, "hooks in"}, {hooked, "lifts"}, {up, "holds"}, {held, "lets down"}, {down, "waits"}, {let_go, "is gone"}})
      if (t > since - 1e-9) does = what;
    std::printf("%8.1f %10.4f %10.4f %10.4f %10.4f %10.1f  %s\n", t, felt, held_by_root, borne, felt + held_by_root + borne, 1e3 * seen(vessel, above.mesh()),
                does);
    if (t == 0) album.views.push_back(view("lift_covered", simulator, vessel));
    if (std::abs(t - held + 0.1) < 1e-9) album.views.push_back(view("lift_lifted", simulator, vessel));
  });
  album.charts.push_back(std::move(chart));
  return album;
}

}  // namespace

int main(int argc, char** argv) { return drawing::run_example("lift", argc, argv, example); }
