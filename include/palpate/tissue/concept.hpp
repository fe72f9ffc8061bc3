// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/core/padded_columns.hpp>
#include <palpate/core/serial.hpp>
#include <palpate/mesh/surface_topology.hpp>
#include <palpate/tissue/column_force.hpp>

#include <array>
#include <concepts>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>

namespace palpate {

namespace detail {

/// Columns of which one is looked at at a time, whatever they are made of: positions as they are, shifted or extrapolated, velocities of a body at rest.
template <RealScalar Scalar>
struct AnyColumns {
  Vector3<Scalar> col(int) const;
};

/// The columns that a body and a solver of statics compute in; what passes for both works with either.
template <RealScalar Scalar>
using BodyColumns = StridedView<Scalar>;
template <RealScalar Scalar>
using ConstBodyColumns = typename PaddedColumns<Scalar>::ConstView;

// What a TissueModel is asked for, one member each, so that TissueSentences can say which is missing.
template <class T>
concept HasRealScalar = RealScalar<typename T::Scalar>;
template <class T>
concept HasSize = requires(T const& tissue) { { tissue.size() } -> std::convertible_to<int>; };
template <class T>
concept HasRestPosition = requires(T const& tissue, int i) { { tissue.rest_position(i) } -> std::convertible_to<Vector3<typename T::Scalar>>; };
template <class T>
concept HasMass = requires(T const& tissue, int i) { { tissue.mass(i) } -> std::convertible_to<typename T::Scalar>; };
template <class T>
concept HasNailed = requires(T const& tissue, int i) { { tissue.nailed(i) } -> std::convertible_to<bool>; };
template <class T>
concept HasNeighbours = requires(T const& tissue, int i) { tissue.for_each_neighbour(i, [](int) {}); };
template <class T>
concept HasAssembly = std::default_initializable<typename T::Assembly> && requires(T const& tissue, std::span<int const> moving, typename T::Assembly& assembly) {
  tissue.assemble(moving, assembly);
  { std::as_const(assembly).particles() } -> std::convertible_to<std::span<int const>>;
};
template <class T>
concept AddsForces = requires(typename T::Assembly& assembly, Matrix3X<typename T::Scalar> const& x, Matrix3X<typename T::Scalar>& f,
                              ConstBodyColumns<typename T::Scalar> const& padded_x, BodyColumns<typename T::Scalar>& padded_f) {
  assembly.add_forces(x, x, f);
  assembly.add_forces(padded_x, padded_x, padded_f);
};
template <class T>
concept HasStiffnessBound = requires(T const& tissue, int i) { { tissue.stiffness_bound(i) } -> std::convertible_to<typename T::Scalar>; };
template <class T>
concept HasDampingBound = requires(T const& tissue, int i) { { tissue.damping_bound(i) } -> std::convertible_to<typename T::Scalar>; };

}  // namespace detail

/// Knows its particles: how many, where they rest, what they weigh, which are nailed, who their neighbours are.
template <class T>
concept HasParticles =
    detail::HasRealScalar<T> && detail::HasSize<T> && detail::HasRestPosition<T> && detail::HasMass<T> && detail::HasNailed<T> && detail::HasNeighbours<T>;

/// Counts its edits: what was derived from masses, elements or nails before is void when the number is another. One that never changes says 0.
template <class T>
concept CountsRevisions = requires(T const& tissue) {
  { tissue.revision() } -> std::same_as<std::size_t>;
};

/// Knows its surface: what a tool touches and a renderer draws. Of a body without one it has no triangles.
template <class T>
concept HasSurface = requires(T const& tissue) {
  { tissue.surface() } -> std::same_as<SurfaceTopology const&>;
};

/// Gathers what acts on a subset of its particles into an `Assembly`, which then adds the forces at (x, v) [N].
///   assemble(moving, assembly) const      each of them once, in any order
///   assembly.particles()                  the particles in `moving`, then those that act on them
///   assembly.add_forces(x, v, f)          3 × particles(); x, v and f are padded columns in a body, matrices in statics and tests: make it a template
template <class T>
concept HasSubsetForces = detail::HasAssembly<T> && detail::AddsForces<T>;

/// Answers the force of all its elements on one particle at (x, v) [N]; x and v answer col(i) and nothing else: make it a template.
template <class T>
concept HasParticleForce = requires(T const& tissue, int i, detail::AnyColumns<typename T::Scalar> const& columns) {
  { tissue.internal_force(i, columns, columns) } -> std::convertible_to<Vector3<typename T::Scalar>>;
};

/// States, row by row, an upper bound of its stiffness [N/m] and damping [N·s/m]: Σ_j ‖K_ij‖ at the rest shape.
template <class T>
concept HasStiffnessRowBounds = detail::HasStiffnessBound<T> && detail::HasDampingBound<T>;

/// What the body is made of: rest shape, masses and elements, and their forces.
/// What the syntax can not say: forces are continuous, vanish at the rest shape of a body without pre-tension, and depend on
/// nothing but the positions and velocities given.
template <class T>
concept TissueModel = std::copyable<T> && HasParticles<T> && CountsRevisions<T> && HasSurface<T> && HasSubsetForces<T> && HasParticleForce<T> &&
                      HasStiffnessRowBounds<T>;

namespace detail {

/// Says, where it is instantiated, what keeps T from being a TissueModel: each member with its signature.
template <class T>
struct TissueSentences {
  static constexpr int missing = !HasRealScalar<T> + !HasSize<T> + !HasRestPosition<T> + !HasMass<T> + !HasNailed<T> + !HasNeighbours<T> + !CountsRevisions<T> +
                                 !HasSurface<T> + !HasAssembly<T> + !AddsForces<T> + !HasParticleForce<T> + !HasStiffnessBound<T> + !HasDampingBound<T>;
  static constexpr bool is_none = missing > 6 || !HasRealScalar<T>;   // then there is no use in the others
  static_assert(!is_none, "palpate: this is no TissueModel, which begins with: using Scalar = double; see palpate/tissue/concept.hpp, or use MassSpring<double>.");
  static_assert(is_none || std::copyable<T>, "palpate: a tissue is copied with its body; give it a copy constructor and a copy assignment.");
  static_assert(is_none || HasSize<T>, "palpate: the tissue has no size(); declare: int size() const, how many particles it has.");
  static_assert(is_none || HasRestPosition<T>, "palpate: the tissue has no rest_position(i); declare: Vector3<Scalar> rest_position(int i) const, undeformed, in m.");
  static_assert(is_none || HasMass<T>, "palpate: the tissue has no mass(i); declare: Scalar mass(int i) const, in kg.");
  static_assert(is_none || HasNailed<T>, "palpate: the tissue has no nailed(i); declare: bool nailed(int i) const, true for a fixed particle.");
  static_assert(is_none || HasNeighbours<T>, "palpate: the tissue has no for_each_neighbour(i, visit); declare: template <class Visit> void for_each_neighbour(int i, Visit visit) const, "
                "which calls visit(j) for each particle j that shares an element with i.");
  static_assert(is_none || CountsRevisions<T>, "palpate: the tissue has no revision(); declare: std::size_t revision() const, how often masses, elements or nails were edited; 0 if never.");
  static_assert(is_none || HasSurface<T>, "palpate: the tissue has no surface(); declare: SurfaceTopology const& surface() const, the triangles of its skin.");
  static_assert(is_none || HasAssembly<T>, "palpate: the tissue has no assemble(moving, assembly); declare a class Assembly with std::span<int const> particles() const, and "
                "void assemble(std::span<int const> moving, Assembly& assembly) const.");
  static_assert(is_none || !HasAssembly<T> || AddsForces<T>, "palpate: the tissue's Assembly has no add_forces(x, v, f) for every kind of columns; declare: template <class X, class V, class F> "
                "void add_forces(X const& x, V const& v, F& f) const, which adds to f.col(k) the force on particles()[k].");
  static_assert(is_none || HasParticleForce<T>, "palpate: the tissue has no internal_force(i, x, v) for every kind of columns; declare: template <class X, class V> "
                "Vector3<Scalar> internal_force(int i, X const& x, V const& v) const, in N, and ask x and v for nothing but col(j).");
  static_assert(is_none || HasStiffnessBound<T>, "palpate: the tissue has no stiffness_bound(i); declare: Scalar stiffness_bound(int i) const, in N/m, at least sum_j |K_ij| at rest.");
  static_assert(is_none || HasDampingBound<T>, "palpate: the tissue has no damping_bound(i); declare: Scalar damping_bound(int i) const, in N s/m, at least sum_j |C_ij|.");
};

}  // namespace detail

// --- what a tissue may answer besides; a misspelt one is told by static_assert(HasPrestrain<MyTissue>) and its like --------------------

/// Refinement: also states the bound of its stiffness at other positions [N/m]: Σ_j ‖K_ij(x)‖, tangent and pre-tension counted. x answers col(i).
template <class T>
concept HasStiffnessRowBoundsAt = HasStiffnessRowBounds<T> && requires(T const& tissue, int i, detail::AnyColumns<typename T::Scalar> const& positions) {
  { tissue.stiffness_bound(i, positions) } -> std::convertible_to<typename T::Scalar>;
};

/// Refinement: also states the bound of its damping at other positions [N·s/m], where that follows a stiffness which grows.
template <class T>
concept HasDampingBoundAt = detail::HasDampingBound<T> && requires(T const& tissue, int i, detail::AnyColumns<typename T::Scalar> const& positions) {
  { tissue.damping_bound(i, positions) } -> std::convertible_to<typename T::Scalar>;
};

/// Refinement: has springs without weight that hold particles where they rest (anchor springs): `home(i).stiffness` [N/m], `home(i).damping` [N·s/m].
template <class T>
concept HasHomeSprings = requires(T const& tissue, int i) {
  { tissue.home(i).stiffness } -> std::convertible_to<typename T::Scalar>;
  { tissue.home(i).damping } -> std::convertible_to<typename T::Scalar>;
};

/// Refinement: is made of springs between two particles each (links): `links()` lists them, and at which particles they are; see LinkSet.
template <class T>
concept HasLinks = requires(T const& tissue, int i) {
  { tissue.links().size() } -> std::same_as<int>;
  { tissue.links()[i].rest_length } -> std::convertible_to<typename T::Scalar>;
  { tissue.links().at(i) } -> std::convertible_to<std::span<int const>>;
};

/// Refinement: states its pre-tension, the share that elements are shorter at rest. Where it is above 0 a body is settled as it is made.
template <class T>
concept HasPrestrain = requires(T const& tissue) {
  { tissue.link_prestrain() } -> std::convertible_to<typename T::Scalar>;
};

/// Refinement: takes memory beforehand, so that up to so many particles and triangles neither cuts nor another choice of moving particles allocates.
template <class T>
concept ReservesMemory = requires(T& tissue, T const& built, typename T::Assembly& assembly, int particles, int triangles) {
  tissue.reserve(particles, triangles);
  assembly.reserve(built, particles, triangles);
};

namespace detail {

/// What a body passes to accelerate(); each is called as a template.
struct EachBlock {
  template <class Walk>
  void operator()(int, Walk const&) const;
};
struct BeforeForces {
  void operator()(int, int) const;
};
struct AfterForces {
  template <class Columns>
  void operator()(int, Columns const&) const;
};
struct AfterForcesOfBlock {
  AfterForces operator()(int) const;
};

}  // namespace detail

/// Refinement: its Assembly does in one pass what else takes three: integrator, forces, integrator. For accelerate() see MassSpringAssembly.
///   blocks() const                        of particles(), that can be walked at once
///   force_columns() const                 that accelerate() needs behind `force`
///   max_force_columns(n) static           the most that n particles need
///   accelerate(x, v, gravity, pushes, force, run, columns, before, after_of) const
template <class T>
concept HasFusedForces =
    HasSubsetForces<T> && requires(typename T::Assembly const& assembly, typename T::Scalar const* x, typename T::Scalar* force,
                                   Vector3<typename T::Scalar> const& gravity, std::span<ColumnForce<typename T::Scalar> const> pushes,
                                   std::array<typename T::Scalar const*, 2> const& columns, int n) {
      { assembly.blocks() } noexcept -> std::same_as<int>;
      { assembly.force_columns() } noexcept -> std::same_as<int>;
      { T::Assembly::max_force_columns(n) } noexcept -> std::same_as<int>;
      assembly.accelerate(x, x, gravity, pushes, force, detail::EachBlock{}, columns, detail::BeforeForces{}, detail::AfterForcesOfBlock{});
    };

/// Refinement: multiplies its stiffness and damping with a vector: y += K(x) d, y += C(x) d, both symmetric and positive semidefinite. x is as in
/// add_forces, d and y are matrices or contiguous columns: make them templates.
template <class T>
concept HasStiffnessProduct =
    requires(T const& tissue, detail::ConstBodyColumns<typename T::Scalar> const& padded_x, Matrix3X<typename T::Scalar> const& x,
             typename Columns<typename T::Scalar, 3>::View& view, Matrix3X<typename T::Scalar>& y) {
      tissue.add_stiffness_product(padded_x, std::as_const(view), view);
      tissue.add_damping_product(padded_x, std::as_const(view), view);
      tissue.add_stiffness_product(x, x, y);
      tissue.add_damping_product(x, x, y);
    };

/// Refinement: hands out the same K(x) in blocks: visit(i, j, K_ij) for particles that are one or neighbours. What is visited twice is added.
template <class T>
concept HasStiffnessBlocks = requires(T const& tissue, Matrix3X<typename T::Scalar> const& x, void (*visit)(int, int, Matrix<typename T::Scalar, 3, 3> const&)) {
  tissue.for_each_stiffness_block(x, visit);
};

/// Refinement: its Assembly also gives the matrix that an implicit integrator solves with: after linearise(x, inverse_mass), out = (m M + c C + k K) d and
/// the diagonal of that matrix, K and C symmetric and positive semidefinite at x. d and out are 4 × particles().size(), contiguous, the fourth row
/// 0, d zero in the border's columns; what comes out there is not used.
template <class T>
concept HasTangentOperator = HasSubsetForces<T> && requires(typename T::Assembly& assembly, PaddedView<typename T::Scalar> const& x,
                                                            typename T::Scalar const* in, typename T::Scalar* out, typename T::Scalar factor) {
  assembly.linearise(x, in);
  assembly.multiply_tangent(factor, factor, factor, in, out);
  assembly.tangent_diagonal(factor, factor, factor, out);
};

/// Refinement: its Assembly states the energy of the elements that act on the chosen particles, at positions as multiply_tangent has them, and
/// what rounding may add to it [J].
template <class T>
concept HasAssemblyEnergy = HasTangentOperator<T> && requires(typename T::Assembly const& assembly, typename T::Scalar const* x) {
  { assembly.energy_rounding() } -> std::convertible_to<typename T::Scalar>;
  { assembly.energy(x) } -> std::convertible_to<typename T::Scalar>;
};

/// Refinement: its Assembly follows edits. follow_edits(moving, assembly) is as assemble(), of an assembly that was made of this tissue before some edits, or of
/// one that this is a copy of. Its sums may have an order that depends on what was edited when: layout() says it, and take(layout), then follow_edits,
/// give it to another assembly, of this tissue or a copy. A tissue that hides assemble() hides follow_edits(), too.
template <class T>
concept FollowsEdits = HasSubsetForces<T> && requires(T const& tissue, std::span<int const> moving, typename T::Assembly& assembly,
                                                      typename T::Assembly const& made, typename T::Assembly::Layout const& layout) {
  tissue.follow_edits(moving, assembly);
  { made.layout() } -> std::same_as<typename T::Assembly::Layout>;
  assembly.take(layout);
};

namespace detail {

/// What assemblies that follow edits say of their order; of others nothing.
template <class Tissue>
struct LayoutOf {
  struct type {};
};
template <FollowsEdits Tissue>
struct LayoutOf<Tissue> {
  using type = typename Tissue::Assembly::Layout;
};

}  // namespace detail

/// Refinement: says what moves it when the host names no integrator: `using DefaultIntegrator = BackwardEuler;`.
template <class T>
concept HasDefaultIntegrator = requires { typename T::DefaultIntegrator; };

/// Refinement: its Assembly, of doubles, multiplies with the tangent in float too: much faster, and as exact as conjugate gradients
/// need that are corrected in double.
template <class T>
concept HasFloatTangent =
    HasTangentOperator<T> && std::same_as<typename T::Scalar, double> && requires(typename T::Assembly const& assembly, double factor, float const* in, float* out) {
      assembly.multiply_tangent(factor, factor, factor, in, out);
    };

/// Refinement: its Assembly does linearise() and multiply_tangent() on some cores at once, where an Execution is their last argument, with the same bytes.
template <class T>
concept HasTangentOnCores = HasTangentOperator<T> && requires(typename T::Assembly& assembly, PaddedView<typename T::Scalar> const& x, typename T::Scalar const* in,
                                                              typename T::Scalar* out, typename T::Scalar factor, Serial const& run) {
  assembly.linearise(x, in, run);
  assembly.multiply_tangent(factor, factor, factor, in, out, run);
  { assembly.energy(in, run) } -> std::convertible_to<typename T::Scalar>;
};

/// Refinement: its Assembly multiplies with the tangent faster than the tissue itself: `static constexpr bool fast_tangent = true` in it.
template <class T>
concept HasFastTangent = HasTangentOperator<T> && requires { requires T::Assembly::fast_tangent; };

/// Refinement: the damping force that its Assembly adds is linear in the velocities, and dearer than multiply_tangent() gives it once the tangent is there: `static
/// constexpr bool damps_by_tangent = true` in it. Without velocities add_forces() costs less.
template <class T>
concept DampsByTangent = HasTangentOperator<T> && requires { requires T::Assembly::damps_by_tangent; };

/// Refinement: its Assembly computes some of the chosen particles alone, at their cost: their accelerations, as accelerate(), and after linearise() their
/// part of a product and of the diagonal. d is zero in the others, whose `out` stays; `run` is as in accelerate().
template <class T>
concept HasForcesOfSome =
    HasTangentOperator<T> &&
    requires(typename T::Assembly const& assembly, std::span<int const> some, typename T::Scalar const* in, typename T::Scalar* out,
             Vector3<typename T::Scalar> const& gravity, std::span<ColumnForce<typename T::Scalar> const> pushes, typename T::Scalar factor) {
      assembly.accelerate_some(some, in, in, gravity, pushes, out, detail::EachBlock{});
      assembly.multiply_some(some, factor, factor, factor, in, out, detail::EachBlock{});
      assembly.diagonal_of_some(some, factor, factor, factor, out);
    };

/// Refinement: remembers: remember(x, h) after a step of h seconds that ended at x, forget() as the body is reset; then its Assembly takes what is
/// remembered. All of it belongs to what a copy of the tissue copies.
template <class T>
concept HasHistory = HasSubsetForces<T> && requires(T& tissue, typename T::Assembly& assembly, Matrix3X<typename T::Scalar> const& x, typename T::Scalar h) {
  tissue.remember(x, h);
  tissue.forget();
  assembly.take_history(tissue);
};

namespace detail {

/// The lowest J = det F of some elements, and whose it is.
template <class Scalar>
struct LowestDeterminant {
  int element = -1;
  Scalar value = std::numeric_limits<Scalar>::infinity();
};
template <class L, class Scalar>
concept IsLowestDeterminant = requires(L const& lowest) {
  { lowest.element } -> std::convertible_to<int>;
  { lowest.value } -> std::convertible_to<Scalar>;
};
template <class Assembly, class Scalar>
concept LooksAtAll = requires(Assembly const& assembly, Scalar const* x) {
  { assembly.lowest_determinant(x) } -> IsLowestDeterminant<Scalar>;
};
template <class Assembly, class Scalar>
concept LooksAtParts = requires(Assembly const& assembly, Scalar const* x) {
  { assembly.lowest_determinant(x, 0, 1) } -> IsLowestDeterminant<Scalar>;
};

}  // namespace detail

/// Refinement: says at positions x which of its elements is nearest to being turned over, and its J = det F, as members
/// `element` and `value`; so does its Assembly, of those that act: lowest_determinant(x), x as in multiply_tangent(). One
/// that has lowest_determinant(x, part, parts) is asked by explicit steps for one of so many parts at a time, another for
/// all in one step of so many.
template <class T>
concept HasLowestDeterminant =
    HasSubsetForces<T> &&
    (detail::LooksAtAll<typename T::Assembly, typename T::Scalar> ||
     detail::LooksAtParts<typename T::Assembly, typename T::Scalar>) &&
    requires(T const& tissue, Matrix3X<typename T::Scalar> const& x) {
      { tissue.lowest_determinant(x) } -> detail::IsLowestDeterminant<typename T::Scalar>;
    };

/// Refinement: states the energy stored in its elements at given positions [J]; they are padded columns or a matrix.
template <class T>
concept HasPotentialEnergy =
    requires(T const& tissue, Matrix3X<typename T::Scalar> const& x, detail::ConstBodyColumns<typename T::Scalar> const& padded_x) {
      { tissue.potential_energy(x) } -> std::convertible_to<typename T::Scalar>;
      { tissue.potential_energy(padded_x) } -> std::convertible_to<typename T::Scalar>;
    };

/// Refinement: lets its surface be cut: particles are inserted and split, triangles subdivided, and mass and springs follow.
///   cuttable()       whether this one can be; one built from a volume, say, can not. One that is a CuttableSolid as well is a solid then.
///   triangle_area(t) of triangle t, undeformed [m²]
///   next_copy(i)     particles that cuts made of one, at one place undeformed, form a ring: the one after i, or i where there is no other
template <class T>
concept CuttableTissue = TissueModel<T> && requires(T& tissue, T const& seen, int i, Vector3<typename T::Scalar> const& barycentric,
                                                    typename T::Scalar s, std::span<int const> triangles) {
  { seen.cuttable() } -> std::same_as<bool>;
  { seen.next_copy(i) } -> std::same_as<int>;
  { seen.triangle_area(i) } -> std::convertible_to<typename T::Scalar>;
  { tissue.insert_in_triangle(i, barycentric) } -> std::same_as<int>;
  { tissue.insert_on_edge(i, i, s) } -> std::same_as<int>;
  { tissue.split_particle(i, triangles) } -> std::same_as<int>;
  tissue.merge_last_particle(i);
  tissue.change_corner(i, i, i);
  tissue.balance_copies(i, i);
};

/// Refinement: a tissue that tells of each triangle of its surface whether it is the wall of a wound.
template <class T>
concept TellsWounds = requires(T const& seen, int i) { { seen.is_wound(i) } -> std::same_as<bool>; };

/// Refinement: a solid whose tetrahedra are divided and parted; see FiniteElements and CutSolid. finish_edits() follows the edits of a tick.
///   topology()                   a TetrahedralAdjacency
///   for_each_joined(i, visit)    the particles that an edge joins to i, after each edit
///   is_wound(triangle), is_cut(tetrahedron, face)
template <class T>
concept CuttableSolid = TissueModel<T> && TellsWounds<T> && requires(T& tissue, T const& seen, int i, typename T::Scalar s, std::span<int const> tetrahedra) {
  seen.topology();
  seen.for_each_joined(i, [](int) {});
  { seen.is_cut(i, i) } -> std::same_as<bool>;
  tissue.divide_edge(i, i, s).vertex;
  tissue.split_vertex(i, tetrahedra).vertex;
  tissue.mark_cut(i, i);
  tissue.finish_edits();
};

/// Refinement: tetrahedra can be taken away, see FiniteElements::remove_tetrahedron.
template <class T>
concept RemovableSolid = CuttableSolid<T> && requires(T& tissue, int i) { tissue.remove_tetrahedron(i).last; };

/// Refinement: evens out the masses around a particle that a cut has left too light; see MassSpring::even_mass.
template <class T>
concept EvensMass = TissueModel<T> && requires(T& tissue, int i) { tissue.even_mass(i, [](int, int, typename T::Scalar) {}); };

/// Refinement: says besides where there is too little to divide an edge or a triangle; see MassSpring::has_mass_to_divide.
template <class T>
concept RedistributesMass = CuttableTissue<T> && EvensMass<T> && requires(T const& seen, int i, typename T::Scalar s, Vector3<typename T::Scalar> const& barycentric) {
  { seen.has_mass_to_divide(i, i, s) } -> std::same_as<bool>;
  { seen.has_mass_to_divide(i, barycentric) } -> std::same_as<bool>;
};

/// Refinement: makes tissue of one or more of its pieces alone: their particles, in the order given, with all that hangs on them.
template <class T>
concept DivisibleTissue = TissueModel<T> && requires(T const& tissue, std::span<int const> particles) {
  { tissue.part(particles) } -> std::same_as<T>;
};

/// Refinement: lets a particle rest at another place of its surface: what hangs on it follows, its mass stays with it.
template <class T>
concept SeparableTissue = CuttableTissue<T> && requires(T& tissue, int i, Vector3<typename T::Scalar> const& rest) { tissue.move_rest(i, rest); };

}  // namespace palpate
