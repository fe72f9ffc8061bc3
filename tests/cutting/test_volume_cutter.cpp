// SPDX-License-Identifier: MIT
// Cuts through solids. Yardsticks: cases of a plane through a tetrahedron, counted by hand; areas and volumes in closed form; what no cut may change
// (testing/solid_cut_invariants.hpp), over random strokes; the same stroke on a body at rest; leapfrog written out here, on the cut tetrahedra.
#include "solid_strokes.hpp"
#include "solid_tissues.hpp"

#include "catch.hpp"

#include <palpate/body/pieces.hpp>
#include <palpate/body/soft_body.hpp>
#include <palpate/core/random.hpp>
#include <palpate/cutting/aspirator.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/material/viscoelastic.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/testing/solid_cut_invariants.hpp>
#include <palpate/tissue/finite_elements.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

using namespace palpate;
using namespace palpate_test;

namespace {

using Vector = Vector3<double>;

template <class Of, class S>
auto solid_body(TetrahedralMesh<S> const& mesh) {
  return SoftBody(Of::tissue(mesh, S(0)), BackwardEuler{});
}
template <class Of>
auto block_body(int n, BlockPattern pattern = BlockPattern::alternating) {
  return solid_body<Of>(make_block<double>(n, n, n, 0.005, pattern));
}

}  // namespace

TEMPLATE_LIST_TEST_CASE("a plane through one tetrahedron makes the parts that are counted by hand", "[volume_cutter]",
                        Solids) {
  for (PlaneCase const& c : plane_cases()) {
    INFO(c.name);
    auto body = solid_body<TestType>(one_tetrahedron());
    testing::SolidCutInvariants before(body);
    VolumeCutter<double> knife;
    c.cut(knife, body);
    CHECK(testing::to_text(before.check(body)) == "");
    CHECK(body.tissue().tetrahedra() == c.tetrahedra);
    CHECK(body.size() == c.particles);
    CHECK(body.triangles().cols() == c.triangles);
    CHECK(pieces(body) == 2);
    CHECK(knife.report().lip_area == Approx(2 * knife.report().area).epsilon(1e-12));
  }
}

TEMPLATE_LIST_TEST_CASE("a plane along the face between two tetrahedra opens it, and a blade that goes half way through an edge opens nothing", "[volume_cutter]",
                        Solids) {
  TetrahedralMesh<double> mesh{Matrix3X<double>(3, 5), Matrix<int, 4, Dynamic>(4, 2)};
  mesh.points << 0, 0, 0, 0.01, -0.01, 0, 0.01, 0, 0, 0, 0, 0, 0.01, 0, 0;
  mesh.tetrahedra << 0, 0, 1, 2, 2, 1, 3, 4;
  if ((mesh.points.col(1) - mesh.points.col(0)).cross(mesh.points.col(2) - mesh.points.col(0)).dot(mesh.points.col(3) - mesh.points.col(0)) < 0)
    mesh.tetrahedra.row(1).swap(mesh.tetrahedra.row(2));
  SECTION("Z: three vertices") {
    auto body = solid_body<TestType>(mesh);
    VolumeCutter<double> knife;
    stroke(knife, body, Vector(0, -0.02, -0.0203), Vector(0, 0.03, -0.0203), Vector(0, 0, 0.05), 30);
    CHECK(body.tissue().tetrahedra() == 2);
    CHECK(body.size() == 8);
    CHECK(pieces(body) == 2);
    CHECK(knife.report().area == Approx(0.5e-4).epsilon(1e-12));
    CHECK(knife.report().lip_area == Approx(1e-4).epsilon(1e-12));
  }
  SECTION("one edge so far") {
    auto body = solid_body<TestType>(mesh);
    VolumeCutter<double> knife;
    // The edge from vertex 0 to vertex 3 alone, at 0.4.
    stroke(knife, body, Vector(0.004, -0.001, -0.002), Vector(0.004, 0.001, -0.002), Vector(0, 0, 0.003), 10);
    CHECK(body.tissue().tetrahedra() == 3);
    CHECK(body.size() == 6);
    CHECK(pieces(body) == 1);
    CHECK(knife.report().edges_divided == 1);
    CHECK(knife.report().area == 0);
    CHECK(knife.is_cutting());
  }
}

TEMPLATE_LIST_TEST_CASE("a plane through a block has the area that it must, where it snaps to nothing, to a plane of vertices and along faces", "[volume_cutter]",
                        Solids) {
  for (auto const pattern : {BlockPattern::alternating, BlockPattern::kuhn})
    for (double const x : {0.0213, 0.0203, 0.020, 0.0199}) {
      INFO("x = " << x);
      auto body = block_body<TestType>(9, pattern);
      int const tetrahedra = body.tissue().tetrahedra();
      testing::SolidCutInvariants before(body);
      VolumeCutter<double> knife;
      stroke(knife, body, Vector(x, -0.005, -0.01), Vector(x, -0.005, 0.05), Vector(0, 0.05, 0), 200);
      CHECK(testing::to_text(before.check(body)) == "");
      CHECK(pieces(body) == 2);
      CHECK(knife.report().area == Approx(0.0016).epsilon(1e-12));
      CHECK(knife.report().lip_area == Approx(0.0032).epsilon(1e-12));
      CHECK(volume(body.rest_solid()) == Approx(0.04 * 0.04 * 0.04).epsilon(1e-12));
      CHECK(knife.report().closed_faces == 0);
      if (x != 0.0213) CHECK(body.tissue().tetrahedra() == tetrahedra);   // it bends to the vertices
      CHECK_FALSE(knife.is_cutting());
    }
}

