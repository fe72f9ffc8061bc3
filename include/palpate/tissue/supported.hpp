// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/simd.hpp>
#include <palpate/tissue/column_force.hpp>
#include <palpate/tissue/concept.hpp>
#include <palpate/tissue/element_assembly.hpp>
#include <palpate/tissue/element_sums.hpp>
#include <palpate/tissue/linear_spring.hpp>
#include <palpate/tissue/mass_spring_options.hpp>
#include <palpate/tissue/spring_elements.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>

namespace palpate {

/// Tissue whose surface particles also stand on support springs to the body's centre: they resist the radial displacements that change
/// its volume, as what fills the body would, without particles inside.
///   a SupportSpring for each:  d_i = x_i − C,  L_i = |X_i − C|,  w_i = m_i/m̄,  m̄ the mean mass of a surface particle
///
///   Supported tissue(MassSpring<double>(mesh, {...}), LinearSpring<double>{.stiffness = 20.0, .damping = 0.1});
///
/// The springs are weighed by mass, which a cut conserves: they need no state of their own, and pieces of the surface together carry what
/// the whole did. links() stay the edges of the mesh.
/// Units      the law's; its stiffness is that of a surface particle of mean mass [N/m]. C [m], world frame.
/// Source     \cite vassilev2002. Ours: C stays where it is, the centre of mass at rest unless one is given, so that a zone of influence stays
///            local and no force acts on far particles. Like home springs they tie the body to the world; turning about C they allow.
/// Cost       one root and two divisions a moving surface particle; nothing for others. noexcept, no allocation. What the tissue can do besides, it can
///            still: fused steps, blocks at once, tangent, cuts.
/// Invariant  L_i > 0 for every surface particle. set_mass changes a particle's support in proportion.
/// Limits     they lessen a change of volume, they do not forbid it. In a solid, mass that a cut moves inside from the skin takes its supports along. There is no part().
///            Radial means outward only where the surface is star-shaped about C.
template <TissueModel Tissue, SpringLaw<typename Tissue::Scalar> Law = LinearSpring<typename Tissue::Scalar>>
class Supported : public Tissue {
 public:
  using Scalar = typename Tissue::Scalar;
  using Vector = Vector3<Scalar>;

  class Assembly;

  /// Supports to the centre of mass at rest. Throws InvalidArgument when a surface particle lies there, or for a law that is none.
  Supported(Tissue tissue, Law law) : Tissue(std::move(tissue)), law_(std::move(law)) {
    Scalar mass = 0;
    centre_.setZero();
    for (int i = 0; i < this->size(); ++i) {
      centre_ += this->mass(i) * this->rest_position(i);
      mass += this->mass(i);
    }
    centre_ /= mass;
    start();
  }
  Supported(Tissue tissue, Law law, Vector const& centre) : Tissue(std::move(tissue)), law_(std::move(law)), centre_(centre) {
    if (!is_finite(centre_)) throw InvalidArgument("the centre of the support springs is not finite");
    start();
  }

  Vector centre() const noexcept { return centre_; }
  Law const& support() const noexcept { return law_; }

  /// What a particle's support spring is multiplied with: m_i/m̄ on the surface, 0 inside.
  Scalar support_weight(int i) const noexcept { return is_on_surface(i) ? this->mass(i) / mean_mass_ : Scalar(0); }
  Scalar support_length(int i) const noexcept { return (this->rest_position(i) - centre_).norm(); }   // L_i [m]

  void assemble(std::span<int const> moving, Assembly& assembly) const { assembly.build(*this, moving); }
  void follow_edits(std::span<int const> moving, Assembly& assembly) const
    requires FollowsEdits<Tissue>
  {
    assembly.follow(*this, moving);
  }

