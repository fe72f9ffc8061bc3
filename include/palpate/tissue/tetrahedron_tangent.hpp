// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/core/simd_columns.hpp>
#include <palpate/core/tensor3.hpp>

#include <concepts>
#include <cstddef>
#include <cstring>

namespace palpate::detail {

/// The stiffness of as many tetrahedra as a pack T has numbers, between the three edges from node 0: half as many numbers as between four nodes.
template <class T>
struct TetrahedronTangent {
  static constexpr int lanes = static_cast<int>(sizeof(T) / sizeof(NumberOf<T>));

  SymmetricTensor3<T> aa, bb, cc;
  Tensor3<T> ab, ac, bc;
  int starts[4][lanes];   // of the nodes' columns

  /// What the changes d of the edges, in rows, pull at nodes 1, 2 and 3.
  [[gnu::always_inline]] friend Tensor3<T> operator*(TetrahedronTangent const& t, Tensor3<T> const& d) noexcept {
    return {((t.aa.xx * d.xx + t.aa.xy * d.xy + t.aa.xz * d.xz) + (t.ab.xx * d.yx + t.ab.xy * d.yy + t.ab.xz * d.yz)) + (t.ac.xx * d.zx + t.ac.xy * d.zy + t.ac.xz * d.zz),
            ((t.aa.xy * d.xx + t.aa.yy * d.xy + t.aa.yz * d.xz) + (t.ab.yx * d.yx + t.ab.yy * d.yy + t.ab.yz * d.yz)) + (t.ac.yx * d.zx + t.ac.yy * d.zy + t.ac.yz * d.zz),
            ((t.aa.xz * d.xx + t.aa.yz * d.xy + t.aa.zz * d.xz) + (t.ab.zx * d.yx + t.ab.zy * d.yy + t.ab.zz * d.yz)) + (t.ac.zx * d.zx + t.ac.zy * d.zy + t.ac.zz * d.zz),
            ((t.ab.xx * d.xx + t.ab.yx * d.xy + t.ab.zx * d.xz) + (t.bb.xx * d.yx + t.bb.xy * d.yy + t.bb.xz * d.yz)) + (t.bc.xx * d.zx + t.bc.xy * d.zy + t.bc.xz * d.zz),
            ((t.ab.xy * d.xx + t.ab.yy * d.xy + t.ab.zy * d.xz) + (t.bb.xy * d.yx + t.bb.yy * d.yy + t.bb.yz * d.yz)) + (t.bc.yx * d.zx + t.bc.yy * d.zy + t.bc.yz * d.zz),
            ((t.ab.xz * d.xx + t.ab.yz * d.xy + t.ab.zz * d.xz) + (t.bb.xz * d.yx + t.bb.yz * d.yy + t.bb.zz * d.yz)) + (t.bc.zx * d.zx + t.bc.zy * d.zy + t.bc.zz * d.zz),
            ((t.ac.xx * d.xx + t.ac.yx * d.xy + t.ac.zx * d.xz) + (t.bc.xx * d.yx + t.bc.yx * d.yy + t.bc.zx * d.yz)) + (t.cc.xx * d.zx + t.cc.xy * d.zy + t.cc.xz * d.zz),
            ((t.ac.xy * d.xx + t.ac.yy * d.xy + t.ac.zy * d.xz) + (t.bc.xy * d.yx + t.bc.yy * d.yy + t.bc.zy * d.yz)) + (t.cc.xy * d.zx + t.cc.yy * d.zy + t.cc.yz * d.zz),
            ((t.ac.xz * d.xx + t.ac.yz * d.xy + t.ac.zz * d.xz) + (t.bc.xz * d.yx + t.bc.yz * d.yy + t.bc.zz * d.yz)) + (t.cc.xz * d.zx + t.cc.yz * d.zy + t.cc.zz * d.zz)};
  }
};

/// Whether numbers are doubles, and a register holds twice as many floats: then what need not be as exact is computed in those.
template <class T>
inline constexpr bool has_floats_beside = std::same_as<NumberOf<T>, double> && sizeof(T) > sizeof(double) && sizeof(T) == sizeof(simd::Lanes<float>);

/// The first or second half of each number of `to`, a structure of `count` packs of floats, becomes those of `from`, rounded.
template <std::size_t count, class Floats, class T>
void put_half(void* to, int half, void const* from) noexcept {
  constexpr int lanes = static_cast<int>(sizeof(T) / sizeof(NumberOf<T>));
  static_assert(sizeof(Floats) == 2 * lanes * sizeof(float));
  char const* const read = static_cast<char const*>(from);
  char* const write = static_cast<char*>(to) + static_cast<std::size_t>(half) * sizeof(Floats) / 2;
  for (std::size_t n = 0; n < count; ++n) {
    NumberOf<T> given[lanes];
    float rounded[lanes];
    std::memcpy(given, read + n * sizeof(T), sizeof(given));
    for (int lane = 0; lane < lanes; ++lane) rounded[lane] = static_cast<float>(given[lane]);
    std::memcpy(write + n * sizeof(Floats), rounded, sizeof(rounded));
  }
}
template <class Floats, class T>
void put_half(TetrahedronTangent<Floats>& to, int half, TetrahedronTangent<T> const& from) noexcept {
  put_half<45, Floats, T>(&to, half, &from);
  for (int node = 0; node < 4; ++node) std::memcpy(&to.starts[node][half * TetrahedronTangent<T>::lanes], from.starts[node], sizeof(from.starts[node]));
}
template <class Floats, class T>
void put_half(Tensor3<Floats>& to, int half, Tensor3<T> const& from) noexcept {
  put_half<9, Floats, T>(&to, half, &from);
}

}  // namespace palpate::detail
