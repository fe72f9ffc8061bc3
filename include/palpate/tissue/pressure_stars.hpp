// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <array>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace palpate {

/// What pressure is averaged over: the tetrahedra of one material round a node. A node where two materials meet has a star of each.
/// With V the volume of its tetrahedra at rest and κ their bulk modulus, a star stores V/4 κ/2 (J̄ − 1)², J̄ = Σ_e V_e J_e / V.
/// Source     \cite bonet1998.
template <RealScalar Scalar>
class PressureStars {
 public:
  PressureStars() = default;

  /// volume(e) [m³]; group(e) ≥ 0, the same for tetrahedra that share pressure; bulk_modulus(e) [Pa].
  template <class Volume, class Group, class Bulk>
  PressureStars(int particles, std::span<std::array<int, 4> const> nodes, Volume const& volume, Group const& group, Bulk const& bulk_modulus) {
    std::vector<std::vector<std::pair<int, int>>> at_node(static_cast<std::size_t>(particles));   // group, star
    std::vector<std::vector<int>> elements;
    for (std::size_t e = 0; e < nodes.size(); ++e) {
      auto& corners = corners_.emplace_back();
      for (std::size_t k = 0; k < 4; ++k) {
        auto& here = at_node[static_cast<std::size_t>(nodes[e][k])];
        int star = -1;
        for (auto const& [of, known] : here)
          if (of == group(static_cast<int>(e))) star = known;
        if (star < 0) {
          star = static_cast<int>(elements.size());
          here.emplace_back(group(static_cast<int>(e)), star);
          elements.emplace_back(), node_.push_back(nodes[e][k]), volume_.push_back(0), bulk_.push_back(bulk_modulus(static_cast<int>(e)));
        }
        elements[static_cast<std::size_t>(star)].push_back(static_cast<int>(e));
        volume_[static_cast<std::size_t>(star)] += volume(static_cast<int>(e));
        corners[k] = star;
      }
    }
    for (auto const& some : elements) {
      elements_.insert(elements_.end(), some.begin(), some.end());
      ends_.push_back(static_cast<int>(elements_.size()));
    }
  }

  bool empty() const noexcept { return node_.empty(); }
  int size() const noexcept { return static_cast<int>(node_.size()); }
  int node(int star) const noexcept { return node_[static_cast<std::size_t>(star)]; }
  Scalar volume(int star) const noexcept { return volume_[static_cast<std::size_t>(star)]; }         ///< V [m³]
  Scalar bulk_modulus(int star) const noexcept { return bulk_[static_cast<std::size_t>(star)]; }   ///< κ [Pa]
  std::span<int const> elements(int star) const noexcept {
    std::size_t const s = static_cast<std::size_t>(star), begin = s > 0 ? static_cast<std::size_t>(ends_[s - 1]) : 0;
    return std::span(elements_).subspan(begin, static_cast<std::size_t>(ends_[s]) - begin);
  }
  /// The star at each corner of a tetrahedron.
  std::array<int, 4> const& at_corners(int element) const noexcept { return corners_[static_cast<std::size_t>(element)]; }

 private:
  std::vector<std::array<int, 4>> corners_;
  std::vector<int> node_, ends_, elements_;
  std::vector<Scalar> volume_, bulk_;
};

}  // namespace palpate
