// SPDX-License-Identifier: MIT
#include "allocation_trap.hpp"
#include "cantilever.hpp"
#include "catch.hpp"
#include "device/message.hpp"
#include "tissue/distorted.hpp"
#include "yardstick.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/material/corotational.hpp>
#include <palpate/material/linear_elastic.hpp>
#include <palpate/material/neo_hookean.hpp>
#include <palpate/material/st_venant_kirchhoff.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/tetrahedra_where.hpp>
#include <palpate/statics/newton_raphson.hpp>
#include <palpate/testing/element.hpp>
#include <palpate/testing/tissue.hpp>
#include <palpate/tissue/finite_elements.hpp>

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

using namespace palpate;
using palpate_test::check_yardstick, palpate_test::distorted, palpate_test::message_of, palpate_test::stiffness_at_rest, palpate_test::tip_over_timoshenko;
using palpate_test::unsaid, palpate_test::worse;

namespace {

bool is_inside(int i, int n) {
  int const x = i % n, y = i / n % n, z = i / (n * n);
  return std::min({x, y, z}) > 0 && std::max({x, y, z}) < n - 1;
}

/// The forces of the whole tissue on the columns that a body computes in: fourth rows of zeros.
template <class Tissue, class S = typename Tissue::Scalar>
Matrix3X<S> forces(Tissue const& tissue, Matrix3X<S> const& x) {
  typename Tissue::Assembly assembly;
  std::vector<int> all(static_cast<std::size_t>(tissue.size()));
  std::iota(all.begin(), all.end(), 0);
  tissue.assemble(all, assembly);
  Matrix<S, 4, Dynamic> padded = Matrix<S, 4, Dynamic>::Zero(4, x.cols()), f = padded;
  padded.topRows(3) = x;
  assembly.add_forces(padded, padded, f);
  return f.topRows(3);
}

/// Starts a body from positions and velocities.
template <class Body, class S = typename Body::Scalar>
void start(Body& body, Matrix3X<S> const& x, Matrix3X<S> const& v) {
  auto state = body.save();
  for (int i = 0; i < body.size(); ++i) state.particles.position[i] = x.col(i), state.particles.velocity[i] = v.col(i);
  body.restore(state);
}

/// A law of plain numbers that says nothing but what it must.
struct Plain {
  StVenantKirchhoffLaw<double> law;
  double energy(Tensor3<double> const& F) const { return law.energy(F); }
  Tensor3<double> stress(Tensor3<double> const& F) const { return law.stress(F); }
  Tensor3<double> stress_change(Tensor3<double> const& F, Tensor3<double> const& d) const { return law.stress_change(F, d); }
};

template <class S, class Visit>
void for_each_material(Visit visit) {
  S const young = 3000, poisson = S(0.4);
  visit(LinearElastic<S>{young, poisson});
  visit(Corotational<S>{young, poisson});
  visit(StVenantKirchhoff<S>{young, poisson});
  visit(NeoHookean<S>{young, poisson});
  visit(StableNeoHookean<S>{young, poisson});
}

template <class S, class M>
FiniteElements<S, M> solid(TetrahedralMesh<S> const& mesh, M const& material) {
  return {mesh, {.density = 1000, .material = material}};
}

}  // namespace

// Yardstick: what a battery for any element asks: central differences, and balance of forces and torques.
TEST_CASE("a tetrahedron of each material keeps the laws of elements", "[tissue][finite_elements]") {
  NodeColumns<double, 4> rest;
  rest << 0.0, 0.01, 0.002, 0.001, 0.0, 0.001, 0.012, 0.003, 0.0, -0.001, 0.002, 0.009;
  for_each_material<double>([&]<class M>(M const& material) {
    LinearTetrahedron<double, typename detail::LawOf<M>::type> const element(rest, material.law(), 1000);
    CHECK(testing::check_element<double>(element, rest, {.reach = 5e-4, .turns = !std::same_as<M, LinearElastic<double>>}) == testing::Violations{});
  });
  LinearTetrahedron<double, Plain> const plain(rest, Plain{StVenantKirchhoff<double>{3000, 0.4}.law()}, 1000);
  CHECK(testing::check_element<double>(plain, rest, {.reach = 5e-4}) == testing::Violations{});
}

