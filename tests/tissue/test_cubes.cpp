// SPDX-License-Identifier: MIT
// Yardsticks: points and faces counted by hand and by sets of coordinates; a bar under load and its Poisson's ratio; force against the differences of energy;
// what splitting must not change; brute force for the nearest point; two springs in series under a tool; what is the same after a restore to the byte.
#include "allocation_trap.hpp"
#include "catch.hpp"
#include "device/message.hpp"
#include "tissue/cube_octree.hpp"

#include <palpate/body/concept.hpp>
#include <palpate/cutting/no_cutter.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/repair.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/models.hpp>
#include <palpate/simulator/body_loop.hpp>
#include <palpate/testing/body.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

using namespace palpate;
using namespace palpate_test;

static_assert(SimulatedBody<Cubes<double>> && SimulatedBody<Cubes<float>>);
static_assert(SearchableBody<Cubes<double>> && StatesMobility<Cubes<float>> && CountsRenumberings<Cubes<double>>);

namespace {

constexpr double edge = 0.01, young = 5000;   // m, Pa

template <class S>
TriangleMesh<S> block_skin(int nx, int ny, int nz) {   // cubes
  TriangleMesh<S> skin = surface(make_block<S>(nx + 1, ny + 1, nz + 1, S(edge), BlockPattern::alternating));
  repair(skin);   // without the points inside
  return skin;
}
template <class S>
Cubes<S> block(int nx, int ny, int nz, CubesOptions<S> options = {}) {
  options.edge = S(edge), options.young = S(young);
  return Cubes<S>(block_skin<S>(nx, ny, nz), options);
}

/// Places in units of a hundredth of an edge.
template <class S>
std::array<int, 3> grid_place(Vector3<S> const& x) {
  return {int(std::lround(double(x[0]) * 1e4)), int(std::lround(double(x[1]) * 1e4)), int(std::lround(double(x[2]) * 1e4))};
}
template <class Body>
int places(Body const& body) {
  std::set<std::array<int, 3>> all;
  for (int i = 0; i < body.size(); ++i) all.insert(grid_place<typename Body::Scalar>(body.reference_position(i)));
  return int(all.size());
}
template <class Body>
int vertex_at(Body const& body, typename Body::Vector const& place) {
  int best = 0;
  for (int i = 1; i < body.size(); ++i)
    if ((body.reference_position(i) - place).squaredNorm() < (body.reference_position(best) - place).squaredNorm()) best = i;
  return best;
}

/// Edges of the skin that not exactly one triangle has on each side.
template <class Body>
int open_edges(Body const& body) {
  std::map<std::pair<int, int>, int> directed;
  auto const triangles = body.triangles();
  for (int t = 0; t < triangles.cols(); ++t)
    for (int k = 0; k < 3; ++k) ++directed[{triangles(k, t), triangles((k + 1) % 3, t)}];
  int open = 0;
  for (auto const& [e, count] : directed) {
    auto const other = directed.find({e.second, e.first});
    open += other == directed.end() || other->second != count;
  }
  return open;
}

/// Stress times a quarter of a face on each corner of the cubes at both ends along an axis [N].
template <class Body>
void pull(Body& body, int axis, double stress) {
  using S = typename Body::Scalar;
  auto const [low, high] = low_and_high(body.rest_mesh().points);
  for (int c = 0; c < body.cubes(); ++c)
    for (int k = 0; k < 8; ++k) {
      int const v = body.corners(c)[std::size_t(k)];
      S const place = body.reference_position(v)[axis];
      bool const is_far = (k >> axis & 1) != 0;
      if (std::abs(place - (is_far ? high : low)[axis]) < S(edge / 10))
        body.apply_force(v, S((is_far ? 1 : -1) * stress * edge * edge / 4) * Vector3<S>::Unit(axis));
    }
}
template <class Body>
double stretch(Body const& body, int a, int b) {
  return double((body.positions().col(a) - body.positions().col(b)).norm() / (body.reference_position(a) - body.reference_position(b)).norm()) - 1;
}

template <class Body>
void shake(Body& body, double far) {   // by forces, since hanging vertices follow
  using S = typename Body::Scalar;
  for (int i = 0; i < body.size(); ++i) body.apply_force(i, S(far) * Vector3<S>::Random());
}

template <class Body>
std::set<std::array<int, 3>> sorted_triangles(Body const& body) {
  std::set<std::array<int, 3>> all;
  for (int t = 0; t < body.tissue().surface().triangle_count(); ++t) all.insert(body.tissue().surface().corners(t));
  return all;
}
template <class Body>
bool are_same(Body const& a, Body const& b) {
  return a.size() == b.size() && a.positions() == b.positions() && a.velocities() == b.velocities() && a.triangles() == b.triangles();
}

}  // namespace

