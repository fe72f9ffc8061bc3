// SPDX-License-Identifier: MIT
#include "catch.hpp"
#include "meshes.hpp"

#include <palpate/core/random.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/components.hpp>
#include <palpate/mesh/edges.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/rings.hpp>
#include <palpate/mesh/sphere.hpp>

#include <algorithm>
#include <array>
#include <map>
#include <queue>
#include <set>
#include <vector>

using namespace palpate;
using namespace palpate_test;

namespace {

template <class Elements>
std::set<std::array<int, 2>> brute_edges(Elements const& elements) {
  std::set<std::array<int, 2>> result;
  for (Eigen::Index e = 0; e < elements.cols(); ++e)
    for (int i = 0; i < elements.rows(); ++i)
      for (int j = 0; j < elements.rows(); ++j)
        if (elements(i, e) < elements(j, e)) result.insert({elements(i, e), elements(j, e)});
  return result;
}

/// Distance in edges from one vertex, by breadth-first search over the brute-force edge set.
std::vector<int> brute_distances(std::set<std::array<int, 2>> const& sides, int vertices, std::vector<int> const& seeds) {
  std::vector<int> distance(static_cast<std::size_t>(vertices), -1);
  std::queue<int> queue;
  for (int const s : seeds) distance[static_cast<std::size_t>(s)] = 0, queue.push(s);
  while (!queue.empty()) {
    int const v = queue.front();
    queue.pop();
    for (auto const& e : sides)
      for (int k = 0; k < 2; ++k)
        if (e[static_cast<std::size_t>(k)] == v)
          if (int& d = distance[static_cast<std::size_t>(e[static_cast<std::size_t>(1 - k)])]; d < 0) {
            d = distance[static_cast<std::size_t>(v)] + 1;
            queue.push(e[static_cast<std::size_t>(1 - k)]);
          }
  }
  return distance;
}

}  // namespace

// Yardstick: an ordered set filled from all corner pairs.
TEMPLATE_TEST_CASE("edges are every side once, in order", "[mesh]", PALPATE_TEST_SCALARS) {
  auto const check = [](auto const& mesh, auto const& elements) {
    auto const found = edges(mesh);
    auto const expected = brute_edges(elements);
    REQUIRE(found == std::vector<std::array<int, 2>>(expected.begin(), expected.end()));
  };
  auto const grid = make_grid<TestType>(7, 5, TestType(0.1));
  check(grid, grid.triangles);
  auto const ring = torus<TestType>(9, 6, 2, 1);
  check(ring, ring.triangles);
  auto const block = make_block<TestType>(4, 3, 3, TestType(0.1));
  check(block, block.tetrahedra);
  // Grid, by counting: horizontal, vertical and diagonal sides.
  REQUIRE(edges(grid).size() == 6u * 5u + 7u * 4u + 6u * 4u);
}

// Yardstick: the rim of a grid, by its indices; closed surfaces have none.
TEMPLATE_TEST_CASE("the boundary of a grid is its rim, in the sense of its triangles", "[mesh]", PALPATE_TEST_SCALARS) {
  int const nx = 6, ny = 4;
  auto const mesh = make_grid<TestType>(nx, ny, TestType(1));
  std::vector<int> rim;
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i)
      if (i == 0 || j == 0 || i == nx - 1 || j == ny - 1) rim.push_back(j * nx + i);
  REQUIRE(boundary_vertices(mesh) == rim);

  auto const sides = boundary_edges(mesh);
  REQUIRE(sides.size() == rim.size());
  REQUIRE(std::is_sorted(sides.begin(), sides.end()));
  std::map<int, int> next;
  double area = 0;   // the rim runs counter-clockwise: the shoelace formula gives + area
  for (auto const& s : sides) {
    REQUIRE(next.emplace(s[0], s[1]).second);
    area += 0.5 * (double(mesh.points(0, s[0])) * double(mesh.points(1, s[1])) -
                   double(mesh.points(0, s[1])) * double(mesh.points(1, s[0])));
  }
  REQUIRE(area == Approx((nx - 1) * (ny - 1)));

  REQUIRE(boundary_edges(tetrahedron<TestType>()).empty());
  REQUIRE(boundary_vertices(make_sphere<TestType>(1, 3)).empty());
  REQUIRE(boundary_edges(torus<TestType>(5, 4, 2, 1)).empty());
}

// Yardstick: area and volume of the box, Euler's formula.
TEMPLATE_TEST_CASE("the surface of a block is its six sides, outward", "[mesh]", PALPATE_TEST_SCALARS) {
  auto const block = make_block<TestType>(4, 3, 5, TestType(0.5));
  auto const skin = surface(block);
  REQUIRE(skin.points == block.points);
  REQUIRE(skin.triangles.cols() == 2 * 2 * (3 * 2 + 3 * 4 + 2 * 4));
  REQUIRE(surface_area(skin) == Approx(0.25 * 2 * (3 * 2 + 3 * 4 + 2 * 4)));
  REQUIRE(volume(skin) == Approx(0.125 * 3 * 2 * 4));
  REQUIRE(euler_characteristic(skin) == 2);
  REQUIRE(boundary_edges(skin).empty());
  REQUIRE(surface(TetrahedralMesh<TestType>{}).triangles.cols() == 0);
}

