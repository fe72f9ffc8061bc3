// SPDX-License-Identifier: MIT
// A thigh of springs in two layers under a probe: linear in the skin, f = δ/(aδ + b) inside, on tetrahedra that fill a surface, round a nailed bone.
//   1  a generated indentation, 1 % of noise on each force, and its coefficients found again by least squares
//   2  the volume that springs of three laws, supports and an incompressible solid lose under a pad, all with 5 N on it at 12 mm. Forces are in proportion
//      to stiffnesses and largest tensions together, so one press says how much of them that takes.
#include "../album.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/core/random.hpp>
#include <palpate/fitting/fit_stiffness.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/models.hpp>
#include <palpate/statics/newton_raphson.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/saturating_spring.hpp>
#include <palpate/tissue/supported.hpp>
#include <palpate/volume/embedded_surface.hpp>
#include <palpate/volume/fill.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <span>
#include <utility>
#include <vector>

namespace {

using namespace palpate;
using Vector = Vector3<double>;

constexpr MassOptions<double> mass{.total = 4.0};   // kg

void find_again(drawing::Picture& chart) {
  using namespace drawing;
  auto const mesh = fill(make_thigh<double>(), {.edge = 0.035}).mesh;
  auto const bone = thigh_bone(mesh);
  auto const build = [&](std::span<double const> values) {
    auto tissue = two_layers(mesh, LinearSpring<double>{.stiffness = values[0]}, LockingSpring<double>{.stiffness = values[1], .largest_tension = values[2]},
                             {.mass = mass});
    tissue.nail(bone);
    return tissue;
  };
  constexpr double deepest = 0.025;
  constexpr int count = 24;
  auto const curve = [&](std::span<double const> values) {
    SoftBody body(build(values));
    int const touched = body.nearest_vertex({0, 0.08, 0});
    Vector const out = body.reference_normal(touched);
    std::vector<IndentationPoint> points;
    for (int k = 1; k <= count; ++k) {
      double const depth = deepest * k / count;
      body.drag(touched, body.reference_position(touched) - depth * out);
      body.solve_statics(NewtonRaphson{}, 1e-6);
      points.push_back({depth, -body.reaction(touched).dot(out)});
    }
    return std::pair(touched, points);
  };
  std::vector<double> const truth{200.0, 80.0, 1.6};
  auto const [touched, exact] = curve(truth);
  auto measured = exact;
  Random random(Seed{7});
  for (IndentationPoint& point : measured) point.force *= 1 + 0.01 * random.normal<double>(), point.deviation = point.force;
  auto const fit = fit_stiffness(build, {{"skin k", "N/m", 100}, {"inside k = 1/b", "N/m", 100}, {"inside T_max = 1/a", "N", 1}},
                                 IndentationTest<double>{.particle = touched}, measured);
  std::printf("%-20s %8s %8s %8s %8s\n", "coefficient", "true", "found", "from", "to");
  std::vector<double> found;
  for (std::size_t k = 0; k < truth.size(); ++k) {
    auto const& one = fit.coefficients[k];
    std::printf("%-20s %8.3f %8.3f %8.3f %8.3f\n", one.name.c_str(), truth[k], one.value, one.low, one.high);
    found.push_back(one.value);
  }
  std::printf("residual %.4f N rms, 95 %% confidence, %d measurements to %.0f mm\n\n", fit.rms, count, 1e3 * deepest);

  auto &line = chart.line(blue, "two layers, found again"), &linear = chart.dashes(green, "all springs linear, the same at rest");
  auto& dots = chart.dots(orange, "generated, 1 % noise");
  add(line, 0, 0), add(linear, 0, 0);
  for (auto const& point : curve(found).second) add(line, 1e3 * point.depth, point.force);
  for (auto const& point : curve(std::vector{found[0], found[1], 1e4}).second) add(linear, 1e3 * point.depth, point.force);
  for (auto const& point : measured) add(dots, 1e3 * point.depth, point.force);
}

/// A thigh of 2,232 tetrahedra under a pad of five vertices, some 5 cm across.
struct Press {
  TetrahedralMesh<double> mesh = fill(make_thigh<double>(), {.edge = 0.03}).mesh;
  TriangleMesh<double> skin = surface(mesh);
  std::vector<int> bone = thigh_bone(mesh), pad;
  static constexpr double step = 0.002, depth = 0.012, deepest = 0.016;

  Press() {
    std::vector<char> on_skin(static_cast<std::size_t>(mesh.points.cols()), 0);
    for (int const v : skin.triangles.reshaped()) on_skin[static_cast<std::size_t>(v)] = 1;
    for (int const i : vertices_where(mesh, [](auto const& p) { return p.y() > 0 && std::hypot(p.x(), p.z()) < 0.026; }))
      if (on_skin[static_cast<std::size_t>(i)]) pad.push_back(i);
  }

  double lost(Matrix3X<double> const& positions) const { return volume(skin) - volume(TriangleMesh<double>{positions, skin.triangles}); }

