// SPDX-License-Identifier: MIT
// Tissue taken away under a tool. Yardsticks: what nothing may change (testing/solid_cut_invariants.hpp), after every tick; a topology built anew from what is
// left; the tetrahedra in reach, searched one by one; cases counted by hand.
// PALPATE_ASPIRATIONS sets how many random ways (6 if not set), PALPATE_SEED with which seed they begin.
#include "catch.hpp"
#include "device/message.hpp"

#include <palpate/body/pieces.hpp>
#include <palpate/body/soft_body.hpp>
#include <palpate/core/random.hpp>
#include <palpate/cutting/aspirator.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/components.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/mesh/tetrahedra_where.hpp>
#include <palpate/testing/solid_cut_invariants.hpp>
#include <palpate/testing/tetrahedral_topology.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/volume/fill.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

using namespace palpate;
using palpate_test::message_of, palpate_test::unsaid;

namespace {

using Vector = Vector3<double>;

template <class S, class Integrator = BackwardEuler>
auto solid_body(TetrahedralMesh<S> const& mesh, SolidOptions<S, StableNeoHookean<S>> options = {}, Integrator integrator = {}) {
  options.density = 1000, options.material = {.young = S(1e4), .poisson = S(0.4)};
  return SoftBody(FiniteElements<S, StableNeoHookean<S>>(mesh, options), integrator);
}
template <class S>
TetrahedralMesh<S> as(TetrahedralMesh<double> const& mesh) {
  return {mesh.points.cast<S>(), mesh.tetrahedra};
}
/// Two balls, one in the other: what is between them.
TetrahedralMesh<double> shell() {
  auto outer = make_sphere<double>(0.015, 8), inner = make_sphere<double>(0.009, 6);
  auto const first = static_cast<int>(outer.points.cols());
  TriangleMesh<double> both{Matrix3X<double>(3, first + inner.points.cols()), Matrix<int, 3, Dynamic>(3, outer.triangles.cols() + inner.triangles.cols())};
  both.points << outer.points, inner.points;
  inner.triangles.row(1).swap(inner.triangles.row(2));
  both.triangles << outer.triangles, (inner.triangles.array() + first).matrix();
  return fill(both, {.edge = 0.005}).mesh;
}
auto sorted_tetrahedra(TetrahedralTopology const& solid) {
  std::vector<std::array<int, 4>> all;
  for (int t = 0; t < solid.tetrahedron_count(); ++t) all.push_back(solid.corners(t)), std::sort(all.back().begin(), all.back().end());
  std::sort(all.begin(), all.end());
  return all;
}
auto sorted_triangles(SurfaceTopology const& surface) {
  std::vector<std::array<int, 3>> all;
  for (int t = 0; t < surface.triangle_count(); ++t) {
    auto c = surface.corners(t);
    std::rotate(c.begin(), std::min_element(c.begin(), c.end()), c.end());
    all.push_back(c);
  }
  std::sort(all.begin(), all.end());
  return all;
}
template <class Body>
std::string violations(testing::SolidCutInvariants<Body> const& before, Body& body, AspiratorReport const& report) {
  return testing::to_text(before.check(body, {.volume = report.volume, .mass = report.mass}));
}
/// Down to a place from above, in so many ticks.
template <class S, class Body>
void lower(Aspirator<S>& tool, Body& body, Vector const& to, int ticks) {
  for (int k = ticks; k >= 0; --k) tool.advance(body, Vector(to + Vector(0, 0, 0.03 * k / ticks)).cast<S>());
}

}  // namespace

static_assert(ResettableCutter<Aspirator<double>, decltype(solid_body(TetrahedralMesh<double>()))>);

