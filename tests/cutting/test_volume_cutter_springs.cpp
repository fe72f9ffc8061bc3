// SPDX-License-Identifier: MIT
// Cuts through mass-spring solids. Yardsticks: a plane through a tetrahedron, counted by hand; areas in closed form; the same cut through finite elements, number
// by number; what no cut may change, over random strokes; springs and masses computed here from the cut mesh and the one that there was, and leapfrog written
// out on those; differences of energy; a uniform stretch. PALPATE_ORGANS sets how many strokes the stable step is measured after (8 if not set).
#include "solid_strokes.hpp"

#include "catch.hpp"

#include <palpate/body/pieces.hpp>
#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/edges.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/statics/newton_raphson.hpp>
#include <palpate/tissue/cubic_spring.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/locking_spring.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/saturating_spring.hpp>
#include <palpate/tissue/supported.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <type_traits>
#include <utility>
#include <vector>

using namespace palpate;
using namespace palpate_test;

namespace {

using Vector = Vector3<double>;
using Springs = MassSpring<double>;

Springs::Options const options{.mass = {.total = 0.01}, .link = {.stiffness = 60.0, .damping = 0.02}};
auto spring_body(TetrahedralMesh<double> const& mesh, Springs::Options const& of = options) { return SoftBody(Springs(mesh, of), LeapfrogVerlet{}); }
auto spring_block(int n, BlockPattern pattern = BlockPattern::alternating) { return spring_body(make_block<double>(n, n, n, 0.005, pattern)); }
auto solid_block(int n) {
  return SoftBody(FiniteElements<double, StableNeoHookean<double>>(make_block<double>(n, n, n, 0.005, BlockPattern::alternating),
                                                                   {.density = 1000, .material = {.young = 1e4, .poisson = 0.4}}),
                  BackwardEuler{});
}

/// A stroke that comes in from a side and stays inside.
void cut_half(auto& body) {
  VolumeCutter<double> knife;
  stroke(knife, body, Vector(0.0061, -0.003, 0.0052), Vector(0.0083, -0.003, 0.03), Vector(0, 0.013, 0), 60);
  knife.lift(body);
  REQUIRE(knife.report().lip_area > 1e-5);
}

double volume_of(TetrahedralMesh<double> const& mesh, Eigen::Index t) {
  auto const x = [&](int k) { return Vector(mesh.points.col(mesh.tetrahedra(k, t))); };
  return (x(1) - x(0)).cross(x(2) - x(0)).dot(x(3) - x(0)) / 6;
}

/// The springs and masses that a cut mesh has to have by the rule, from it and the uncut one, where all springs have one stiffness: a tetrahedron that is whole
/// brings V/ΣV to each of its edges; the parts of one bring κ V/(k L²), κ = Σ_6 (V/ΣV) k L²/(6 V) of the whole.
struct Expected {
  std::map<std::array<int, 2>, double> weight;
  std::vector<double> mass;
  int divided = 0;

