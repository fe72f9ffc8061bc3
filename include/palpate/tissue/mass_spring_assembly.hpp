// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/tissue/mass_spring_options.hpp>

#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace palpate {

/// The springs that act on a chosen set of particles, renumbered so that the force loop walks memory in order.
/// Particles 0 … moving−1 are the chosen ones; after them comes the border: particles that only hold an end of a spring.
/// Each link is stored once, with its lower end; a link between two border particles is left out.
/// Shapes     positions, velocities, forces: 3 × particles().size(), one column per local particle.
/// Cost       O(links), no allocation, noexcept.
/// Limits     a link of length 0 has no direction: it gives no force.
template <RealScalar Scalar, SpringLaw<Scalar> Law>
class MassSpringAssembly {
 public:
  /// Local particle → particle of the body.
  std::span<int const> particles() const noexcept { return particles_; }
  int moving() const noexcept { return moving_; }

  /// f += internal forces at (x, v) in the first `moving()` columns; the border's columns are overwritten with partial sums.
  template <class X, class V, class F>
  void add_forces(X const& x, V const& v, F& f) const noexcept {
    for (int i = 0; i < moving_; ++i) {
      auto const u = static_cast<std::size_t>(i);
      Vector3<Scalar> const xi = x.col(i);
      Vector3<Scalar> const vi = v.col(i);
      Vector3<Scalar> sum = -home_[u].stiffness * (xi - rest_[u]) - home_[u].damping * vi;
      for (std::size_t l = first_[u]; l < first_[u + 1]; ++l) {
        int const j = other_[l];
        Vector3<Scalar> const d = xi - x.col(j);
        Scalar const length = d.norm();
        if (!(length > 0)) continue;
        Vector3<Scalar> const n = d / length;
        Scalar const closing = n.dot(vi - v.col(j));
        Scalar const tension = weight_[l] * static_cast<Scalar>(law_[l].tension(length - rest_length_[l], rest_length_[l]) +
                                                               law_[l].damping * closing);
        sum -= tension * n;
        f.col(j) += tension * n;
      }
      f.col(i) += sum;
    }
  }

  /// Gathers the springs of `tissue` that pull on the particles in `moving`. Allocates only when the set outgrows earlier ones.
  template <class Tissue>
  void build(Tissue const& tissue, std::span<int const> moving) {
    for (int const p : particles_)
      if (static_cast<std::size_t>(p) < local_.size()) local_[static_cast<std::size_t>(p)] = -1;
    local_.resize(static_cast<std::size_t>(tissue.size()), -1);
    particles_.assign(moving.begin(), moving.end());
    moving_ = static_cast<int>(moving.size());
    for (int i = 0; i < moving_; ++i) local_[static_cast<std::size_t>(moving[static_cast<std::size_t>(i)])] = i;

    first_.clear(), other_.clear(), rest_length_.clear(), weight_.clear(), law_.clear(), home_.clear(), rest_.clear();
    for (int i = 0; i < moving_; ++i) {
      int const p = moving[static_cast<std::size_t>(i)];
      first_.push_back(other_.size());
      home_.push_back(tissue.home(p));
      rest_.push_back(tissue.rest_position(p));
      for (int const l : tissue.links().at(p)) {
        auto const& link = tissue.links()[l];
        int const q = link.a == p ? link.b : link.a;
        int& j = local_[static_cast<std::size_t>(q)];
        if (j < 0) {
          j = static_cast<int>(particles_.size());
          particles_.push_back(q);
        }
        if (j < i) continue;   // stored with its lower end
        other_.push_back(j);
        rest_length_.push_back(link.rest_length);
        weight_.push_back(link.weight);
        law_.push_back(link.law);
      }
    }
    first_.push_back(other_.size());
  }

  void reserve(int particles, int links) {
    auto const n = static_cast<std::size_t>(particles);
    auto const m = static_cast<std::size_t>(links);
    particles_.reserve(n), local_.reserve(n), first_.reserve(n + 1), home_.reserve(n), rest_.reserve(n);
    other_.reserve(m), rest_length_.reserve(m), weight_.reserve(m), law_.reserve(m);
  }

 private:
  int moving_ = 0;
  std::vector<int> particles_;
  std::vector<int> local_;   // particle of the body → local particle, −1 outside
  std::vector<std::size_t> first_;
  std::vector<int> other_;
  std::vector<Scalar> rest_length_;
  std::vector<Scalar> weight_;
  std::vector<Law> law_;
  std::vector<HomeSpring<Scalar>> home_;
  std::vector<Vector3<Scalar>> rest_;
};

}  // namespace palpate
