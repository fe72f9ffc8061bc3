// SPDX-License-Identifier: MIT
#include "catch.hpp"
#include "tissue/yardstick.hpp"

#include <palpate/core/error.hpp>
#include <palpate/material/corotational.hpp>
#include <palpate/material/linear_elastic.hpp>
#include <palpate/material/neo_hookean.hpp>
#include <palpate/material/st_venant_kirchhoff.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/testing/material.hpp>

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstdlib>
#include <limits>
#include <string>
#include <utility>

using namespace palpate;
using palpate_test::check_yardstick, palpate_test::text, palpate_test::worse;

namespace {

using Square = Eigen::Matrix3d;

Tensor3<double> tensor(Square const& m) { return {m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1), m(2, 2)}; }
Square matrix(Tensor3<double> const& a) { return (Square() << a.xx, a.xy, a.xz, a.yx, a.yy, a.yz, a.zx, a.zy, a.zz).finished(); }

/// Lateral stretch and stress along x of a bar that is pulled to a stretch and free at its sides.
template <class Law>
std::pair<double, double> pull(Law const& law, double stretch) {
  double low = 0.2, high = 3.0;   // the lateral stress grows with the lateral stretch
  for (int k = 0; k < 200; ++k) {
    double const middle = (low + high) / 2;
    (law.stress({stretch, 0, 0, 0, middle, 0, 0, 0, middle}).yy > 0 ? high : low) = middle;
  }
  return {low, law.stress({stretch, 0, 0, 0, low, 0, 0, 0, low}).xx};
}

template <class Law>
Square cauchy(Law const& law, Square const& F) {
  return matrix(law.stress(tensor(F))) * F.transpose() / F.determinant();
}

bool says_so(testing::Violations const& found, char const* sentence) { return std::find(found.begin(), found.end(), sentence) != found.end(); }

Square simple_shear(double gamma) {
  Square F = Square::Identity();
  F(0, 1) = gamma;
  return F;
}

/// A law whose stress is not the gradient of its energy, and more.
template <class S>
struct Wrong {
  int mistake;
  S energy(Tensor3<S> const& F) const { return right().energy(F) + S(mistake == 0 ? 10 : 0) + (mistake == 4 ? F.xy * F.xy * 100 : 0); }
  Tensor3<S> stress(Tensor3<S> const& F) const {
    auto P = S(mistake == 1 ? 1.1 : 1) * right().stress(F);
    if (mistake == 4) P.xy += 200 * F.xy;
    return P;
  }
  Tensor3<S> stress_change(Tensor3<S> const& F, Tensor3<S> const& d) const {
    auto P = S(mistake == 1 || mistake == 2 ? 1.1 : 1) * right().stress_change(F, d);
    if (mistake == 3) P.xy += 100 * d.xx;
    if (mistake == 4) P.xy += 200 * d.xy;
    return P;
  }
  static StVenantKirchhoffLaw<S> right() { return StVenantKirchhoff<S>{1000, S(0.3)}.law(); }
};

/// St. Venant and Kirchhoff's law with a fibre along x that gets steep: ψ = … + c/(2k) (exp(k e²) − 1), e = |f|² − 1, f the first column of F.
template <class S>
struct Steep {
  StVenantKirchhoffLaw<S> rest = StVenantKirchhoff<S>{1000, S(0.3)}.law();
  S c = 1000, k = 100;
  S energy(Tensor3<S> const& F) const { return rest.energy(F) + c / (2 * k) * std::expm1(k * e(F) * e(F)); }
  Tensor3<S> stress(Tensor3<S> const& F) const { return rest.stress(F) + 2 * c * e(F) * grown(F) * fibre(F); }
  Tensor3<S> stress_change(Tensor3<S> const& F, Tensor3<S> const& d) const {
    S const change = 2 * double_contraction(fibre(F), fibre(d));
    return rest.stress_change(F, d) + 2 * c * grown(F) * ((1 + 2 * k * e(F) * e(F)) * change * fibre(F) + e(F) * fibre(d));
  }
  static Tensor3<S> fibre(Tensor3<S> const& F) { return {F.xx, 0, 0, F.yx, 0, 0, F.zx, 0, 0}; }
  static S e(Tensor3<S> const& F) { return F.xx * F.xx + F.yx * F.yx + F.zx * F.zx - 1; }
  S grown(Tensor3<S> const& F) const { return std::exp(k * e(F) * e(F)); }
};