TEST_CASE("a topology from which tetrahedra are taken is the one built anew from the others", "[cutting][aspirator]") {
  auto const mesh = make_block<double>(4, 4, 4, 0.01, BlockPattern::alternating);
  TetrahedralTopology solid(mesh);
  auto left = sorted_tetrahedra(solid);
  Random random(Seed{7});
  while (solid.tetrahedron_count() > 1) {
    int const t = static_cast<int>(random.below(static_cast<std::uint64_t>(solid.tetrahedron_count()))), faces = solid.border().triangle_count();
    auto gone = solid.corners(t);
    auto const removal = solid.remove_tetrahedron(t);
    CHECK(removal.corners == gone);
    CHECK(solid.border().triangle_count() == faces + static_cast<int>(removal.opened_count) - static_cast<int>(removal.gone_count));
    std::sort(gone.begin(), gone.end());
    left.erase(std::find(left.begin(), left.end(), gone));
    REQUIRE(sorted_tetrahedra(solid) == left);
    TetrahedralTopology const anew(solid.vertex_count(), solid.tetrahedra());
    REQUIRE(sorted_triangles(solid.border()) == sorted_triangles(anew.border()));
    REQUIRE(testing::to_text(testing::check_tetrahedral_topology(solid)) == "");
  }
}

TEST_CASE("a tool that stays takes all tetrahedra whose middle it reaches, and no other", "[cutting][aspirator]") {
  auto const mesh = make_block<double>(7, 7, 7, 0.005, BlockPattern::alternating);
  auto body = solid_body(mesh);
  testing::SolidCutInvariants const before(body);
  Vector const tip(0.0153, 0.0147, 0.0291);
  double const reach = 0.009;
  double volume = 0;
  int count = 0;
  for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t) {
    auto const p = [&](int k) { return Vector(mesh.points.col(mesh.tetrahedra(k, t))); };
    if (((p(0) + p(1) + p(2) + p(3)) / 4 - tip).norm() > reach) continue;
    volume += (p(1) - p(0)).cross(p(2) - p(0)).dot(p(3) - p(0)) / 6, ++count;
  }
  REQUIRE(count > 50);
  Aspirator<double> tool({.tip_radius = 0.004, .reach = reach, .max_tetrahedra = 7});
  tool.advance(body, Vector(tip + Vector(0, 0, 0.03)));
  CHECK(tool.state() == CuttingPhase::no_contact);
  int ticks = 0;
  for (; ticks < 100 && tool.report().tetrahedra < count; ++ticks) {
    int const so_far = tool.report().tetrahedra;
    tool.advance(body, tip);
    CHECK(tool.report().tetrahedra - so_far <= 7);
    REQUIRE(violations(before, body, tool.report()) == "");
  }
  CHECK(ticks == (count + 6) / 7);
  CHECK(tool.report().tetrahedra == count);
  CHECK(tool.report().volume == Approx(volume).epsilon(1e-12));
  CHECK(tool.report().mass == Approx(1000 * volume).epsilon(1e-12));
  CHECK(tool.report().refused == 0);
  tool.advance(body, tip);
  CHECK(tool.report().tetrahedra == count);
  CHECK(body.tissue().tetrahedra() == mesh.tetrahedra.cols() - count);
}

TEST_CASE("a tick takes no more volume than it may", "[cutting][aspirator]") {
  auto const mesh = make_block<double>(7, 7, 7, 0.005, BlockPattern::alternating);
  auto body = solid_body(mesh, {.prestrain = 0.02});
  double const largest = 0.005 * 0.005 * 0.005 / 3;   // of the five in a cube the one in the middle
  Aspirator<double> tool({.tip_radius = 0.004, .reach = 0.02, .max_tetrahedra = 1000, .max_volume = 2 * largest});
  tool.advance(body, Vector(0.015, 0.015, 0.06));
  for (int k = 0; k < 5; ++k) {
    double const so_far = tool.report().volume;
    tool.advance(body, Vector(0.015, 0.015, 0.032));
    CHECK(tool.report().volume - so_far >= 2 * largest * (1 - 1e-9));
    CHECK(tool.report().volume - so_far < 3 * largest * (1 + 1e-9));
  }
}

