// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/integrator/concept.hpp>

#include <type_traits>
#include <utility>

namespace work_precision {

/// What an integrator asked of its system: forces of all particles, and products with the tangent.
struct Counts {
  long evaluations = 0, products = 0;
};

/// A system that counts, and is otherwise the one behind it.
template <class System>
class CountingSystem {
 public:
  using Scalar = typename System::Scalar;
  using Matrix = typename System::Matrix;

  CountingSystem(System& system, Counts& counts) : system_(system), counts_(counts) {}

  decltype(auto) positions() { return system_.positions(); }
  decltype(auto) velocities() { return system_.velocities(); }
  decltype(auto) scratch(int k) { return system_.scratch(k); }
  decltype(auto) previous_acceleration() { return system_.previous_acceleration(); }
  bool remembers() const { return system_.remembers(); }
  template <class X, class V>
  decltype(auto) acceleration(X const& x, V const& v) {
    ++counts_.evaluations;
    return system_.acceleration(x, v);
  }
  template <class X, class V, class Out>
  void acceleration(X const& x, V const& v, Out&& out) {
    ++counts_.evaluations;
    system_.acceleration(x, v, std::forward<Out>(out));
  }
  void linearise()
    requires palpate::LinearisedSystem<System>
  {
    system_.linearise();
  }
  template <class D, class Out>
  void multiply_tangent(Scalar m, Scalar c, Scalar k, D const& d, Out&& out)
    requires palpate::LinearisedSystem<System>
  {
    ++counts_.products;
    system_.multiply_tangent(m, c, k, d, std::forward<Out>(out));
  }
  template <class Out>
  void tangent_diagonal(Scalar m, Scalar c, Scalar k, Out&& out)
    requires palpate::LinearisedSystem<System>
  {
    system_.tangent_diagonal(m, c, k, std::forward<Out>(out));
  }

 private:
  System& system_;
  Counts& counts_;
};

/// An integrator that counts what its steps ask for.
template <palpate::Integrator I>
struct Counted {
  I integrator;
  Counts* counts;

  template <class System>
  void step(System& system, typename System::Scalar h) const
    requires palpate::detail::Steps<I, CountingSystem<System>>
  {
    CountingSystem<System> counting(system, *counts);
    integrator.step(counting, h);
  }
  template <palpate::RealScalar Scalar>
  Scalar stable_step(palpate::ModalBounds<Scalar> const& modes) const
    requires palpate::StatesStableStep<I>
  {
    return integrator.stable_step(modes);
  }
};

}  // namespace work_precision