TEMPLATE_TEST_CASE("a split makes the 19 missing of 27 points and 8 children, and no vertex is there twice", "[tissue][cubes]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto lone = block<S>(1, 1, 1, {.levels = 1});
  CHECK(lone.size() == 8);
  CHECK(lone.triangles().cols() == 12);
  CHECK(lone.split(0));
  CHECK_FALSE(lone.split(0));
  CHECK(lone.size() == 27);
  CHECK(places(lone) == 27);
  CHECK(lone.leaves() == 8);
  CHECK(lone.triangles().cols() == 48);
  CHECK(open_edges(lone) == 0);
  CHECK(lone.join(0));
  CHECK(lone.size() == 8);
  CHECK(lone.triangles().cols() == 12);

  for (int const levels : {1, 2, 3}) {
    auto body = block<S>(3, 3, 3, {.levels = levels, .touched_cubes = 1});
    int const parts = 1 << levels;
    CHECK(body.size() == 64);
    std::set<int> split;
    std::srand(4);
    for (int k = 0; k < 40; ++k) {
      int const c = std::rand() % 27;
      if (split.erase(c) != 0)
        body.join(c);
      else
        split.insert(c), body.split(c);
      std::set<std::array<int, 3>> expected;   // by coordinates, of all split cubes and of the rest
      for (int cube = 0; cube < 27; ++cube) {
        int const n = split.count(cube) != 0 ? parts : 1;
        for (int z = 0; z <= n; ++z)
          for (int y = 0; y <= n; ++y)
            for (int x = 0; x <= n; ++x)
              expected.insert(grid_place<double>(edge * Vector3<double>(cube % 3 + double(x) / n, cube / 3 % 3 + double(y) / n, cube / 9 + double(z) / n)));
      }
      CHECK(body.size() == int(expected.size()));
      CHECK(places(body) == body.size());
      CHECK(body.leaves() == 27 + int(split.size()) * (parts * parts * parts - 1));
      CHECK(open_edges(body) == 0);
      CHECK(surface_area(body.mesh()) == Approx(54 * edge * edge).epsilon(1e-4));
      CHECK(volume(body.mesh()) == Approx(27 * edge * edge * edge).epsilon(1e-4));
      S mass = 0;
      for (int i = 0; i < body.size(); ++i) mass += body.mass(i);
      CHECK(mass == Approx(0.027).epsilon(1e-4));
    }
  }
}

TEST_CASE("cubes fill a surface, better the smaller they are, and say what they can not fill", "[tissue][cubes]") {
  double const exact = 4 * std::numbers::pi / 3 * 1e-3;
  for (double const h : {0.02, 0.01, 0.005}) {
    Cubes<double> const ball(make_sphere<double>(0.1, 12), {.edge = h, .young = young});
    CHECK(ball.volume() == Approx(exact).epsilon(0.5 * h / 0.02 * 0.2));
    CHECK(open_edges(ball) == 0);
    CHECK(volume(ball.mesh()) == Approx(ball.volume()));
  }
  auto const skin = block_skin<double>(1, 1, 1);
  CHECK(unsaid(message_of([&] { Cubes<double>(skin, {.edge = 0, .young = young}); }), "edge is 0 m") == "");
  CHECK(unsaid(message_of([&] { Cubes<double>(skin, {.edge = 0.01, .young = 5}); }), "Cubes: .young is 5 Pa", "kPa times 1,000") == "");
  CHECK(unsaid(message_of([&] { Cubes<double>(skin, {.edge = 0.01, .young = young, .density = 1.06}); }), "Cubes: .density is 1.06 kg/m3", "g/cm3 times 1,000") == "");
  CHECK_NOTHROW(Cubes<double>(skin, {.edge = 0.01, .young = young, .density = 0}));
  CHECK(unsaid(message_of([&] { Cubes<double>(skin, {.edge = 1e-6, .young = young}); }), "give an edge above") == "");
  CHECK(unsaid(message_of([&] { Cubes<double>(skin, {.edge = 0.01, .young = young, .relaxation = 2}); }), "relaxation is 2") == "");
  CHECK(unsaid(message_of([&] { Cubes<double>(skin, {.edge = 0.01, .young = young, .levels = 7}); }), "levels is 7") == "");
  auto open = skin;
  open.triangles.conservativeResize(3, open.triangles.cols() - 1);
  CHECK_THROWS_AS((Cubes<double>(open, {.edge = 0.01, .young = young})), InvalidMesh);
  Cubes<double> body(skin, {.edge = 0.01, .young = young, .levels = 1});
  CHECK_THROWS_AS(body.apply_force(8, {0, 0, 1}), OutOfRange);
  CHECK(unsaid(message_of([&] { body.apply_force(0, {0, 0, NAN}); }), "must be finite") == "");
  body.split(0);
  CHECK(unsaid(message_of([&] { body.nail(20); }), "only the first 8 vertices can be nailed") == "");
}

TEMPLATE_TEST_CASE("a bar of cubes has Young's modulus E and Poisson's ratio 1/4, split or not", "[tissue][cubes]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  bool const is_float = std::is_same_v<S, float>;
  double const strain = is_float ? 1e-3 : 1e-6, within = is_float ? 5e-3 : 1e-4;
  for (int axis = 0; axis < 3; ++axis)
    for (int const levels : {0, 1, 2}) {
      auto body = block<S>(axis == 0 ? 4 : 2, axis == 1 ? 4 : 2, axis == 2 ? 4 : 2, {.levels = levels});
      if (levels > 0) body.split(axis == 0 ? 1 : axis == 1 ? 2 : 4), body.split(axis == 0 ? 6 : axis == 1 ? 5 : 9);   // not where it is pulled
      pull(body, axis, strain * young);
      auto const report = body.solve_statics(is_float ? S(3e-8) : S(1e-13), 20000);
      CHECK(report);
      int const corner = vertex_at(body, Vector3<S>::Zero());
      for (int a = 0; a < 3; ++a) {
        int const other = vertex_at(body, Vector3<S>(S(2 * edge) * Vector3<S>::Unit(a)));
        CHECK(stretch(body, corner, other) == Approx(a == axis ? strain : -strain / 4).epsilon(within));
      }
    }
}

