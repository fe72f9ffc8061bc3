// SPDX-License-Identifier: MIT
// What many strokes leave of a body. Yardsticks: a mesh refined evenly to n particles, whose stable step falls by √(n₀/n); sums taken by hand before
// and after.
#include "drawn_strokes.hpp"

#include "catch.hpp"

#include <palpate/core/random.hpp>
#include <palpate/mesh/components.hpp>
#include <palpate/mesh/measures.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <numbers>
#include <string>
#include <vector>

using namespace palpate;

namespace {

struct Shape {
  double smallest_angle = 180;   // degrees
  double largest_aspect = 0;     // longest side over the height on it
};

template <class Body>
Shape shape_of(Body const& body) {
  Shape shape;
  auto const mesh = body.rest_mesh();
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t)
    for (int k = 0; k < 3; ++k) {
      Vector3<double> const corner = mesh.points.col(mesh.triangles(k, t));
      Vector3<double> const a = mesh.points.col(mesh.triangles((k + 1) % 3, t)) - corner, b = mesh.points.col(mesh.triangles((k + 2) % 3, t)) - corner;
      double const twice_area = a.cross(b).norm();
      shape.smallest_angle = std::min(shape.smallest_angle, std::atan2(twice_area, a.dot(b)) * 180 / std::numbers::pi);
      shape.largest_aspect = std::max(shape.largest_aspect, a.squaredNorm() / twice_area);
    }
  return shape;
}

/// So many organs are cut: PALPATE_ORGANS, or two.
std::uint64_t organs_to_cut() {
  char const* const asked = std::getenv("PALPATE_ORGANS");
  return asked != nullptr ? std::stoul(asked) : 2;
}

}  // namespace

TEST_CASE("strokes across each other leave a third of the stable step that an even mesh would have") {
  auto const mesh = make_organ<double>({.vertices = 1002});
  double const edge = mean_edge_length(mesh);
  int const strokes = 200;
  for (std::uint64_t seed = 1; seed <= organs_to_cut(); ++seed) {
    CAPTURE(seed);
    MassSpring<double> const tissue(mesh, {.mass = {.total = 0.1}, .link = {.stiffness = 60, .damping = 1e-4}, .home = {.stiffness = 4, .damping = 1e-4}});
    SoftBody body(tissue, LeapfrogVerlet{}, WholeBody{});
    testing::CutInvariants const before(body);
    double const uncut = body.stable_step();
    int const particles = body.size();
    REQUIRE(static_cast<int>(body.triangles().cols()) == 2000);
    Random random(Seed{seed});
    for (int k = 0; k < strokes; ++k) {
      ProgressiveCutter<double> scalpel({.puncture_depth = 0.2 * edge});
      for (auto const& tip : stroke_along<double>(mesh, random, edge, 10, 0.3 * edge)) scalpel.advance(body, tip);
    }
    REQUIRE(testing::to_text(before.check(body)) == "");
    CHECK(body.size() > particles + 15 * strokes);   // they go on across earlier wounds
    double const part = body.stable_step() / uncut, even = std::sqrt(static_cast<double>(particles) / body.size());
    Shape const shape = shape_of(body);
    UNSCOPED_INFO("seed " << seed << ": " << body.size() << " particles, stable step " << part << " of the uncut body's, of an even mesh " << even
                          << "; smallest angle " << shape.smallest_angle << " degrees, largest aspect " << shape.largest_aspect);
    CHECK(part >= even / 3);
    CHECK(shape.smallest_angle > 0.3);
    CHECK(shape.largest_aspect < 250);
  }
}