  // The tissue's own, and those of the supports.
  template <class X, class V>
  Vector internal_force(int i, X const& x, V const& v) const noexcept {
    return Tissue::internal_force(i, x, v) + supports().internal_force(i, x, v);
  }
  template <class X>
    requires HasPotentialEnergy<Tissue>
  Scalar potential_energy(X const& x) const {
    return Tissue::potential_energy(x) + supports().potential_energy(x);
  }
  template <class X, class D, class Y>
    requires HasStiffnessProduct<Tissue>
  void add_stiffness_product(X const& x, D const& d, Y& y) const noexcept {
    Tissue::add_stiffness_product(x, d, y), supports().add_stiffness_product(x, d, y);
  }
  template <class X, class Visit>
    requires HasStiffnessBlocks<Tissue>
  void for_each_stiffness_block(X const& x, Visit visit) const {
    Tissue::for_each_stiffness_block(x, visit), supports().for_each_stiffness_block(x, visit);
  }
  template <class X, class D, class Y>
    requires HasStiffnessProduct<Tissue>
  void add_damping_product(X const& x, D const& v, Y& y) const noexcept {
    Tissue::add_damping_product(x, v, y), supports().add_damping_product(x, v, y);
  }
  Scalar stiffness_bound(int i) const noexcept { return Tissue::stiffness_bound(i) + supports().stiffness_bound(i); }
  template <class X>
    requires HasStiffnessRowBoundsAt<Tissue>
  Scalar stiffness_bound(int i, X const& x) const {   // which may allocate
    return Tissue::stiffness_bound(i, x) + supports().stiffness_bound(i, x);
  }
  Scalar damping_bound(int i) const noexcept { return Tissue::damping_bound(i) + supports().damping_bound(i); }
  template <class X>
    requires HasDampingBoundAt<Tissue>
  Scalar damping_bound(int i, X const& x) const {
    return Tissue::damping_bound(i, x) + supports().damping_bound(i, x);
  }

 private:
  /// The support springs as elements.
  class Supports : public ElementSums<Supports, Scalar> {
   public:
    explicit Supports(Supported const& tissue) noexcept : tissue_(tissue) {}
    int size() const noexcept { return tissue_.size(); }
    Scalar mass(int i) const noexcept { return tissue_.mass(i); }
    Vector rest_position(int i) const noexcept { return tissue_.rest_position(i); }
    template <class Visit>
    void for_each_element_at(int i, Visit visit) const {
      if (Scalar const weight = tissue_.support_weight(i); weight > 0)
        visit(std::array{i}, SupportSpring<Scalar, Law>{tissue_.support_length(i), weight, tissue_.law_, tissue_.centre_});
    }
    template <class Visit>
    void for_each_element(Visit visit) const {
      for (int i = 0; i < size(); ++i) for_each_element_at(i, visit);
    }

   private:
    Supported const& tissue_;
  };
  Supports supports() const noexcept { return Supports(*this); }

  bool is_on_surface(int i) const noexcept {
    auto const around = this->surface().triangles_at(i);
    if constexpr (CuttableSolid<Tissue>)   // what was inside before a cut has no support
      return std::any_of(around.begin(), around.end(), [this](int t) { return !this->is_wound(t); });
    else
      return !around.empty();
  }

  void start() {
    Scalar mass = 0, longest = 0;
    int on_surface = 0;
    for (int i = 0; i < this->size(); ++i) longest = std::max(longest, support_length(i));
    for (int i = 0; i < this->size(); ++i) {
      if (!is_on_surface(i)) continue;
      if (!(support_length(i) > Scalar(1e-6) * longest))
        throw InvalidArgument(detail::message("particle ", i, " rests at the centre of the support springs; give a centre inside the body"));
      detail::require_valid_law(law_, support_length(i));
      mass += this->mass(i);
      ++on_surface;
    }
    mean_mass_ = mass / static_cast<Scalar>(std::max(1, on_surface));
  }

  Law law_;
  Vector centre_;
  Scalar mean_mass_ = 1;   // kg
};

/// The tissue's own assembly, with the support springs of the moving particles beside it.
template <TissueModel Tissue, SpringLaw<typename Tissue::Scalar> Law>
class Supported<Tissue, Law>::Assembly : public Tissue::Assembly {
  using Inner = typename Tissue::Assembly;

