// SPDX-License-Identifier: MIT
// What an edit of the surface may not change. Yardstick: sums over the tissue before the edit, and the edges of its mesh.
#include <palpate/mesh/components.hpp>
#include <palpate/mesh/edges.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/saturating_spring.hpp>

#include "body/random_edits.hpp"
#include "catch.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <vector>

using namespace palpate;

namespace {

template <class Tissue>
TriangleMesh<double> rest_mesh(Tissue const& tissue) {
  return {tissue.rest_positions().template cast<double>(), tissue.surface().triangles()};
}

struct Totals {
  double mass = 0, home_stiffness = 0, home_damping = 0, area = 0;
  Vector3<double> moment = Vector3<double>::Zero();

  template <class Tissue>
  explicit Totals(Tissue const& tissue) : area(surface_area(rest_mesh(tissue))) {
    for (int i = 0; i < tissue.size(); ++i) {
      mass += tissue.mass(i);
      moment += tissue.mass(i) * tissue.rest_position(i);
      home_stiffness += tissue.home(i).stiffness;
      home_damping += tissue.home(i).damping;
    }
  }
};

void check_same(Totals const& now, Totals const& before) {
  CHECK(now.mass == Approx(before.mass).epsilon(1e-12));
  CHECK(now.home_stiffness == Approx(before.home_stiffness).epsilon(1e-12));
  CHECK(now.home_damping == Approx(before.home_damping).epsilon(1e-12));
  CHECK(now.area == Approx(before.area).epsilon(1e-12));
  CHECK((now.moment - before.moment).norm() < 1e-12 * before.mass);
}

/// Energy of the links when everything is `stretch` times as large.
template <class Tissue>
double stretched_energy(Tissue const& tissue, double stretch) {
  return tissue.potential_energy((stretch * tissue.rest_positions()).eval());
}

template <class Tissue>
void check_links_are_edges(Tissue const& tissue) {
  auto const sides = edges(rest_mesh(tissue));
  REQUIRE(tissue.links().size() == static_cast<int>(sides.size()));
  bool every_edge = true, rest_lengths = true, positive = true;
  for (auto const& [a, b] : sides) {
    int const l = tissue.links().find(a, b);
    every_edge = every_edge && l >= 0 && l == tissue.links().find(b, a);
    if (l < 0) continue;
    double const length = (tissue.rest_position(a) - tissue.rest_position(b)).norm() * (1 - tissue.link_prestrain());
    rest_lengths = rest_lengths && std::abs(tissue.links()[l].rest_length - length) < 1e-14;
    positive = positive && tissue.links()[l].weight > 0;
  }
  CHECK(every_edge);
  CHECK(rest_lengths);
  CHECK(positive);
}

/// Everything about a tissue, in an order that does not depend on its history.
template <class Tissue>
struct Portrait {
  std::vector<double> particles;
  std::map<std::array<int, 2>, std::array<double, 4>> links;
  std::vector<std::array<int, 3>> triangles;

  explicit Portrait(Tissue const& tissue) {
    for (int i = 0; i < tissue.size(); ++i) {
      auto const x = tissue.rest_position(i);
      particles.insert(particles.end(), {x[0], x[1], x[2], tissue.mass(i), tissue.home(i).stiffness, tissue.home(i).damping, double(tissue.nailed(i))});
    }
    for (int l = 0; l < tissue.links().size(); ++l) {
      auto const& link = tissue.links()[l];
      links[{std::min(link.a, link.b), std::max(link.a, link.b)}] = {link.rest_length, link.weight, link.law.stiffness, link.law.damping};
    }
    for (int t = 0; t < tissue.surface().triangle_count(); ++t) {
      auto c = tissue.surface().corners(t);
      std::rotate(c.begin(), std::min_element(c.begin(), c.end()), c.end());
      triangles.push_back(c);
    }
  }

  /// The largest difference of any number; infinite where the topology is another.
  double distance(Portrait const& other) const {
    double const infinite = std::numeric_limits<double>::infinity();
    if (triangles != other.triangles || particles.size() != other.particles.size() || links.size() != other.links.size()) return infinite;
    double most = 0;
    for (std::size_t k = 0; k < particles.size(); ++k) most = std::max(most, std::abs(particles[k] - other.particles[k]));
    for (auto const& [ends, values] : links) {
      auto const found = other.links.find(ends);
      if (found == other.links.end()) return infinite;
      for (std::size_t k = 0; k < 4; ++k) most = std::max(most, std::abs(values[k] - found->second[k]));
    }
    return most;
  }
};

MassSpring<double> tissue_of(TriangleMesh<double> const& mesh, HomeSpring<double> const& home = {.stiffness = 3.0, .damping = 0.2}) {
  return {mesh, {.mass = {.total = 0.3}, .link = {.stiffness = 80.0, .damping = 0.1}, .home = home, .link_prestrain = 0.03}};
}

std::vector<TriangleMesh<double>> meshes() { return {make_grid<double>(6, 5, 0.01), make_sphere<double>(0.05, 3)}; }

}  // namespace

