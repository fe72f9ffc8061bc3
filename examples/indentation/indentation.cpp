// SPDX-License-Identifier: MIT
// What can one Young's modulus say of a measured indentation curve? The published curve of liver under a probe of 4 mm, loading, beside a hyperelastic block
// under a flat punch as wide, whose modulus is fitted to the first millimetres. Stress is proportional to E at a given nu, so force is: one run with
// E = 1 kPa, and least squares of one factor. Small presses have a closed form, F = 2 a E/(1 - nu²) d (Boussinesq's flat punch, a = 2 mm), on a half-space without
// friction; here the punch sticks and the block is 60 x 60 x 40 mm.
#include "../album.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/fitting/fit_stiffness.hpp>
#include <palpate/force/liver.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/statics/newton_raphson.hpp>
#include <palpate/tissue/finite_elements.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <span>
#include <utility>
#include <vector>

namespace {

using namespace palpate;

constexpr double radius = 0.002, poisson = 0.45, young = 1000.0;   // m, -, Pa
constexpr double step = 0.0005;                                    // m

/// Where line k of K lies, from 0 to `far`: 1 mm apart at the punch, by a constant factor wider from line to line.
double graded(double k, int K, double far) {
  constexpr double first = 0.001;
  double low = 1.0001, high = 3.0;
  for (int i = 0; i < 100; ++i) {
    double const q = (low + high) / 2;
    (first * (std::pow(q, K) - 1) / (q - 1) < far ? low : high) = q;
  }
  return first * (std::pow(low, k) - 1) / (low - 1);
}

/// The force [N] that holds the punch at each of these depths, in rising order, up to where the first tetrahedron turns over.
std::vector<double> forces(std::vector<double> const& depths) {
  constexpr int across = 14, down = 10;
  auto mesh = make_block<double>(across + 1, across + 1, down + 1, 1.0, BlockPattern::alternating);
  for (Eigen::Index i = 0; i < mesh.points.cols(); ++i) {
    Vector3<double> p = mesh.points.col(i);
    for (int axis = 0; axis < 2; ++axis) {
      double const from_middle = p[axis] - across / 2;
      p[axis] = (from_middle < 0 ? -1 : 1) * graded(std::abs(from_middle), across / 2, 0.03);
    }
    p.z() = -graded(down - p.z(), down, 0.04);
    mesh.points.col(i) = p;
  }
  auto const pad = vertices_where(mesh, [](auto const& p) { return p.z() > -1e-9 && std::hypot(p.x(), p.y()) < radius + 1e-6; });
  FiniteElements<double, StableNeoHookean<double>> tissue(mesh, {.density = 1060.0, .material = {young, poisson}});
  tissue.nail(vertices_where(mesh, [](auto const& p) { return p.z() < -0.04 + 1e-6; }));
  SoftBody body(std::move(tissue));
  std::vector<double> found;
  for (double const depth : depths) {
    for (int const i : pad) body.drag(i, mesh.points.col(i) - depth * Vector3<double>::UnitZ());
    body.solve_statics(NewtonRaphson{}, 1e-6);
    if (!(body.tissue().lowest_determinant(body.positions()).value > 0)) break;
    double force = 0;
    for (int const i : pad) force -= body.reaction(i).z();
    found.push_back(force);
  }
  return found;
}

drawing::Album indentation() {
  using namespace drawing;
  auto const liver = liver_loading<double>();
  auto const measured = [&](double depth) { return liver(depth) - liver(0.0); };   // the published curve is not zero at its beginning
  std::vector<double> depths;
  for (int k = 1; k <= 20; ++k) depths.push_back(k * step);
  auto const unit = forces(depths);   // at 1 kPa

  double const punch = 2 * radius * young / (1 - poisson * poisson);   // N/m
  std::printf("flat punch, first half millimetre: %.3f of the closed form\n", unit.front() / step / punch);

  // Least squares of one factor, over the first depths up to `to`.
  struct Fit {
    double modulus, rms, largest;   // Pa, N, N
  };
  auto const fit_to = [&](double to) {
    double product = 0, square = 0;
    std::size_t count = 0;
    for (; count < unit.size() && depths[count] <= to + 1e-9; ++count) product += unit[count] * measured(depths[count]), square += unit[count] * unit[count];
    Fit fit{young * product / square, 0, 0};
    for (std::size_t k = 0; k < count; ++k) {
      double const off = fit.modulus / young * unit[k] - measured(depths[k]);
      fit.rms += off * off / static_cast<double>(count);
      fit.largest = std::max(fit.largest, std::abs(off));
    }
    fit.rms = std::sqrt(fit.rms);
    return fit;
  };
  double const last = depths[unit.size() - 1];
  std::printf("all tetrahedra upright down to %.1f mm\n\n%10s %12s %14s %16s\n", 1e3 * last, "fit to", "E [Pa]", "rms [mN]", "largest [mN]");
  for (double const to : {0.002, 0.003, 0.004, last}) {
    Fit const fit = fit_to(to);
    std::printf("%7.1f mm %12.0f %14.3f %16.3f\n", 1e3 * to, fit.modulus, 1e3 * fit.rms, 1e3 * fit.largest);
  }
  Fit const whole = fit_to(last);
  std::printf("\n%10s %14s %12s %14s %22s\n", "depth", "measured [mN]", "solid [mN]", "residual [mN]", "E of this depth [Pa]");
  for (std::size_t k = 1; k < unit.size(); k += 2)
    std::printf("%7.1f mm %14.2f %12.2f %14.2f %22.0f\n", 1e3 * depths[k], 1e3 * measured(depths[k]), 1e3 * whole.modulus / young * unit[k],
                1e3 * (whole.modulus / young * unit[k] - measured(depths[k])), young * measured(depths[k]) / unit[k]);

  // The same by fit_stiffness, with its interval: there a single vertex stands for the probe, on a mesh as wide around it.
  auto const coarse = make_block<double>(11, 11, 7, 2 * radius, BlockPattern::alternating);
  auto const build = [&](std::span<double const> values) {
    FiniteElements<double, StableNeoHookean<double>> tissue(coarse, {.density = 1060.0, .material = {values[0], poisson}});
    tissue.nail(vertices_where(coarse, [](auto const& p) { return p.z() < 1e-9; }));
    return tissue;
  };
  std::vector<IndentationPoint> points;
  for (std::size_t k = 0; k < 8; ++k) points.push_back({depths[k], measured(depths[k])});
  IndentationTest<double> const middle{.point = Vector3<double>(10 * radius, 10 * radius, 12 * radius), .direction = -Vector3<double>::UnitZ()};
  auto const fitted = fit_stiffness(build, {{"young", "Pa", young}}, middle, points, StiffnessFitOptions<NewtonRaphson<>>{});
  std::printf("\nfit_stiffness to 4 mm: E %.0f Pa, 95 %% between %.0f and %.0f, rms %.3f mN\n", fitted["young"].value, fitted["young"].low, fitted["young"].high, 1e3 * fitted.rms);

  Picture curve("indentation_curve", "Liver under a probe of 4 mm, and a solid with one modulus", "depth [mm]", "force [mN]");
  sample(curve.line(blue, "measured"), 0.0, 0.012, 1e3, [&](double depth) { return 1e3 * measured(depth); });
  auto& solid = curve.dots(orange, "solid, fitted");
  for (std::size_t k = 0; k < unit.size(); ++k) add(solid, 1e3 * depths[k], 1e3 * whole.modulus / young * unit[k]);
  sample(curve.dashes(black, "flat punch, same modulus"), 0.0, 0.012, 1e3, [&](double depth) { return 1e3 * whole.modulus / young * punch * depth; });

  Picture modulus("indentation_modulus", "The modulus that each depth alone asks for", "depth [mm]", "Young's modulus [Pa]");
  auto& by_solid = modulus.dots(orange, "by the solid");
  for (std::size_t k = 0; k < unit.size(); ++k) add(by_solid, 1e3 * depths[k], young * measured(depths[k]) / unit[k]);
  sample(modulus.line(black, "by the flat punch"), 0.0005, 0.02, 1e3, [&](double depth) { return young * measured(depth) / (punch * depth); });
  return {.charts = {curve, modulus}, .views = {}};
}

}  // namespace

int main(int argc, char** argv) { return drawing::run_example("indentation", argc, argv, indentation); }
