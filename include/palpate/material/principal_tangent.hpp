// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/simd.hpp>
#include <palpate/core/tensor3.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

namespace palpate {

namespace detail {

template <class T>
struct Direction {
  T x, y, z;
};

/// The rotation of p and q that makes their entry pq of a symmetric tensor zero; of it and of the columns of V.
template <class T>
[[gnu::always_inline]] inline void jacobi_rotation(T& pp, T& qq, T& pq, T& rp, T& rq, T& xp, T& xq, T& yp, T& yq, T& zp, T& zq) noexcept {
  constexpr bool is_double = sizeof(NumberOf<T>) == sizeof(double);
  T const half = number<T>(0.5), one = number<T>(1), apart = half * (qq - pp), sign = apart < T{} ? T{} - one : one;
  T const width = sign * apart + number<T>(is_double ? 1e-150 : 1e-18);   // above zero: it is divided by
  T root, inverse, cosine, secant;   // of the angle; cos 2θ = width/root, sin 2θ = pq/root
  simd::root_and_inverse(root, inverse, T(width * width + pq * pq));
  simd::root_and_inverse(cosine, secant, T(half + half * width * inverse));
  T const sine = half * sign * pq * inverse * secant, t = sine * secant;
  auto const both = [&](T& p, T& q) {
    T const before = p;
    p = cosine * before - sine * q, q = sine * before + cosine * q;
  };
  pp = pp - t * pq, qq = qq + t * pq, pq = T{};
  both(rp, rq), both(xp, xq), both(yp, yq), both(zp, zq);
}

/// Eigenvalues of symmetric tensors, in their diagonals, and their eigenvectors, in the columns of V, by Jacobi's rotations: until nothing but rounding is
/// beside the diagonals, at most as many sweeps as double needs. A rotation waits for the one before it: those of some tensors run beside each other.
template <class T, std::size_t Count>
void diagonalise(std::array<Tensor3<T>, Count>& symmetric, std::array<Tensor3<T>, Count>& V) noexcept {
  constexpr auto epsilon = std::numeric_limits<NumberOf<T>>::epsilon();
  auto const is_diagonal = [](Tensor3<T> const& a) {
    T const beside = a.xy * a.xy + a.xz * a.xz + a.yz * a.yz, along = a.xx * a.xx + a.yy * a.yy + a.zz * a.zz;
    return simd::all_below(T(beside - number<T>(epsilon * epsilon) * along), std::numeric_limits<NumberOf<T>>::min());
  };
  V.fill(Tensor3<T>::identity());
  std::array<Tensor3<T>, Count> as = symmetric;
  for (int sweep = 0; sweep < 5 && !std::all_of(as.begin(), as.end(), is_diagonal); ++sweep) {
    for (std::size_t k = 0; k < Count; ++k) jacobi_rotation(as[k].xx, as[k].yy, as[k].xy, as[k].xz, as[k].yz, V[k].xx, V[k].xy, V[k].yx, V[k].yy, V[k].zx, V[k].zy);
    for (std::size_t k = 0; k < Count; ++k) jacobi_rotation(as[k].xx, as[k].zz, as[k].xz, as[k].xy, as[k].yz, V[k].xx, V[k].xz, V[k].yx, V[k].yz, V[k].zx, V[k].zz);
    for (std::size_t k = 0; k < Count; ++k) jacobi_rotation(as[k].yy, as[k].zz, as[k].yz, as[k].xy, as[k].xz, V[k].xy, V[k].xz, V[k].yy, V[k].yz, V[k].zy, V[k].zz);
  }
  symmetric = as;
}

/// Of F: FᵀF is V, a rotation, times the diagonal of `squared` times Vᵀ.
template <class T>
struct PrincipalStretches {
  Tensor3<T> squared, V;
};
template <class T, std::size_t Count>
std::array<PrincipalStretches<T>, Count> principal_stretches(std::array<Tensor3<T>, Count> const& F) noexcept {
  std::array<Tensor3<T>, Count> squared, V;
  for (std::size_t k = 0; k < Count; ++k) squared[k] = transpose(F[k]) * F[k];
  diagonalise(squared, V);
  std::array<PrincipalStretches<T>, Count> all;
  for (std::size_t k = 0; k < Count; ++k) all[k] = {squared[k], V[k]};
  return all;
}

/// A symmetric linear map of 3 × 3 changes that does not mix what is on the diagonal with what is beside it, nor the pairs yz, xz, xy with each other.
template <class T>
struct PrincipalChange {
  T xx, yy, zz, xy, xz, yz;   // of the diagonal to itself
  T same[3], other[3];        // of the entries of each pair, to themselves and to each other