// Yardstick: Eigen's singular values of the blocks of stiffness(x). Where the tetrahedron is strained otherwise than evenly, `norm_bound` of those.
TEMPLATE_TEST_CASE("the row bounds of a tetrahedron at rest are of the norms of its stiffness's blocks", "[tissue][finite_elements]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  double const digits = std::same_as<S, double> ? 1e-12 : 2e-4;
  std::srand(3);
  for (int trial = 0; trial < 20; ++trial) {
    NodeColumns<S, 4> rest = S(0.005) * NodeColumns<S, 4>::Random();
    if ((rest.col(1) - rest.col(0)).cross(rest.col(2) - rest.col(0)).dot(rest.col(3) - rest.col(0)) < 0) rest.col(1).swap(rest.col(2));
    for_each_material<S>([&]<class M>(M const& material) {
      LinearTetrahedron<S, typename detail::LawOf<M>::type> const element(rest, material.law(), S(1000));
      static_assert(HasBlockNormsAtRest<decltype(element), S> == IsIsotropicLaw<typename detail::LawOf<M>::type>);
      for (S const size : {S(1), S(0.9), S(1.2)}) {   // as under pre-strain
        NodeColumns<S, 4> x = size * rest;
        bool const is_even = trial % 4 != 0, is_exact = is_even && IsIsotropicLaw<typename detail::LawOf<M>::type>;
        if (!is_even) x.row(0) *= S(1.1);
        NodeMatrix<double, 4> const stiffness = element.stiffness(x).template cast<double>();
        auto const norms = detail::block_norms_at_rest(element, x);
        for (int i = 0; i < 4; ++i)
          for (int j = 0; j < 4; ++j) {
            Matrix<double, 3, 3> const block = stiffness.template block<3, 3>(3 * i, 3 * j);
            double const must = is_exact ? block.jacobiSvd().singularValues()[0] : detail::norm_bound<double>(block);
            CHECK(static_cast<double>(norms(i, j)) == Approx(must).epsilon(digits));
          }
      }
    });
  }
}

// Yardstick: dense central differences of the energy; the laws of tissues.
TEST_CASE("a solid's forces are the gradient of its energy, of the whole and of a subset", "[tissue][finite_elements]") {
  auto const mesh = distorted<double>(3, 0.01);
  auto const check = [&]<class M>(M const& material) {
    auto const tissue = solid<double>(mesh, material);
    CHECK(testing::check_tissue(tissue, {.displacement = 0.05, .isolated = !std::same_as<M, LinearElastic<double>>}) == testing::Violations{});
    std::srand(11);
    Matrix3X<double> x = mesh.points + 5e-4 * Matrix3X<double>::Random(3, mesh.points.cols());
    Matrix3X<double> gradient(3, x.cols());
    double const step = 1e-7;
    for (Eigen::Index k = 0; k < x.size(); ++k) {
      double const before = x(k);
      x(k) = before + step;
      double const ahead = tissue.potential_energy(x);
      x(k) = before - step;
      gradient(k) = (ahead - tissue.potential_energy(x)) / (2 * step);
      x(k) = before;
    }
    CHECK((forces(tissue, x) + gradient).norm() < 1e-6 * gradient.norm());
  };
  for_each_material<double>(check);
  check(Plain{StVenantKirchhoff<double>{3000, 0.4}.law()});   // one element after the other
}

