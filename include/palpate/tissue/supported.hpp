// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/tissue/concept.hpp>
#include <palpate/tissue/linear_spring.hpp>
#include <palpate/tissue/mass_spring_options.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace palpate {

/// Tissue whose surface particles also stand on support springs to the body's centre: they resist the radial displacements that change
/// its volume, as what fills the body would, without particles inside.
///   f_i −= (m_i/m̄) (T(|d_i| − R_i) + c d_i·v_i/|d_i|) d_i/|d_i|,   d_i = x_i − C,  R_i = |X_i − C|,  m̄ the mean mass of a surface particle
///
///   Supported tissue(MassSpring<double>(mesh, {...}), LinearSpring<double>{.stiffness = 20.0, .damping = 0.1});
///
/// The springs are weighed by mass, which a cut conserves: they need no state of their own, and pieces of the surface together carry what
/// the whole did. links() stay the edges of the mesh.
/// Units      the law's; its stiffness is that of a surface particle of mean mass [N/m]. C [m], world frame.
/// Source     \cite vassilev2002. Ours: C stays where it is, the centre of mass at rest unless one is given, so that a zone of influence stays
///            local and no force acts on far particles. Like home springs they tie the body to the world; turning about C they allow.
/// Cost       one root and one division a moving surface particle; nothing for others. noexcept, no allocation.
/// Invariant  R_i > 0 for every surface particle. set_mass changes a particle's support in proportion.
/// Limits     they lessen a change of volume, they do not forbid it. Radial means outward only where the surface is star-shaped about C.
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
    if (!centre_.allFinite()) throw InvalidArgument("the centre of the support springs is not finite");
    start();
  }

  Vector centre() const noexcept { return centre_; }
  Law const& support() const noexcept { return law_; }

  /// What a particle's support spring is multiplied with: m_i/m̄ on the surface, 0 inside.
  Scalar support_weight(int i) const noexcept { return is_on_surface(i) ? this->mass(i) / mean_mass_ : Scalar(0); }
  Scalar support_length(int i) const noexcept { return (this->rest_position(i) - centre_).norm(); }   // R_i [m]

  void assemble(std::span<int const> moving, Assembly& assembly) const { assembly.build(*this, moving); }

  template <class X, class V>
  Vector internal_force(int i, X const& x, V const& v) const noexcept {
    return Tissue::internal_force(i, x, v) - pull(law_, support_weight(i), support_length(i), Vector(x.col(i) - centre_), Vector(v.col(i)));
  }

  template <class X>
  Scalar potential_energy(X const& x) const
    requires HasPotentialEnergy<Tissue>
  {
    Scalar energy = Tissue::potential_energy(x);
    for (int i = 0; i < this->size(); ++i) {
      Scalar const length = support_length(i);
      energy += support_weight(i) * energy_of(law_, (x.col(i) - centre_).norm() - length, length);
    }
    return energy;
  }

  /// y += K dx [N], positive semidefinite as the tissue's own.
  template <class X, class D, class Y>
  void add_stiffness_product(X const& x, D const& dx, Y& y) const noexcept
    requires HasStiffnessProduct<Tissue>
  {
    Tissue::add_stiffness_product(x, dx, y);
    for (int i = 0; i < this->size(); ++i) {
      Vector const d = x.col(i) - centre_;
      Scalar const length = d.norm(), weight = support_weight(i), rest_length = support_length(i);
      if (!(length > 0) || !(weight > 0)) continue;
      Scalar const along = weight * tangent_stiffness_of(law_, length - rest_length, rest_length);
      Scalar const across = weight * std::max(Scalar(0), static_cast<Scalar>(law_.tension(length - rest_length, rest_length))) / length;
      y.col(i) += across * dx.col(i) + (along - across) / (length * length) * d.dot(dx.col(i)) * d;
    }
  }
  template <class X, class D, class Y>
  void add_damping_product(X const& x, D const& dv, Y& y) const noexcept
    requires HasStiffnessProduct<Tissue>
  {
    Tissue::add_damping_product(x, dv, y);
    for (int i = 0; i < this->size(); ++i) {
      Vector const d = x.col(i) - centre_;
      if (!(d.squaredNorm() > 0)) continue;
      y.col(i) += support_weight(i) * static_cast<Scalar>(law_.damping) / d.squaredNorm() * d.dot(dv.col(i)) * d;
    }
  }

  Scalar stiffness_bound(int i) const noexcept {
    return Tissue::stiffness_bound(i) + support_weight(i) * tangent_stiffness_of(law_, Scalar(0), support_length(i));
  }
  /// The same at positions x.
  template <class X>
    requires HasStiffnessRowBoundsAt<Tissue>
  Scalar stiffness_bound(int i, X const& x) const noexcept {
    Scalar const length = (x.col(i) - centre_).norm(), rest_length = support_length(i), elongation = length - rest_length;
    Scalar const along = std::abs(tangent_stiffness_of(law_, elongation, rest_length));
    Scalar const across = length > 0 ? std::abs(static_cast<Scalar>(law_.tension(elongation, rest_length))) / length : Scalar(0);
    return Tissue::stiffness_bound(i, x) + support_weight(i) * std::max(along, across);
  }
  Scalar damping_bound(int i) const noexcept {
    return Tissue::damping_bound(i) + support_weight(i) * static_cast<Scalar>(law_.damping);
  }

 private:
  /// (w/|d|²) (T |d| + c d·v) d; none at the centre, where it has no direction.
  static Vector pull(Law const& law, Scalar weight, Scalar rest_length, Vector const& d, Vector const& v) noexcept {
    Scalar const squared_length = d.squaredNorm();
    if (!(squared_length > std::numeric_limits<Scalar>::min())) return Vector::Zero();
    Scalar const length = std::sqrt(squared_length);
    Scalar const elastic = static_cast<Scalar>(law.tension(length - rest_length, rest_length)) * length;
    return weight / squared_length * (elastic + static_cast<Scalar>(law.damping) * d.dot(v)) * d;
  }

  bool is_on_surface(int i) const noexcept { return !this->surface().triangles_at(i).empty(); }

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