TEMPLATE_TEST_CASE("forces of cubes are the slope of their energy, sum to nothing, and turn with the body", "[tissue][cubes]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  std::srand(7);
  auto body = block<S>(2, 3, 2, {.pretension = S(0.1), .levels = 1, .sweeps = 1});
  body.split(3), body.split(8);
  shake(body, 0.02);
  body.solve_statics(S(0), 1);   // which splits nothing
  // What pulls vertices that lead, with what hangs on them, is all there is: no force and no moment on the whole.
  Vector3<double> sum = Vector3<double>::Zero(), moment = Vector3<double>::Zero();
  double size = 0;
  for (int i = 0; i < body.size(); ++i) {
    Vector3<double> const force = body.net_force(i).template cast<double>();
    sum += force, size += force.norm(), moment += Vector3<double>(body.positions().col(i).template cast<double>()).cross(force);
    if (body.hangs(i)) CHECK(force.norm() == 0);
  }
  double const within = 1e2 * double(std::numeric_limits<S>::epsilon());
  CHECK(size > 0.01);
  CHECK(sum.norm() < within * size);
  CHECK(moment.norm() < within * size * 0.03);
  if constexpr (std::is_same_v<S, double>) {
    auto state = body.save();
    for (int i = 0; i < body.size(); i += 3) {
      if (body.hangs(i)) continue;
      body.restore(state);
      Vector3<S> const force = body.net_force(i);
      for (int a = 0; a < 3; ++a) {
        std::array<S, 2> energy{};
        for (int const side : {0, 1}) {
          auto moved = state;
          S const d = side == 0 ? S(-1e-7) : S(1e-7);
          moved.u(a, i) += d;
          body.restore(moved);   // which does not move what hangs
          for (int h = 0; h < body.size(); ++h)
            if (body.hangs(h)) {
              Vector3<S> const home = body.reference_position(h);   // on an edge or a face of unsplit cubes: weights by distance, from coordinates alone
              Vector3<S> const apart = (body.reference_position(i) - home).cwiseAbs() / S(edge);
              Vector3<S> between = home / S(edge);
              S weight = 1;
              for (int b = 0; b < 3; ++b) {
                bool const is_on_grid = std::abs(between[b] - std::round(between[b])) < 1e-6;
                weight *= is_on_grid ? (apart[b] < 1e-6 ? S(1) : S(0)) : std::max(S(0), 1 - apart[b]);
              }
              moved.u(a, h) += weight * d;
            }
          body.restore(moved);
          energy[std::size_t(side)] = body.elastic_energy();
        }
        INFO("vertex " << i << " axis " << a);
        CHECK(force[a] == Approx(-(energy[1] - energy[0]) / 2e-7).epsilon(1e-5).margin(1e-8));
      }
    }
    body.restore(state);
    Eigen::Quaternion<S> const turn = Eigen::Quaternion<S>::UnitRandom();
    auto turned = body;
    for (int i = 0; i < body.size(); ++i) state.u.col(i) = turn * (body.positions().col(i)) + Vector3<S>(1, 2, 3) - body.reference_position(i);
    turned.restore(state);
    for (int i = 0; i < body.size(); ++i) CHECK((turned.net_force(i) - turn * body.net_force(i)).norm() < 1e-10);
  }
}

TEMPLATE_TEST_CASE("hanging vertices follow their edge or face: no gap opens", "[tissue][cubes]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  std::srand(9);
  for (int const levels : {1, 2}) {
    auto body = block<S>(3, 3, 2, {.levels = levels, .sweeps = 2});
    body.split(4), body.split(1), body.split(17);
    for (int round = 0; round < 5; ++round) {
      shake(body, 0.02);
      body.solve_statics(S(0), 2);   // which splits nothing
      int hanging = 0;
      for (int h = 0; h < body.size(); ++h) {
        if (!body.hangs(h)) continue;
        ++hanging;
        // The corners of the smallest grid edge or face that holds it, from coordinates.
        Vector3<S> const home = body.reference_position(h) / S(edge);
        Vector3<S> mean = Vector3<S>::Zero();
        for (int k = 0; k < 8; ++k) {
          S weight = 1;
          Vector3<S> corner;
          for (int a = 0; a < 3; ++a) {
            S const below = std::floor(home[a] + S(1e-4)), part = home[a] - below;
            corner[a] = S(edge) * (below + S(k >> a & 1));
            weight *= (k >> a & 1) != 0 ? part : 1 - part;
          }
          if (weight > S(1e-4)) mean += weight * body.positions().col(vertex_at(body, corner));
        }
        CHECK((body.positions().col(h) - mean).norm() < S(edge) * 200 * std::numeric_limits<S>::epsilon());
      }
      CHECK(hanging > 8);
      CHECK(open_edges(body) == 0);
    }
  }
}

