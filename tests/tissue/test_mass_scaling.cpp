// SPDX-License-Identifier: MIT
#include "catch.hpp"
#include "yardstick.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/material/corotational.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/lowest_frequencies.hpp>
#include <palpate/tissue/mass_scaling.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/supported.hpp>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

using namespace palpate;
using palpate_test::check_yardstick, palpate_test::worse;

namespace {

template <class S>
FiniteElements<S, StableNeoHookean<S>> clamped(TetrahedralMesh<S> const& mesh, Pressure pressure = Pressure::element) {
  FiniteElements<S, StableNeoHookean<S>> tissue(mesh, {.density = 1000, .material = {.young = 5e3, .poisson = S(0.45)}, .pressure = pressure});
  tissue.nail(vertices_where(mesh, [](auto const& p) { return p.x() < S(1e-6); }));
  return tissue;
}

/// A beam in which two vertices have come near others: the tetrahedra between them are flat.
TetrahedralMesh<double> beam_with_slivers() {
  auto mesh = make_block<double>(9, 4, 4, 0.01, BlockPattern::alternating);
  for (Vector3<double> const& at : {Vector3<double>(0.03, 0.01, 0.01), Vector3<double>(0.06, 0.02, 0.01)})
    for (Eigen::Index i = 0; i < mesh.points.cols(); ++i)
      if ((mesh.points.col(i) - at).norm() < 1e-9) mesh.points(0, i) += 0.0085;
  return mesh;
}

/// Frequencies by Eigen's dense solver.
template <class Tissue>
std::vector<double> dense_frequencies(Tissue const& tissue) {
  std::vector<int> place;
  int free = 0;
  for (int i = 0; i < tissue.size(); ++i) place.push_back(tissue.nailed(i) ? -1 : free++);
  auto const at = [&](int i) { return 3 * place[static_cast<std::size_t>(i)]; };
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(3 * free, 3 * free), M = K;
  tissue.for_each_stiffness_block(Matrix3X<double>(tissue.rest_positions()), [&](int i, int j, Matrix<double, 3, 3> const& block) {
    if (at(i) >= 0 && at(j) >= 0) K.block<3, 3>(at(i), at(j)) += block;
  });
  for (int i = 0; i < tissue.size(); ++i)
    if (at(i) >= 0) M.block<3, 3>(at(i), at(i)) = tissue.mass(i) * Eigen::Matrix3d::Identity();
  Eigen::VectorXd const squared = Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd>(K, M, Eigen::EigenvaluesOnly).eigenvalues();
  std::vector<double> found;
  for (double const s : squared) found.push_back(std::sqrt(std::max(0.0, s)) / (2 * std::numbers::pi));
  return found;
}

}  // namespace

// Yardstick: the same in double. Blocks of floats resist translations by their rounding, which was 71 % of the slowest frequency.
TEST_CASE("the lowest frequencies of a long beam of floats are those of doubles", "[tissue][mass_scaling]") {
  auto const found = [](auto scalar) {
    using S = decltype(scalar);
    auto const mesh = make_block<S>(121, 3, 3, S(0.005), BlockPattern::alternating);
    FiniteElements<S, StableNeoHookean<S>> beam(mesh, {.density = 1060, .material = {.young = 5000, .poisson = S(0.45)}});
    beam.nail(vertices_where(mesh, [](auto const& p) { return p.x() < S(1e-6); }));
    return lowest_frequencies(beam, 4);
  };
  auto const rough = found(0.0f);
  auto const fine = found(0.0);
  for (std::size_t k = 0; k < 4; ++k) CHECK(std::abs(static_cast<double>(rough[k]) / fine[k] - 1) < (k < 2 ? 0.02 : 1e-3));
}

// Yardstick: Eigen's dense solver.
TEST_CASE("the lowest frequencies are those of a dense solver", "[tissue][mass_scaling][yardstick]") {
  double worst = 0;
  auto const mesh = make_block<double>(6, 3, 3, 0.01, BlockPattern::alternating);
  for (auto const pressure : {Pressure::element, Pressure::nodal}) {
    auto const tissue = clamped(mesh, pressure);
    auto const expected = dense_frequencies(tissue), found = lowest_frequencies(tissue, 7);
    REQUIRE(found.size() == 7);
    for (std::size_t k = 0; k < 7; ++k) worst = worse(worst, std::abs(found[k] / expected[k] - 1));
  }
  auto free = clamped(mesh);
  for (int i = 0; i < free.size(); ++i) free.unnail(i);
  auto const expected = dense_frequencies(free), found = lowest_frequencies(free, 9);
  for (std::size_t k = 0; k < 6; ++k) CHECK(found[k] < 1e-3 * expected[6]);
  for (std::size_t k = 6; k < 9; ++k) worst = worse(worst, std::abs(found[k] / expected[k] - 1));
  CHECK_THROWS_WITH(lowest_frequencies(free, 0), says("0 frequencies", "give 1"));
  CHECK_THROWS_WITH(lowest_frequencies(free, 3 * free.size() + 1), says("frequencies asked of"));
  for (int const count : {3 * free.size() / 2, 3 * free.size()}) {   // all but free motions, however many are asked for
    auto const many = lowest_frequencies(free, count);
    REQUIRE(static_cast<int>(many.size()) == count);
    for (std::size_t k = 0; k < 6; ++k) CHECK(many[k] < 1e-3 * expected[6]);
    for (std::size_t k = 6; k < many.size(); ++k) worst = worse(worst, std::abs(many[k] / expected[k] - 1));
  }
  check_yardstick({.what = "lowest frequencies, clamped and free, with and without nodal pressure: largest relative error", .source = "dense solver, Eigen", .expected = 0, .ours = worst, .within = 1e-6});
}

