// SPDX-License-Identifier: MIT
// Yardsticks: linear finite elements, element by element, uncut and cut; a tissue made anew of the cut tetrahedra; a bar's closed form; what a battery asks
// of any tissue (central differences, symmetry, balance); what no cut may change (testing/solid_cut_invariants.hpp).
#include "allocation_trap.hpp"
#include "catch.hpp"
#include "cutting/solid_strokes.hpp"
#include "device/message.hpp"
#include "tissue/distorted.hpp"
#include "tissue/yardstick.hpp"

#include <palpate/body/pieces.hpp>
#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/aspirator.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/models.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/statics/newton_raphson.hpp>
#include <palpate/testing/solid_cut_invariants.hpp>
#include <palpate/testing/tissue.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

using namespace palpate;
using namespace palpate_test;

namespace {

template <class S>
using Elements = FiniteElements<S, LinearElastic<S>>;

template <class S>
TensorMassOptions<S> soft() {
  return {.density = 1000, .material = {.young = S(1e4), .poisson = S(0.4)}, .damping = {.alpha = S(2), .beta = S(1e-3)}, .prestrain = S(0.02)};
}
template <class S>
Elements<S> same_elements(TetrahedralMesh<S> const& mesh, TensorMassOptions<S> const& options) {
  return {mesh, {.density = options.density, .material = options.material, .damping = options.damping, .prestrain = options.prestrain}};
}

/// How far forces, energy and products with the stiffness of two tissues of the same particles are apart at random places: shares of those of the second.
template <class A, class B, class S = typename A::Scalar>
S farthest(A const& a, B const& b) {
  std::srand(7);
  Matrix3X<S> const x = a.rest_positions() + S(1e-3) * Matrix3X<S>::Random(3, a.size()), v = S(0.1) * Matrix3X<S>::Random(3, a.size());
  Matrix3X<S> fa(3, a.size()), fb = fa, ka = Matrix3X<S>::Zero(3, a.size()), kb = ka, ca = ka, cb = ka;
  for (int i = 0; i < a.size(); ++i) fa.col(i) = a.internal_force(i, x, v), fb.col(i) = b.internal_force(i, x, v);
  a.add_stiffness_product(x, v, ka), b.add_stiffness_product(x, v, kb);
  a.add_damping_product(x, v, ca), b.add_damping_product(x, v, cb);
  S const energy = b.potential_energy(x);
  return std::max({(fa - fb).norm() / fb.norm(), (ka - kb).norm() / kb.norm(), (ca - cb).norm() / cb.norm(), std::abs(a.potential_energy(x) - energy) / energy});
}

/// Two bodies through the same steps; how far they come apart, as a share of how far they move.
template <class A, class B>
double apart_after(A& a, B& b, int steps, double h) {
  for (int step = 0; step < steps; ++step) a.step(h), b.step(h);
  double most = 0, moved = 0;
  for (int i = 0; i < a.size(); ++i) {
    most = std::max<double>(most, (a.displacement(i) - b.displacement(i)).norm());
    moved = std::max<double>(moved, b.displacement(i).norm());
  }
  CHECK(moved > 1e-4);
  CHECK(moved < 0.01);
  return most / moved;
}

auto held_below(auto tissue) {
  for (int i = 0; i < tissue.size(); ++i)
    if (tissue.rest_position(i)[2] < 1e-6) tissue.nail(i);
  return tissue;
}

}  // namespace

TEMPLATE_TEST_CASE("tensors at vertices and edges are linear finite elements, added up", "[tissue][tensor_mass][yardstick]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const mesh = distorted<S>(4, S(0.005));
  TensorMass<S> tissue(mesh, soft<S>());
  auto elements = same_elements<S>(mesh, soft<S>());
  S const limit = std::is_same_v<S, double> ? S(1e-12) : S(1e-5);
  auto const compare = [&](std::string const& name) {
    check_yardstick({.what = "tensor mass of " + name + (std::is_same_v<S, float> ? " (float)" : "") + ": largest difference of force, energy, products over each", .source = "assembled elements", .expected = 0,
                     .ours = farthest(tissue, elements), .within = limit});
  };
  compare("one material");
  std::array const some{3, 4, 5, 17};
  tissue.set_material(some, {.young = S(1e5), .poisson = S(0.2)}, S(1300)), elements.set_material(some, {.young = S(1e5), .poisson = S(0.2)}, S(1300));
  compare("two materials");
  for (int i = 0; i < tissue.size(); ++i) {
    CHECK(tissue.mass(i) == elements.mass(i));
    S sum = 0;   // of its row: what the bound is to be above
    for (std::size_t k = 0; k < tissue.rows().columns(i).size(); ++k) sum += palpate::detail::norm_bound<S>(tissue.rows().tensor(i, k));
    CHECK(sum <= tissue.stiffness_bound(i) * (1 + 10 * limit));
    CHECK(sum > tissue.stiffness_bound(i) / 10);
  }
}

