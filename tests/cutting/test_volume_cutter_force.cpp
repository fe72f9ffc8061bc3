// SPDX-License-Identifier: MIT
// What a solid does to a blade that cuts it: work, force, puncture. Yardsticks: toughness times area, toughness times the length of the blade in tissue; what
// measured curves say at the depth and the speed of its path.
#include "catch.hpp"
#include <palpate/body/pieces.hpp>
#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/aspirator.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/force/blade.hpp>
#include <palpate/force/cutting_force.hpp>
#include <palpate/force/karnopp_friction.hpp>
#include <palpate/force/liver.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/repair.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

using namespace palpate;

namespace {

constexpr double top = 0.02, depth = 0.012;   // m, of the block and of the cut

/// Firm tissue on a plate, 6 × 2 × 2 cm, so that little of the work is elastic.
template <class Scalar>
auto make_body(double young = 6e4) {
  FiniteElements<Scalar, StableNeoHookean<Scalar>> tissue(make_block<Scalar>(13, 5, 5, Scalar(0.005), BlockPattern::alternating),
                                                          {.density = 1000, .material = {Scalar(young), Scalar(0.4)}, .damping = {.alpha = 30}});
  for (int i = 0; i < tissue.size(); ++i)
    if (tissue.rest_position(i)[2] < Scalar(1e-6)) tissue.nail(i);
  return SoftBody(std::move(tissue), BackwardEuler{});
}

using Body = decltype(make_body<double>());
using Knife = VolumeCutter<double>;
static_assert(FeelsReaction<Knife, Body> && ResettableCutter<Knife, Body> && ResistsBlade<Knife, Body> && CountsWork<Knife, Body> && CountsArea<Knife> && !HoldsTissue<Knife, Body>);

struct Result {
  Recording recording;
  double area = 0;
  VolumeCutReport report{};
};
template <class Scalar, class Solid>
Result cut_along(Trajectory<Scalar> const& path, VolumeCutOptions<Scalar> const& options, Solid body, SimulatorOptions const& of_simulator = {}) {
  Simulator simulator(ScriptedDevice<Scalar>(path, {.max_force = 10.0}), std::move(body), VolumeCutter<Scalar>(options), TissueReaction{}, of_simulator);
  Result result{.recording = simulator.run(static_cast<double>(path.duration()))};
  result.area = simulator.cutter().area(), result.report = simulator.cutter().report();
  REQUIRE(simulator.statistics().body_counts.diverged == 0);
  return result;
}
template <class Scalar>
Result cut_along(Trajectory<Scalar> const& path, VolumeCutOptions<Scalar> const& options, SimulatorOptions const& of_simulator = {},
                 double young = 6e4) {
  return cut_along(path, options, make_body<Scalar>(young), of_simulator);
}

/// From above into the tissue at x = 12 mm, in the middle of its width, 30 mm along, and out.
template <class Scalar>
Trajectory<Scalar> stroke(bool again = false) {
  auto const at = [](double x, double z) { return Vector3<Scalar>(Scalar(x), Scalar(0.0113), Scalar(z)); };
  auto path = Trajectory<Scalar>::start(at(0.012, top + 0.004));
  path.line(at(0.012, top - depth), 0.2);
  path.line(at(0.042, top - depth), 1.0);
  if (again) path.line(at(0.012, top - depth), 1.0);
  path.line(at(again ? 0.012 : 0.042, top + 0.01), 0.2);
  return path;
}

/// A tool that is not turned, on a straight way at 1 kHz.
template <class Solid>
void draw(Knife& knife, Solid& body, Vector3<double>& tip, Vector3<double> const& to, int ticks) {
  Vector3<double> const from = tip;
  for (int tick = 1; tick <= ticks; ++tick) {
    tip = from + static_cast<double>(tick) / ticks * (to - from);
    knife.advance(body, ToolPose<double>{.position = tip});
    REQUIRE(body.step(1e-3));
  }
}

/// A cut right across the way of that, from above down to z = low.
void cut_across(Body& body, double x, double low) {
  Knife knife;
  for (int tick = 0; tick <= 60; ++tick) {
    double const y = -0.01 + 0.04 * tick / 60;
    knife.advance(body, {{x, y, low}, {x, y, 0.04}});
  }
  knife.lift(body);
}

/// The ticks in which the force has changed by more than the stiffness of the blade and of the contact times the way of the tool, and `more` [N].
std::vector<Tick const*> jumps(Recording const& recording, double more) {
  std::vector<Tick const*> found;
  for (std::size_t k = 1; k < recording.ticks().size(); ++k) {
    Tick const &now = recording.ticks()[k], &last = recording.ticks()[k - 1];
    if ((now.force - last.force).norm() > 2000 * (now.tip - last.tip).norm() + more) found.push_back(&now);
  }
  return found;
}

double energy_at(Recording const& recording, double time) {
  auto const& ticks = recording.ticks();
  auto const it = std::lower_bound(ticks.begin(), ticks.end(), time, [](Tick const& t, double at) { return t.time < at; });
  return it == ticks.end() ? ticks.back().energy : it->energy;
}

/// N, of the published liver so deep [m] on the way in or out: table 6-2 of the thesis, written out; it takes millimetres.
double published_liver(double deep, bool out) {
  constexpr double rows[5][4] = {{0.1211, -8.8553, 1.4730, -3.3122},
                                 {0.3226, 0.4131, 17.1267, -9.3809},
                                 {-1.2783, -6.0967, -0.0032, 3.7464},
                                 {-0.6281, -0.4962, -0.0200, 8.6331},
                                 {-2.4796, -4.0361, 0.0002, 1.6728}};
  double force = 18.6234;
  for (auto const& [of_depth, of_flag, weight, bias] : rows) force += weight * std::tanh(of_depth * 1000 * deep + (out ? of_flag : 0) + bias);
  return force;
}

}  // namespace

