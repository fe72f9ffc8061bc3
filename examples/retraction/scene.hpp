// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/palpate.hpp>
#include <palpate/tool.hpp>
#include <palpate/volume/organ_volume.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace retraction {

using Vector = palpate::Vector3<double>;
using Solid = palpate::FiniteElements<double, palpate::StableNeoHookean<double>>;
using Body = palpate::SoftBody<Solid, palpate::BackwardEuler, palpate::WholeBody>;

/// What the three hands do, and when. Units: m, s.
struct Plan {
  double edge = 0.0135;        // of the lattice that fills the organ: 3,338 tetrahedra
  double x = -0.030, y = 0.010;   // of the cut's middle, on the dome of the right lobe
  double cut = 0.06;           // how far the scalpel goes, along x
  double deep = 0.018;         // its tip, below the skin
  double aside = 0.016;        // each hook, beside the cut
  double press = 0.004;        // how far it presses in, to hook in
  double draw = 0.008;         // how far it draws the tissue aside; as far again while the scalpel cuts
  double tilt = 0.25;          // rad, of a hook's point, towards the hand
  double hook_in = 0.4, draw_in = 0.5, touch_in = 0.3, cut_in = 1.4, settle = 0.4, rest = 1.1;

  double hooked() const { return hook_in; }
  double drawn() const { return hook_in + draw_in; }
  double cutting() const { return drawn() + touch_in; }   // from here on, to stopped()
  double stopped() const { return cutting() + cut_in; }
  double at_rest() const { return stopped() + settle; }
  double end() const { return at_rest() + rest; }
};

using Hand = palpate::ScriptedDevice<double>;

/// The liver, filled, and lying in its bed: the underside is fixed.
struct Organ {
  palpate::TriangleMesh<double> skin;
  palpate::TetrahedralMesh<double> solid;

  explicit Organ(Plan const& plan) : skin(palpate::make_organ<double>()), solid(palpate::fill(skin, {.edge = plan.edge}).mesh) {}

  Body body() const {
    Solid tissue(solid, {.density = 1060.0, .material = {.young = 5e3, .poisson = 0.4}, .damping = {.alpha = 10.0}, .prestrain = 0.04});
    auto const border = palpate::surface(solid);
    auto const normals = palpate::vertex_normals(border);
    for (int i = 0; i < normals.cols(); ++i)
      if (normals.col(i).norm() > 0.5 && normals(2, i) < 0.2) tissue.nail(i);
    return Body(std::move(tissue), palpate::BackwardEuler{.max_iterations = 20});
  }
};

/// The place of the upper side above or below (x, y, ·).
inline Vector upper_side(palpate::TriangleMesh<double> const& border, double x, double y) {
  Vector highest(x, y, border.points.row(2).minCoeff());
  for (Eigen::Index t = 0; t < border.triangles.cols(); ++t) {
    Vector const a = border.points.col(border.triangles(0, t)), b = border.points.col(border.triangles(1, t)), c = border.points.col(border.triangles(2, t));
    Vector const normal = (b - a).cross(c - a);
    if (!(normal.z() > 0)) continue;   // looks down
    Vector const at(x, y, a.z() - (normal.x() * (x - a.x()) + normal.y() * (y - a.y())) / normal.z());
    bool const is_inside = (b - a).cross(at - a).z() >= 0 && (c - b).cross(at - b).z() >= 0 && (a - c).cross(at - c).z() >= 0;
    if (is_inside) highest.z() = std::max(highest.z(), at.z());
  }
  return highest;
}

/// One hook: down onto the skin, pressed in, drawn aside, and as far again while the scalpel cuts. `side` is −1 or 1, along y: the shaft leans that
/// way, and the point looks a little there, so that it holds what is drawn.
inline Hand hook(Plan const& plan, palpate::TriangleMesh<double> const& border, double side) {
  using enum palpate::Pace;
  Vector const on = upper_side(border, plan.x, plan.y + side * plan.aside), down(0, 0, -plan.press), drawn(0, side * plan.draw, 0);
  auto path = palpate::Trajectory<double>::start(on - down);
  path.line(on + down, plan.hook_in, minimum_jerk).line(on + down + drawn, plan.draw_in, minimum_jerk).hold(plan.touch_in);
  path.line(on + down + 2 * drawn, plan.cut_in, minimum_jerk);
  Eigen::Quaterniond const turned = Eigen::AngleAxisd(side > 0 ? 0.0 : std::numbers::pi, Vector::UnitZ()) * Eigen::AngleAxisd(plan.tilt, Vector::UnitX());
  return Hand(std::move(path), {.orientation = {{0.0, turned}}});
}

/// The scalpel waits above, comes down, cuts along x as deep below the skin as it was before the pull, and stays where it is then.
inline Hand scalpel(Plan const& plan, palpate::TriangleMesh<double> const& border) {
  double const from = plan.x - plan.cut / 2;
  auto const below = [&](double x) { return Vector(upper_side(border, x, plan.y) - Vector(0, 0, plan.deep)); };
  auto path = palpate::Trajectory<double>::start(below(from) + Vector(0, 0, 2.2 * plan.deep));
  path.hold(plan.drawn()).line(below(from), plan.touch_in, palpate::Pace::minimum_jerk);
  constexpr int pieces = 24;
  for (int k = 1; k <= pieces; ++k) path.line(below(from + plan.cut * k / pieces), plan.cut_in / pieces);
  return Hand(std::move(path), {.orientation = {{0.0, Eigen::Quaterniond::Identity()}}});   // upright
}

/// Three hands at one organ: two hooks and a scalpel.
inline auto make_simulator(Plan const& plan, Organ const& organ, double body_rate = 500.0) {
  using namespace palpate;
  Body body = organ.body();
  auto const border = body.mesh();   // under its pre-tension
  auto const hooked = [] { return Hook<double>({.friction = 0.5}); };
  VolumeCutter<double> knife({.edge = {Vector::Zero(), Vector(0, 0, 0.04)}, .puncture_depth = 0.003, .toughness = 30.0, .lip_friction = 5.0});
  return Simulator(std::move(body), SimulatorOptions{.body_rate = body_rate}, Tool(hook(plan, border, -1), hooked(), TissueReaction{}),
                   Tool(hook(plan, border, 1), hooked(), TissueReaction{}), Tool(scalpel(plan, border), std::move(knife), TissueReaction{}));
}

}  // namespace retraction
