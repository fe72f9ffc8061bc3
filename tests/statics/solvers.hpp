// SPDX-License-Identifier: MIT
// Every shipped solver of statics, for tests that hold for all of them; and a chain whose balance is known.
#pragma once

#include <palpate/mesh/surface_topology.hpp>
#include <palpate/statics/dynamic_relaxation.hpp>
#include <palpate/statics/local_relaxation.hpp>
#include <palpate/statics/newton_raphson.hpp>
#include <palpate/tissue/concept.hpp>

#include <numeric>
#include <span>
#include <vector>

namespace palpate_test {

using namespace palpate;

/// Calls visit(name, solver) for each.
template <class Visit>
void for_each_solver(Visit visit) {
  visit("dynamic relaxation", DynamicRelaxation{});
  visit("local relaxation, index", LocalRelaxation{.order = VisitOrder::index});
  visit("local relaxation, breadth first", LocalRelaxation{});
  visit("local relaxation, random", LocalRelaxation{.order = VisitOrder::random});
  visit("Newton, conjugate gradients", NewtonRaphson<>{});
  visit("Newton, over-relaxation", NewtonRaphson<TangentOverRelaxation>{});
  visit("modified Newton", NewtonRaphson<>{.tangent = Tangent::modified});
  visit("modified Newton, over-relaxation", NewtonRaphson<TangentOverRelaxation>{.tangent = Tangent::modified});
  visit("damped Newton", NewtonRaphson<>{.damping = 0.6});
}

/// A chain of springs along x, nailed at particle 0, that pull in proportion to the vector between their ends:
/// f on i + 1 = −k_i (u_{i+1} − u_i). Under forces f its displacement is u_n = Σ_{i<n} (Σ_{j>i} f_j)/k_i.
template <class S>
class Chain {
 public:
  using Scalar = S;
  struct Assembly {
    std::vector<int> local;
    std::vector<Vector3<S>> force;
    Chain const* chain = nullptr;
    std::span<int const> particles() const { return local; }
    template <class X, class V, class F>
    void add_forces(X const& x, V const& /*v*/, F& f) const {
      Matrix3X<S> all = chain->rest_;
      for (std::size_t k = 0; k < local.size(); ++k) all.col(local[k]) = x.col(static_cast<Eigen::Index>(k));
      for (std::size_t k = 0; k < local.size(); ++k)
        f.col(static_cast<Eigen::Index>(k)) += chain->internal_force(local[k], all, Matrix3X<S>::Zero(3, all.cols()));
    }
  };

  explicit Chain(std::vector<S> stiffness) : k_(std::move(stiffness)), rest_(3, size()) {
    for (int i = 0; i < size(); ++i) rest_.col(i) << S(i), S(0), S(0);
  }
  int size() const { return static_cast<int>(k_.size()) + 1; }
  std::size_t revision() const { return 0; }
  Vector3<S> rest_position(int i) const { return rest_.col(i); }
  S mass(int) const { return S(0.1); }
  bool nailed(int i) const { return i == 0; }
  template <class Visit>
  void for_each_neighbour(int i, Visit visit) const {
    if (i > 0) visit(i - 1);
    if (i + 1 < size()) visit(i + 1);
  }
  SurfaceTopology const& surface() const { return surface_; }
  void assemble(std::span<int const> moving, Assembly& assembly) const {
    assembly.local.assign(moving.begin(), moving.end());
    for (int i = 0; i < size(); ++i)
      if (std::find(moving.begin(), moving.end(), i) == moving.end()) assembly.local.push_back(i);
    assembly.chain = this;
  }
  template <class X, class V>
  Vector3<S> internal_force(int i, X const& x, V const&) const {
    Vector3<S> f = Vector3<S>::Zero();
    if (i > 0) f -= stiffness(i - 1) * ((x.col(i) - rest_.col(i)) - (x.col(i - 1) - rest_.col(i - 1)));
    if (i + 1 < size()) f -= stiffness(i) * ((x.col(i) - rest_.col(i)) - (x.col(i + 1) - rest_.col(i + 1)));
    return f;
  }
  template <class X, class D, class Y>
  void add_stiffness_product(X const&, D const& dx, Y& y) const {
    for (int i = 0; i + 1 < size(); ++i) {
      Vector3<S> const pull = stiffness(i) * (dx.col(i + 1) - dx.col(i));
      y.col(i + 1) += pull;
      y.col(i) -= pull;
    }
  }
  template <class X, class Visit>
  void for_each_stiffness_block(X const&, Visit visit) const {
    for (int i = 0; i + 1 < size(); ++i)
      for (int const a : {i, i + 1})
        for (int const b : {i, i + 1}) visit(a, b, Matrix<S, 3, 3>((a == b ? stiffness(i) : -stiffness(i)) * Matrix<S, 3, 3>::Identity()));
  }
  template <class X, class D, class Y>
  void add_damping_product(X const&, D const&, Y&) const {}
  S stiffness_bound(int i) const { return 2 * ((i > 0 ? stiffness(i - 1) : S(0)) + (i + 1 < size() ? stiffness(i) : S(0))); }
  S damping_bound(int) const { return S(0); }
  S stiffness(int i) const { return k_[static_cast<std::size_t>(i)]; }

 private:
  std::vector<S> k_;
  Matrix3X<S> rest_;
  SurfaceTopology surface_;
};

/// All particles but the nailed ones.
template <class Tissue>
std::vector<int> free_particles(Tissue const& tissue) {
  std::vector<int> free;
  for (int i = 0; i < tissue.size(); ++i)
    if (!tissue.nailed(i)) free.push_back(i);
  return free;
}

template <class Tissue>
Matrix3X<typename Tissue::Scalar> rest_of(Tissue const& tissue) {
  Matrix3X<typename Tissue::Scalar> x(3, tissue.size());
  for (int i = 0; i < tissue.size(); ++i) x.col(i) = tissue.rest_position(i);
  return x;
}

}  // namespace palpate_test