TEMPLATE_TEST_CASE("nails, home springs and gravity: what holds a column of cubes", "[tissue][cubes]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  bool const is_float = std::is_same_v<S, float>;
  auto column = block<S>(1, 1, 6, {.density = S(10)});   // light, so that strains are small
  for (int i = 0; i < column.size(); ++i)
    if (column.reference_position(i)[2] < S(1e-4)) column.support(i, S(1));
  column.set_gravity({0, 0, S(-9.81)});
  CHECK(column.solve_statics(is_float ? S(1e-8) : S(1e-13)));
  // Weight m g on four springs; above, u' = −ρ g (L − z)/E but for the lumped masses: a half cube at each end.
  double const weight = 10 * 9.81 * edge * edge * 6 * edge;
  for (int i = 0; i < column.size(); ++i) {
    double const z = double(column.reference_position(i)[2]), length = 6 * edge;
    double const fall = weight / 4 + 10 * 9.81 / young * (length * z - z * z / 2);
    CHECK(-column.displacement(i)[2] == Approx(fall).epsilon(1e-3));
  }
  auto nailed = block<S>(2, 2, 2, {.levels = 1});
  for (int i = 0; i < nailed.size(); ++i)
    if (nailed.reference_position(i)[2] < S(1e-4)) nailed.nail(i);
  nailed.split(0);
  int held = 0;
  for (int i = 0; i < nailed.size(); ++i) {
    held += nailed.tissue().nailed(i);
    if (nailed.tissue().nailed(i)) CHECK(nailed.reference_position(i)[2] < S(1e-4));
  }
  CHECK(held == 9 + 5);   // the middle of the split cube's lower face, and of its four edges
  shake(nailed, 0.01);
  nailed.step(S(1e-3));
  for (int i = 0; i < nailed.size(); ++i)
    if (nailed.tissue().nailed(i)) CHECK(nailed.displacement(i).norm() == 0);
}

TEST_CASE("cubes that are visited by chance go on the same to the byte where loads stay the same", "[tissue][cubes]") {
  auto body = block<double>(4, 3, 3, {.order = VisitOrder::random, .sweeps = 2});
  body.nail(0), body.set_gravity({0, 0, -9.81});
  body.step(1e-3);
  auto const saved = body.save();
  body.step(1e-3);
  Matrix3X<double> const first = body.positions();
  body.restore(saved), body.step(1e-3);
  CHECK(body.positions() == first);
  auto other = block<double>(4, 3, 3, {.levels = 1, .order = VisitOrder::random, .sweeps = 2});
  CHECK_THROWS_WITH(other.restore(saved), says("levels", "it is another body's"));
}

TEMPLATE_TEST_CASE("cubes go on the same to the byte after a restore, split, cut and touched", "[tissue][cubes]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  for (auto const order : {VisitOrder::breadth_first, VisitOrder::index, VisitOrder::random}) {
    auto body = block<S>(4, 3, 3, {.pretension = S(0.05), .levels = 1, .join_after = 7, .order = order, .sweeps = 2});
    for (int i = 0; i < body.size(); ++i)
      if (body.reference_position(i)[2] < S(1e-4)) body.nail(i);
    auto const tick = [&](int k) {
      Vector3<S> const tip(S(0.02) + S(0.015) * std::cos(S(0.05) * S(k)), S(0.015) + S(0.01) * std::sin(S(0.05) * S(k)), S(0.03));
      auto const touched = body.nearest_point(tip);
      for (int k2 = 0; k2 < 3; ++k2)
        body.apply_force(body.tissue().surface().corners(touched.triangle)[std::size_t(k2)], Vector3<S>(0, 0, -touched.barycentric[k2] * S(0.1)));
      body.step(S(1e-3));
    };
    for (int k = 0; k < 30; ++k) tick(k);
    body.cut({S(0.0201), S(-1), S(0.015)}, {S(0.0201), S(-1), S(1)}, {S(0.0201), S(0.02), S(0.015)}, {S(0.0201), S(0.02), S(1)});
    CHECK(body.opened_faces() > 0);
    for (int k = 30; k < 40; ++k) tick(k);
    body.apply_force(5, {S(0.01), 0, 0});
    auto const saved = body.save();
    std::size_t const restorations = body.restorations();
    for (int k = 40; k < 90; ++k) tick(k);
    auto const first = body;
    body.split(0), body.nail(body.corners(35)[7]), body.step(S(0.1));
    body.restore(saved);
    CHECK(body.restorations() == restorations + 1);
    for (int k = 40; k < 90; ++k) tick(k);
    CHECK(are_same(body, first));
    body.restore(first.save());
    CHECK(are_same(body, first));
  }
}

