// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/index_lists.hpp>
#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace palpate {

/// What pressure is averaged over: the tetrahedra of one material round a node. A node where two materials meet has a star of each.
/// With V the volume of its tetrahedra at rest and κ their bulk modulus, a star stores V/4 κ/2 (J̄ − 1)², J̄ = Σ_e V_e J_e / V.
/// Source     \cite bonet1998.
template <RealScalar Scalar>
class PressureStars {
 public:
  /// These tetrahedra, in order, have other nodes or another volume than before, or are new; no other is new. at(i): the tetrahedra at particle i;
  /// volume(e) [m³]; group(e) ≥ 0, the same for tetrahedra that share pressure; bulk_modulus(e) [Pa]. Returns the stars that have changed, in order.
  template <class At, class Volume, class Group, class Bulk>
  std::span<int const> follow(std::span<int const> edited, std::span<std::array<int, 4> const> nodes, At const& at, Volume const& volume, Group const& group,
                              Bulk const& bulk_modulus) {
    corners_.resize(nodes.size(), {-1, -1, -1, -1});
    changed_.clear();
    for (int const e : edited)
      for (std::size_t k = 0; k < 4; ++k) {
        int& star = corners_[index(e)][k];
        if (star < 0) continue;
        changed_.push_back(star);
        if (node(star) != nodes[index(e)][k]) elements_.remove(star, e), star = -1;
      }
    for (int const e : edited)
      for (std::size_t k = 0; k < 4; ++k) {
        int& star = corners_[index(e)][k];
        if (star >= 0) continue;
        int const node = nodes[index(e)][k];
        for (int const other : at(node))   // one beside it that knows
          for (std::size_t l = 0; l < 4 && star < 0 && group(other) == group(e); ++l)
            if (other != e && nodes[index(other)][l] == node) star = corners_[index(other)][l];
        if (star < 0) {
          star = size();
          node_.push_back(node), volume_.push_back(0), bulk_.push_back(bulk_modulus(e));
          elements_.add_list();
        }
        elements_.add(star, e, 0);
        changed_.push_back(star);
      }
    std::sort(changed_.begin(), changed_.end());
    changed_.erase(std::unique(changed_.begin(), changed_.end()), changed_.end());
    for (int const star : changed_) {
      Scalar& sum = volume_[index(star)] = 0;
      for (int const e : elements_[star]) sum += volume(e);
    }
    return changed_;
  }

  /// Memory for so many tetrahedra, and for so many more stars than there are.
  void reserve(std::size_t elements, std::size_t more) {
    std::size_t const stars = node_.size() + more;
    corners_.reserve(elements), node_.reserve(stars), volume_.reserve(stars), bulk_.reserve(stars), changed_.reserve(stars);
    elements_.reserve_for_growth(static_cast<int>(stars));
  }
  bool empty() const noexcept { return node_.empty(); }
  /// Of so many tetrahedra.
  int elements_known() const noexcept { return static_cast<int>(corners_.size()); }
  int size() const noexcept { return static_cast<int>(node_.size()); }
  int node(int star) const noexcept { return node_[static_cast<std::size_t>(star)]; }
  Scalar volume(int star) const noexcept { return volume_[static_cast<std::size_t>(star)]; }         ///< V [m³]
  Scalar bulk_modulus(int star) const noexcept { return bulk_[static_cast<std::size_t>(star)]; }   ///< κ [Pa]
  /// κ/4V [N/m⁵]: what its Hessian is of the square of V ∂J̄/∂x.
  Scalar stiffness(int star) const noexcept { return bulk_modulus(star) / (4 * volume(star)); }
  /// None, of one that a cut has left empty.
  std::span<int const> elements(int star) const noexcept { return elements_[star]; }
  /// The star at each corner of a tetrahedron.
  std::array<int, 4> const& at_corners(int element) const noexcept { return corners_[static_cast<std::size_t>(element)]; }

 private:
  static std::size_t index(int i) noexcept { return static_cast<std::size_t>(i); }

  std::vector<std::array<int, 4>> corners_;   // −1 while it is not known
  std::vector<int> node_, changed_;
  IndexLists elements_;   // of each star
  std::vector<Scalar> volume_, bulk_;
};

}  // namespace palpate