/// A law with a bulk modulus of so many times that of St. Venant and Kirchhoff's.
template <class Law, class S>
struct Bulky : Law {
  S times = 1;
  S bulk_modulus() const { return times * StVenantKirchhoff<S>{1000, S(0.3)}.law().bulk_modulus(); }
};

}  // namespace

// Yardsticks: central differences, rotations, and Hooke's law in the limit.
TEMPLATE_TEST_CASE("each material is the gradient of its energy, turns with the tissue and obeys Hooke's law at small strain", "[material]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  double const strain = GENERATE(0.05, 0.3, 1.0);
  auto const check = [&](auto const& material, bool objective) {
    return testing::check_material<S>(material.law(), {.strain = strain, .objective = objective, .young = 3000, .poisson = 0.4});
  };
  S const young = 3000, poisson = S(0.4);
  CHECK(check(LinearElastic<S>{young, poisson}, false) == testing::Violations{});
  CHECK(check(Corotational<S>{young, poisson}, true) == testing::Violations{});
  CHECK(check(StVenantKirchhoff<S>{young, poisson}, true) == testing::Violations{});
  CHECK(check(StableNeoHookean<S>{young, poisson}, true) == testing::Violations{});
  if (strain < 1) CHECK(check(NeoHookean<S>{young, poisson}, true) == testing::Violations{});
}

TEMPLATE_TEST_CASE("the law battery sees what is wrong", "[material]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const check = [](int mistake, testing::MaterialChecks const& checks = {}) { return testing::check_material<S>(Wrong<S>{mistake}, checks); };
  CHECK(check(5) == testing::Violations{});
  CHECK(check(0) == testing::Violations{"there is energy at F = 1"});
  CHECK(check(1) == testing::Violations{"stress must be d energy/dF"});
  CHECK(check(2) == testing::Violations{"stress_change must be d stress/dF : dF"});
  CHECK(says_so(check(3), "stress_change must be symmetric: a : change(b) = b : change(a)"));
  CHECK(check(4) == testing::Violations{"the energy changes when the tissue is turned"});
  CHECK(check(5, {.young = 1100, .poisson = 0.3}) == testing::Violations{"small strains must obey Hooke's law: stress_change(1, d) is another"});
  CHECK(says_so(testing::check_material<S>(LinearElastic<S>{1000, S(0.3)}.law()), "the energy changes when the tissue is turned"));
}

TEMPLATE_TEST_CASE("the law battery follows a law that gets steep, and says where its numbers end", "[material]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  CHECK(testing::to_text(testing::check_material<S>(Steep<S>{}, {.strain = 0.05})) == "");
  auto const found = testing::check_material<S>(Steep<S>{.k = std::same_as<S, float> ? S(100) : S(1000)}, {.strain = 0.3});   // exp of more than 88, or 709
  REQUIRE(found.size() == 1);
  CHECK_THAT(found[0], says("energy, stress or stress_change is not finite at F = {", "det F = "));
}

TEMPLATE_TEST_CASE("the law battery compares the bulk modulus with that of the tangent", "[material]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const check = [](auto law, double times) {
    Bulky<decltype(law), S> const bulky{law, S(times)};
    return testing::to_text(testing::check_material<S>(bulky, {.strain = 0.05}));
  };
  auto const isotropic = StVenantKirchhoff<S>{1000, S(0.3)}.law();
  CHECK(check(isotropic, 1) == "");
  CHECK_THAT(check(isotropic, 1.1), says("bulk_modulus() is 916", "but that of stress_change at F = 1 is 833"));   // E/(3 (1 − 2ν))
  CHECK_THAT(check(isotropic, 0.9), says("bulk_modulus() is 75", "but that of stress_change at F = 1 is 833"));
  CHECK(check(Steep<S>{}, 1) == "");   // a fibre adds to what it takes to press all sides together
  CHECK_THAT(check(Steep<S>{}, 3), says("bulk_modulus() is 25", "but that of stress_change at F = 1 is 1277"));   // + 4 c/9
}