// Yardstick: the plane that a straight edge sweeps when it is drawn across itself.
TEST_CASE("the edge turns with the tool: drawn tilted it leaves a plane that is tilted", "[volume_cutter]") {
  auto const mesh = make_block<double>(7, 7, 7, 0.005, BlockPattern::alternating);
  SoftBody body(FiniteElements<double, StableNeoHookean<double>>(mesh, {.density = 1000, .material = {.young = 5e3, .poisson = 0.45}}), BackwardEuler{}, WholeBody{});
  VolumeCutter<double> knife({.edge = {{0, 0, 0}, {0, 0, 0.05}}});
  Eigen::Quaterniond const tilt(Eigen::AngleAxisd(0.5, Vector3<double>::UnitY()));
  Vector3<double> const normal = tilt * Vector3<double>::UnitX(), tip(0.0087, 0, 0.0081);
  for (int k = 0; k <= 40; ++k) knife.advance(body, ToolPose<double>{.position = tip + Vector3<double>(0, -0.004 + 0.001 * k, 0), .orientation = tilt});
  auto const old = static_cast<int>(mesh.points.cols());
  int on_plane = 0;
  for (int i = old; i < body.size(); ++i) {
    Vector3<double> const x = body.tissue().rest_position(i);
    bool const is_copy = (mesh.points.colwise() - x).colwise().norm().minCoeff() < 1e-12;   // of a vertex that the cut went to
    CAPTURE(i, x.transpose());
    if (!is_copy) CHECK(std::abs(normal.dot(x - tip)) < 1e-12);
    on_plane += !is_copy;
  }
  CHECK(on_plane > 60);
}

TEMPLATE_LIST_TEST_CASE("a cut is the same however finely its way is divided into ticks", "[volume_cutter]",
                        Solids) {
  for (std::uint64_t seed = 0; seed < 24; ++seed) {
    std::uint64_t const kind = seed % 4;
    INFO("seed " << seed << ", " << (kind < 2 ? "a block" : "an uneven one"));
    auto const cut = [&](int ticks) {
      auto const pattern = kind == 0 ? BlockPattern::alternating : BlockPattern::kuhn;
      auto body = kind < 2 ? block_body<TestType>(4, pattern) : solid_body<TestType>(solid_of(kind == 2 ? 2 : 7));   // the latter of both patterns
      VolumeCutter<double> knife;
      Drawn(seed).cut(knife, body, ticks);
      knife.lift(body);
      return std::pair(std::move(body), knife.report());
    };
    auto const [coarse, once] = cut(10);
    for (int const ticks : {37, 1000}) {
      auto const [fine, again] = cut(ticks);
      CHECK(shape(fine) == shape(coarse));
      CHECK(fine.size() == coarse.size());
      CHECK(fine.triangles().cols() == coarse.triangles().cols());
      CHECK(again.area == Approx(once.area).epsilon(1e-12));
    }
  }
}

TEST_CASE("a cut of a blade that bends is the same however finely its way is divided into ticks", "[volume_cutter]") {
  // Yardstick: the corners of all tetrahedra at rest, of two straight pieces at an angle, along a way of any direction. PALPATE_BENDS sets how many ways.
  std::uint64_t const ways = from_environment("PALPATE_BENDS", 12);
  std::uint64_t differ = 0;
  for (double const bend : {20.0, 40.0, 60.0})
    for (std::uint64_t seed = 1; seed <= ways; ++seed) {
      INFO("bent by " << bend << " degrees, seed " << seed);
      Random random(Seed{seed});
      auto const any = [&] { return Vector(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)); };
      Vector const middle = Vector::Constant(0.0075) + 0.002 * any(), way = any().normalized(), up = way.cross(any()).normalized(), side = up.cross(way);
      double const half = bend * std::numbers::pi / 360;
      auto const cut = [&](int ticks) {
        auto body = block_body<Elements>(4, seed % 2 == 0 ? BlockPattern::alternating : BlockPattern::kuhn);
        VolumeCutter<double> knife;
        for (int tick = 0; tick <= ticks; ++tick) {
          Vector const at = middle + 0.04 * (static_cast<double>(tick) / ticks - 0.5) * way;
          Vector const one = std::sin(half) * side + std::cos(half) * up, other = std::sin(half) * side - std::cos(half) * up;
          std::array const blade{Vector(at + 0.04 * one), at, Vector(at + 0.04 * other)};
          knife.advance(body, std::span<Vector const>(blade));
        }
        knife.lift(body);
        return body;
      };
      auto const coarse = cut(10);
      CHECK(pieces(coarse) == 2);
      for (int const ticks : {100, 1000}) {
        auto const fine = cut(ticks);
        bool const same = shape(fine) == shape(coarse) && fine.size() == coarse.size() && fine.triangles().cols() == coarse.triangles().cols();
        differ += same ? 0 : 1;
      }
    }
  INFO(differ << " of " << 6 * ways << " differ from the cut in ten ticks");
  CHECK(differ <= 6 * ways / 100);
}