 public:
  template <class X, class V, class F>
  void add_forces(X const& x, V const& v, F& f) const {
    Inner::add_forces(x, v, f), supports_.add_forces(x, v, f);
  }

  /// The tissue's own step, see HasFusedForces; the supports come in before `after`.
  template <class Run, std::size_t Count, class Before, class AfterOf>
    requires HasFusedForces<Tissue>
  void accelerate(Scalar const* x, Scalar const* v, Vector const& gravity, std::span<ColumnForce<Scalar> const> pushes, Scalar* force, Run const& run,
                  std::array<Scalar const*, Count> const& columns, Before const& before, AfterOf const& after_of) const {
    Inner::accelerate(x, v, gravity, pushes, force, run, columns, before, [&](int block) {
      return [x, v, &supports = supports_, after = after_of(block)]<class Columns>(int i, Columns const& tissue_alone) {
        std::array<Scalar, sizeof(Columns) / sizeof(Scalar)> a;
        simd::store(a.data(), tissue_alone);
        for (std::size_t k = 0; k < a.size(); k += 4) supports.add_acceleration(i + static_cast<int>(k / 4), x, v, a.data() + k);
        Columns accelerations;
        simd::load(accelerations, a.data());
        after(i, accelerations);
      };
    });
  }

  /// The tissue's own tangent and that of the supports; see HasTangentOperator.
  template <class X>
    requires HasTangentOperator<Tissue>
  void linearise(X const& x, Scalar const* inverse_mass) {
    Inner::linearise(x, inverse_mass), supports_.linearise(x, inverse_mass);
  }
  void multiply_tangent(Scalar mass, Scalar damping, Scalar stiffness, Scalar const* d, Scalar* out) const noexcept
    requires HasTangentOperator<Tissue>
  {
    Inner::multiply_tangent(mass, damping, stiffness, d, out), supports_.add_tangent_product(damping, stiffness, d, out);
  }
  void tangent_diagonal(Scalar mass, Scalar damping, Scalar stiffness, Scalar* out) const noexcept
    requires HasTangentOperator<Tissue>
  {
    Inner::tangent_diagonal(mass, damping, stiffness, out), supports_.add_tangent_diagonal(damping, stiffness, out);
  }

  /// The tissue's own energy and that of the supports; see HasAssemblyEnergy.
  Scalar energy(Scalar const* x) const noexcept
    requires HasAssemblyEnergy<Tissue>
  {
    return Inner::energy(x) + supports_.energy(x);
  }
  Scalar energy_rounding() const noexcept
    requires HasAssemblyEnergy<Tissue>
  {
    return Inner::energy_rounding() + energy_rounding_;
  }
  void accelerate_some() = delete;   // the tissue's own would leave the supports out: see HasForcesOfSome

  void build(Supported const& tissue, std::span<int const> moving) {
    static_cast<Tissue const&>(tissue).assemble(moving, static_cast<Inner&>(*this));
    support(tissue, moving);
  }
  void follow(Supported const& tissue, std::span<int const> moving)
    requires FollowsEdits<Tissue>
  {
    static_cast<Tissue const&>(tissue).follow_edits(moving, static_cast<Inner&>(*this));
    support(tissue, moving);
  }
  void reserve(Supported const& tissue, int particles, int triangles)
    requires ReservesMemory<Tissue>
  {
    Inner::reserve(static_cast<Tissue const&>(tissue), particles, triangles);
    supports_.reserve(particles, {static_cast<std::size_t>(particles)});
  }

 private:
  void support(Supported const& tissue, std::span<int const> moving) {
    supports_.build(tissue.supports(), moving);
    energy_rounding_ = 0;
    for (int const i : moving) energy_rounding_ += tissue.supports().stiffness_bound(i) * tissue.support_length(i) * tissue.support_length(i);
    energy_rounding_ *= 4 * std::numeric_limits<Scalar>::epsilon();
  }

  ElementAssembly<Scalar, SupportSpring<Scalar, Law>> supports_;
  Scalar energy_rounding_ = 0;   // J, of the supports
};

}  // namespace palpate