TEST_CASE("a light particle on stiff springs is given mass, and nothing is lost") {
  // A cut that passes vertices closely, on a sheet that moves: the sums are those before the tick.
  double const spacing = 0.01;
  auto const mesh = make_grid<double>(8, 8, spacing);
  MassSpring<double> const tissue(mesh, {.mass = {.total = 0.1}, .link = {.stiffness = 60, .damping = 0}, .home = {.stiffness = 4, .damping = 0}});
  SoftBody body(tissue, LeapfrogVerlet{}, WholeBody{});
  double rate = 0;
  for (int i = 0; i < body.size(); ++i) rate = std::max(rate, tissue.stiffness_bound(i) / tissue.mass(i));
  body.apply_force(27, {0.01, 0.02, 0.03});
  double const h = body.stable_step() / 20;
  for (int k = 0; k < 40; ++k) REQUIRE(body.step(h));
  struct Sums {
    double mass = 0, kinetic = 0;
    Vector3<double> moment = Vector3<double>::Zero(), momentum = Vector3<double>::Zero();
  };
  auto const sums = [&] {
    Sums s;
    for (int i = 0; i < body.size(); ++i) {
      double const m = body.tissue().mass(i);
      s.mass += m, s.moment += m * body.tissue().rest_position(i);
      s.momentum += m * body.velocities().col(i), s.kinetic += m / 2 * body.velocities().col(i).squaredNorm();
    }
    return s;
  };
  double const scale = [&] {
    double sum = 0;
    for (int i = 0; i < body.size(); ++i) sum += body.tissue().mass(i) * body.velocities().col(i).norm();
    return sum;
  }();
  ProgressiveCutter<double> scalpel({.puncture_depth = 0.001, .snap = 0.06 * spacing});
  double const x = 2.3 * spacing, y = 3.07 * spacing;
  Points<double> tips;
  for (double const z : {0.01, 0.005}) tips.push_back({x, y, z});
  for (int k = 0; k <= 60; ++k) tips.push_back({x + 0.05 * k * spacing, y, -0.004});
  tips.push_back({x + 3 * spacing, y, 0.02});
  Sums last = sums();
  for (auto const& tip : tips) {
    scalpel.advance(body, tip);
    Sums const now = sums();
    CHECK(std::abs(now.mass - last.mass) <= 1e-14 * last.mass);
    CHECK((now.moment - last.moment).norm() <= 1e-14 * last.mass);
    CHECK((now.momentum - last.momentum).norm() <= 1e-13 * scale);
    CHECK(now.kinetic <= last.kinetic * (1 + 1e-13));
    last = now;
  }
  REQUIRE(scalpel.report().particles_added > 8);
  double fastest = 0, fastest_by_area = 0;
  auto const rest = body.rest_mesh();
  std::vector<double> area(static_cast<std::size_t>(body.size()), 0.0);
  for (Eigen::Index t = 0; t < rest.triangles.cols(); ++t) {
    Vector3<double> const a = rest.points.col(rest.triangles(0, t)), b = rest.points.col(rest.triangles(1, t)), c = rest.points.col(rest.triangles(2, t));
    for (int k = 0; k < 3; ++k) area[static_cast<std::size_t>(rest.triangles(k, t))] += (b - a).cross(c - a).norm() / 6;
  }
  for (int i = 0; i < body.size(); ++i) {
    fastest = std::max(fastest, body.tissue().stiffness_bound(i) / body.tissue().mass(i));
    double const lumped = 0.1 * area[static_cast<std::size_t>(i)] / surface_area(rest);
    fastest_by_area = std::max(fastest_by_area, body.tissue().stiffness_bound(i) / lumped);
  }
  UNSCOPED_INFO("largest stiffness bound over mass, beside the uncut sheet's: " << fastest / rate << ", lumped by area " << fastest_by_area / rate);
  CHECK(fastest < 6 * rate);
  CHECK(fastest_by_area > 20 * rate);   // or there was nothing to even out
}

