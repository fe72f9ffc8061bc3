// SPDX-License-Identifier: MIT
// What a cut leaves as it was, and what follows it. Yardsticks: rest positions before; the plane that was swept; the other lip of a wound, searched triangle by
// triangle; the same cut with the other one moving; sums of mass and momentum; a tissue made anew; eigenvalues; a copy that is kept by the record of edits.
#include "catch.hpp"
#include "solid_strokes.hpp"
#include "solid_tissues.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/collision/closest_point.hpp>
#include <palpate/core/random.hpp>
#include <palpate/cutting/aspirator.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/material/viscoelastic.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/solid_edit.hpp>
#include <palpate/testing/solid_cut_invariants.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <set>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

using namespace palpate;
using namespace palpate_test;

namespace {

constexpr double edge = 0.005;   // m, of the blocks

auto block_body(int n, BlockPattern pattern = BlockPattern::alternating) {
  return SoftBody(Elements::tissue(make_block<double>(n, n, n, edge, pattern), 0.0), BackwardEuler{});
}
using ExplicitSolids = std::tuple<Elements, Tensors, Turned>;
struct Springs {
  static auto tissue(TetrahedralMesh<double> const& mesh, double prestrain) {
    return MassSpring<double>(mesh, {.mass = {.total = 0.1}, .link = {.stiffness = 50}, .link_prestrain = prestrain});
  }
};
using ExplicitBodies = std::tuple<Elements, Springs>;
BlockPattern pattern_of(std::uint64_t seed) { return seed % 2 == 0 ? BlockPattern::kuhn : BlockPattern::alternating; }

}  // namespace

TEST_CASE("vertices stay where they rest, and those of a wound are on the plane or as near to it as a crossing snaps", "[volume_cutter]") {
  // On an uncut edge from a vertex at height h to one at −k: the crossing is at h / (h + k) of it.
  int snapped = 0, farther = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    INFO("seed " << seed);
    Random random(Seed{seed});
    auto body = block_body(4, pattern_of(seed));
    auto const uncut = body.rest_solid();
    double const mean = body.mean_edge();
    AnyPlane const plane(random, 3 * edge);
    auto const report = plane.cut(body, 3 * edge, false);
    auto const cut = body.rest_solid();
    Eigen::Index const count = uncut.points.cols();
    CHECK(cut.points.leftCols(count) == uncut.points);
    std::set<int> corners;
    for (int t = 0; t < body.triangles().cols(); ++t)
      if (body.tissue().is_wound(t)) corners.insert(body.triangles().col(t).begin(), body.triangles().col(t).end());
    REQUIRE(corners.size() > 10);
    auto const height = [&](Place const& x) { return plane.normal.dot(x - plane.at); };
    int too_thin = 0;
    for (int const v : corners) {
      Place const x = cut.points.col(v);
      Eigen::Index old = 0;   // the vertex that it is, or a copy of
      while (old < count && uncut.points.col(old) != x) ++old;
      if (old == count) {
        CHECK(std::abs(height(x)) < 1e-9 * edge);
        continue;
      }
      double nearest = 1;   // in tolerances
      bool is_nearer = false;
      for (Eigen::Index t = 0; t < uncut.tetrahedra.cols(); ++t) {
        if ((uncut.tetrahedra.col(t).array() != static_cast<int>(old)).all()) continue;
        for (int const w : uncut.tetrahedra.col(t)) {
          double const h = height(x), k = -height(uncut.points.col(w));
          if (w == old || h * k < 0) continue;
          double const length = (x - uncut.points.col(w)).norm(), share = h / (h + k);
          nearest = std::min(nearest, share * length / std::max(0.15 * length, 0.05 * mean) / 1.000001);
          is_nearer = is_nearer || share < 0.5;
        }
      }
      CHECK(is_nearer);
      ++snapped, too_thin += nearest < 1 ? 0 : 1;
    }
    CHECK(too_thin <= 2 * report.too_thin);   // with its copy
    farther += too_thin;
  }
  CHECK(snapped > 400);
  INFO(farther << " of " << snapped << " farther");
  CHECK(farther < snapped / 20);
}