  Expected(TetrahedralMesh<double> const& uncut, TetrahedralMesh<double> const& cut, double stiffness, double total) : mass(std::size_t(cut.points.cols()), 0.0) {
    auto const each_edge = [](TetrahedralMesh<double> const& mesh, Eigen::Index t, auto const& visit) {
      for (int i = 0; i < 4; ++i)
        for (int j = i + 1; j < 4; ++j) {
          int const a = mesh.tetrahedra(i, t), b = mesh.tetrahedra(j, t);
          visit(std::array{std::min(a, b), std::max(a, b)}, (mesh.points.col(a) - mesh.points.col(b)).norm());
        }
    };
    std::map<std::array<int, 2>, double> round;
    for (Eigen::Index t = 0; t < uncut.tetrahedra.cols(); ++t) each_edge(uncut, t, [&](auto const& e, double) { round[e] += volume_of(uncut, t); });
    for (Eigen::Index t = 0; t < cut.tetrahedra.cols(); ++t) {
      double const volume = volume_of(cut, t);
      Eigen::Index const parent = parent_of(uncut, cut, t);
      double const whole = volume_of(uncut, parent);
      bool const is_part = volume < 0.999 * whole;
      divided += is_part ? 1 : 0;
      double modulus = 0;
      each_edge(uncut, parent, [&](auto const& e, double length) { modulus += whole / round[e] * stiffness * length * length / (6 * whole); });
      // Corners that have split rest where the uncut mesh has theirs, and keep their order: of a whole tetrahedron the edges come as those of its parent.
      std::vector<double> shares;
      each_edge(uncut, parent, [&](auto const& e, double) { shares.push_back(whole / round[e]); });
      std::size_t k = 0;
      for (int i = 0; i < 4; ++i) mass[std::size_t(cut.tetrahedra(i, t))] += volume / 4 * total / palpate::volume(uncut);
      each_edge(cut, t, [&](auto const& e, double length) {
        weight[e] += is_part ? modulus * volume / (stiffness * length * length) : shares[k];
        ++k;
      });
    }
  }
  static Eigen::Index parent_of(TetrahedralMesh<double> const& uncut, TetrahedralMesh<double> const& cut, Eigen::Index t) {
    Vector middle = Vector::Zero();
    for (int k = 0; k < 4; ++k) middle += cut.points.col(cut.tetrahedra(k, t)) / 4;
    Eigen::Index best = -1;
    double depth = -1;
    for (Eigen::Index p = 0; p < uncut.tetrahedra.cols(); ++p) {
      double lowest = 1;
      for (int k = 0; k < 4; ++k) {
        TetrahedralMesh<double> one{Matrix3X<double>(3, 4), Matrix<int, 4, Dynamic>(4, 1)};
        one.tetrahedra << 0, 1, 2, 3;
        for (int i = 0; i < 4; ++i) one.points.col(i) = i == k ? middle : Vector(uncut.points.col(uncut.tetrahedra(i, p)));
        lowest = std::min(lowest, volume_of(one, 0) / volume_of(uncut, p));
      }
      if (lowest > depth) best = p, depth = lowest;
    }
    return best;
  }
};

/// What the tissue says of forces is what differences of its energy say, and what its assembly adds up.
void check_forces(auto const& tissue, Matrix3X<double> x) {
  for (Eigen::Index i = 0; i < x.cols(); ++i) x.col(i) += 2e-4 * Vector(std::sin(7.0 * double(i)), std::cos(5.0 * double(i)), std::sin(3.0 * double(i) + 1));
  Matrix3X<double> const still = Matrix3X<double>::Zero(3, x.cols());
  std::vector<int> all(std::size_t(x.cols()));
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = int(i);
  typename std::remove_cvref_t<decltype(tissue)>::Assembly assembly;
  tissue.assemble(all, assembly);
  Matrix3X<double> added = still;
  assembly.add_forces(x, still, added);
  for (int i = 0; i < tissue.size(); i += 7)
    for (int k = 0; k < 3; ++k) {
      double const h = 1e-7, at = x(k, i), force = tissue.internal_force(i, x, still)[k];
      x(k, i) = at + h;
      double const above = tissue.potential_energy(x);
      x(k, i) = at - h;
      double const slope = (above - tissue.potential_energy(x)) / (2 * h);
      x(k, i) = at;
      CHECK(force == Approx(-slope).epsilon(1e-4).margin(1e-5));
      CHECK(added(k, i) == Approx(force).epsilon(1e-9).margin(1e-12));
    }
}

}  // namespace

TEST_CASE("a plane through a tetrahedron of springs makes the parts and the springs that are counted by hand", "[volume_cutter]") {
  for (PlaneCase const& c : plane_cases()) {
    INFO(c.name);
    auto body = spring_body(one_tetrahedron());
    testing::SolidCutInvariants before(body);
    VolumeCutter<double> knife;
    c.cut(knife, body);
    CHECK(testing::to_text(before.check(body)) == "");
    CHECK(body.tissue().topology().tetrahedron_count() == c.tetrahedra);
    CHECK(body.size() == c.particles);
    CHECK(body.triangles().cols() == c.triangles);
    CHECK(body.tissue().links().size() == c.edges);
    CHECK(pieces(body) == 2);
  }
}

