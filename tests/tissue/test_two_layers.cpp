// SPDX-License-Identifier: MIT
// Yardsticks: links of a block and of an octahedron counted by hand; the force on its middle by the formulas of both laws; the coefficients that an
// indentation was generated with; the volume under the pad, which a body loses that does not bulge, and a solid that keeps its volume.
#include "catch.hpp"
#include "device/message.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/core/random.hpp>
#include <palpate/fitting/fit_stiffness.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/validation.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/models.hpp>
#include <palpate/statics/newton_raphson.hpp>
#include <palpate/testing/spring_law.hpp>
#include <palpate/tissue/cubic_spring.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/saturating_spring.hpp>
#include <palpate/tissue/supported.hpp>
#include <palpate/volume/fill.hpp>

#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

using namespace palpate;
using namespace palpate_test;

namespace {

/// Six vertices on the axes, L from the seventh in the middle; eight tetrahedra.
template <class S>
TetrahedralMesh<S> octahedron(S l) {
  TetrahedralMesh<S> mesh;
  mesh.points.resize(3, 7);
  mesh.points << 0, l, -l, 0, 0, 0, 0, 0, 0, 0, l, -l, 0, 0, 0, 0, 0, 0, 0, l, -l;
  mesh.tetrahedra.resize(4, 8);
  for (int t = 0; t < 8; ++t) {
    int a = 1 + (t & 1), b = 3 + (t >> 1 & 1), c = 5 + (t >> 2);
    if ((a == 2) ^ (b == 4) ^ (c == 6)) std::swap(a, b);   // mirrored once or three times
    mesh.tetrahedra.col(t) << 0, a, b, c;
  }
  return mesh;
}

template <class Tissue>
int skin_links(Tissue const& tissue) {
  int count = 0;
  for (int l = 0; l < tissue.links().size(); ++l) count += tissue.links()[l].law.is_skin();
  return count;
}

}  // namespace

TEMPLATE_TEST_CASE("two layers: which links are skin, counted by hand", "[tissue][two_layers]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  LinearSpring<S> const skin{.stiffness = S(200), .damping = S(0.3)};
  LockingSpring<S> const inside{.stiffness = S(80), .largest_tension = S(2), .damping = S(0.1)};
  auto const tissue = two_layers(make_block<S>(3, 3, 3, S(0.01)), skin, inside, {.mass = {.total = S(0.2)}});
  // Eight cubes of six tetrahedra: 54 edges along the axes, 36 diagonals of squares, 8 of cubes. The border has 24 squares, so 48 triangles and 72 edges.
  CHECK(tissue.links().size() == 98);
  CHECK(skin_links(tissue) == 72);
  for (int l = 0; l < tissue.links().size(); ++l) {
    auto const& link = tissue.links()[l];
    Vector3<S> const middle = (tissue.rest_position(link.a) + tissue.rest_position(link.b)) / 2;
    bool const on_border = middle.minCoeff() < S(1e-6) || middle.maxCoeff() > S(0.02 - 1e-6);
    REQUIRE(link.law.is_skin() == on_border);
    REQUIRE((link.law.skin_law() != nullptr) == on_border);
    REQUIRE((link.law.inner_law() == nullptr) == on_border);
    REQUIRE(link.law.damping == (on_border ? skin.damping : inside.damping));
    REQUIRE(link.law.tension(S(0.003), link.rest_length) == (on_border ? skin.tension(S(0.003), 0) : inside.tension(S(0.003), 0)));
  }
  CHECK(tissue.total_mass() == Approx(0.2));
  // Of one cube's corners two are joined through it: both are on the border, the link is inside.
  auto const cube = two_layers(make_block<S>(2, 2, 2, S(0.01)), skin, inside);
  CHECK(cube.links().size() == 19);
  CHECK(skin_links(cube) == 18);
}

