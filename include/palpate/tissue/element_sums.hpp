// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/tissue/element.hpp>

#include <array>
#include <cstddef>
#include <utility>

namespace palpate {

/// What a tissue answers as a sum over its elements: forces on a particle, energy, products, row bounds. It is the base of the tissue, `Tissue`, which has
///   rest_position(i) const
///   for_each_element(visit) const         visit(nodes, element): the particles that it joins, an array of as many as it says
///   for_each_element_at(i, visit) const   the same for those that particle i is a node of
/// Shapes     x, v, d, y: 3 × particles, or what answers col(i).
/// Cost       internal_force and the bounds O(elements at the particle), the others O(elements); no allocation.
template <class Tissue, RealScalar Scalar>
class ElementSums {
 public:
  /// The force of all elements on one particle at (x, v) [N].
  template <class X, class V>
  Vector3<Scalar> internal_force(int i, X const& x, V const& v) const noexcept {
    Vector3<Scalar> force = Vector3<Scalar>::Zero();
    self().for_each_element_at(i, [&](auto const& nodes, auto const& element) {
      auto const forces = detail::element_force(element, gather(x, nodes), gather(v, nodes));
      add_column_of(i, nodes, forces, force);
    });
    return force;
  }

  /// Energy in all elements at x [J].
  template <class X>
  Scalar potential_energy(X const& x) const {
    Scalar energy = 0;
    self().for_each_element([&](auto const& nodes, auto const& element) { energy += element.energy(gather(x, nodes)); });
    return energy;
  }

  /// y += K d at positions x [N], K positive semidefinite.
  template <class X, class D, class Y>
  void add_stiffness_product(X const& x, D const& d, Y& y) const noexcept {
    self().for_each_element(
        [&](auto const& nodes, auto const& element) { scatter(detail::stiffness_product(element, gather(x, nodes), gather(d, nodes)), nodes, y); });
  }

  /// The blocks of the same K: visit(i, j, K_ij) once for each pair of nodes of each element.
  template <class X, class Visit>
  void for_each_stiffness_block(X const& x, Visit visit) const {
    self().for_each_element([&](auto const& nodes, auto const& element) {
      auto const stiffness = detail::semidefinite_stiffness(element, gather(x, nodes));
      for (std::size_t a = 0; a < nodes.size(); ++a)
        for (std::size_t b = 0; b < nodes.size(); ++b)
          visit(nodes[a], nodes[b], Matrix<Scalar, 3, 3>(stiffness.template block<3, 3>(3 * static_cast<int>(a), 3 * static_cast<int>(b))));
    });
  }

  /// y += C v at positions x [N].
  template <class X, class D, class Y>
  void add_damping_product(X const& x, D const& v, Y& y) const noexcept {
    self().for_each_element(
        [&](auto const& nodes, auto const& element) { scatter(detail::damping_product(element, gather(x, nodes), gather(v, nodes)), nodes, y); });
  }

  /// Gershgorin's row sum of the stiffness at rest: Σ_j ‖K_ij‖ [N/m].
  Scalar stiffness_bound(int i) const noexcept {
    Scalar sum = 0;
    self().for_each_element_at(i, [&](auto const& nodes, auto const& element) {
      sum += detail::stiffness_bound_at_rest(element, rest(nodes), place(nodes, i));
    });
    return sum;
  }

  /// The same at positions x: each element with its tangent and its tension there.
  template <class X>
  Scalar stiffness_bound(int i, X const& x) const noexcept {
    Scalar sum = 0;
    self().for_each_element_at(i, [&](auto const& nodes, auto const& element) { sum += detail::stiffness_bound(element, gather(x, nodes), place(nodes, i)); });
    return sum;
  }

  /// The same for the damping at rest [N·s/m].
  Scalar damping_bound(int i) const noexcept {
    Scalar sum = 0;
    self().for_each_element_at(i, [&](auto const& nodes, auto const& element) {
      sum += detail::damping_bound(element, rest(nodes), place(nodes, i));
    });
    return sum;
  }
  template <class X>
  Scalar damping_bound(int i, X const& x) const noexcept {
    Scalar sum = 0;
    self().for_each_element_at(i, [&](auto const& nodes, auto const& element) { sum += detail::damping_bound(element, gather(x, nodes), place(nodes, i)); });
    return sum;
  }

 private:
  Tissue const& self() const noexcept { return static_cast<Tissue const&>(*this); }

  // Without loops: at -O2 gcc would leave them, and go through memory.
  template <class X, std::size_t N>
  static NodeColumns<Scalar, static_cast<int>(N)> gather(X const& x, std::array<int, N> const& nodes) noexcept {
    return columns<N>([&](std::size_t k) -> decltype(auto) { return x.col(nodes[k]); });
  }
  template <std::size_t N>
  NodeColumns<Scalar, static_cast<int>(N)> rest(std::array<int, N> const& nodes) const noexcept {
    return columns<N>([&](std::size_t k) { return self().rest_position(nodes[k]); });
  }
  template <std::size_t N, class Of>
  static NodeColumns<Scalar, static_cast<int>(N)> columns(Of const& of) noexcept {
    NodeColumns<Scalar, static_cast<int>(N)> all;
    [&]<std::size_t... K>(std::index_sequence<K...>) { ((all.col(static_cast<int>(K)) = of(K)), ...); }(std::make_index_sequence<N>{});
    return all;
  }
  template <std::size_t N, class Y>
  static void scatter(NodeColumns<Scalar, static_cast<int>(N)> const& own, std::array<int, N> const& nodes, Y& y) noexcept {
    [&]<std::size_t... K>(std::index_sequence<K...>) { ((y.col(nodes[K]) += own.col(static_cast<int>(K))), ...); }(std::make_index_sequence<N>{});
  }
  /// sum += the column of the node that particle i is.
  template <std::size_t N>
  static void add_column_of(int i, std::array<int, N> const& nodes, NodeColumns<Scalar, static_cast<int>(N)> const& own, Vector3<Scalar>& sum) noexcept {
    [&]<std::size_t... K>(std::index_sequence<K...>) {
      ((nodes[K] == i ? void(sum += own.col(static_cast<int>(K))) : void()), ...);
    }(std::make_index_sequence<N>{});
  }
  /// Which of the nodes particle i is.
  template <std::size_t N>
  static int place(std::array<int, N> const& nodes, int i) noexcept {
    int k = 0;
    while (nodes[static_cast<std::size_t>(k)] != i) ++k;
    return k;
  }
};

}  // namespace palpate
