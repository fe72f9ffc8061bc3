// SPDX-License-Identifier: MIT
#include "allocation_trap.hpp"
#include "catch.hpp"
#include "device/message.hpp"
#include "yardstick.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/theta_scheme.hpp>
#include <palpate/material/corotational.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/material/viscoelastic.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/statics/newton_raphson.hpp>
#include <palpate/testing/tissue.hpp>
#include <palpate/tissue/finite_elements.hpp>

#include <Eigen/Geometry>

#include <array>
#include <cmath>
#include <concepts>
#include <cstdlib>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

using namespace palpate;
using palpate_test::message_of;
using palpate_test::check_yardstick, palpate_test::text, palpate_test::unsaid, palpate_test::worse;

namespace {

template <class S>
auto fading(S young = 5000) {
  return Viscoelastic{StableNeoHookean<S>{.young = young, .poisson = S(0.45)}, {{S(0.3), S(0.1)}, {S(0.2), S(2.0)}}};
}

/// F of simple shear.
Tensor3<double> shear(double by) { return {1, by, 0, 0, 1, 0, 0, 0, 1}; }

template <class S, class M>
FiniteElements<S, M> solid(TetrahedralMesh<S> const& mesh, M const& material, Pressure pressure = Pressure::element) {
  return {mesh, {.density = 1000, .material = material, .pressure = pressure}};
}

// Without a scalar of its own a material that fades has that of the material inside.
static_assert(std::same_as<Viscoelastic<StableNeoHookean<float>>, Viscoelastic<StableNeoHookean<float>, float>>);
static_assert(Material<Viscoelastic<StableNeoHookean<float>>, float> && Material<Viscoelastic<StableNeoHookean<double>>, double>);

}  // namespace

// Yardstick: the Prony series. The shear stress of Hooke's law in shear is deviatoric as a whole.
TEST_CASE("a strain that is kept fades by the Prony series", "[tissue][viscoelastic][yardstick]") {
  auto law = Viscoelastic{Corotational<double>{.young = 3000, .poisson = 0.45}, {{0.3, 0.1}, {0.2, 2.0}}}.law();
  PronyHistory<double> history;
  Tensor3<double> const F = shear(1e-6);
  PronyStep<double> at_once(0.0);
  law.faded = history.advance(law, F, at_once);
  double const first = law.stress(F).xy;
  CHECK(std::abs(first / (3000 / 2.9 * 1e-6) - 1) < 1e-5);   // small strain
  double time = 0, worst = 0;
  for (double const h : {1e-3, 0.05, 0.1, 0.4, 1.0, 5.0}) {
    PronyStep<double> step(h);
    law.faded = history.advance(law, F, step);
    time += h;
    double const series = 0.5 + 0.3 * std::exp(-time / 0.1) + 0.2 * std::exp(-time / 2.0);
    worst = worse(worst, std::abs(law.stress(F).xy / first - series));
  }
  check_yardstick({.what = "strain that is kept, 6 steps of 1 ms to 5 s: largest error of the stress over the first", .source = "Prony's series", .expected = 0, .ours = worst, .within = 1e-10});
  PronyHistory<double> grown;   // volume has no part in it
  auto const swollen = grown.advance(law, 1.05 * Tensor3<double>::identity(), at_once);
  CHECK(std::abs(swollen.xx) + std::abs(swollen.xy) < 1e-10);
}

// Yardstick: the closed form, in long double: Q = S (1 - (1 - f) exp(-n s)) after a first step that takes S from 0, of which f = 1 - (1 - exp(-s))/s follows.
TEMPLATE_TEST_CASE("a strain that is kept fades as slowly as a term of many steps asks for", "[tissue][viscoelastic]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  S const h = S(1e-3);
  for (S const time : {S(0.002), S(0.0999), S(0.1001), S(1), S(100), S(1e4)}) {   // s = 0.5 … 1e-7
    auto law = Viscoelastic{Corotational<S>{.young = 3000, .poisson = S(0.45)}, {{S(0.5), time}}}.law();
    PronyHistory<S> history;
    PronyStep<S> step(h);
    Tensor3<S> const F{1, S(0.1), 0, 0, 1, 0, 0, 0, 1};
    long double const s = static_cast<long double>(h) / time, f = 1 + std::expm1(-s) / s;
    long double const first = s < 1e-3L ? s / 2 - s * s / 6 + s * s * s / 24 - s * s * s * s / 120 : f;
    int done = 0;
    for (int const n : {1, 10, 1000, 20000}) {
      S faded = 0;
      for (; done < n; ++done) faded = history.advance(law, F, step).xy;
      long double const expected = history.last.xy * (first - (1 - first) * std::expm1(-(n - 1) * s)) / 2;
      INFO("time " << time << ", steps " << n << ", faded " << faded << " of " << static_cast<double>(expected));
      CHECK(std::abs(faded / expected - 1) < (n == 1 ? 1e3 : 3e4) * std::numeric_limits<S>::epsilon());   // a step of 1e-7 is rounded at what there is
    }
  }
}