namespace {

/// How far the middle of a wound's triangle at rest is from the nearest one that faces it, at most [m]; and the area of the wounds [m²].
std::pair<double, double> gap_of(auto const& body) {
  struct Triangle {
    std::array<Place, 3> corners;
    Place normal;
  };
  std::vector<Triangle> wounds;
  double area = 0, farthest = 0;
  auto const mesh = body.rest_solid();
  for (int t = 0; t < body.triangles().cols(); ++t) {
    if (!body.tissue().is_wound(t)) continue;
    auto const x = [&](int k) { return Place(mesh.points.col(body.triangles()(k, t))); };
    Place const cross = (x(1) - x(0)).cross(x(2) - x(0));
    area += cross.norm() / 2;
    wounds.push_back({{x(0), x(1), x(2)}, cross.normalized()});
  }
  for (Triangle const& one : wounds) {
    Place const middle = (one.corners[0] + one.corners[1] + one.corners[2]) / 3;
    double nearest = std::numeric_limits<double>::infinity();
    for (Triangle const& other : wounds)
      if (one.normal.dot(other.normal) < -1 + 1e-9)
        nearest = std::min(nearest, (closest_point_on_triangle<double>(middle, other.corners[0], other.corners[1], other.corners[2]).point - middle).norm());
    farthest = std::max(farthest, nearest);
  }
  return {farthest, area};
}

}  // namespace

TEST_CASE("the lips of a wound lie on each other at rest, also where two cuts cross", "[volume_cutter]") {
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    INFO("seed " << seed);
    Random random(Seed{seed});
    auto body = block_body(4, pattern_of(seed));
    double area = 0;
    Place last = Place::Zero();
    for (int cuts = 0; cuts < 2;) {
      AnyPlane const plane(random, 3 * edge);
      if (std::abs(plane.normal.dot(last)) > 0.8) continue;
      area += plane.cut(body, 3 * edge, false).lip_area;
      auto const [gap, wounds] = gap_of(body);
      CHECK(gap < 1e-9 * edge);
      CHECK(wounds == Approx(area).epsilon(1e-9));
      last = plane.normal, ++cuts;
    }
    CHECK(pieces(body) == 4);
  }
}

TEST_CASE("a blade that rests while the tissue goes over it cuts what one does that goes through resting tissue", "[volume_cutter]") {
  // Yardstick: the same motion of one against the other, seen from the tissue.
  Place const low(0.0071, 0.0066, 0.0012), high(0.0085, 0.0079, 0.0181);
  for (BlockPattern const pattern : {BlockPattern::alternating, BlockPattern::kuhn}) {
    auto const tissue_at = [](double u) {
      Eigen::Translation3d const way(0.026 * (u - 0.55), 0.004 * std::sin(2 * u), 0.003 * u * u);
      return Eigen::Isometry3d(way * Eigen::AngleAxisd(0.6 * u, Place(0.2, 0.1, 1).normalized()));
    };
    auto const cut = [&](bool tissue_moves) {
      auto body = block_body(4, pattern);
      VolumeCutter<double> knife;
      for (int i = 0; i < body.size(); ++i) body.hold(i);
      for (int tick = 0; tick <= 120; ++tick) {
        Eigen::Isometry3d const at = tissue_at(tick / 120.0);
        for (int i = 0; tissue_moves && i < body.size(); ++i) {
          if (!body.is_held(i)) body.hold(i);
          body.drag(i, Place(at * body.tissue().rest_position(i)));
        }
        knife.advance(body, tissue_moves ? BladeSegment<double>{low, high} : BladeSegment<double>{at.inverse() * low, at.inverse() * high});
      }
      knife.lift(body);
      return body;
    };
    auto const over = cut(true), through = cut(false);
    REQUIRE(through.tissue().tetrahedra() > 150);
    CHECK(over.rest_solid().tetrahedra == through.rest_solid().tetrahedra);
    CHECK(over.triangles() == through.triangles());
    REQUIRE(over.size() == through.size());
    CHECK((over.rest_solid().points - through.rest_solid().points).cwiseAbs().maxCoeff() < 1e-12);
  }
}