TEST_CASE("an edge of springs divided in its middle, and a vertex split, have the springs that are found by hand", "[volume_cutter]") {
  // Tetrahedra of V = 1/6 and 1/3 on both sides of the face 0 1 2, whose edges have L² = 2: shares of 1/3 and 2/3. Edges to 3 have L² = 1, those to 4 L² = 2.
  // What they bring to a link is κ V/(k L²), κ V/k = (3 · 2/3 + 3)/6 = 5/6 and (3 · 4/3 + 3 · 2)/6 = 5/3.
  TetrahedralMesh<double> mesh{Matrix3X<double>(3, 5), Matrix<int, 4, Dynamic>(4, 2)};
  mesh.points << 1, 0, 0, 0, 1, 0, 1, 0, 0, 1, 0, 0, 1, 0, 1;
  mesh.tetrahedra << 0, 0, 2, 1, 1, 2, 3, 4;
  auto body = spring_body(mesh, {.mass = {.total = 3.0}, .link = {.stiffness = 10.0, .damping = 2.0}, .home = {.stiffness = 6.0, .damping = 3.0}, .link_prestrain = 0.1});
  testing::SolidCutInvariants before(body);
  auto const& tissue = body.tissue();
  auto const weight = [&](int a, int b) { return tissue.links()[tissue.links().find(a, b)].weight; };
  SECTION("divided: all four parts have half of their tetrahedron's volume") {
    int const n = body.insert_on_edge(0, 1, 0.5);
    body.finish_edits();
    CHECK(tissue.links().size() == 13);
    for (int const end : {0, 1}) {
      CHECK(weight(n, end) == Approx((5.0 / 12 + 5.0 / 6) / 0.5));
      CHECK(weight(2, end) == Approx((5.0 / 12 + 5.0 / 6) / 2));
      CHECK(weight(3, end) == Approx(5.0 / 12));
      CHECK(weight(4, end) == Approx(5.0 / 6 / 2));
      CHECK(tissue.mass(end) == Approx(3.0 / 8));
      CHECK(tissue.home(end).stiffness == Approx(3.0));
    }
    CHECK(weight(n, 2) == Approx((5.0 / 6 + 5.0 / 3) / 1.5));
    CHECK(weight(n, 3) == Approx(5.0 / 6 / 0.5));
    CHECK(weight(n, 4) == Approx(5.0 / 3 / 1.5));
    CHECK(weight(2, 3) == Approx(5.0 / 6));
    CHECK(weight(2, 4) == Approx(5.0 / 3 / 2));
    auto const& half = tissue.links()[tissue.links().find(n, 0)];
    CHECK(half.rest_length == Approx(0.9 * std::sqrt(0.5)));
    CHECK(half.law.damping == 2.0);
    CHECK(tissue.mass(n) == Approx(3.0 / 4));   // a corner of all that there is
    CHECK(tissue.home(n).stiffness == Approx(6.0));
    CHECK(tissue.home(n).damping == Approx(3.0));
    CHECK(testing::to_text(before.check(body)) == "");
  }
  SECTION("split: each copy has its own side's shares, masses by volume") {
    std::array const first{0};
    int const n = body.split_vertex(0, first);
    body.finish_edits();
    CHECK(tissue.links().size() == 11);
    for (int const other : {1, 2}) {
      CHECK(weight(n, other) == Approx(1.0 / 3));
      CHECK(weight(0, other) == Approx(2.0 / 3));
    }
    CHECK(weight(n, 3) == 1);
    CHECK(weight(0, 4) == 1);
    CHECK(tissue.links().find(0, 3) < 0);
    CHECK(tissue.links().find(n, 4) < 0);
    CHECK(tissue.mass(n) == Approx(0.25));
    CHECK(tissue.mass(0) == Approx(0.5));
    CHECK(tissue.home(n).stiffness == Approx(2.0));
    CHECK(tissue.home(n).damping == Approx(1.0));
    CHECK(tissue.next_copy(0) == n);
    CHECK(tissue.surface().triangle_count() == 8);
    for (int t = 6; t < 8; ++t) CHECK(tissue.is_wound(t));
    CHECK_FALSE(tissue.is_wound(5));
  }
}

TEST_CASE("a plane through a block of springs has the area that it must", "[volume_cutter]") {
  for (double const x : {0.0113, 0.0103, 0.010}) {
    INFO("x = " << x);
    auto body = spring_block(5);
    testing::SolidCutInvariants before(body);
    VolumeCutter<double> knife;
    stroke(knife, body, Vector(x, -0.005, -0.01), Vector(x, -0.005, 0.03), Vector(0, 0.03, 0), 100);
    CHECK(testing::to_text(before.check(body)) == "");
    CHECK(pieces(body) == 2);
    CHECK(knife.report().area == Approx(0.0004).epsilon(1e-12));
    CHECK(knife.report().lip_area == Approx(0.0008).epsilon(1e-12));
    CHECK(volume(body.rest_solid()) == Approx(0.02 * 0.02 * 0.02).epsilon(1e-12));
  }
}