TEST_CASE("what stays keeps its velocity, and mass and momentum go with the tetrahedra", "[cutting][aspirator]") {
  auto body = solid_body(make_block<double>(6, 6, 6, 0.005, BlockPattern::alternating));
  body.set_gravity({0.3, 0.2, -9.81});
  for (int i = 0; i < 36; ++i) body.nail(i);
  for (int k = 0; k < 10; ++k) body.step(0.002);
  Matrix3X<double> const velocity = body.velocities();
  std::vector<double> mass;
  for (int i = 0; i < body.size(); ++i) mass.push_back(body.tissue().mass(i));
  Vector const momentum = body.momentum();
  Aspirator<double> tool({.tip_radius = 0.006, .reach = 0.009, .max_tetrahedra = 40});
  lower(tool, body, {0.0125, 0.0125, 0.024}, 10);
  REQUIRE(tool.report().tetrahedra > 20);
  Vector gone = Vector::Zero();
  double lost = 0;
  int empty = 0;
  for (int i = 0; i < static_cast<int>(mass.size()); ++i) {
    double const less = mass[static_cast<std::size_t>(i)] - body.tissue().mass(i);
    gone += less * velocity.col(i), lost += less;
    if (body.tissue().mass(i) > 0)
      CHECK(body.velocities().col(i) == velocity.col(i));
    else
      CHECK((++empty, body.velocities().col(i).isZero(0)));
  }
  REQUIRE(body.size() == static_cast<int>(mass.size()));
  CHECK(empty > 0);
  CHECK(lost == Approx(tool.report().mass).epsilon(1e-12));
  CHECK((body.momentum() - (momentum - gone)).norm() < 1e-12 * momentum.norm());
}

TEST_CASE("a solid from which tetrahedra were taken is the one built anew without them", "[cutting][aspirator]") {
  auto const mesh = make_block<double>(6, 6, 6, 0.005, BlockPattern::alternating);
  for (auto const pressure : {Pressure::element, Pressure::nodal}) {
    SolidOptions<double, StableNeoHookean<double>> const options{.density = 1000, .material = {.young = 1e4, .poisson = 0.45}, .pressure = pressure};
    auto const made_of = [&](TetrahedralMesh<double> const& tetrahedra) {
      FiniteElements<double, StableNeoHookean<double>> tissue(tetrahedra, options);
      tissue.set_material(tetrahedra_where(tetrahedra, [](Vector const& middle) { return middle.x() < 0.013; }), {.young = 7e4, .poisson = 0.3}, 1300);
      return tissue;
    };
    SoftBody body(made_of(mesh), BackwardEuler{});
    Aspirator<double> tool({.tip_radius = 0.006, .reach = 0.009, .max_tetrahedra = 13});
    lower(tool, body, {0.0125, 0.0125, 0.024}, 30);
    REQUIRE(tool.report().tetrahedra > 20);
    REQUIRE(tool.report().vertices_split == 0);   // a mesh with vertices at one place would be refused
    auto const& tissue = body.tissue();
    auto const rest = body.rest_solid();
    TetrahedralMesh<double> left{Matrix3X<double>(3, rest.points.cols()), rest.tetrahedra};
    std::vector<int> now(static_cast<std::size_t>(rest.points.cols()), -1), before;
    for (int& v : left.tetrahedra.reshaped()) {
      int& place = now[static_cast<std::size_t>(v)];
      if (place < 0) place = static_cast<int>(before.size()), left.points.col(place) = rest.points.col(v), before.push_back(v);
      v = place;
    }
    left.points.conservativeResize(3, std::ssize(before));
    REQUIRE(std::ssize(before) < rest.points.cols());
    auto const anew = made_of(left);
    Random random(Seed{3});
    Matrix3X<double> x(3, left.points.cols()), all = rest.points;
    for (int i = 0; i < x.cols(); ++i) {
      for (int k = 0; k < 3; ++k) x(k, i) = left.points(k, i) + random.uniform(-5e-4, 5e-4);
      all.col(before[static_cast<std::size_t>(i)]) = x.col(i);
    }
    Matrix3X<double> const still = Matrix3X<double>::Zero(3, rest.points.cols());
    CHECK(tissue.potential_energy(all) == Approx(anew.potential_energy(x)).epsilon(1e-12));
    for (int i = 0; i < x.cols(); ++i) {
      int const was = before[static_cast<std::size_t>(i)];
      Vector const expected = anew.internal_force(i, x, still);
      CHECK((tissue.internal_force(was, all, still) - expected).norm() <= 1e-11 * anew.stiffness_bound(i) * 5e-4);
      CHECK(tissue.mass(was) == Approx(anew.mass(i)).epsilon(1e-12));
      CHECK(tissue.stiffness_bound(was) == Approx(anew.stiffness_bound(i)).epsilon(1e-9));
    }
  }
}

