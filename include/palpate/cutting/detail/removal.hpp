// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <vector>

namespace palpate {

/// What has been taken away of a solid.
struct RemovedTissue {
  int tetrahedra = 0;   ///< with those of debris
  double volume = 0;    ///< m³, undeformed
  double mass = 0;      ///< kg
  int debris = 0;       ///< pieces that came free and went
};

namespace detail {

/// Tetrahedra that are to go, one by one or as pieces, and how they do.
class Removal {
 public:
  void clear() noexcept { taken_.clear(); }
  void add(int t) { taken_.push_back(t); }
  std::size_t size() const noexcept { return taken_.size(); }
  bool has(int t) const noexcept { return std::find(taken_.begin(), taken_.end(), t) != taken_.end(); }

  /// m³, undeformed.
  template <class Body>
  static double volume(Body const& body, int t) {
    double const length = 1 - static_cast<double>(body.tissue().link_prestrain());
    return static_cast<double>(body.tissue().list().elements[static_cast<std::size_t>(t)].volume()) / (length * length * length);
  }

  /// Adds the piece that a tetrahedron belongs to, if it has fewer of them than `most`, none nailed or held, and something is left of the body.
  template <class Body>
  void add_debris(Body const& body, int start, int most, RemovedTissue& report) {
    auto const& solid = body.tissue().topology();
    auto const end = static_cast<std::size_t>(std::min(most, solid.tetrahedron_count()));
    if (has(start)) return;
    piece_.assign(1, start);
    for (std::size_t n = 0; n < piece_.size(); ++n)
      for (int k = 0; k < 4; ++k) {
        int const corner = solid.corners(piece_[n])[static_cast<std::size_t>(k)], beyond = solid.neighbour(piece_[n], k);
        if (piece_.size() >= end || body.tissue().nailed(corner) || body.is_held(corner)) return;
        if (beyond >= 0 && std::find(piece_.begin(), piece_.end(), beyond) == piece_.end()) piece_.push_back(beyond);
      }
    if (piece_.size() >= end || taken_.size() + piece_.size() >= static_cast<std::size_t>(solid.tetrahedron_count())) return;
    taken_.insert(taken_.end(), piece_.begin(), piece_.end());
    ++report.debris;
  }

  /// Takes them away, largest numbers first, so that no other one of them gets another number. Returns the particles that they had, each once.
  template <class Body>
  std::vector<int>& take(Body& body, RemovedTissue& report) {
    std::sort(taken_.begin(), taken_.end(), std::greater<>());
    corners_.clear();
    for (int const t : taken_) {
      auto const c = body.tissue().topology().corners(t);
      auto const weigh = [&] {
        double sum = 0;
        for (int const v : c) sum += static_cast<double>(body.tissue().mass(v));
        return sum;
      };
      double const before = weigh();
      report.volume += volume(body, t);
      body.remove_tetrahedron(t);
      report.mass += before - weigh();
      ++report.tetrahedra;
      corners_.insert(corners_.end(), c.begin(), c.end());
    }
    std::sort(corners_.begin(), corners_.end());
    corners_.erase(std::unique(corners_.begin(), corners_.end()), corners_.end());
    return corners_;
  }

 private:
  std::vector<int> taken_, piece_, corners_;
};

}  // namespace detail

}  // namespace palpate