TEST_CASE("insertions keep mass, centre of mass, home springs, area and one link an edge") {
  Random random(Seed{11});
  for (auto const& mesh : meshes()) {
    auto tissue = tissue_of(mesh);
    Totals const before(tissue);
    for (int k = 0; k < 200; ++k) {
      palpate_test::random_insertion(tissue, tissue.surface(), random);
      if (k % 20 != 0) continue;
      check_same(Totals(tissue), before);
      check_links_are_edges(tissue);
    }
    bool heavy = true;
    for (int i = 0; i < tissue.size(); ++i) heavy = heavy && tissue.mass(i) > 0 && tissue.home(i).stiffness > 0;
    CHECK(heavy);
  }
}

TEST_CASE("insertions do not change the energy of a uniform stretch") {
  Random random(Seed{12});
  for (auto const& mesh : meshes()) {
    MassSpring<double> tissue(mesh, {.link = {.stiffness = 80.0, .damping = 0.1}});
    double const stretched = stretched_energy(tissue, 1.1), pressed = stretched_energy(tissue, 0.95);
    REQUIRE(stretched > 0);
    for (int k = 0; k < 300; ++k) palpate_test::random_insertion(tissue, tissue.surface(), random);
    CHECK(stretched_energy(tissue, 1.1) == Approx(stretched).epsilon(1e-9));
    CHECK(stretched_energy(tissue, 0.95) == Approx(pressed).epsilon(1e-9));
  }
}

TEST_CASE("splits keep the same sums, and share a link between the lips") {
  Random random(Seed{13});
  for (auto const& mesh : meshes()) {
    auto tissue = tissue_of(mesh);
    MassSpring<double> loose(mesh, {.link = {.stiffness = 80.0}});
    double const stretched = stretched_energy(loose, 1.1);
    Totals const before(tissue);
    for (int k = 0; k < 40; ++k) {
      if (k % 4 != 3) {
        Random same = random;
        palpate_test::random_insertion(tissue, tissue.surface(), random);
        palpate_test::random_insertion(loose, loose.surface(), same);
      } else {
        Random same = random;
        palpate_test::random_split(tissue, tissue.surface(), random);
        palpate_test::random_split(loose, loose.surface(), same);
      }
      check_same(Totals(tissue), before);
      check_links_are_edges(tissue);
    }
    CHECK(stretched_energy(loose, 1.1) == Approx(stretched).epsilon(1e-9));   // copies move together in a uniform stretch
  }
}

TEST_CASE("an edge cut along its length leaves each side its own share, by hand") {
  // Two triangles of the same area at the diagonal 0–3 of a square: each owns half of its spring.
  auto tissue = tissue_of(make_grid<double>(2, 2, 1.0));
  int const upper = tissue.surface().triangle_with_edge(3, 0) >= 0 ? tissue.surface().triangle_with_edge(3, 0) : -1;
  int const lower = tissue.surface().triangle_with_edge(0, 3) >= 0 ? tissue.surface().triangle_with_edge(0, 3) : -1;
  REQUIRE(upper >= 0);
  REQUIRE(lower >= 0);
  std::array<int, 1> const side{upper};
  int const a = tissue.split_particle(0, side), b = tissue.split_particle(3, side);
  int const left = tissue.links().find(a, b), right = tissue.links().find(0, 3);
  REQUIRE(left >= 0);
  REQUIRE(right >= 0);
  CHECK(tissue.links()[left].weight == Approx(0.5));
  CHECK(tissue.links()[right].weight == Approx(0.5));
  CHECK(tissue.links().size() == 6);
  CHECK(tissue.mass(0) == Approx(tissue.mass(a)));   // half of the corner's triangles each
  CHECK(connected_components(rest_mesh(tissue)).size() == 2);
}

TEST_CASE("a split that is merged again has never been") {
  Random random(Seed{14});
  for (auto const& mesh : meshes()) {
    auto tissue = tissue_of(mesh);
    for (int k = 0; k < 25; ++k) {
      for (int insertion = 0; insertion < 2; ++insertion) palpate_test::random_insertion(tissue, tissue.surface(), random);
      Portrait const before(tissue);
      auto const [p, copy] = palpate_test::random_split(tissue, tissue.surface(), random);
      CHECK(Portrait(tissue).distance(before) > 1e-12);
      tissue.merge_last_particle(p);
      CHECK(Portrait(tissue).distance(before) < 1e-13);
    }
  }
}

TEST_CASE("a particle between nails is nailed, one beside a free particle is free") {
  auto const skin = make_grid<double>(4, 4, 1.0);
  auto tissue = tissue_of(skin);
  tissue.nail({0, 1, 5});
  int const inside = tissue.insert_in_triangle(0, {0.3, 0.3, 0.4});   // triangle 0, 1, 5
  CHECK(tissue.nailed(inside));
  CHECK(tissue.nailed(tissue.insert_on_edge(0, 1, 0.5)));
  CHECK_FALSE(tissue.nailed(tissue.insert_on_edge(1, 2, 0.5)));
}

TEST_CASE("coefficients of one edge go on to its pieces") {
  auto tissue = tissue_of(make_grid<double>(4, 4, 1.0));
  tissue.set_link(tissue.links().find(5, 6), {.stiffness = 200.0, .damping = 0.7});
  int const n = tissue.insert_on_edge(5, 6, 0.25);
  for (int const end : {5, 6}) {
    int const l = tissue.links().find(end, n);
    REQUIRE(l >= 0);
    CHECK(tissue.links()[l].law.stiffness == 200.0);
    CHECK(tissue.links()[l].law.damping == 0.7);
  }
  CHECK(tissue.links().find(5, 6) < 0);
}