TEMPLATE_LIST_TEST_CASE("the same stroke again, and to and fro, adds nothing", "[volume_cutter]",
                        Solids) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    INFO("seed " << seed);
    auto body = block_body<TestType>(4);
    VolumeCutter<double> knife;
    Drawn const drawn(seed);
    drawn.cut(knife, body, 50);
    knife.lift(body);
    auto const once = shape(body);
    int const size = body.size();
    drawn.cut(knife, body, 31);
    CHECK(shape(body) == once);
    Drawn back = drawn;
    back.way = -back.way;
    back.cut(knife, body, 50);
    drawn.cut(knife, body, 50);
    knife.lift(body);
    CHECK(shape(body) == once);
    CHECK(body.size() <= size + 2);   // seed 10: a face between edges that the end of the first stroke has parted opens as well
  }
}

TEMPLATE_LIST_TEST_CASE("one stroke through the material cuts the same tetrahedra of a body at rest, swung and stretched, number by number", "[volume_cutter]",
                        Solids) {
  Vector const middle(0.0075, 0.0072, 0.0078), blade = Vector(0.3, 0.2, 1).normalized(), way(1, 0.25, 0.1);
  auto const cut = [&](auto const& motion) {
    auto body = block_body<TestType>(4);
    VolumeCutter<double> knife;
    for (int i = 0; i < body.size(); ++i) body.hold(i);
    for (int tick = 0; tick <= 100; ++tick) {
      double const u = tick / 100.0;
      for (int i = 0; i < body.size(); ++i) {
        if (!body.is_held(i)) body.hold(i);
        body.drag(i, motion(u, Vector(body.tissue().rest_position(i))));
      }
      Vector const at = middle + (u - 0.5) * 0.024 * way;
      knife.advance(body, {motion(u, Vector(at - 0.009 * blade)), motion(u, Vector(at + 0.004 * blade))});
    }
    return body;
  };
  auto const rest = cut([](double, Vector const& X) { return X; });
  auto const swung = cut([](double u, Vector const& X) {
    return Vector(Eigen::AngleAxisd(3 * u, Vector(1, 2, 3).normalized()) * X + Vector(0.1 * u, 0.3 * std::sin(5 * u), 0));
  });
  auto const stretched = cut([](double u, Vector const& X) { return Vector(1.3 * X[0] + 0.2 * u * X[1] + 0.1, 0.9 * X[1], 1.1 * X[2] + 0.1 * u * X[0]); });
  REQUIRE(rest.tissue().tetrahedra() > 150);
  for (auto const* other : {&swung, &stretched}) {
    REQUIRE(other->tissue().tetrahedra() == rest.tissue().tetrahedra());
    CHECK(other->rest_solid().tetrahedra == rest.rest_solid().tetrahedra);
    CHECK(other->triangles() == rest.triangles());
    CHECK((other->rest_solid().points - rest.rest_solid().points).cwiseAbs().maxCoeff() < 1e-15);
  }
}

TEMPLATE_TEST_CASE("whatever is cut, nothing is lost and all follows", "[volume_cutter][random]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const make = [](auto of) {
    return [of](TetrahedralMesh<S> const& mesh, std::uint64_t seed) {
      auto tissue = of.tissue(mesh, seed % 7 == 4 ? S(0.05) : S(0));
      for (int i = 0; i < tissue.size(); ++i)
        if (tissue.rest_position(i)[2] < S(1e-6)) tissue.nail(i);
      return SoftBody(std::move(tissue), BackwardEuler{});
    };
  };
  cut_at_random<S>(90, make(Elements{}));
  cut_at_random<S>(30, make(Tensors{}), true);
  cut_at_random<S>(15, make(Turned{}));
}