TEST_CASE("one stroke cuts the same tetrahedra of springs as of finite elements, at rest, swung and stretched, number by number", "[volume_cutter]") {
  Vector const middle(0.0075, 0.0072, 0.0078), blade = Vector(0.3, 0.2, 1).normalized(), way(1, 0.25, 0.1);
  auto const cut = [&](auto body, auto const& motion) {
    VolumeCutter<double> knife;
    for (int i = 0; i < body.size(); ++i) body.hold(i);
    for (int tick = 0; tick <= 100; ++tick) {
      double const u = tick / 100.0;
      for (int i = 0; i < body.size(); ++i) body.drag(i, motion(u, Vector(body.tissue().rest_position(i))));
      Vector const at = middle + (u - 0.5) * 0.024 * way;
      knife.advance(body, {motion(u, Vector(at - 0.009 * blade)), motion(u, Vector(at + 0.004 * blade))});
    }
    knife.lift(body);
    return body;
  };
  auto const at_rest = [](double, Vector const& X) { return X; };
  auto const elements = cut(solid_block(4), at_rest);
  REQUIRE(elements.tissue().tetrahedra() > 150);
  auto const check = [&](auto const& springs) {
    CHECK(springs.rest_solid().tetrahedra == elements.rest_solid().tetrahedra);
    CHECK(springs.triangles() == elements.triangles());
    REQUIRE(springs.size() == elements.size());
    CHECK((springs.rest_solid().points - elements.rest_solid().points).cwiseAbs().maxCoeff() < 1e-15);
    bool same = true;
    for (int t = 0; t < springs.triangles().cols(); ++t) same = same && springs.tissue().is_wound(t) == elements.tissue().is_wound(t);
    for (int t = 0; t < springs.tissue().topology().tetrahedron_count(); ++t)
      for (int k = 0; k < 4; ++k) same = same && springs.tissue().is_cut(t, k) == elements.tissue().is_cut(t, k);
    CHECK(same);
  };
  check(cut(spring_block(4), at_rest));
  check(cut(spring_block(4), [](double u, Vector const& X) {
    return Vector(Eigen::AngleAxisd(3 * u, Vector(1, 2, 3).normalized()) * X + Vector(0.1 * u, 0.3 * std::sin(5 * u), 0));
  }));
  check(cut(spring_block(4), [](double u, Vector const& X) { return Vector(1.3 * X[0] + 0.2 * u * X[1] + 0.1, 0.9 * X[1], 1.1 * X[2] + 0.1 * u * X[0]); }));
}

TEMPLATE_TEST_CASE("whatever is cut, nothing is lost of springs either", "[volume_cutter][random]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  cut_at_random<S>(60, [](TetrahedralMesh<S> const& mesh, std::uint64_t seed) {
    MassSpring<S> tissue(mesh, {.mass = {.total = S(0.004)}, .link = {.stiffness = S(40), .damping = S(0.01)}, .home = {.stiffness = S(0.5), .damping = S(1e-3)},
                                .link_prestrain = seed % 7 == 4 ? S(0.05) : S(0)});
    for (int i = 0; i < tissue.size(); ++i)
      if (seed % 2 == 0 && tissue.rest_position(i)[2] < S(1e-6)) tissue.nail(i);
    return SoftBody(std::move(tissue), BackwardEuler{});
  });
}

