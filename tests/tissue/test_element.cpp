// SPDX-License-Identifier: MIT
// Elements, shipped ones and a user's. Yardsticks: central differences, Moreau's conditions of a projection, power iteration.
#include <palpate/core/random.hpp>
#include <palpate/testing/element.hpp>
#include <palpate/tissue/cubic_spring.hpp>
#include <palpate/tissue/locking_spring.hpp>
#include <palpate/tissue/saturating_spring.hpp>
#include <palpate/tissue/spring_elements.hpp>

#include "catch.hpp"
#include "tissue/user_elements.hpp"

#include <Eigen/Cholesky>

using namespace palpate;
using namespace palpate_test;

namespace {

template <RealScalar S>
NodeColumns<S, 4> corners() {   // of no regular tetrahedron
  NodeColumns<S, 4> x;
  x << S(0.001), S(0.011), S(0.002), S(0.003), S(0.0), S(0.001), S(0.012), S(0.001), S(-0.001), S(0.002), S(0.0), S(0.009);
  return x;
}

template <RealScalar S, class E>
std::string broken(E const& element, NodeColumns<S, E::nodes> const& rest, testing::ElementChecks const& checks = {}) {
  return testing::to_text(testing::check_element<S>(element, rest, checks));
}


/// A link of which a test makes wrong ones.
struct Base {
  static constexpr int nodes = 2;
  using Columns = NodeColumns<double, 2>;
  LinkSpring<double> spring;
  double energy(Columns const& x) const { return spring.energy(x); }
  Columns force(Columns const& x) const { return spring.force(x); }
  NodeMatrix<double, 2> stiffness(Columns const& x) const { return spring.stiffness(x); }
};

}  // namespace

TEMPLATE_TEST_CASE("shipped elements obey the laws of elements", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  NodeColumns<S, 2> const ends = corners<S>().template leftCols<2>();
  S const length = (ends.col(0) - ends.col(1)).norm();
  CHECK(broken<S>(LinkSpring<S>{length, S(0.7), {.stiffness = S(50), .damping = S(0.1)}}, ends) == "");
  CHECK(broken<S>(LinkSpring<S, SaturatingSpring<S>>{length, S(1), {.stiffness = S(50), .largest_tension = S(0.1), .damping = S(0.1)}}, ends) == "");
  CHECK(broken<S>(LinkSpring<S, LockingSpring<S>>{length, S(2), {.stiffness = S(50), .largest_tension = S(0.3), .damping = S(0.1)}}, ends) == "");
  CHECK(broken<S>(LinkSpring<S, CubicSpring<S>>{length, S(1), {.stiffness = S(50), .damping = S(0.1)}}, ends) == "");
  CHECK(broken<S>(LinkSpring<S>{S(0.9) * length, S(1), {.stiffness = S(50)}}, ends, {.relaxed = false}) == "");
  Vector3<S> const here(S(0.01), S(0.02), S(-0.03)), centre(S(0.002), S(0), S(0.01));
  testing::ElementChecks const tied{.reach = 0.005, .isolated = false};
  CHECK(broken<S>(SupportSpring<S>{(here - centre).norm(), S(0.7), {.stiffness = S(20), .damping = S(0.1)}, centre}, here, tied) == "");
  CHECK(broken<S>(SupportSpring<S, SaturatingSpring<S>>{(here - centre).norm(), S(1), {.stiffness = S(20), .largest_tension = S(0.1)}, centre}, here, tied) == "");
  CHECK(broken<S>(AnchorSpring<S>{here, {S(3), S(0.05)}}, here, tied) == "");
}

TEMPLATE_TEST_CASE("a user's elements obey them too", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  NodeColumns<S, 4> const rest = corners<S>();
  CHECK(broken<S>(UserTetrahedron<S>(rest, S(3000), S(0.3)), rest, {.turns = false}) == "");
  NodeColumns<S, 3> const triangle = rest.template leftCols<3>();
  CHECK(broken<S>(MembraneTriangle<S>(triangle, S(3000), S(0.3), S(0.001), S(0.01)), triangle) == "");
}