TEMPLATE_LIST_TEST_CASE("a cut body moves as its tetrahedra do, by leapfrog written out", "[volume_cutter]",
                        Solids) {
  auto whole = block_body<TestType>(4);
  VolumeCutter<double> knife;
  stroke(knife, whole, Vector(0.0061, -0.003, 0.0052), Vector(0.0083, -0.003, 0.03), Vector(0, 0.013, 0), 60);
  knife.lift(whole);
  REQUIRE(knife.report().lip_area > 1e-5);
  using Tissue = std::remove_cvref_t<decltype(whole.tissue())>;
  using Element = typename Tissue::Element;
  SoftBody body(Tissue(whole.tissue()), LeapfrogVerlet{});
  auto const mesh = body.rest_solid();
  Matrix3X<double> x = mesh.points, v = Matrix3X<double>::Zero(3, x.cols()), force(3, x.cols());
  std::vector<Element> elements;
  std::vector<double> mass(static_cast<std::size_t>(x.cols()), 0.0);
  auto const law = body.tissue().list().elements.front().law();
  for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t) {
    NodeColumns<double, 4> rest;
    for (int k = 0; k < 4; ++k) rest.col(k) = mesh.points.col(mesh.tetrahedra(k, t));
    elements.emplace_back(rest, law, 1000.0);
    for (int k = 0; k < 4; ++k) mass[static_cast<std::size_t>(mesh.tetrahedra(k, t))] += elements.back().mass() / 4;
  }
  for (int i = 0; i < body.size(); ++i) {
    x(0, i) += 0.0002 * std::sin(300 * x(1, i));
    body.hold(i), body.drag(i, Vector(x.col(i))), body.release(i);
  }
  REQUIRE(body.positions() == x);
  double const h = 2e-5;
  REQUIRE(h < body.stable_step());
  for (int step = 0; step < 100; ++step) {
    REQUIRE(body.step(h));
    x += h / 2 * v;   // drift, kick, drift
    force.setZero();
    for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t) {
      NodeColumns<double, 4> now;
      for (int k = 0; k < 4; ++k) now.col(k) = x.col(mesh.tetrahedra(k, t));
      NodeColumns<double, 4> const own = elements[static_cast<std::size_t>(t)].force(now);
      for (int k = 0; k < 4; ++k) force.col(mesh.tetrahedra(k, t)) += own.col(k);
    }
    for (Eigen::Index i = 0; i < x.cols(); ++i) {
      v.col(i) += h * force.col(i) / mass[static_cast<std::size_t>(i)];
      x.col(i) += h / 2 * v.col(i);
    }
  }
  CHECK((x - mesh.points).cwiseAbs().maxCoeff() > 1e-5);
  CHECK((body.positions() - x).cwiseAbs().maxCoeff() < 1e-9 * 0.015);
}

TEMPLATE_LIST_TEST_CASE("a host's copy of the border follows a solid's cut by the record of changes", "[volume_cutter]",
                        Solids) {
  auto body = block_body<TestType>(4);
  Matrix<int, 3, Dynamic> copy = body.triangles();
  body.forget_changes();
  VolumeCutter<double> knife;
  for (int tick = 0; tick <= 40; ++tick) {
    double const y = -0.002 + 0.019 * tick / 40;
    knife.advance(body, {{0.0071, y, 0.004}, {0.0083, y, 0.02}});
    auto const changes = body.changes();
    copy.conservativeResize(3, changes.triangle_count);
    for (int const t : changes.triangles) copy.col(t) = body.triangles().col(t);
    for (int t = changes.first_triangle; t < changes.triangle_count; ++t) copy.col(t) = body.triangles().col(t);
    body.forget_changes();
    REQUIRE(copy == body.triangles());
  }
  int wounds = 0;
  for (int t = 0; t < body.tissue().surface().triangle_count(); ++t) wounds += body.tissue().is_wound(t) ? 1 : 0;
  CHECK(wounds > 20);
}

