// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/body_view.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace palpate {

namespace detail {

/// Positions of a body with one particle, or all of them, shifted, as a 3 × n expression.
template <class Positions, RealScalar Scalar>
struct Shifted {
  Positions const& x;
  Vector3<Scalar> shift;
  int particle;   // −1: all
  Vector3<Scalar> col(int i) const noexcept {
    if (particle < 0 || particle == i) return x.col(i) + shift;
    return x.col(i);
  }
};

}  // namespace detail

/// How far the border of a moving set would give way if it might [m]: what the whole body is off by for standing still there.
///   max_b |r_b| / √(h_b (2 D_b − h_b)),   h_b ≥ D_b / n
/// r_b is the force that holds back the border's particle b, D_b its stiffness along r_b with all others fixed, h_b the part of it that
/// ties b to the world rather than to its neighbours; n the particles of the body. The root is what a chain of springs D − h with home
/// springs h opposes to a force on one of its particles: D alone where neighbours do not matter, far less where home springs are soft.
/// Found by probing: the force at b as it is, with b shifted along r_b, with b and its neighbours shifted; any tissue can be asked.
/// Units      r [N], D, h [N/m].
/// Cost       O(springs at the border); noexcept, allocates nothing.
/// Limits     a static estimate to first order: what moves fast is off by up to twice as much, or less where the wave is not there yet.
///            Without home springs a body is taken to be held as far away as it is wide. See docs/region.md for what was measured.
template <TissueModel Tissue>
typename Tissue::Scalar truncation_error(BodyView<Tissue> const& body, std::span<int const> border) noexcept {
  using Scalar = typename Tissue::Scalar;
  using Vector = Vector3<Scalar>;
  auto const x = body.state.position.view();
  Scalar largest = 0;
  for (int const b : border) {
    if (b >= body.size() || !body.is_free(b)) continue;
    Vector const force = body.tissue.internal_force(b, x, Still<Scalar>{});
    Vector const residual = force + body.tissue.mass(b) * body.gravity;
    Scalar const size = residual.norm();
    Scalar const bound = body.tissue.stiffness_bound(b);
    if (!(size > 0) || !(bound > 0)) continue;
    Vector const along = residual / size;
    Scalar const probe = std::max(size / bound, std::sqrt(std::numeric_limits<Scalar>::epsilon()) * x.col(b).cwiseAbs().maxCoeff());
    auto const stiffness = [&](int shifted) {
      detail::Shifted<decltype(x), Scalar> const there{x, probe * along, shifted};
      return along.dot(force - body.tissue.internal_force(b, there, Still<Scalar>{})) / probe;
    };
    Scalar const own = std::clamp(stiffness(b), Scalar(1e-3) * bound, bound);
    Scalar const tie = std::clamp(stiffness(-1), own / Scalar(body.size()), own);
    largest = std::max(largest, size / std::sqrt(tie * (2 * own - tie)));
  }
  return largest;
}

}  // namespace palpate
