// SPDX-License-Identifier: MIT
// Tetrahedral topology. Yardsticks: numbers counted by hand, `surface(mesh)`, and the law battery, which searches all corners.
#include "allocation_trap.hpp"
#include "catch.hpp"

#include <palpate/core/random.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/mesh/tetrahedral_topology.hpp>
#include <palpate/testing/tetrahedral_topology.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

using namespace palpate;

namespace {

TetrahedralTopology made_of(int vertices, std::initializer_list<std::array<int, 4>> tetrahedra) {
  Matrix<int, 4, Dynamic> columns(4, static_cast<Eigen::Index>(tetrahedra.size()));
  Eigen::Index t = 0;
  for (auto const& c : tetrahedra) columns.col(t++) << c[0], c[1], c[2], c[3];
  return TetrahedralTopology(vertices, columns);
}

std::string broken(TetrahedralTopology const& topology, bool manifold = true) {
  return testing::to_text(testing::check_tetrahedral_topology(topology, {.manifold = manifold}));
}

std::vector<int> round(TetrahedralTopology const& topology, int a, int b) {
  std::vector<int> visited;
  topology.for_each_round(a, b, [&](int t) { visited.push_back(t); });
  return visited;
}

/// Vertices, tetrahedra, border triangles.
using Counts = std::array<int, 3>;
Counts counts(TetrahedralTopology const& topology) { return {topology.vertex_count(), topology.tetrahedron_count(), topology.border().triangle_count()}; }

/// The counts after an operator; checked on the way: the laws, the record, and that taking it back leaves everything as it was.
template <class Operator>
Counts counts_after(TetrahedralTopology topology, Operator const& edit_it, bool manifold = true) {
  TetrahedralTopology const before = topology;
  TopologyEdit const edit = edit_it(topology);
  CHECK(broken(topology, manifold) == "");
  CHECK(testing::to_text(testing::check_tetrahedral_edit(before, edit, topology)) == "");
  Counts const after = counts(topology);
  topology.undo(edit);
  CHECK(broken(topology) == "");
  CHECK(topology.tetrahedra() == before.tetrahedra());
  CHECK(topology.border().triangles() == before.border().triangles());
  CHECK(counts(topology) == counts(before));
  return after;
}

TetrahedralTopology one() { return made_of(4, {{0, 1, 2, 3}}); }
TetrahedralTopology pair() { return made_of(5, {{0, 1, 2, 3}, {4, 1, 3, 2}}); }                            // a common face 1 2 3
TetrahedralTopology ring() { return made_of(5, {{0, 1, 2, 3}, {0, 1, 3, 4}, {0, 1, 4, 2}}); }              // three round the edge 0 – 1
TetrahedralTopology hinge() { return made_of(6, {{0, 1, 2, 3}, {0, 1, 4, 5}}); }                           // a common edge 0 – 1

}  // namespace

TEST_CASE("one tetrahedron: four faces, counter-clockwise seen from outside", "[topology]") {
  auto const topology = one();
  CHECK(broken(topology) == "");
  CHECK(counts(topology) == Counts{4, 1, 4});
  // Face k lies opposite corner k. With corners at 0, x, y, z: outward normals x + y + z, −x, −y, −z.
  CHECK(topology.face(0, 0) == std::array{1, 2, 3});
  CHECK(topology.face(0, 1) == std::array{0, 3, 2});
  CHECK(topology.face(0, 2) == std::array{0, 1, 3});
  CHECK(topology.face(0, 3) == std::array{0, 2, 1});
  CHECK(topology.tetrahedron_with_face(2, 3, 1) == 0);
  CHECK(topology.tetrahedron_with_face(2, 1, 3) == -1);
  CHECK(topology.corner_of(0, 2) == 2);
  CHECK(topology.corner_of(0, 4) == -1);
  CHECK_FALSE(topology.is_inside(0));
  CHECK(round(topology, 3, 1) == std::vector<int>{0});
}