TEST_CASE("a tensor-mass tissue keeps the laws of tissues", "[tissue][tensor_mass]") {
  TensorMass<double> const tissue(distorted<double>(3, 0.01), {.density = 1000, .material = {.young = 3000, .poisson = 0.4}, .damping = {.beta = 1e-3}});
  CHECK(testing::to_text(testing::check_tissue(tissue, {.displacement = 0.05})) == "");
}

// Yardstick: Hooke's law, F = E ε A.
TEST_CASE("a bar of tensors that is drawn out pulls as Hooke says, and is strained evenly", "[tissue][tensor_mass]") {
  double const edge = 0.01, side = 3 * edge, length = 10 * edge, young = 1e4, strain = 0.02;
  TensorMass<double> tissue(make_block<double>(11, 4, 4, edge, BlockPattern::alternating), {.density = 1000, .material = {.young = young, .poisson = 0}});
  SoftBody body(std::move(tissue), BackwardEuler{});
  for (int i = 0; i < body.size(); ++i) {
    Vector3<double> const rest = body.tissue().rest_position(i);
    if (rest[0] > 1e-9 && rest[0] < length - 1e-9) continue;
    body.drag(i, {(1 + strain) * rest[0], rest[1], rest[2]});
  }
  body.settle(NewtonRaphson{});
  double pull = 0;
  for (int i = 0; i < body.size(); ++i) {
    Vector3<double> const rest = body.tissue().rest_position(i);
    CHECK((body.displacement(i) - Vector3<double>(strain * rest[0], 0, 0)).norm() < 1e-6 * side);
    if (rest[0] < 1e-9) pull += body.reaction(i)[0];
  }
  CHECK(std::abs(pull) == Approx(young * strain * side * side).epsilon(1e-5));
}

TEST_CASE("a body of tensors moves as one of linear finite elements: explicit in a zone, implicit as a whole, and cut", "[tissue][tensor_mass]") {
  auto const mesh = make_block<double>(6, 4, 5, 0.005, BlockPattern::alternating);
  auto const check = [&](auto integrator, auto region, double h, bool cuts) {
    SoftBody tensors(held_below(TensorMass<double>(mesh, soft<double>())), integrator, region);
    SoftBody elements(held_below(same_elements<double>(mesh, soft<double>())), integrator, region);
    int const top = tensors.nearest_vertex({0.0125, 0.0075, 0.02});
    tensors.apply_force(top, {0.01, 0, -0.05}), elements.apply_force(top, {0.01, 0, -0.05});
    CHECK(apart_after(tensors, elements, 100, h) < 1e-7);
    if (!cuts) return;
    VolumeCutter<double> one, two;
    Place const from(0.0113, -0.003, 0.011), to(0.0121, -0.003, 0.03), way(0, 0.013, 0);
    for (int tick = 0; tick <= 20; ++tick) {
      Place const off = way * (tick / 20.0);
      one.advance(tensors, {from + off, to + off}), two.advance(elements, {from + off, to + off});
      tensors.step(h), elements.step(h);
    }
    REQUIRE(tensors.size() == elements.size());
    CHECK(one.report().area > 1e-5);
    CHECK(apart_after(tensors, elements, 50, h) < 1e-5);
  };
  check(LeapfrogVerlet{}, ZoneOfInfluence{.rings = 2}, 5e-5, false);
  check(BackwardEuler{}, WholeBody{}, 1e-3, true);
}

TEST_CASE("whatever is cut, the tensors are those of the tetrahedra that are there", "[tissue][tensor_mass]") {
  int taken = 0;
  for (std::uint64_t seed = 0; seed < 25; ++seed) {
    INFO("seed " << seed);
    SoftBody body(TensorMass<double>(make_block<double>(4, 4, 4, 0.005, BlockPattern::alternating), soft<double>()), BackwardEuler{});
    testing::SolidCutInvariants before(body);
    VolumeCutter<double> knife;
    for (std::uint64_t k = 0; k < 3; ++k) Drawn(100 * seed + k).cut(knife, body, 30), knife.lift(body);
    CHECK(testing::to_text(before.check(body)) == "");
    auto const& tissue = body.tissue();
    CHECK(farthest(tissue, static_cast<Elements<double> const&>(tissue)) < 1e-12);   // element by element
    int const cut = tissue.tetrahedra();
    Aspirator<double> aspirator({.tip_radius = 0.004});
    for (int tick = 0; tick < 6; ++tick) aspirator.advance(body, Vector3<double>(0.007, 0.0075, 0.025 - 0.002 * tick));
    taken += cut - tissue.tetrahedra();
    CHECK(farthest(tissue, static_cast<Elements<double> const&>(tissue)) < 1e-12);
  }
  CHECK(taken > 100);
}