TEST_CASE("where a held vertex splits the hand keeps one side, where a nailed one does both stay", "[volume_cutter]") {
  for (bool const nails : {false, true}) {
    INFO((nails ? "nailed" : "held"));
    auto tissue = Elements::tissue(make_block<double>(5, 5, 5, edge, BlockPattern::alternating), 0.0);
    int middle = -1;   // of the top
    for (int i = 0; i < tissue.size(); ++i)
      if ((tissue.rest_position(i) - Place(0.01, 0.01, 0.02)).norm() < 1e-9) middle = i;
    REQUIRE(middle >= 0);
    if (nails) tissue.nail(middle);
    SoftBody body(std::move(tissue), BackwardEuler{});
    body.set_gravity({0.3, -0.5, -9.81});
    if (!nails) body.hold(middle);
    for (int k = 0; k < 3; ++k) REQUIRE(body.step(1e-3));
    auto const sums = [&] {
      std::pair<Place, double> all{Place::Zero(), 0.0};
      for (int i = 0; i < body.size(); ++i) all.first += body.tissue().mass(i) * body.velocities().col(i), all.second += body.tissue().mass(i);
      return all;
    };
    auto const [momentum, mass] = sums();
    Place const fixed = body.positions().col(middle);
    VolumeCutter<double> knife;
    double const x = body.positions()(0, middle);
    stroke(knife, body, Place(x, -0.01, -0.01), Place(x, -0.01, 0.03), Place(0, 0.04, 0), 40);   // bends to the vertices of that plane
    auto const [after, all] = sums();
    CHECK((after - momentum).norm() < 1e-12 * momentum.norm());
    CHECK(all == Approx(mass).epsilon(1e-12));
    CHECK(pieces(body) == 2);
    int copy = -1, copies = 0;
    for (int i = 0; i < body.size(); ++i)
      if (i != middle && body.tissue().rest_position(i) == body.tissue().rest_position(middle)) copy = i, ++copies;
    REQUIRE(copies == 1);
    CHECK(body.positions().col(copy) == fixed);
    CHECK(body.tissue().nailed(middle) == nails);
    CHECK(body.tissue().nailed(copy) == nails);
    CHECK(body.is_held(middle) == !nails);
    CHECK_FALSE(body.is_held(copy));
    CHECK(body.velocities().col(copy).norm() == 0);   // as it was
    for (int k = 0; k < 30; ++k) REQUIRE(body.step(1e-3));
    CHECK(body.positions().col(middle) == fixed);
    if (nails)
      CHECK(body.positions().col(copy) == fixed);
    else
      CHECK(body.positions()(2, copy) < fixed[2] - 1e-3);   // that side falls: g t²/2 is 4 mm
  }
}