TEST_CASE("what meets across a face, round an edge and at a vertex", "[topology]") {
  auto const two = pair();
  CHECK(broken(two) == "");
  CHECK(counts(two) == Counts{5, 2, 6});
  CHECK(two.neighbour(0, 0) == 1);
  CHECK(two.neighbour(1, 0) == 0);
  CHECK(two.neighbour(0, 1) == -1);
  CHECK(two.border_triangle(0, 0) == -1);
  // Along 1 → 2, counter-clockwise seen from 2: (1, 2, 0, 3) is positive, so from 0 to 3 in tetrahedron 0, on to 4 in tetrahedron 1.
  CHECK(round(two, 1, 2) == std::vector<int>{0, 1});
  CHECK(round(two, 2, 1) == std::vector<int>{1, 0});
  CHECK(two.fans_round(0, 4) == 0);

  auto const three = ring();
  CHECK(broken(three) == "");
  CHECK(counts(three) == Counts{5, 3, 6});
  CHECK(round(three, 0, 1) == std::vector<int>{0, 1, 2});   // (0, 1, 2, 3), then on over the face 0 1 3
  CHECK(round(three, 1, 0) == std::vector<int>{0, 2, 1});
  CHECK(three.fans_round(0, 1) == 1);

  TetrahedralTopology const block(make_block<double>(3, 3, 3, 1.0));
  CHECK(block.is_inside(13));
  CHECK(block.tetrahedra_at(13).size() == 24);
  int neighbours = 0;
  block.for_each_neighbour(13, [&](int) { ++neighbours; });
  CHECK(neighbours == 14);                          // 6 along the axes, 6 along diagonals of squares, 2 along those of cubes
  CHECK(round(block, 0, 13).size() == 6);           // a cube's diagonal
  CHECK(round(block, 13, 26).size() == 6);
}

// By hand: the vertices of a ball's surface, 162 of them, all joined to its middle.
TEST_CASE("a vertex with many neighbours visits each once", "[topology]") {
  auto const ball = make_sphere<double>(1.0, 4);
  int const middle = static_cast<int>(ball.points.cols());
  REQUIRE(middle == 162);
  Matrix<int, 4, Dynamic> tetrahedra(4, ball.triangles.cols());
  tetrahedra.topRows<3>() = ball.triangles;
  tetrahedra.row(3).setConstant(middle);
  for (Eigen::Index t = 0; t < tetrahedra.cols(); ++t) std::swap(tetrahedra(0, t), tetrahedra(1, t));   // seen from the middle
  TetrahedralTopology const cone(middle + 1, tetrahedra);
  std::vector<int> times(162, 0);
  cone.for_each_neighbour(middle, [&](int i) { ++times[static_cast<std::size_t>(i)]; });
  CHECK(times == std::vector<int>(162, 1));
}

TEST_CASE("the border is numbered as surface() numbers it", "[topology]") {
  for (auto const pattern : {BlockPattern::kuhn, BlockPattern::alternating}) {
    auto const mesh = make_block<double>(4, 3, 5, 0.1, pattern);
    TetrahedralTopology const topology(mesh);
    CHECK(broken(topology) == "");
    CHECK(testing::to_text(testing::check_tetrahedral_topology(topology, mesh.points, 3 * 2 * 4 * 1e-3)) == "");
    CHECK(topology.border().triangles() == surface(mesh).triangles);
    CHECK(topology.tetrahedra() == mesh.tetrahedra);
  }
  CHECK(broken(TetrahedralTopology()) == "");
}

// One tetrahedron more for each round the edge; two border triangles more for each fan that ends at the border.
TEST_CASE("insertion on an edge", "[topology]") {
  auto const on = [](int a, int b) {
    return [=](TetrahedralTopology& topology) { return topology.insert_on_edge(a, b); };
  };
  CHECK(counts_after(one(), on(0, 1)) == Counts{5, 2, 6});
  CHECK(counts_after(pair(), on(1, 2)) == Counts{6, 4, 8});    // an edge of the common face
  CHECK(counts_after(pair(), on(2, 1)) == Counts{6, 4, 8});
  CHECK(counts_after(pair(), on(0, 3)) == Counts{6, 3, 8});    // one of the first alone
  CHECK(counts_after(ring(), on(0, 1)) == Counts{6, 6, 6});    // inside
  CHECK(counts_after(ring(), on(3, 2)) == Counts{6, 4, 8});
  CHECK(counts_after(ring(), on(4, 0)) == Counts{6, 5, 8});
  CHECK(counts_after(TetrahedralTopology(make_block<double>(3, 3, 3, 1.0)), on(13, 26)) == Counts{28, 48 + 6, 48});

  auto topology = ring();
  TopologyEdit const edit = topology.insert_on_edge(0, 1);
  CHECK(edit.vertex == 5);
  CHECK(std::vector<int>(edit.parents().begin(), edit.parents().end()) == std::vector<int>{0, 1});
  CHECK_FALSE(edit.is_copy());
  CHECK(topology.corners(1) == std::array{0, 5, 3, 4});
  CHECK(topology.corners(4) == std::array{5, 1, 3, 4});
  CHECK(topology.is_inside(5));
}

