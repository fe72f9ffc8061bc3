// SPDX-License-Identifier: MIT
// A particle that rests elsewhere. Yardstick: a tissue built on the moved mesh, spring by spring, and the sums before.
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/supported.hpp>

#include "catch.hpp"

using namespace palpate;

static_assert(SeparableTissue<MassSpring<float>> && SeparableTissue<Supported<MassSpring<double>>>);

TEMPLATE_TEST_CASE("a moved particle's links rest at the lengths of the new shape; nothing else changes", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto mesh = make_sphere<S>(S(0.05), 3);
  S const prestrain = GENERATE(S(0), S(0.1));
  typename MassSpring<S>::Options const options{.mass = {.total = S(0.2), .lumping = Lumping::equal},
                                                .link = {.stiffness = S(60), .damping = S(0.05)},
                                                .home = {.stiffness = S(4), .damping = S(0.02)},
                                                .link_prestrain = prestrain};
  MassSpring<S> tissue(mesh, options);
  std::size_t const revision = tissue.revision();
  Vector3<S> const there = mesh.points.col(7) + Vector3<S>(S(0.002), S(-0.001), S(0.0005));
  tissue.move_rest(7, there);
  CHECK(tissue.revision() != revision);
  mesh.points.col(7) = there;
  MassSpring<S> const built(mesh, options);
  REQUIRE(tissue.links().size() == built.links().size());
  for (int l = 0; l < built.links().size(); ++l) {
    int const found = tissue.links().find(built.links()[l].a, built.links()[l].b);
    REQUIRE(found >= 0);
    CHECK(tissue.links()[found].rest_length == built.links()[l].rest_length);
    CHECK(tissue.links()[found].weight == S(1));
  }
  for (int i = 0; i < built.size(); ++i) {
    CHECK(tissue.rest_position(i) == built.rest_position(i));
    CHECK(tissue.mass(i) == built.mass(i));
    CHECK(tissue.home(i).stiffness == built.home(i).stiffness);
  }
  for (int t = 0; t < built.surface().triangle_count(); ++t) CHECK(tissue.triangle_area(t) == built.triangle_area(t));
  if (prestrain == 0) CHECK(tissue.internal_force(7, mesh.points, Matrix3X<S>::Zero(3, tissue.size())).norm() < S(1e-4));
}

TEST_CASE("a support spring follows a particle that rests elsewhere") {
  auto const mesh = make_sphere<double>(0.05, 3);
  Supported tissue(MassSpring<double>(mesh, {}), LinearSpring<double>{.stiffness = 20.0, .damping = 0.1}, Vector3<double>::Zero());
  tissue.move_rest(3, 0.9 * mesh.points.col(3));
  CHECK(tissue.support_length(3) == Approx(0.045));
}
