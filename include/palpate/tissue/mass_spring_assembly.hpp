// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/tissue/mass_spring_options.hpp>

#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace palpate {

/// The springs that act on a chosen set of particles, renumbered so that the force loop walks memory in order.
/// Particles 0 … moving−1 are the chosen ones; after them comes the border: particles that only hold an end of a spring.
/// Each link is stored once, with its lower end; a link between two border particles is left out.
///   f_i −= (w/|d|²) (T(|d| − L) |d| + c d·(v_i − v_j)) d,   d = x_i − x_j; the same with + on j
/// Shapes     positions, velocities, forces: 3 × particles().size(), one column per local particle.
/// Cost       O(links), no allocation, noexcept. Root and division do not wait for each other: that is why d is not normalised.
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
    LocalLink const* link = links_.data();
    for (int i = 0; i < moving_; ++i) {
      Anchor const& anchor = anchors_[static_cast<std::size_t>(i)];
      Vector3<Scalar> const xi = x.col(i);
      Vector3<Scalar> const vi = v.col(i);
      Vector3<Scalar> sum = -anchor.home.stiffness * (xi - anchor.rest) - anchor.home.damping * vi;
      for (LocalLink const* const end = links_.data() + anchor.end; link != end; ++link) {
        int const j = link->other;
        Vector3<Scalar> const d = xi - x.col(j);
        Scalar const squared_length = d.squaredNorm();
        if (!(squared_length > std::numeric_limits<Scalar>::min())) continue;
        Scalar const length = std::sqrt(squared_length);
        Scalar const elastic = static_cast<Scalar>(link->law.tension(length - link->rest_length, link->rest_length)) * length;
        Scalar const viscous = static_cast<Scalar>(link->law.damping) * d.dot(vi - v.col(j));
        Vector3<Scalar> const pull = link->weight / squared_length * (elastic + viscous) * d;
        sum -= pull;
        f.col(j) += pull;
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

    links_.clear(), anchors_.clear();
    for (int i = 0; i < moving_; ++i) {
      int const p = moving[static_cast<std::size_t>(i)];
      for (int const l : tissue.links().at(p)) {
        auto const& link = tissue.links()[l];
        int const q = link.a == p ? link.b : link.a;
        int& j = local_[static_cast<std::size_t>(q)];
        if (j < 0) {
          j = static_cast<int>(particles_.size());
          particles_.push_back(q);
        }
        if (j > i) links_.push_back({j, link.rest_length, link.weight, link.law});   // stored with its lower end
      }
      anchors_.push_back({tissue.rest_position(p), tissue.home(p), links_.size()});
    }
  }

  void reserve(int particles, int links) {
    auto const n = static_cast<std::size_t>(particles);
    particles_.reserve(n), local_.reserve(n), anchors_.reserve(n);
    links_.reserve(static_cast<std::size_t>(links));
  }

 private:
  /// What a link needs in the force loop, side by side in memory.
  struct LocalLink {
    int other;   // the upper end
    Scalar rest_length;
    Scalar weight;
    Law law;
  };
  struct Anchor {
    Vector3<Scalar> rest;
    HomeSpring<Scalar> home;
    std::size_t end;   // of the particle's links
  };

  int moving_ = 0;
  std::vector<int> particles_;
  std::vector<int> local_;   // particle of the body → local particle, −1 outside
  std::vector<LocalLink> links_;
  std::vector<Anchor> anchors_;
};

}  // namespace palpate