// Yardstick: G' = G (g∞ + Σ g ω²τ²/(1 + ω²τ²)), G'' = G Σ g ωτ/(1 + ω²τ²).
TEST_CASE("a strain that swings meets storage and loss modulus, in second order", "[tissue][viscoelastic][yardstick]") {
  double const pi = std::acos(-1.0), amplitude = 1e-5, G = 3000 / 2.9;
  for (double const omega : {0.5, 3.0, 20.0}) {
    std::string const what = "strain that swings, ω = " + text(omega) + " 1/s, 200 steps a period: ";
    std::array<double, 2> errors{};
    for (std::size_t round = 0; round < 2; ++round) {
      int const steps = round == 0 ? 200 : 400;   // a period
      auto law = Viscoelastic{Corotational<double>{.young = 3000, .poisson = 0.45}, {{0.3, 0.1}, {0.2, 2.0}}}.law();
      PronyHistory<double> history;
      double const h = 2 * pi / omega / steps;
      PronyStep<double> step(h);
      int const periods = 10 + static_cast<int>(40.0 * omega / (2 * pi));   // until the start has faded
      double in = 0, out = 0;
      for (int k = 1; k <= periods * steps; ++k) {
        double const phase = omega * h * k;
        Tensor3<double> const F = shear(amplitude * std::sin(phase));
        law.faded = history.advance(law, F, step);
        if (k <= (periods - 1) * steps) continue;
        in += law.stress(F).xy * std::sin(phase) * 2 / steps, out += law.stress(F).xy * std::cos(phase) * 2 / steps;
      }
      double storage = 0.5, loss = 0;
      for (auto const& [share, tau] : {std::pair{0.3, 0.1}, std::pair{0.2, 2.0}}) {
        double const x = omega * tau;
        storage += share * x * x / (1 + x * x), loss += share * x / (1 + x * x);
      }
      double const found_storage = in / (G * amplitude), found_loss = out / (G * amplitude);
      errors[round] = std::hypot(found_storage - storage, found_loss - loss);
      CHECK(errors[round] < 1e-4);
      if (round > 0) continue;
      check_yardstick({.what = what + "G′/G", .source = "g∞ + Σ g ω²τ²/(1 + ω²τ²)", .expected = storage, .ours = found_storage, .within = 1e-4});
      check_yardstick({.what = what + "G″/G", .source = "Σ g ωτ/(1 + ω²τ²)", .expected = loss, .ours = found_loss, .within = 1e-4});
    }
    check_yardstick({.what = what + "error over that of 400", .source = "second order", .expected = 4, .ours = errors[0] / errors[1], .within = 0.5});
  }
}

TEMPLATE_TEST_CASE("a solid that fades keeps the laws of tissues, with what it remembers", "[tissue][viscoelastic]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  std::srand(3);
  auto const mesh = make_block<S>(3, 3, 3, S(0.01), BlockPattern::alternating);
  for (Pressure const pressure : {Pressure::element, Pressure::nodal}) {
    auto tissue = solid<S>(mesh, fading<S>(), pressure);
    CHECK(testing::check_tissue(tissue, {.displacement = 0.05}) == testing::Violations{});
    Matrix3X<S> const x = mesh.points + S(5e-4) * Matrix3X<S>::Random(3, tissue.size()), still = Matrix3X<S>::Zero(3, tissue.size());
    tissue.remember(x, S(0.2)), tissue.remember(x, S(0.2));
    // Yardstick: central differences of the energy.
    Matrix3X<S> at = x, forces(3, tissue.size());
    Matrix3X<S> const all = testing::detail::WholeTissue<decltype(tissue)>(tissue).forces(x, still);
    for (int i = 0; i < tissue.size(); ++i) CHECK((tissue.internal_force(i, x, still) - all.col(i)).norm() < S(std::same_as<S, float> ? 1e-4 : 1e-11) * all.norm());
    if constexpr (std::same_as<S, double>) {
      for (Eigen::Index k = 0; k < x.size(); ++k) {
        double const before = at(k), step = 1e-7;
        at(k) = before + step;
        double const ahead = tissue.potential_energy(at);
        at(k) = before - step;
        forces(k) = (tissue.potential_energy(at) - ahead) / (2 * step);
        at(k) = before;
      }
      CHECK((forces - all).norm() < 1e-6 * all.norm());
      // Turned as a whole it turns along: what is remembered lies in the tissue.
      Matrix<double, 3, 3> const R = Eigen::AngleAxisd(1.1, Vector3<double>(1, 2, -1).normalized()).toRotationMatrix();
      Matrix3X<double> const turned = R * x;
      CHECK((testing::detail::WholeTissue<decltype(tissue)>(tissue).forces(turned, still) - R * all).norm() < 1e-10 * all.norm());
    }
  }
}

