// SPDX-License-Identifier: MIT
// What a leapfrog step of a solid costs beside a plain Eigen loop over the same tetrahedra in the same run, and a product with its tangent beside one with
// a loop over the elements' 12 x 12 matrices' blocks, by material, scalar and size (cubes of 5 alternating tetrahedra: 8^3, 16^3, 28^3 of
// them).
// And: what nodal pressure adds to a step (asked: at most 2); what it costs that nodes are numbered at random; a millisecond of a block of 5 kPa and edges of 7 mm in stable leapfrog steps, from 10^3 to 10^6
// tetrahedra; an implicit step of 10 ms with 25 iterations, its residual, and one to a residual of 1e-3, without and with an assembled
// stiffness.
//   bench_solid                              as it was compiled
//   BENCH=solid sh benchmarks/step.sh        compiled with plain -O2, -O3, with AVX2 and for this processor, one after the other
// prints, for each, the median of plain time / library time over rounds that run both in turn (above 1 the library is faster) and the best time of both
// per tetrahedron [ns]. Time is the thread's own.
#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/material/corotational.hpp>
#include <palpate/material/st_venant_kirchhoff.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/tissue/finite_elements.hpp>

#include "thread_time.hpp"

#include <benchmark/benchmark.h>

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

namespace {

using namespace palpate;

/// The stress of each material as one writes it with Eigen; the rotation of the last by the library's formula, one number at a time.
template <class S>
using Square = Matrix<S, 3, 3>;
template <class S>
Square<S> plain_stress(StVenantKirchhoffLaw<S> const& law, Square<S> const& F) {
  Square<S> const E = S(0.5) * (F.transpose() * F - Square<S>::Identity());
  return F * (law.lambda * E.trace() * Square<S>::Identity() + 2 * law.mu * E);
}
template <class S>
Square<S> plain_stress(StableNeoHookeanLaw<S> const& law, Square<S> const& F) {
  Square<S> cofactor;
  cofactor.col(0) = F.col(1).cross(F.col(2)), cofactor.col(1) = F.col(2).cross(F.col(0)), cofactor.col(2) = F.col(0).cross(F.col(1));
  S const J = F.col(0).dot(cofactor.col(0)), I = F.squaredNorm();
  return law.m * (1 - 1 / (I + 1)) * F + law.l * (J - law.alpha) * cofactor;
}
template <class S>
Square<S> plain_stress(CorotationalLaw<S> const& law, Square<S> const& F) {
  RotationOf<S> const found({F(0, 0), F(0, 1), F(0, 2), F(1, 0), F(1, 1), F(1, 2), F(2, 0), F(2, 1), F(2, 2)});
  Tensor3<S> const& r = found.R;
  Square<S> R;
  R << r.xx, r.xy, r.xz, r.yx, r.yy, r.yz, r.zx, r.zy, r.zz;
  return 2 * law.mu * (F - R) + law.lambda * (found.trace - 3) * R;
}

/// Leapfrog over columns of Eigen.
template <class S, class Law>
class PlainSolid {
 public:
  PlainSolid(TetrahedralMesh<S> const& mesh, Law const& law, S density) : x_(mesh.points), v_(Matrix3X<S>::Zero(3, x_.cols())), f_(v_), inverse_mass_(static_cast<std::size_t>(x_.cols())) {
    for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t) {
      auto const n = mesh.tetrahedra.col(t);
      Square<S> edges;
      for (int k = 0; k < 3; ++k) edges.col(k) = x_.col(n[k + 1]) - x_.col(n[0]);
      elements_.push_back({{n[0], n[1], n[2], n[3]}, edges.inverse(), edges.determinant() / 6, law});
      for (int k = 0; k < 4; ++k) inverse_mass_[static_cast<std::size_t>(n[k])] += density * elements_.back().volume / 4;
    }
    for (S& m : inverse_mass_) m = 1 / m;
  }
  void advance(S h) {
    f_.setZero();
    for (auto const& [n, inverse, volume, law] : elements_) {
      Square<S> D;
      for (int k = 0; k < 3; ++k) D.col(k) = x_.col(n[k + 1]) - x_.col(n[0]);
      Square<S> const H = -volume * plain_stress(law, Square<S>(D * inverse)) * inverse.transpose();
      for (int k = 0; k < 3; ++k) f_.col(n[k + 1]) += H.col(k);
      f_.col(n[0]) -= H.rowwise().sum();
    }
    for (Eigen::Index i = 0; i < x_.cols(); ++i) v_.col(i) += h * inverse_mass_[static_cast<std::size_t>(i)] * f_.col(i), x_.col(i) += h * v_.col(i);
  }
  Matrix3X<S> const& positions() const { return x_; }
  Matrix3X<S>& velocities() { return v_; }

