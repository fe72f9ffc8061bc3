// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace palpate {

/// A set of particles in insertion order, with membership in constant time (stamps).
/// Cost       clear, add and contains are O(1); nothing is allocated below the reserved size.
class Selection {
 public:
  void reserve(int particles) {
    particles_.reserve(static_cast<std::size_t>(particles));
    stamp_.resize(static_cast<std::size_t>(particles), 0);
  }

  void clear() noexcept {
    particles_.clear();
    ++now_;
  }

  /// True if the particle was not in the set before.
  bool add(int particle) {
    auto const p = static_cast<std::size_t>(particle);
    if (p >= stamp_.size()) stamp_.resize(p + 1, 0);
    if (stamp_[p] == now_) return false;
    stamp_[p] = now_;
    particles_.push_back(particle);
    return true;
  }

  bool contains(int particle) const noexcept {
    auto const p = static_cast<std::size_t>(particle);
    return p < stamp_.size() && stamp_[p] == now_;
  }

  void sort() { std::sort(particles_.begin(), particles_.end()); }

  std::span<int const> particles() const noexcept { return particles_; }
  int size() const noexcept { return static_cast<int>(particles_.size()); }

 private:
  std::vector<int> particles_;
  std::vector<std::uint64_t> stamp_;
  std::uint64_t now_ = 1;
};

}  // namespace palpate
