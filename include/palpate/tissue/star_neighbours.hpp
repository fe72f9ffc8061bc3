// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/growing_lists.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/tissue/pressure_stars.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <iterator>
#include <span>
#include <utility>
#include <vector>

namespace palpate {

/// Which particles of a solid with nodal pressure are neighbours, those that share a star, and Σ_j ‖K_ij‖ of each at rest. What a tetrahedron and what a star
/// adds to it is kept: after an edit those are computed anew that have changed.
template <RealScalar Scalar>
class StarNeighbours {
 public:
  /// Memory for so many particles and tetrahedra, more than there are.
  void reserve(std::size_t particles, std::size_t elements) {
    std::size_t const more = particles - bounds_.size();   // stars too; with each the lists of those beside it outgrow their places
    near_.reserve(particles, near_.items() + 256 * more), parts_of_.reserve(star_seen_.size() + more, parts_of_.items() + 128 * more);
    rows_.reserve(elements), bounds_.reserve(particles), seen_.reserve(particles), place_.reserve(particles), star_seen_.reserve(star_seen_.size() + more);
    for (auto* some : {&moved_, &found_, &kept_, &merged_}) some->reserve(particles);
    parts_.reserve(particles), gradients_.reserve(particles);
  }
  /// In order, without i.
  std::span<int const> of(int i) const noexcept { return near_[i]; }
  Scalar stiffness_bound(int i) const noexcept { return bounds_[index(i)]; }   ///< N/m

  /// These tetrahedra have changed or are new, and these stars. nodes: of each tetrahedron; at(i): the tetrahedra at particle i, of so many. At rest:
  /// block_norms(e), ‖K‖ of two nodes each of a tetrahedron alone [N/m]; volume_gradient(e), V ∂J/∂x [m²].
  template <class At, class BlockNorms, class VolumeGradient>
  void follow(std::span<int const> edited, std::span<int const> changed, PressureStars<Scalar> const& stars, std::span<std::array<int, 4> const> nodes, int particles,
              At const& at, BlockNorms const& block_norms, VolumeGradient const& volume_gradient) {
    rows_.resize(nodes.size()), place_.resize(index(particles)), seen_.resize(index(particles), 0), star_seen_.resize(index(stars.size()), 0);
    for (int const e : edited) {
      Matrix<Scalar, 4, 4> const norms = block_norms(e);
      for (int k = 0; k < 4; ++k) rows_[index(e)][index(k)] = norms.col(k).sum();
    }
    std::vector<int>& moved = moved_;   // particles
    moved.clear();
    for (int const s : changed) {
      take_parts(s, stars, nodes, volume_gradient);
      for (Part const& part : parts_of_[s]) moved.push_back(part.node);
    }
    for (int i = near_.size(); i < particles; ++i) moved.push_back(i);
    std::sort(moved.begin(), moved.end());
    moved.erase(std::unique(moved.begin(), moved.end()), moved.end());
    bounds_.resize(index(particles));
    for (int const i : moved) take(i, stars, nodes, at(i));
  }

 private:
  /// What a star adds to the row of a node of it.
  struct Part {
    int node;
    Scalar bound;   // N/m
  };

  static std::size_t index(int i) noexcept { return static_cast<std::size_t>(i); }

  /// K of a star is w g gᵀ with g = V ∂J̄/∂x, w = κ/4V: its block of two nodes has the norm w |g_i| |g_j|.
  template <class VolumeGradient>
  void take_parts(int s, PressureStars<Scalar> const& stars, std::span<std::array<int, 4> const> nodes, VolumeGradient const& volume_gradient) {
    ++look_, parts_.clear(), gradients_.clear();
    for (int const e : stars.elements(s)) {
      auto const grows = volume_gradient(e);
      for (int k = 0; k < 4; ++k) {
        int const node = nodes[index(e)][index(k)];
        if (std::exchange(seen_[index(node)], look_) == look_) {
          gradients_[place_[index(node)]] += grows.col(k);
        } else {
          place_[index(node)] = gradients_.size();
          gradients_.push_back(grows.col(k)), parts_.push_back({node, 0});
        }
      }
    }
    Scalar all = 0;
    for (auto const& gradient : gradients_) all += gradient.norm();
    for (std::size_t k = 0; k < parts_.size(); ++k) parts_[k].bound = stars.stiffness(s) * all * gradients_[k].norm();
    parts_of_.set(s, parts_);
  }
  void take(int i, PressureStars<Scalar> const& stars, std::span<std::array<int, 4> const> nodes, std::span<int const> elements) {
    found_.clear();
    seen_[index(i)] = ++look_;
    Scalar& bound = bounds_[index(i)] = 0;
    for (int const e : elements) {
      for (std::size_t k = 0; k < 4; ++k)
        if (nodes[index(e)][k] == i) bound += rows_[index(e)][k];
      for (int const s : stars.at_corners(e)) {
        if (std::exchange(star_seen_[index(s)], look_) == look_) continue;
        for (Part const& part : parts_of_[s])
          if (part.node == i)
            bound += part.bound;
          else if (std::exchange(seen_[index(part.node)], look_) != look_)
            found_.push_back(part.node);
      }
    }
    set_neighbours(i);
  }
  /// To those found. Most were neighbours before, which are in order: then only the others need sorting.
  void set_neighbours(int i) {
    kept_.clear(), merged_.clear();
    if (i < near_.size())
      for (int const j : near_[i])
        if (seen_[index(j)] == look_) seen_[index(j)] = 0, kept_.push_back(j);
    std::erase_if(found_, [this](int j) { return seen_[index(j)] != look_; });
    std::sort(found_.begin(), found_.end());
    std::merge(kept_.begin(), kept_.end(), found_.begin(), found_.end(), std::back_inserter(merged_));
    near_.set(i, merged_);
  }

  GrowingLists<int> near_;
  GrowingLists<Part> parts_of_;   // each star
  std::vector<std::array<Scalar, 4>> rows_;   // Σ_j ‖K_kj‖ of each tetrahedron alone [N/m]
  std::vector<Scalar> bounds_;
  std::vector<unsigned> seen_, star_seen_;   // in which look each particle, each star was found last
  unsigned look_ = 0;
  std::vector<std::size_t> place_;   // of a particle among the parts of a star
  std::vector<Part> parts_;
  std::vector<Vector3<Scalar>> gradients_;   // g [m²]
  std::vector<int> moved_, found_, kept_, merged_;
};

}  // namespace palpate
