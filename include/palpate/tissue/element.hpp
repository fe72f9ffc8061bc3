// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/semidefinite.hpp>
#include <palpate/core/matrix.hpp>

#include <concepts>
#include <type_traits>

namespace palpate {

/// One column for each node of an element: positions [m], velocities [m/s], forces [N].
template <RealScalar Scalar, int Nodes>
using NodeColumns = Matrix<Scalar, 3, Nodes>;

/// Between the nodes of an element, in the order x y z of node 0, x y z of node 1, …: a stiffness [N/m] or a damping [N·s/m].
template <RealScalar Scalar, int Nodes>
using NodeMatrix = Matrix<Scalar, 3 * Nodes, 3 * Nodes>;

/// Says how many particles it joins: `static constexpr int nodes`.
template <class E>
concept HasNodes = requires {
  { E::nodes } -> std::convertible_to<int>;
  requires(E::nodes > 0);
};

/// States the energy it stores at the positions of its nodes [J].
template <class E, class Scalar>
concept HasElementEnergy = HasNodes<E> && requires(E const& element, NodeColumns<Scalar, E::nodes> const& x) {
  { element.energy(x) } -> std::convertible_to<Scalar>;
};

namespace detail {

/// A matrix, or an expression, of the shape and the scalar of another.
template <class A, class Wanted>
concept HasShapeOf = std::convertible_to<A, Wanted> && std::same_as<typename std::remove_cvref_t<A>::Scalar, typename Wanted::Scalar> &&
                     int{std::remove_cvref_t<A>::RowsAtCompileTime} == int{Wanted::RowsAtCompileTime} && int{std::remove_cvref_t<A>::ColsAtCompileTime} == int{Wanted::ColsAtCompileTime};

}  // namespace detail

/// States its elastic force on each node, −∇energy [N].
template <class E, class Scalar>
concept HasElementForce = HasNodes<E> && requires(E const& element, NodeColumns<Scalar, E::nodes> const& x) {
  { element.force(x) } -> detail::HasShapeOf<NodeColumns<Scalar, E::nodes>>;
};

/// States its tangent stiffness, −∂force/∂x [N/m]: symmetric.
template <class E, class Scalar>
concept HasElementStiffness = HasNodes<E> && requires(E const& element, NodeColumns<Scalar, E::nodes> const& x) {
  { element.stiffness(x) } -> detail::HasShapeOf<NodeMatrix<Scalar, E::nodes>>;
};

/// An elastic element between some particles: it holds its rest data and answers for the positions of its nodes. ElementTissue makes tissue of it.
///   static constexpr int nodes
///   energy(x) const → Scalar             x: NodeColumns<Scalar, nodes>, 3 × nodes
///   force(x) const → NodeColumns         −∇energy
///   stiffness(x) const → NodeMatrix      −∂force/∂x
/// What the syntax can not say, and testing::check_element checks: they belong together, and the force is continuous. Return matrices, no expressions:
/// what an expression refers to is gone by then.
template <class E, class Scalar>
concept Element = RealScalar<Scalar> && std::copy_constructible<E> && HasNodes<E> && HasElementEnergy<E, Scalar> && HasElementForce<E, Scalar> &&
                  HasElementStiffness<E, Scalar>;

namespace detail {

/// Says, where it is instantiated, what keeps E from being an Element of this scalar.
template <class E, class Scalar>
struct ElementSentences {
  static constexpr bool is_other = !HasElementForce<E, Scalar> && HasElementForce<E, std::conditional_t<std::same_as<Scalar, float>, double, float>>;
  static constexpr bool is_asked = HasNodes<E> && !is_other;
  static_assert(HasNodes<E>, "palpate: this is no Element, it has no nodes; declare: static constexpr int nodes, how many particles it joins.");
  static_assert(!is_other, "palpate: the element computes in another scalar than the points; write both for double or both for float.");
  static_assert(!is_asked || HasElementEnergy<E, Scalar>, "palpate: the element has no energy(x) const; declare: Scalar energy(NodeColumns<Scalar, nodes> const& x) const, in J.");
  static_assert(!is_asked || HasElementForce<E, Scalar>,
                "palpate: the element has no force(x) const; declare: NodeColumns<Scalar, nodes> force(NodeColumns<Scalar, nodes> const& x) const, in N.");
  static_assert(!is_asked || HasElementStiffness<E, Scalar>,
                "palpate: the element has no stiffness(x) const; declare: NodeMatrix<Scalar, nodes> stiffness(NodeColumns<Scalar, nodes> const& x) const, in N/m.");
};

}  // namespace detail

// --- what an element may answer besides; a misspelt one is told by static_assert(HasElementDamping<MyElement, double>) and its like -------------

/// Refinement: states the positive semidefinite part of its stiffness, or what it takes for that. Of others it is found by eigenvalues.
template <class E, class Scalar>
concept HasSemidefiniteStiffness = Element<E, Scalar> && requires(E const& element, NodeColumns<Scalar, E::nodes> const& x) {
  { element.semidefinite_stiffness(x) } -> std::convertible_to<NodeMatrix<Scalar, E::nodes>>;
};

/// Refinement: has a shorter way to the norms of the 3 × 3 blocks of stiffness(rest), where the particles rest: they may be less than `norm_bound` of those, not than
/// their largest singular values.
template <class E, class Scalar>
concept HasBlockNormsAtRest = Element<E, Scalar> && requires(E const& element, NodeColumns<Scalar, E::nodes> const& rest) {
  { element.block_norms_at_rest(rest) } -> std::convertible_to<Matrix<Scalar, E::nodes, E::nodes>>;
};

/// Refinement: damps: `damping(x)` is C in the force −C v, symmetric and positive semidefinite [N·s/m].
template <class E, class Scalar>
concept HasElementDamping = Element<E, Scalar> && requires(E const& element, NodeColumns<Scalar, E::nodes> const& x) {
  { element.damping(x) } -> std::convertible_to<NodeMatrix<Scalar, E::nodes>>;
};

/// Refinement: answers without matrices, which is faster: force(x, v) with the damping, K(x) d with the positive semidefinite stiffness, C(x) v.
template <class E, class Scalar>
concept HasElementProducts = Element<E, Scalar> && requires(E const& element, NodeColumns<Scalar, E::nodes> const& x) {
  { element.force(x, x) } -> std::convertible_to<NodeColumns<Scalar, E::nodes>>;
  { element.stiffness_product(x, x) } -> std::convertible_to<NodeColumns<Scalar, E::nodes>>;
  { element.damping_product(x, x) } -> std::convertible_to<NodeColumns<Scalar, E::nodes>>;
};

/// Refinement: states Σ_j ‖K_ij‖ and Σ_j ‖C_ij‖ of the row of any of its nodes: at rest, and the first at positions x. Of others it follows from the matrices.
template <class E, class Scalar>
concept HasElementBounds = Element<E, Scalar> && requires(E const& element, NodeColumns<Scalar, E::nodes> const& x) {
  { element.stiffness_bound() } -> std::convertible_to<Scalar>;
  { element.stiffness_bound(x) } -> std::convertible_to<Scalar>;
  { element.damping_bound() } -> std::convertible_to<Scalar>;
};

/// Refinement: has a mass [kg], which its nodes share equally.
template <class E, class Scalar>
concept HasElementMass = Element<E, Scalar> && requires(E const& element) {
  { element.mass() } -> std::convertible_to<Scalar>;
};

namespace detail {

/// columns += factor · matrix · v, by plain loops: Eigen's for such sizes take seconds to compile.
template <RealScalar Scalar, int N, int N3>
void add_product(NodeColumns<Scalar, N>& columns, Scalar factor, Matrix<Scalar, N3, N3> const& matrix, NodeColumns<Scalar, N> const& v) noexcept {
  static_assert(N3 == 3 * N);
  for (int j = 0; j < N3; ++j) {
    Scalar const part = factor * v.data()[j];
    for (int i = 0; i < N3; ++i) columns.data()[i] += part * matrix.data()[j * N3 + i];
  }
}

/// The force of an element at (x, v) with its damping.
template <class E, RealScalar Scalar, int N>
NodeColumns<Scalar, N> element_force(E const& element, NodeColumns<Scalar, N> const& x, NodeColumns<Scalar, N> const& v) {
  if constexpr (HasElementProducts<E, Scalar>) {
    return element.force(x, v);
  } else {
    NodeColumns<Scalar, N> force = element.force(x);
    if constexpr (HasElementDamping<E, Scalar>) add_product(force, Scalar(-1), NodeMatrix<Scalar, N>(element.damping(x)), v);
    return force;
  }
}

template <class E, RealScalar Scalar, int N>
NodeMatrix<Scalar, N> semidefinite_stiffness(E const& element, NodeColumns<Scalar, N> const& x) {
  if constexpr (HasSemidefiniteStiffness<E, Scalar>)
    return element.semidefinite_stiffness(x);
  else
    return semidefinite_part<Scalar, 3 * N>(element.stiffness(x));
}

template <class E, RealScalar Scalar, int N>
NodeColumns<Scalar, N> stiffness_product(E const& element, NodeColumns<Scalar, N> const& x, NodeColumns<Scalar, N> const& d) {
  if constexpr (HasElementProducts<E, Scalar>) {
    return element.stiffness_product(x, d);
  } else {
    NodeColumns<Scalar, N> product = NodeColumns<Scalar, N>::Zero();
    add_product(product, Scalar(1), semidefinite_stiffness(element, x), d);
    return product;
  }
}

template <class E, RealScalar Scalar, int N>
NodeColumns<Scalar, N> damping_product(E const& element, NodeColumns<Scalar, N> const& x, NodeColumns<Scalar, N> const& v) {
  if constexpr (HasElementProducts<E, Scalar>) {
    return element.damping_product(x, v);
  } else {
    NodeColumns<Scalar, N> product = NodeColumns<Scalar, N>::Zero();
    if constexpr (HasElementDamping<E, Scalar>) add_product(product, Scalar(1), NodeMatrix<Scalar, N>(element.damping(x)), v);
    return product;
  }
}

/// ‖B_kj‖ of a stiffness, which is symmetric.
template <RealScalar Scalar, int N3>
Matrix<Scalar, N3 / 3, N3 / 3> block_norms(Matrix<Scalar, N3, N3> const& stiffness) noexcept {
  Matrix<Scalar, N3 / 3, N3 / 3> norms;
  for (int k = 0; k < N3 / 3; ++k)
    for (int j = k; j < N3 / 3; ++j) norms(k, j) = norms(j, k) = norm_bound<Scalar>(stiffness.template block<3, 3>(3 * k, 3 * j));
  return norms;
}
template <class E, RealScalar Scalar, int N>
Matrix<Scalar, N, N> block_norms_at_rest(E const& element, NodeColumns<Scalar, N> const& rest) {
  if constexpr (HasBlockNormsAtRest<E, Scalar>)
    return element.block_norms_at_rest(rest);
  else
    return block_norms<Scalar, 3 * N>(element.stiffness(rest));
}

/// Σ_j ‖B_kj‖ of the row of node k.
template <RealScalar Scalar, int N3>
Scalar row_norm(Matrix<Scalar, N3, N3> const& matrix, int k) noexcept {
  Scalar sum = 0;
  for (int j = 0; j < N3; j += 3) sum += norm_bound<Scalar>(matrix.template block<3, 3>(3 * k, j));
  return sum;
}

/// The row of node k at rest, where x is the rest shape, and elsewhere.
template <class E, RealScalar Scalar, int N>
Scalar stiffness_bound_at_rest(E const& element, NodeColumns<Scalar, N> const& x, int k) {
  if constexpr (HasElementBounds<E, Scalar>)
    return element.stiffness_bound();
  else
    return block_norms_at_rest(element, x).col(k).sum();
}
template <class E, RealScalar Scalar, int N>
Scalar stiffness_bound(E const& element, NodeColumns<Scalar, N> const& x, int k) {
  if constexpr (HasElementBounds<E, Scalar>)
    return element.stiffness_bound(x);
  else
    return row_norm<Scalar, 3 * N>(element.stiffness(x), k);
}
template <class E, RealScalar Scalar, int N>
Scalar damping_bound(E const& element, NodeColumns<Scalar, N> const& x, int k) {
  if constexpr (HasElementBounds<E, Scalar>)
    return element.damping_bound();
  else if constexpr (HasElementDamping<E, Scalar>)
    return row_norm<Scalar, 3 * N>(element.damping(x), k);
  else
    return 0;
}

/// add(k, stiffness, damping) for each node k: the two above.
template <class E, RealScalar Scalar, class Add>
void add_bounds_at_rest(E const& element, NodeColumns<Scalar, E::nodes> const& x, Add const& add) {
  if constexpr (HasElementBounds<E, Scalar>) {
    for (int k = 0; k < E::nodes; ++k) add(k, element.stiffness_bound(), element.damping_bound());
  } else {
    Matrix<Scalar, E::nodes, E::nodes> const size = block_norms_at_rest(element, x);
    for (int k = 0; k < E::nodes; ++k) add(k, size.col(k).sum(), damping_bound<E, Scalar, E::nodes>(element, x, k));
  }
}

}  // namespace detail

}  // namespace palpate
