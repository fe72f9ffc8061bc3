// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/simd.hpp>
#include <palpate/core/tensor3.hpp>

#include <limits>

namespace palpate {

namespace detail {

/// Eigenvalues of a symmetric tensor, in its diagonal, and eigenvectors, in the columns of V, by Jacobi's rotations: until nothing but rounding is beside the
/// diagonal, at most as many sweeps as double needs.
template <class T>
Tensor3<T> diagonalise(Tensor3<T>& a) noexcept {
  constexpr auto epsilon = std::numeric_limits<NumberOf<T>>::epsilon();
  Tensor3<T> V = Tensor3<T>::identity();
  T const zero{}, tiny = number<T>(1e-30);
  auto const turn = [&](T& pp, T& qq, T& pq, T& rp, T& rq, T& xp, T& xq, T& yp, T& yq, T& zp, T& zq) {
    T const half = number<T>(0.5) * (qq - pp), one = number<T>(1), sign = half < zero ? zero - one : one;
    T root;
    simd::square_root(root, T(half * half + pq * pq));
    T const t = sign * pq / (sign * half + root + tiny);
    T cosine;
    simd::square_root(cosine, T(one / (t * t + one)));
    T const sine = t * cosine;
    auto const both = [&](T& p, T& q) {
      T const before = p;
      p = cosine * before - sine * q, q = sine * before + cosine * q;
    };
    pp = pp - t * pq, qq = qq + t * pq, pq = zero;
    both(rp, rq), both(xp, xq), both(yp, yq), both(zp, zq);
  };
  for (int sweep = 0; sweep < 5; ++sweep) {
    T const beside = a.xy * a.xy + a.xz * a.xz + a.yz * a.yz, along = a.xx * a.xx + a.yy * a.yy + a.zz * a.zz;
    if (simd::all_below(T(beside - number<T>(epsilon * epsilon) * along), std::numeric_limits<NumberOf<T>>::min())) break;
    turn(a.xx, a.yy, a.xy, a.xz, a.yz, V.xx, V.xy, V.yx, V.yy, V.zx, V.zy);
    turn(a.xx, a.zz, a.xz, a.xy, a.yz, V.xx, V.xz, V.yx, V.yz, V.zx, V.zz);
    turn(a.yy, a.zz, a.yz, a.xy, a.xz, V.xy, V.xz, V.yy, V.yz, V.zy, V.zz);
  }
  return V;
}

/// The positive semidefinite part of an isotropic law's tangent at F = U Σ Vᵀ, U and V rotations. In the frames of U and V it is a matrix A of the three
/// principal changes and, for each two of the others, a 2 × 2 block whose eigenvalues are a sum and a difference; where one is negative it becomes 0.
/// This is what products need when gradients have been turned by V.
template <class T>
struct TurnedTangent {
  Tensor3<T> U;
  T Axx, Ayy, Azz, Axy, Axz, Ayz;
  T sums[3], differences[3];   // of the pairs yz, xz, xy

  /// The stress in the frames of U and V of a change M = Uᵀ dF V there.
  [[gnu::always_inline]] Tensor3<T> in_frames(Tensor3<T> const& M) const noexcept {
    return {Axx * M.xx + Axy * M.yy + Axz * M.zz, sums[2] * M.xy + differences[2] * M.yx, sums[1] * M.xz + differences[1] * M.zx,
            sums[2] * M.yx + differences[2] * M.xy, Axy * M.xx + Ayy * M.yy + Ayz * M.zz, sums[0] * M.yz + differences[0] * M.zy,
            sums[1] * M.zx + differences[1] * M.xz, sums[0] * M.zy + differences[0] * M.yz, Axz * M.xx + Ayz * M.yy + Azz * M.zz};
  }
  [[gnu::always_inline]] Tensor3<T> change(Tensor3<T> const& dF) const noexcept { return U * in_frames(transpose(U) * dF); }
  /// dF : change(dF) for dF = e_c ⊗ (x, y, z); (ux, uy, uz) is row c of U.
  [[gnu::always_inline]] T curvature(T const& ux, T const& uy, T const& uz, T const& x, T const& y, T const& z) const noexcept {
    Tensor3<T> const M{ux * x, ux * y, ux * z, uy * x, uy * y, uy * z, uz * x, uz * y, uz * z};
    return double_contraction(M, in_frames(M));
  }
  /// (x, y, z) for c = 0, 1, 2.
  template <class Use>
  [[gnu::always_inline]] void curvatures(T const& x, T const& y, T const& z, Use const& use) const noexcept {
    use(curvature(U.xx, U.xy, U.xz, x, y, z), curvature(U.yx, U.yy, U.yz, x, y, z), curvature(U.zx, U.zy, U.zz, x, y, z));
  }
  /// That of so many times the law.
  void scale(T const& factor) noexcept {
    for (T* entry : {&Axx, &Ayy, &Azz, &Axy, &Axz, &Ayz}) *entry = factor * *entry;
    for (int k = 0; k < 3; ++k) sums[k] = factor * sums[k], differences[k] = factor * differences[k];
  }
};

/// The same, with V.
/// Source     \cite teran2005, there for laws in the principal stretches; here the entries are asked of stress_change at Σ.
template <class T>
struct PrincipalTangent : TurnedTangent<T> {
  using TurnedTangent<T>::U, TurnedTangent<T>::Axx, TurnedTangent<T>::Ayy, TurnedTangent<T>::Azz, TurnedTangent<T>::Axy, TurnedTangent<T>::Axz, TurnedTangent<T>::Ayz;
  using TurnedTangent<T>::sums, TurnedTangent<T>::differences;
  Tensor3<T> V;