// Inside 2 → 6; on the border 1 → 3 and two border triangles more.
TEST_CASE("insertion on a face", "[topology]") {
  auto const on = [](int a, int b, int c) {
    return [=](TetrahedralTopology& topology) { return topology.insert_on_face(a, b, c); };
  };
  CHECK(counts_after(pair(), on(1, 2, 3)) == Counts{6, 6, 6});
  CHECK(counts_after(pair(), on(3, 2, 1)) == Counts{6, 6, 6});
  CHECK(counts_after(pair(), on(0, 1, 2)) == Counts{6, 4, 8});
  CHECK(counts_after(one(), on(3, 0, 1)) == Counts{5, 3, 6});
  auto topology = pair();
  topology.insert_on_face(1, 2, 3);
  CHECK(topology.corners(0) == std::array{0, 1, 2, 5});
  CHECK(topology.corners(1) == std::array{4, 1, 5, 2});
  CHECK(topology.neighbour(0, 0) == 1);
}

TEST_CASE("insertion in a tetrahedron", "[topology]") {
  auto const in = [](int t) {
    return [=](TetrahedralTopology& topology) { return topology.insert_in_tetrahedron(t); };
  };
  CHECK(counts_after(one(), in(0)) == Counts{5, 4, 4});
  CHECK(counts_after(ring(), in(2)) == Counts{6, 6, 6});
  auto topology = one();
  topology.insert_in_tetrahedron(0);
  CHECK(topology.tetrahedra() == (Matrix<int, 4, 4>() << 0, 4, 0, 0, 1, 1, 4, 1, 2, 2, 2, 4, 4, 3, 3, 3).finished());
}

TEST_CASE("two tetrahedra come apart vertex by vertex: first the face opens, then the edge, then the corner", "[topology]") {
  CHECK(counts_after(pair(), [](auto& topology) { return topology.split_vertex(1, std::array{1}); }, false) == Counts{6, 2, 8});
  auto topology = pair();
  TetrahedronFans fans;
  topology.fans_at(1, fans);
  CHECK(fans.size() == 1);
  topology.fans_at(1, fans, [&](int t, int k) { return topology.neighbour(t, k) == 1 - t; });
  REQUIRE(fans.size() == 2);
  CHECK(fans[1].front() == 1);

  std::vector<TopologyEdit> edits;
  edits.push_back(topology.split_vertex(1, fans[1]));   // the face opens
  CHECK(topology.corners(1) == std::array{4, 5, 3, 2});
  CHECK(topology.border().corners(6) == topology.face(1, 0));
  CHECK(topology.border().corners(7) == topology.face(0, 0));
  // Only the edge 2 – 3 holds the two together: it is none of a manifold, and each part has its own pair of triangles there.
  CHECK(broken(topology, false) == "");
  CHECK(broken(topology, true) != "");
  CHECK(topology.fans_round(2, 3) == 2);
  for (int triangle = 0; triangle < 8; ++triangle)
    for (int k = 0; k < 3; ++k)
      CHECK(topology.border_face(topology.border_neighbour(triangle, k)).tetrahedron == topology.border_face(triangle).tetrahedron);

  topology.fans_at(2, fans);
  REQUIRE(fans.size() == 2);
  edits.push_back(topology.split_vertex(2, fans[1]));
  CHECK(counts(topology) == Counts{7, 2, 8});
  CHECK(broken(topology, true) == "");
  topology.fans_at(3, fans);
  REQUIRE(fans.size() == 2);
  edits.push_back(topology.split_vertex(3, fans[1]));
  CHECK(counts(topology) == Counts{8, 2, 8});
  CHECK(topology.corners(0) == std::array{0, 1, 2, 3});
  CHECK(topology.corners(1) == std::array{4, 5, 7, 6});

  for (; !edits.empty(); edits.pop_back()) topology.undo(edits.back());
  CHECK(broken(topology) == "");
  CHECK(topology.tetrahedra() == pair().tetrahedra());
  CHECK(topology.border().triangles() == pair().border().triangles());
}