TEST_CASE("materials, nodal pressure, viscoelasticity, a zone, several blades and cores follow a cut", "[volume_cutter]") {
  auto const cut_and_move = [](auto& body, double step = 1e-3) {
    testing::SolidCutInvariants before(body);
    VolumeCutter<double> knife, other;
    for (int tick = 0; tick <= 40; ++tick) {
      double const u = -0.002 + 0.019 * tick / 40;
      knife.advance(body, {{0.0071, u, 0.0052}, {0.0083, u, 0.02}});
      if (tick > 10) other.advance(body, {{u, 0.0091, 0.0063}, {u, 0.0091, 0.02}});   // meets the first cut, and crosses it
      REQUIRE(testing::to_text(before.check(body)) == "");
      REQUIRE(body.step(step));
    }
    CHECK(knife.report().lip_area > 1e-5);
    CHECK(other.report().lip_area > 1e-5);
    // What the tissue says of forces is what differences of its energy say: the elements are where the topology has them.
    auto const& tissue = body.tissue();
    Matrix3X<double> x = body.positions();
    for (Eigen::Index i = 0; i < x.cols(); ++i) x.col(i) += 2e-4 * Vector(std::sin(7.0 * double(i)), std::cos(5.0 * double(i)), std::sin(3.0 * double(i) + 1));
    Matrix3X<double> const still = Matrix3X<double>::Zero(3, x.cols());
    for (int i = 0; i < body.size(); i += 7)
      for (int k = 0; k < 3; ++k) {
        double const h = 1e-7, at = x(k, i);
        x(k, i) = at + h;
        double const above = tissue.potential_energy(x);
        x(k, i) = at - h;
        double const slope = (above - tissue.potential_energy(x)) / (2 * h);
        x(k, i) = at;
        CHECK(tissue.internal_force(i, x, still)[k] == Approx(-slope).epsilon(1e-4).margin(1e-5));
      }
  };
  auto const mesh = make_block<double>(4, 4, 4, 0.005, BlockPattern::alternating);
  auto const held_below = [](auto tissue) {
    for (int i = 0; i < tissue.size(); ++i)
      if (tissue.rest_position(i)[2] < 1e-6) tissue.nail(i);
    return tissue;
  };
  StableNeoHookean<double> const soft{.young = 1e4, .poisson = 0.4}, nearly{.young = 1e4, .poisson = 0.47};
  SECTION("two materials") {
    FiniteElements<double, StableNeoHookean<double>> tissue(mesh, {.density = 1000, .material = soft});
    std::array const hard{40, 41, 42, 43, 44};
    tissue.set_material(hard, {.young = 1e5, .poisson = 0.3}, 1500.0);
    SoftBody body(held_below(std::move(tissue)), BackwardEuler{});
    cut_and_move(body);
  }
  SECTION("nodal pressure") {
    SoftBody body(held_below(FiniteElements<double, StableNeoHookean<double>>(mesh, {.density = 1000, .material = nearly, .pressure = Pressure::nodal})), BackwardEuler{});
    cut_and_move(body);
  }
  SECTION("stiffness in rows") {
    SoftBody body(held_below(FiniteElements<double, StableNeoHookean<double>>(mesh, {.density = 1000, .material = soft, .stiffness = Stiffness::assembled})), BackwardEuler{});
    cut_and_move(body);
  }
  SECTION("a material that remembers") {
    using Slow = Viscoelastic<StableNeoHookean<double>>;
    Slow material;
    material.material = soft;
    material.terms[0] = {0.3, 0.1};
    SoftBody body(held_below(FiniteElements<double, Slow>(mesh, {.density = 1000, .material = material})), BackwardEuler{});
    cut_and_move(body);
  }
  SECTION("a zone") {
    SoftBody body(held_below(FiniteElements<double, StableNeoHookean<double>>(mesh, {.density = 1000, .material = soft})), BackwardEuler{}, ZoneOfInfluence{.rings = 2});
    body.apply_force(body.nearest_vertex({0.0075, 0.0075, 0.015}), {0, 0, -0.01});
    cut_and_move(body);
  }
  SECTION("a zone, and explicit steps") {
    FiniteElements<double, StableNeoHookean<double>> tissue(mesh, {.density = 1000, .material = soft});
    SoftBody body(held_below(std::move(tissue)), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 2});
    int const top = body.nearest_vertex({0.005, 0.005, 0.015});
    body.hold(top), body.drag(top, body.positions().col(top) - Vector(0, 0, 0.0005));
    double const step = 5e-6, whole = body.stable_step();
    cut_and_move(body, step);
    double const stable = body.stable_step();
    CHECK(step < stable);
    CHECK(stable < whole);
    REQUIRE(body.is_held(top));
    for (int k = 0; k < 1000; ++k) REQUIRE(body.step(0.9 * stable));
    auto const moved = [&] { return (body.positions() - body.rest_solid().points).colwise().norm().eval(); };
    CHECK(moved().maxCoeff() < 0.001);   // m: twice what it is held by; it rings, and does not blow up
    CHECK((moved().array() > 1e-4).count() > 10);
  }
  SECTION("a piece of its own") {
    auto body = block_body<Elements>(4);
    VolumeCutter<double> knife;
    stroke(knife, body, Vector(0.0071, -0.003, -0.01), Vector(0.0083, -0.003, 0.03), Vector(0, 0.022, 0), 40);
    auto const parts = pieces_of(body);
    REQUIRE(parts.size() == 2);
    auto one = part_of(body, parts[0]), two = part_of(body, parts[1]);
    CHECK(one.total_mass() + two.total_mass() == Approx(body.total_mass()).epsilon(1e-12));
    int wounds = 0;
    for (int t = 0; t < one.tissue().surface().triangle_count(); ++t) wounds += one.tissue().is_wound(t) ? 1 : 0;
    CHECK(wounds > 10);
    testing::SolidCutInvariants before(one);
    VolumeCutter<double> again;
    stroke(again, one, Vector(-0.01, 0.0061, -0.01), Vector(-0.01, 0.0061, 0.03), Vector(0.03, 0, 0), 40);
    CHECK(again.report().lip_area > 1e-5);
    CHECK(pieces(one) == 2);
  }
}