TEMPLATE_TEST_CASE("the hand's work is at least the toughness times the area that was cut", "[volume_cutter][cut_force]", double, float) {
  // Yardstick: Gc times the area, both from the recording; the area of the plane that the blade has swept, give or take what snapping bends.
  double const toughness = 120;
  auto const result = cut_along<TestType>(stroke<TestType>(), {.puncture_depth = TestType(0.003), .toughness = TestType(toughness)});
  double const area = result.recording.ticks().back().cut_area;
  CHECK(area == result.area);
  CHECK(area > 0.7 * 0.030 * depth);   // the blade stays behind, and has cut nothing yet where the last edges are ahead of it
  CHECK(area < 1.2 * 0.030 * depth);
  CHECK(result.recording.ticks().back().energy >= toughness * area);
  CHECK(result.recording.ticks().back().energy < 1.8 * toughness * area);
  double worst = 0;   // what is owed at any time, in steps of an edge: an event of area is paid right after
  for (Tick const& tick : result.recording.ticks()) worst = std::max(worst, toughness * tick.cut_area - tick.energy);
  CHECK(worst < 0.25 * toughness * 0.005 * depth);
}

TEST_CASE("the hand pays for the area however it saws, goes in zigzag or turns round, in firm and in stiff tissue", "[volume_cutter][cut_force]") {
  // Yardstick: Gc times the area at the end, and less an event of area at any time, against the work since the puncture; the force changes by no more than
  // stiffness times way and the slew limit.
  double const toughness = 120, slew = 500, low = top - depth;
  struct Way {
    char const* name;
    Vector3<double> back;   // m, from where it turns round; ahead are 1 mm along it, or 3
    double ahead;
  };
  for (Way const& way : {Way{"sawing", {0, 0, 0.004}, 0.001}, Way{"long sawing", {0, 0, 0.009}, 0.003}, Way{"zigzag", {0, 0.003, 0}, 0.003},
                         Way{"forward and back", {0.002, 0, 0}, 0.003}})
    for (double const young : {6e4, 5e5}) {
      INFO(way.name << ", " << young << " Pa");
      auto path = Trajectory<double>::start({0.012, 0.0113, top + 0.004});
      path.line({0.012, 0.0113, low}, 0.2);
      Vector3<double> at(0.012, 0.0113, low);
      for (int k = 1; 0.012 + way.ahead * k <= 0.0421; ++k) {
        Vector3<double> const next = Vector3<double>(0.012 + way.ahead * k, 0.0113, low) + (k % 2 == 1 ? way.back : Vector3<double>::Zero());
        path.line(next, (next - at).norm() / 0.1), at = next;
      }
      path.line({at[0], at[1], top + 0.01}, 0.2);
      auto const result = cut_along<double>(path, {.puncture_depth = 0.003, .toughness = toughness}, {.servo = {.safety = {.slew = slew}}}, young);
      auto const& ticks = result.recording.ticks();
      auto const first = std::find_if(ticks.begin(), ticks.end(), [](Tick const& tick) { return tick.phase == CuttingPhase::moving; });
      REQUIRE(first != ticks.end());
      CHECK(result.area > 0.3 * 0.030 * depth);
      CHECK(ticks.back().energy - first->energy >= toughness * result.area);
      double owed = 0;
      for (auto tick = first; tick != ticks.end(); ++tick) {
        owed = std::max(owed, toughness * tick->cut_area - (tick->energy - first->energy));
        double const jump = (tick->force - (tick - 1)->force).norm(), moved = (tick->tip - (tick - 1)->tip).norm();
        if (jump > 2000 * moved + 1.001e-3 * slew) FAIL_CHECK("at " << tick->time << " s the force jumps by " << jump << " N");
      }
      CHECK(owed < 0.4 * toughness * 0.005 * depth);
    }
}