// In Kuhn's pattern six triangles of the plane z = 2 meet in the middle of the block, and 24 tetrahedra, half of them above.
TEST_CASE("a vertex inside is split along a ring of faces: a lens opens, with a skin of its own", "[topology]") {
  auto const mesh = make_block<double>(5, 5, 5, 1.0);
  TetrahedralTopology topology(mesh);
  auto const before = topology;
  std::vector<int> above;
  for (int const t : topology.tetrahedra_at(62)) {
    double height = 0;
    for (int const v : topology.corners(t)) height += mesh.points(2, v) / 4;
    if (height > 2) above.push_back(t);
  }
  REQUIRE(above.size() == 12);
  TopologyEdit const edit = topology.split_vertex(62, above);
  CHECK(broken(topology) == "");
  CHECK(testing::to_text(testing::check_tetrahedral_edit(before, edit, topology)) == "");
  CHECK(counts(topology) == Counts{126, 384, 192 + 12});
  CHECK(edit.end_triangle - edit.first_triangle == 12);
  CHECK(topology.border().is_inside(62));
  CHECK(topology.border().is_inside(125));
  CHECK(testing::detail::euler_characteristic(topology) == 2);   // a ball with a hollow
  TetrahedronFans fans;
  for (int v = 0; v < 126; ++v) {
    topology.fans_at(v, fans);
    CHECK(fans.size() == 1);
  }
}

// Faces p q r and p q s of a plane through a block: no vertex lies inside the cut, so none splits and nothing opens. Bisected, their common edge has a
// midpoint with four faces of the cut around it: its tetrahedra are two fans, and four faces open.
TEST_CASE("a cut of two faces opens when their common edge is bisected", "[topology]") {
  TetrahedralTopology topology(make_block<double>(4, 4, 4, 1.0));
  auto const vertex = [](int i, int j, int k) { return (k * 4 + j) * 4 + i; };
  int const p = vertex(1, 1, 1), q = vertex(2, 2, 1), r = vertex(2, 1, 1), s = vertex(1, 2, 1);   // a square and its diagonal
  std::vector<int> cut{p, q, r, s};
  auto const separated = [&](int t, int k) {
    auto const face = topology.face(t, k);
    return std::all_of(face.begin(), face.end(), [&](int v) { return std::find(cut.begin(), cut.end(), v) != cut.end(); });
  };
  REQUIRE(topology.tetrahedron_with_face(p, q, r) >= 0);
  REQUIRE(topology.tetrahedron_with_face(p, q, s) >= 0);
  TetrahedronFans fans;
  for (int const v : {p, q, r, s}) {
    topology.fans_at(v, fans, separated);
    CHECK(fans.size() == 1);
  }
  int const triangles = topology.border().triangle_count();
  int const m = topology.insert_on_edge(p, q).vertex;
  cut.push_back(m);
  topology.fans_at(m, fans, separated);
  REQUIRE(fans.size() == 2);
  CHECK(topology.border().triangle_count() == triangles);
  topology.split_vertex(m, fans[0]);
  CHECK(topology.border().triangle_count() == triangles + 8);
  CHECK(broken(topology) == "");
}

