// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/huge_page_vector.hpp>

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace palpate {

/// What has become of a body's particles and triangles since its host last forgot the changes: enough to patch a copy of them.
///
///   particles 0 … first_particle − 1                the same ones; they may have moved
///   particles first_particle … particle_count − 1   new, or others than before
///   triangles 0 … first_triangle − 1                as before, but for those listed in `triangles`: each once, ascending
///   triangles first_triangle … triangle_count − 1   new, or others than before
///
/// What the copy has beyond the counts is gone. A particle that is moved over the undeformed surface by a SeparatingCutter is no other one. What a blade
/// divides for the eye only is in body.temporary_subdivisions().
/// A triangle that was edited back to what it was is still listed. The list is good until the next edit, or until the changes are forgotten.
struct SurfaceChanges {
  int first_particle = 0, particle_count = 0;
  int first_triangle = 0, triangle_count = 0;
  std::span<int const> triangles;   // indices below first_triangle
};

namespace detail {

/// Which triangles were edited, and how low the counts were: what SurfaceChanges tells.
/// Invariant  a triangle is listed once, however often it is edited; so the list is never longer than the surface was.
/// Cost       edited() O(1), sorted() O(m log m) for m listed, forget() O(m). Below what was reserved nothing allocates.
class ChangeRecord {
 public:
  int first_particle() const noexcept { return first_particle_; }
  int first_triangle() const noexcept { return first_triangle_; }

  void edited(int t) {
    if (t >= first_triangle_) return;   // new anyway
    auto const k = static_cast<std::size_t>(t);
    if (k >= is_listed_.size()) is_listed_.resize(2 * k + 1);
    if (is_listed_[k] != 0) return;
    is_listed_[k] = 1;
    listed_.push_back(t);
  }
  void particles_fell_to(int count) noexcept { first_particle_ = std::min(first_particle_, count); }

  void triangles_fell_to(int count) noexcept { first_triangle_ = std::min(first_triangle_, count); }

  /// Those listed that are not new, ascending.
  std::span<int const> sorted() noexcept {
    std::sort(listed_.begin(), listed_.end());
    return {listed_.begin(), std::lower_bound(listed_.begin(), listed_.end(), first_triangle_)};
  }

  /// From now on, what changes in a surface of so many; with 0 and 0, everything is new.
  void forget(int particles, int triangles) noexcept {
    for (int const t : listed_) is_listed_[static_cast<std::size_t>(t)] = 0;
    listed_.clear();
    first_particle_ = particles;
    first_triangle_ = triangles;
  }

  void reserve(int triangles) {
    auto const count = static_cast<std::size_t>(triangles);
    listed_.reserve(count);
    if (is_listed_.size() < count) is_listed_.resize(count);
  }

 private:
  std::vector<int> listed_;
  HugePageVector<char> is_listed_;   // by triangle
  int first_particle_ = 0, first_triangle_ = 0;
};

}  // namespace detail

}  // namespace palpate