// Yardstick: a homogeneous stress has no divergence; a rigid motion costs nothing.
TEMPLATE_TEST_CASE("patch: an affine displacement leaves no force inside, and what turns as a whole has none or turns along", "[tissue][finite_elements][yardstick]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  constexpr int n = 5;
  S const tolerance = std::same_as<S, float> ? S(1e-5) : S(1e-12);
  auto const mesh = distorted<S>(n, S(0.01));
  Matrix<S, 3, 3> F;
  F << S(1.1), S(0.05), S(-0.1), S(0.02), S(0.95), S(0.07), S(-0.04), S(0.1), S(1.2);
  Matrix<S, 3, 3> const R = Eigen::AngleAxis<S>(S(2), Vector3<S>(1, -2, S(0.5)).normalized()).toRotationMatrix();
  double residual = 0, rigid = 0, turned = 0;
  for_each_material<S>([&]<class M>(M const& material) {
    auto const tissue = solid<S>(mesh, material);
    Matrix3X<S> const x = F * mesh.points, f = forces(tissue, x);
    S const scale = S(3000) * S(0.01) * S(0.01);   // N, of a modulus on a facet
    for (int i = 0; i < tissue.size(); ++i)
      if (is_inside(i, n)) residual = worse(residual, f.col(i).norm() / scale);
    CHECK(f.norm() > S(0.1) * scale);
    if constexpr (!std::same_as<M, LinearElastic<S>>) {
      rigid = worse(rigid, forces(tissue, Matrix3X<S>(R * mesh.points)).colwise().norm().template maxCoeff<Eigen::PropagateNaN>() / scale);
      turned = worse(turned, (forces(tissue, Matrix3X<S>(R * x)) - R * f).norm() / f.norm());
    }
  });
  std::string const scalar = std::same_as<S, float> ? " (float)" : "";
  check_yardstick({.what = "patch, five laws: largest force inside a distorted mesh over E h²" + scalar, .source = "balance", .expected = 0, .ours = residual, .within = tolerance});
  check_yardstick({.what = "the mesh turned by 2 rad, four laws: largest force over E h²" + scalar, .source = "no strain", .expected = 0, .ours = rigid, .within = tolerance});
  check_yardstick({.what = "the strained mesh turned: f(R x) − R f(x), its norm over that of f" + scalar, .source = "objectivity", .expected = 0, .ours = turned, .within = tolerance});
}

// Yardstick: a body that nothing holds has six motions without stiffness.
TEST_CASE("a free solid has six null modes", "[tissue][finite_elements][yardstick]") {
  double worst = 0;
  auto const mesh = distorted<double>(3, 0.01);
  std::vector<int> place(static_cast<std::size_t>(mesh.points.cols()));
  std::iota(place.begin(), place.end(), 0);
  for_each_material<double>([&](auto const& material) {
    auto const tissue = solid<double>(mesh, material);
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> const modes(Eigen::MatrixXd(stiffness_at_rest(tissue, mesh.points, place, tissue.size())));
    worst = worse(worst, modes.eigenvalues().head(6).cwiseAbs().maxCoeff<Eigen::PropagateNaN>() / modes.eigenvalues().tail(1)[0]);
    CHECK(modes.eigenvalues()[6] > 1e-4 * modes.eigenvalues().tail(1)[0]);
  });
  check_yardstick({.what = "six null modes of the distorted mesh, five laws: eigenvalue over the largest", .source = "rigid motion", .expected = 0, .ours = worst, .within = 1e-14});
}

// Yardstick: deflections over Timoshenko's beam as computed independently for these meshes, within 0.01.
TEST_CASE("a cantilever bends as linear tetrahedra do", "[tissue][finite_elements][yardstick]") {
  for (auto const& beam : palpate_test::cantilevers)
    check_yardstick({.what = to_text(beam), .source = "computed independently", .expected = beam.plain, .ours = tip_over_timoshenko(beam.through, beam.poisson, beam.pattern), .within = 0.01});
}

// Yardstick: a bar clamped at one end, without lateral strain, swings along itself at sqrt(E / rho) / (4 L).
TEST_CASE("a clamped bar swings along itself at the frequency of the closed form", "[tissue][finite_elements][yardstick]") {
  double const young = 5000, density = 1000, spacing = 0.005;
  int const cubes = 40;
  auto const mesh = make_block<double>(cubes + 1, 2, 2, spacing, BlockPattern::alternating);
  FiniteElements<double, Corotational<double>> tissue(mesh, {.density = density, .material = {.young = young, .poisson = 0.0}});
  for (int i = 0; i < tissue.size(); ++i)
    if (mesh.points(0, i) < 1e-9) tissue.nail(i);
  SoftBody body(std::move(tissue), LeapfrogVerlet{});
  double const length = cubes * spacing, frequency = std::sqrt(young / density) / (4 * length);
  Matrix3X<double> x = mesh.points;
  x.row(0) += 1e-3 * length * (std::numbers::pi / (2 * length) * mesh.points.row(0).array()).sin().matrix();
  start(body, x, Matrix3X<double>(Matrix3X<double>::Zero(3, x.cols())));
  int const end = body.nearest_vertex({length, 0, 0});
  double const h = 0.5 * body.stable_step(), from = length;
  double last = x(0, end) - from, first_zero = 0, time = 0;
  int zeros = 0;
  while (zeros < 5 && time < 10 / frequency) {
    body.step(h);
    time += h;
    double const now = body.positions()(0, end) - from;
    if ((now < 0) != (last < 0)) {
      double const at = time - h * now / (now - last);
      if (zeros++ == 0) first_zero = at;
      else if (zeros == 5) check_yardstick({.what = "clamped bar, ν = 0: frequency along itself [Hz]", .source = "√(E/ρ)/(4L)", .expected = frequency, .ours = 2 / (at - first_zero), .within = 2e-3, .relative = true});
    }
    last = now;
  }
  CHECK(zeros == 5);
}