TEST_CASE("a blade that cuts is resisted with toughness times its length in tissue, and friction", "[volume_cutter][cut_force]") {
  // Yardstick: F = (Gc + φ) L, L the depth of an upright blade drawn across; while nothing is owed, so the median of the ticks. The skin is dented at the
  // blade, which makes L less.
  double const toughness = 100, friction = 25;
  auto const result = cut_along<double>(stroke<double>(), {.puncture_depth = 0.003, .toughness = toughness, .lip_friction = friction});
  std::vector<double> forces;
  for (Tick const& tick : result.recording.ticks())
    if (tick.time > 0.7 && tick.time < 1.15) forces.push_back(-tick.force[0]);
  std::nth_element(forces.begin(), forces.begin() + std::ssize(forces) / 2, forces.end());
  CHECK(forces[forces.size() / 2] == Approx((toughness + friction) * depth).epsilon(0.15));
}

TEST_CASE("a blade is resisted along what of it is in the tissue, and not where it goes through a gap", "[volume_cutter][cut_force]") {
  // Yardstick: φ L, L the heights of both blocks; the gap between them is wider or narrower than half an edge.
  for (double const gap : {0.0005, 0.002, 0.0024, 0.004}) {
    INFO("a gap of " << gap << " m");
    auto const block = make_block<double>(4, 4, 3, 0.005, BlockPattern::alternating);
    Eigen::Index const points = block.points.cols(), tetrahedra = block.tetrahedra.cols();
    TetrahedralMesh<double> both{Matrix3X<double>(3, 2 * points), Matrix<int, 4, Dynamic>(4, 2 * tetrahedra)};
    both.points.leftCols(points) = both.points.rightCols(points) = block.points;
    both.points.rightCols(points).row(2).array() += 0.010 + gap;
    both.tetrahedra.leftCols(tetrahedra) = block.tetrahedra;
    both.tetrahedra.rightCols(tetrahedra) = block.tetrahedra.array() + static_cast<int>(points);
    SoftBody body(FiniteElements<double, StableNeoHookean<double>>(both, {.density = 1000, .material = {6e4, 0.4}}), BackwardEuler{});
    Knife knife({.lip_friction = 100});
    for (double const y : {0.0061, 0.0066, 0.0071}) {
      std::array<Vector3<double>, 3> const blade{Vector3<double>(0.0071, y, -0.01), Vector3<double>(0.0071, y, 0.0083), Vector3<double>(0.0071, y, 0.04)};
      knife.advance(body, std::span<Vector3<double> const>(blade));
    }
    REQUIRE(knife.grip());
    CHECK(knife.grip()->slip_force == Approx(100 * 0.020).epsilon(1e-6));
  }
}