/// The tissue's own assembly, and the support springs of the moving particles after it.
template <TissueModel Tissue, SpringLaw<typename Tissue::Scalar> Law>
class Supported<Tissue, Law>::Assembly {
 public:
  std::span<int const> particles() const noexcept { return inner_.particles(); }

  template <class X, class V, class F>
  void add_forces(X const& x, V const& v, F& f) const noexcept(noexcept(inner_.add_forces(x, v, f))) {
    inner_.add_forces(x, v, f);
    for (Support const& s : supports_)
      f.col(s.particle) -= pull(law_, s.weight, s.rest_length, Vector(x.col(s.particle) - centre_), Vector(v.col(s.particle)));
  }

  void build(Supported const& tissue, std::span<int const> moving) {
    static_cast<Tissue const&>(tissue).assemble(moving, inner_);
    law_ = tissue.law_;
    centre_ = tissue.centre_;
    supports_.clear();
    for (std::size_t k = 0; k < moving.size(); ++k) {
      Scalar const weight = tissue.support_weight(moving[k]);
      if (weight > 0) supports_.push_back(Support{.particle = static_cast<int>(k), .weight = weight, .rest_length = tissue.support_length(moving[k])});
    }
  }

  void reserve(Supported const& tissue, int particles, int triangles)
    requires ReservesMemory<Tissue>
  {
    inner_.reserve(static_cast<Tissue const&>(tissue), particles, triangles);
    supports_.reserve(static_cast<std::size_t>(particles));
  }

  /// The tissue's own tangent and that of the supports; see HasTangentOperator.
  template <class X>
  void linearise(X const& x, Scalar const* inverse_mass)
    requires HasTangentOperator<Tissue> && StatesStiffness<Law, Scalar>
  {
    inner_.linearise(x, inverse_mass);
    for (Support& s : supports_) {
      s.direction = x.col(s.particle).template head<3>() - centre_;
      Scalar const length = s.direction.norm(), elongation = length - s.rest_length;
      s.along = s.across = s.damping = 0;
      if (!(length > 0)) continue;
      s.direction /= length;
      s.across = s.weight * std::max(Scalar(0), static_cast<Scalar>(law_.tension(elongation, s.rest_length))) / length;
      s.along = s.weight * std::max(Scalar(0), static_cast<Scalar>(law_.tangent_stiffness(elongation, s.rest_length)));
      s.damping = s.weight * static_cast<Scalar>(law_.damping);
    }
  }
  void multiply_tangent(Scalar mass, Scalar damping, Scalar stiffness, Scalar const* d, Scalar* out) const noexcept
    requires HasTangentOperator<Tissue> && StatesStiffness<Law, Scalar>
  {
    inner_.multiply_tangent(mass, damping, stiffness, d, out);
    for (Support const& s : supports_) {
      Eigen::Map<Vector const> const w(d + 4 * static_cast<std::ptrdiff_t>(s.particle));
      Scalar const across = stiffness * s.across, along = stiffness * s.along + damping * s.damping;
      Eigen::Map<Vector>(out + 4 * static_cast<std::ptrdiff_t>(s.particle)) += across * w + (along - across) * s.direction.dot(w) * s.direction;
    }
  }
  void tangent_diagonal(Scalar mass, Scalar damping, Scalar stiffness, Scalar* out) const noexcept
    requires HasTangentOperator<Tissue> && StatesStiffness<Law, Scalar>
  {
    inner_.tangent_diagonal(mass, damping, stiffness, out);
    for (Support const& s : supports_) {
      Scalar const across = stiffness * s.across, along = stiffness * s.along + damping * s.damping;
      Eigen::Map<Vector>(out + 4 * static_cast<std::ptrdiff_t>(s.particle)) +=
          Vector::Constant(across) + (along - across) * s.direction.cwiseAbs2();
    }
  }

 private:
  struct Support {
    int particle;
    Scalar weight;
    Scalar rest_length;
    Scalar across = 0, along = 0, damping = 0;   // N/m, N/m, N·s/m: since linearise()
    Vector direction = Vector::Zero();
  };
  typename Tissue::Assembly inner_;
  Law law_{};
  Vector centre_ = Vector::Zero();
  std::vector<Support> supports_;
};

}  // namespace palpate