TEMPLATE_TEST_CASE("a blade opens cubes across its plane alone, where the source opens them along it too", "[tissue][cubes]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto body = block<S>(4, 4, 4), as_source = body;
  int const vertex = vertex_at(body, Vector3<S>(S(0.02), S(0.01), S(0.03)));
  // In the middle of the block in x, through a quarter of its section: y < 20 mm, z > 20 mm.
  CHECK(body.cut({S(0.0201), -1, S(0.02)}, {S(0.0201), -1, 1}, {S(0.0201), S(0.02), S(0.02)}, {S(0.0201), S(0.02), 1}) == 4);
  CHECK(body.opened_faces() == 4);
  CHECK(body.size() == 125 + 4);   // of 3 × 3 vertices the wound's front, 5, is shared
  CHECK(places(body) == 125);
  CHECK(body.triangles().cols() == 6 * 16 * 2 + 4 * 2 * 2);
  CHECK(open_edges(body) == 0);
  CHECK(body.cut({S(0.0201), -1, S(0.02)}, {S(0.0201), -1, 1}, {S(0.0201), S(0.02), S(0.02)}, {S(0.0201), S(0.02), 1}) == 0);
  // All copies around one vertex: eight, and of twelve faces eight lie along the blade.
  CHECK(as_source.detach(vertex) == 12);
  int beside = 0;
  for (int i = 0; i < as_source.size(); ++i) beside += (as_source.reference_position(i) - as_source.reference_position(vertex)).norm() < S(1e-4);
  CHECK(beside == 8);
  beside = 0;
  for (int i = 0; i < body.size(); ++i) beside += (body.reference_position(i) - body.reference_position(vertex)).norm() < S(1e-4);
  CHECK(beside == 2);
}

TEMPLATE_TEST_CASE("a cut in many strokes is that of one, through split cubes too, and leaves two pieces", "[tissue][cubes]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto once = block<S>(5, 4, 3, {.levels = 1}), often = once;
  once.split(11), once.split(37), often.split(11), often.split(37);
  Vector3<S> const along = Vector3<S>(S(0.3), 1, 0), up(S(0.1), 0, 1), start(S(0.017), S(-0.011), S(-0.013));
  auto const at = [&](S s, S t) { return Vector3<S>(start + S(0.07) * (s * along + t * up)); };
  int const faces = once.cut(at(0, 0), at(0, 1), at(1, 0), at(1, 1));
  int sum = 0;
  for (int k = 0; k < 17; ++k) sum += often.cut(at(S(k) / 17, 0), at(S(k) / 17, 1), at(S(k + 1) / 17, 0), at(S(k + 1) / 17, 1));
  CHECK(sum == faces);
  CHECK(once.positions() == often.positions());   // triangles of wounds are numbered as they were opened
  CHECK(sorted_triangles(once) == sorted_triangles(often));
  CHECK(open_edges(once) == 0);
  CHECK(volume(once.mesh()) == Approx(60 * edge * edge * edge).epsilon(1e-4));
  // Which sides cubes are on, by the middle of each; linked cubes of two sides would share a vertex.
  Vector3<S> const normal = along.cross(up);
  std::vector<int> side(std::size_t(once.size()), 0);
  int mixed = 0;
  for (int c = 0; c < once.cubes(); ++c) {
    Vector3<S> const middle(S(edge) * (S(c % 5) + S(0.5)), S(edge) * (S(c / 5 % 4) + S(0.5)), S(edge) * (S(c / 20) + S(0.5)));
    int const here = (middle - start).dot(normal) > 0 ? 1 : 2;
    for (int const v : once.corners(c)) side[std::size_t(v)] |= here;
  }
  for (int const both : side) mixed += both == 3;
  CHECK(mixed == 0);
}

TEMPLATE_TEST_CASE("a cut gapes by the pre-tension, and springs stay in balance", "[tissue][cubes]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  bool const is_float = std::is_same_v<S, float>;
  double const tension = 0.1;
  auto body = block<S>(6, 2, 2, {.pretension = S(tension)});
  // One vertex is held at each end, both on one line: each half shrinks towards its own.
  int const left = vertex_at(body, Vector3<S>(0, S(0.01), S(0.01))), right = vertex_at(body, Vector3<S>(S(0.06), S(0.01), S(0.01)));
  body.nail(left), body.nail(right);
  CHECK(body.solve_statics(is_float ? S(1e-6) : S(1e-9), 3000));
  CHECK(body.cut({S(0.0301), -1, -1}, {S(0.0301), -1, 1}, {S(0.0301), 1, -1}, {S(0.0301), 1, 1}) == 4);
  CHECK(body.size() == 7 * 9 + 9);
  body.solve_statics(is_float ? S(1e-7) : S(1e-11), 20000);
  std::vector<double> middle;
  for (int i = 0; i < body.size(); ++i)
    if ((body.reference_position(i) - Vector3<S>(S(0.03), S(0.01), S(0.01))).norm() < S(1e-4)) middle.push_back(double(body.positions()(0, i)));
  REQUIRE(middle.size() == 2);
  CHECK(std::abs(middle[0] - middle[1]) == Approx(tension * 0.06).epsilon(is_float ? 0.01 : 1e-4));
  CHECK(double(body.elastic_energy()) < 1e-7);
}