TEST_CASE("a tool cuts on where its tip is in a cavity, or out at the far side, and is resisted", "[volume_cutter][cut_force]") {
  // Yardsticks: the thickness that the edge is in, times the way it is drawn; toughness and friction times that thickness; the tip's depth below the skin at rest.
  constexpr double thick = 0.010, toughness = 20, friction = 2, low = -0.1;   // z of the body's bottom, m
  for (bool const is_hollow : {true, false}) {
    INFO((is_hollow ? "a cavity below a roof" : "a layer that is held at two sides"));
    auto block = make_block<double>(13, 9, 9, 0.005, BlockPattern::alternating);   // 60 × 40 × 40 mm
    block.points.row(2).array() += low;
    auto mesh = block;
    int count = 0;
    for (int t = 0; t < block.tetrahedra.cols(); ++t) {
      Vector3<double> middle = Vector3<double>::Zero();
      for (int k = 0; k < 4; ++k) middle += block.points.col(block.tetrahedra(k, t)) / 4;
      Vector3<double> const off = (middle - Vector3<double>(0.030, 0.020, low + 0.020)).cwiseAbs();
      if (is_hollow ? off.x() > 0.020 || off.y() > 0.015 || off.z() > 0.010 : middle.z() > low + 0.030) mesh.tetrahedra.col(count++) = block.tetrahedra.col(t);
    }
    mesh.tetrahedra.conservativeResize(4, count);
    repair(mesh);
    FiniteElements<double, StableNeoHookean<double>> tissue(mesh, {.density = 1000, .material = {6e4, 0.4}, .damping = {.alpha = 30}});
    tissue.nail(vertices_where(mesh, [&](auto const& p) { return is_hollow ? p.z() < low + 1e-6 : p.x() < 0.006 || p.x() > 0.054; }));
    double const beyond = is_hollow ? 0.0307 : 0.060;
    auto path = Trajectory<double>::start({0.0313, 0.0087, low + 0.045});   // tip, above; the edge goes 50 mm up from it
    path.line({0.0313, 0.0087, low + 0.022}, 0.4).line({0.0313, 0.0307, low + 0.022}, 0.8).line({0.0313, 0.0187, low + 0.022}, 0.4);
    path.line({0.0313, beyond, low + 0.022}, 1.0).line({0.0313, beyond, low + 0.060}, 0.3);   // back, on, and out
    VolumeCutOptions<double> const options{.edge = {{0, 0, 0}, {0, 0, 0.05}}, .puncture_depth = 0.003, .toughness = toughness, .lip_friction = friction};
    Simulator simulator(ScriptedDevice<double>(path, {.max_force = 10.0}), SoftBody(std::move(tissue), BackwardEuler{}), VolumeCutter<double>(options), TissueReaction{});
    auto const recording = simulator.run(path.duration());
    std::vector<double> forces;
    for (Tick const& tick : recording.ticks())
      if (tick.time > 0.7 && tick.time < 1.2) {
        forces.push_back(-tick.force[1]);
        CHECK(tick.phase == CuttingPhase::moving);
        CHECK(tick.depth == Approx(0.040 - 0.022).epsilon(0.02));
      }
    std::nth_element(forces.begin(), forces.begin() + std::ssize(forces) / 2, forces.end());
    CHECK(forces[forces.size() / 2] == Approx((toughness + friction) * thick).epsilon(0.15));
    double const drawn = is_hollow ? 0.022 : 0.0313;
    CHECK(simulator.cutter().area() > 0.85 * thick * drawn);
    CHECK(simulator.cutter().area() < 1.1 * thick * (drawn + 0.005));
    CHECK(recording.ticks().back().energy >= toughness * simulator.cutter().area());
    CHECK(recording.ticks().back().phase == CuttingPhase::no_contact);
  }
}

TEST_CASE("a tool that is put through a ridge from one flank to the other cuts on", "[volume_cutter][cut_force]") {
  // Yardstick: twice the height of the ridge above the blade, times the way.
  auto mesh = make_block<double>(9, 13, 9, 0.005, BlockPattern::alternating);   // 40 × 60 × 40 mm
  mesh.points = Eigen::AngleAxisd(std::numbers::pi / 4, Vector3<double>::UnitY()).toRotationMatrix() * mesh.points;
  double const ridge = mesh.points.row(2).maxCoeff(), x = mesh.points(0, 0) + 0.04 * std::sqrt(0.5);
  FiniteElements<double, StableNeoHookean<double>> tissue(mesh, {.density = 1000, .material = {6e4, 0.4}, .damping = {.alpha = 30}});
  tissue.nail(vertices_where(mesh, [&](auto const& p) { return p.z() < ridge - 0.025; }));
  SoftBody body(std::move(tissue), BackwardEuler{});
  Knife knife({.edge = {{0, 0, 0}, {-0.05, 0, 0}}, .puncture_depth = 0.003});
  double const height = 0.0103, low = ridge - height;
  Vector3<double> tip(x - 0.03, 0.0087, low);
  auto const go = [&](Vector3<double> const& to, int ticks) { draw(knife, body, tip, to, ticks); };
  go({x + 0.03, 0.0087, low}, 300);
  CHECK(knife.state() == CuttingPhase::moving);
  CHECK(knife.contact().touching);
  go({x + 0.03, 0.0387, low}, 500);
  CHECK(knife.state() == CuttingPhase::moving);
  CHECK(knife.area() == Approx(2 * height * 0.030).epsilon(0.15));
  go({x + 0.03, 0.0387, ridge + 0.005}, 200);
  CHECK(knife.state() == CuttingPhase::no_contact);
}