// Yardstick: energy and momentum of a body that nothing acts on.
TEST_CASE("an undamped solid keeps its energy and momentum", "[tissue][finite_elements]") {
  auto const mesh = distorted<double>(4, 0.01);
  SoftBody body(solid<double>(mesh, StableNeoHookean<double>{5000, 0.45}), LeapfrogVerlet{});
  Matrix3X<double> const squeezed = Eigen::Vector3d(1.1, 0.95, 1.0).asDiagonal() * mesh.points;
  Matrix3X<double> spin(3, mesh.points.cols());
  for (Eigen::Index i = 0; i < spin.cols(); ++i) spin.col(i) = Vector3<double>(0.1, 0, 0) + Vector3<double>(0, 0, 5).cross(Vector3<double>(squeezed.col(i)));
  start(body, squeezed, spin);
  double const h = 0.2 * body.stable_step(), energy = body.kinetic_energy() + body.potential_energy();
  auto const momentum = [&] {
    Vector3<double> sum = Vector3<double>::Zero();
    for (int i = 0; i < body.size(); ++i) sum += body.tissue().mass(i) * body.velocities().col(i);
    return sum;
  };
  Vector3<double> const before = momentum();
  double worst = 0;
  body.step(h);
  palpate_test::AllocationCount const allocations;
  for (int k = 0; k < 3000; ++k) {
    body.step(h);
    worst = std::max(worst, std::abs(body.kinetic_energy() + body.potential_energy() - energy));
  }
  CHECK(allocations.count() == 0);
  CHECK(worst < 0.02 * energy);
  CHECK((momentum() - before).norm() < 1e-11 * before.norm());
}

// Yardstick: the equilibrium of an independent solver, Newton's method.
TEST_CASE("implicit steps come to rest where Newton's method does, and allocate nothing after the first", "[tissue][finite_elements]") {
  auto const mesh = make_block<double>(11, 3, 3, 0.005, BlockPattern::alternating);
  auto const sag = [&](auto const& material) {
    auto tissue = solid<double>(mesh, material);
    for (int i = 0; i < tissue.size(); ++i)
      if (mesh.points(0, i) < 1e-9) tissue.nail(i);
    SoftBody body(std::move(tissue), BackwardEuler{});
    body.set_gravity({0, 0, -9.81});
    body.step(0.02);
    palpate_test::AllocationCount const allocations;
    for (int k = 0; k < 200; ++k) body.step(0.02);
    CHECK(allocations.count() == 0);
    double const reached = (body.positions() - mesh.points).row(2).minCoeff();
    body.settle(NewtonRaphson{});
    double const expected = (body.positions() - mesh.points).row(2).minCoeff();
    CHECK(expected < -1e-3);
    CHECK(reached == Approx(expected).epsilon(1e-3));
  };
  sag(StableNeoHookean<double>{2e5, 0.4});
  sag(LinearElastic<double>{2e5, 0.4});
}