TEMPLATE_LIST_TEST_CASE("edges of several pieces, a depth to puncture, a bound on what a tick makes", "[volume_cutter]",
                        Solids) {
  SECTION("an edge of three pieces cuts like one, where it is straight") {
    auto one = block_body<TestType>(5), three = block_body<TestType>(5);
    VolumeCutter<double> knife, other;
    for (int tick = 0; tick <= 50; ++tick) {
      Vector const a(0.0093, -0.002 + 0.024 * tick / 50, -0.005), b(0.0093, a[1], 0.025);
      knife.advance(one, {a, b});
      std::array const points{a, Vector(a + (b - a) / 3), Vector(a + (b - a) * 2 / 3), b};
      other.advance(three, std::span<Vector const>(points));
    }
    CHECK(shape(one) == shape(three));
    CHECK(pieces(three) == 2);
  }
  SECTION("it cuts no sooner than it has punctured") {
    auto body = block_body<TestType>(5);
    VolumeCutter<double> knife({.puncture_depth = 0.003});
    auto const down = [&](double z) { knife.advance(body, {{0.0093, 0.0101, z}, {0.0093, 0.0101, z + 0.03}}); };
    for (double z = 0.022; z > 0.0172; z -= 0.0002) down(z);
    CHECK_FALSE(knife.is_cutting());
    CHECK(body.tissue().tetrahedra() == 320);
    for (double z = 0.0172; z > 0.010; z -= 0.0002) down(z);
    for (double y = 0.0101; y > 0.004; y -= 0.0002) knife.advance(body, {{0.0093, y, 0.01}, {0.0093, y, 0.04}});
    CHECK(knife.is_cutting());
    CHECK(knife.report().area > 0);
  }
  SECTION("what a tick does not make follows in the next ones") {
    auto at_once = block_body<TestType>(5), later = block_body<TestType>(5);
    VolumeCutter<double> fast, slow({.max_tetrahedra = 20});
    auto const to = [](double y) { return BladeSegment<double>{{0.0087, y, -0.005}, {0.0087, y, 0.025}}; };
    fast.advance(at_once, to(-0.002)), slow.advance(later, to(-0.002));
    fast.advance(at_once, to(0.022));
    int ticks = 0, most = 0;
    for (; pieces(later) == 1 && ticks < 100; ++ticks) {
      int const before = later.tissue().tetrahedra();
      slow.advance(later, to(0.022));
      most = std::max(most, later.tissue().tetrahedra() - before);
    }
    CHECK(ticks >= 5);
    CHECK(most < 120);
    CHECK(shape(at_once) == shape(later));
  }
}

TEST_CASE("what can not be cut with is refused in a sentence, and leaves the body as it was", "[volume_cutter]") {
  auto body = block_body<Elements>(3);
  VolumeCutter<double> knife;
  CHECK_THROWS_WITH(knife.advance(body, {Vector(0, 0, std::nan("")), Vector(0, 0, 1)}), Catch::Contains("point 0 of the blade is (0, 0, nan) m; it must be finite"));
  CHECK_THROWS_WITH(knife.advance(body, {Vector(0, 0, -500), Vector(0, 0, 500)}), Catch::Contains("is it in m?"));
  std::array const point{Vector(0, 0, 0)};
  CHECK_THROWS_WITH(knife.advance(body, std::span<Vector const>(point)), Catch::Contains("at least two"));
  CHECK_THROWS_WITH(VolumeCutter<double>({.snap = 0.5}), Catch::Contains("snap is 0.5"));
  CHECK_THROWS_WITH(VolumeCutter<double>({.puncture_depth = -1}), Catch::Contains("puncture depth is -1"));
  CHECK_THROWS_WITH(VolumeCutter<double>({.puncture_depth = 2}), Catch::Contains("the puncture depth is 2 m") && Catch::Contains("in mm it would be 0.002 m"));
  CHECK_THROWS_WITH(VolumeCutter<double>({.max_tetrahedra = 0}), Catch::Contains("at least 1"));
  CHECK_THROWS_WITH(VolumeCutter<double>({.edge = {{0, 0, 0}, {0, 0, 1}, {1, 1, INFINITY}}}), Catch::Contains("point 2 of the edge is (1, 1, inf) m"));
  CHECK_THROWS_WITH(knife.advance(body, {Vector(0, 0, 1), Vector(0, 0, 1)}),
                    Catch::Contains("the tick was not taken: the blade has no length from point 0 to point 1: both are (0, 0, 1) m; give it two different ends"));
  std::array const bent{Vector(0, 0, 0), Vector(0, 0, 0.01), Vector(0, 0, 0.01), Vector(0, 0.01, 0.02)};
  CHECK_THROWS_WITH(knife.advance(body, std::span<Vector const>(bent)), Catch::Contains("from point 1 to point 2"));
  CHECK_THROWS_WITH(VolumeCutter<double>({.edge = {{0, 0, 0.02}, {0, 0, 0.02}}}), Catch::Contains("both are (0, 0, 0.02) m in the tool's frame"));
  CHECK(body.tissue().tetrahedra() == 40);
  CHECK(body.size() == 27);
}

TEST_CASE("a tool whose force is no number is refused in mid-cut, and the cut goes on as if it had not been", "[volume_cutter]") {
  // Yardstick: the same cut without those ticks.
  auto const cut = [](bool disturbed) {
    auto body = block_body<Elements>(4);
    VolumeCutter<double> knife({.edge = {{0, 0, 0}, {0, 0, 0.03}}, .puncture_force = 0.2, .toughness = 50});
    for (int tick = 0; tick <= 40; ++tick) {
      ToolPose<double> const tool{.position = {0.0071, -0.002 + 0.019 * tick / 40, tick == 0 ? 0.02 : 0.004}};
      auto const refuse = [&](double force, char const* sentence) {
        CHECK_THROWS_WITH(knife.advance(body, tool, force), Catch::Contains(sentence));
        CHECK_THROWS_WITH(knife.resisted(Vector(0, force, 0)), Catch::Contains("it must be finite"));
      };
      if (disturbed) refuse(std::nan(""), "the tool presses with nan N; give a finite force"), refuse(INFINITY, "the tool presses with inf N"), refuse(-INFINITY, "with -inf N");
      double const pressed = tick < 10 ? 0.1 : 0.3;
      disturbed ? knife.advance(body, tool, pressed) : knife.advance(body, tool.position, pressed);   // a tip alone is a tool that is not turned
    }
    REQUIRE(knife.area() > 1e-5);
    return std::pair(shape(body), knife.area());
  };
  CHECK(cut(true) == cut(false));
}