TEMPLATE_TEST_CASE("two layers: the middle of an octahedron, by the formulas of both laws", "[tissue][two_layers]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  double const l = 0.02, k = 80, largest = 1.2;   // the pole is 15 mm away
  auto const formula = [&](double d) { return d / (d / largest + 1 / k); };
  auto const mesh = octahedron(S(l));
  REQUIRE(validate(mesh).empty());
  auto tissue = two_layers(mesh, LinearSpring<S>{.stiffness = S(200)}, LockingSpring<S>{.stiffness = S(k), .largest_tension = S(largest)});
  CHECK(tissue.links().size() == 18);
  CHECK(skin_links(tissue) == 12);
  for (int i = 1; i < 7; ++i) tissue.nail(i);
  SoftBody body(std::move(tissue), LeapfrogVerlet{});
  // The middle goes along z: one link is shortened by d, one stretched by d, four are stretched a little and pull back.
  double last = 0;
  for (int step = 1; step <= 7; ++step) {   // to the guard, half the way to the pole
    double const d = 0.001 * step, side = std::hypot(l, d);
    body.drag(0, {0, 0, S(d)});
    double const force = double(body.reaction(0)[2]), wanted = formula(d) - formula(-d) + 4 * formula(side - l) * d / side;
    CHECK(force == Approx(wanted).epsilon(1e-4));
    CHECK(force / d > last);
    last = force / d;
  }
  // A vertex of the skin: four linear links, and the one of inside, which is shortened.
  body.drag(0, {0, 0, 0});
  body.drag(5, {0, 0, S(l - 0.005)});
  double const height = l - 0.005, side = std::hypot(l, height), pushed = -formula(-0.005) + 4 * 200 * (l * std::sqrt(2.0) - side) * height / side;
  CHECK(-double(body.reaction(5)[2]) == Approx(pushed).epsilon(1e-4));
}

TEST_CASE("two layers: the law keeps what laws have to, with other laws too, and says what is wrong", "[tissue][two_layers]") {
  using Spring = LayerSpring<double>;
  for (Spring const& law : {Spring::skin({.stiffness = 50}), Spring::inside({.stiffness = 50, .largest_tension = 0.7})})
    CHECK(testing::check_spring_law(law, 0.02).empty());
  auto const mesh = make_block<double>(2, 2, 2, 0.01);
  auto const odd = two_layers(mesh, CubicSpring<double>{.stiffness = 50}, SaturatingSpring<double>{.stiffness = 10, .largest_tension = 1});
  CHECK(skin_links(odd) == 18);
  CHECK(unsaid(message_of([&] { two_layers(mesh, LinearSpring<double>{.stiffness = -3}, LockingSpring<double>{}); }), "link stiffness is -3 N/m") == "");
  CHECK(unsaid(message_of([&] { two_layers(mesh, LinearSpring<double>{}, LockingSpring<double>{.guard = 1}); }), "LockingSpring: .guard is 1", "0 to below 1") == "");
  CHECK(unsaid(message_of([&] { thigh_bone(mesh, 0.015, 3.0); }), "no vertex", "0.015 m", "shorter edge") == "");
}

TEST_CASE("a thigh is what it says, and its bone is inside", "[tissue][two_layers]") {
  auto const skin = make_thigh<double>({.vertices = 800});
  CHECK(skin.points.cols() == 800);
  CHECK(validate(skin).empty());
  CHECK(euler_characteristic(skin) == 2);
  Vector3<double> const size = skin.points.rowwise().maxCoeff() - skin.points.rowwise().minCoeff();
  CHECK(size.z() == Approx(0.30).epsilon(0.02));
  CHECK(size.x() == Approx(0.15).epsilon(0.03));
  // A frustum of radii 0.1825 and 0.2675 of the length; round ends take some of it.
  double const frustum = 3.14159265 / 3 * 0.3 * (std::pow(0.05475, 2) + 0.05475 * 0.08025 + std::pow(0.08025, 2));
  CHECK(volume(skin) < frustum);
  CHECK(volume(skin) > 0.9 * frustum);
  CHECK(volume(make_thigh<double>({.vertices = 800, .length = 0.6})) == Approx(8 * volume(skin)));
  auto const solid = fill(skin, {.edge = 0.03});
  CHECK(solid.same_topology());
  auto const bone = thigh_bone(solid.mesh);
  CHECK(bone.size() > 5);
  for (int const i : bone) {
    Vector3<double> const p = solid.mesh.points.col(i);
    CHECK(std::hypot(p.x(), p.y() - 0.015 * (1 - 4 * std::pow(p.z() / 0.3, 2))) <= 0.015);
  }
}