TEST_CASE("a nodule of another material is stiffer and heavier", "[tissue][finite_elements]") {
  auto const mesh = make_block<double>(3, 3, 3, 0.01, BlockPattern::alternating);
  auto tissue = solid<double>(mesh, StableNeoHookean<double>{3000, 0.45});
  auto const total = [&] {
    double sum = 0;
    for (int i = 0; i < tissue.size(); ++i) sum += tissue.mass(i);
    return sum;
  };
  CHECK(total() == Approx(1000 * 0.02 * 0.02 * 0.02));
  double const bound = tissue.stiffness_bound(13);
  std::size_t const revision = tissue.revision();
  std::vector<int> const first_cube{0, 1, 2, 3, 4};
  tissue.set_material(first_cube, {30000, 0.45}, 3000);
  CHECK(total() == Approx(1000 * 7e-6 + 3000 * 1e-6));
  CHECK(tissue.stiffness_bound(13) > 1.5 * bound);
  CHECK(tissue.revision() != revision);
  CHECK_THROWS_AS(tissue.set_material(std::vector<int>{40}, {3000, 0.4}, 1000), OutOfRange);
  CHECK_THROWS_AS(tissue.set_material(std::vector<int>{40}, {3000, 0.4}), OutOfRange);
  tissue.set_material(tetrahedra_where(mesh, [](auto const& centre) { return centre.x() > 0.01; }), {60000, 0.4});
  CHECK(total() == Approx(1000 * 7e-6 + 3000 * 1e-6));
  FiniteElements<double, StableNeoHookean<double>> stretched(mesh, {.density = 1000, .material = {3000, 0.4}, .prestrain = 0.1});
  double const before = stretched.mass(13);
  stretched.set_material(first_cube, {6000, 0.4});
  CHECK(stretched.mass(13) == Approx(before));
  CHECK_THROWS_WITH(tissue.set_material(first_cube, {3000, 0.4}, -1), says("density", "-1"));
}

// Yardstick: superposition: a small load bends a beam in proportion to it.
TEST_CASE("a load too small to move a particle beside its neighbours still bends a beam", "[tissue][finite_elements]") {
  auto const mesh = make_block<double>(21, 3, 3, 0.005, BlockPattern::alternating);
  auto const sag = [&](double gravity) {
    auto tissue = solid<double>(mesh, StableNeoHookean<double>{1e5, 0.49});
    for (int i = 0; i < tissue.size(); ++i)
      if (mesh.points(0, i) < 1e-9) tissue.nail(i);
    SoftBody body(std::move(tissue), BackwardEuler{});
    body.set_gravity({0, 0, -gravity});
    body.settle(NewtonRaphson{});
    return -(body.positions() - mesh.points).row(2).minCoeff();
  };
  double const of_more = sag(0.5);
  CHECK(of_more > 4e-3);
  for (double const part : {0.1, 1e-3, 1e-5}) CHECK(std::abs(sag(0.5 * part) / (part * of_more) - 1) < 0.02);
}

TEST_CASE("each refusal of a solid says what is wrong, where, and what to give, and leaves a tissue as it was", "[tissue][finite_elements][error]") {
  using Material = StableNeoHookean<double>;
  auto const mesh = make_block<double>(3, 2, 2, 0.01);
  auto const said = [&](auto const& edit) {
    auto bad = mesh;
    edit(bad);
    return message_of([&] { solid<double>(bad, Material{3000, 0.45}); });
  };
  auto const [a, b] = std::pair{mesh.tetrahedra(0, 3), mesh.tetrahedra(1, 3)};
  CHECK(unsaid(said([](auto& bad) { std::swap(bad.tetrahedra(0, 3), bad.tetrahedra(1, 3)); }), "tetrahedron 3") == "");
  CHECK(unsaid(said([](auto& bad) { bad.tetrahedra(0, 3) = bad.tetrahedra(1, 3); }), "tetrahedron 3", std::to_string(b)) == "");
  CHECK(unsaid(said([&](auto& bad) { bad.points.col(a) = bad.points.col(b); }), "tetrahedron") == "");   // flat
  CHECK(unsaid(said([&](auto& bad) { bad.points(1, a) = std::numeric_limits<double>::quiet_NaN(); }), std::to_string(a)) == "");
  CHECK(unsaid(said([](auto& bad) { bad.tetrahedra(2, 3) = 99; }), "tetrahedron 3", "99") == "");

  auto tissue = solid<double>(mesh, Material{3000, 0.45});
  Matrix3X<double> const x = 1.1 * mesh.points;
  double const energy = tissue.potential_energy(x), mass = tissue.mass(0);
  auto const refused = [&](Material const& material, auto const&... words) {
    for (auto const& text : {message_of([&] { solid<double>(mesh, material); }), message_of([&] { tissue.set_material(std::vector<int>{0, 1}, material, 1200.0); })}) {
      CHECK(unsaid(text, words...) == "");
      CHECK(std::count(text.begin(), text.end(), '\n') == 0);
    }
    CHECK(tissue.potential_energy(x) == energy);
    CHECK(tissue.mass(0) == mass);
  };
  double const nan = std::numeric_limits<double>::quiet_NaN();
  refused({3000, 0.5}, "Poisson's ratio is 0.5", "below 0.5");
  refused({3000, -1.0}, "Poisson's ratio is -1", "above -1");
  refused({3000, nan}, "Poisson's ratio is nan");
  refused({3, 0.45}, "Young's modulus is 3 Pa", "kPa times 1,000");
  refused({2e10, 0.45}, "Young's modulus is", "10 GPa");
  refused({-3000, 0.45}, "Young's modulus is -3000 Pa");
  refused({nan, 0.45}, "Young's modulus is nan Pa");
  auto const nothing_set = [&](std::vector<int> const& some, double density, auto const&... words) {
    CHECK(unsaid(message_of([&] { tissue.set_material(some, {8000, 0.3}, density); }), words...) == "");
    CHECK(tissue.potential_energy(x) == energy);
    CHECK(tissue.mass(0) == mass);
  };
  nothing_set({0, 99}, 1200.0, "tetrahedron index 99 is outside");
  nothing_set({0, -1}, 1200.0, "tetrahedron index -1 is outside");
  nothing_set({0}, 0.0, "the density", "0 kg/m3");
  nothing_set({0}, nan, "the density", "nan kg/m3");
}