// Yardstick: closed forms; for the neo-Hookean bar the root of its two equations, found elsewhere.
TEST_CASE("bars and shears follow the closed forms", "[material][yardstick]") {
  double const E = 5000, nu = 0.45, mu = E / (2 * (1 + nu)), lambda = E * nu / ((1 + nu) * (1 - 2 * nu));
  auto const st_venant = StVenantKirchhoff<double>{E, nu}.law();
  auto const neo_hooke = NeoHookean<double>{E, nu}.law();
  for (double const stretch : {0.8, 1.0, 1.3}) {
    check_yardstick({.what = "bar of St. Venant-Kirchhoff, ν = 0.45, stretch " + text(stretch) + ": P/E", .source = "(λ³ − λ)/2", .expected = (stretch * stretch * stretch - stretch) / 2,
                     .ours = pull(st_venant, stretch).second / E, .within = 1e-9});
  }
  for (double const gamma : {-0.4, 0.1, 1.5}) {
    std::string const sheared = "simple shear γ = " + text(gamma) + " of ";
    check_yardstick({.what = sheared + "St. Venant-Kirchhoff: P₁₂/E", .source = "(μγ + (λ + 2μ)γ³/2)/E", .expected = (mu * gamma + (lambda + 2 * mu) * gamma * gamma * gamma / 2) / E,
                     .ours = st_venant.stress(tensor(simple_shear(gamma))).xy / E, .within = 1e-12});
    Square const sigma = cauchy(neo_hooke, simple_shear(gamma));
    check_yardstick({.what = sheared + "neo-Hooke: σ₁₂/E", .source = "μγ/E", .expected = mu * gamma / E, .ours = sigma(0, 1) / E, .within = 1e-12});
    check_yardstick({.what = sheared + "neo-Hooke: (σ₁₁ − σ₂₂)/E", .source = "μγ²/E", .expected = mu * gamma * gamma / E, .ours = (sigma(0, 0) - sigma(1, 1)) / E, .within = 1e-12});
  }
  struct Bar {
    double stretch, lateral, stress;
  };
  for (Bar const& bar : {Bar{0.7, 1.170853, -0.433939}, Bar{2.0, 0.725935, 0.598796}}) {
    auto const [lateral, stress] = pull(neo_hooke, bar.stretch);
    std::string const what = "bar of neo-Hooke, ν = 0.45, stretch " + text(bar.stretch);
    check_yardstick({.what = what + ": lateral stretch", .source = "root of its two equations, computed independently", .expected = bar.lateral, .ours = lateral, .within = 1e-6});
    check_yardstick({.what = what + ": P/E", .source = "root of its two equations, computed independently", .expected = bar.stress, .ours = stress / E, .within = 1e-6});
  }
}

// Yardstick: the rotation U diag(1, 1, det) V^T of Eigen's singular value decomposition.
TEST_CASE("the nearest rotation is that of the singular value decomposition, turned over too", "[material][yardstick]") {
  std::srand(7);
  double worst = 0;
  for (int k = 0; k < 2000; ++k) {
    Square const F = (k % 2 == 0 ? 1.0 : 0.0) * Square::Identity() + 0.7 * Square::Random();
    Eigen::JacobiSVD<Square> const svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
    double const sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
    if (svd.singularValues()[1] + sign * svd.singularValues()[2] < 1e-3) continue;   // none is nearest
    Square const R = svd.matrixU() * Eigen::Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
    RotationOf<double> const found(tensor(F));
    worst = worse(worst, worse((matrix(found.R) - R).norm(), std::abs(found.trace - (R.transpose() * F).trace())));
  }
  check_yardstick({.what = "nearest rotation of 2000 random F: norm of the difference", .source = "singular values, Eigen", .expected = 0, .ours = worst, .within = 1e-9});
  for (double const stretch : {0.0, 1e-200, 1e-9, 1e9}) CHECK(is_finite(matrix(RotationOf<double>(Tensor3<double>::diagonal(stretch)).R)));
}