TEMPLATE_TEST_CASE("depth first through the octree and the box tree find the same point of the skin", "[tissue][cubes]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  std::srand(21);
  Cubes<S> body(make_sphere<S>(S(0.05), 10), {.edge = S(0.01), .young = S(young), .levels = 1, .sweeps = 2});
  CubeOctree octree(body);
  int wrong = 0;
  for (int round = 0; round < 10; ++round) {
    for (int k = 0; k < 5; ++k) body.apply_force(std::rand() % body.size(), S(0.1) * Vector3<S>::Random());
    for (int const c : {7 * round, 40 * round % body.cubes()}) round % 3 == 2 ? body.join(c) : body.split(c);
    if (round == 5) body.cut({S(0.001), -1, 0}, {S(0.001), -1, 1}, {S(0.001), 1, 0}, {S(0.001), 1, 1});
    body.step(S(1e-3));
    octree.fit(body);
    for (int k = 0; k < 1000; ++k) {
      Vector3<S> const p = S(0.07) * Vector3<S>::Random();
      auto const by_boxes = body.nearest_point(p), by_octree = octree.nearest_point(body, p);
      S exact = std::numeric_limits<S>::infinity();
      if (k % 10 == 0)
        for (int t = 0; t < body.triangles().cols(); ++t) {
          auto const c = body.tissue().surface().corners(t);
          auto const x = body.positions();
          exact = std::min(exact, std::sqrt(closest_point_on_triangle<S>(p, x.col(c[0]), x.col(c[1]), x.col(c[2])).squared_distance));
        }
      wrong += std::abs(by_boxes.distance - by_octree.distance) > S(0.1) * 10 * std::numeric_limits<S>::epsilon();
      wrong += k % 10 == 0 && std::abs(by_octree.distance - exact) > S(0.1) * 10 * std::numeric_limits<S>::epsilon();
    }
  }
  CHECK(wrong == 0);
  CHECK_FALSE(body.nearest_point(Vector3<S>::Constant(std::numeric_limits<S>::quiet_NaN())).found());
}

TEMPLATE_TEST_CASE("a tool splits the cube it touches, and it is joined when it is left; nothing is allocated", "[tissue][cubes]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  REQUIRE(trap_works());
  for (int const levels : {0, 1, 2}) {
    auto body = block<S>(6, 4, 3, {.levels = levels, .join_after = 30, .sweeps = 3});
    for (int i = 0; i < body.size(); ++i)
      if (body.reference_position(i)[2] < S(1e-4)) body.nail(i);
    BodyLoop loop(std::move(body), NoCutter<S>(), ContactCoupling{}, 100);
    S const top = S(0.03), deep = S(1e-3);
    int k = 0, most = 0;
    S least = 1e9, largest = 0;
    auto const slide = [&](int until) {   // comes down in 20 ticks, then along x at 20 mm/s
      for (; k < until; ++k) {
        S const z = k < 1600 ? top - deep * std::min(S(1), S(k - 10) / 20) : top + deep;
        S const force = loop.tick({Vector3<S>(S(0.013) + S(2e-5) * S(std::clamp(k - 30, 0, 1570)), S(0.018), z)}, S(1e-3)).tissue_force.norm();
        if (k > 200 && k < 1600) least = std::min(least, force), largest = std::max(largest, force);
        int split = 0;
        for (int c = 0; c < loop.body().cubes(); ++c) split += loop.body().is_split(c);
        most = std::max(most, split);
      }
    };
    slide(120);
    AllocationCount const allocations;
    slide(1500);
    long const count = allocations.count();
    CHECK(count == 0);
    CHECK(loop.counts().diverged == 0);
    CHECK(most >= (levels > 0 ? 1 : 0));
    CHECK(most <= (levels > 0 ? 2 : 0));   // the touched one, and for 30 ms the one before
    CHECK(least > S(0.01));
    CHECK(largest < S(0.5));
    slide(1800);
    CHECK(loop.body().leaves() == loop.body().cubes());
  }
}

TEMPLATE_TEST_CASE("a tool that stays feels cubes at rest: a steady force, that of the coupling and of the springs", "[tissue][cubes]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  for (double const stiffness : {500.0, 2000.0, 50000.0})
    for (int const sweeps : {1, 6})
      for (int const levels : {0, 1}) {
        auto body = block<S>(4, 4, 3, {.levels = levels, .sweeps = sweeps});
        for (int i = 0; i < body.size(); ++i)
          if (body.reference_position(i)[2] < S(1e-4)) body.nail(i);
        BodyLoop loop(std::move(body), NoCutter<S>(), ContactCoupling{.stiffness = stiffness}, 100);
        S const top = S(0.03);
        S least = 1e9, most = 0;
        Vector3<S> tip;
        for (int k = 0; k < 700; ++k) {
          tip = {S(0.0175), S(0.0181), top - S(2e-3) * std::min(S(1), S(k - 10) / 100)};
          S const force = loop.tick({tip}, S(1e-3)).tissue_force.norm();
          if (k >= 600) least = std::min(least, force), most = std::max(most, force);
        }
        INFO(stiffness << " N/m, " << sweeps << " sweeps, levels " << levels << ": " << least << " to " << most << " N");
        CHECK(most - least < S(2e-3) * most);
        auto const& contact = loop.cutter().contact();
        CHECK(most == Approx(S(stiffness) * (contact.point - tip).dot(contact.normal)).epsilon(0.02));
        // The same force on the body alone, solved: the touched point goes as deep.
        auto alone = loop.body();
        auto const corners = alone.tissue().surface().corners(contact.triangle);
        for (int k = 0; k < 3; ++k) alone.apply_force(corners[std::size_t(k)], -contact.barycentric[k] * most * contact.normal);
        alone.solve_statics(std::is_same_v<S, float> ? S(1e-6) : S(1e-10));
        Vector3<S> point = Vector3<S>::Zero();
        for (int k = 0; k < 3; ++k) point += contact.barycentric[k] * alone.positions().col(corners[std::size_t(k)]);
        CHECK((point - contact.point).norm() < S(2e-5));
      }
}