TEST_CASE("two layers: a generated indentation gives back the coefficients", "[tissue][two_layers]") {
  auto const mesh = fill(make_thigh<double>(), {.edge = 0.035}).mesh;
  auto const bone = thigh_bone(mesh);
  auto const build = [&](std::span<double const> values) {
    auto tissue = two_layers(mesh, LinearSpring<double>{.stiffness = values[0]}, LockingSpring<double>{.stiffness = values[1], .largest_tension = values[2]},
                             {.mass = {.total = 4.0}});
    tissue.nail(bone);
    return tissue;
  };
  std::vector<double> const truth{200, 80, 1.6};
  SoftBody body(build(truth), LeapfrogVerlet{});
  int const touched = body.nearest_vertex({0, 0.08, 0});
  Vector3<double> const out = body.reference_normal(touched);
  std::vector<IndentationPoint> points;
  Random random(Seed{7});
  double first = 0, last = 0;
  for (int k = 1; k <= 24; ++k) {
    double const depth = 0.025 * k / 24;
    body.drag(touched, body.reference_position(touched) - depth * out);
    body.solve_statics(NewtonRaphson{}, 1e-6);
    double const force = -body.reaction(touched).dot(out), measured = force * (1 + 0.01 * random.normal<double>());
    points.push_back({depth, measured, measured});   // 1 % of each
    (k == 1 ? first : last) = force / depth;
  }
  CHECK(last > first);
  auto const fit = fit_stiffness(build, {{"skin", "N/m", 100}, {"inside", "N/m", 100}, {"largest tension", "N", 1}},
                                 IndentationTest<double>{.particle = touched}, points);
  CHECK(fit.converged);
  CHECK(fit.stable);
  CHECK(fit.determined);
  std::vector<double> const within{0.10, 0.01, 0.04};   // half the interval, of the value, at most
  for (std::size_t k = 0; k < 3; ++k) {
    auto const& found = fit.coefficients[k];
    INFO(found.name << " " << found.value << ", " << found.low << " to " << found.high);
    CHECK(found.low < truth[k]);
    CHECK(truth[k] < found.high);
    CHECK(found.high - found.low < 2 * within[k] * found.value);
  }
}

namespace {

/// A thigh of 2,232 tetrahedra under a pad of five vertices, 12 mm deep.
struct Press {
  TetrahedralMesh<double> mesh = fill(make_thigh<double>(), {.edge = 0.03}).mesh;
  TriangleMesh<double> skin = surface(mesh);
  std::vector<int> bone = thigh_bone(mesh), pad;
  double const depth = 0.012;

  Press() {
    std::vector<char> on_skin(std::size_t(mesh.points.cols()), 0);
    for (int const v : skin.triangles.reshaped()) on_skin[std::size_t(v)] = 1;
    for (int const i : vertices_where(mesh, [](auto const& p) { return p.y() > 0 && std::hypot(p.x(), p.z()) < 0.026; }))
      if (on_skin[std::size_t(i)]) pad.push_back(i);
  }

  double lost(Matrix3X<double> const& positions) const { return volume(skin) - volume(TriangleMesh<double>{positions, skin.triangles}); }

  struct Pressed {
    double force, lost, moment;   // N, m³, and N m: Σ f·x of the forces from outside
  };
  template <class Tissue>
  Pressed press(Tissue tissue) const {
    tissue.nail(bone);
    SoftBody body(std::move(tissue), LeapfrogVerlet{});
    for (double const d : {depth / 2, depth}) {
      for (int const i : pad) body.drag(i, mesh.points.col(i) - Vector3<double>(0, d, 0));
      body.solve_statics(NewtonRaphson{}, 1e-5);
    }
    Pressed found{0, lost(body.positions()), 0};
    for (int const i : pad) found.force -= body.reaction(i).y();
    for (auto const* held : {&pad, &bone})
      for (int const i : *held) found.moment += body.reaction(i).dot(body.positions().col(i));
    return found;
  }
  /// `build(scale)` with stiffnesses and tensions so scaled that the pad asks for `force`. Forces are in proportion to the scale, so one press tells it.
  Pressed fitted(double force, auto const& build) const {
    Pressed const found = press(build(force / press(build(1.0)).force));
    CHECK(found.force == Approx(force).epsilon(1e-3));
    return found;
  }
};

}  // namespace