// Where the two smallest stretches cancel no rotation is nearest, and Newton's steps for the trace end at a double root. Yardstick: with any rotation |P| is at most
// 2 μ (|F| + √3) + √3 λ |tr S − 3|, tr S no more than √3 |F|.
TEMPLATE_TEST_CASE("the corotational stress stays what it can be where no rotation is nearest", "[material]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const law = Corotational<S>{.young = S(5e3), .poisson = S(0.45)}.law();
  std::srand(11);
  double worst = 0;
  for (int k = 0; k < 4000; ++k) {
    double const off = k < 2000 ? 0 : std::pow(10.0, -1 - k % 12);
    Square const Q = Eigen::HouseholderQR<Square>(Square::Random()).householderQ(), U = Eigen::HouseholderQR<Square>(Square::Random()).householderQ();
    Eigen::Vector3d const stretches = k % 2 == 0 ? Eigen::Vector3d(3, 0.5, -0.5 + off) : Eigen::Vector3d(3, off, 0);
    Eigen::Matrix<S, 3, 3> const F = (Q * stretches.asDiagonal() * U.transpose() * (Q.determinant() * U.determinant())).cast<S>();
    Tensor3<S> const tensor{F(0, 0), F(0, 1), F(0, 2), F(1, 0), F(1, 1), F(1, 2), F(2, 0), F(2, 1), F(2, 2)}, P = law.stress(tensor);
    double const norm = std::sqrt(double(double_contraction(P, P))), size = double(F.norm()), three = std::sqrt(3.0);
    double const most = 2 * double(law.mu) * (size + three) + three * double(law.lambda) * (three * size + 3);
    REQUIRE(std::isfinite(double(law.energy(tensor))));
    worst = worse(worst, norm / most);
  }
  CHECK(worst < 1);
}

// Yardstick: the eigenvalues of the tangent as a 9 x 9 matrix, by Eigen.
TEST_CASE("the tangent's positive semidefinite part leaves the positive eigenvalues", "[material][yardstick]") {
  std::srand(5);
  auto const check = [](auto const& law, double strain) {
    Square const F = Square::Identity() + strain * Square::Random();
    Eigen::Matrix<double, 9, 9> whole, part;
    detail::PrincipalTangent<double> const tangent(law, tensor(F));
    for (int k = 0; k < 9; ++k) {
      Square d = Square::Zero();
      d(k) = 1;
      whole.col(k) = Eigen::Map<Eigen::Matrix<double, 9, 1> const>(Square(matrix(law.stress_change(tensor(F), tensor(d)))).data());
      part.col(k) = Eigen::Map<Eigen::Matrix<double, 9, 1> const>(Square(matrix(tangent.stress_change(tensor(d)))).data());
    }
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> const eigen(whole);
    Eigen::Matrix<double, 9, 9> const expected = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() * eigen.eigenvectors().transpose();
    return (part - expected).norm() / expected.norm();
  };
  double worst = 0;
  for (double const strain : {0.0, 0.1, 0.5, 1.0})
    for (int k = 0; k < 50; ++k) {
      worst = worse(worst, check(StVenantKirchhoff<double>{1000, 0.4}.law(), strain));
      worst = worse(worst, check(StableNeoHookean<double>{1000, 0.4}.law(), strain));
      worst = worse(worst, check(Corotational<double>{1000, 0.4}.law(), strain));
      if (strain < 0.4) worst = worse(worst, check(NeoHookean<double>{1000, 0.4}.law(), strain));
    }
  check_yardstick({.what = "positive semidefinite part of the tangent, four laws: difference over its norm", .source = "eigenvalues, Eigen", .expected = 0, .ours = worst, .within = 1e-6});
}

TEST_CASE("a modulus or Poisson's ratio that cannot be is refused in a line", "[material][error]") {
  double const nan = std::numeric_limits<double>::quiet_NaN();
  for (double const young : {5.0, 2e10, 0.0, -1.0, nan}) CHECK_THROWS_AS((StableNeoHookean<double>{young, 0.4}.law()), InvalidArgument);
  for (double const poisson : {0.5, 0.6, -1.0, nan}) CHECK_THROWS_AS((Corotational<double>{1000, poisson}.law()), InvalidArgument);
  CHECK_THROWS_WITH((StableNeoHookean<double>{5.0, 0.4}.law()), says("Young's modulus is 5 Pa", "kPa times 1,000"));
  CHECK_THROWS_WITH((StableNeoHookean<double>{5000, 0.5}.law()), says("Poisson's ratio is 0.5", "below 0.5"));
}
