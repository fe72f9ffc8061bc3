// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/simd.hpp>

#include <concepts>
#include <type_traits>
#include <utility>

namespace palpate {

/// The type of one number of a pack.
template <class T>
struct NumberIn {
  using type = std::remove_cvref_t<decltype(std::declval<T&>()[0])>;
};
template <std::floating_point T>
struct NumberIn<T> {
  using type = T;
};
template <class T>
using NumberOf = typename NumberIn<T>::type;

/// A constant of a formula, as a number or in each place of a pack.
template <class T>
constexpr T number(double value) noexcept {
  if constexpr (std::floating_point<T>)
    return static_cast<T>(value);
  else
    return T{} + static_cast<NumberOf<T>>(value);
}

/// A 3 × 3 matrix of numbers, or of packs of them (simd::Pack): what a material is written in, so that one formula serves one element or as many as a
/// register holds. Not Eigen's matrix: its expressions take long to compile for packs, and loops over nine numbers stay loops at -O2.
template <class T>
struct Tensor3 {
  T xx, xy, xz, yx, yy, yz, zx, zy, zz;

  [[gnu::always_inline]] static Tensor3 identity() noexcept { return diagonal(number<T>(1)); }
  [[gnu::always_inline]] static Tensor3 diagonal(T const& d) noexcept { return {d, T{}, T{}, T{}, d, T{}, T{}, T{}, d}; }

  [[gnu::always_inline]] friend Tensor3 operator+(Tensor3 const& a, Tensor3 const& b) noexcept {
    return {a.xx + b.xx, a.xy + b.xy, a.xz + b.xz, a.yx + b.yx, a.yy + b.yy, a.yz + b.yz, a.zx + b.zx, a.zy + b.zy, a.zz + b.zz};
  }
  [[gnu::always_inline]] friend Tensor3 operator-(Tensor3 const& a, Tensor3 const& b) noexcept {
    return {a.xx - b.xx, a.xy - b.xy, a.xz - b.xz, a.yx - b.yx, a.yy - b.yy, a.yz - b.yz, a.zx - b.zx, a.zy - b.zy, a.zz - b.zz};
  }
  [[gnu::always_inline]] friend Tensor3 operator*(T const& f, Tensor3 const& a) noexcept {
    return {f * a.xx, f * a.xy, f * a.xz, f * a.yx, f * a.yy, f * a.yz, f * a.zx, f * a.zy, f * a.zz};
  }
  [[gnu::always_inline]] friend Tensor3 operator*(Tensor3 const& a, Tensor3 const& b) noexcept {
    return {a.xx * b.xx + a.xy * b.yx + a.xz * b.zx, a.xx * b.xy + a.xy * b.yy + a.xz * b.zy, a.xx * b.xz + a.xy * b.yz + a.xz * b.zz,
            a.yx * b.xx + a.yy * b.yx + a.yz * b.zx, a.yx * b.xy + a.yy * b.yy + a.yz * b.zy, a.yx * b.xz + a.yy * b.yz + a.yz * b.zz,
            a.zx * b.xx + a.zy * b.yx + a.zz * b.zx, a.zx * b.xy + a.zy * b.yy + a.zz * b.zy, a.zx * b.xz + a.zy * b.yz + a.zz * b.zz};
  }
};

/// A symmetric one.
template <class T>
struct SymmetricTensor3 {
  T xx{}, yy{}, zz{}, xy{}, xz{}, yz{};

