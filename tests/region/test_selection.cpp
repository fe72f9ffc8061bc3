// SPDX-License-Identifier: MIT
// Yardsticks: rings counted by hand, and distances by repeated relaxation over the edges of the mesh.
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include "catch.hpp"
#include "allocation_trap.hpp"

#include <algorithm>
#include <limits>
#include <set>
#include <vector>

using namespace palpate;

namespace {

/// The particles not farther than `rings` edges from a touched one, by Bellman and Ford on the triangles.
std::set<int> by_distance(TriangleMesh<double> const& mesh, std::vector<int> const& touched, int rings) {
  std::vector<int> distance(static_cast<std::size_t>(mesh.points.cols()), 1000000);
  for (int const p : touched) distance[static_cast<std::size_t>(p)] = 0;
  for (bool changed = true; changed;) {
    changed = false;
    for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t)
      for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3; ++l) {
          int& far = distance[static_cast<std::size_t>(mesh.triangles(k, t))];
          int const near = distance[static_cast<std::size_t>(mesh.triangles(l, t))];
          if (near + 1 < far) far = near + 1, changed = true;
        }
  }
  std::set<int> result;
  for (std::size_t p = 0; p < distance.size(); ++p)
    if (distance[p] <= rings) result.insert(static_cast<int>(p));
  return result;
}

std::set<int> chosen(TriangleMesh<double> const& mesh, std::vector<int> const& touched, int rings) {
  MassSpring<double> const tissue(mesh, {});
  Selection selection;
  ZoneOfInfluence{.rings = rings}.select(tissue, touched, selection);
  return {selection.particles().begin(), selection.particles().end()};
}

}  // namespace

TEST_CASE("rings around one particle inside a grid: 1, 7, 19, 37") {
  auto const skin = make_grid<double>(10, 10, 1.0);
  CHECK(chosen(skin, {44}, 0).size() == 1);
  CHECK(chosen(skin, {44}, 1).size() == 7);
  CHECK(chosen(skin, {44}, 2).size() == 19);
  CHECK(chosen(skin, {44}, 3).size() == 37);
}

TEST_CASE("a zone holds the particles within its rings, and no others") {
  auto const grid = make_grid<double>(9, 7, 1.0);
  auto const ball = make_sphere<double>(1.0, 5);
  for (int rings = 0; rings < 5; ++rings)
    for (std::vector<int> const& touched : {std::vector<int>{0}, {31}, {5, 40, 62}, {20, 20, 21}}) {
      CAPTURE(rings);
      CHECK(chosen(grid, touched, rings) == by_distance(grid, touched, rings));
      CHECK(chosen(ball, touched, rings) == by_distance(ball, touched, rings));
    }
}

TEST_CASE("a zone of more rings than there are ends where the body does") {
  auto const grid = make_grid<double>(9, 7, 1.0);
  for (int round = 0; round < 100; ++round) CHECK(chosen(grid, {31}, std::numeric_limits<int>::max()).size() == 63);
}

TEST_CASE("without touch a zone is empty, and the whole body is whole") {
  auto const skin = make_grid<double>(4, 5, 1.0);
  MassSpring<double> const tissue(skin, {});
  CHECK(chosen(skin, {}, 3).empty());
  Selection selection;
  WholeBody{}.select(tissue, {}, selection);
  CHECK(selection.size() == 20);
}

TEST_CASE("a selection forgets at once and does not allocate again") {
  REQUIRE(palpate_test::trap_works());
  Selection selection;
  selection.reserve(50);
  palpate_test::AllocationCount const allocations;
  bool twice = false, missing = false;
  for (int round = 0; round < 1000; ++round) {
    selection.clear();
    missing = missing || selection.contains(round % 50) || !selection.add(round % 50) || !selection.contains(round % 50);
    twice = twice || selection.add(round % 50);
  }
  long const count = allocations.count();
  CHECK(count == 0);
  CHECK_FALSE(twice);
  CHECK_FALSE(missing);
  CHECK_FALSE(selection.contains(-1));
  CHECK_FALSE(selection.contains(1000));
  selection.add(70);   // beyond what was reserved
  CHECK(selection.contains(70));
}