TEST_CASE("a blade whose tip has been out at the far side cuts on where all of it is in the tissue again", "[volume_cutter][cut_force]") {
  // Yardstick: the body's thickness, and the blade's place in it. It is turned about a point in the tissue, with its tip from below the body to above it.
  Body body = make_body<double>();
  Knife knife({.edge = {{0, 0, 0}, {-0.03, 0, 0}}, .puncture_depth = 0.003});
  Vector3<double> tip(0.010, 0.0113, 0.024);
  double angle = 1.2;   // of the edge above the plane
  int within = 0;
  auto const advance = [&] {
    knife.advance(body, ToolPose<double>{.position = tip, .orientation = Eigen::Quaterniond(Eigen::AngleAxisd(angle, Vector3<double>::UnitY()))});
    REQUIRE(body.step(1e-3));
  };
  for (int k = 0; k < 100; ++k) tip.z() -= 0.012 / 100, advance();
  for (int k = 0; k < 100; ++k) tip.x() += 0.02 / 100, advance();
  auto const reach = [&] { return Vector3<double>(0.02 * std::cos(angle), 0, -0.02 * std::sin(angle)); };
  Vector3<double> heel = tip - reach();
  heel.z() = 0.012;
  bool was_out = false;
  for (int k = 0; k < 300; ++k) {
    angle -= 1.8 / 300, tip = heel + reach(), advance();
    was_out = was_out || tip.z() < -0.002;
    if (tip.z() < 0.018) CHECK(knife.state() == CuttingPhase::moving);
    within += tip.z() > 0.001 && tip.z() < 0.018;
  }
  CHECK(was_out);
  CHECK(within > 50);
}

TEST_CASE("the way back through a cut costs friction alone", "[volume_cutter][cut_force]") {
  // Yardstick: the way out has cost toughness; back again it is φ L for each metre, and what has been paid for the first edge of way before it is known that nothing is cut.
  double const toughness = 100, friction = 20;
  auto const result = cut_along<double>(stroke<double>(true), {.puncture_depth = 0.003, .toughness = toughness, .lip_friction = friction});
  double const out = energy_at(result.recording, 1.2) - energy_at(result.recording, 0.2), back = energy_at(result.recording, 2.2) - energy_at(result.recording, 1.2);
  CHECK(out > (toughness + friction) * depth * 0.022);
  CHECK(back < friction * depth * 0.030 + 2 * toughness * depth * 0.005);
}

TEST_CASE("the force on the hand changes in a tick by no more than stiffness times way and half a newton, but where the blade comes in and where it leaves",
          "[volume_cutter][cut_force]") {
  // Yardstick: |ΔF| ≤ K |Δp| + 0.5 N without any limit on slew, K the blade's stiffness and the contact's; at the puncture what the skin has pressed with is gone,
  // and where the blade leaves the block through its side what it was held with.
  auto path = Trajectory<double>::start({0.012, 0.0113, top + 0.004});
  path.line({0.012, 0.0113, top - depth}, 0.2);
  path.line({0.070, 0.0113, top - depth}, 1.4);   // out at the end
  path.line({0.070, 0.0113, top + 0.01}, 0.2);
  auto const result = cut_along<double>(path, {.puncture_depth = 0.003, .toughness = 150, .blade_stiffness = 1000});
  for (Tick const* tick : jumps(result.recording, 0.5))
    if (tick->phase == (tick - 1)->phase && tick->tip[0] < 0.058) FAIL_CHECK("at " << tick->time << " s, x = " << tick->tip[0] << " m the force jumps");
  CHECK(jumps(result.recording, 0.5).size() <= 3);
  CHECK(result.recording.largest_force() > 1.0);
  // Of a soft spring with much toughness, which is far behind where it leaves, and of a stiff one: what they cut is paid for.
  CHECK(result.recording.ticks().back().energy >= 150 * result.area);
  auto deeper = Trajectory<double>::start({0.012, 0.0113, top + 0.004});
  deeper.line({0.012, 0.0113, top - 0.0163}, 0.2).line({0.070, 0.0113, top - 0.0163}, 1.4).line({0.070, 0.0113, top + 0.01}, 0.2);
  for (double const stiffness : {500.0, 4000.0}) {
    auto const out = cut_along<double>(deeper, {.puncture_depth = 0.002, .toughness = 400, .blade_stiffness = stiffness});
    CHECK(out.area > 0.7 * 0.048 * 0.0163);
    CHECK(out.recording.ticks().back().energy >= 400 * out.area);
  }
}