TEST_CASE("a nailed particle that is given mass stands still, and one in a hand moves as the hand does") {
  // Strokes over a sheet in motion, of which every fourth particle is nailed and every fourth held.
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    INFO("seed " << seed);
    Random random(Seed{seed});
    auto const in = [&](double low, double high) { return random.uniform(low, high); };
    MassSpring<double> tissue(make_grid<double>(9, 9, 0.01), {.mass = {.total = 0.1}, .link = {.stiffness = 50}, .home = {.stiffness = 5}});
    for (int i = 0; i < tissue.size(); i += 4) tissue.nail(i);
    SoftBody body(std::move(tissue), LeapfrogVerlet{});
    for (int i = 0; i < body.size(); ++i) {
      if (i % 4 == 0) continue;
      body.drag(i, body.positions().col(i), {in(-0.1, 0.1), in(-0.1, 0.1), in(-0.1, 0.1)});
      if (i % 4 > 1) body.release(i);
    }
    Matrix3X<double> const x = body.positions(), v = body.velocities();
    double const h = body.stable_step() / 10;
    for (int stroke = 0; stroke < 6; ++stroke) {
      ProgressiveCutter<double> scalpel({.puncture_depth = 0.002});
      Vector3<double> const from(in(0, 0.08), in(0, 0.08), -0.003), to(in(0, 0.08), in(0, 0.08), -0.003);
      scalpel.advance(body, Vector3<double>(from[0], from[1], 0.004));
      for (int tick = 0; tick <= 40; ++tick) {
        scalpel.advance(body, Vector3<double>(from + (to - from) * tick / 40.0));
        REQUIRE(body.step(h));
      }
      scalpel.advance(body, Vector3<double>(to[0], to[1], 0.004));
    }
    for (int i = 0; i < body.size(); ++i) {
      if (body.tissue().nailed(i)) CHECK(body.velocities().col(i) == Vector3<double>::Zero());
      if (body.is_held(i)) CHECK(body.velocities().col(i) == v.col(i));
      if (i < x.cols() && (body.tissue().nailed(i) || body.is_held(i))) CHECK(body.positions().col(i) == x.col(i));
    }
  }
}

TEST_CASE("a line drawn again and again frees next to nothing") {
  // A line has no area, so nothing should come free. Where the first way was snapped the later ones lie beside it: what comes free is small and rare.
  auto const mesh = make_organ<double>({.vertices = 500});
  double const edge = mean_edge_length(mesh);
  SoftBody const uncut(make_tissue(mesh), LeapfrogVerlet{}, WholeBody{});
  testing::CutInvariants const before(uncut);
  Random random(Seed{11});
  int freed = 0;
  double largest = 0;   // mean edges squared
  int const lines = 60;
  for (int k = 0; k < lines; ++k) {
    auto body = uncut;
    ProgressiveCutter<double> scalpel({.puncture_depth = 0.2 * edge});
    auto const once = stroke_along(mesh, random, edge, 7.0, 0.3 * edge);
    auto const on = once.begin() + 5, end = once.end() - 5;
    Points<double> tips(once.begin(), end);
    for (int times = 0; times < 3; ++times) {
      tips.insert(tips.end(), std::reverse_iterator(end), std::reverse_iterator(on));
      tips.insert(tips.end(), on, end);
    }
    tips.insert(tips.end(), end, once.end());
    for (auto const& tip : tips) scalpel.advance(body, tip);
    REQUIRE(testing::to_text(before.check(body)) == "");
    auto const rest = body.rest_mesh();
    auto pieces = connected_components(rest);
    std::sort(pieces.begin(), pieces.end(), [](auto const& a, auto const& b) { return a.size() > b.size(); });
    freed += static_cast<int>(pieces.size()) - 1;
    for (std::size_t p = 1; p < pieces.size(); ++p) {
      double area = 0;
      for (Eigen::Index t = 0; t < rest.triangles.cols(); ++t)
        if (std::find(pieces[p].begin(), pieces[p].end(), rest.triangles(0, t)) != pieces[p].end()) area += body.tissue().triangle_area(static_cast<int>(t));
      largest = std::max(largest, area / (edge * edge));
    }
  }
  CAPTURE(freed, largest);
  CHECK(freed < lines / 3);
  CHECK(largest < 0.2);
}