TEST_CASE("a cut body of springs moves as the springs do that its mesh must have, by leapfrog written out", "[volume_cutter]") {
  auto whole = spring_block(4);
  auto const uncut = whole.rest_solid();
  cut_half(whole);
  SoftBody body(Springs(whole.tissue()), LeapfrogVerlet{});
  auto const mesh = body.rest_solid();
  Expected const expected(uncut, mesh, 60.0, 0.01);
  REQUIRE(expected.divided > 50);
  auto const& links = body.tissue().links();
  CHECK(links.size() == int(expected.weight.size()));
  double worst = 0;
  for (auto const& [ends, weight] : expected.weight) worst = std::max(worst, std::abs(links[links.find(ends[0], ends[1])].weight / weight - 1));
  CHECK(worst < 1e-12);
  for (std::size_t i = 0; i < expected.mass.size(); ++i) worst = std::max(worst, std::abs(body.tissue().mass(int(i)) / expected.mass[i] - 1));
  CHECK(worst < 1e-12);   // as lumped anew: none is light enough to be lent any

  Matrix3X<double> x = mesh.points, v = Matrix3X<double>::Zero(3, x.cols()), before = v;
  for (int i = 0; i < body.size(); ++i) {
    x(0, i) += 0.0002 * std::sin(300 * x(1, i));
    body.hold(i), body.drag(i, Vector(x.col(i))), body.release(i);
  }
  auto const acceleration = [&](Matrix3X<double> const& at, Matrix3X<double> const& velocity) {
    Matrix3X<double> a = Matrix3X<double>::Zero(3, at.cols());
    for (auto const& [ends, weight] : expected.weight) {
      auto const [i, j] = ends;
      Vector const d = at.col(i) - at.col(j), n = d.normalized();
      double const length = (mesh.points.col(i) - mesh.points.col(j)).norm();
      Vector const force = -weight * (60.0 * (d.norm() - length) + 0.02 * n.dot(velocity.col(i) - velocity.col(j))) * n;
      a.col(i) += force / expected.mass[std::size_t(i)], a.col(j) -= force / expected.mass[std::size_t(j)];
    }
    return a;
  };
  double const h = 2e-5;
  REQUIRE(h < body.stable_step());
  for (int step = 0; step < 100; ++step) {
    REQUIRE(body.step(h));
    x += h / 2 * v;   // drift, kick, drift; the damping at a velocity that the last kick carries to the middle
    if (step == 0) before = acceleration(x, v);
    before = acceleration(x, v + h / 2 * before);
    v += h * before;
    x += h / 2 * v;
  }
  CHECK((x - mesh.points).cwiseAbs().maxCoeff() > 1e-5);
  CHECK((body.positions() - x).cwiseAbs().maxCoeff() < 1e-9 * 0.015);
}

namespace {

/// Divides edges of tetrahedra drawn at random.
void divide_at_random(auto& tissue, int count) {
  Random random(Seed{4});
  for (int k = 0; k < count; ++k) {
    auto const c = tissue.topology().corners(int(random.below(std::uint64_t(tissue.topology().tetrahedron_count()))));
    std::size_t const i = random.below(4), j = (i + 1 + random.below(3)) % 4;
    tissue.divide_edge(c[i], c[j], random.uniform(0.3, 0.7));
  }
  tissue.finish_edits();
}

}  // namespace

TEMPLATE_TEST_CASE("springs of every law follow edits of their tetrahedra", "[volume_cutter]", SaturatingSpring<double>, LockingSpring<double>, CubicSpring<double>) {
  TestType law;
  law.stiffness = 60;
  if constexpr (std::is_same_v<TestType, CubicSpring<double>>)
    law.cubic = 1e6;
  else
    law.largest_tension = 0.5;
  MassSpring<double, TestType> tissue(make_block<double>(4, 4, 4, 0.005, BlockPattern::alternating), {.mass = {.total = 0.004}, .link = law, .link_prestrain = 0.02});
  auto const sum = testing::SpringSums::of(tissue).stretch;
  divide_at_random(tissue, 100);
  for (int i = 0; i < 64; i += 3) {
    auto const all = tissue.topology().tetrahedra_at(i);
    std::vector<int> const some(all.begin(), all.begin() + std::ssize(all) / 2);
    if (!some.empty()) tissue.split_vertex(i, some);
  }
  tissue.finish_edits();
  CHECK(tissue.size() > 64 + 100 + 15);
  CHECK(testing::SpringSums::of(tissue).stretch == Approx(sum).epsilon(1e-12));
  check_forces(tissue, tissue.rest_positions());
}

TEST_CASE("dividing tetrahedra of springs keeps the energy of a uniform stretch; that of others changes little", "[volume_cutter]") {
  for (auto const pattern : {BlockPattern::alternating, BlockPattern::kuhn}) {
    Springs tissue(make_block<double>(5, 5, 5, 0.005, pattern), options);
    auto const energy = [&](Matrix<double, 3, 3> const& F) { return tissue.potential_energy((F * tissue.rest_positions()).eval()); };
    Matrix<double, 3, 3> const one = Matrix<double, 3, 3>::Identity();
    Matrix<double, 3, 3> along = one, sheared = one;
    along(0, 0) = 1.01, sheared(0, 1) = 0.01;
    double const larger = energy(1.1 * one), smaller = energy(0.95 * one), stretched = energy(along), slid = energy(sheared);
    divide_at_random(tissue, 300);
    CHECK(tissue.topology().tetrahedron_count() > 1000);
    CHECK(energy(1.1 * one) == Approx(larger).epsilon(1e-9));
    CHECK(energy(0.95 * one) == Approx(smaller).epsilon(1e-9));
    // No springs could keep these: what a new edge adds is a full square of the strain, which none of the old edges has to give.
    CHECK(energy(along) / stretched == Approx(1).margin(0.2));
    CHECK(energy(sheared) / slid == Approx(1).margin(0.2));
  }
}