 private:
  struct Element {
    int nodes[4];
    Square<S> inverse;   // of the edges at rest
    S volume;
    Law law;
  };
  Matrix3X<S> x_, v_, f_;
  std::vector<S> inverse_mass_;
  std::vector<Element> elements_;
};

template <class Plain, class Library>
void in_turn(benchmark::State& state, double tetrahedra, int rounds, Plain const& plain, Library const& library) {
  std::vector<double> ratios;
  double best_plain = 1e9, best_library = 1e9;
  for (auto _ : state) {
    double const start = benchmarks::thread_time();
    for (int k = 0; k < rounds; ++k) plain();
    double const middle = benchmarks::thread_time();
    for (int k = 0; k < rounds; ++k) library();
    double const end = benchmarks::thread_time();
    ratios.push_back((middle - start) / (end - middle));
    best_plain = std::min(best_plain, (middle - start) / rounds / tetrahedra * 1e9), best_library = std::min(best_library, (end - middle) / rounds / tetrahedra * 1e9);
  }
  std::nth_element(ratios.begin(), ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2), ratios.end());
  state.counters["plain/library"] = ratios[ratios.size() / 2];
  state.counters["plain_ns"] = best_plain;
  state.counters["library_ns"] = best_library;
}

template <class S, class M>
FiniteElements<S, M> solid(TetrahedralMesh<S> const& mesh, Stiffness stiffness = Stiffness::matrix_free, Pressure pressure = Pressure::element) {
  return {mesh, {.density = S(1000), .material = {.young = S(5000), .poisson = S(0.45)}, .pressure = pressure, .stiffness = stiffness}};
}

template <class S, class M>
void step(benchmark::State& state) {
  int const n = static_cast<int>(state.range(0));
  auto const mesh = make_block<S>(n + 1, n + 1, n + 1, S(0.005), BlockPattern::alternating);
  SoftBody body(solid<S, M>(mesh), LeapfrogVerlet{}, WholeBody{});
  PlainSolid<S, decltype(M{}.law())> peer(mesh, M{S(5000), S(0.45)}.law(), S(1000));
  auto start = body.save();
  for (int i = 0; i < body.size(); ++i) start.particles.velocity[i] = peer.velocities().col(i) = S(0.02) * Vector3<S>::Random();
  body.restore(start);
  S const h = S(0.3) * body.stable_step();
  auto const tetrahedra = static_cast<double>(mesh.tetrahedra.cols());
  in_turn(state, tetrahedra, std::max(2, static_cast<int>(4e5 / tetrahedra)), [&] { peer.advance(h); }, [&] { body.step(h); });
}