// Yardstick: Hooke's law with what is left of the modulus, in a bar whose sides are free; Newton's method on an elastic bar.
TEST_CASE("a bar that hangs creeps from the sag of its modulus at once to that of what is left", "[tissue][viscoelastic][yardstick]") {
  auto const mesh = make_block<double>(3, 3, 9, 0.01, BlockPattern::alternating);
  auto const nail = [&](auto& tissue) { tissue.nail(vertices_where(mesh, [](auto const& p) { return p.z() > 0.08 - 1e-6; })); };
  auto const sag = [&](auto const& body) { return mesh.points.row(2).minCoeff() - body.positions().row(2).minCoeff(); };
  auto const elastic = [&](double young, double poisson) {
    auto tissue = solid<double>(mesh, StableNeoHookean<double>{young, poisson});
    nail(tissue);
    SoftBody body(std::move(tissue), BackwardEuler{});
    body.set_gravity({0, 0, -9.81});
    body.settle(NewtonRaphson{});
    return sag(body);
  };
  double const E = 2e4, nu = 0.45, mu = E / (2 * (1 + nu)), bulk = E / (3 * (1 - 2 * nu)), left = mu / 2;   // g∞ = ½ of the shear modulus
  double const at_once = elastic(E, nu), later = elastic(9 * bulk * left / (3 * bulk + left), (3 * bulk - 2 * left) / (6 * bulk + 2 * left));
  REQUIRE(later > 1.8 * at_once);
  auto const creep = [&](auto const& integrator, double h) {
    auto tissue = solid<double>(mesh, fading<double>(E));
    nail(tissue);
    SoftBody body(std::move(tissue), integrator);
    body.set_gravity({0, 0, -9.81});
    body.settle(NewtonRaphson{});
    check_yardstick({.what = "bar that hangs and fades: sag at once [m]", .source = "elastic bar of the whole modulus", .expected = at_once, .ours = sag(body), .within = 1e-6, .relative = true});
    body.step(h);
    palpate_test::AllocationCount const allocations;
    double last = sag(body);
    bool monotone = true;
    for (int k = 0; k < static_cast<int>(20.0 / h); ++k) {
      REQUIRE(body.step(h));
      if (double const now = sag(body); k % 50 == 0) monotone = monotone && now > last - 1e-5, last = now;
    }
    CHECK(allocations.count() == 0);
    CHECK(monotone);
    check_yardstick({.what = "bar that hangs and fades: sag after 20 s [m]", .source = "elastic bar of what is left", .expected = later, .ours = sag(body), .within = 2e-3, .relative = true});
    return body;
  };
  auto body = creep(BackwardEuler{.tolerance = 1e-6}, 0.02);
  body.reset();
  CHECK(body.tissue().internal_force(0, mesh.points, mesh.points * 0).norm() < 1e-12);   // forgotten
}

TEST_CASE("what a solid remembers is saved, copied, and the same on all cores' order", "[tissue][viscoelastic]") {
  auto const mesh = make_block<double>(5, 4, 4, 0.01, BlockPattern::alternating);
  auto const body_of = [&](auto const& integrator, auto const& region) {
    auto tissue = solid<double>(mesh, fading<double>());
    tissue.nail(vertices_where(mesh, [](auto const& p) { return p.x() < 1e-6; }));
    SoftBody body(std::move(tissue), integrator, region);
    body.set_gravity({0, 0, -9.81});
    return body;
  };
  auto const check = [&](auto body, double h) {
    for (int k = 0; k < 30; ++k) body.step(h);
    auto const mark = body.save();
    auto other = body;
    auto fresh = body;
    fresh.reset();
    fresh.restore(mark);
    for (int k = 0; k < 30; ++k) body.step(h), other.step(h), fresh.step(h);
    CHECK(body.positions() == other.positions());
    CHECK(body.positions() == fresh.positions());
    body.restore(mark);
    for (int k = 0; k < 30; ++k) body.step(h);
    CHECK(body.positions() == other.positions());
  };
  check(body_of(BackwardEuler{}, WholeBody{}), 0.01);
  check(body_of(LeapfrogVerlet{}, WholeBody{}), 5e-4);
  check(body_of(BackwardEuler{}, ZoneOfInfluence{.rings = 2}), 0.01);
}

