// SPDX-License-Identifier: MIT
#include "strokes.hpp"

#include <palpate/core/error.hpp>

#include <Eigen/Geometry>

#include <cmath>
#include <functional>
#include <utility>

namespace cutting {

namespace {

constexpr double pi = 3.14159265358979323846;
constexpr double above = 0.01;        // m over the surface, before and after
constexpr double below = 0.004;       // m under it while the blade cuts
constexpr double per_tick = 0.00015;  // m, at 1 kHz: 15 cm/s

struct Spot {
  Vector point, normal;
};

/// Looks along the ray origin + r·direction, r > 0, for the last place where it leaves the liver.
Spot last_exit(Mesh const& mesh, Vector const& origin, Vector const& direction) {
  double farthest = 0.0;
  Spot spot;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    Vector const a = mesh.points.col(mesh.triangles(0, t)), b = mesh.points.col(mesh.triangles(1, t)),
                 c = mesh.points.col(mesh.triangles(2, t));
    Vector const normal = (b - a).cross(c - a);
    double const towards = normal.dot(direction), r = normal.dot(a - origin) / towards;
    if (!(towards > 0.0) || !(r > farthest)) continue;
    Vector const p = origin + r * direction;
    if (normal.dot((b - a).cross(p - a)) < 0.0 || normal.dot((c - b).cross(p - b)) < 0.0 ||
        normal.dot((a - c).cross(p - c)) < 0.0)
      continue;
    farthest = r;
    spot = {p, normal.normalized()};
  }
  if (!(farthest > 0.0)) throw palpate::InvalidArgument("a stroke goes past the liver");
  return spot;
}

/// A curve over the surface as tips: `at(s)` is the place on the surface for 0 ≤ s ≤ 1, `length` about how long it is [m].
Tips tips_along(std::function<Spot(double)> const& at, double length) {
  Tips tips;
  auto const down = [&](Spot const& spot, double height) { tips.push_back(spot.point + height * spot.normal); };
  Spot const first = at(0.0), last = at(1.0);
  for (double height = above; height > -below; height -= per_tick) down(first, height);
  int const ticks = static_cast<int>(std::ceil(length / per_tick));
  std::vector<Spot> spots;
  for (int k = 0; k <= ticks; ++k) spots.push_back(at(double(k) / ticks));
  for (Spot const& spot : spots) down(spot, -below);
  for (double height = -below; height < above; height += per_tick) down(last, height);
  return tips;
}

}  // namespace

std::vector<Stroke> strokes_over(Mesh const& liver) {
  // A curve drawn on the table top, dropped on the liver from above.
  auto const from_above = [&](std::function<Vector(double)> const& curve, double length) {
    return tips_along([&, curve](double s) { return last_exit(liver, curve(s), Vector::UnitZ()); }, length);
  };
  auto const line = [&](Vector const& from, Vector const& to) {
    return from_above([=](double s) { return Vector(from + s * (to - from)); }, (to - from).norm());
  };
  auto const wave = [](double s) { return Vector(-0.075 + 0.10 * s, 0.005 + 0.014 * std::sin(2 * pi * s), 0.0); };
  auto const circle = [](double s) {
    double const turn = 2 * pi * 1.03 * s;
    return Vector(-0.03 + 0.022 * std::cos(turn), 0.01 + 0.022 * std::sin(turn), 0.0);
  };
  // In the plane x = 1 cm, all the way round.
  auto const around = [&](double s) {
    double const turn = 2 * pi * 1.02 * s;
    return last_exit(liver, Vector(0.01, 0.012, 0.006), Vector(0.0, std::sin(turn), std::cos(turn)));
  };

  Vector const over_the_front(0.0, -0.55, 1.0), from_the_right(0.5, -0.8, 0.55);
  return {
      {.name = "straight", .blades = {line({-0.07, 0.0, 0.0}, {0.02, 0.012, 0.0})}, .seen_from = over_the_front},
      {.name = "curved", .blades = {from_above(wave, 0.14)}, .seen_from = over_the_front},
      {.name = "crossing",
       .blades = {line({-0.07, -0.012, 0.0}, {0.015, 0.028, 0.0})},
       .afterwards = {line({-0.05, 0.038, 0.0}, {-0.005, -0.026, 0.0})},
       .seen_from = over_the_front},
      {.name = "loop", .blades = {from_above(circle, 0.145)}, .part = {0.0, 0.015, 0.032}, .seen_from = over_the_front},
      {.name = "around", .blades = {tips_along(around, 0.30)}, .part = {0.03, 0.0, 0.0}, .seen_from = from_the_right},
      {.name = "two_blades",
       .blades = {line({-0.07, -0.015, 0.0}, {0.01, -0.010, 0.0}), line({-0.07, 0.022, 0.0}, {0.01, 0.027, 0.0})},
       .seen_from = over_the_front},
  };
}

}  // namespace cutting