TEST_CASE("a cut body's stable step and row bounds are those of a body that is made of its tetrahedra", "[volume_cutter]") {
  // Made anew with one piece a metre away: vertices at one place are refused. stable_step() comes from a search of up to 60 products, raised by 5 %, that
  // begins where the last one ended: it is no closer than that. What bounds it in any case, row by row, is the same to rounding.
  auto uncut = SoftBody(Elements::tissue(make_block<double>(4, 4, 4, edge, BlockPattern::alternating), 0.0), LeapfrogVerlet{});
  auto body = uncut;
  double const before = body.stable_step();
  VolumeCutter<double> knife;
  stroke(knife, body, Place(0.0071, -0.01, -0.01), Place(0.0083, -0.01, 0.03), Place(0, 0.04, 0), 40);
  auto mesh = body.rest_solid();
  auto const parts = connected_components(mesh);
  REQUIRE(parts.size() == 2);
  for (int const i : parts[1]) mesh.points(0, i) += 1;
  auto tissue = Elements::tissue(mesh, 0.0);
  SoftBody lumped(std::as_const(uncut).tissue(), BackwardEuler{});
  VolumeCutter<double> same;
  stroke(same, lumped, Place(0.0071, -0.01, -0.01), Place(0.0083, -0.01, 0.03), Place(0, 0.04, 0), 40);
  for (int i = 0; i < body.size(); ++i) {
    REQUIRE(lumped.tissue().mass(i) == Approx(tissue.mass(i)).epsilon(1e-12));
    tissue.set_mass(i, body.tissue().mass(i));
  }
  SoftBody anew(std::move(tissue), LeapfrogVerlet{});
  CHECK(body.guaranteed_stable_step() == Approx(anew.guaranteed_stable_step()).epsilon(1e-9));
  for (int i = 0; i < body.size(); ++i) {
    REQUIRE(body.tissue().stiffness_bound(i) == Approx(anew.tissue().stiffness_bound(i)).epsilon(1e-9));
  }
  // The fastest mode, from forces differenced.
  Eigen::Index const n = 3 * body.size();
  Matrix3X<double> const rest = body.rest_solid().points, still = Matrix3X<double>::Zero(3, body.size());
  Eigen::MatrixXd scaled(n, n);
  double const step = 1e-6 * edge;
  auto const mass = [&](Eigen::Index k) { return body.tissue().mass(static_cast<int>(k / 3)); };
  for (Eigen::Index k = 0; k < n; ++k) {
    Matrix3X<double> ahead = rest, behind = rest;
    ahead(k % 3, k / 3) += step, behind(k % 3, k / 3) -= step;
    for (int i = 0; i < body.size(); ++i)
      scaled.col(k).segment<3>(3 * i) =
          (body.tissue().internal_force(i, behind, still) - body.tissue().internal_force(i, ahead, still)) / (2 * step * std::sqrt(mass(3 * i) * mass(k)));
  }
  double const fastest = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>((scaled + scaled.transpose()) / 2, Eigen::EigenvaluesOnly).eigenvalues()[n - 1];
  double const limit = 2 / std::sqrt(fastest);
  for (auto* const of : {&body, &anew}) {
    CHECK(of->stable_step() <= limit * (1 + 1e-6));
    CHECK(of->stable_step() >= 0.95 * limit);
  }
  CHECK(body.stable_step() < before);
}

TEST_CASE("row bounds after a cut do not depend on what viscoelastic tissue remembers", "[volume_cutter]") {
  // Yardstick: the same cut before anything has faded.
  auto const mesh = make_block<double>(5, 5, 5, edge, BlockPattern::alternating);
  auto const cut = [&](int steps) {
    Viscoelastic const law{StableNeoHookean<double>{.young = 5e3, .poisson = 0.45}, {{0.3, 0.1}, {0.6, 0.2}}};
    SoftBody body(FiniteElements<double, std::remove_const_t<decltype(law)>>(mesh, {.density = 1000, .material = law}), LeapfrogVerlet{});
    for (int i = 0; i < body.size(); ++i) body.drag(i, Place(1.6 * mesh.points(0, i), 0.8 * mesh.points(1, i), 0.8 * mesh.points(2, i)));
    for (int step = 0; step < steps; ++step) REQUIRE(body.step(4e-3));
    testing::SolidCutInvariants before(body, {.min_height = 0.0199 * body.mean_edge()});
    VolumeCutter<double> knife;
    stroke(knife, body, Place(0.017, -0.003, -0.01), Place(0.017, -0.003, 0.03), Place(0, 0.03, 0), 40);
    CHECK(testing::to_text(before.check(body)) == "");
    knife.lift(body);
    return body;
  };
  auto const fresh = cut(0), faded = cut(300);
  REQUIRE(fresh.size() == faded.size());
  REQUIRE(fresh.size() > 125);
  for (int i = 0; i < fresh.size(); ++i) CHECK(faded.tissue().stiffness_bound(i) == Approx(fresh.tissue().stiffness_bound(i)).epsilon(1e-12));
}