  template <class Law>
  PrincipalTangent(Law const& law, Tensor3<T> const& F) noexcept {
    T const zero{}, tiny = number<T>(1e-30);
    Tensor3<T> C = transpose(F) * F;
    V = diagonalise(C);
    Tensor3<T> const B = F * V;
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
    T sx, sy;
    simd::square_root(sx, T(U.xx * U.xx + U.yx * U.yx + U.zx * U.zx + tiny));
    T const one_x = number<T>(1) / sx;
    U.xx *= one_x, U.yx *= one_x, U.zx *= one_x;
    T const along = U.xx * U.xy + U.yx * U.yy + U.zx * U.zy;
    U.xy -= along * U.xx, U.yy -= along * U.yx, U.zy -= along * U.zx;
    simd::square_root(sy, T(U.xy * U.xy + U.yy * U.yy + U.zy * U.zy + tiny));
    T const one_y = number<T>(1) / sy;
    U.xy *= one_y, U.yy *= one_y, U.zy *= one_y;
    T const bx = U.xz, by = U.yz, bz = U.zz;
    U.xz = U.yx * U.zy - U.zx * U.yy, U.yz = U.zx * U.xy - U.xx * U.zy, U.zz = U.xx * U.yy - U.yx * U.xy;
    T const sz = bx * U.xz + by * U.yz + bz * U.zz;

    Tensor3<T> const stretches{sx, zero, zero, zero, sy, zero, zero, zero, sz};
    T const one = number<T>(1);
    auto const change = [&](Tensor3<T> const& d) { return law.stress_change(stretches, d); };
    Tensor3<T> const x = change({one, zero, zero, zero, zero, zero, zero, zero, zero}), y = change({zero, zero, zero, zero, one, zero, zero, zero, zero}),
                     z = change({zero, zero, zero, zero, zero, zero, zero, zero, one});
    Tensor3<T> A{x.xx, y.xx, z.xx, x.yy, y.yy, z.yy, x.zz, y.zz, z.zz};
    T const minor = A.xx * A.yy - A.xy * A.xy, whole = determinant(A, cofactor(A));
    if (!(simd::all_below(T(zero - A.xx), NumberOf<T>{}) && simd::all_below(T(zero - minor), NumberOf<T>{}) && simd::all_below(T(zero - whole), NumberOf<T>{}))) {
      Tensor3<T> const frame = diagonalise(A);
      simd::raise_to(A.xx, zero), simd::raise_to(A.yy, zero), simd::raise_to(A.zz, zero);
      A = (frame * Tensor3<T>{A.xx, zero, zero, zero, A.yy, zero, zero, zero, A.zz}) * transpose(frame);
    }
    Axx = A.xx, Ayy = A.yy, Azz = A.zz, Axy = A.xy, Axz = A.xz, Ayz = A.yz;
    auto const pair = [&](int k, T const& same, T const& other) {
      sums[k] = same + other, differences[k] = same - other;
      simd::raise_to(sums[k], zero), simd::raise_to(differences[k], zero);
      T const half = number<T>(0.5), sum = half * sums[k], difference = half * differences[k];
      sums[k] = sum + difference, differences[k] = sum - difference;   // now the entries of the block
    };
    Tensor3<T> const yz = change({zero, zero, zero, zero, zero, one, zero, zero, zero}), xz = change({zero, zero, one, zero, zero, zero, zero, zero, zero}),
                     xy = change({zero, one, zero, zero, zero, zero, zero, zero, zero});
    pair(0, yz.yz, yz.zy), pair(1, xz.xz, xz.zx), pair(2, xy.xy, xy.yx);
  }

  Tensor3<T> stress_change(Tensor3<T> const& dF) const noexcept { return this->change(dF * V) * transpose(V); }

 private:
  /// 1 where a is not above the others, else 0.
  static T smaller(T const& a, T const& b, T const& c) noexcept {
    return ((a <= b) & (a <= c)) ? number<T>(1) : T{};
  }
};

}  // namespace detail

}  // namespace palpate