TEST_CASE("a tool that crosses an old wound cuts on beyond it, and is not jerked there", "[volume_cutter][cut_force]") {
  // Yardsticks: the same way of the blade alone; the area without the old wound; |ΔF| ≤ K |Δp| + 0.75 N, of 1.8 N that the blade is held with.
  double const low = top - depth;
  auto path = Trajectory<double>::start({0.012, 0.0113, top + 0.004});
  path.line({0.012, 0.0113, low}, 0.2).line({0.046, 0.0113, low}, 1.0).line({0.046, 0.0113, top + 0.01}, 0.2);
  VolumeCutOptions<double> const options{.puncture_depth = 0.003, .toughness = 150};
  auto const alone = cut_along(path, options);
  struct Wound {
    double x, low;
    bool steps;
  };
  for (Wound const& wound : {Wound{0.0287, 0.001, true}, Wound{0.0364, 0.006, false}}) {   // 19 and 14 mm deep, of 20
    INFO("a wound at " << wound.x << " m, down to " << wound.low << " m");
    Body bodies[2] = {make_body<double>(), make_body<double>()};
    Knife tool({.puncture_depth = 0.003}), blade({.puncture_depth = 0.003});
    for (Body& body : bodies) cut_across(body, wound.x, wound.low);
    bool is_touching = true;
    for (int tick = 0; tick <= 700; ++tick) {
      double const in = std::min(tick, 100) / 100.0, on = std::max(tick - 100, 0) / 600.0;
      Vector3<double> const at(0.012 + 0.034 * on, 0.0113, top + 0.004 - (depth + 0.004) * in);
      tool.advance(bodies[0], ToolPose<double>{.position = at});
      blade.advance(bodies[1], {at, at + Vector3<double>(0, 0, 0.03)});
      is_touching = is_touching && (tick < 100 || tool.state() == CuttingPhase::moving);
      if (wound.steps && tick % 4 == 0) REQUIRE((bodies[0].step(1e-3) && bodies[1].step(1e-3)));
    }
    CHECK(is_touching);
    CHECK(tool.area() == Approx(blade.area()).epsilon(1e-12));
    Body body = make_body<double>();
    cut_across(body, wound.x, wound.low);
    auto const across = cut_along(path, options, std::move(body));
    CHECK(across.area == Approx(alone.area).epsilon(0.1));
    CHECK(across.recording.ticks().back().energy >= 150 * across.area);
    for (Tick const* tick : jumps(across.recording, 0.75))
      if (tick->phase == (tick - 1)->phase) FAIL_CHECK("at " << tick->time << " s, x = " << tick->tip[0] << " m the force jumps");
  }
}

TEST_CASE("a tool that comes back into the wound that it has left cuts on from its end", "[volume_cutter][cut_force]") {
  // Yardstick: its depth times the way of the second stroke beyond the first.
  double const low = top - depth;
  for (double const back : {0.030, 0.039}) {
    INFO("back at x = " << back << " m");
    Body body = make_body<double>();
    Knife knife({.puncture_depth = 0.006});
    auto const go = [&](Vector3<double> const& from, Vector3<double> const& to) {
      int jumps = 0;
      for (int tick = 1; tick <= 200; ++tick) {
        auto const before = knife.state();
        knife.advance(body, ToolPose<double>{.position = from + tick / 200.0 * (to - from)});
        jumps += knife.state() != before;
        REQUIRE(body.step(1e-3));
      }
      return jumps;
    };
    Vector3<double> const in(0.012, 0.0113, top - depth), end(0.042, 0.0113, top - depth), over(back, 0.0113, top + 0.006), deep(back, 0.0113, low);
    go({0.012, 0.0113, top + 0.004}, in), go(in, end), go(end, {0.042, 0.0113, top + 0.006});
    REQUIRE(knife.state() == CuttingPhase::no_contact);
    double const first = knife.area();
    go({0.042, 0.0113, top + 0.006}, over), go(over, deep);
    CHECK(knife.state() == CuttingPhase::moving);
    CHECK(go(deep, {0.055, 0.0113, low}) == 0);
    CHECK(knife.area() - first == Approx(depth * (0.055 - 0.042)).epsilon(0.25));
    go({0.055, 0.0113, low}, {0.055, 0.0113, top + 0.006});
    CHECK(knife.state() == CuttingPhase::no_contact);
  }
}

TEST_CASE("a tool that comes into a closed wound of a thin layer cuts on from its end", "[volume_cutter][cut_force]") {
  // Yardstick: its height above the tip times the way beyond the wound; the nearest skin is the far side, and at the wound it meets no wall first.
  constexpr double thick = 0.010, at = 0.0313, end = 0.02;
  for (double const off : {0.0, 0.0005}) {
    INFO(off << " m beside the wound");
    FiniteElements<double, StableNeoHookean<double>> tissue(make_block<double>(13, 9, 3, 0.005, BlockPattern::alternating),
                                                            {.density = 1000, .material = {6e4, 0.4}, .damping = {.alpha = 30}});
    for (int i = 0; i < tissue.size(); ++i)
      if (double const x = tissue.rest_position(i).x(); x < 1e-6 || x > 0.0599) tissue.nail(i);
    SoftBody body(std::move(tissue), BackwardEuler{});
    Knife saw, knife({.edge = {{0, 0, 0}, {0, 0, 0.05}}, .puncture_depth = 0.006});
    for (double y = -0.01; y < end; y += 0.001) saw.advance(body, BladeSegment<double>{{at, y, -0.01}, {at, y, 0.06}});
    saw.lift(body);
    Vector3<double> tip(at + off, 0.0107, thick + 0.003);
    auto const go = [&](Vector3<double> const& to, int ticks) { draw(knife, body, tip, to, ticks); };
    double const low = thick / 4;
    go({at + off, 0.0107, low}, 200);
    CHECK(knife.state() == CuttingPhase::moving);
    CHECK(knife.contact().normal.z() > 0.99);
    CHECK(knife.contact().depth == Approx(thick - low).epsilon(0.1));
    go({at + off, 0.038, low}, 300);
    CHECK(knife.area() > (thick - low) * (0.038 - end - 0.006));   // it ends at the last edges that were crossed
    CHECK(knife.area() < (thick - low) * (0.038 - end + 0.001));
    go({at + off, 0.038, thick + 0.01}, 50);
    CHECK(knife.state() == CuttingPhase::no_contact);
  }
}

