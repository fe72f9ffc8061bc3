// SPDX-License-Identifier: MIT
// A heart under a finger (Zheng 2006: 961 nodes, some 50 Hz with the zone of influence, drawing included, on a PC of 2006). The finger goes 8 mm deep and
// comes back. Each tick finds the vertex under it, computes the tissue (the whole body, or the zone around the touch) and the smooth normals that the
// picture is shaded with: that is the rate printed here, without drawing.
#include "../album.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/edges.hpp>
#include <palpate/mesh/heart.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/rings.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <utility>
#include <vector>

namespace {

using namespace palpate;
using Vector = Vector3<double>;
using Heart = decltype(SoftBody(std::declval<MassSpring<double>>(), LeapfrogVerlet{}, ZoneOfInfluence{}));

constexpr double tick = 1e-3, deepest = 0.008, home_stiffness = 20.0;   // s, m, N/m
constexpr int press_ticks = 300, ticks = 1200;
constexpr ZoneOfInfluence whole{.rings = 100};   // rings enough for all particles: one type for both

Heart heart(ZoneOfInfluence region) {
  return Heart(MassSpring<double>(make_heart<double>(), {.mass = {.total = 0.3}, .link = {.stiffness = 60.0, .damping = 0.05},
                                                         .home = {.stiffness = home_stiffness, .damping = 0.1}}),
               LeapfrogVerlet{}, region);
}

/// Down in 0.3 s, 0.6 s at rest, up again.
double depth_at(int k) {
  double const share = k < press_ticks ? double(k) / press_ticks : k < ticks - press_ticks ? 1.0 : double(ticks - k) / press_ticks;
  return deepest * share * share * (3.0 - 2.0 * share);
}

struct Palpation {
  double force = 0.0, balance = 0.0, truncation = 0.0;   // N, N, m: of the finger at rest, of the home springs, the zone's estimate
  std::vector<double> rings;                             // m, the mean displacement of the touched vertex and of each ring around it
  TriangleMesh<double> pressed;
};

/// A palpation; `rate` [1/s] counts its ticks. The finger is at `place`.
Palpation palpate_once(Heart body, Vector const& place, double& rate, PlotSeries* curve = nullptr) {
  int const touched = body.nearest_vertex(place);
  Vector const home = body.reference_position(touched), inward = -body.reference_normal(touched);
  Palpation result;
  auto const mesh = body.rest_mesh();
  std::chrono::duration<double> computing{};
  body.hold(touched);
  for (int k = 1; k <= ticks; ++k) {
    auto const start = std::chrono::steady_clock::now();
    Vector const finger = home + depth_at(k) * inward;
    int const under = body.nearest_vertex(finger);
    body.drag(touched, finger);
    body.advance(tick);
    auto const normals = vertex_normals(body.mesh());
    computing += std::chrono::steady_clock::now() - start;
    if (under < 0 || !normals.allFinite()) std::printf("the body is not sound in tick %d\n", k);
    if (curve != nullptr && k <= press_ticks && k % 10 == 0) drawing::add(*curve, 1e3 * depth_at(k), body.reaction(touched).dot(inward));
    if (k != ticks - press_ticks) continue;
    // At rest the finger pushes as much as the home springs push back: links push their two ends alike, so they cancel.
    Vector sum = Vector::Zero();
    for (int i = 0; i < body.size(); ++i) sum += home_stiffness * body.displacement(i);
    result.force = body.reaction(touched).dot(inward);
    result.balance = sum.dot(inward);
    result.truncation = body.truncation_error();
    result.pressed = body.mesh();
    for (auto const& ring : vertex_rings(mesh, touched, 3)) {
      double mean = 0.0;
      for (int const i : ring) mean += body.displacement(i).norm() / double(ring.size());
      result.rings.push_back(mean);
    }
  }
  rate = ticks / computing.count();
  return result;
}

/// The same three times: prints force, truncation error, and the median rate with the slowest and the fastest.
Palpation palpate_often(char const* name, ZoneOfInfluence region, Vector const& place, PlotSeries& curve) {
  std::array<double, 3> rates{};
  Palpation result;
  for (std::size_t k = 0; k < rates.size(); ++k) result = palpate_once(heart(region), place, rates[k], k == 0 ? &curve : nullptr);
  std::sort(rates.begin(), rates.end());
  std::printf("%-12s %9.4f %13.3f %10.0f %10.0f ... %.0f\n", name, result.force, 1e3 * result.truncation, rates[1], rates.front(), rates.back());
  return result;
}

drawing::Album heart_example() {
  using namespace drawing;
  auto const mesh = make_heart<double>();
  std::printf("heart: %d nodes, %d triangles, %d edges; in the thesis 961, 1712, 2687, which is no closed surface\n", static_cast<int>(mesh.points.cols()),
              static_cast<int>(mesh.triangles.cols()), static_cast<int>(edges(mesh).size()));

  Album album;
  Picture curves("heart_force", "A finger on the heart: force over depth", "depth [mm]", "force [N]");
  Vector const place(0.01, -0.05, -0.02);   // on the right ventricle
  std::printf("%-12s %9s %13s %10s %20s\n", "computed", "force [N]", "cut off [mm]", "rate [Hz]", "slowest ... fastest");
  Palpation const all = palpate_often("whole body", whole, place, curves.line(blue, "whole body"));
  Palpation const three = palpate_often("three rings", {.rings = 3}, place, curves.line(green, "three rings"));
  Palpation const two = palpate_often("two rings", {.rings = 2}, place, curves.line(orange, "two rings"));
  Palpation const one = palpate_often("one ring", {.rings = 1}, place, curves.line(pink, "one ring"));
  std::printf("in the thesis two rings: some 50 Hz, a PC of 2006, drawing included\n");
  std::printf("balance of the whole body at rest: the finger pushes %.4f N, the home springs push back %.4f N\n", all.force, all.balance);
  std::printf("whole body, mean displacement: touched %.3f, ring 1 %.3f, ring 2 %.3f, ring 3 %.3f mm\n", 1e3 * all.rings[0], 1e3 * all.rings[1], 1e3 * all.rings[2],
              1e3 * all.rings[3]);
  std::printf("the hand feels of the cut-off: three rings %+.1f %%, two %+.1f %%, one %+.1f %%; a person tells 7 %%\n", 100.0 * (three.force / all.force - 1.0),
              100.0 * (two.force / all.force - 1.0), 100.0 * (one.force / all.force - 1.0));
  album.charts.push_back(curves);
  Vector const from(0.35, -1.0, 0.25);
  album.views.push_back({.name = "heart_facets", .mesh = two.pressed, .from = from, .has_facets = true});
  album.views.push_back({.name = "heart_smooth", .mesh = two.pressed, .from = from});
  return album;
}

}  // namespace

int main(int argc, char** argv) { return drawing::run_example("heart", argc, argv, heart_example); }
