// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/tissue/concept.hpp>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {

/// One mode of a body: its shape's undamped frequency and what damps it.
template <RealScalar Scalar>
struct Mode {
  Scalar frequency = 0;       ///< ω [rad/s]
  Scalar damping_ratio = 0;   ///< ζ = γ/(2ω): below 1 it oscillates; infinite where a mode is damped and nothing has stiffness
  bool converged = true;      ///< else the slowest is not faster than this, and may be far slower
};

/// A body as a sum of oscillators x″ + 2ζω x′ + ω² x = 0: the fastest, which limits the step, and the slowest, which the eye sees.
template <RealScalar Scalar>
struct ModalView {
  Mode<Scalar> fastest, slowest;
};

namespace detail {

/// An extreme eigenvalue of M⁻½ K M⁻½ and what its mode answers to C, by conjugate gradients on Rayleigh's quotient (LOBPCG with a single
/// vector): one product an iteration.
template <class Tissue, class X, class Moves>
Mode<typename Tissue::Scalar> extreme_mode(Tissue const& tissue, X const& x, Moves moves, bool largest) {
  using Scalar = typename Tissue::Scalar;
  using Columns = Matrix3X<Scalar>;
  using Basis = Matrix<Scalar, Dynamic, 3>;
  int const n = tissue.size();
  Matrix<Scalar, 1, Dynamic> scale(1, n);
  for (int i = 0; i < n; ++i) scale[i] = moves(i) ? 1 / std::sqrt(tissue.mass(i)) : Scalar(0);
  auto const apply = [&](auto const& vector, auto add_product) {
    Columns const d = vector.reshaped(3, n).array().rowwise() * scale.array();
    Columns y = Columns::Zero(3, n);
    add_product(d, y);
    y.array().rowwise() *= scale.array();
    return Matrix<Scalar, Dynamic, 1>(y.reshaped());
  };
  auto const stiffness = [&](auto const& d, auto& y) { tissue.add_stiffness_product(x, d, y); };
  auto const damping = [&](auto const& d, auto& y) { tissue.add_damping_product(x, d, y); };

  Basis basis = Basis::Zero(3 * n, 3), image = basis;   // the mode, its residual, the last direction
  for (int k = 0; k < 3 * n; ++k) {
    double const turn = (k + 1) * 0.6180339887498949;
    basis(k, 0) = scale[k / 3] > 0 ? static_cast<Scalar>(turn - std::floor(turn) - 0.5) : Scalar(0);
  }
  Mode<Scalar> mode;
  if (!(basis.col(0).norm() > 0)) return mode;
  basis.col(0).normalize();
  image.col(0) = apply(basis.col(0), stiffness);
  constexpr Scalar digits = std::numeric_limits<Scalar>::epsilon();
  Scalar value = 0, size = 0, residual = 0;
  for (int k = 0; k < 2000; ++k) {
    value = basis.col(0).dot(image.col(0));
    size = std::max(size, image.col(0).norm());
    basis.col(1) = image.col(0) - value * basis.col(0);
    residual = basis.col(1).norm();
    if (!(residual > std::max(Scalar(1e-4) * value, 64 * digits * size))) break;
    int columns = 1;
    for (int const c : {1, 2}) {   // orthonormal, what is dependent left out
      Matrix<Scalar, Dynamic, 1> v = basis.col(c);
      Matrix<Scalar, Dynamic, 1> av = image.col(c);
      if (c == 1) v.normalize(), av = apply(v, stiffness);
      Scalar const before = v.norm();
      for (int pass = 0; pass < 2; ++pass)
        for (int b = 0; b < columns; ++b) {
          Scalar const part = basis.col(b).dot(v);
          v -= part * basis.col(b);
          av -= part * image.col(b);
        }
      Scalar const left = v.norm();
      if (!(left > Scalar(1e-3) * before) || !(left > 0)) continue;
      basis.col(columns) = v / left;
      image.col(columns++) = av / left;
    }
    Matrix<Scalar, Dynamic, Dynamic> const small = basis.leftCols(columns).transpose() * image.leftCols(columns);
    Eigen::SelfAdjointEigenSolver<Matrix<Scalar, Dynamic, Dynamic>> const solved((small + small.transpose()) / 2);
    Matrix<Scalar, Dynamic, 1> mix = solved.eigenvectors().col(largest ? columns - 1 : 0);
    Matrix<Scalar, Dynamic, 1> const next = basis.leftCols(columns) * mix;
    Matrix<Scalar, Dynamic, 1> const next_image = image.leftCols(columns) * mix;
    mix[0] = 0;
    Matrix<Scalar, Dynamic, 1> const direction = basis.leftCols(columns) * mix;
    image.col(2) = image.leftCols(columns) * mix;
    basis.col(2) = direction;
    basis.col(0) = next.normalized();
    image.col(0) = k % 20 == 19 ? apply(basis.col(0), stiffness) : Matrix<Scalar, Dynamic, 1>(next_image / next.norm());
  }
  Scalar const gamma = basis.col(0).dot(apply(basis.col(0), damping));
  Scalar const least = 64 * digits * size;   // below it rounding cannot be told from stiffness
  mode.frequency = std::sqrt(std::max(value, least));
  mode.damping_ratio = mode.frequency > 0 ? gamma / (2 * mode.frequency) : gamma > 0 ? std::numeric_limits<Scalar>::infinity() : Scalar(0);
  mode.converged = !(size > 0) || (value > least && residual <= Scalar(0.1) * value);
  return mode;
}

}  // namespace detail

/// The fastest and the slowest mode of a body where it is now, and the damping ratios they show.
/// Limits     the ratio is that of the undamped mode's shape: exact where damping does not mix modes (C a combination of M and K, as
///            damping_for proposes for equal homes), else to first order. A compressed link's sideways push is left out.
///            `converged` is false after 2,000 products, as for a long beam that is slower than the fastest by more than some thousand times, and where the
///            slowest is below 10⁻⁷ of the fastest, in float below 1/360, as of a free body: what is told is an upper bound. See lowest_frequencies().
/// Source     the damped oscillator of any textbook.
/// Cost       some hundred products with the stiffness; allocates: for setting up, not for the loop.
template <class Body>
  requires HasStiffnessProduct<typename detail::TissueOf<Body>::type>
ModalView<typename Body::Scalar> modal_view(Body const& body) {
  auto const moves = [&](int i) { return !body.tissue().nailed(i) && !body.is_held(i) && body.tissue().mass(i) > 0; };
  auto const x = body.positions();
  return {detail::extreme_mode(body.tissue(), x, moves, true), detail::extreme_mode(body.tissue(), x, moves, false)};
}
/// Of what is no such body: what is wrong.
template <class Other>
  requires(!HasStiffnessProduct<typename detail::TissueOf<Other>::type>)
ModalView<typename Other::Scalar> modal_view(Other const&) {
  static_assert(detail::NamesTissue<Other>, "modal_view: this is no body; of a tissue make one: SoftBody body(std::move(tissue)).");
  static_assert(!detail::NamesTissue<Other> || HasStiffnessProduct<typename detail::TissueOf<Other>::type>,
                "modal_view: the body's tissue does not multiply its stiffness; see HasStiffnessProduct.");
  return {};
}

}  // namespace palpate