TEMPLATE_TEST_CASE("particles of no tetrahedron do no harm", "[cutting][aspirator]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const try_out = [](auto body) {
    for (int i = 0; i < 36; ++i) body.nail(i);
    Aspirator<S> tool({.tip_radius = S(0.006), .reach = S(0.009), .max_tetrahedra = 40});
    lower(tool, body, {0.0125, 0.0125, 0.024}, 10);
    int empty = -1;
    for (int i = 0; i < body.size(); ++i)
      if (!(body.tissue().mass(i) > 0)) empty = i;
    REQUIRE(empty >= 0);
    body.set_gravity({0, 0, S(-9.81)});
    body.apply_force(empty, {1, 2, 3});
    body.hold(empty), body.release(empty);
    for (int k = 0; k < 20; ++k) body.step(S(2e-4));
    CHECK(body.positions().allFinite());
    CHECK(body.stable_step() > 0);
    CHECK(std::isfinite(body.guaranteed_modal_bounds().squared_frequency));
    CHECK(body.solve_statics({}, S(1e-3)).converged);
    CHECK(body.positions().allFinite());
    CHECK(body.reaction(empty).allFinite());
    CHECK(pieces_of(body).size() == 1);
    auto const part = part_of(body, pieces_of(body)[0]);
    CHECK(part.tissue().tetrahedra() == body.tissue().tetrahedra());
  };
  auto const mesh = as<S>(make_block<double>(6, 6, 6, 0.005, BlockPattern::alternating));
  try_out(solid_body(mesh));
  try_out(solid_body(mesh, {.pressure = Pressure::nodal}));
  try_out(solid_body(mesh, {}, LeapfrogVerlet{}));
}

TEST_CASE("a plate one tetrahedron thick is pierced where all round the place is in reach, else it stays closed", "[cutting][aspirator]") {
  auto const mesh = make_block<double>(9, 9, 2, 0.005, BlockPattern::alternating);
  for (double const reach : {0.003, 0.011}) {
    INFO("reach " << reach);
    auto body = solid_body(mesh);
    testing::SolidCutInvariants const before(body);
    Aspirator<double> tool({.tip_radius = 0.003, .reach = reach, .max_tetrahedra = 200});
    tool.advance(body, Vector(0.0203, 0.0197, 0.04));
    for (int k = 0; k < 30; ++k) {
      tool.advance(body, Vector(0.0203, 0.0197, 0.0079 - 0.0002 * k));
      REQUIRE(violations(before, body, tool.report()) == "");
    }
    // Euler characteristic of the border, which is closed: 2 of a plate, 0 of a plate with a hole.
    auto const& border = body.tissue().surface();
    int vertices = 0;
    for (int i = 0; i < body.size(); ++i) vertices += border.triangles_at(i).empty() ? 0 : 1;
    CHECK(vertices - border.triangle_count() / 2 == (reach > 0.005 ? 0 : 2));
  }
}

TEST_CASE("a bar that is taken through falls in two, and a small piece goes as debris", "[cutting][aspirator]") {
  auto const mesh = make_block<double>(13, 3, 3, 0.005, BlockPattern::alternating);   // 240 tetrahedra
  for (int const debris : {0, 60}) {
    auto body = solid_body(mesh);
    for (int i = 0; i < body.size(); ++i)
      if (body.tissue().rest_position(i).x() < 0.001) body.nail(i);
    testing::SolidCutInvariants const before(body);
    Aspirator<double> tool({.tip_radius = 0.004, .reach = 0.008, .max_tetrahedra = 6, .debris = debris});
    for (double const y : {0.002, 0.008})
      for (int k = 0; k < 60; ++k) {
        tool.advance(body, Vector(0.0501, y, 0.02 - 0.0005 * k));
        REQUIRE(violations(before, body, tool.report()) == "");
      }
    auto const pieces = connected_components(body.rest_solid());
    CHECK(pieces.size() == (debris > 0 ? 1u : 2u));
    CHECK(pieces_of(body).size() == pieces.size());
  }
}