TEST_CASE("a stroke goes on after a restore as it did before, where the cutter is restored as well; on another body it begins anew", "[volume_cutter]") {
  using Solid = FiniteElements<double, StableNeoHookean<double>>;
  auto const block = [](int nx, int ny, int nz, BlockPattern pattern) {
    return SoftBody(Solid(make_block<double>(nx, ny, nz, 0.005, pattern), {.density = 1000.0, .material = {.young = 1e4, .poisson = 0.4}}), BackwardEuler{});
  };
  auto const stroke = [](auto& body, VolumeCutter<double>& knife, int from, int to) {
    for (int i = from; i <= to; ++i) {
      double const y = -0.004 + 0.038 * i / 60;
      knife.advance(body, {{0.0113, y, -0.005}, {0.0113, y, 0.035}});
    }
  };
  auto undisturbed = block(7, 7, 7, BlockPattern::alternating), body = undisturbed;
  VolumeCutter<double> knife, other;
  stroke(undisturbed, knife, 0, 60);
  knife.lift(undisturbed);
  stroke(body, other, 0, 30);
  auto const saved = body.save();
  VolumeCutter<double> const then = other;
  stroke(body, other, 31, 45);
  body.restore(saved), other = then, other.resume(body);
  stroke(body, other, 31, 60);
  other.lift(body);
  CHECK(body.positions() == undisturbed.positions());
  CHECK(body.triangles() == undisturbed.triangles());
  CHECK(other.area() == knife.area());
  CHECK(other.area() == Approx(0.03 * 0.03).epsilon(1e-9));

  // A stroke that was to be forgotten when both were kept, since tetrahedra had got other numbers: the same tetrahedra are cut without that restore.
  for (bool const is_restored : {false, true}) {
    INFO((is_restored ? "restored" : "not restored"));
    auto eaten = block(6, 6, 6, BlockPattern::alternating);
    VolumeCutter<double> blade;
    Aspirator<double> tool({.tip_radius = 0.005, .reach = 0.008, .max_tetrahedra = 1000});
    auto const go = [&](double y) { blade.advance(eaten, {{0.0113, y, -0.01}, {0.0113, y, 0.04}}); };
    for (int tick = 0; tick <= 20; ++tick) go(-0.005 + 0.001 * tick);
    for (int tick = 0; tick < 15; ++tick) tool.advance(eaten, {{0.0125, 0.0125, 0.04 - 0.002 * tick}});
    REQUIRE(eaten.tissue().tetrahedra() == 590);
    if (is_restored) {
      auto const state = eaten.save();
      VolumeCutter<double> const kept = blade;
      eaten.restore(state), blade = kept, blade.resume(eaten);
    }
    go(0.0161);
    CHECK(eaten.tissue().tetrahedra() == 590);
    REQUIRE(eaten.step(1e-3));
  }

  // In mid-stroke to a body of as many particles and fewer tetrahedra.
  auto large = block(11, 11, 11, BlockPattern::kuhn), thin = block(2, 30, 30, BlockPattern::alternating);
  VolumeCutter<double> lost;
  for (int i = 0; i <= 20; ++i) lost.advance(large, {{0.0471, 0.053 - 0.001 * i, 0.041}, {0.0471, 0.053 - 0.001 * i, 0.06}});
  REQUIRE(thin.size() >= large.size());
  REQUIRE(thin.tissue().tetrahedra() < large.tissue().tetrahedra());
  for (double const y : {-0.003, 0.003, 0.009}) lost.advance(thin, {Vector(-0.002, y, 0.0713), Vector(0.007, y, 0.0713)});
  CHECK(thin.tissue().tetrahedra() > 0);
}

