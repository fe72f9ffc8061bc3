// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/surface_intersection.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/refill.hpp>

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace palpate::detail {

/// The volumes that sheets have in common, and on which vertices these depend, whoever found them: first those of a SurfaceIntersection, then those of CutLips.
template <RealScalar Scalar>
class RegionShapes {
 public:
  using Region = typename SurfaceIntersection<Scalar>::Region;
  using VertexGradient = typename SurfaceIntersection<Scalar>::VertexGradient;

  void take(SurfaceIntersection<Scalar> const& found) {
    refill(regions_, found.regions()), found_ = regions_.size();
    for (std::size_t side = 0; side < 2; ++side) refill(gradients_[side], found.gradient(static_cast<int>(side)));
  }
  /// Of a region that is added: begin, then its gradients on either side, ascending, then end.
  Region& begin_region() {
    Region& region = regions_.emplace_back();
    for (std::size_t side = 0; side < 2; ++side) region.begin[side] = gradients_[side].size();
    return region;
  }
  void add(int side, VertexGradient const& one) { gradients_[static_cast<std::size_t>(side)].push_back(one); }
  void end_region() noexcept {
    for (std::size_t side = 0; side < 2; ++side) regions_.back().end[side] = gradients_[side].size();
  }

  std::span<Region const> regions() const noexcept { return regions_; }
  /// Whether the lips of a cut have made a region.
  bool is_of_lips(std::size_t region) const noexcept { return region >= found_; }
  std::span<VertexGradient const> gradient(int side) const noexcept { return gradients_[static_cast<std::size_t>(side)]; }
  std::span<VertexGradient const> gradient(int side, Region const& of) const noexcept {
    auto const s = static_cast<std::size_t>(side);
    return gradient(side).subspan(of.begin[s], of.end[s] - of.begin[s]);
  }

 private:
  std::vector<Region> regions_;
  std::array<std::vector<VertexGradient>, 2> gradients_;
  std::size_t found_ = 0;
};

}  // namespace palpate::detail
