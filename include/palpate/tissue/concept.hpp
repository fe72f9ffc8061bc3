// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <array>
#include <concepts>
#include <span>

namespace palpate {

/// Knows its particles: how many, where they rest, what they weigh, which are nailed, who their neighbours are.
template <class T>
concept HasParticles = requires(T const& tissue, int i) {
  requires RealScalar<typename T::Scalar>;
  { tissue.size() } -> std::convertible_to<int>;
  { tissue.rest_position(i) } -> std::convertible_to<Vector3<typename T::Scalar>>;
  { tissue.mass(i) } -> std::convertible_to<typename T::Scalar>;
  { tissue.nailed(i) } -> std::convertible_to<bool>;
  tissue.for_each_neighbour(i, [](int) {});
};

/// Knows its surface: what a tool touches and a renderer draws.
template <class T>
concept HasSurface = requires(T const& tissue) {
  { tissue.surface().triangle_count() } -> std::convertible_to<int>;
  tissue.surface().triangles();
};

/// Gathers what acts on a subset of its particles into an `Assembly`, which then answers forces at (x, v).
template <class T>
concept Assembles = requires(T const& tissue, std::span<int const> moving, typename T::Assembly& assembly,
                             Matrix3X<typename T::Scalar>& columns) {
  tissue.assemble(moving, assembly);
  { assembly.particles() } -> std::convertible_to<std::span<int const>>;
  assembly.add_forces(columns, columns, columns);
};

/// States, row by row, an upper bound of its stiffness [N/m] and damping [N·s/m]: Σ_j ‖K_ij‖ at the rest shape.
template <class T>
concept BoundsItsRows = requires(T const& tissue, int i) {
  { tissue.stiffness_bound(i) } -> std::convertible_to<typename T::Scalar>;
  { tissue.damping_bound(i) } -> std::convertible_to<typename T::Scalar>;
};

/// Also states the bound of its stiffness at other positions [N/m]: Σ_j ‖K_ij(x)‖, tangent and pre-tension counted.
template <class T>
concept BoundsItsRowsAt = BoundsItsRows<T> && requires(T const& tissue, int i, Matrix3X<typename T::Scalar> const& positions) {
  { tissue.stiffness_bound(i, positions) } -> std::convertible_to<typename T::Scalar>;
};

/// Answers the force of all its elements on one particle at (x, v) [N]; x and v are asked for a column at a time.
template <class T>
concept AnswersForOne = requires(T const& tissue, int i, Matrix3X<typename T::Scalar> const& columns) {
  { tissue.internal_force(i, columns, columns) } -> std::convertible_to<Vector3<typename T::Scalar>>;
};

/// What the body is made of: rest shape, masses and elements, and their forces.
/// What the syntax can not say: forces are continuous, vanish at the rest shape of a body without pre-tension, and depend on
/// nothing but the positions and velocities given.
template <class T>
concept TissueModel = std::copyable<T> && HasParticles<T> && HasSurface<T> && Assembles<T> && AnswersForOne<T> && BoundsItsRows<T>;

/// Also multiplies its stiffness and damping with a vector: K dx at x, C dv at x.
template <class T>
concept MultipliesStiffness = requires(T const& tissue, Matrix3X<typename T::Scalar>& columns) {
  tissue.add_stiffness_product(columns, columns, columns);
  tissue.add_damping_product(columns, columns, columns);
};

/// Its Assembly also gives the matrix that an implicit integrator solves with: after linearise(x, inverse_mass), out = (m M + c C + k K) d and
/// the diagonal of that matrix, K and C symmetric and positive semidefinite at x. d and out are 4 × particles().size(), contiguous, the fourth row
/// 0, d zero in the border's columns; what comes out there is not used.
template <class T>
concept Linearises = Assembles<T> && requires(typename T::Assembly& assembly, Matrix<typename T::Scalar, 4, Dynamic> const& x,
                                              typename T::Scalar const* in, typename T::Scalar* out, typename T::Scalar factor) {
  assembly.linearise(x, in);
  assembly.multiply_tangent(factor, factor, factor, in, out);
  assembly.tangent_diagonal(factor, factor, factor, out);
};

/// Also states the energy stored in its elements at given positions [J].
template <class T>
concept HasPotentialEnergy = requires(T const& tissue, Matrix3X<typename T::Scalar> const& positions) {
  { tissue.potential_energy(positions) } -> std::convertible_to<typename T::Scalar>;
};

/// Also lets its surface be cut: particles are inserted and split, triangles subdivided, and mass and springs follow.
template <class T>
concept CuttableTissue = TissueModel<T> && requires(T& tissue, int i, Vector3<typename T::Scalar> barycentric,
                                                    typename T::Scalar s, std::span<int const> triangles, std::array<int, 3> corners) {
  { tissue.insert_in_triangle(i, barycentric) } -> std::same_as<int>;
  { tissue.insert_on_edge(i, i, s) } -> std::same_as<int>;
  { tissue.split_particle(i, triangles) } -> std::same_as<int>;
  tissue.merge_last_particle(i);
  tissue.change_corner(i, i, i);
  tissue.balance_copies(i, i);
  { tissue.insert_temporary(i, barycentric) } -> std::same_as<int>;
  tissue.move_temporary(i, barycentric);
  tissue.remove_temporary(i, corners);
};

/// Also evens out the masses around a particle that a cut has left too light; see MassSpring::even_mass.
template <class T>
concept EvensMasses = CuttableTissue<T> && requires(T& tissue, int i) { tissue.even_mass(i, [](int, int, typename T::Scalar) {}); };

/// Also makes tissue of one or more of its pieces alone: their particles, in the order given, with all that hangs on them.
template <class T>
concept DivisibleTissue = TissueModel<T> && requires(T const& tissue, std::span<int const> particles) {
  { tissue.part(particles) } -> std::same_as<T>;
};

/// Also lets a particle rest at another place of its surface: what hangs on it follows, its mass stays with it.
template <class T>
concept SeparableTissue = CuttableTissue<T> && requires(T& tissue, int i, Vector3<typename T::Scalar> rest) { tissue.move_rest(i, rest); };

}  // namespace palpate