TEST_CASE("the last tetrahedron stays", "[cutting][aspirator]") {
  auto body = solid_body(make_block<double>(3, 3, 3, 0.005, BlockPattern::alternating));
  testing::SolidCutInvariants const before(body);
  Aspirator<double> tool({.tip_radius = 0.02, .reach = 0.05, .max_tetrahedra = 11, .debris = 100});
  for (int k = 0; k < 20; ++k) {
    tool.advance(body, Vector(0.005, 0.005, 0.06 - 0.003 * k));
    REQUIRE(violations(before, body, tool.report()) == "");
    body.step(0.001);
    REQUIRE(body.positions().allFinite());
  }
  CHECK(body.tissue().tetrahedra() == 1);
}

TEMPLATE_TEST_CASE("whatever is taken away, the border stays a manifold, and undo is whole", "[cutting][aspirator][random]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const from_environment = [](char const* name, std::uint64_t otherwise) {
    char const* const asked = std::getenv(name);
    return asked != nullptr ? std::stoull(asked) : otherwise;
  };
  std::uint64_t const ways = from_environment("PALPATE_ASPIRATIONS", 6), first = from_environment("PALPATE_SEED", 1);
  std::array const solids{make_block<double>(5, 5, 5, 0.006, BlockPattern::alternating), fill(make_sphere<double>(0.014, 8), {.edge = 0.006}).mesh, shell()};
  int removed = 0, split = 0, refused = 0, debris = 0;
  for (std::uint64_t seed = first; seed - first < ways; ++seed) {
    Random random(Seed{seed});
    auto const& solid = solids[seed % 3];
    auto const run = [&](auto& body, bool is_checked) {
      Random again = random;
      auto const any_vector = [&] { return Vector(again.uniform(-1.0, 1.0), again.uniform(-1.0, 1.0), again.uniform(-1.0, 1.0)); };
      Vector const low = solid.points.rowwise().minCoeff(), high = solid.points.rowwise().maxCoeff(), size = high - low;
      if (seed % 2 == 0) {   // cut it first
        VolumeCutter<S> knife;
        Vector const middle = (low + high) / 2 + 0.2 * size.cwiseProduct(any_vector()), blade = any_vector().normalized(), way = any_vector().normalized();
        for (int tick = 0; tick <= 10; ++tick) {
          Vector const at = middle + (0.2 * tick - 1) * size.norm() * way;
          knife.advance(body, {Vector(at - size.norm() * blade).template cast<S>(), Vector(at + 0.1 * size.norm() * blade).template cast<S>()});
        }
        knife.lift(body);
      }
      testing::SolidCutInvariants const before(body);
      Aspirator<S> tool({.tip_radius = S(again.uniform(0.002, 0.006)),
                         .reach = S(again.uniform(0.006, 0.01)),
                         .max_tetrahedra = 1 + static_cast<int>(again.below(30)),
                         .debris = static_cast<int>(again.below(2)) * 12});
      std::string wrong;
      for (int way = 0; way < 2 && wrong.empty(); ++way) {
        Vector const from = (low + high) / 2 + 1.2 * size.norm() * any_vector().normalized(), to = (low + high) / 2 + 0.5 * size.cwiseProduct(any_vector());
        int const ticks = 12 + static_cast<int>(again.below(12));
        for (int tick = 0; tick <= ticks && wrong.empty(); ++tick) {
          tool.advance(body, Vector(from + (1.2 * tick / ticks) * (to - from)).template cast<S>());
          if (tick % 3 == 0) body.step(S(1e-3));
          refused += tool.report().refused;
          if (is_checked) wrong = violations(before, body, tool.report());
        }
      }
      if (is_checked) CHECK((wrong.empty() ? "" : "seed " + std::to_string(seed) + ": " + wrong) == "");
      return tool.report();
    };
    auto body = solid_body(as<S>(solid));
    auto const whole = body.save();
    auto const copy = body;
    auto const report = run(body, true);
    removed += report.tetrahedra, split += report.vertices_split, debris += report.debris;
    auto twin = copy;
    run(twin, false);
    REQUIRE(twin.size() == body.size());
    CHECK(twin.positions() == body.positions());
    CHECK(twin.velocities() == body.velocities());
    CHECK(twin.tissue().topology().tetrahedra() == body.tissue().topology().tetrahedra());
    CHECK(twin.triangles() == body.triangles());
    body.restore(whole);
    CHECK(body.positions() == copy.positions());
    CHECK(body.triangles() == copy.triangles());
    CHECK(testing::to_text(testing::SolidCutInvariants(copy).check(body)) == "");
    CHECK(body.solid_edits().empty());
  }
  CHECK(removed > 10 * static_cast<int>(ways));
  CHECK(split > 0);
  CHECK(refused > 0);
  CHECK(debris > 0);
}