TEST_CASE("stiff springs, a zone, several blades, statics and pieces follow a cut through springs", "[volume_cutter]") {
  auto const mesh = make_block<double>(4, 4, 4, 0.005, BlockPattern::alternating);
  auto const held_below = [](auto tissue) {
    for (int i = 0; i < tissue.size(); ++i)
      if (tissue.rest_position(i)[2] < 1e-6) tissue.nail(i);
    return tissue;
  };
  auto const cut_and_move = [](auto body) {
    testing::SolidCutInvariants before(body);
    VolumeCutter<double> knife, other;
    for (int tick = 0; tick <= 40; ++tick) {
      double const u = -0.002 + 0.019 * tick / 40;
      knife.advance(body, {{0.0071, u, 0.0052}, {0.0083, u, 0.02}});
      if (tick > 10) other.advance(body, {{u, 0.0091, 0.0063}, {u, 0.0091, 0.02}});   // meets the first cut, and crosses it
      REQUIRE(testing::to_text(before.check(body)) == "");
      REQUIRE(body.step(2e-5));
    }
    CHECK(knife.report().lip_area > 1e-5);
    CHECK(other.report().lip_area > 1e-5);
    check_forces(body.tissue(), body.positions());
    return body;
  };
  MassOptions<double> const mass{.total = 0.004};
  SECTION("springs of their own: a new one has the law of the edge that was divided, and each brings what its own stiffness asks for") {
    Springs tissue(mesh, {.mass = mass, .link = {.stiffness = 60.0, .damping = 1e-3}});
    for (int l = 0; l < tissue.links().size(); l += 5) tissue.set_link(l, {.stiffness = 600.0, .damping = 1e-2});
    auto const body = cut_and_move(SoftBody(held_below(std::move(tissue)), LeapfrogVerlet{}));
    for (int l = 0; l < body.tissue().links().size(); ++l) {
      auto const& law = body.tissue().links()[l].law;
      REQUIRE(((law.stiffness == 60.0 && law.damping == 1e-3) || (law.stiffness == 600.0 && law.damping == 1e-2)));
    }
  }
  SECTION("a zone") {
    SoftBody body(held_below(Springs(mesh, {.mass = mass, .link = {.stiffness = 60.0, .damping = 1e-3}})), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 2});
    body.apply_force(body.nearest_vertex({0.0075, 0.0075, 0.015}), {0, 0, -0.01});
    cut_and_move(std::move(body));
  }
  SECTION("pre-tension: the wound gapes, and both solvers of statics find one balance") {
    auto body = SoftBody(held_below(Springs(mesh, {.mass = mass, .link = {.stiffness = 60.0, .damping = 1e-3}, .link_prestrain = 0.1})), BackwardEuler{});
    cut_half(body);
    auto other = body;
    body.settle();
    other.settle(NewtonRaphson{});
    CHECK((body.positions() - other.positions()).cwiseAbs().maxCoeff() < 1e-7);
    double widest = 0;
    for (int i = 0; i < body.size(); ++i) widest = std::max(widest, (body.positions().col(i) - body.positions().col(body.tissue().next_copy(i))).norm());
    CHECK(widest > 1e-4);
    for (int i = 0; i < body.size(); ++i)
      if (!body.tissue().nailed(i)) CHECK(body.tissue().internal_force(i, body.positions(), Matrix3X<double>::Zero(3, body.size())).norm() < 1e-6);
  }
  SECTION("a piece of its own, which is cut again") {
    auto body = spring_body(mesh);
    VolumeCutter<double> knife;
    stroke(knife, body, Vector(0.0071, -0.003, -0.01), Vector(0.0083, -0.003, 0.03), Vector(0, 0.022, 0), 40);
    auto const parts = pieces_of(body);
    REQUIRE(parts.size() == 2);
    auto one = part_of(body, parts[0]), two = part_of(body, parts[1]);
    CHECK(one.total_mass() + two.total_mass() == Approx(body.total_mass()).epsilon(1e-12));
    CHECK(one.tissue().links().size() + two.tissue().links().size() == body.tissue().links().size());
    int wounds = 0;
    for (int t = 0; t < one.tissue().surface().triangle_count(); ++t) wounds += one.tissue().is_wound(t) ? 1 : 0;
    CHECK(wounds > 10);
    testing::SolidCutInvariants before(one);
    VolumeCutter<double> again;
    stroke(again, one, Vector(-0.01, 0.0061, -0.01), Vector(-0.01, 0.0061, 0.03), Vector(0.03, 0, 0), 40);
    CHECK(again.report().lip_area > 1e-5);
    CHECK(pieces(one) == 2);
    CHECK(testing::to_text(before.check(one)) == "");
    for (int k = 0; k < 100; ++k) REQUIRE(body.step(2e-5));
    for (int k = 0; k < 100; ++k) REQUIRE(two.step(2e-5));
    for (std::size_t k = 0; k < parts[1].size(); ++k) REQUIRE((two.positions().col(int(k)) - body.positions().col(parts[1][k])).norm() < 1e-12);
  }
  SECTION("support springs stay with the skin") {
    SoftBody body(Supported(Springs(mesh, {.mass = mass, .link = {.stiffness = 60.0, .damping = 1e-3}}), LinearSpring<double>{.stiffness = 5.0}), LeapfrogVerlet{});
    cut_half(body);
    auto const& surface = body.tissue().surface();
    int inner = 0;
    for (int i = 0; i < body.size(); ++i) {
      bool skin = false;
      for (int const t : surface.triangles_at(i)) skin = skin || !body.tissue().is_wound(t);
      CHECK((body.tissue().support_weight(i) > 0) == skin);
      inner += !skin && !surface.triangles_at(i).empty() ? 1 : 0;
    }
    CHECK(inner > 3);
    for (int k = 0; k < 100; ++k) REQUIRE(body.step(2e-5));
    check_forces(body.tissue(), body.positions());
  }
}