TEMPLATE_LIST_TEST_CASE("the explicit step of a solid outlasts a stroke of 3 to 8 edges: masses are evened out", "[volume_cutter]", ExplicitSolids) {
  // Yardsticks: a mesh refined evenly to as many particles, where the step is shorter as edges are; sums over the particles; x + h v + h²/2 f/m of each one, f at x + h/2 v.
  // PALPATE_ORGANS sets how many strokes.
  double least = 1, least_lumped = 1;
  for (std::uint64_t seed = 1, seeds = from_environment("PALPATE_ORGANS", 4); seed <= seeds; ++seed) {
    auto tissue = TestType::tissue(make_block<double>(7, 7, 7, edge, BlockPattern::alternating), 0.0);
    for (int i = 0; i < tissue.size(); ++i)
      if (tissue.rest_position(i)[2] < 1e-6) tissue.nail(i);
    SoftBody body(std::move(tissue), LeapfrogVerlet{});
    Random random(Seed{seed});
    auto const any = [&] { return Place(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)); };
    body.apply_force(body.nearest_vertex(Place(0.015, 0.015, 0.03)), {0.3, 0.2, -0.2});
    for (int step = 0; step < 20; ++step) REQUIRE(body.step(0.5 * body.stable_step()));
    double const before = body.stable_step(), guaranteed = body.guaranteed_stable_step();
    int const particles = body.size();
    struct Sums {
      double mass = 0, energy = 0;
      Place moment = Place::Zero(), momentum = Place::Zero();
    };
    auto const sums = [&] {
      Sums s;
      for (int i = 0; i < body.size(); ++i) {
        double const m = body.tissue().mass(i);
        Place const v = body.velocities().col(i);
        s.mass += m, s.energy += m / 2 * v.squaredNorm(), s.moment += m * body.tissue().rest_position(i), s.momentum += m * v;
        REQUIRE(m > 0);
      }
      return s;
    };
    Sums const then = sums();
    Place const middle = Place::Constant(0.015) + 0.006 * any(), blade = any().normalized(), way = any().normalized();
    double const length = edge * random.uniform(3.0, 8.0), width = edge * random.uniform(2.0, 6.0);
    VolumeCutter<double> knife;
    stroke(knife, body, middle - length / 2 * way - width / 2 * blade, middle - length / 2 * way + width / 2 * blade, length * way, 60);
    knife.lift(body);
    Sums const now = sums();
    CHECK(now.mass == Approx(then.mass).epsilon(1e-12));
    CHECK((now.moment - then.moment).norm() < 1e-12 * then.mass * 0.03);
    CHECK((now.momentum - then.momentum).norm() < 1e-12 * std::sqrt(then.mass * then.energy));
    CHECK(now.energy <= then.energy * (1 + 1e-12));
    double const even = std::cbrt(double(particles) / body.size()), step = body.stable_step();
    auto as_lumped = std::as_const(body).tissue();
    for (int i = 0; i < body.size(); ++i) {
      double sum = 0;
      for (int const t : as_lumped.elements_at(i)) sum += as_lumped.list().elements[static_cast<std::size_t>(t)].mass() / 4;
      as_lumped.set_mass(i, sum);
    }
    double const otherwise = SoftBody(std::move(as_lumped), LeapfrogVerlet{}).stable_step();
    INFO("seed " << seed << ": " << particles << " particles, then " << body.size() << "; the step is " << step / before << " of what it was, refined evenly " << even
                 << ", with masses as lumped " << otherwise / before);
    CHECK(step > 0.3 * even * before);
    CHECK(step > 0.95 * otherwise);   // some strokes hardly cut
    least = std::min(least, step / before), least_lumped = std::min(least_lumped, otherwise / before);
    CHECK(body.guaranteed_stable_step() > guaranteed / std::sqrt(4 * 1.25 * 1.25 * 1.25));   // what masses are evened out to, and a quarter more three times
    double const h = 0.9 * step;
    Matrix3X<double> const x = body.positions(), v = body.velocities(), half = x + h / 2 * v;
    REQUIRE(body.step(h));
    for (int i = 0; i < body.size(); ++i) {
      Place const a = body.tissue().nailed(i) ? Place(0, 0, 0) : Place(body.tissue().internal_force(i, half, v) / body.tissue().mass(i));
      CHECK((body.positions().col(i) - x.col(i) - h * v.col(i) - h * h / 2 * a).norm() < 1e-12 * edge);
    }
    for (int k = 0; k < 200; ++k) REQUIRE(body.step(h));
  }
  CHECK(least > 2 * least_lumped);
}

