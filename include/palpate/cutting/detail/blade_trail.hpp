// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/cutting/detail/traced_blade.hpp>

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace palpate::detail {

/// Where a blade is in the undeformed solid, and where it was one to two edges of its way before: a stroke that is forgotten there goes on from there.
template <RealScalar Scalar>
class BladeTrail {
  using Vector = Vector3<double>;
  using Traced = TracedBlade<Scalar>;

 public:
  void clear() noexcept {
    here_.clear(), before_.clear(), far_.clear();
    way_ = 0;
  }
  /// The points of the blade now.
  std::span<Vector const> here() const noexcept { return here_.points; }

  template <class Body>
  void put(Body const& body, std::span<BladeSample const> samples) {
    here_.clear();
    for (BladeSample const& sample : samples) here_.shares.push_back(sample.share), here_.points.push_back(Traced::undeformed(body, sample));
    if (far_.points.empty()) far_ = before_ = here_;
  }
  /// It has moved so far [m]. Returns whether that makes an edge since it has last returned so.
  bool goes_by(double way, double edge) {
    if ((way_ += way) < edge) return false;
    way_ = 0;
    std::swap(far_, before_);
    before_ = here_;
    return true;
  }

  /// Whether the blade, that was put elsewhere, is within half an edge of where it was, in the mean over what of it is in the tissue.
  template <class Body>
  bool is_here(Body const& body, std::span<BladeSample const> samples) const {
    if (here_.points.empty()) return false;
    double off = 0;
    int inside = 0;
    for (BladeSample const& sample : samples)
      if (sample.is_inside()) off += (here_.at(sample.share) - Traced::undeformed(body, sample)).norm(), ++inside;
    return inside > 0 && off < inside * static_cast<double>(body.mean_edge()) / 2;
  }
  /// Where the samples were an edge back, carried by the tetrahedra that carry them.
  template <class Body>
  void place_behind(Body const& body, std::span<BladeSample const> samples, std::vector<Vector>& places) const {
    places.clear();
    for (BladeSample const& sample : samples) places.push_back(Traced::now(body, sample, far_.at(sample.share) - Traced::undeformed(body, sample)));
  }

 private:
  struct Place {
    std::vector<double> shares;
    std::vector<Vector> points;
    void clear() noexcept { shares.clear(), points.clear(); }
    /// Between the points beside a share.
    Vector at(double share) const noexcept {
      auto const k = static_cast<std::size_t>(std::upper_bound(shares.begin(), shares.end(), share) - shares.begin());
      if (k == 0) return points.front();
      if (k == shares.size()) return points.back();
      double const u = (share - shares[k - 1]) / (shares[k] - shares[k - 1]);
      return (1 - u) * points[k - 1] + u * points[k];
    }
  };

  Place here_, before_, far_;
  double way_ = 0;
};

}  // namespace palpate::detail
