// SPDX-License-Identifier: MIT
// Laparoscopy of a gall bladder, a 2-D membrane that is cut \cite deformable_survey. Forceps through a trocar take its fundus and draw it up. Scissors through
// another one cut it off along its bed, the liver, from the neck round the fundus and back. The forceps take it away.
//   at rest     hand + bed = weight
//   cut off     the hand bears the weight of what it holds, the bed that of what stays
//   the shaft   goes through its trocar: the hand moves the other way, as on a lever
#include "../album.hpp"

#include <palpate/body/pieces.hpp>
#include <palpate/body/soft_body.hpp>
#include <palpate/collision/closest_point.hpp>
#include <palpate/cutting/separating_cutter.hpp>
#include <palpate/device/trajectory.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/implicit.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/young_springs.hpp>
#include <palpate/tool/built_in_shapes.hpp>
#include <palpate/tool/grasp.hpp>
#include <palpate/tool/trocar.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <limits>
#include <numbers>
#include <utility>

namespace {

using namespace palpate;
using Vector = Vector3<double>;
using Mesh = TriangleMesh<double>;

constexpr double g = 9.81, pi = std::numbers::pi, step = 1e-3;                // m/s², 1, s
constexpr double neck = -0.035, fundus = 0.025, thin = 0.009, thick = 0.018;   // m: where the middle line begins and ends, and the radii there
constexpr double bed = 0.0025, seam = 0.005;                                    // m: the wall below grows on the liver; the height at which it is cut
constexpr double bile = 600.0;                                                 // Pa, until it is drawn off
constexpr double shaft = 0.25;                                                 // m, of both instruments, from tip to hand
Vector const port(0.080, 0.045, 0.130), other_port(-0.010, -0.100, 0.105);      // of the forceps, of the scissors

/// A pear, flat where it lies on the liver.
double field(Vector const& p) {
  double const along = std::clamp((p.x() - neck) / (fundus - neck), 0.0, 1.0);
  double const pear = (p - Vector(neck + along * (fundus - neck), 0, 0.002)).norm() - (thin + along * (thick - thin));
  return (pear - p.z() + std::hypot(pear + p.z(), 0.003)) / 2;
}
auto gall_bladder() {
  Mesh const wall = make_implicit<double>(field, Eigen::AlignedBox<double, 3>(Vector(-0.06, -0.03, -0.01), Vector(0.06, 0.03, 0.035)), 700);
  MassSpring<double> tissue(wall, {.mass = {.total = 0.015}, .link = {.damping = 0.02}, .home = {.damping = 1e-3}});
  set_young(tissue, 2e5, YoungSprings::van_gelder, 0.002);
  for (int i = 0; i < tissue.size(); ++i)
    if (tissue.rest_position(i).z() < bed) tissue.set_home(i, {.stiffness = 20.0, .damping = 0.02});
  SoftBody body(std::move(tissue), BackwardEuler{});
  body.set_gravity({0, 0, -g});
  return body;
}

/// Bile presses from inside: for the next step.
template <class Body>
void fill(Body& body, double pressure) {
  Mesh const now = body.mesh();
  for (auto const& t : now.triangles.colwise()) {
    Vector const a = now.points.col(t[0]), b = now.points.col(t[1]), c = now.points.col(t[2]), push = pressure / 6 * (b - a).cross(c - a);
    for (int const i : t) body.apply_force(i, push);
  }
}
/// What the bed does to the wall [N].
template <class Body>
Vector by_bed(Body const& body) {
  Vector sum = Vector::Zero();
  for (int i = 0; i < body.size(); ++i) sum -= body.tissue().home(i).stiffness * (Vector(body.positions().col(i)) - body.tissue().rest_position(i));
  return sum;
}

/// Where a point of the wall, given at rest, is now, and the way out of the wall there.
template <class Body>
std::pair<Vector, Vector> seen(Body const& body, Vector const& at_rest) {
  double least = std::numeric_limits<double>::infinity();
  std::pair<Vector, Vector> found;
  auto const& tissue = body.tissue();
  for (Eigen::Index k = 0; k < body.triangles().cols(); ++k) {
    Eigen::Vector3i const t = body.triangles().col(k);
    auto const near = closest_point_on_triangle<double>(at_rest, tissue.rest_position(t[0]), tissue.rest_position(t[1]), tissue.rest_position(t[2]));
    if (near.squared_distance >= least) continue;
    least = near.squared_distance;
    found = {Vector::Zero(), Vector::Zero()};
    for (int c = 0; c < 3; ++c) {
      found.first += near.barycentric[c] * body.positions().col(t[c]);
      found.second += near.barycentric[c] * body.reference_normal(t[c]);
    }
  }
  return {found.first, found.second.normalized()};
}

/// What was cut, in the wall as it is at rest [m]: each edge of it has become two of the border.
template <class Body>
double cut_length(Body const& body) {
  Mesh const wall = body.rest_mesh();
  double sum = 0;
  for (auto const& [a, b] : boundary_edges(wall)) sum += (wall.points.col(a) - wall.points.col(b)).norm() / 2;
  return sum;
}

/// The liver below, to be drawn.
Mesh liver() {
  auto block = make_block<double>(25, 21, 2, 1.0, BlockPattern::alternating);
  for (auto p : block.points.colwise()) {
    double const x = 0.11 * (p.x() / 24 - 0.5) - 0.004, y = 0.09 * (p.y() / 20 - 0.5), out = x * x / (0.055 * 0.055) + y * y / (0.045 * 0.045);
    p = Vector(x, y, -0.0012 - 0.003 * out * out - 0.016 * (1 - p.z()));
  }
  return surface(block);
}
/// The wall from inside, to be drawn.
Mesh lining(Mesh wall) {
  wall.points -= 3e-4 * vertex_normals(wall);
  return wall;
}
/// An instrument from its jaws to a little above its trocar, and the trocar's sleeve.
Mesh instrument(ToolShape<double> const& shape, ToolPose<double> const& pose, Vector const& hole) {
  auto rods = shape.rods;
  double const depth = (hole - pose.position).norm();
  rods.back().rod.to.z() = depth + 0.020;
  rods.push_back({.rod = {.from = {0, 0, depth - 0.008}, .to = {0, 0, depth + 0.010}, .radius = 0.0045}});
  Mesh all = rods_picture(rods, 16, pose.opening);
  all.points = (pose.orientation.toRotationMatrix() * all.points).colwise() + pose.position;
  return all;
}

/// When what is done [s].
constexpr double come = 0.3, closed = 0.45, emptied = 0.7, drawn = 1.3, begins = 1.7, freed = 3.0, cut = 4.3, taken = 5.2, end = 5.8;
char const* done(double t) {
  char const* does = "the forceps come";
  for (auto const& [since, what] : {std::pair{come, "they close"}, {closed, "bile is drawn off"}, {emptied, "they draw the fundus up"}, {drawn, "they hold it"},
                                    {begins, "the scissors cut"}, {freed, "they cut, it is folded over"}, {cut, "it is taken away"}, {taken, "it hangs"}})
    if (t > since - 1e-9) does = what;
  return does;
}

drawing::Album example() {
  auto body = gall_bladder();
  for (int k = 0; k < 120; ++k) fill(body, bile), body.step(5e-3);
  double const weight = body.total_mass() * g, area = surface_area(body.rest_mesh());
  std::printf("a wall of %d particles, %.2f cm2, that weighs %.4f N, round %.1f ml of bile\n\n", body.size(), 1e4 * area, weight, 1e6 * volume(body.mesh()));

  // The seam, round the wall as it is at rest.
  double const height = seam - 0.002, at_neck = std::sqrt(thin * thin - height * height), at_fundus = std::sqrt(thick * thick - height * height);
  double const straight = std::hypot(fundus - neck, at_fundus - at_neck), round = 2 * straight + pi * (at_neck + at_fundus);
  auto const lasts = [&](double length) { return length / round * (cut - begins); };
  auto way = Trajectory<double>::start({neck, -at_neck, seam});
  way.line({fundus, -at_fundus, seam}, lasts(straight)).arc({fundus, 0, seam}, Vector::UnitZ(), pi, lasts(pi * at_fundus));
  way.line({neck, at_neck, seam}, lasts(straight)).arc({neck, 0, seam}, Vector::UnitZ(), pi, lasts(pi * at_neck));

  using enum Pace;
  Vector const top = seen(body, {fundus + 0.004, 0.004, 0.02}).first, out = (port - top).normalized();
  auto tip = Trajectory<double>::start(top + 0.03 * out);
  tip.line(top - 0.004 * out, come, minimum_jerk).hold(emptied - come).line(top + 0.010 * out, drawn - emptied, minimum_jerk).hold(freed - drawn);
  tip.line({-0.020, 0.0, 0.060}, cut - freed, minimum_jerk).line({-0.010, 0.010, 0.095}, taken - cut, minimum_jerk);
  auto const opening = [](double t) { return 1 - 0.75 * std::clamp((t - come) / (closed - come), 0.0, 1.0); };   // two walls are between the jaws then

  // The jaws hold, and push nothing: a limp wall round them would be pushed from both sides, and tremble. It is light: the step has to resolve their springs.
  auto const jaws = make_forceps_shape<double>({.opening = 0.016, .jaw = 0.022, .radius = 0.001, .shaft = shaft - 0.022});
  Grasp<double> grasp({.clamp_force = 6.0, .stiffness = 500.0, .damping = 0.1, .width = 0.010});
  SeparatingCutter<double> scissors({.puncture_depth = 0.001});
  auto const blades = make_forceps_shape<double>({.opening = 0.007, .jaw = 0.016, .radius = 0.0008, .shaft = shaft - 0.016});
  Trocar<double> const trocar({.point = port}), other_trocar({.point = other_port});

  drawing::Picture chart("gall_bladder_forces", "A gall bladder is cut off its bed", "time [s]", "force [N]");
  auto &by_hand = chart.line(drawing::blue, "forceps"), &by_liver = chart.line(drawing::orange, "bed");
  auto& all = chart.dashes(drawing::black, "weight");
  drawing::Album album;
  Mesh const below = liver();
  auto const pose_at = [&](double t) { return trocar({.position = tip.at(t).position, .opening = opening(t)}); };
  ToolPose<double> pose = pose_at(0), blade;
  auto const draw = [&](char const* name) {
    Mesh const wall = body.drawn_mesh();
    album.views.push_back({.name = name,
                           .mesh = wall,
                           .from = Vector(0.30, -1.0, 0.50).normalized(),
                           .colour = {0.47, 0.58, 0.30},
                           .parts = {{lining(wall), {0.80, 0.66, 0.40}},
                                     {below, {0.50, 0.20, 0.15}},
                                     {instrument(jaws, pose, port), {0.62, 0.66, 0.70}},
                                     {instrument(blades, blade, other_port), {0.30, 0.42, 0.62}}}});
  };
  std::printf("%8s %10s %10s %10s %9s %7s  %s\n", "time [s]", "hand [N]", "bed [N]", "sum [N]", "cut [mm]", "pieces", "what is done");
  double off = 0;   // m
  Vector drawn_tip, drawn_hand, freed_tip, freed_hand;
  int const ticks = static_cast<int>(std::lround(end / step));
  for (int tick = 0; tick <= ticks; ++tick) {
    double const t = tick * step;
    auto const before = std::exchange(pose, pose_at(t));
    Vector const along = pose.orientation * Vector::UnitZ();
    Vector const hand = pose.position + shaft * along;
    off = std::max(off, (port - pose.position).cross(along).norm());
    if (tick == std::lround(freed / step)) drawn_tip = pose.position, drawn_hand = hand;
    if (tick == std::lround(cut / step)) freed_tip = pose.position, freed_hand = hand;
    if (t <= cut) {   // the hand with the scissors sees where the seam is, and comes to it in the last 0.3 s
      auto const [there, away] = seen(body, way.at(t - begins).position);
      blade.position = there + (0.03 * std::clamp((begins - t) / 0.3, 0.0, 1.0) - 0.0015) * away;
    } else if ((other_port - blade.position).norm() > 0.06) {
      blade.position += 0.15 * step * (other_port - blade.position).normalized();
    }
    blade = other_trocar({.position = blade.position, .opening = 0.5});
    if (t <= cut)
      scissors.advance(body, blade);
    else
      scissors.reset(body);
    if (before.opening >= 0.6 && pose.opening < 0.6) grasp.take(body, pose, {jaws.rods[0].at(pose.opening), jaws.rods[1].at(pose.opening)});
    grasp.advance(body, pose);
    Vector on_jaws = Vector::Zero(), moment = Vector::Zero();
    grasp.press(body, {.begin = before, .end = pose, .now = pose}, step, on_jaws, moment);
    if (double const pressure = bile * std::clamp((emptied - t) / (emptied - closed), 0.0, 1.0); pressure > 0) fill(body, pressure);
    body.step(step);

    double const pull = -on_jaws.z() + 0.0, bears = by_bed(body).z();   // + 0: not −0
    if (tick % 20 == 0) drawing::add(by_hand, t, pull), drawing::add(by_liver, t, bears), drawing::add(all, t, weight);
    if (tick % 200 == 0)
      std::printf("%8.1f %10.4f %10.4f %10.4f %9.1f %7zu  %s\n", t, pull, bears, pull + bears, 1e3 * cut_length(body), pieces_of(body).size(), done(t));
    if (tick == 0) draw("gall_bladder_before");
    if (tick == std::lround(1.6 / step)) draw("gall_bladder_drawn");
    if (tick == std::lround(2.8 / step)) draw("gall_bladder_cut");
    if (tick == ticks) draw("gall_bladder_taken");
  }
  std::printf("\nseam %.1f mm round, cut %.1f mm; area %.4f cm2, by the cutter's report %.4f cm2\n", 1e3 * round, 1e3 * cut_length(body),
              1e4 * surface_area(body.rest_mesh()), 1e4 * (area + scissors.report().area_change));
  for (auto const& piece : pieces_of(body)) {
    double mass = 0;
    bool grows_on_bed = false;
    for (int const i : piece) mass += body.tissue().mass(i), grows_on_bed = grows_on_bed || body.tissue().home(i).stiffness > 0;
    std::printf("%s: %zu particles, %.4f N\n", grows_on_bed ? "on the bed" : "taken away", piece.size(), mass * g);
  }
  auto const levered = [&](Vector const& at) { return Vector(port + (shaft / (port - at).norm() - 1) * (port - at)); };
  std::printf("the shaft is off its trocar by %.0e m at most; the tip was moved %.1f mm over the neck, the hand %.1f mm the other way, by the lever %.1f mm\n",
              off, 1e3 * (drawn_tip - freed_tip).x(), 1e3 * (freed_hand - drawn_hand).x(), 1e3 * (levered(freed_tip) - levered(drawn_tip)).x());
  album.charts.push_back(std::move(chart));
  return album;
}

}  // namespace

int main(int argc, char** argv) { return drawing::run_example("gall_bladder", argc, argv, example); }