TEST_CASE("over the floor of a pit a tool cuts nothing before it has pressed it", "[volume_cutter][cut_force]") {
  // Yardstick: the nearest point of the body, its outward normal there.
  FiniteElements<double, StableNeoHookean<double>> tissue(make_block<double>(13, 11, 7, 0.005, BlockPattern::alternating),
                                                          {.density = 1000, .material = {6e4, 0.4}, .damping = {.alpha = 30}});   // 60 × 50 × 30 mm
  for (int i = 0; i < tissue.size(); ++i)
    if (tissue.rest_position(i).z() < 1e-6) tissue.nail(i);
  SoftBody body(std::move(tissue), BackwardEuler{});
  Aspirator<double> aspirator({.tip_radius = 0.004, .reach = 0.008, .max_tetrahedra = 400, .debris = 50});
  for (double x = 0.016; x <= 0.0441; x += 0.002)
    for (double y = 0.013; y <= 0.0371; y += 0.004)
      for (double z = 0.04; z >= 0.0199; z -= 0.01) aspirator.advance(body, Vector3<double>(x, y, z)), aspirator.advance(body, Vector3<double>(x, y, z));
  REQUIRE(aspirator.report().tetrahedra > 500);
  int pressed = 0;
  for (int place = 0; place < 100; ++place) {
    Knife knife({.puncture_depth = 0.006});
    Vector3<double> tip(0.021 + 0.0018 * (place % 10), 0.018 + 0.0014 * (place / 10), 0.036);
    bool is_out = true;
    for (; is_out && tip.z() > 0; tip.z() -= 2e-4) {
      knife.advance(body, ToolPose<double>{.position = tip});
      auto const near = body.nearest_point(tip);
      bool on_border = false;
      is_out = (tip - near.point).dot(detail::pseudo_normal(body, near.triangle, near.barycentric, on_border)) > 0;
      REQUIRE(knife.state() != CuttingPhase::moving);
    }
    pressed += knife.state() == CuttingPhase::indenting;
  }
  CHECK(pressed == 100);
}

TEST_CASE("the wall of a wound that is wide open is punctured as the skin is", "[volume_cutter][cut_force]") {
  // Yardstick: the depth asked for, from the wall of a half whose other half is 0.1 m away.
  Body body = make_body<double>();
  Knife saw;
  double const middle = 0.0313;
  for (double y = -0.02; y < 0.04; y += 0.001) saw.advance(body, BladeSegment<double>{{middle, y, -0.02}, {middle, y, 0.06}});
  saw.lift(body);
  auto const pieces = pieces_of(body);
  REQUIRE(pieces.size() == 2);
  auto state = body.save();
  for (int const i : pieces[body.reference_position(pieces[0][0]).x() > middle ? 0 : 1]) state.particles.position[i].x() += 0.1, state.particles.home[i].x() += 0.1;
  body.restore(state);
  Knife knife({.puncture_depth = 0.006});
  for (double deep = -0.02; deep < 0.0055; deep += 2e-4) {
    knife.advance(body, ToolPose<double>{.position = {middle - deep, 0.0107, 0.008}});
    if (std::abs(deep) > 1e-9) CHECK(knife.state() == (deep < 0 ? CuttingPhase::no_contact : CuttingPhase::indenting));
    if (deep > 1e-9) CHECK(knife.contact().depth == Approx(deep).margin(5e-4));
  }
  CHECK(knife.area() == 0);
  for (double deep = 0.0055; deep < 0.02; deep += 2e-4) knife.advance(body, ToolPose<double>{.position = {middle - deep, 0.0107, 0.008}});
  CHECK(knife.state() == CuttingPhase::moving);
  CHECK(knife.area() > 0);
}