TEST_CASE("volume lost under a pad at 5 N: springs of three laws, supports, and an incompressible solid", "[tissue][two_layers]") {
  Press const thigh;
  REQUIRE(thigh.pad.size() == 5);
  MassOptions<double> const mass{.total = 4.0};
  double const k = 100, reach = 0.010, force = 5.0;
  auto const linear = [&](double s) { return MassSpring<double>(thigh.mesh, {.mass = mass, .link = {.stiffness = s * k}}); };
  auto const locking = LockingSpring<double>{.stiffness = k, .largest_tension = k * reach};
  auto const scaled = [](auto law, double s) { return law.stiffness *= s, law.largest_tension *= s, law; };
  double young = 0;
  double const by_linear = thigh.fitted(force, linear).lost;
  double const by_saturating = thigh.fitted(force, [&](double s) {
    return MassSpring<double, SaturatingSpring<double>>(thigh.mesh, {.mass = mass, .link = {.stiffness = s * k, .largest_tension = s * k * reach}});
  }).lost;
  double const by_locking = thigh.fitted(force, [&](double s) {
    return MassSpring<double, LockingSpring<double>>(thigh.mesh, {.mass = mass, .link = scaled(locking, s)});
  }).lost;
  double const by_layers = thigh.fitted(force, [&](double s) {
    return two_layers(thigh.mesh, LinearSpring<double>{.stiffness = 2 * s * k}, scaled(locking, s), {.mass = mass});
  }).lost;
  double const by_supports = thigh.fitted(force, [&](double s) { return Supported(linear(s), LinearSpring<double>{.stiffness = s * k}); }).lost;
  auto const solid = thigh.fitted(force, [&](double s) {
    young = s * 5000;
    return FiniteElements<double, StableNeoHookean<double>>(
        thigh.mesh, {.density = 1000.0, .material = {.young = young, .poisson = 0.495}, .pressure = Pressure::nodal});
  });
  Matrix3X<double> pad_alone = thigh.mesh.points;
  for (int const i : thigh.pad) pad_alone(1, i) -= thigh.depth;
  double const under_pad = thigh.lost(pad_alone);
  INFO("ml: " << 1e6 * by_linear << " " << 1e6 * by_saturating << " " << 1e6 * by_locking << " " << 1e6 * by_layers << " " << 1e6 * by_supports << " "
              << 1e6 * solid.lost << ", under the pad " << 1e6 * under_pad << ", E " << young);
  // What docs/models.md has, ml.
  CHECK(1e6 * by_linear == Approx(29.93).epsilon(0.01));
  CHECK(1e6 * by_saturating == Approx(29.93).epsilon(0.01));
  CHECK(1e6 * by_locking == Approx(26.38).epsilon(0.01));
  CHECK(1e6 * by_layers == Approx(26.06).epsilon(0.01));
  CHECK(1e6 * by_supports == Approx(31.18).epsilon(0.01));
  CHECK(1e6 * solid.lost == Approx(0.874).epsilon(0.01));
  CHECK(1e6 * under_pad == Approx(29.56).epsilon(1e-3));
  // Closed form: Σ f·x of the forces from outside is the integral of the trace of stress, 3 K (J − 1), 3 K = E/(1 − 2ν), and of a neo-Hookean solid's shear
  // twice its energy, which is the work of the pad.
  double const work = force * thigh.depth / 2;
  CHECK(solid.lost == Approx((2 * work - solid.moment) / (young / (1 - 2 * 0.495))).epsilon(0.06));
}