  [[gnu::always_inline]] Tensor3<T> of(Tensor3<T> const& M) const noexcept {
    return {xx * M.xx + xy * M.yy + xz * M.zz, same[2] * M.xy + other[2] * M.yx, same[1] * M.xz + other[1] * M.zx,
            same[2] * M.yx + other[2] * M.xy, xy * M.xx + yy * M.yy + yz * M.zz, same[0] * M.yz + other[0] * M.zy,
            same[1] * M.zx + other[1] * M.xz, same[0] * M.zy + other[0] * M.yz, xz * M.xx + yz * M.yy + zz * M.zz};
  }
  /// What e ⊗ b changes along a, as a matrix of e.
  [[gnu::always_inline]] Tensor3<T> block(Direction<T> const& a, Direction<T> const& b) const noexcept {
    T const ax = a.x * b.x, ay = a.y * b.y, az = a.z * b.z, axy = a.x * b.y, ayx = a.y * b.x, axz = a.x * b.z, azx = a.z * b.x, ayz = a.y * b.z, azy = a.z * b.y;
    return {xx * ax + same[2] * ay + same[1] * az, xy * axy + other[2] * ayx, xz * axz + other[1] * azx,
            xy * ayx + other[2] * axy, same[2] * ax + yy * ay + same[0] * az, yz * ayz + other[0] * azy,
            xz * azx + other[1] * axz, yz * azy + other[0] * ayz, same[1] * ax + same[0] * ay + zz * az};
  }
  friend PrincipalChange operator*(T const& f, PrincipalChange const& a) noexcept {
    return {f * a.xx, f * a.yy, f * a.zz, f * a.xy, f * a.xz, f * a.yz, {f * a.same[0], f * a.same[1], f * a.same[2]}, {f * a.other[0], f * a.other[1], f * a.other[2]}};
  }
};

/// The positive semidefinite part of an isotropic law's tangent at F = U Σ Vᵀ, U and V rotations. In the frames of U and V it is a matrix A of the three
/// principal changes and, for each two of the others, a 2 × 2 block whose eigenvalues are a sum and a difference; where one is negative it becomes 0.
/// Source     \cite teran2005, there for laws in the principal stretches; here the entries are asked of stress_change at Σ.
template <class T>
struct PrincipalTangent {
  Tensor3<T> U, V;
  PrincipalChange<T> change;

