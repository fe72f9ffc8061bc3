// SPDX-License-Identifier: MIT
// The thesis's estimate of the critical stiffness beside the sharp limit, on its two squares. Yardsticks: by hand, the dispersion relation of an endless
// sheet, and bodies that do or do not blow up.
#include <palpate/body/soft_body.hpp>
#include <palpate/body/stability.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include "catch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

using namespace palpate;

namespace {

constexpr double pi = std::numbers::pi;

auto square(int side, double link, double link_damping, double home, double home_damping) {
  auto const skin = make_grid<double>(side, side, 1.0);
  MassSpring<double> tissue(skin, {.mass = {.total = 1.0, .lumping = Lumping::equal},
                                   .link = {.stiffness = link, .damping = link_damping},
                                   .home = {.stiffness = home, .damping = home_damping}});
  tissue.nail(boundary_vertices(skin));
  return SoftBody(std::move(tissue), LeapfrogVerlet{}, WholeBody{});
}

/// The largest m ω²/k of plane waves in an endless sheet with links along x, y and the diagonal: 2 Σ (1 − cos q·d) n nᵀ over the three.
double fastest_wave() {
  double most = 0;
  for (int i = 0; i <= 400; ++i)
    for (int j = 0; j <= 400; ++j) {
      double const x = 2 * (1 - std::cos(pi * i / 200)), y = 2 * (1 - std::cos(pi * j / 200)), d = 1 - std::cos(pi * (i + j) / 200);
      double const mean = (x + y) / 2 + d, half = (x - y) / 2;   // of the matrix (x + d, d; d, y + d)
      most = std::max(most, mean + std::sqrt(half * half + d * d));
    }
  return most;
}

bool stays(auto body, double h) {
  for (int k = 0; k < 400; ++k) {
    if (k < 20) body.apply_force(body.size() / 2 + 5, {0.3, 0.1, -1.0});
    if (!body.step(h)) return false;
  }
  return (body.positions() - body.rest_mesh().points).cwiseAbs().maxCoeff() < 10.0;
}

}  // namespace

TEST_CASE("the estimate of the critical stiffness is m/(n π² h²)") {
  CHECK(critical_stiffness(1.0, 100, 1e-3) == Approx(1013.2118).epsilon(1e-7));
  CHECK(critical_stiffness(2.0, 400, 0.5) == Approx(2.0 / (400 * pi * pi * 0.25)).epsilon(1e-14));
  CHECK_THROWS_WITH(critical_stiffness(0.0, 100, 1e-3), says("0 kg", "positive"));
  CHECK_THROWS_WITH(critical_stiffness(1.0, 0, 1e-3), says("0 particles", "1 or more"));
  CHECK_THROWS_WITH(critical_stiffness(1.0, 100, std::nan("")), says("nan s", "positive"));
}

TEST_CASE("without dampers a sheet stands 5.7 times the estimate") {
  double const wave = fastest_wave();
  CHECK(4 * pi * pi / wave == Approx(5.7).epsilon(0).margin(0.1));
  for (int const side : {10, 20}) {
    auto body = square(side, 1.0, 0.0, 0.0, 0.0);
    double const h = body.stable_step(), sharp = 1.0 / critical_stiffness(1.0, side * side, h);   // at that step a link of 1 N/m is the stiffest
    CAPTURE(side, h);
    CHECK(sharp <= 4 * pi * pi / wave * 1.1);   // the squares' borders are nailed: their fastest mode is a bit slower than the sheet's
    CHECK(sharp >= 4 * pi * pi / wave / 1.06);   // and the answer 5 % on the safe side
  }
}

TEST_CASE("with the dampers of the thesis's squares the estimate allows steps that blow up") {
  struct Scene {
    int side;
    double link, link_damping, home, home_damping;
  };
  for (Scene const s : {Scene{10, 1.0, 1.0, 2.0, 1.0}, Scene{20, 2.0, 1.0, 1.0, 0.5}}) {
    auto body = square(s.side, s.link, s.link_damping, s.home, s.home_damping);
    double const estimated = std::sqrt(1.0 / (s.side * s.side * pi * pi * s.link)), sharp = body.stable_step();
    CAPTURE(s.side, estimated, sharp);
    CHECK(critical_stiffness(1.0, s.side * s.side, estimated) == Approx(s.link).epsilon(1e-12));
    CHECK(estimated / sharp > 15);
    CHECK(estimated / sharp < 40);
    CHECK(stays(body, 0.99 * sharp));
    CHECK_FALSE(stays(body, estimated / 4));
  }
}