TEST_CASE("tissue that is pulled where it rests has no lowest frequencies, and masses that suffice are left alone", "[tissue][mass_scaling]") {
  auto const mesh = make_block<double>(4, 3, 3, 0.01, BlockPattern::alternating);
  using Solid = FiniteElements<double, StableNeoHookean<double>>;
  for (double const prestrain : {1e-4, 0.02})
    CHECK_THROWS_WITH(lowest_frequencies(Solid(mesh, {.density = 1000, .material = {.young = 5000, .poisson = 0.45}, .prestrain = prestrain}), 8), says("is pulled with", "pre-strained"));
  FiniteElements<float, StableNeoHookean<float>> const single(make_block<float>(4, 3, 3, 0.01f, BlockPattern::alternating), {.density = 1000, .material = {.young = 5000, .poisson = 0.45f}});
  CHECK(lowest_frequencies(single, 8)[7] > 0);
  Solid tissue(mesh, {.density = 1000, .material = {.young = 5000, .poisson = 0.45}});
  auto const scaling = scale_masses(tissue, 1e-5, 0);
  CHECK((scaling.particles == 0 && scaling.moved == 0));
  auto const none = scale_masses(tissue, 1.0, 0);   // nobody has any to spare
  CHECK((none.particles == 0 && none.moved == 0));
}

// Yardstick: a bar clamped at one end, without lateral strain, swings along itself at √(E/ρ)/(4 L); a row of cubes, guided so that it can do nothing else.
TEST_CASE("a bar's lowest frequency is that of the closed form", "[tissue][mass_scaling][yardstick]") {
  double const young = 5000, density = 1000, length = 0.2;
  auto const mesh = make_block<double>(41, 2, 2, 0.005, BlockPattern::alternating);
  FiniteElements<double, Corotational<double>> tissue(mesh, {.density = density, .material = {.young = young, .poisson = 0.0}});
  tissue.nail(vertices_where(mesh, [](auto const& p) { return p.x() < 1e-9; }));
  double const expected = std::sqrt(young / density) / (4 * length);
  double nearest = 0;
  for (double const f : lowest_frequencies(tissue, 12))   // bending and torsion are about it
    if (std::abs(f - expected) < std::abs(nearest - expected)) nearest = f;
  check_yardstick({.what = "clamped bar, ν = 0: the one of its lowest frequencies along itself [Hz]", .source = "√(E/ρ)/(4L)", .expected = expected, .ours = nearest, .within = 1e-3, .relative = true});
}

// Yardsticks: the sum of masses; leapfrog, which does not bear the step without; Eigen's dense solver for the frequencies.
TEST_CASE("mass scaling lets leapfrog take longer steps and hardly changes how a beam swings", "[tissue][mass_scaling]") {
  auto const pressure = GENERATE(Pressure::element, Pressure::nodal);
  CAPTURE(static_cast<int>(pressure));
  auto const mesh = beam_with_slivers();
  auto const plain = clamped(mesh, pressure);
  auto scaled = plain;
  auto const as_it_was = scale_masses(scaled, 1e-9);
  CHECK(as_it_was.particles == 0);
  CHECK(as_it_was.moved == 0);
  double const step = (pressure == Pressure::nodal ? 1.5 : 2) * as_it_was.step_before;   // a star stiffens what is two edges away
  auto const scaling = scale_masses(scaled, step);
  double before = 0, after = 0, lightest = 1e9;
  for (int i = 0; i < plain.size(); ++i) {
    before += plain.mass(i), after += scaled.mass(i);
    if (plain.nailed(i)) CHECK(plain.mass(i) == scaled.mass(i));
    if (!plain.nailed(i)) lightest = std::min(lightest, scaled.mass(i) / (scaled.stiffness_bound(i) * step * step / 4));
  }
  CHECK(std::abs(after / before - 1) < 1e-14);
  CHECK(lightest > 1 - 1e-12);
  CHECK(scaling.particles > 0);
  CHECK(scaling.moved > 0);
  CHECK(scaling.moved < 0.3 * scaling.total);
  CHECK(std::abs(scaling.step / step - 1) < 1e-12);
  auto const slow = dense_frequencies(plain), now = dense_frequencies(scaled);
  REQUIRE(scaling.frequencies.size() == 6);
  for (std::size_t k = 0; k < 6; ++k) {
    CHECK(std::abs(scaling.frequencies_before[k] / slow[k] - 1) < 1e-6);
    CHECK(std::abs(scaling.frequencies[k] / now[k] - 1) < 1e-6);
  }
  CHECK(std::abs(now[0] / slow[0] - 1) < 0.02);
  CHECK(now.back() <= 1 / (std::numbers::pi * step));   // 2/h
  CHECK(slow.back() > now.back());
  auto little = plain;
  scale_masses(little, 1.1 * as_it_was.step_before, 0);
  int changed = 0;
  for (int i = 0; i < plain.size(); ++i) changed += little.mass(i) != plain.mass(i);
  CHECK(changed > 0);
  if (pressure == Pressure::element) CHECK(changed < plain.size() / 2);   // what is far away stays
  CHECK_THAT(to_text(scaling), says("mass scaling: ", " particles; guaranteed step ", "lowest frequencies [Hz] "));

  auto const swing = [&](auto const& tissue, double h) {
    SoftBody body(tissue, LeapfrogVerlet{}, WholeBody{});
    body.apply_force(body.nearest_vertex({1, 0, 0}), {0, 0, 0.01});
    bool good = true;
    for (int k = 0; k < 3000 && good; ++k) good = static_cast<bool>(body.step(h));
    return good;
  };
  double const sharp = SoftBody(plain, LeapfrogVerlet{}, WholeBody{}).stable_step();
  CHECK(SoftBody(scaled, LeapfrogVerlet{}, WholeBody{}).stable_step() >= step);
  CHECK(swing(scaled, 0.95 * step));
  double const too_long = std::max(0.95 * step, 1.3 * sharp);
  CHECK_FALSE(swing(plain, too_long));
}