TEST_CASE("parts that touch in an edge or a corner alone: each keeps its own border", "[topology]") {
  auto topology = hinge();
  CHECK(broken(topology, false) == "");
  CHECK(counts(topology) == Counts{6, 2, 8});
  CHECK(topology.fans_round(0, 1) == 2);
  CHECK(round(topology, 0, 1).size() == 2);
  for (int triangle = 0; triangle < 8; ++triangle)
    for (int k = 0; k < 3; ++k)
      CHECK(topology.border_face(topology.border_neighbour(triangle, k)).tetrahedron == topology.border_face(triangle).tetrahedron);
  auto const before = topology;
  TopologyEdit const edit = topology.insert_on_edge(0, 1);   // two fans: two border triangles more for each
  CHECK(counts(topology) == Counts{7, 4, 12});
  CHECK(broken(topology, false) == "");
  CHECK(testing::to_text(testing::check_tetrahedral_edit(before, edit, topology)) == "");
  auto const corner = made_of(7, {{0, 1, 2, 3}, {0, 4, 5, 6}});
  CHECK(broken(corner) == "");
  TetrahedronFans fans;
  corner.fans_at(0, fans);
  CHECK(fans.size() == 2);
}

TEST_CASE("single elements: a block put together and taken apart, its border joined and opened", "[topology]") {
  auto const mesh = make_block<double>(3, 3, 3, 1.0);
  TetrahedralTopology topology;
  for (int v = 0; v < 27; ++v) topology.add_vertex();
  for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t) {
    auto const c = mesh.tetrahedra.col(t);
    CHECK(topology.add_tetrahedron({c[0], c[1], c[2], c[3]}) == t);
    CHECK(broken(topology, false) == "");
  }
  CHECK(counts(topology) == Counts{27, 48, 48});
  // A corner torn off its vertex is a split of one tetrahedron.
  TetrahedralTopology split = topology;
  int const t = topology.tetrahedra_at(13)[5];
  split.split_vertex(13, std::array{t});
  topology.add_vertex();
  topology.replace_corner(t, 13, 27);
  CHECK(topology.tetrahedra() == split.tetrahedra());
  CHECK(counts(topology) == counts(split));
  CHECK(broken(topology, false) == "");
  topology.replace_corner(t, 27, 13);
  CHECK(broken(topology) == "");
  topology.pop_vertex();
  CHECK(counts(topology) == Counts{27, 48, 48});
  auto const c = topology.corners(7);
  topology.set_tetrahedron(7, {c[1], c[2], c[0], c[3]});   // turned, the same
  CHECK(broken(topology) == "");
  while (topology.tetrahedron_count() > 0) {
    topology.pop_tetrahedron();
    CHECK(broken(topology, false) == "");
  }
  CHECK(topology.border().triangle_count() == 0);
}