TEST_CASE("a host's copy of the triangles is patched by the record of changes where tetrahedra go", "[cutting][aspirator]") {
  auto body = solid_body(make_block<double>(6, 6, 6, 0.005, BlockPattern::alternating));
  Matrix<int, 3, Dynamic> copy = body.triangles();
  body.forget_changes();
  Aspirator<double> tool({.tip_radius = 0.005, .reach = 0.008, .max_tetrahedra = 9});
  for (int k = 0; k < 40; ++k) {
    tool.advance(body, Vector(0.0125, 0.0125, 0.035 - 0.0006 * k));
    auto const changes = body.changes();
    copy.conservativeResize(3, changes.triangle_count);
    for (int const t : changes.triangles) copy.col(t) = body.triangles().col(t);
    for (int t = changes.first_triangle; t < changes.triangle_count; ++t) copy.col(t) = body.triangles().col(t);
    REQUIRE(copy == body.triangles());
    body.forget_changes();
  }
  CHECK(tool.report().tetrahedra > 100);
}

TEST_CASE("a blade in a body from which another tool takes tetrahedra begins anew, and the body stays sound", "[cutting][aspirator]") {
  auto body = solid_body(make_block<double>(6, 6, 6, 0.005, BlockPattern::alternating));
  testing::SolidCutInvariants const before(body);
  VolumeCutter<double> knife;
  Aspirator<double> tool({.tip_radius = 0.005, .reach = 0.008, .max_tetrahedra = 3});
  for (int k = 0; k < 60; ++k) {
    double const y = -0.005 + 0.0006 * k;
    knife.advance(body, {{0.0113, y, -0.01}, {0.0113, y, 0.04}});
    if (k % 3 == 0) tool.advance(body, Vector(0.0125, 0.0125, 0.038 - 0.0004 * k));
    REQUIRE(violations(before, body, tool.report()) == "");
  }
  CHECK(tool.report().tetrahedra > 20);
}

TEST_CASE("an aspirator refuses what it can not be, in one line", "[cutting][aspirator]") {
  using Options = AspiratorOptions<double>;
  auto const made = [](Options const& options) { return message_of([&] { Aspirator<double>{options}; }); };
  CHECK(unsaid(made({.tip_radius = 0}), "tip radius is 0 m") == "");
  CHECK(unsaid(made({.tip_radius = 0.01, .reach = 0.005}), "reach is 0.005 m", "0.01 m") == "");
  CHECK(unsaid(made({.max_tetrahedra = 0}), "max_tetrahedra is 0") == "");
  CHECK(unsaid(made({.max_volume = 0}), "max_volume is 0 m3") == "");
  CHECK(unsaid(made({.debris = -1}), "debris is -1") == "");
  auto body = solid_body(make_block<double>(3, 3, 3, 0.005, BlockPattern::alternating));
  Aspirator<double> tool;
  CHECK(unsaid(message_of([&] { tool.advance(body, Vector(0, std::nan(""), 0)); }), "tip is (0, nan, 0)") == "");
}
