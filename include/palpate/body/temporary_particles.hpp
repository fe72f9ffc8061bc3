// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>
#include <vector>

namespace palpate {

/// Barycentric weights of a point of a triangle, kept off its edges: off each by a share of the height over it, or by a distance [m] where that is
/// more, but by no more than a quarter of the height.
template <RealScalar Scalar>
Vector3<Scalar> off_edges(std::array<Vector3<Scalar>, 3> const& corners, Vector3<Scalar> const& w, Scalar share, Scalar distance) {
  Scalar const twice_area = (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm();
  Vector3<Scalar> least;
  for (std::size_t k = 0; k < 3; ++k) {
    Scalar const part = distance * (corners[(k + 2) % 3] - corners[(k + 1) % 3]).norm();   // of the area, as the height is
    least[static_cast<int>(k)] = part < twice_area / 4 ? std::max(share, part / twice_area) : Scalar(0.25);
  }
  Vector3<Scalar> const above = (w - least).cwiseMax(Scalar(0));
  return least + (1 - least.sum()) / above.sum() * above;
}

using TemporaryId = std::size_t;   // of a temporary particle: no other gets the same

/// A particle that divides a triangle for the eye only, while a blade is inside: it follows the corners of that triangle, without mass or springs.
template <RealScalar Scalar>
struct TemporaryParticle {
  TemporaryId id;
  int triangle;                        // the one divided
  int second;                          // the first of the two triangles added
  int particle;
  std::array<int, 4> parents;          // three corners, and the copy of one of them once it is split, or −1
  std::array<Scalar, 4> weights;
  int split_corner = -1;               // which of the three that is
  std::array<bool, 3> at_copy{};       // which of the three triangles are at the copy

  bool divides(int t) const noexcept { return t == triangle || t == second || t == second + 1; }
  bool follows(int p) const noexcept { return std::find(parents.begin(), parents.end(), p) != parents.end(); }

  /// By the three corners, as if none were split.
  Vector3<Scalar> whole_weights() const noexcept {
    Vector3<Scalar> w(weights[0], weights[1], weights[2]);
    if (split_corner >= 0) w[split_corner] += weights[3];
    return w;
  }
  void set_weights(Vector3<Scalar> const& w) noexcept {
    weights = {w[0], w[1], w[2], 0};
    share_split_corner();
  }

  /// Calls visit(particle, weight) for those it follows.
  template <class Visit>
  void for_each_parent(Visit visit) const {
    for (std::size_t k = 0; k < parents.size(); ++k)
      if (parents[k] >= 0) visit(parents[k], weights[k]);
  }

  /// One of its triangles went from one copy of a corner to another: its place is between both then.
  void change_corner(int t, int before, int now) noexcept {
    for (int k = 0; k < 3; ++k)
      if (parents[static_cast<std::size_t>(k)] == before && parents[3] < 0) {
        parents[3] = now;
        split_corner = k;
        share_split_corner();
      }
    if (parents[3] == now) at_copy[t == triangle ? 0 : static_cast<std::size_t>(t - second + 1)] = true;
  }

 private:
  void share_split_corner() noexcept {
    if (split_corner < 0) return;
    Scalar& weight = weights[static_cast<std::size_t>(split_corner)];
    weight = weights[3] = weight / 2;
  }
};

/// The temporary particles of a body in the order of their numbers, and what became of those that are not temporary any more.
template <RealScalar Scalar>
class TemporaryParticles {
 public:
  using Particle = TemporaryParticle<Scalar>;

  int count() const noexcept { return static_cast<int>(present_.size()); }
  bool empty() const noexcept { return present_.empty(); }
  auto begin() const noexcept { return present_.begin(); }
  auto end() const noexcept { return present_.end(); }
  Particle const& operator[](std::size_t k) const noexcept { return present_[k]; }

  /// Its place in the order, or null.
  Particle* find(TemporaryId id) noexcept {
    return find_if([&](Particle const& t) { return t.id == id; });
  }
  Particle const* find(TemporaryId id) const noexcept { return const_cast<TemporaryParticles*>(this)->find(id); }
  Particle const* in_triangle(int t) const noexcept {
    return const_cast<TemporaryParticles*>(this)->find_if([&](Particle const& temporary) { return temporary.divides(t); });
  }
  /// One in a triangle that had the edge a–b while it was whole: of a wound beside its blade, either lip.
  Particle const* at_edge(int a, int b) const noexcept {
    return const_cast<TemporaryParticles*>(this)->find_if([&](Particle const& temporary) { return temporary.follows(a) && temporary.follows(b); });
  }
  Particle const* following(int p) const noexcept {
    return const_cast<TemporaryParticles*>(this)->find_if([&](Particle const& temporary) { return temporary.follows(p); });
  }

  TemporaryId new_id() noexcept { return ++last_id_; }
  void add(Particle const& temporary) { present_.push_back(temporary); }
  void remove_last() noexcept { present_.pop_back(); }

  void change_corner(int t, int before, int now) noexcept {
    for (Particle& temporary : present_)
      if (temporary.divides(t)) temporary.change_corner(t, before, now);
  }

  // --- those that are away during an edit: they are put back in the same order -----------------------------------------
  /// Where those that are withdrawn next begin.
  std::size_t withdrawn_count() const noexcept { return withdrawn_.size(); }
  Particle const& withdrawn(std::size_t k) const noexcept { return withdrawn_[k]; }
  void remember_from(std::size_t k) { withdrawn_.insert(withdrawn_.end(), present_.begin() + static_cast<std::ptrdiff_t>(k), present_.end()); }
  void forget_withdrawn(std::size_t k) { withdrawn_.erase(withdrawn_.begin() + static_cast<std::ptrdiff_t>(k)); }
  void forget_withdrawn_from(std::size_t k) { withdrawn_.erase(withdrawn_.begin() + static_cast<std::ptrdiff_t>(k), withdrawn_.end()); }

  // --- those that have become particles that stay, until their blades know ---------------------------------------------
  void keep(TemporaryId id, int particle) { kept_.push_back({id, particle}); }
  /// The particle that the last one kept has become.
  int last_kept() const noexcept { return kept_.back().second; }
  /// The particle that a temporary one has become, or −1; told once.
  int take_kept(TemporaryId id) noexcept {
    auto const found = std::find_if(kept_.begin(), kept_.end(), [&](auto const& kept) { return kept.first == id; });
    if (found == kept_.end()) return -1;
    int const particle = found->second;
    kept_.erase(found);
    return particle;
  }

  /// None is there, none has been kept; ids go on.
  void clear() noexcept { present_.clear(), kept_.clear(); }
  void reserve(std::size_t count) { present_.reserve(count), withdrawn_.reserve(count), kept_.reserve(count); }

 private:
  template <class Condition>
  Particle* find_if(Condition const& condition) noexcept {
    auto const found = std::find_if(present_.begin(), present_.end(), condition);
    return found == present_.end() ? nullptr : &*found;
  }

  std::vector<Particle> present_;
  std::vector<Particle> withdrawn_;
  std::vector<std::pair<TemporaryId, int>> kept_;
  TemporaryId last_id_ = 0;
};

}  // namespace palpate