/// The plain one has the elements' matrices, made beforehand.
template <class S, class M>
void tangent_product(benchmark::State& state) {
  int const n = static_cast<int>(state.range(0));
  auto const mesh = make_block<S>(n + 1, n + 1, n + 1, S(0.005), BlockPattern::alternating);
  auto const tissue = solid<S, M>(mesh);
  typename FiniteElements<S, M>::Assembly assembly;
  std::vector<int> all(static_cast<std::size_t>(tissue.size()));
  std::iota(all.begin(), all.end(), 0);
  tissue.assemble(all, assembly);
  Matrix<S, 4, Dynamic> x = Matrix<S, 4, Dynamic>::Zero(4, mesh.points.cols()), d = x, product = x;
  x.topRows(3) = mesh.points + S(2e-4) * Matrix3X<S>::Random(3, x.cols());
  d.topRows(3).setRandom();
  assembly.linearise(PaddedView<S>(x.data(), 4, x.cols()), nullptr);
  std::vector<NodeMatrix<S, 4>> matrices;
  auto const& elements = tissue.template elements<typename FiniteElements<S, M>::Element>();
  for (std::size_t e = 0; e < elements.elements.size(); ++e) {
    NodeColumns<S, 4> here;
    for (int k = 0; k < 4; ++k) here.col(k) = x.col(elements.nodes[e][static_cast<std::size_t>(k)]).template head<3>();
    matrices.push_back(elements.elements[e].semidefinite_stiffness(here));
  }
  Matrix3X<S> const direction = d.topRows(3);
  Matrix3X<S> out = direction;
  auto const plain = [&] {
    out.setZero();
    for (std::size_t e = 0; e < matrices.size(); ++e) {
      auto const& nodes = elements.nodes[e];
      Matrix<S, 12, 1> own;
      for (int k = 0; k < 4; ++k) own.template segment<3>(3 * k) = direction.col(nodes[static_cast<std::size_t>(k)]);
      Matrix<S, 12, 1> const pull = matrices[e] * own;
      for (int k = 0; k < 4; ++k) out.col(nodes[static_cast<std::size_t>(k)]) += pull.template segment<3>(3 * k);
    }
  };
  auto const tetrahedra = static_cast<double>(matrices.size());
  in_turn(state, tetrahedra, std::max(2, static_cast<int>(4e5 / tetrahedra)), plain, [&] { assembly.multiply_tangent(0, 0, 1, d.data(), product.data()); });
  if (!((product.topRows(3) - out).norm() < S(1e-3) * out.norm())) state.SkipWithError("the two products differ");
}

/// A step of a body beside one of another: the median of the ratios, under this name, and the best time per tetrahedron.
template <class Body>
void beside(benchmark::State& state, char const* name, double tetrahedra, typename Body::Scalar h, Body& plain, Body& body) {
  std::vector<double> ratios;
  double best = 1e9;
  int const rounds = std::max(1, static_cast<int>(4e5 / tetrahedra));
  plain.step(h), body.step(h);   // gathers
  for (auto _ : state) {
    double const start = benchmarks::thread_time();
    for (int k = 0; k < rounds; ++k) plain.step(h);
    double const middle = benchmarks::thread_time();
    for (int k = 0; k < rounds; ++k) body.step(h);
    double const end = benchmarks::thread_time();
    ratios.push_back((end - middle) / (middle - start)), best = std::min(best, (end - middle) / rounds);
  }
  std::nth_element(ratios.begin(), ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2), ratios.end());
  state.counters[name] = ratios[ratios.size() / 2];
  state.counters["ns"] = 1e9 * best / tetrahedra;
}

/// A leapfrog step with nodal pressure beside one without.
template <class S, class M>
void nodal_pressure(benchmark::State& state) {
  int const n = static_cast<int>(state.range(0));
  auto const mesh = make_block<S>(n + 1, n + 1, n + 1, S(0.005), BlockPattern::alternating);
  SoftBody body(solid<S, M>(mesh), LeapfrogVerlet{}, WholeBody{}), averaged(solid<S, M>(mesh, Stiffness::matrix_free, Pressure::nodal), LeapfrogVerlet{}, WholeBody{});
  beside(state, "nodal/element", static_cast<double>(mesh.tetrahedra.cols()), S(0.3) * std::min(body.stable_step(), averaged.stable_step()), body, averaged);
}