TEST_CASE("where too little mass is around, mass scaling says how far it came", "[tissue][mass_scaling]") {
  auto tissue = clamped(beam_with_slivers());
  auto const scaling = scale_masses(tissue, 1.2e-3, 0);
  CHECK(scaling.particles > 0);
  CHECK(scaling.step < 1.2e-3);
  CHECK(scaling.frequencies.empty());
  for (int i = 0; i < tissue.size(); ++i) REQUIRE(tissue.mass(i) > 0);
  CHECK_THROWS_WITH(scale_masses(tissue, 0.0), says("the step", "0"));
  CHECK_THROWS_WITH(scale_masses(tissue, std::nan("")), says("the step"));
}

TEST_CASE("springs and float can be scaled too", "[tissue][mass_scaling]") {
  MassSpring<double> skin(make_grid<double>(6, 6, 0.01), {.mass = {.total = 0.1}, .link = {.stiffness = 60}, .home = {.stiffness = 4}});
  skin.set_mass(14, 1e-5);
  auto const scaling = scale_masses(skin, 0.002);
  CHECK(scaling.step > 2 * scaling.step_before);
  auto solid = clamped<float>(make_block<float>(5, 3, 3, 0.01f, BlockPattern::alternating));
  solid.set_mass(20, 1e-6f);
  auto const in_float = scale_masses(solid, 3e-4f, 3);
  CHECK(in_float.step >= 0.9999f * 3e-4f);
  CHECK(in_float.frequencies[0] == Approx(in_float.frequencies_before[0]).epsilon(0.02));
}

// Yardstick: the step that was asked for. A support spring's stiffness is in proportion to mass, so it grows with what is lent: a step of 2 ms came out as 1.96.
TEMPLATE_TEST_CASE("supported tissue is lent mass until it stands the step", "[tissue][mass_scaling]", float, double) {
  using S = TestType;
  auto mesh = make_block<S>(9, 4, 4, S(0.01), BlockPattern::alternating);
  MassSpring<S> springs(mesh, {.mass = {.total = S(0.07)}, .link = {.stiffness = S(20)}});
  springs.nail(vertices_where(mesh, [](auto const& p) { return p.x() < S(1e-6); }));
  springs.set_mass(40, S(1e-5));
  auto const plain = springs;
  Supported tissue(std::move(springs), LinearSpring<S>{.stiffness = S(20)}, {S(0.0403), S(0.0152), S(0.0151)});
  double before = 0, after = 0;
  for (int i = 0; i < tissue.size(); ++i) before += static_cast<double>(tissue.mass(i));
  auto const scaling = scale_masses(tissue, S(2e-3), 0);
  for (int i = 0; i < tissue.size(); ++i) after += static_cast<double>(tissue.mass(i));
  CHECK(scaling.step_before < S(1.2e-3));
  CHECK(std::abs(scaling.step / S(2e-3) - 1) < 32 * std::numeric_limits<S>::epsilon());
  CHECK(std::abs(after / before - 1) < 32 * static_cast<double>(std::numeric_limits<S>::epsilon()));
  int changed = 0;
  for (int i = 0; i < tissue.size(); ++i) changed += tissue.mass(i) > plain.mass(i);
  CHECK(scaling.particles == changed);   // each is counted once
}