TEST_CASE("a cut through springs is restored in its middle, and goes on from there to the byte", "[volume_cutter]") {
  auto body = spring_block(4);
  VolumeCutter<double> knife;
  auto const go = [&](int first, int last) {
    for (int tick = first; tick < last; ++tick) {
      knife.advance(body, {{0.0071, -0.002 + 0.019 * tick / 40, 0.0052}, {0.0083, -0.002 + 0.019 * tick / 40, 0.02}});
      REQUIRE(body.step(2e-5));
    }
  };
  testing::SolidCutInvariants before(body);
  go(0, 20);
  auto const middle = body.save();
  Matrix3X<double> const at = body.positions();
  go(20, 41);
  REQUIRE(body.size() > at.cols());
  std::vector<Matrix3X<double>> ends;
  for (int again = 0; again < 2; ++again) {
    body.restore(middle);
    CHECK(body.positions() == at);
    CHECK(testing::to_text(before.check(body)) == "");
    knife = {};
    go(20, 41);
    CHECK(testing::to_text(before.check(body)) == "");
    ends.emplace_back(body.positions());
  }
  CHECK(ends[0].cols() > at.cols());
  CHECK(ends[0] == ends[1]);
}

TEST_CASE("the stable step of springs outlasts a stroke of 3 to 8 edges: masses are evened out", "[volume_cutter]") {
  for (std::uint64_t seed = 1, seeds = from_environment("PALPATE_ORGANS", 8); seed <= seeds; ++seed) {
    auto body = spring_body(make_block<double>(7, 7, 7, 0.005, BlockPattern::alternating), {.mass = {.total = 0.03}, .link = {.stiffness = 60.0, .damping = 0.02}});
    auto const before = body.modal_bounds(), guaranteed = body.guaranteed_modal_bounds();
    int const particles = body.size();
    Random random(Seed{seed});
    auto const any = [&] { return Vector(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)); };
    Vector const middle = Vector::Constant(0.015) + 0.006 * any(), blade = any().normalized(), way = any().normalized();
    double const length = 0.005 * random.uniform(3.0, 8.0), width = 0.005 * random.uniform(2.0, 6.0);
    VolumeCutter<double> knife;
    stroke(knife, body, middle - length / 2 * way - width / 2 * blade, middle - length / 2 * way + width / 2 * blade, length * way, 60);
    knife.lift(body);
    // Refined evenly to as many particles, all edges are shorter by the same share: both rates go with 1/L².
    double const even = std::cbrt(double(particles) / body.size());
    double const stiffness = std::sqrt(before.squared_frequency / body.modal_bounds().squared_frequency), damping = before.decay_rate / body.modal_bounds().decay_rate;
    INFO("seed " << seed << ": " << particles << " particles, then " << body.size() << "; the step is " << stiffness << " of what it was where stiffness bounds it, "
                 << damping << " where damping does; refined evenly " << even << " and " << even * even);
    CHECK(stiffness > 0.33 * even);
    CHECK(damping > 0.1 * even * even);
    CHECK(body.guaranteed_modal_bounds().squared_frequency < 4.5 * guaranteed.squared_frequency);   // what masses are evened out to, and a quarter's steps beyond
  }
}

