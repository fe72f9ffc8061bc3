// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/statics/tangent_matrix.hpp>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <vector>

namespace palpate {

/// Solves K p = f for a symmetric positive (semi)definite tangent, from p = 0. Returns its iterations, or −1 when K is singular to it
/// and p is not to be used. It need not be exact: Newton's method corrects it.
template <class Solver, class Scalar>
concept TangentSolver = requires(Solver const& solver, TangentMatrix<Scalar> const& k, Matrix3X<Scalar> const& f, Matrix3X<Scalar>& p) {
  { solver.solve(k, f, p) } -> std::same_as<int>;
};

/// Conjugate gradients, preconditioned with the diagonal blocks. Until |f − K p| ≤ tolerance |f| in the preconditioner's norm.
/// Cost       one product an iteration; iterations grow with the root of the condition number. Allocates.
struct TangentConjugateGradients {
  double tolerance = 1e-4;
  int iterations = 10000;

  template <RealScalar Scalar>
  int solve(TangentMatrix<Scalar> const& k, Matrix3X<Scalar> const& f, Matrix3X<Scalar>& p) const {
    int const n = k.size();
    std::vector<Matrix<Scalar, 3, 3>> inverse(static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i) inverse[static_cast<std::size_t>(i)] = k.diagonal(i).inverse();
    Matrix3X<Scalar> r = f, z(3, n), d(3, n), kd(3, n);
    p.setZero(3, n);
    auto const precondition = [&] {
      for (int i = 0; i < n; ++i) z.col(i) = inverse[static_cast<std::size_t>(i)] * r.col(i);
    };
    precondition();
    d = z;
    Scalar rz = r.cwiseProduct(z).sum();
    if (!std::isfinite(rz)) return -1;
    Scalar const share = std::max(static_cast<Scalar>(tolerance), 4 * std::numeric_limits<Scalar>::epsilon());
    Scalar const enough = share * share * rz;
    int count = 0;
    for (; count < iterations && rz > enough; ++count) {
      k.multiply(d, kd);
      Scalar const curvature = d.cwiseProduct(kd).sum();
      if (!(curvature > 0)) return -1;
      Scalar const step = rz / curvature;
      p += step * d;
      r -= step * kd;
      precondition();
      Scalar const last = rz;
      rz = r.cwiseProduct(z).sum();
      if (!std::isfinite(rz)) return -1;
      d = z + rz / last * d;
    }
    return count;
  }
};

/// Successive over-relaxation in blocks, p_i ← (1 − ω) p_i + ω K_ii⁻¹ (f_i − Σ_{j≠i} K_ij p_j). Until no change is above tolerance times the
/// largest |p_i|. Converges for 0 < ω < 2 on a positive definite K.
/// Source     \cite deformable_survey, its inner solver.
/// Cost       one product a sweep; sweeps grow with the condition number (ω = 1), or its root (the best ω, near 2 for large bodies). Allocates.
struct TangentOverRelaxation {
  double omega = 1.7;
  double tolerance = 1e-5;
  int sweeps = 20000;

  template <RealScalar Scalar>
  int solve(TangentMatrix<Scalar> const& k, Matrix3X<Scalar> const& f, Matrix3X<Scalar>& p) const {
    if (!(omega > 0 && omega < 2)) throw InvalidArgument(detail::message("omega is ", omega, "; over-relaxation needs 0 < omega < 2"));
    int const n = k.size();
    std::vector<Matrix<Scalar, 3, 3>> inverse(static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i) inverse[static_cast<std::size_t>(i)] = k.diagonal(i).inverse();
    p.setZero(3, n);
    Scalar const share = std::max(static_cast<Scalar>(tolerance), 4 * std::numeric_limits<Scalar>::epsilon());
    for (int count = 1; count <= sweeps; ++count) {
      Scalar largest = 0, change = 0;
      for (int i = 0; i < n; ++i) {
        Vector3<Scalar> const there = inverse[static_cast<std::size_t>(i)] * (f.col(i) - k.beside(i, p));
        Vector3<Scalar> const shift = static_cast<Scalar>(omega) * (there - p.col(i));
        p.col(i) += shift;
        if (!is_finite(p.col(i))) return -1;
        largest = std::max(largest, p.col(i).cwiseAbs().maxCoeff());
        change = std::max(change, shift.cwiseAbs().maxCoeff());
      }
      if (change <= share * largest) return count;
    }
    return sweeps;
  }
};

}  // namespace palpate