TEMPLATE_LIST_TEST_CASE("a nailed particle of a solid that is given mass stands still, and one in a hand moves as the hand does", "[volume_cutter]", ExplicitBodies) {
  // Strokes through a block in motion, of which every fourth particle is nailed and every fourth held.
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    INFO("seed " << seed);
    auto tissue = TestType::tissue(make_block<double>(6, 6, 6, edge, BlockPattern::kuhn), 0.0);
    for (int i = 0; i < tissue.size(); i += 4) tissue.nail(i);
    SoftBody body(std::move(tissue), LeapfrogVerlet{});
    Random random(Seed{seed});
    auto const any = [&] { return Place(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)); };
    for (int i = 0; i < body.size(); ++i) {
      if (i % 4 == 0) continue;
      body.drag(i, body.positions().col(i), 0.1 * any());
      if (i % 4 > 1) body.release(i);
    }
    Matrix3X<double> const before = body.velocities();
    for (int n = 0; n < 4; ++n) {
      Place const middle = Place::Constant(0.0125) + 0.01 * any(), blade = 0.02 * any().normalized(), way = 0.02 * any();
      VolumeCutter<double> knife;
      stroke(knife, body, middle - way / 2 - blade, middle - way / 2 + blade, way, 20);
      knife.lift(body);
    }
    for (int i = 0; i < body.size(); ++i) {
      if (body.tissue().nailed(i)) CHECK(body.velocities().col(i) == Place::Zero());
      if (body.is_held(i)) CHECK(body.velocities().col(i) == before.col(i));
    }
  }
}

TEMPLATE_LIST_TEST_CASE("masses are evened out beside particles of which all tetrahedra are gone, and those weigh nothing", "[volume_cutter]", ExplicitSolids) {
  // Yardsticks: the mass before, less what the tools say they have taken.
  int gone = 0, cut = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    INFO("seed " << seed);
    auto tissue = TestType::tissue(make_block<double>(5, 5, 5, edge, pattern_of(seed)), 0.0);
    tissue.nail(0);
    SoftBody body(std::move(tissue), LeapfrogVerlet{});
    auto const mass = [&] {   // of what hangs together at all
      double sum = 0;
      for (int i = 0; i < body.size(); ++i) sum += body.tissue().topology().tetrahedra_at(i).empty() ? 0 : body.tissue().mass(i);
      return sum;
    };
    double const whole = mass();
    Random random(Seed{seed});
    auto const any = [&] { return Place(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)); };
    VolumeCutter<double> knife({.debris = 40});
    Aspirator<double> tool({.tip_radius = 0.004, .reach = 0.006, .max_tetrahedra = 6});
    for (int n = 0; n < 6; ++n) {
      Place const middle = Place::Constant(2 * edge) + 1.5 * edge * any(), blade = 6 * edge * any().normalized(), way = 5 * edge * any().normalized();
      stroke(knife, body, middle - way / 2 - blade / 2, middle - way / 2 + blade / 2, way, 15);
      knife.lift(body);
      for (int tick = 0; tick < 4; ++tick) tool.advance(body, ToolPose<double>{.position = middle + (1 - 0.3 * tick) * way});
      REQUIRE(body.step(0.2 * body.stable_step()));
      CHECK(mass() == Approx(whole - knife.debris().mass - tool.report().mass).epsilon(1e-12));
    }
    gone += knife.debris().tetrahedra + tool.report().tetrahedra, cut += knife.report().tetrahedra_added;
    for (int i = 0; i < body.size(); ++i)
      if (body.tissue().topology().tetrahedra_at(i).empty()) CHECK((body.tissue().mass(i) == 0 && body.tissue().nailed(i)));
  }
  CHECK(gone > 200);
  CHECK(cut > 200);
}