TEST_CASE("a solid of what cannot be is refused in a line", "[tissue][finite_elements][error]") {
  auto const make = [](auto const& edit) {
    auto mesh = make_block<double>(2, 2, 2, 0.01);
    edit(mesh);
    return solid<double>(mesh, StableNeoHookean<double>{3000, 0.45});
  };
  CHECK_NOTHROW(make([](auto&) {}));
  CHECK_THROWS_AS(make([](auto& mesh) { mesh.points.col(7) = mesh.points.col(6); }), InvalidMesh);
  CHECK_THROWS_AS(make([](auto& mesh) { std::swap(mesh.tetrahedra(0, 2), mesh.tetrahedra(1, 2)); }), InvalidMesh);
  CHECK_THROWS_AS(make([](auto& mesh) { mesh.tetrahedra(0, 2) = mesh.tetrahedra(1, 2); }), InvalidMesh);
  CHECK_THROWS_AS(make([](auto& mesh) { mesh.points(0, 3) = std::numeric_limits<double>::quiet_NaN(); }), InvalidMesh);
  CHECK_THROWS_WITH(FiniteElements(make_block<double>(2, 2, 2, 0.01), SolidOptions<double, StableNeoHookean<double>>{.density = 0, .material = {3000, 0.45}}), says("density", "0 kg/m3"));
  for (double const density : {1.06, 1e6, std::numeric_limits<double>::quiet_NaN()})
    CHECK_THROWS_WITH(FiniteElements(make_block<double>(2, 2, 2, 0.01), SolidOptions<double, StableNeoHookean<double>>{.density = density, .material = {3000, 0.45}}),
                      says("the density is", "g/cm3 times 1,000"));
}

// Yardstick: the row sums of the elements' own matrices; at rest the norms are the least there are (see above), elsewhere bounds of them.
TEST_CASE("row bounds of tetrahedra that are strained at rest are those of their matrices", "[finite_elements]") {
  auto const mesh = make_block<double>(3, 3, 3, 0.01, BlockPattern::alternating);
  for (double const stretch : {0.5, 1.0, 1.25}) {
    auto const make = [&](NodeColumns<double, 4> own) {
      own.row(0) *= stretch;
      return LinearTetrahedron<double, StVenantKirchhoffLaw<double>>(own, StVenantKirchhoff<double>{.young = 5000, .poisson = 0.3}.law(), 1000.0);
    };
    ElementTissue const tissue(mesh, {.total = 0.1}, make_elements(mesh.points, mesh.tetrahedra, make));
    for (int i = 0; i < tissue.size(); ++i) {
      double const bound = tissue.stiffness_bound(i), must = tissue.stiffness_bound(i, tissue.rest_positions());
      if (stretch == 1.0)
        CHECK((bound > 0.8 * must && bound < must));
      else
        CHECK(bound == Approx(must).epsilon(1e-9));
    }
  }
}
