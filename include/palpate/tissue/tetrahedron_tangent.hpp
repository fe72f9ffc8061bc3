// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/core/simd_columns.hpp>
#include <palpate/core/tensor3.hpp>
#include <palpate/material/principal_tangent.hpp>

#include <concepts>
#include <cstddef>
#include <cstring>

namespace palpate::detail {

/// What of a tetrahedron's stiffness is on the diagonal: of nodes 1, 2, 3 in rows, and of node 0.
template <class T>
struct TangentDiagonal {
  Tensor3<T> nodes;
  Direction<T> first;
};

/// The stiffness of as many tetrahedra as a pack T has numbers, between the three edges from node 0: half as many numbers as between four nodes.
template <class T>
struct TetrahedronTangent {
  static constexpr int lanes = static_cast<int>(sizeof(T) / sizeof(NumberOf<T>));

  SymmetricTensor3<T> aa, bb, cc;
  Tensor3<T> ab, ac, bc;
  int starts[4][lanes];   // of the nodes' columns

  [[gnu::flatten]] void set(auto const& tangent, Tensor3<T> const& gradients, T const& volume) noexcept {
    Tensor3<T> const g = tangent.turned(gradients);
    Direction<T> const a{g.xx, g.xy, g.xz}, b{g.yx, g.yy, g.yz}, c{g.zx, g.zy, g.zz};
    auto const block = [&](Direction<T> const& from, Direction<T> const& by) { return volume * tangent.block(from, by); };
    aa = upper_triangle(block(a, a)), bb = upper_triangle(block(b, b)), cc = upper_triangle(block(c, c));
    ab = block(a, b), ac = block(a, c), bc = block(b, c);
  }
  TangentDiagonal<T> diagonal() const noexcept {   // node 0 takes minus the sum of the others
    auto const first = [](T const& on, T const& beside) { return on + beside + beside; };
    return {{aa.xx, aa.yy, aa.zz, bb.xx, bb.yy, bb.zz, cc.xx, cc.yy, cc.zz},
            {first(aa.xx + bb.xx + cc.xx, ab.xx + ac.xx + bc.xx), first(aa.yy + bb.yy + cc.yy, ab.yy + ac.yy + bc.yy), first(aa.zz + bb.zz + cc.zz, ab.zz + ac.zz + bc.zz)}};
  }
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

/// The same of an isotropic law, in the frames of its principal stretches: two thirds of the numbers, and half as many operations more.
template <class T>
struct PrincipalTetrahedronTangent {
  static constexpr int lanes = static_cast<int>(sizeof(T) / sizeof(NumberOf<T>));

  Tensor3<T> U, gradients;   // turned as stretches are at rest
  PrincipalChange<T> change;   // times the volume
  int starts[4][lanes];

  [[gnu::flatten]] void set(PrincipalTangent<T> const& tangent, Tensor3<T> const& at_rest, T const& volume) noexcept {
    U = tangent.U, gradients = tangent.turned(at_rest), change = volume * tangent.change;
  }
  TangentDiagonal<T> diagonal() const noexcept {
    T const two = number<T>(2), xy = two * (change.xy + change.other[2]), xz = two * (change.xz + change.other[1]), yz = two * (change.yz + change.other[0]);
    Tensor3<T> const on{U.xx * U.xx, U.xy * U.xy, U.xz * U.xz, U.yx * U.yx, U.yy * U.yy, U.yz * U.yz, U.zx * U.zx, U.zy * U.zy, U.zz * U.zz};
    Tensor3<T> const beside{U.xx * U.xy, U.xx * U.xz, U.xy * U.xz, U.yx * U.yy, U.yx * U.yz, U.yy * U.yz, U.zx * U.zy, U.zx * U.zz, U.zy * U.zz};
    auto const at = [&](T x, T y, T z) __attribute__((always_inline)) {   // of (U M) Uᵀ, M what e ⊗ g changes along g
      T const xx = x * x, yy = y * y, zz = z * z, mxy = xy * (x * y), mxz = xz * (x * z), myz = yz * (y * z);
      T const mxx = change.xx * xx + change.same[2] * yy + change.same[1] * zz, myy = change.same[2] * xx + change.yy * yy + change.same[0] * zz,
              mzz = change.same[1] * xx + change.same[0] * yy + change.zz * zz;
      return Direction<T>{(on.xx * mxx + on.xy * myy + on.xz * mzz) + (beside.xx * mxy + beside.xy * mxz + beside.xz * myz),
                          (on.yx * mxx + on.yy * myy + on.yz * mzz) + (beside.yx * mxy + beside.yy * mxz + beside.yz * myz),
                          (on.zx * mxx + on.zy * myy + on.zz * mzz) + (beside.zx * mxy + beside.zy * mxz + beside.zz * myz)};
    };
    Tensor3<T> const& g = gradients;
    Direction<T> const a = at(g.xx, g.xy, g.xz), b = at(g.yx, g.yy, g.yz), c = at(g.zx, g.zy, g.zz);
    return {{a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z}, at(g.xx + g.yx + g.zx, g.xy + g.yy + g.zy, g.xz + g.yz + g.zz)};
  }
  [[gnu::always_inline]] friend Tensor3<T> operator*(PrincipalTetrahedronTangent const& t, Tensor3<T> const& d) noexcept {
    return (t.gradients * transpose(t.change.of(transpose(d * t.U) * t.gradients))) * transpose(t.U);
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
template <template <class> class Tangent, class Floats, class T>
void put_half(Tangent<Floats>& to, int half, Tangent<T> const& from) noexcept {
  put_half<(sizeof(from) - sizeof(from.starts)) / sizeof(T), Floats, T>(&to, half, &from);
  for (int node = 0; node < 4; ++node) std::memcpy(&to.starts[node][half * Tangent<T>::lanes], from.starts[node], sizeof(from.starts[node]));
}
template <class Floats, class T>
void put_half(Tensor3<Floats>& to, int half, Tensor3<T> const& from) noexcept {
  put_half<9, Floats, T>(&to, half, &from);
}

}  // namespace palpate::detail
