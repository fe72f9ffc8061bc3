// SPDX-License-Identifier: MIT
// The stable step after strokes over meshes as they come from elsewhere: five families, none of them even, all with springs of one stiffness. Yardstick:
// a mesh refined evenly to n particles, whose largest κ and γ grow by n/n₀, so that the step falls by √(n₀/n) where stiffness bounds it and by n₀/n
// where damping does.
#include "drawn_strokes.hpp"
#include "stroke_case.hpp"

#include "catch.hpp"

#include <palpate/core/random.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <string>

using namespace palpate;

namespace {

TriangleMesh<double> closed_grid(int columns, int rows) {
  TriangleMesh<double> mesh;
  mesh.points.resize(3, columns * rows);
  mesh.triangles.resize(3, 2 * columns * rows);
  for (int i = 0; i < columns; ++i)
    for (int j = 0; j < rows; ++j) {
      int const a = i * rows + j, b = (i + 1) % columns * rows + j, c = (i + 1) % columns * rows + (j + 1) % rows, d = i * rows + (j + 1) % rows;
      mesh.triangles.col(2 * a) << a, b, c;
      mesh.triangles.col(2 * a + 1) << a, c, d;
    }
  return mesh;
}

/// A torus whose rings are four times as dense on one side as on the other, and so are the points of each ring.
TriangleMesh<double> uneven_torus() {
  int const columns = 40, rows = 20;
  auto mesh = closed_grid(columns, rows);
  auto const angle = [](int i, int count) {
    double const even = 2 * std::numbers::pi * i / count;
    return even + 0.6 * std::sin(even);
  };
  for (int i = 0; i < columns; ++i)
    for (int j = 0; j < rows; ++j) {
      double const u = angle(i, columns), v = angle(j, rows), r = 0.06 + 0.025 * std::cos(v);
      mesh.points.col(i * rows + j) << r * std::cos(u), r * std::sin(u), 0.025 * std::sin(v);
    }
  return mesh;
}

/// An ellipsoid of meridians and parallels: needles at the poles.
TriangleMesh<double> meridians() {
  int const around = 32, down = 24, pole = around * (down - 1);
  TriangleMesh<double> mesh;
  mesh.points.resize(3, pole + 2);
  mesh.triangles.resize(3, 2 * pole);
  for (int j = 1; j < down; ++j)
    for (int i = 0; i < around; ++i) {
      double const polar = std::numbers::pi * j / down, u = 2 * std::numbers::pi * i / around;
      mesh.points.col((j - 1) * around + i) << 0.05 * std::sin(polar) * std::cos(u), 0.05 * std::sin(polar) * std::sin(u), 0.03 * std::cos(polar);
    }
  mesh.points.col(pole) << 0, 0, 0.03;
  mesh.points.col(pole + 1) << 0, 0, -0.03;
  Eigen::Index t = 0;
  for (int i = 0; i < around; ++i) {
    int const next = (i + 1) % around, last = (down - 2) * around;
    mesh.triangles.col(t++) << pole, i, next;
    mesh.triangles.col(t++) << pole + 1, last + next, last + i;
    for (int a = i, c = next; a < last; a += around, c += around) {
      mesh.triangles.col(t++) << a, a + around, c + around;
      mesh.triangles.col(t++) << a, c + around, c;
    }
  }
  return mesh;
}

/// A sheet whose vertices lie up to a third of an edge off their places.
TriangleMesh<double> shaken_sheet() {
  int const side = 28;
  auto mesh = make_grid<double>(side, side, 0.01);
  Random random(Seed{7});
  for (int i = 0; i < side * side; ++i) {
    if (int const x = i % side; x > 0 && x < side - 1) mesh.points(0, i) += random.uniform(-0.0035, 0.0035);
    if (int const y = i / side; y > 0 && y < side - 1) mesh.points(1, i) += random.uniform(-0.0035, 0.0035);
  }
  return mesh;
}

TriangleMesh<double> family(std::string const& name) {
  if (name == "uneven torus") return uneven_torus();
  if (name == "meridians") return meridians();
  if (name == "shaken sheet") return shaken_sheet();
  if (name == "thin tube") return make_open_tube<double>(12, 60, 0.02, 0.6);
  return make_uneven_sheet<double>(12, 12);   // edges 1 : 86
}

/// With so many seeds each is cut: PALPATE_ORGANS, or three.
std::uint64_t seeds() {
  char const* const asked = std::getenv("PALPATE_ORGANS");
  return asked != nullptr ? std::stoul(asked) : 3;
}

}  // namespace

TEST_CASE("strokes over uneven meshes leave a third of the stable step that refinement would, squared where damping bounds it") {
  std::string const name = GENERATE(as<std::string>{}, "uneven torus", "meridians", "shaken sheet", "thin tube", "growing sheet");
  auto const mesh = family(name);
  double const edge = mean_edge_length(mesh);
  double least = 1e3, least_damped = 1e3;   // of what is promised
  for (std::uint64_t seed = 1; seed <= seeds(); ++seed) {
    CAPTURE(name, seed);
    SoftBody body(make_tissue(mesh), LeapfrogVerlet{}, WholeBody{});
    testing::CutInvariants const before(body);
    auto const uncut = body.modal_bounds();
    int const particles = body.size();
    Random random(Seed{seed});
    for (int k = 0; k < 40; ++k) {
      ProgressiveCutter<double> scalpel({.puncture_depth = 0.2 * edge});
      double const tick = random.uniform(0.04, 1.6) * edge;
      for (auto const& tip : stroke_along<double>(mesh, random, edge, 30 * tick / edge, tick)) scalpel.advance(body, tip);
    }
    REQUIRE(testing::to_text(before.check(body)) == "");
    CHECK(body.size() > 1.5 * particles);
    auto const cut = body.modal_bounds();
    double const refined = static_cast<double>(body.size()) / particles;
    least = std::min(least, 3 * std::sqrt(refined * uncut.squared_frequency / cut.squared_frequency));
    least_damped = std::min(least_damped, 9 * refined * uncut.decay_rate / cut.decay_rate);
  }
  UNSCOPED_INFO(name << ": the stable step is at least " << least << " times what is promised, " << least_damped << " times where damping bounds it");
  CHECK(least >= 1);
  CHECK(least_damped >= 1);
}