TEST_CASE("what can not be is refused, and nothing has changed", "[topology]") {
  CHECK_THROWS_WITH(made_of(3, {{0, 1, 2, 3}}), says("tetrahedron 0", "vertex 3", "3 vertices", "`validate`"));
  CHECK_THROWS_AS(made_of(4, {{0, 1, 2, -1}}), InvalidMesh);
  CHECK_THROWS_WITH(made_of(4, {{0, 1, 2, 1}}), says("tetrahedron 0", "vertex 1 twice"));
  CHECK_THROWS_WITH(made_of(5, {{0, 1, 2, 3}, {4, 1, 2, 3}}), says("tetrahedron 1", "face 1 2 3", "tetrahedron 0", "same side"));
  CHECK_THROWS_WITH(made_of(4, {{0, 1, 2, 3}, {1, 0, 2, 3}}), says("tetrahedron 1", "tetrahedron 0", "same four corners"));
  CHECK_THROWS_AS(made_of(6, {{0, 1, 2, 3}, {4, 1, 3, 2}, {5, 1, 3, 2}}), InvalidMesh);   // three at one face

  auto topology = pair();
  CHECK_THROWS_WITH(topology.insert_on_edge(0, 4), says("edge", "0 4"));
  CHECK_THROWS_WITH(topology.insert_on_face(0, 4, 2), says("face", "0 4 2"));
  CHECK_THROWS_WITH(topology.insert_on_edge(2, 2), says("vertex 2", "twice"));
  CHECK_THROWS_WITH(topology.insert_on_edge(2, 5), says("vertex index 5", "0 … 4"));
  CHECK_THROWS_AS(topology.insert_in_tetrahedron(2), OutOfRange);
  CHECK_THROWS_WITH(topology.split_vertex(0, std::array{1}), says("tetrahedron 1", "vertex 0", "tetrahedra_at(0)"));
  CHECK_THROWS_WITH(topology.split_vertex(1, std::array{1, 1}), says("tetrahedron 1", "twice"));
  CHECK_THROWS_WITH(topology.split_vertex(1, std::array{0, 1}), says("2 of the 2", "vertex 1", "at least one, and not all"));
  CHECK_THROWS_AS(topology.split_vertex(1, {}), InvalidArgument);
  CHECK_THROWS_AS(topology.split_vertex(-1, std::array{0}), OutOfRange);
  CHECK_THROWS_AS(topology.split_vertex(1, std::array{2}), OutOfRange);
  CHECK_THROWS_WITH(topology.add_tetrahedron({0, 1, 2, 3}), says("0 1 2 3", "face 1 2 3", "tetrahedron 0"));
  CHECK_THROWS_AS(topology.set_tetrahedron(1, {0, 1, 3, 2}), InvalidArgument);
  CHECK_THROWS_WITH(topology.replace_corner(1, 0, 2), says("vertex 0", "tetrahedron 1"));
  CHECK_THROWS_AS(topology.replace_corner(1, 4, 2), InvalidArgument);
  CHECK(topology.tetrahedra() == pair().tetrahedra());
  CHECK(topology.border().triangles() == pair().border().triangles());
  CHECK(broken(topology) == "");

  auto const first = topology.insert_on_edge(1, 2);
  auto const second = topology.split_vertex(3, std::array{topology.tetrahedra_at(3)[0]});
  CHECK_THROWS_WITH(topology.undo(first), says("vertex 5", "take back those after it first"));
  topology.undo(second);
  CHECK_THROWS_AS(topology.undo(second), InvalidArgument);
  CHECK_THROWS_AS(topology.undo(TopologyEdit{}), InvalidArgument);
  topology.undo(first);
  CHECK(topology.tetrahedra() == pair().tetrahedra());
}

TEST_CASE("a split takes a part of the topology's own list", "[topology]") {
  TetrahedralTopology topology(make_block<double>(3, 3, 3, 1.0)), other = topology;
  auto const list = topology.tetrahedra_at(13).subspan(3, 9);
  std::vector<int> const copied(list.begin(), list.end());
  topology.split_vertex(13, list);
  other.split_vertex(13, copied);
  CHECK(topology.tetrahedra() == other.tetrahedra());
  CHECK(topology.border().triangles() == other.border().triangles());
  CHECK(broken(topology, false) == "");
}

// A blade's provisional front is made and taken back at every tick.
TEST_CASE("edits within the reserve, made and taken back without end, allocate nothing", "[topology]") {
  REQUIRE(palpate_test::trap_works());
  TetrahedralTopology topology(make_block<double>(5, 5, 5, 1.0));
  topology.reserve(200, 1000, 800);
  Random random(Seed{11});
  std::vector<TopologyEdit> edits(30);
  TetrahedronFans fans;
  for (int v = 0; v < topology.vertex_count(); ++v) topology.fans_at(v, fans);
  palpate_test::AllocationCount const allocations;
  for (int tick = 0; tick < 300; ++tick) {
    for (auto& edit : edits) {
      int const t = static_cast<int>(random.below(static_cast<std::uint64_t>(topology.tetrahedron_count())));
      auto const c = topology.corners(t);
      auto const here = topology.tetrahedra_at(c[0]);
      switch (random.below(4)) {
        case 0: edit = topology.insert_on_edge(c[0], c[1]); break;
        case 1: edit = topology.insert_on_face(c[0], c[1], c[2]); break;
        case 2: edit = topology.insert_in_tetrahedron(t); break;
        default:
          if (here.size() > 1)
            edit = topology.split_vertex(c[0], here.first(here.size() / 2));
          else
            edit = topology.insert_in_tetrahedron(t);
      }
    }
    for (auto edit = edits.rbegin(); edit != edits.rend(); ++edit) topology.undo(*edit);
  }
  CHECK(allocations.count() == 0);
  CHECK(broken(topology) == "");
  CHECK(topology.tetrahedra() == make_block<double>(5, 5, 5, 1.0).tetrahedra);
}