  [[gnu::always_inline]] operator Tensor3<T>() const noexcept { return {xx, xy, xz, xy, yy, yz, xz, yz, zz}; }
  friend SymmetricTensor3 operator+(SymmetricTensor3 const& a, SymmetricTensor3 const& b) noexcept {
    return {a.xx + b.xx, a.yy + b.yy, a.zz + b.zz, a.xy + b.xy, a.xz + b.xz, a.yz + b.yz};
  }
  friend SymmetricTensor3 operator*(T const& f, SymmetricTensor3 const& a) noexcept { return {f * a.xx, f * a.yy, f * a.zz, f * a.xy, f * a.xz, f * a.yz}; }
};
/// Of a tensor that is symmetric, or taken to be.
template <class T>
[[gnu::always_inline]] inline SymmetricTensor3<T> upper_triangle(Tensor3<T> const& a) noexcept {
  return {a.xx, a.yy, a.zz, a.xy, a.xz, a.yz};
}

template <class T>
[[gnu::always_inline]] inline Tensor3<T> transpose(Tensor3<T> const& a) noexcept {
  return {a.xx, a.yx, a.zx, a.xy, a.yy, a.zy, a.xz, a.yz, a.zz};
}
template <class T>
[[gnu::always_inline]] inline T trace(Tensor3<T> const& a) noexcept {
  return a.xx + a.yy + a.zz;
}
/// a : b = Σ a_ij b_ij.
template <class T>
[[gnu::always_inline]] inline T double_contraction(Tensor3<T> const& a, Tensor3<T> const& b) noexcept {
  return (a.xx * b.xx + a.xy * b.xy + a.xz * b.xz) + (a.yx * b.yx + a.yy * b.yy + a.yz * b.yz) + (a.zx * b.zx + a.zy * b.zy + a.zz * b.zz);
}
/// (a + aᵀ)/2.
template <class T>
[[gnu::always_inline]] inline Tensor3<T> symmetric_part(Tensor3<T> const& a) noexcept {
  T const half = number<T>(0.5), xy = half * (a.xy + a.yx), xz = half * (a.xz + a.zx), yz = half * (a.yz + a.zy);
  return {a.xx, xy, xz, xy, a.yy, yz, xz, yz, a.zz};
}
/// ∂ det a / ∂a = det(a) a⁻ᵀ, without dividing.
template <class T>
[[gnu::always_inline]] inline Tensor3<T> cofactor(Tensor3<T> const& a) noexcept {
  return {a.yy * a.zz - a.yz * a.zy, a.yz * a.zx - a.yx * a.zz, a.yx * a.zy - a.yy * a.zx,
          a.zy * a.xz - a.zz * a.xy, a.zz * a.xx - a.zx * a.xz, a.zx * a.xy - a.zy * a.xx,
          a.xy * a.yz - a.xz * a.yy, a.xz * a.yx - a.xx * a.yz, a.xx * a.yy - a.xy * a.yx};
}
/// The change of cofactor(a) with a change d of a.
template <class T>
[[gnu::always_inline]] inline Tensor3<T> cofactor_change(Tensor3<T> const& a, Tensor3<T> const& d) noexcept {
  return {a.yy * d.zz + d.yy * a.zz - a.yz * d.zy - d.yz * a.zy, a.yz * d.zx + d.yz * a.zx - a.yx * d.zz - d.yx * a.zz, a.yx * d.zy + d.yx * a.zy - a.yy * d.zx - d.yy * a.zx,
          a.zy * d.xz + d.zy * a.xz - a.zz * d.xy - d.zz * a.xy, a.zz * d.xx + d.zz * a.xx - a.zx * d.xz - d.zx * a.xz, a.zx * d.xy + d.zx * a.xy - a.zy * d.xx - d.zy * a.xx,
          a.xy * d.yz + d.xy * a.yz - a.xz * d.yy - d.xz * a.yy, a.xz * d.yx + d.xz * a.yx - a.xx * d.yz - d.xx * a.yz, a.xx * d.yy + d.xx * a.yy - a.xy * d.yx - d.xy * a.yx};
}
/// From cofactor(a).
template <class T>
[[gnu::always_inline]] inline T determinant(Tensor3<T> const& a, Tensor3<T> const& cofactor) noexcept {
  return a.xx * cofactor.xx + a.xy * cofactor.xy + a.xz * cofactor.xz;
}

/// The same of each number of a pack, by a function of one number.
template <class T, class Function>
T each(T const& numbers, Function const& function) noexcept {
  if constexpr (std::floating_point<T>) {
    return function(numbers);
  } else {
    T result = numbers;
    for (int k = 0; k < static_cast<int>(sizeof(T) / sizeof(numbers[0])); ++k) result[k] = function(numbers[k]);
    return result;
  }
}

}  // namespace palpate