TEST_CASE("a host's copy of the tetrahedra follows a cut by the record of edits", "[volume_cutter]") {
  // The record says where a vertex is inserted, which corners of which tetrahedra it takes, and what splits; which tetrahedra have the copy the body says.
  auto body = block_body(4, BlockPattern::kuhn);
  auto copy = body.rest_solid();
  std::vector<int> place;   // of each vertex, the one that was at its place first
  for (int i = 0; i < body.size(); ++i) place.push_back(i);
  std::size_t done = body.solid_edits().size();
  VolumeCutter<double> knife, other;
  int inserted = 0, split = 0;
  for (int tick = 0; tick <= 40; ++tick) {
    double const u = -0.002 + 0.019 * tick / 40;
    knife.advance(body, {{0.0071, u, 0.004}, {0.0083, u, 0.02}});
    if (tick > 10) other.advance(body, {{u, 0.0091, 0.0063}, {u, 0.0091, 0.02}});
    std::vector<int> copies;
    for (; done < body.solid_edits().size(); ++done) {
      using Kind = SolidEdit<double>::Kind;
      auto const& e = body.solid_edits()[done];
      REQUIRE(e.kind != Kind::removed);
      int const n = static_cast<int>(copy.points.cols());
      if (e.kind == Kind::divided) {
        REQUIRE(e.second == copy.tetrahedra.cols());
        copy.tetrahedra.conservativeResize(4, e.second + 1);
        copy.tetrahedra.col(e.second) = copy.tetrahedra.col(e.first);
        copy.tetrahedra(e.to, e.first) = n - 1, copy.tetrahedra(e.from, e.second) = n - 1;
        continue;
      }
      copy.points.conservativeResize(3, n + 1);
      place.push_back(e.kind == Kind::inserted ? n : place[static_cast<std::size_t>(e.first)]);
      if (e.kind == Kind::inserted) {
        copy.points.col(n) = (1 - e.s) * copy.points.col(e.first) + e.s * copy.points.col(e.second), ++inserted;
      } else {
        REQUIRE(e.second == n);
        copy.points.col(n) = copy.points.col(e.first), copies.push_back(n), ++split;
      }
    }
    REQUIRE(copy.points == body.rest_solid().points);
    auto const now = body.rest_solid().tetrahedra;
    REQUIRE(copy.tetrahedra.cols() == now.cols());
    for (Eigen::Index t = 0; t < now.cols(); ++t)
      for (int k = 0; k < 4; ++k) REQUIRE(place[static_cast<std::size_t>(copy.tetrahedra(k, t))] == place[static_cast<std::size_t>(now(k, t))]);
    for (int const v : copies)
      for (int const t : body.tissue().topology().tetrahedra_at(v))
        for (int k = 0; k < 4; ++k)
          if (now(k, t) == v) copy.tetrahedra(k, t) = v;
    REQUIRE(copy.tetrahedra == now);
  }
  CHECK(inserted > 50);
  CHECK(split > 30);
}