TEMPLATE_TEST_CASE("a force on four corners is that on the point itself, on the nearest vertex it turns the body", "[tissue][cubes]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  std::srand(5);
  for (int const levels : {0, 1}) {
    auto body = block<S>(3, 3, 2, {.levels = levels});
    if (levels > 0) body.split(13), body.split(9);
    S most_off = 0;
    for (int k = 0; k < 200; ++k) {
      Vector3<S> const p(S(0.03) * S(std::rand()) / S(RAND_MAX), S(0.03) * S(std::rand()) / S(RAND_MAX), S(0.021)), force(0, 0, -1);
      auto const touched = body.nearest_point(p);
      for (auto const spread : {TouchSpread::face_corners, TouchSpread::nearest_vertex}) {
        body.apply_force_at(touched, force, spread);
        Vector3<S> sum = Vector3<S>::Zero(), moment = Vector3<S>::Zero();
        for (int i = 0; i < body.size(); ++i) {
          Vector3<S> const f = body.net_force(i);
          sum += f, moment += (body.positions().col(i) - touched.point).cross(f);
        }
        CHECK((sum - force).norm() < S(1e-5));
        if (spread == TouchSpread::face_corners)
          CHECK(moment.norm() < S(1e-6));
        else
          most_off = std::max(most_off, moment.norm());
        body.restore(body.save());
        auto clean = body.save();
        clean.load.setZero(), clean.loaded.clear();
        body.restore(clean);
      }
    }
    CHECK(most_off > S(0.005));   // N m per N: half a diagonal of a face is 7 mm
    CHECK(most_off < S(0.0072));
  }
}

TEMPLATE_TEST_CASE("cubes keep the laws of bodies", "[tissue][cubes]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  for (int const levels : {0, 1}) {
    Cubes<S> body(make_sphere<S>(S(0.05), 8), {.edge = S(0.015), .young = S(young), .levels = levels});
    for (int i = 0; i < body.size(); ++i)
      if (body.reference_position(i)[2] < S(-0.03)) body.nail(i);
    CAPTURE(levels);
    CHECK(testing::to_text(testing::check_body(body)) == "");
    body.cut({S(0.001), -1, 0}, {S(0.001), -1, 1}, {S(0.001), 1, 0}, {S(0.001), 1, 1});
    CHECK(testing::to_text(testing::check_body(body)) == "");
  }
}

TEMPLATE_TEST_CASE("a piece of cubes that nothing holds has no weight", "[tissue][cubes]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto body = block<S>(4, 2, 2), whole = body;
  for (auto* one : {&body, &whole})
    for (int i = 0; i < one->size(); ++i)
      if (one->reference_position(i)[0] < S(1e-4)) one->nail(i);
  body.set_gravity({0, 0, S(-9.81)}), whole.set_gravity({0, 0, S(-9.81)});
  for (int k = 0; k < 400; ++k) body.step(S(1e-3)), whole.step(S(1e-3));
  CHECK(body.cut({S(0.0201), -1, -1}, {S(0.0201), -1, 1}, {S(0.0201), 1, -1}, {S(0.0201), 1, 1}) == 4);
  int const far = vertex_at(body, Vector3<S>(S(0.04), 0, 0));
  Vector3<S> const was = body.positions().col(far);
  bool rests = false;
  for (int k = 0; k < 3000 && !rests; ++k) rests = body.step(S(1e-3)).at_rest;
  CHECK(rests);
  CHECK((body.positions().col(far) - was).norm() < S(2e-3));   // it relaxes, and stays
  // What is still held hangs as a block half as long does.
  auto half = block<S>(2, 2, 2);
  for (int i = 0; i < half.size(); ++i)
    if (half.reference_position(i)[0] < S(1e-4)) half.nail(i);
  half.set_gravity({0, 0, S(-9.81)});
  for (int k = 0; k < 3000 && !half.step(S(1e-3)).at_rest; ++k) {
  }
  int const end = vertex_at(half, Vector3<S>(S(0.02), 0, 0));
  S least = 1;
  for (int i = 0; i < body.size(); ++i)
    if (body.reference_position(i) == half.reference_position(end)) least = std::min(least, (body.positions().col(i) - half.positions().col(end)).norm());
  CHECK(least < S(1e-6));
}