  struct Pressed {
    std::vector<double> depth, force, lost;   // m, N, m³
    Matrix3X<double> positions;               // at the last
  };
  template <class Tissue>
  Pressed press(Tissue tissue, double to) const {
    tissue.nail(bone);
    SoftBody body(std::move(tissue));
    Pressed found;
    for (double d = step; d < to + step / 2; d += step) {
      for (int const i : pad) body.drag(i, mesh.points.col(i) - Vector(0, d, 0));
      body.solve_statics(NewtonRaphson{}, 1e-5);
      double force = 0;
      for (int const i : pad) force -= body.reaction(i).y();
      found.depth.push_back(d), found.force.push_back(force), found.lost.push_back(lost(body.positions()));
    }
    found.positions = body.positions();
    return found;
  }
};

/// The fine skin as the tetrahedra carry it, and a probe where the pad is.
TriangleMesh<double> under_probe(Press const& thigh, Matrix3X<double> const& positions) {
  EmbeddedSurface skin(make_thigh<double>({.vertices = 4000}), thigh.mesh);
  skin.update(positions);
  auto const shown = skin.mesh();
  auto probe = make_sphere(1.0, 12);
  double top = -1;
  for (int const i : thigh.pad) top = std::max(top, positions(1, i));
  Vector const radii(0.022, 0.040, 0.022), middle(0, top + radii.y(), 0);
  probe.points = (radii.asDiagonal() * probe.points).colwise() + middle;
  TriangleMesh<double> both;
  auto const vertices = shown.points.cols(), triangles = shown.triangles.cols();
  both.points.resize(3, vertices + probe.points.cols()), both.triangles.resize(3, triangles + probe.triangles.cols());
  both.points << shown.points, probe.points;
  both.triangles << shown.triangles, (probe.triangles.array() + static_cast<int>(vertices)).matrix();
  return both;
}

drawing::Album thigh_example() {
  using namespace drawing;
  Picture force("thigh_force", "A vertex of a thigh pressed: coefficients found by least squares", "depth [mm]", "force [N]");
  find_again(force);

  Press const thigh;
  constexpr double wanted = 5.0, k = 100.0, reach = 0.010;   // N, N/m, m
  Picture lost("thigh_volume", "Volume that a thigh loses under a pad, 5 N at 12 mm each", "depth [mm]", "volume lost [ml]");
  Album album;
  auto const at = static_cast<std::size_t>(std::lround(Press::depth / Press::step)) - 1;
  std::printf("%-20s %10s %10s %12s\n", "model", "scale", "force [N]", "lost [ml]");
  auto const show = [&](char const* name, PlotSeries& series, auto const& build) {
    double const scale = wanted / thigh.press(build(1.0), Press::depth).force[at];
    auto const found = thigh.press(build(scale), Press::deepest);
    std::printf("%-20s %10.4f %10.4f %12.3f\n", name, scale, found.force[at], 1e6 * found.lost[at]);
    add(series, 0, 0);
    for (std::size_t n = 0; n < found.depth.size(); ++n) add(series, 1e3 * found.depth[n], 1e6 * found.lost[n]);
    return found;
  };
  auto const linear = [&](double s) { return MassSpring<double>(thigh.mesh, {.mass = mass, .link = {.stiffness = s * k}}); };
  auto const locking = [&](double s) { return LockingSpring<double>{.stiffness = s * k, .largest_tension = s * k * reach}; };
  show("linear", lost.line(blue, "linear springs"), linear);
  show("saturating", lost.dots(orange, "saturating springs"), [&](double s) {
    return MassSpring<double, SaturatingSpring<double>>(thigh.mesh, {.mass = mass, .link = {.stiffness = s * k, .largest_tension = s * k * reach}});
  });
  show("locking", lost.line(green, "locking springs"),
       [&](double s) { return MassSpring<double, LockingSpring<double>>(thigh.mesh, {.mass = mass, .link = locking(s)}); });
  auto const pressed = show("two layers", lost.dashes(pink, "two layers"), [&](double s) {
    return two_layers(thigh.mesh, LinearSpring<double>{.stiffness = 2 * s * k}, locking(s), {.mass = mass});
  });
  show("linear, supported", lost.line(sky, "linear springs and supports"),
       [&](double s) { return Supported(linear(s), LinearSpring<double>{.stiffness = s * k}); });
  show("solid", lost.line(black, "incompressible solid"), [&](double s) {
    return FiniteElements<double, StableNeoHookean<double>>(
        thigh.mesh, {.density = 1000.0, .material = {.young = s * 5000.0, .poisson = 0.495}, .pressure = Pressure::nodal});
  });
  auto& yardstick = lost.dashes(yellow, "under the pad, if nothing bulges");
  for (double d = 0; d < Press::deepest + Press::step / 2; d += Press::step) {
    Matrix3X<double> alone = thigh.mesh.points;
    for (int const i : thigh.pad) alone(1, i) -= d;
    add(yardstick, 1e3 * d, 1e6 * thigh.lost(alone));
    if (std::abs(d - Press::depth) < 1e-9)
      std::printf("under the pad, if nothing bulges %.3f ml of %.0f ml\n", 1e6 * thigh.lost(alone), 1e6 * volume(thigh.skin));
  }
  album.views.push_back({.name = "thigh_pressed", .mesh = under_probe(thigh, pressed.positions), .from = Vector(1.0, 0.45, 0.25)});
  album.charts = {force, lost};
  return album;
}

}  // namespace

int main(int argc, char** argv) { return drawing::run_example("thigh", argc, argv, thigh_example); }