  template <class Law>
  PrincipalTangent(Law const& law, Tensor3<T> const& F) noexcept : PrincipalTangent(law, F, principal_stretches(std::array{F})[0]) {}
  /// With those of F.
  template <class Law>
  PrincipalTangent(Law const& law, Tensor3<T> const& F, PrincipalStretches<T> const& stretches_of_F) noexcept : V(stretches_of_F.V) {
    T const zero{}, tiny = number<T>(1e-30);
    Tensor3<T> const B = F * V, &C = stretches_of_F.squared;
    // The column of the smallest stretch is made last, the others by Gram and Schmidt; signs so that U and V turn and do not mirror.
    T const least_x = smaller(C.xx, C.yy, C.zz), least_y = smaller(C.yy, C.xx, C.zz) * (number<T>(1) - least_x);
    U = B;
    auto const cycle = [&](T const& by, Tensor3<T>& m) {   // where by is 1 columns x y z become y z x
      Tensor3<T> const old = m;
      m.xx = old.xx + by * (old.xy - old.xx), m.xy = old.xy + by * (old.xz - old.xy), m.xz = old.xz + by * (old.xx - old.xz);
      m.yx = old.yx + by * (old.yy - old.yx), m.yy = old.yy + by * (old.yz - old.yy), m.yz = old.yz + by * (old.yx - old.yz);
      m.zx = old.zx + by * (old.zy - old.zx), m.zy = old.zy + by * (old.zz - old.zy), m.zz = old.zz + by * (old.zx - old.zz);
    };
    cycle(least_x, U), cycle(least_x, V), cycle(least_y, U), cycle(least_y, U), cycle(least_y, V), cycle(least_y, V);
    T sx, sy, one_x, one_y;
    simd::root_and_inverse(sx, one_x, T(U.xx * U.xx + U.yx * U.yx + U.zx * U.zx + tiny));
    U.xx *= one_x, U.yx *= one_x, U.zx *= one_x;
    T const along = U.xx * U.xy + U.yx * U.yy + U.zx * U.zy;
    U.xy -= along * U.xx, U.yy -= along * U.yx, U.zy -= along * U.zx;
    simd::root_and_inverse(sy, one_y, T(U.xy * U.xy + U.yy * U.yy + U.zy * U.zy + tiny));
    U.xy *= one_y, U.yy *= one_y, U.zy *= one_y;
    T const bx = U.xz, by = U.yz, bz = U.zz;
    U.xz = U.yx * U.zy - U.zx * U.yy, U.yz = U.zx * U.xy - U.xx * U.zy, U.zz = U.xx * U.yy - U.yx * U.xy;
    T const sz = bx * U.xz + by * U.yz + bz * U.zz;

    Tensor3<T> const stretches{sx, zero, zero, zero, sy, zero, zero, zero, sz};
    auto const [x, y, rest] = changes_at(law, stretches);
    Tensor3<T> A{x.xx, y.xx, rest.xx, x.yy, y.yy, rest.yy, x.zz, y.zz, rest.zz};
    T const minor = A.xx * A.yy - A.xy * A.xy, whole = determinant(A, cofactor(A));
    if (!(simd::all_below(T(zero - A.xx), NumberOf<T>{}) && simd::all_below(T(zero - minor), NumberOf<T>{}) && simd::all_below(T(zero - whole), NumberOf<T>{}))) {
      std::array diagonal{A}, frame{A};
      diagonalise(diagonal, frame);
      auto& [xx, xy, xz, yx, yy, yz, zx, zy, zz] = diagonal[0];
      simd::raise_to(xx, zero), simd::raise_to(yy, zero), simd::raise_to(zz, zero);
      A = (frame[0] * Tensor3<T>{xx, zero, zero, zero, yy, zero, zero, zero, zz}) * transpose(frame[0]);
    }
    change.xx = A.xx, change.yy = A.yy, change.zz = A.zz, change.xy = A.xy, change.xz = A.xz, change.yz = A.yz;
    auto const pair = [&](int k, T const& on, T const& beside) {
      T sum = on + beside, difference = on - beside;
      simd::raise_to(sum, zero), simd::raise_to(difference, zero);
      T const half = number<T>(0.5);
      change.same[k] = half * (sum + difference), change.other[k] = half * (sum - difference);
    };
    pair(0, rest.yz, rest.zy), pair(1, rest.xz, rest.zx), pair(2, rest.xy, rest.yx);
  }

  Tensor3<T> stress_change(Tensor3<T> const& dF) const noexcept { return (U * change.of(transpose(U) * (dF * V))) * transpose(V); }
  Tensor3<T> turned(Tensor3<T> const& g) const noexcept { return g * V; }
  Tensor3<T> block(Direction<T> const& a, Direction<T> const& b) const noexcept { return (U * change.block(a, b)) * transpose(U); }

 private:
  /// By a change of the first stretch, of the second, and of the third and all three pairs: what is beside the diagonal has nothing to do with what is on it.
  /// Within one function, so that what they have in common is computed once.
  template <class Law>
  [[gnu::flatten]] static std::array<Tensor3<T>, 3> changes_at(Law const& law, Tensor3<T> const& stretches) noexcept {
    T const o{}, one = number<T>(1);
    return {law.stress_change(stretches, {one, o, o, o, o, o, o, o, o}), law.stress_change(stretches, {o, o, o, o, one, o, o, o, o}),
            law.stress_change(stretches, {o, one, one, o, o, one, o, o, one})};
  }
  /// 1 where a is not above the others, else 0.
  static T smaller(T const& a, T const& b, T const& c) noexcept {
    return ((a <= b) & (a <= c)) ? number<T>(1) : T{};
  }
};

}  // namespace detail

}  // namespace palpate