TEST_CASE("the battery of elements finds what is broken") {
  using Spring = LinkSpring<double>;
  NodeColumns<double, 2> const ends = corners<double>().leftCols<2>();
  Spring const good{(ends.col(0) - ends.col(1)).norm(), 1.0, {.stiffness = 50.0, .damping = 0.1}};
  CHECK(broken<double>(Base{good}, ends) == "");
  struct Energy : Base {
    double energy(Columns const& x) const { return 1.01 * spring.energy(x); }
  };
  CHECK_THAT(broken<double>(Energy{good}, ends), Catch::Matchers::Contains("-gradient of energy"));
  struct Stiffness : Base {
    NodeMatrix<double, 2> stiffness(Columns const& x) const { return spring.semidefinite_stiffness(x); }
  };
  CHECK_THAT(broken<double>(Stiffness{good}, ends), Catch::Matchers::Contains("-d force/dx"));
  struct Tied : Base {
    Columns force(Columns const& x) const {
      Columns f = spring.force(x);
      f(2, 0) -= 1e-3;
      return f;
    }
    double energy(Columns const& x) const { return spring.energy(x) + 1e-3 * x(2, 0); }
  };
  CHECK_THAT(broken<double>(Tied{good}, ends), Catch::Matchers::Contains("force at rest") && Catch::Matchers::Contains("have a sum"));
  struct Negative : Base {
    NodeMatrix<double, 2> semidefinite_stiffness(Columns const& x) const { return spring.stiffness(x); }
  };
  CHECK_THAT(broken<double>(Negative{good}, ends), Catch::Matchers::Contains("not positive semidefinite"));
  struct Bound : Base {
    double stiffness_bound() const { return 0.4 * spring.stiffness_bound(); }
    double stiffness_bound(Columns const& x) const { return 0.4 * spring.stiffness_bound(x); }
    double damping_bound() const { return 0; }
  };
  CHECK_THAT(broken<double>(Bound{good}, ends), Catch::Matchers::Contains("bound at rest") && Catch::Matchers::Contains("bound at x"));
  struct Skew : Base {
    NodeMatrix<double, 2> damping(Columns const&) const {
      NodeMatrix<double, 2> c = NodeMatrix<double, 2>::Identity();
      c(0, 0) = -1;
      return c;
    }
  };
  CHECK_THAT(broken<double>(Skew{good}, ends), Catch::Matchers::Contains("damping is not positive semidefinite"));
  struct Drags : Base {
    NodeMatrix<double, 2> damping(Columns const&) const { return 0.1 * NodeMatrix<double, 2>::Identity(); }
  };
  CHECK_THAT(broken<double>(Drags{good}, ends), Catch::Matchers::Contains("brakes an element that moves as a whole"));
  struct Light : Base {
    double mass() const { return -1; }
  };
  CHECK_THAT(broken<double>(Light{good}, ends), Catch::Matchers::Contains("the mass is -1 kg"));
  struct NearlyBound : Base {   // enough where nodes move at random, not where they move against each other
    double stiffness_bound() const { return 0.9 * spring.stiffness_bound(); }
    double stiffness_bound(Columns const& x) const { return 0.9 * spring.stiffness_bound(x); }
    double damping_bound() const { return 0; }
  };
  CHECK_THAT(broken<double>(NearlyBound{good}, ends), Catch::Matchers::Contains("bound at rest") && Catch::Matchers::Contains("bound at x"));
}

TEMPLATE_TEST_CASE("the semidefinite part of a symmetric matrix is its projection", "", PALPATE_TEST_SCALARS) {
  // P is the nearest one to A if and only if P and P − A are positive semidefinite and P (P − A) = 0.
  using S = TestType;
  using Square = Matrix<S, Dynamic, Dynamic>;
  S const digits = std::same_as<S, float> ? S(1e-5) : S(1e-13);
  auto const is_semidefinite = [&](Square const& m) { return Eigen::LLT<Square>(m + digits * Square::Identity(9, 9)).info() == Eigen::Success; };
  Random random(Seed{5});
  for (int trial = 0; trial < 50; ++trial) {
    Square a(9, 9);
    for (int k = 0; k < a.size(); ++k) a.data()[k] = random.uniform(S(-1), S(1));
    a = (a + a.transpose()).eval() / 10;
    if (trial % 5 == 0) a = (a * a).eval();   // semidefinite: handed back
    Square const part = detail::semidefinite_part<S, 9>(a), rest = part - a;
    CHECK(is_semidefinite(part));
    CHECK(is_semidefinite(rest));
    CHECK((part * rest).norm() < digits);
    if (trial % 5 == 0) CHECK(rest.norm() == 0);
  }
}

TEST_CASE("the bound of a block's norm is no less than its spectral norm, and exact where that is simple") {
  Random random(Seed{6});
  using Block = Matrix<double, 3, 3>;
  for (int trial = 0; trial < 200; ++trial) {
    Block b;
    for (int k = 0; k < 9; ++k) b.data()[k] = random.uniform(-1.0, 1.0);
    Vector3<double> v(0.3, 0.5, -0.8);
    for (int k = 0; k < 2000; ++k) v = Vector3<double>(b.transpose() * (b * v)).normalized();   // power iteration
    double const norm = (b * v).norm();
    CHECK(detail::norm_bound(b) >= norm * (1 - 1e-14));
    CHECK(detail::norm_bound(b) <= 1.74 * norm);
  }
  CHECK(detail::norm_bound(Block(3 * Block::Identity())) == Approx(3.0));
  Vector3<double> const n(0.6, 0.0, 0.8);
  CHECK(detail::norm_bound(Block(2 * n * n.transpose())) == Approx(2.0));
}