// Yardstick: work. What is pulled and let go slowly gives back less than was put in.
TEST_CASE("a solid of two materials that fade is set anew, and what cannot be is refused", "[tissue][viscoelastic][error]") {
  auto const mesh = make_block<double>(3, 3, 3, 0.01, BlockPattern::alternating);
  auto tissue = solid<double>(mesh, fading<double>());
  Matrix3X<double> const x = 1.02 * mesh.points, still = Matrix3X<double>::Zero(3, tissue.size());
  tissue.remember(x, 1.0);
  tissue.set_material(std::vector<int>{0, 1}, fading<double>(8000), 1200.0);
  CHECK(tissue.list().elements[0].law().faded.xx == 0);
  double const nan = std::numeric_limits<double>::quiet_NaN();
  auto const with = [&](PronyTerm<double> const& one, PronyTerm<double> const& two) {
    return message_of([&] { solid<double>(mesh, Viscoelastic{StableNeoHookean<double>{.young = 5e3, .poisson = 0.45}, {one, two}}); });
  };
  CHECK(with({0.3, 0.1}, {0.2, 2.0}) == "(no exception)");
  CHECK(unsaid(with({0.3, 0.1}, {-0.2, 2.0}), "the share of Prony's term 1 is -0.2", "from 0 to below 1") == "");
  CHECK(unsaid(with({nan, 0.1}, {0.2, 2.0}), "the share of Prony's term 0 is nan") == "");
  CHECK(unsaid(with({0.6, 0.1}, {0.5, 2.0}), "are 1.1 together", "less than 1") == "");
  CHECK(unsaid(with({0.3, 0.0}, {0.5, 2.0}), "the time of Prony's term 0 is 0 s", "positive") == "");
  CHECK(unsaid(with({0.3, nan}, {0.5, 2.0}), "the time of Prony's term 0 is nan s") == "");
  // Finite for what is flat or turned over.
  Matrix3X<double> flat = mesh.points;
  flat.row(2).setZero();
  tissue.remember(flat, 0.1);
  tissue.remember(-1.0 * mesh.points, 0.1);
  for (auto const& element : tissue.list().elements) CHECK(std::isfinite(element.law().faded.xx));
}

// Pressed flat while its base is drawn wide, then let go over a base of its size. Yardstick: the same of elastic tissue, which is as it was within a second; the
// longest time of the series is 0.1 s.
TEST_CASE("what was pressed flat comes back, and what it remembers of that fades", "[tissue][viscoelastic]") {
  auto const volume_after = [](auto const& material, auto integrator, double h, double wide, double flat, double least) {
    TetrahedralMesh<double> mesh;
    mesh.points.resize(3, 4), mesh.tetrahedra.resize(4, 1);
    mesh.points << 0, 0.01, 0, 0, 0, 0, 0.01, 0, 0, 0, 0, 0.01;
    mesh.tetrahedra << 0, 1, 2, 3;
    SoftBody body(FiniteElements<double, std::remove_cvref_t<decltype(material)>>(mesh, {.density = 1000, .material = material, .damping = {.alpha = 20}}), integrator);
    auto const run = [&](double seconds, auto const& before) {
      int const steps = static_cast<int>(std::lround(seconds / h));
      for (int k = 1; k <= steps; ++k) before(static_cast<double>(k) / steps), body.step(h);
    };
    auto const pose = [&](double width, double height) {
      for (int i = 0; i < 4; ++i) body.drag(i, mesh.points.col(i).cwiseProduct(Vector3<double>(width, width, height)));
    };
    run(0.1, [&](double s) { pose(1 + (wide - 1) * s, 1 + (flat - 1) * s); });
    run(0.3, [](double) {});
    run(0.02, [&](double s) { pose(wide + (1 - wide) * s, flat + (least - flat) * s); });
    body.release(3);
    run(1.5, [](double) {});
    return body.tissue().lowest_determinant(body.positions()).value;
  };
  StableNeoHookean<double> const elastic{.young = 5e3, .poisson = 0.45};
  Viscoelastic const fading{elastic, {{0.3, 0.1}, {0.2, 0.02}}};
  struct Press {
    double wide, flat, least;
  };
  for (auto const& [wide, flat, least] : {Press{2, 0.03, 0.02}, Press{1.5, 0.05, 0.03}, Press{1, 0.11, 0.05}, Press{1, 0.2, -0.05}}) {
    CHECK(volume_after(elastic, BackwardEuler{}, 1e-3, wide, flat, least) > 0.999);
    CHECK(volume_after(fading, BackwardEuler{}, 1e-3, wide, flat, least) > 0.999);
    CHECK(volume_after(fading, ThetaScheme{.theta = 0.6}, 1e-3, wide, flat, least) > 0.999);
    CHECK(volume_after(fading, LeapfrogVerlet{}, 2e-5, wide, flat, least) > 0.999);
  }
}