/// A step of a mesh that is numbered at random beside one that is numbered row by row: by leapfrog, or by backward Euler with 25 iterations.
template <class Integrator>
void numbered_at_random(benchmark::State& state) {
  int const n = static_cast<int>(state.range(0));
  auto const mesh = make_block<double>(n + 1, n + 1, n + 1, 0.007, BlockPattern::alternating);
  auto other = mesh;
  std::vector<int> number(static_cast<std::size_t>(mesh.points.cols()));
  std::iota(number.begin(), number.end(), 0);
  std::shuffle(number.begin(), number.end(), std::mt19937(1));
  for (std::size_t i = 0; i < number.size(); ++i) other.points.col(number[i]) = mesh.points.col(static_cast<Eigen::Index>(i));
  for (int& corner : other.tetrahedra.reshaped()) corner = number[static_cast<std::size_t>(corner)];
  auto const make = [](auto const& of) {
    auto tissue = solid<double, StableNeoHookean<double>>(of);
    tissue.nail(vertices_where(of, [](auto const& p) { return p.z() < 1e-6; }));
    Integrator integrator;
    if constexpr (std::same_as<Integrator, BackwardEuler>) integrator = {.tolerance = 0, .max_iterations = 25};
    SoftBody body(std::move(tissue), integrator, WholeBody{});
    body.set_gravity({0, 0, -9.81});
    return body;
  };
  auto rows = make(mesh), random = make(other);
  beside(state, "random/rows", static_cast<double>(mesh.tetrahedra.cols()), std::min(0.01, 0.5 * rows.stable_step()), rows, random);
}

/// A millisecond of a block that swings, by leapfrog in stable steps, and what its memory delivers: what a step reads and writes of its tetrahedra.
template <class S, class M>
void millisecond(benchmark::State& state) {
  int const n = static_cast<int>(state.range(0));
  auto const mesh = make_block<S>(n + 1, n + 1, n + 1, S(0.007), BlockPattern::alternating);
  auto tissue = solid<S, M>(mesh);
  tissue.nail(vertices_where(mesh, [](auto const& p) { return p.z() < S(1e-6); }));
  SoftBody body(std::move(tissue), LeapfrogVerlet{}, WholeBody{});
  body.set_gravity({0, 0, S(-9.81)});
  S const stable = body.stable_step();
  int const steps = static_cast<int>(std::ceil(S(1e-3) / stable));
  double best = 1e9;
  body.step(S(1e-3) / static_cast<S>(steps));   // gathers
  for (auto _ : state) {
    double const start = benchmarks::thread_time();
    for (int k = 0; k < steps; ++k) body.step(S(1e-3) / static_cast<S>(steps));
    best = std::min(best, benchmarks::thread_time() - start);
  }
  auto const tetrahedra = static_cast<double>(mesh.tetrahedra.cols());
  double const bytes = (9 + 1 + sizeof(M{}.law()) / sizeof(S)) * sizeof(S) + 4 * sizeof(int);
  state.counters["tetrahedra"] = tetrahedra;
  state.counters["substeps"] = steps;
  state.counters["ms"] = 1e3 * best;
  state.counters["ns"] = 1e9 * best / steps / tetrahedra;
  state.counters["GB/s"] = 1e-9 * bytes * tetrahedra * steps / best;
}