TEMPLATE_TEST_CASE("cubes pulled out to many times an edge come to rest, and back when they are let go", "[tissue][cubes]", PALPATE_TEST_SCALARS) {
  // Yardsticks: the rest shape; under the force the place that a factor of 0.6 comes to, which converges however far tissue is pulled out.
  using S = TestType;
  struct Pull {
    int levels;
    double force, farther;   // N; than so many edges of the cubes that are pulled
  };
  for (auto const& [levels, force, farther] : {Pull{1, 0.7, 0.5}, Pull{2, 0.4, 1.0}, Pull{3, 0.1, 1.0}}) {
    auto const pulled = [&](S factor) {
      auto body = block<S>(6, 4, 3, {.levels = levels, .relaxation = factor});
      for (int i = 0; i < body.size(); ++i)
        if (body.reference_position(i)[2] < S(1e-4)) body.nail(i);
      int const corner = vertex_at(body, Vector3<S>(S(0.06), S(0.04), S(0.03)));
      Vector3<S> const by = S(force) * Vector3<S>(1, S(0.7), 1).normalized();
      int diverged = 0;
      for (int k = 0; k < 400; ++k) {
        body.apply_force_at({.triangle = body.tissue().surface().triangles_at(corner)[0], .barycentric = Vector3<S>::Constant(S(1) / 3)}, by);
        diverged += body.step(S(1e-3)).diverged;
      }
      CHECK(diverged == 0);
      return std::pair(body, corner);
    };
    CAPTURE(levels, force);
    auto [body, corner] = pulled(S(1.2));
    Vector3<S> const to = body.positions().col(corner);
    CHECK((to - pulled(S(0.6)).first.positions().col(corner)).norm() < S(1e-5));
    CHECK((to - body.reference_position(corner)).norm() > S(farther * edge / std::pow(2, levels)));
    bool rests = false;
    for (int k = 0; k < 2000 && !rests; ++k) rests = body.step(S(1e-3)).at_rest;
    CHECK(rests);
    S off = 0;
    for (int i = 0; i < body.size(); ++i) off = std::max(off, (body.positions().col(i) - body.reference_position(i)).norm());
    CHECK(off < S(1e-5));
  }
}

TEMPLATE_TEST_CASE("a force that waits on a split cube is not lost where cubes are split, joined or cut meanwhile", "[tissue][cubes]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  for (int const edit : {0, 1, 2, 3}) {
    auto body = block<S>(6, 3, 3, {.levels = 1});
    for (int i = 0; i < body.size(); ++i)
      if (body.reference_position(i)[2] < S(1e-4)) body.nail(i);
    body.split(38);
    int const fine = vertex_at(body, Vector3<S>(S(0.025), S(0.005), S(0.03)));
    REQUIRE(fine >= 4 * 7 * 4);
    body.apply_force(fine, {0, 0, S(-0.1)});
    if (edit == 1) body.split(0);
    if (edit == 2) body.join(38);
    if (edit == 3) body.cut({S(0.0501), -1, S(0.02)}, {S(0.0501), -1, 1}, {S(0.0501), 1, S(0.02)}, {S(0.0501), 1, 1});
    body.solve_statics(std::is_same_v<S, float> ? S(1e-6) : S(1e-10));
    int const below = vertex_at(body, Vector3<S>(S(0.03), S(0.01), S(0.03)));
    CAPTURE(edit);
    CHECK(body.displacement(below)[2] < S(-5e-4));
  }
}

TEST_CASE("cubes say what is wrong with an edge in millimetres, a missing clock and another body's state", "[tissue][cubes]") {
  auto const sphere_of = [](double radius) { return make_sphere<double>(radius, 6); };
  auto const sphere = sphere_of(0.05);
  CHECK_THROWS_WITH(Cubes<double>(sphere, {.edge = 8, .young = young}), says("an edge of 8 m is longer than the surface", "in metres"));
  CHECK_THROWS_WITH(Cubes<double>(sphere, {.edge = 0.01, .young = young, .seconds = 1e-3, .clock = nullptr}), says(".seconds is a limit", ".clock is null"));
  Cubes<double> body(sphere, {.edge = 0.01, .young = young});
  Cubes<double> const other(sphere, {.edge = 0.02, .young = young});
  int const size = body.size();
  CHECK_THROWS_WITH(body.restore(other.save()), says("can not be restored", "another body's"));
  CHECK(body.size() == size);
  auto row = block<double>(8, 1, 1), flat = block<double>(4, 2, 1), turned = block<double>(2, 4, 1);   // 8 cubes each; as many vertices the last two
  Matrix3X<double> const before = flat.positions();
  CHECK_THROWS_WITH(flat.restore(row.save()), says("lie in another way", "another body's"));
  CHECK_THROWS_WITH(flat.restore(turned.save()), says("lie in another way", "another body's"));
  Cubes<double> const larger(sphere_of(0.1), {.edge = 0.02, .young = young});   // the same cubes, of twice the size
  CHECK_THROWS_WITH(body.restore(larger.save()), says("a body 0.3", "m across", "another body's"));
  CHECK(flat.positions() == before);
  flat.restore(block<double>(4, 2, 1).save());
}

TEMPLATE_TEST_CASE("what cubes say that a force does in a step is more than it does to one vertex, and no more than a few times", "[tissue][cubes]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  // A coupling that is told too little is not stable; one that is told far too much is slow.
  auto body = block<S>(8, 8, 4);
  for (int i = 0; i < body.size(); ++i)
    if (body.reference_position(i)[2] < S(1e-4)) body.nail(i);
  int const touched = vertex_at(body, Vector3<S>(S(0.04), S(0.04), S(0.04)));
  for (int const axis : {0, 2}) {
    auto pushed = body;
    pushed.apply_force(touched, S(1e-4) * Vector3<S>::Unit(axis));
    pushed.step(S(1e-3));
    S const share = pushed.displacement(touched)[axis] / (S(1e-4) * body.mobility(touched, touched, S(1e-3)) * S(1e-6));
    CHECK(share > S(0.15));
    CHECK(share < S(0.35));
  }
}