TEST_CASE("tensors of which tissue was taken are those of a body made without it", "[tissue][tensor_mass][yardstick]") {
  SoftBody body(TensorMass<double>(make_block<double>(6, 6, 6, 0.005, BlockPattern::alternating), soft<double>()), BackwardEuler{});
  Aspirator<double> aspirator({.tip_radius = 0.004, .reach = 0.006, .max_tetrahedra = 10});
  int const whole = body.tissue().tetrahedra();
  for (int tick = 0; tick < 30 && body.tissue().tetrahedra() >= whole - 10; ++tick) aspirator.advance(body, Vector3<double>(0.0125, 0.0125, 0.035 - 0.0005 * tick));
  REQUIRE(body.tissue().tetrahedra() < whole - 10);
  std::vector<int> kept, number(static_cast<std::size_t>(body.size()), -1);   // a particle whose tetrahedra are all gone stays, alone
  for (int i = 0; i < body.size(); ++i)
    if (!body.tissue().elements_at(i).empty()) number[static_cast<std::size_t>(i)] = static_cast<int>(kept.size()), kept.push_back(i);
  auto mesh = body.rest_solid();
  mesh.points = Matrix3X<double>(mesh.points(Eigen::all, kept));
  for (int& i : mesh.tetrahedra.reshaped()) i = number[static_cast<std::size_t>(i)];
  check_yardstick({.what = "tensor mass of which elements were taken away: largest difference of force, energy, products over each", .source = "built anew without them", .expected = 0,
                   .ours = farthest(body.tissue().part(kept), TensorMass<double>(mesh, soft<double>())), .within = 1e-12});
}

TEST_CASE("tensors: saved and restored to the byte, parts that go on alone, and steps and cuts without memory", "[tissue][tensor_mass]") {
  auto const mesh = make_block<double>(5, 5, 5, 0.005, BlockPattern::alternating);
  SoftBody body(held_below(TensorMass<double>(mesh, soft<double>())), BackwardEuler{});
  VolumeCutter<double> knife;
  stroke(knife, body, Place(0.0071, -0.003, 0.0063), Place(0.0083, -0.003, 0.03), Place(0, 0.012, 0), 20);
  for (int step = 0; step < 10; ++step) body.step(1e-3);
  auto const saved = body.save();
  auto const go_on = [&] {
    VolumeCutter<double> again;
    stroke(again, body, Place(-0.003, 0.0061, 0.0063), Place(-0.003, 0.0073, 0.03), Place(0.012, 0, 0), 20);
    for (int step = 0; step < 10; ++step) body.step(1e-3);
    return Matrix3X<double>(body.positions());
  };
  auto const first = go_on();
  body.restore(saved);
  auto const second = go_on();
  REQUIRE(first.cols() == second.cols());
  CHECK((first.array() == second.array()).all());

  REQUIRE(trap_works());
  AllocationCount const allocations;
  for (int step = 0; step < 20; ++step) body.step(1e-3);
  long const count = allocations.count();
  CHECK(count == 0);
}

TEST_CASE("an assembly of tensors that follows edits and masses is one that is made anew", "[tissue][tensor_mass]") {
  TensorMass<double> tissue(distorted<double>(4, 0.01), {.density = 1000, .material = {.young = 3000, .poisson = 0.4}});
  auto const all = [&] {
    std::vector<int> every(static_cast<std::size_t>(tissue.size()));
    std::iota(every.begin(), every.end(), 0);
    return every;
  };
  TensorMass<double>::Assembly followed, anew;
  tissue.assemble(all(), followed);
  for (int t = 0; t < 40; t += 5) {
    auto const c = tissue.topology().corners(t);
    tissue.divide_edge(c[0], c[1], 0.4);
    tissue.finish_edits();
    tissue.follow_edits(all(), followed);
  }
  tissue.set_mass(5, 1.0);
  tissue.follow_edits(all(), followed);
  tissue.assemble(all(), anew);
  CHECK(followed.energy_rounding() == Approx(anew.energy_rounding()).epsilon(1e-12));
  Matrix<double, 4, Dynamic> one = Matrix<double, 4, Dynamic>::Zero(4, tissue.size()), other = one;
  followed.tangent_diagonal(1, 0, 1e-4, one.data()), anew.tangent_diagonal(1, 0, 1e-4, other.data());
  CHECK(one(0, 5) > 1.0);
  CHECK((one - other).cwiseAbs().maxCoeff() < 1e-12);
}

TEST_CASE("a tensor-mass tissue says what is wrong with what it is given", "[tissue][tensor_mass]") {
  auto const mesh = make_block<double>(2, 2, 2, 0.01);
  CHECK(message_of([&] { TensorMass<double>(mesh, {.density = -1, .material = {.young = 1e4, .poisson = 0.3}}); }).find("the density is -1 kg/m3") != std::string::npos);
  CHECK(message_of([&] { TensorMass<double>(mesh, {.density = 1000, .material = {.young = 1e4, .poisson = 0.5}}); }).find("Poisson's ratio is 0.5") != std::string::npos);
}
