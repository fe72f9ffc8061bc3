// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/validation.hpp>
#include <palpate/tool/built_in_shapes.hpp>

#include <cmath>
#include <limits>
#include <numbers>

using namespace palpate;

TEMPLATE_TEST_CASE("The picture of a rod is closed, looks outwards and has the volume of its prism and pyramids", "[tool][tool_shape]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Capsule<S> const rod{{S(0.01), S(-0.02), S(0.03)}, {S(0.05), S(0.03), S(-0.01)}, S(0.004)};
  int const sides = 7;
  auto const mesh = rod_picture(rod, sides);
  CHECK_NOTHROW(validate(mesh, {.closed = true}));
  double const polygon = sides / 2.0 * 0.004 * 0.004 * std::sin(2 * std::numbers::pi / sides), length = std::sqrt(0.04 * 0.04 + 0.05 * 0.05 + 0.04 * 0.04);
  CHECK(static_cast<double>(volume(mesh)) == Approx(polygon * (length + 2 * 0.004 / 3)).epsilon(1e-4));
  CHECK(rod_picture(Capsule<S>{}, 5).triangles.cols() == 20);   // a point without a size is still drawn
  CHECK_THROWS_WITH(rod_picture(rod, 2), says("2 sides", "at least 3"));
}

TEMPLATE_TEST_CASE("Built-in shapes are valid, and their rods lie where they say", "[tool][tool_shape]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const near = [](Vector3<S> const& a, Vector3<double> const& b) { return (a.template cast<double>() - b).norm() < 1e-7; };
  auto const probe = make_probe_shape<S>({.radius = 0.003, .length = 0.2});
  CHECK(near(probe.rods.at(0).rod.to, {0, 0, 0.2}));
  auto const hook = make_hook_shape<S>({.point = 0.01, .shaft = 0.1, .bend = std::numbers::pi / 2});
  REQUIRE(hook.rods.size() == 2);
  CHECK((near(hook.rods[0].rod.from, {0, 0, 0}) && near(hook.rods[0].rod.to, {0, 0, 0.01}) && near(hook.rods[1].rod.to, {0, 0.1, 0.01})));
  auto const scalpel = make_scalpel_shape<S>({.edge = 0.02, .angle = std::numbers::pi / 6});
  CHECK((scalpel.rods.at(0).use == RodUse::cutting && scalpel.rods.at(1).use == RodUse::deforming));
  CHECK(near(scalpel.rods[0].rod.to, {0.02 * std::sqrt(0.75), 0, 0.01}));
  auto const forceps = make_forceps_shape<S>({.opening = 0.012, .jaw = 0.01});
  CHECK((near(forceps.rods.at(0).rod.from, {-0.006, 0, 0}) && near(forceps.rods.at(1).rod.from, {0.006, 0, 0}) && near(forceps.rods[1].rod.to, {0, 0, 0.008})));
  CHECK((near(forceps.rods[0].at(1).from, {-0.006, 0, 0}) && near(forceps.rods[1].at(0.5).from, {0.0035, 0, 0})));
  CHECK((near(forceps.rods[0].at(0).from, {-0.001, 0, 0}) && near(forceps.rods[1].at(0).from, {0.001, 0, 0}) && near(forceps.rods[1].at(0).to, {0, 0, 0.008})));   // they touch
  for (auto const* shape : {&probe, &hook, &scalpel, &forceps}) {
    CHECK_NOTHROW(shape->validate());
    CHECK(shape->picture.triangles.cols() == 48 * static_cast<Eigen::Index>(shape->rods.size()));
    CHECK(volume(shape->picture) > 0);
  }
}

TEST_CASE("A shape says what is wrong with it", "[tool][tool_shape]") {
  double const nan = std::numeric_limits<double>::quiet_NaN();
  ToolShape<double> shape;
  CHECK_THROWS_WITH(shape.validate(), says("there is no rod", "at least one"));
  shape.rods = {{.rod = {.to = {0, 0, 1}, .radius = 0.1}}, {.rod = {.to = {0, 1, 1}}, .use = RodUse::cutting}};
  CHECK_NOTHROW(shape.validate());
  auto const with = [&](auto change) {
    ToolShape<double> changed = shape;
    change(changed);
    changed.validate();
  };
  CHECK_THROWS_WITH(with([&](auto& s) { s.rods[1].rod.to.y() = nan; }), says("an end of rod 1 is not finite"));
  CHECK_THROWS_WITH(with([&](auto& s) { s.rods[0].rod.radius = -1; }), says("radius of rod 0 is -1 m", "not negative"));
  CHECK_THROWS_WITH(with([&](auto& s) { s.rods[1].use = RodUse::deforming; }), says("rod 1 deforms", "radius is 0"));
  CHECK_THROWS_WITH(with([&](auto& s) { s.haptic_point = HapticPoint::chosen, s.chosen = 2; }), says("rod 2", "there are 2"));
  CHECK_THROWS_WITH(with([&](auto& s) { s.haptic_point = HapticPoint::chosen, s.chosen = 1; }), says("rod 1", "which cuts"));
  CHECK_THROWS_WITH(with([&](auto& s) { s.picture.points.setZero(3, 3), s.picture.triangles.setConstant(3, 1, 3); }),
                    says("triangle 0", "corner 3", "3 points"));
  CHECK_THROWS_WITH(with([&](auto& s) { s.picture.points.setConstant(3, 1, nan); }), says("point of the picture is not finite"));
  CHECK_THROWS_WITH(make_probe_shape<double>({.radius = 0}), says(".radius is 0 m", "positive"));
  CHECK_THROWS_WITH(make_probe_shape<double>({.length = 100}), says("rod 0 is 100 m", "in cm it would be 1 m, in mm it would be 0.1 m", "long; give its ends in m"));
  CHECK_THROWS_WITH(make_probe_shape<double>({.radius = 2}), says("radius of rod 0 is 2 m", "in mm it would be 0.002 m", "give it in m"));
  shape = make_forceps_shape<double>();
  shape.rods[1].closing[0].x() = nan;
  CHECK_THROWS_WITH(shape.validate(), says("an end of rod 1 is not finite"));
  CHECK_THROWS_WITH(make_hook_shape<double>({.bend = 4}), says(".bend is 4 rad", "below pi"));
  CHECK_THROWS_WITH(make_scalpel_shape<double>({.angle = 0}), says(".angle is 0 rad"));
  CHECK_THROWS_WITH(make_forceps_shape<double>({.opening = 0.05, .jaw = 0.02}), says(".opening is 0.05 m", "0.02"));
}