// Yardstick: the body that went on. The tetrahedra that a sweep begins with come in the order in which the search tree gives them.
TEST_CASE("steps and cuts go on to the byte after a restore in mid-stroke", "[volume_cutter]") {
  auto const mesh = make_block<double>(5, 5, 5, 0.01, BlockPattern::alternating);
  TensorMass<double> const tissue(mesh, {.density = 1000.0, .material = {.young = 5e3, .poisson = 0.4}});
  int differ = 0;
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    Random random(Seed{seed});
    SoftBody body(tissue, LeapfrogVerlet{});
    for (int i = 0; i < body.size(); ++i)
      if (mesh.points(2, i) < 1e-6) body.nail(i);
    body.set_gravity({random.uniform(0.0, 0.3), 0, -2});
    double const x = random.uniform(0.01, 0.04), aside = random.uniform(-0.002, 0.002), z = random.uniform(0.005, 0.035), tilt = random.uniform(-0.005, 0.005);
    int const last = 12, kept = 2 + static_cast<int>(random.below(9));
    VolumeCutter<double> knife;
    auto const go = [&](int from, int to) {
      for (int tick = from; tick <= to; ++tick) {
        double const y = -0.01 + 0.06 * tick / last, now = x + aside * tick / last;
        knife.advance(body, {{now, y, z}, {now + tilt, y, 0.06}});
        if (tick == last) knife.lift(body);
        body.step(1e-4);
      }
    };
    go(0, kept);
    auto const saved = body.save();
    auto const then = knife;
    go(kept + 1, last);
    Matrix3X<double> const went_on = body.positions(), rest = body.rest_mesh().points;
    body.restore(saved), knife = then, knife.resume(body);
    go(kept + 1, last);
    bool const is_same = body.size() == went_on.cols() && body.positions() == went_on && body.rest_mesh().points == rest;
    if (!is_same) ++differ, UNSCOPED_INFO("seed " << seed << ", saved after tick " << kept);
  }
  CHECK(differ == 0);
}

// Yardstick: the body that went on. The stable step comes from sums over packs that have followed the cuts.
TEST_CASE("the stable step of elements is the same to the byte after a restore in mid-stroke", "[volume_cutter]") {
  int differ = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    Random random(Seed{seed});
    SoftBody body(FiniteElements<double, StableNeoHookean<double>>(make_block<double>(4, 4, 4, 0.005, BlockPattern::alternating),
                                                                  {.density = 1000.0, .material = {.young = 1e4, .poisson = 0.4}}),
                  LeapfrogVerlet{});
    body.set_gravity({1, 0, -3});
    double const y = random.uniform(0.003, 0.012), tilt = random.uniform(-0.004, 0.004);
    int const kept = 3 + static_cast<int>(random.below(10));
    VolumeCutter<double> knife;
    auto const go = [&](int from, int to) {
      std::vector<double> steps;
      for (int tick = from; tick <= to; ++tick) {
        knife.advance(body, {{-0.002 + 0.001 * tick, y, 0.004}, {-0.002 + 0.001 * tick, y + tilt, 0.02}});
        steps.push_back(body.stable_step());
        body.step(0.9 * steps.back());
      }
      return steps;
    };
    go(0, kept);
    auto const saved = body.save();
    auto const then = knife;
    auto const steps = go(kept + 1, 18);
    Matrix3X<double> const went_on = body.positions();
    body.restore(saved), knife = then, knife.resume(body);
    if (go(kept + 1, 18) != steps || body.positions() != went_on) ++differ;
  }
  CHECK(differ == 0);
}

TEST_CASE("a restore in mid-stroke changes nothing where blades go along the faces of a solid, one through what others have left", "[volume_cutter]") {
  // Seeds that took, of some 9,000 ticks, what a new search tree visits beside the blade for a place to begin at; and for which an edge was to be divided that
  // splits had parted.
  for (std::uint64_t const seed : {189u, 612u}) {
    auto body = solid_body<Elements>(solid_of(5 * seed));
    Random random(Seed{seed});
    auto const direction = [&] {
      Vector d = Vector::Zero();
      while (d.norm() == 0)
        for (int axis = 2; axis >= 0; --axis) d[axis] = static_cast<double>(random.below(3)) - 1;
      return Vector(d.normalized());
    };
    std::array<VolumeCutter<double>, 3> knives;
    for (int stroke = 0; stroke < 6; ++stroke) {
      Vector middle;
      for (int axis = 2; axis >= 0; --axis) middle[axis] = 0.0025 * static_cast<double>(random.below(7));
      Vector const blade = direction();
      Vector way = direction();
      while (way.cross(blade).norm() < 0.1) way = direction();
      double const half = random.uniform(0.002, 0.015), far = random.uniform(0.003, 0.025);
      VolumeCutter<double>& knife = knives[static_cast<std::size_t>(stroke % 3)];
      for (int tick = 0; tick <= 6; ++tick) {
        Vector const at = middle + (tick / 3.0 - 1) * far * way;
        BladeSegment<double> const to{at - half * blade, at + half * blade};
        auto const saved = body.save();
        auto const then = knives;
        knife.advance(body, to);
        auto const once = body.rest_solid();
        auto const border = body.triangles().eval();
        for (auto& each : knives) each.lift(body);
        body.restore(saved), knives = then;
        for (auto& each : knives) each.resume(body);
        knife.advance(body, to);
        INFO("seed " << seed << ", stroke " << stroke << ", tick " << tick);
        REQUIRE(body.tissue().tetrahedra() == once.tetrahedra.cols());
        CHECK(body.rest_solid().tetrahedra == once.tetrahedra);
        CHECK(body.rest_solid().points == once.points);
        CHECK(body.triangles() == border);
      }
      if (random.below(2) == 0) knife.lift(body);
    }
  }
}
