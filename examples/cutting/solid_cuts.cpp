// SPDX-License-Identifier: MIT
#include "solid_cuts.hpp"

#include "pictures.hpp"

#include <palpate/palpate.hpp>
#include <palpate/testing/solid_cut_invariants.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

namespace cutting {

namespace {

using namespace palpate;

using Block = SoftBody<FiniteElements<double, StableNeoHookean<double>>, BackwardEuler, WholeBody>;

constexpr double tick = 2e-3;   // s
constexpr double block_width = 0.048, block_height = 0.020;   // m

Block make_tissue() {
  FiniteElements<double, StableNeoHookean<double>> tissue(make_block<double>(13, 13, 6, 0.004, BlockPattern::alternating),
                                                          {.density = 1060.0, .material = {.young = 3000, .poisson = 0.4}, .prestrain = 0.08});
  // It lies on a plate, and its sides hang on to what is around it.
  for (int i = 0; i < tissue.size(); ++i) {
    Vector const X = tissue.rest_position(i);
    if (X[2] < 1e-6 || std::min({X[0], X[1], block_width - X[0], block_width - X[1]}) < 1e-6) tissue.nail(i);
  }
  return Block(std::move(tissue));
}

/// One way of a straight edge: where it is at u from 0 to 1.
using Way = std::function<BladeSegment<double>(double)>;
struct SolidCut {
  std::string name;
  std::vector<Way> ways;
  Vector lift = Vector::Zero();   // m, how far a free piece is taken out
};

/// The edge goes from y = −2 mm on, and stays upright.
Way along_y(double x, double lowest, double far) {
  return [=](double u) { return BladeSegment<double>{{x, -0.002 + far * u, lowest}, {x, -0.002 + far * u, 0.030}}; };
}
Way tilted(double top, double bottom) {
  double const x = 0.010 / (block_height - 0.0065);   // as steep above the block as in it
  return [=](double u) {
    double const y = -0.002 + (block_width + 0.004) * u;
    return BladeSegment<double>{{bottom, y, 0.0065}, {top + (top - bottom) * x, y, block_height + 0.010}};
  };
}

std::vector<SolidCut> solid_cuts() {
  std::vector<SolidCut> cuts;
  cuts.push_back({"through", {along_y(0.0226, -0.005, 0.052)}, Vector::Zero()});
  cuts.push_back({"partial", {along_y(0.0226, 0.0085, 0.040)}, Vector::Zero()});
  cuts.push_back({"curved", {[](double u) {
                    double const angle = std::numbers::pi * (0.15 + 1.2 * u);
                    Vector const at(0.024 + 0.0135 * std::cos(angle), 0.024 + 0.0135 * std::sin(angle), 0.0085);
                    return BladeSegment<double>{at, at + Vector(0, 0, 0.022)};
                  }}, Vector::Zero()});
  cuts.push_back({"crossing",
                  {along_y(0.0226, 0.0085, 0.044), [](double u) { return BladeSegment<double>{{0.006 + 0.036 * u, 0.0251, 0.0085}, {0.006 + 0.036 * u, 0.0251, 0.03}}; }},
                  Vector::Zero()});
  cuts.push_back({"wedge", {tilted(0.0147, 0.0251), tilted(0.0334, 0.0229)}, Vector(0, 0, 0.014)});
  cuts.push_back({"slice", {[](double u) { return BladeSegment<double>{{-0.004, -0.002 + 0.052 * u, 0.0148}, {0.052, -0.002 + 0.052 * u, 0.0148}}; }}, Vector(0.006, 0, 0.010)});
  return cuts;
}

/// The border as a picture shows it: what was inside before the cut in the colour of an inside.
Mesh drawn(Block const& body) {
  auto const& surface = body.tissue().surface();
  Mesh mesh{Matrix3X<double>(3, 2 * body.size()), body.triangles()};
  mesh.points << body.positions(), body.positions();
  for (int t = 0; t < surface.triangle_count(); ++t)
    if (body.tissue().is_wound(t)) {
      mesh.triangles.col(t).array() += body.size();   // vertices of its own: sharp along the lips
      std::swap(mesh.triangles(1, t), mesh.triangles(2, t));
    }
  return mesh;
}

void move_on(Block& body) {
  if (!body.step(tick)) throw Error("the tissue diverged");
}

/// How far apart two particles are at most that were one before the cut.
double widest_gap(Block const& body) {
  std::vector<int> order;
  for (int i = 0; i < body.size(); ++i) order.push_back(i);
  auto const rest = [&](int i) {
    Vector const X = body.tissue().rest_position(i);
    return std::array{X[0], X[1], X[2]};
  };
  std::sort(order.begin(), order.end(), [&](int i, int j) { return rest(i) < rest(j); });
  double widest = 0;
  for (std::size_t k = 1; k < order.size(); ++k)
    if (rest(order[k - 1]) == rest(order[k])) widest = std::max(widest, (body.positions().col(order[k - 1]) - body.positions().col(order[k])).norm());
  return widest;
}

bool show(SolidCut const& cut, Canvas const& canvas) {
  Block body = make_tissue();
  testing::SolidCutInvariants const before(body, {.min_height = 0.0199 * body.mean_edge()});
  int const tetrahedra = body.tissue().tetrahedra();
  std::string broken;
  auto checked = body.tissue().revision();
  auto const check = [&] {
    if (broken.empty() && body.tissue().revision() != checked) broken = testing::to_text(before.check(body));
    checked = body.tissue().revision();
  };
  double area = 0, lips = 0;
  for (Way const& way : cut.ways) {
    VolumeCutter<double> knife;
    for (int k = 0; k <= 60; ++k) {
      knife.advance(body, way(k / 60.0));
      check();
      move_on(body);
    }
    knife.lift(body);
    check();
    area += knife.report().area, lips += knife.report().lip_area;
    for (int k = 0; k < 60; ++k) move_on(body);
  }
  double const gap = widest_gap(body);
  auto pieces = pieces_of(body);
  std::sort(pieces.begin(), pieces.end(), [](auto const& a, auto const& b) { return a.size() > b.size(); });
  Mesh picture = drawn(body);
  for (std::size_t k = 1; k < pieces.size(); ++k)   // taken out, in the picture
    for (int const i : pieces[k]) picture.points.col(i) += cut.lift, picture.points.col(body.size() + i) += cut.lift;
  write_pictures(canvas, "solid_" + cut.name, picture, Vector(-0.5, -1.0, 1.1), true);
  std::printf("%-9s pieces %d  tetrahedra %+5d  area %5.2f cm2  both lips %5.2f cm2  gap %4.1f mm  invariants %s\n", cut.name.c_str(), static_cast<int>(pieces.size()),
              body.tissue().tetrahedra() - tetrahedra, 1e4 * area, 1e4 * lips, 1e3 * gap, broken.empty() ? "hold" : "BROKEN");
  std::fflush(stdout);
  if (!broken.empty()) std::fprintf(stderr, "cutting: %s: %s", cut.name.c_str(), broken.c_str());
  return broken.empty();
}

}  // namespace

bool show_solid_cuts(Canvas const& canvas) {
  bool good = true;
  for (SolidCut const& cut : solid_cuts()) good = show(cut, canvas) && good;
  return good;
}

}  // namespace cutting