/// A backward-Euler step of 10 ms with 25 iterations: its time, the residual reached, and the time of a step to 1e-3.
template <class M, Stiffness stiffness, Pressure pressure = Pressure::element>
void implicit_step(benchmark::State& state) {
  int const n = static_cast<int>(state.range(0));
  auto const mesh = make_block<double>(n + 1, n + 1, n + 1, 0.007, BlockPattern::alternating);
  auto const make = [&](BackwardEuler const& integrator) {
    auto tissue = solid<double, M>(mesh, stiffness, pressure);
    tissue.nail(vertices_where(mesh, [](auto const& p) { return p.z() < 1e-6; }));
    SoftBody body(std::move(tissue), integrator, WholeBody{});
    body.set_gravity({0, 0, -9.81});
    body.step(0.01);
    return body;
  };
  auto body = make({.tolerance = 0, .max_iterations = 25}), converged = make({.tolerance = 1e-3, .max_iterations = 10000});
  auto const start = body.save(), other = converged.save();
  double best = 1e9, best_converged = 1e9, residual = 0;
  int iterations = 0;
  for (auto _ : state) {
    body.restore(start), converged.restore(other);
    body.step(0.01), converged.step(0.01);   // gathers
    double const first = benchmarks::thread_time();
    residual = body.step(0.01).solve.residual;
    double const middle = benchmarks::thread_time();
    iterations = converged.step(0.01).solve.iterations;
    best = std::min(best, middle - first), best_converged = std::min(best_converged, benchmarks::thread_time() - middle);
  }
  state.counters["tetrahedra"] = static_cast<double>(mesh.tetrahedra.cols());
  state.counters["ms"] = 1e3 * best;
  state.counters["residual"] = residual;
  state.counters["ms_to_1e-3"] = 1e3 * best_converged;
  state.counters["iterations_to_1e-3"] = iterations;
}

BENCHMARK(step<double, StVenantKirchhoff<double>>)->Arg(8)->Arg(16)->Arg(28)->Unit(benchmark::kMillisecond);
BENCHMARK(step<double, StableNeoHookean<double>>)->Arg(8)->Arg(16)->Arg(28)->Unit(benchmark::kMillisecond);
BENCHMARK(step<double, Corotational<double>>)->Arg(8)->Arg(16)->Arg(28)->Unit(benchmark::kMillisecond);
BENCHMARK(step<float, StVenantKirchhoff<float>>)->Arg(16)->Unit(benchmark::kMillisecond);
BENCHMARK(step<float, StableNeoHookean<float>>)->Arg(16)->Unit(benchmark::kMillisecond);
BENCHMARK(step<float, Corotational<float>>)->Arg(16)->Unit(benchmark::kMillisecond);
BENCHMARK(tangent_product<double, StableNeoHookean<double>>)->Arg(16)->Unit(benchmark::kMillisecond);
BENCHMARK(tangent_product<float, StableNeoHookean<float>>)->Arg(16)->Unit(benchmark::kMillisecond);
BENCHMARK(nodal_pressure<double, StableNeoHookean<double>>)->Arg(16)->Unit(benchmark::kMillisecond);
BENCHMARK(numbered_at_random<LeapfrogVerlet>)->Arg(16)->Arg(32)->Unit(benchmark::kMillisecond);
BENCHMARK(numbered_at_random<BackwardEuler>)->Arg(16)->Arg(32)->Unit(benchmark::kMillisecond);
BENCHMARK(millisecond<double, StableNeoHookean<double>>)->Arg(6)->Arg(9)->Arg(16)->Arg(27)->Arg(58)->Unit(benchmark::kMillisecond);
BENCHMARK(implicit_step<StableNeoHookean<double>, Stiffness::matrix_free>)->Arg(5)->Arg(9)->Arg(16)->Unit(benchmark::kMillisecond);
BENCHMARK(implicit_step<StableNeoHookean<double>, Stiffness::assembled>)->Arg(5)->Arg(9)->Arg(16)->Unit(benchmark::kMillisecond);
BENCHMARK(implicit_step<StableNeoHookean<double>, Stiffness::matrix_free, Pressure::nodal>)->Arg(5)->Arg(9)->Arg(16)->Unit(benchmark::kMillisecond);
BENCHMARK(implicit_step<Corotational<double>, Stiffness::matrix_free>)->Arg(5)->Arg(9)->Arg(16)->Unit(benchmark::kMillisecond);
BENCHMARK(implicit_step<Corotational<double>, Stiffness::assembled>)->Arg(5)->Arg(9)->Arg(16)->Unit(benchmark::kMillisecond);

}  // namespace