TEST_CASE("a blade punctures when it presses hard enough, however little deep", "[volume_cutter][cut_force]") {
  // Yardstick: the force of the recording at the puncture.
  double const force = 0.25;
  auto const result = cut_along<double>(stroke<double>(), {.puncture_depth = 0.5, .puncture_force = force});
  auto const& ticks = result.recording.ticks();
  auto const first = std::find_if(ticks.begin(), ticks.end(), [](Tick const& tick) { return tick.phase == CuttingPhase::moving; });
  REQUIRE(first != ticks.end());
  CHECK((first - 1)->force.norm() >= force);
  CHECK((first - 2)->force.norm() < force);
  CHECK(result.area > 0);
  CHECK(cut_along<double>(stroke<double>(), {.puncture_depth = 0.5}).area == 0);
}

TEST_CASE("measured curves, blade factors and friction are felt at the depth and speed of the blade in a solid", "[volume_cutter][cut_force]") {
  // Yardstick: how deep the path is below the flat skin, its speed into the tissue, and the closed forms at these: 3 N at 18 mm before the puncture; then the
  // published network times w cos θ/s at d/cos θ, the lesser branch on the way out, and (C + b v) d of the friction, whose spring stays drawn where the blade
  // stays as deep.
  double const puncture = 0.006, deepest = 0.014, speed = 0.04, angle = 0.2, width = 8, sharpness = 1.25, dry = 20, viscous = 300, spring = 600;
  CuttingForce force(bladed(liver_hysteresis<double>(), BladeFactors<double>{.width_ratio = width, .sharpness = sharpness, .entry_angle = angle}),
                     KarnoppFriction<double>({.dynamic = dry, .viscous = viscous, .holding = 40, .stick_speed = 0.002, .stick_stiffness = spring}));
  auto const at = [](double x, double z) { return Vector3<double>(x, 0.0113, z); };
  auto path = Trajectory<double>::start(at(0.012, top + 0.004));
  path.line(at(0.012, top - deepest), (deepest + 0.004) / speed).line(at(0.030, top - deepest), 0.4);
  path.line(at(0.030, top + 0.004), (deepest + 0.004) / speed);
  Simulator simulator(ScriptedDevice<double>(path, {.max_force = 10.0}), make_body<double>(), VolumeCutter<double>({.puncture_depth = puncture}), std::move(force));
  auto const recording = simulator.run(path.duration());
  CHECK(simulator.cutter().area() > 0.5 * 0.018 * deepest);   // the front is at the last edges

  auto const curve = [&](double deep, bool out) {
    double const d = deep / std::cos(angle), in = published_liver(d, false);
    return width * std::cos(angle) / sharpness * (out ? std::min(published_liver(d, true), in) : in);
  };
  double const sliding = dry + viscous * speed;   // N/m
  int indents = 0, enters = 0, cuts = 0, leaves = 0;
  for (Tick const& tick : recording.ticks()) {
    double const deep = top - tick.tip[2];
    double expected = 0;
    if (tick.phase == CuttingPhase::indenting) {
      expected = 3.0 / 0.018 * deep, ++indents;
      CHECK(deep < puncture + 1.01e-3 * speed);
    } else if (tick.phase == CuttingPhase::moving && tick.tip[0] == 0.012) {
      if (deep < puncture + 2 * sliding * puncture / spring) continue;   // its spring is being drawn
      expected = curve(deep, false) + sliding * deep, ++enters;
    } else if (tick.phase == CuttingPhase::moving && deep > deepest - 1e-9) {
      expected = curve(deepest, false) + sliding * deepest, ++cuts;
    } else if (tick.phase == CuttingPhase::moving) {
      if (deep > deepest - 2 * sliding * deepest / spring - 0.0015 || deep < 0.002) continue;   // friction and curve turn; below 2 mm the curve fades
      expected = curve(deep, true) - sliding * deep, ++leaves;
    }
    if (!((tick.force - Vector3<double>(0, 0, expected)).norm() < 1e-6))
      FAIL_CHECK("at " << tick.time << " s, " << 1e3 * deep << " mm deep: " << tick.force.transpose() << " N instead of " << expected << " N");
  }
  CHECK(indents > 140);
  CHECK(enters > 170);
  CHECK(cuts > 390);
  CHECK(leaves > 200);
}

TEST_CASE("what makes no sense as a resistance is refused with the value", "[volume_cutter][cut_force]") {
  using Catch::Contains;
  double const nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(VolumeCutter<double>({.toughness = -1}), Contains("toughness is -1 J/m2"));
  CHECK_THROWS_WITH(VolumeCutter<double>({.lip_friction = nan}), Contains("friction of the lips is nan N/m"));
  CHECK_THROWS_WITH(VolumeCutter<double>({.blade_stiffness = 0}), Contains("blade stiffness is 0 N/m"));
  CHECK_THROWS_WITH(VolumeCutter<double>({.edge = {Vector3<double>::Zero()}}), Contains("an edge of 1 points"));
}
