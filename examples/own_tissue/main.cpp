// SPDX-License-Identifier: MIT
// Tissue of elements of one's own, in a zone, in statics and in large implicit steps, beside the closed forms of what it should do.
#include "own_elements.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/statics/newton_raphson.hpp>
#include <palpate/testing/element.hpp>
#include <palpate/testing/tissue.hpp>
#include <palpate/tissue/element_tissue.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

namespace {

using namespace palpate;

bool all_as_expected = true;

void compare(char const* what, double found, double expected, double tolerance, char const* unit) {
  bool const good = std::abs(found - expected) <= tolerance * std::abs(expected);
  all_as_expected = all_as_expected && good;
  std::printf("%-52s %12.6g %s, closed form %12.6g%s\n", what, found, unit, expected, good ? "" : "   <- wrong");
}

void laws(char const* what, testing::Violations const& broken) {
  all_as_expected = all_as_expected && broken.empty();
  std::printf("%-52s %s\n", what, broken.empty() ? "kept" : testing::to_text(broken).c_str());
}

auto home_tissue() {
  auto const mesh = make_grid<double>(9, 9, 0.01);
  return ElementTissue(mesh, {.total = 8.1, .lumping = Lumping::equal}, make_elements(mesh.points, [](auto const& rest) { return OwnHome{rest, 10.0, 0.2}; }));
}

/// A sheet of 80 × 60 mm, 1 mm thick, E = 3 kPa, ν = 0.3.
auto sheet() {
  auto const mesh = make_grid<double>(9, 7, 0.01);
  return ElementTissue(mesh, {.total = 0.01}, make_elements(mesh.points, mesh.triangles, [](auto const& rest) { return OwnMembrane(rest, 3000.0, 0.3, 0.001); }));
}

/// Drags the border to (λ X, κ Y).
template <class Body>
void stretch(Body& body, double along, double across) {
  for (int const i : boundary_vertices(body.rest_mesh())) {
    Vector3<double> const rest = body.tissue().rest_position(i);
    body.drag(i, {along * rest.x(), across * rest.y(), 0.0});
  }
}

/// The sum of what holds the side X = 0 [N], and the largest way from (λ X, κ Y) [m].
template <class Body>
void look(char const* how, Body const& body, double along, double across, double expected) {
  double pull = 0, worst = 0;
  for (int i = 0; i < body.size(); ++i) {
    Vector3<double> const rest = body.tissue().rest_position(i);
    if (rest.x() == 0) pull -= body.reaction(i).x();
    worst = std::max(worst, (body.positions().col(i) - Vector3<double>(along * rest.x(), across * rest.y(), 0.0)).norm());
  }
  compare(how, pull, expected, 1e-5, "N");
  if (!(worst < 1e-7)) {
    all_as_expected = false;
    std::printf("a point inside is %g m from where an affine stretch puts it   <- wrong\n", worst);
  }
}

}  // namespace

int main() try {
  laws("laws of the home spring", testing::check_element<double>(OwnHome{{0.01, 0.0, 0.02}, 10.0, 0.2}, {0.01, 0.0, 0.02}, {.reach = 0.005, .isolated = false}));
  NodeColumns<double, 3> corners;
  corners << 0.0, 0.01, 0.002, 0.0, 0.001, 0.009, 0.0, 0.002, -0.001;
  laws("laws of the membrane", testing::check_element<double>(OwnMembrane(corners, 3000.0, 0.3, 0.001), corners));
  laws("laws of tissue of home springs", testing::check_tissue(home_tissue()));
  laws("laws of tissue of membrane", testing::check_tissue(sheet(), {.isolated = true}));

  // A zone: 0.1 x″ + 0.2 x′ + 10 x = F from rest.
  SoftBody beads(home_tissue(), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 1});
  int moving = 0;
  for (int k = 0; k < 1000; ++k) {
    beads.apply_force(40, {0.0, 0.0, -0.02});
    moving = beads.step(1e-3).moving;
  }
  double const w = std::sqrt(99.0);
  compare("home springs, a push for 1 s, in a zone", beads.displacement(40).z(), -0.002 * (1 - std::exp(-1.0) * (std::cos(w) + std::sin(w) / w)), 1e-4, "m");
  compare("  particles that moved", moving, 7, 0, " ");   // the one that is pushed, and its neighbours on the grid

  // An affine stretch: P = λ E/(1 − ν²) (E_xx + ν E_yy) on the side X = 0, 60 mm wide and 1 mm thick.
  double const along = 1.2, across = 1.1, e_xx = (along * along - 1) / 2, e_yy = (across * across - 1) / 2;
  double const expected = along * 3000.0 / (1 - 0.09) * (e_xx + 0.3 * e_yy) * 0.06 * 0.001;
  SoftBody still(sheet(), LeapfrogVerlet{}, WholeBody{});
  stretch(still, along, across);
  still.solve_statics(NewtonRaphson<>{}, 1e-9);
  look("membrane stretched by 1.2 and 1.1, statics", still, along, across, expected);

  SoftBody implicit(sheet(), BackwardEuler{}, WholeBody{});
  stretch(implicit, along, across);
  for (int k = 0; k < 300; ++k) implicit.step(0.01);
  look("  and after 3 s of BackwardEuler in steps of 10 ms", implicit, along, across, expected);

  std::printf(all_as_expected ? "all as expected\n" : "not as expected\n");
  return all_as_expected ? EXIT_SUCCESS : EXIT_FAILURE;
} catch (palpate::Error const& error) {
  std::printf("own_tissue: %s\n", error.what());
  return EXIT_FAILURE;
}
