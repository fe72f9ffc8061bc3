// SPDX-License-Identifier: MIT
// Elements and tissue of one's own need palpate/extend/tissue.hpp, a body of them palpate/body/soft_body.hpp besides, and nothing else. Yardstick: the
// batteries' differences, and free fall.
#include <palpate/extend/tissue.hpp>

#include "catch.hpp"

#include <palpate/body/soft_body.hpp>

#include "tissue/user_elements.hpp"

#include <cmath>
#include <limits>
#include <span>
#include <utility>

using namespace palpate;

namespace {

/// A cube of 20 mm in five tetrahedra, 1000 kg/m³.
template <class S>
auto cube() {
  TetrahedralMesh<S> mesh{Matrix<S, 3, Dynamic>(3, 8), Matrix<int, 4, Dynamic>(4, 5)};
  for (int i = 0; i < 8; ++i) mesh.points.col(i) = S(0.02) * Vector3<S>(S(i & 1), S(i >> 1 & 1), S(i >> 2 & 1));
  mesh.tetrahedra << 1, 2, 4, 7, 0,  0, 0, 0, 3, 3,  3, 3, 5, 5, 5,  5, 6, 6, 6, 6;   // four corners, and what they leave
  for (int t = 0; t < 5; ++t) {   // all the same way round
    auto c = mesh.tetrahedra.col(t);
    Matrix<S, 3, 3> edges;
    for (int k = 0; k < 3; ++k) edges.col(k) = mesh.points.col(c[k + 1]) - mesh.points.col(c[0]);
    if (edges.determinant() < 0) std::swap(c[2], c[3]);
  }
  return ElementTissue(mesh, make_elements(mesh.points, mesh.tetrahedra, [](auto const& rest) {
    return palpate_test::UserTetrahedron<S>(rest, S(3000), S(0.3));   // Pa
  }));
}

}  // namespace

TEMPLATE_TEST_CASE("a linear tetrahedron of one's own makes tissue", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const tissue = cube<S>();
  double mass = 0;
  for (int i = 0; i < tissue.size(); ++i) mass += static_cast<double>(tissue.mass(i));
  CHECK(mass == Approx(1000 * 8e-6).epsilon(1e-6));   // kg
  NodeColumns<S, 4> corners;
  corners << 0, S(0.02), 0, 0, 0, 0, S(0.02), 0, 0, 0, 0, S(0.02);
  CHECK(testing::to_text(testing::check_element<S>(palpate_test::UserTetrahedron<S>(corners, S(3000), S(0.3)), corners, {.turns = false})) == "");
  CHECK(testing::to_text(testing::check_tissue(tissue)) == "");

  SoftBody body(tissue);
  body.set_gravity({0, 0, S(-10)});
  body.apply_force(7, {S(0.01), 0, 0});   // N, in the first step: it shakes, and its middle goes on at F h/m
  S const h = body.stable_step() / 4;
  for (int k = 0; k < 100; ++k) REQUIRE(body.step(h));
  Vector3<double> momentum = Vector3<double>::Zero();
  for (int i = 0; i < body.size(); ++i) momentum += (tissue.mass(i) * body.velocities().col(i)).template cast<double>();
  double const t = 100 * static_cast<double>(h), fall = mass * 10 * t;
  CHECK(momentum.z() == Approx(-fall).epsilon(1e-4));
  CHECK(momentum.x() == Approx(0.01 * static_cast<double>(h)).margin(1e-4 * fall));
}

TEMPLATE_TEST_CASE("the least element and the least tissue keep their laws", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Vector3<S> const rest(S(0.01), 0, S(0.02));
  CHECK(testing::to_text(testing::check_element<S>(testing::ElementArchetype<S>{rest}, rest, {.reach = 0.005, .isolated = false})) == "");
  TriangleMesh<S> const mesh{Matrix<S, 3, Dynamic>(Matrix<S, 3, 3>::Identity() * S(0.01)), Matrix<int, 3, Dynamic>(Matrix<int, 3, 1>(0, 1, 2))};
  CHECK(testing::to_text(testing::check_tissue(testing::TissueArchetype<S>(mesh))) == "");
}

namespace {

using Right = testing::TissueArchetype<double>;
using Vector = Vector3<double>;

struct Pushes : Right {
  using Right::Right;
  Vector internal_force(int i, auto const& x, auto const& v) const { return -Right::internal_force(i, x, v); }
};
struct Undamped : Right {
  using Right::Right;
  Vector internal_force(int i, auto const& x, auto const& v) const { return Right::internal_force(i, x, v) + Vector(0.2 * v.col(i)); }
};
struct Heavy : Right {
  using Right::Right;
  double mass(int i) const { return i == 1 ? std::numeric_limits<double>::infinity() : 0.1; }
};
struct Loose : Right {
  using Right::Right;
  double damping_bound(int) const { return 0.19; }
};
struct Unbounded : Right {
  using Right::Right;
  double damping_bound(int) const { return std::nan(""); }
};
struct Hoards : Right {   // a force that grows with each time that it is assembled
  using Right::Right;
  struct Assembly : Right::Assembly {
    int times = 0;
    void add_forces(auto const& x, auto const& v, auto& f) const {
      for (int k = 0; k < times; ++k) Right::Assembly::add_forces(x, v, f);
    }
  };
  void assemble(std::span<int const> moving, Assembly& assembly) const { Right::assemble(moving, assembly), ++assembly.times; }
};
struct Divides : Right {   // 0/0 at rest
  using Right::Right;
  struct Assembly : Right::Assembly {
    Matrix3X<double> rest;
    void add_forces(auto const& x, auto const& v, auto& f) const {
      Right::Assembly::add_forces(x, v, f);
      for (int k = 0; k < static_cast<int>(this->particles().size()); ++k) {
        Vector const d = x.col(k) - rest.col(this->particles()[static_cast<std::size_t>(k)]);
        f.col(k) += d / d.norm() * 0.0;
      }
    }
  };
  void assemble(std::span<int const> moving, Assembly& assembly) const {
    Right::assemble(moving, assembly);
    assembly.rest.resize(3, this->size());
    for (int i = 0; i < this->size(); ++i) assembly.rest.col(i) = this->rest_position(i);
  }
};

}  // namespace

TEST_CASE("a tissue that is wrong is told so") {
  TriangleMesh<double> const mesh{Matrix<double, 3, Dynamic>(Matrix<double, 3, 3>::Identity() * 0.01), Matrix<int, 3, Dynamic>(Matrix<int, 3, 1>(0, 1, 2))};
  auto const told = [](auto const& tissue) { return testing::to_text(testing::check_tissue(tissue)); };
  CHECK_THAT(told(Pushes(mesh)), says("internal_force(0) is another than"));
  CHECK_THAT(told(Undamped(mesh)), says("internal_force(0) is another than"));
  CHECK_THAT(told(Heavy(mesh)), says("particle 1 weighs inf kg"));
  CHECK_THAT(told(Loose(mesh)), says("damping_bound(0) is 0.19"));
  CHECK_THAT(told(Unbounded(mesh)), says("both must be finite"));
  CHECK_THAT(told(Hoards(mesh)), says("an assembly that is used again answers otherwise"));
  CHECK_THAT(told(Divides(mesh)), says("at the rest shape is not finite"));
}