TEMPLATE_TEST_CASE("pieces are found and ordered by their smallest vertex", "[mesh]", PALPATE_TEST_SCALARS) {
  auto const one = make_grid<TestType>(3, 3, TestType(1));
  auto two = together(one, tetrahedron<TestType>(), {5, 0, 0});
  auto const pieces = connected_components(two);
  REQUIRE(pieces.size() == 2);
  REQUIRE(pieces[0] == std::vector<int>{0, 1, 2, 3, 4, 5, 6, 7, 8});
  REQUIRE(pieces[1] == std::vector<int>{9, 10, 11, 12});

  // Vertices of no triangle belong to none; indices need not be contiguous.
  auto const scattered = surface_of<TestType>({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}, {5, 0, 0}, {6, 0, 0}},
                                              {{6, 4, 2}, {1, 5, 3}});
  REQUIRE(connected_components(scattered) == std::vector<std::vector<int>>{{1, 3, 5}, {2, 4, 6}});
  REQUIRE(connected_components(TriangleMesh<TestType>{}).empty());
  REQUIRE(connected_components(make_block<TestType>(3, 3, 3, TestType(1))).size() == 1);
}

// Yardstick: breadth-first search over the brute-force edge set, from every vertex.
TEMPLATE_TEST_CASE("rings are distances in edges", "[mesh]", PALPATE_TEST_SCALARS) {
  auto const check = [](auto const& mesh, auto const& elements, std::vector<int> const& seeds) {
    auto const distance = brute_distances(brute_edges(elements), static_cast<int>(mesh.points.cols()), seeds);
    auto const rings = vertex_rings(mesh, seeds, 4);
    REQUIRE(rings.size() == 5);
    for (int k = 1; k <= 4; ++k) {
      std::vector<int> expected;
      for (std::size_t v = 0; v < distance.size(); ++v)
        if (distance[v] == k) expected.push_back(static_cast<int>(v));
      REQUIRE(rings[static_cast<std::size_t>(k)] == expected);
    }
  };
  auto const grid = make_grid<TestType>(7, 6, TestType(1));
  for (int v = 0; v < grid.points.cols(); ++v) check(grid, grid.triangles, {v});
  check(grid, grid.triangles, {0, 41, 17});
  auto const block = make_block<TestType>(4, 3, 3, TestType(1));
  check(block, block.tetrahedra, {5, 0});
}

// Yardstick: on the grid with one diagonal per square a ring is a hexagon of 6 k vertices, far from the rim.
TEMPLATE_TEST_CASE("rings on a grid are hexagons", "[mesh]", PALPATE_TEST_SCALARS) {
  auto const mesh = make_grid<TestType>(21, 21, TestType(1));
  auto const rings = vertex_rings(mesh, 10 * 21 + 10, 9);
  REQUIRE(rings[0] == std::vector<int>{10 * 21 + 10});
  for (std::size_t k = 1; k < rings.size(); ++k) REQUIRE(rings[k].size() == 6 * k);
  REQUIRE(rings[1] == std::vector<int>{9 * 21 + 9, 9 * 21 + 10, 10 * 21 + 9, 10 * 21 + 11, 11 * 21 + 10, 11 * 21 + 11});
  REQUIRE(vertex_rings(mesh, std::vector<int>{3, 3, 1}, 0) == std::vector<std::vector<int>>{{3, 1}});
  REQUIRE(vertex_rings(make_grid<TestType>(2, 2, 1), 0, 3)[3].empty());   // past the end of the mesh

  VertexNeighbours const neighbours(mesh);
  REQUIRE(neighbours.size() == 441);
  REQUIRE(neighbours[0].size() == 3);
  REQUIRE(neighbours[20].size() == 2);
}

TEST_CASE("walks say what is wrong with a mesh or a seed", "[mesh]") {
  auto bad = make_grid<double>(3, 3, 1.0);
  REQUIRE_THROWS_WITH(vertex_rings(bad, 9, 1), says("seed vertex index 9", "0 … 8"));
  REQUIRE_THROWS_AS(vertex_rings(bad, -1, 1), OutOfRange);
  REQUIRE_THROWS_WITH(vertex_rings(bad, 0, -2), says("number of rings is -2", "0 (the seeds alone) or more"));
  bad.triangles(1, 5) = 12;
  auto const text = says("triangle 5", "vertex 12", "9 points", "`validate`");
  REQUIRE_THROWS_WITH(edges(bad), text);
  REQUIRE_THROWS_WITH(boundary_vertices(bad), text);
  REQUIRE_THROWS_WITH(connected_components(bad), text);
  REQUIRE_THROWS_WITH(vertex_rings(bad, 0, 1), text);
  bad.triangles(1, 5) = -1;
  REQUIRE_THROWS_AS(surface_area(bad), InvalidMesh);
}