TEMPLATE_TEST_CASE("nailed particles that lend mass again and again keep some", "[volume_cutter]", PALPATE_TEST_SCALARS) {
  // Found by seed 405 of the random strokes, in float. A short link lacks mass, and its nailed parent draws on a nailed child of its own each time.
  using S = TestType;
  MassSpring<S> tissue(make_block<S>(3, 3, 3, S(0.01)), {.mass = {.total = S(0.004)}, .link = {.stiffness = S(40)}, .home = {.stiffness = S(0.5)}});
  for (int i = 0; i < tissue.size(); ++i)
    if (tissue.rest_position(i)[2] < S(1e-6)) tissue.nail(i);
  auto const particle_at = [&](S x, S z) {
    int found = -1;
    for (int i = 0; i < tissue.size(); ++i)
      if ((tissue.rest_position(i) - Vector3<S>(x, S(0.01), z)).norm() < S(1e-6)) found = i;
    return found;
  };
  int const middle = particle_at(S(0.01), 0), beside = particle_at(0, 0), above = particle_at(S(0.01), S(0.01));
  tissue.divide_edge(middle, beside, S(0.5));
  tissue.divide_edge(middle, above, S(0.01));
  int const lent = tissue.size() - 2, lacks = tissue.size() - 1;
  REQUIRE(tissue.nailed(lent));
  S const had = tissue.mass(lent);
  for (int k = 0; k < 1000; ++k) tissue.even_mass(lacks, [](int, int, S) {});
  CHECK(tissue.mass(lent) < had / 2);
  double total = 0;
  for (int i = 0; i < tissue.size(); ++i) {
    CHECK(tissue.mass(i) > 0);
    total += static_cast<double>(tissue.mass(i));
  }
  CHECK(total == Approx(0.004).epsilon(sizeof(S) == sizeof(float) ? 1e-5 : 1e-12));
}

TEST_CASE("a cutter of solids and a surface, and the other way round, are refused in a sentence", "[volume_cutter]") {
  SoftBody sheet(Springs(make_grid<double>(5, 5, 0.005), {}), LeapfrogVerlet{});
  VolumeCutter<double> knife;
  CHECK_THROWS_WITH(knife.advance(sheet, {{0.0113, 0.011, -0.01}, {0.0113, 0.011, 0.01}}), Catch::Contains("built from a surface") && Catch::Contains("ProgressiveCutter"));
  CHECK_THROWS_AS(knife.lift(sheet), InvalidArgument);
  CHECK_THROWS_AS(knife.resume(sheet), InvalidArgument);
  std::array const some{0};
  CHECK_THROWS_AS(sheet.split_vertex(6, some), InvalidArgument);
  CHECK_THROWS_AS(sheet.rest_solid(), InvalidArgument);
  CHECK(sheet.size() == 25);
  auto block = spring_block(3);
  ProgressiveCutter<double> scalpel;
  CHECK_THROWS_WITH(scalpel.advance(block, {0.005, 0.005, 0.03}), Catch::Contains("built from a volume") && Catch::Contains("VolumeCutter"));
  VolumeCutter<double> clearing({.debris = 5});
  CHECK_THROWS_WITH(clearing.advance(block, {{0.0031, -0.01, 0.004}, {0.0031, 0.03, 0.004}}), Catch::Contains("debris is 5") && Catch::Contains("give 0, or take FiniteElements"));
  CHECK_THROWS_WITH(block.insert_on_edge(0, 1, 1.0), Catch::Contains("s is 1"));
  CHECK_THROWS_AS(block.insert_on_edge(0, 26, 0.5), InvalidArgument);
  CHECK_THROWS_AS(block.insert_on_edge(0, 27, 0.5), OutOfRange);
  CHECK(block.size() == 27);
  CHECK(block.tissue().links().size() == int(edges(block.rest_solid()).size()));
}
