// SPDX-License-Identifier: MIT
#pragma once

/// Tissue of one's own: all that it takes. The page to this header is docs/new_tissue.md.
///
/// Elements are the short way. Required, together the concept Element<E, Scalar>; x is NodeColumns<Scalar, nodes>, 3 × nodes [m]
///   static constexpr int nodes
///   Scalar energy(x) const                                 J
///   NodeColumns<Scalar, nodes> force(x) const              −∇energy [N]
///   NodeMatrix<Scalar, nodes> stiffness(x) const           −∂force/∂x, 3·nodes square [N/m]
/// Optional of an element: HasElementDamping, HasSemidefiniteStiffness, HasElementProducts, HasElementBounds, HasBlockNormsAtRest, HasElementMass;
/// their members are listed in tissue/element.hpp
///   ElementTissue tissue(mesh, {.total = 0.1}, make_elements(mesh.points, mesh.tetrahedra, make));   make(rest) returns an element
/// Battery of an element
///   testing::to_text(testing::check_element<double>(MyElement(corners, ...), corners)) == ""
///
/// Tissue that is no sum over elements. Required, together the concept TissueModel<T>; i is a particle
///   using Scalar                                           double or float; Tissue is copyable
///   int size() const                                       particles
///   Vector3<Scalar> rest_position(int i) const             m
///   Scalar mass(int i) const                               kg
///   bool nailed(int i) const
///   void for_each_neighbour(int i, Visit visit) const      visit(j) for all that share an element with i
///   std::size_t revision() const                           counts edits
///   SurfaceTopology const& surface() const                 what a tool touches
///   class Assembly                                         default constructible, with
///     std::span<int const> particles() const                 those in `moving`, then those that act on them
///     void add_forces(X const& x, V const& v, F& f) const    a template; adds to f.col(k) [N], 3 × particles(), at x [m], v [m/s]
///   void assemble(std::span<int const> moving, Assembly& assembly) const   each once, in any order
///   Vector3<Scalar> internal_force(int i, X const& x, V const& v) const   a template that asks x and v for col(j) and nothing else [N]
///   Scalar stiffness_bound(int i) const                    ≥ Σ_j ‖K_ij‖ at rest [N/m]
///   Scalar damping_bound(int i) const                      ≥ Σ_j ‖C_ij‖ [N·s/m]
/// Optional, their members in tissue/concept.hpp: HasPotentialEnergy, HasStiffnessRowBoundsAt, HasDampingBoundAt, HasStiffnessProduct, HasStiffnessBlocks,
/// HasTangentOperator (implicit integrators), HasAssemblyEnergy, HasFastTangent, HasFloatTangent, DampsByTangent, HasForcesOfSome, HasHistory, HasLowestDeterminant,
/// HasDefaultIntegrator, HasHomeSprings, HasLinks, HasPrestrain, ReservesMemory, HasFusedForces, FollowsEdits; CuttableTissue, TellsWounds,
/// CuttableSolid, RemovableSolid, SeparableTissue, EvensMass, RedistributesMass, DivisibleTissue
/// Battery
///   testing::to_text(testing::check_tissue(tissue)) == ""

#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/testing/element.hpp>
#include <palpate/testing/tissue.hpp>
#include <palpate/tissue/concept.hpp>
#include <palpate/tissue/element.hpp>
#include <palpate/tissue/element_tissue.hpp>

#include <cstddef>
#include <span>
#include <vector>

namespace palpate::testing {

/// The least element: one node on a spring of 10 N/m to where it rests.
template <RealScalar S>
struct ElementArchetype {
  static constexpr int nodes = 1;
  Vector3<S> rest;   // m
  S energy(Vector3<S> const& x) const { return 5 * (x - rest).squaredNorm(); }
  Vector3<S> force(Vector3<S> const& x) const { return -10 * (x - rest); }
  NodeMatrix<S, 1> stiffness(Vector3<S> const&) const { return 10 * NodeMatrix<S, 1>::Identity(); }
};

/// The least tissue: particles of 0.1 kg on springs of 10 N/m and 0.2 N·s/m to where they rest, joined by nothing but their neighbourhood, each
/// with the next; the first one is nailed.
template <RealScalar S>
class TissueArchetype {
 public:
  using Scalar = S;

  class Assembly {
   public:
    std::span<int const> particles() const { return particles_; }
    template <class X, class V, class F>
    void add_forces(X const& x, V const& v, F& f) const {
      for (std::size_t k = 0; k < particles_.size(); ++k) {
        auto const i = static_cast<Eigen::Index>(k);
        f.col(i) -= S(10) * (x.col(i) - rest_[k]) + S(0.2) * v.col(i);
      }
    }

   private:
    friend TissueArchetype;
    std::vector<int> particles_;
    std::vector<Vector3<S>> rest_;
  };

  explicit TissueArchetype(TriangleMesh<S> const& mesh) : points_(mesh.points), surface_(static_cast<int>(mesh.points.cols()), mesh.triangles) {}

  int size() const { return static_cast<int>(points_.cols()); }
  std::size_t revision() const { return 0; }
  Vector3<S> rest_position(int i) const { return points_.col(i); }
  S mass(int) const { return S(0.1); }
  bool nailed(int i) const { return i == 0; }
  template <class Visit>
  void for_each_neighbour(int i, Visit visit) const {
    if (i > 0) visit(i - 1);
    if (i + 1 < size()) visit(i + 1);
  }
  SurfaceTopology const& surface() const { return surface_; }
  void assemble(std::span<int const> moving, Assembly& assembly) const {
    assembly.particles_.assign(moving.begin(), moving.end());
    assembly.rest_.clear();
    for (int const i : moving) assembly.rest_.push_back(rest_position(i));
  }
  template <class X, class V>
  Vector3<S> internal_force(int i, X const& x, V const& v) const {
    return S(-10) * (x.col(i) - points_.col(i)) - S(0.2) * v.col(i);
  }
  S stiffness_bound(int) const { return 10; }
  S damping_bound(int) const { return S(0.2); }

 private:
  Matrix3X<S> points_;
  SurfaceTopology surface_;
};

}  // namespace palpate::testing
