// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/simd_columns.hpp>
#include <palpate/core/tensor3.hpp>
#include <palpate/material/concept.hpp>
#include <palpate/material/semidefinite_tangent.hpp>
#include <palpate/material/with_pressure.hpp>
#include <palpate/tissue/linear_tetrahedron.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace palpate::detail {

/// What tetrahedra of a law are computed in: as many numbers at once as a register holds, where the law is one of such packs and its tangent is known
/// without eigenvalues of 9 × 9 matrices; else one.
template <class Scalar, class Law>
struct PackOfLaw {
  using Number = Scalar;
  using type = Law;
};
template <class Scalar, class Law>
  requires(IsLawOfNumbers<Law, Scalar, simd::Lanes<Scalar>> && (HasSemidefiniteStressChange<Law, Scalar> || IsIsotropicLaw<Law>))
struct PackOfLaw<Scalar, Law> {
  using Number = simd::Lanes<Scalar>;
  using type = typename LawOver<Law, Number>::type;
};

/// The lowest J = det F of some tetrahedra, and whose it is.
template <class Scalar>
struct LowestDeterminant {
  int element = -1;
  Scalar value = std::numeric_limits<Scalar>::infinity();
};

/// Tetrahedra as many at once as a register holds: forces, energy, products with their positive semidefinite tangent, volumes.
/// Columns    4 × n, contiguous, the fourth row 0.
/// Pressure   with stars (see PressureStars) first their volumes are measured, then the pressures of all stars are handed in: a quarter of each, since
///            a tetrahedron has that of its four corners' mean.
template <class Scalar, class Law>
class TetrahedronPacks {
  using T = typename PackOfLaw<Scalar, Law>::Number;
  using PackLaw = typename PackOfLaw<Scalar, Law>::type;
  static constexpr int lanes = static_cast<int>(sizeof(T) / sizeof(Scalar));
  static constexpr int window = 12 * lanes;   // of elements that a pack is chosen from
  static constexpr bool can_average = HasBulkModulus<PackLaw, T>;
  using TangentLaw = std::conditional_t<can_average, WithPressure<T, PackLaw>, PackLaw>;

 public:
  using Element = LinearTetrahedron<Scalar, Law>;

  void reserve(std::size_t particles, std::size_t elements) {
    packs_.reserve((elements + lanes - 1) / lanes), tangents_.reserve(packs_.capacity()), names_.reserve(packs_.capacity()), last_pack_of_.reserve(particles);
  }

  /// Holds elements[which(k)], k < count, with their nodes, all below `particles`. Where it can, no two of a pack share a node: the sum at a node waits for
  /// the one before. name(e) is what lowest() calls it; its energy counts where counts(e).
  template <class Which, class Name, class Counts>
  void fill(int particles, std::span<std::array<int, 4> const> nodes, std::span<Element const> elements, int count, Which const& which, Name const& name, Counts const& counts) {
    packs_.clear(), names_.clear(), stars_.clear();
    last_pack_of_.assign(static_cast<std::size_t>(particles), -1);
    std::array<int, window> waiting;
    int waits = 0, next = 0;
    while (next < count || waits > 0) {
      while (next < count && waits < window) waiting[static_cast<std::size_t>(waits++)] = which(next++);
      Pack& pack = packs_.emplace_back();
      Names& names = names_.emplace_back();
      int lane = 0, left = 0, last = 0;
      auto const take = [&](int e) {
        auto const k = static_cast<std::size_t>(e);
        for (int const i : nodes[k]) last_pack_of_[static_cast<std::size_t>(i)] = static_cast<int>(packs_.size());
        names.name[lane] = name(e), names.local[lane] = e, names.counts[lane] = counts(e);
        put(pack, lane++, nodes[k], elements[k], elements[k].volume());
        last = e;
      };
      for (int k = 0; k < waits; ++k) {
        int const e = waiting[static_cast<std::size_t>(k)];
        auto const& own = nodes[static_cast<std::size_t>(e)];
        bool const shares = std::any_of(own.begin(), own.end(), [&](int i) { return last_pack_of_[static_cast<std::size_t>(i)] == static_cast<int>(packs_.size()); });
        if (lane < lanes && !shares)
          take(e);
        else
          waiting[static_cast<std::size_t>(left++)] = e;
      }
      int const first = std::min(left, lanes - lane);
      for (int k = 0; k < first; ++k) take(waiting[static_cast<std::size_t>(k)]);
      waits = static_cast<int>(std::copy(waiting.begin() + first, waiting.begin() + left, waiting.begin()) - waiting.begin());
      for (; lane < lanes; ++lane) {   // the end: nothing more
        names.name[lane] = names.name[0], names.local[lane] = -1, names.counts[lane] = false;
        put(pack, lane, nodes[static_cast<std::size_t>(last)], elements[static_cast<std::size_t>(last)], Scalar(0));
      }
    }
  }
  /// Their stars: at_corners(e). Calls placed(e, slot) for each: where measured() answers for it.
  template <class AtCorners, class Placed>
  void set_stars(AtCorners const& at_corners, Placed const& placed) {
    measured_.resize(packs_.size());
    for (std::size_t p = 0; p < packs_.size(); ++p) {
      auto& corners = stars_.emplace_back();
      for (int lane = 0; lane < lanes; ++lane) {
        int const e = names_[p].local[lane];
        for (std::size_t k = 0; k < 4; ++k) corners.star[k][lane] = e < 0 ? corners.star[k][0] : at_corners(e)[k];
        if (e >= 0) placed(e, static_cast<int>(p) * lanes + lane);
      }
    }
  }
  Scalar measured(int slot) const noexcept { return lane_of(measured_[static_cast<std::size_t>(slot / lanes)], slot % lanes); }

  /// V J of each at x.
  void measure_volumes(Scalar const* x) noexcept {
    for (std::size_t k = 0; k < packs_.size(); ++k) {
      Tensor3<T> const F = gradient(packs_[k], packs_[k].gradients, x);
      measured_[k] = packs_[k].volume * determinant(F, cofactor(F));
    }
  }
  /// V cof F(x) : dF(v) of each: how fast it grows.
  void measure_growth(Scalar const* x, Scalar const* v) noexcept {
    for (std::size_t k = 0; k < packs_.size(); ++k)
      measured_[k] = packs_[k].volume * double_contraction(cofactor(gradient(packs_[k], packs_[k].gradients, x)), gradient(packs_[k], packs_[k].gradients, v));
  }
  /// The same for a change d of the places that linearise() was at.
  void measure_changes(Scalar const* d) noexcept {
    if constexpr (can_average)
      for (std::size_t k = 0; k < packs_.size(); ++k) measured_[k] = double_contraction(cofactors_[k], gradient(tangents_[k], tangents_[k].gradients, d));
  }

  /// f += the forces at x, in the columns where own(column), with a quarter of the pressure of each star; and with a share `damping` [s] of the tangent's
  /// at the velocities v.
  template <class Own>
  void add_forces(Scalar const* x, Scalar const* v, Scalar damping, Scalar const* pressure, Scalar const* pressure_rate, Scalar* f, Own const& own) const noexcept {
    for (std::size_t k = 0; k < packs_.size(); ++k) {
      Pack const& pack = packs_[k];
      Tensor3<T> const F = gradient(pack, pack.gradients, x);
      Tensor3<T> P = stress(k, F, pressure);
      if (damping != 0) [[unlikely]]
        add_damping(k, F, v, damping, pressure, pressure_rate, P);
      scatter(nodal_forces(P, pack.gradients, pack.volume), pack, f, own);
    }
  }

  void linearise(Scalar const* x, Scalar const* pressure) {
    tangents_.clear(), cofactors_.clear();
    for (std::size_t k = 0; k < packs_.size(); ++k) {
      Tensor3<T> const F = gradient(packs_[k], packs_[k].gradients, x);
      auto const add = [&](auto tangent) {
        tangent.scale(packs_[k].volume);
        Tangent& added = tangents_.emplace_back(Tangent{tangent.turned(), tangent.turned(packs_[k].gradients), {}});
        std::memcpy(added.nodes, packs_[k].nodes, sizeof(added.nodes));
        if (!stars_.empty()) cofactors_.push_back(packs_[k].volume * tangent.turned(cofactor(F)));
      };
      if constexpr (std::is_same_v<std::remove_cvref_t<decltype(std::declval<SemidefiniteTangent<T, PackLaw> const&>().turned())>, decltype(Tangent::law)>)
        if (stars_.empty()) {   // without the pressure's part
          add(SemidefiniteTangent<T, PackLaw>(packs_[k].law, F));
          continue;
        }
      add(FullTangent(tangent_law(k, pressure), F));
    }
  }
  /// out += factor · K d, in the columns where own(column), with a quarter of the change of pressure of each star.
  template <class Own>
  void add_product(Scalar factor, Scalar const* d, Scalar const* pressure_change, Scalar* out, Own const& own) const noexcept {
    T const size = T{} - factor;
    for (std::size_t k = 0; k < tangents_.size(); ++k) {
      Tangent const& tangent = tangents_[k];
      Tensor3<T> P = tangent.law.change(gradient(tangent, tangent.gradients, d));
      if constexpr (can_average)
        if (!stars_.empty()) P = P + of_corners(k, pressure_change) * cofactors_[k];
      scatter(nodal_forces(P, tangent.gradients, size), tangent, out, own);
    }
  }
  /// The diagonal of that; a star's `weight` is κ/(4 V). What the tetrahedra of a star have in common off their own diagonals is left out.
  template <class Own>
  void add_diagonal(Scalar factor, Scalar const* weight, Scalar* out, Own const& own) const noexcept {
    for (std::size_t k = 0; k < packs_.size(); ++k) {
      Tangent const& tangent = tangents_[k];
      Tensor3<T> const& g = tangent.gradients;
      T const zero{}, size = zero + factor;
      T star_size = zero;
      if constexpr (can_average)
        if (!stars_.empty()) star_size = size * of_corners(k, weight);
      auto const add = [&](int a, T const& x, T const& y, T const& z) {   // (x, y, z) the gradient of node a
        tangent.law.curvatures(x, y, z, [&](T const& along_x, T const& along_y, T const& along_z) {
          T sx = size * along_x, sy = size * along_y, sz = size * along_z;
          if (can_average && !stars_.empty()) {
            Tensor3<T> const& cof = cofactors_[k];
            T const gx = cof.xx * x + cof.xy * y + cof.xz * z, gy = cof.yx * x + cof.yy * y + cof.yz * z, gz = cof.zx * x + cof.zy * y + cof.zz * z;
            sx = sx + star_size * gx * gx, sy = sy + star_size * gy * gy, sz = sz + star_size * gz * gz;
          }
          simd::add_to_columns(out, tangent.nodes[a], sx, sy, sz, own);
        });
      };
      add(0, zero - (g.xx + g.yx + g.zx), zero - (g.xy + g.yy + g.zy), zero - (g.xz + g.yz + g.zz));
      add(1, g.xx, g.xy, g.xz), add(2, g.yx, g.yy, g.yz), add(3, g.zx, g.zy, g.zz);
    }
  }

  /// The energy of those that count, without that of their stars [J].
  Scalar energy(Scalar const* x) const noexcept {
    Scalar sum = 0;
    for (std::size_t k = 0; k < packs_.size(); ++k) {
      Tensor3<T> const F = gradient(packs_[k], packs_[k].gradients, x);
      T const each = packs_[k].volume * energy_density(k, F);
      for (int lane = 0; lane < lanes; ++lane)
        if (names_[k].counts[lane]) sum += lane_of(each, lane);
    }
    return sum;
  }
  LowestDeterminant<Scalar> lowest(Scalar const* x) const noexcept {
    LowestDeterminant<Scalar> found;
    for (std::size_t k = 0; k < packs_.size(); ++k) {
      Tensor3<T> const F = gradient(packs_[k], packs_[k].gradients, x);
      T const J = determinant(F, cofactor(F));
      if (simd::all_below(T(number<T>(static_cast<double>(found.value)) - J), Scalar(0))) continue;
      for (int lane = 0; lane < lanes; ++lane)
        if (!(lane_of(J, lane) >= found.value)) found = {names_[k].name[lane], lane_of(J, lane)};
    }
    return found;
  }

 private:
  struct Pack {
    Tensor3<T> gradients;
    T volume;
    PackLaw law;
    int nodes[4][lanes];
  };
  struct Names {
    int name[lanes], local[lanes];
    bool counts[lanes];
  };
  struct Corners {
    int star[4][lanes];
  };
  /// The tangent's part and the gradients that it takes, turned alike.
  using FullTangent = SemidefiniteTangent<T, TangentLaw>;
  struct Tangent {
    std::remove_cvref_t<decltype(std::declval<FullTangent const&>().turned())> law;   // of the whole tetrahedron: times its volume
    Tensor3<T> gradients;
    int nodes[4][lanes];
  };

  static Scalar lane_of(T const& numbers, int lane) noexcept {
    if constexpr (lanes == 1)
      return numbers;
    else
      return numbers[lane];
  }
  static WithPressure<T, PackLaw> law_of(Pack const& pack, T const& pressure) noexcept
    requires can_average
  {
    return {pack.law, pack.law.bulk_modulus(), pressure};
  }
  [[gnu::always_inline]] Tensor3<T> stress(std::size_t k, Tensor3<T> const& F, Scalar const* pressure) const noexcept {
    if constexpr (can_average)
      if (!stars_.empty()) return law_of(packs_[k], of_corners(k, pressure)).stress(F);
    return packs_[k].law.stress(F);
  }
  T energy_density(std::size_t k, Tensor3<T> const& F) const noexcept {
    if constexpr (can_average)
      if (!stars_.empty()) return law_of(packs_[k], T{}).energy(F);
    return packs_[k].law.energy(F);
  }
  TangentLaw tangent_law(std::size_t k, Scalar const* pressure) const noexcept {
    if constexpr (can_average) {
      if (stars_.empty()) return {packs_[k].law, T{}, T{}};
      return law_of(packs_[k], of_corners(k, pressure));
    } else {
      return packs_[k].law;
    }
  }
  /// The sum over the corners' stars.
  T of_corners(std::size_t k, Scalar const* of_star) const noexcept {
    alignas(T) std::array<Scalar, lanes> sums;
    for (int lane = 0; lane < lanes; ++lane) {
      auto const at = [&](int corner) { return of_star[stars_[k].star[corner][lane]]; };
      sums[static_cast<std::size_t>(lane)] = (at(0) + at(1)) + (at(2) + at(3));
    }
    T all;
    simd::load(all, sums.data());
    return all;
  }
  [[gnu::noinline]] void add_damping(std::size_t k, Tensor3<T> const& F, Scalar const* v, Scalar damping, Scalar const* pressure, Scalar const* pressure_rate,
                                     Tensor3<T>& P) const noexcept {
    FullTangent const tangent(tangent_law(k, pressure), F);
    P = P + number<T>(static_cast<double>(damping)) * tangent.stress_change(gradient(packs_[k], packs_[k].gradients, v));
    if constexpr (can_average)
      if (!stars_.empty()) P = P + (number<T>(static_cast<double>(damping)) * of_corners(k, pressure_rate)) * cofactor(F);
  }

  /// Lane k of numbers that lie as those of `value` do.
  template <class Packed, class Value>
  static void set(Packed& packed, int k, Value const& value) noexcept {
    static_assert(sizeof(Packed) == lanes * sizeof(Value));
    if constexpr (lanes == 1) {
      packed = value;
    } else {
      std::array<Scalar, sizeof(Value) / sizeof(Scalar)> numbers;
      std::memcpy(numbers.data(), &value, sizeof(value));
      for (std::size_t n = 0; n < numbers.size(); ++n)
        std::memcpy(reinterpret_cast<char*>(&packed) + (n * lanes + static_cast<std::size_t>(k)) * sizeof(Scalar), &numbers[n], sizeof(Scalar));
    }
  }
  static void put(Pack& pack, int lane, std::array<int, 4> const& nodes, Element const& element, Scalar volume) noexcept {
    set(pack.gradients, lane, element.gradients()), set(pack.law, lane, element.law()), set(pack.volume, lane, volume);
    for (std::size_t a = 0; a < 4; ++a) pack.nodes[a][lane] = nodes[a];
  }

  /// Σ_a (x_a − x_0) ⊗ ∇N_a.
  [[gnu::always_inline]] static Tensor3<T> gradient(auto const& pack, Tensor3<T> const& gradients, Scalar const* x) noexcept {
    T ox, oy, oz;
    Tensor3<T> rows;
    simd::load_columns(ox, oy, oz, x, pack.nodes[0]);
    simd::load_columns(rows.xx, rows.xy, rows.xz, x, pack.nodes[1]);
    simd::load_columns(rows.yx, rows.yy, rows.yz, x, pack.nodes[2]);
    simd::load_columns(rows.zx, rows.zy, rows.zz, x, pack.nodes[3]);
    rows = {rows.xx - ox, rows.xy - oy, rows.xz - oz, rows.yx - ox, rows.yy - oy, rows.yz - oz, rows.zx - ox, rows.zy - oy, rows.zz - oz};
    return transpose(rows) * gradients;
  }
  template <class Own>
  [[gnu::always_inline]] static void scatter(Tensor3<T> const& f, auto const& pack, Scalar* columns, Own const& own) noexcept {
    simd::add_to_columns(columns, pack.nodes[0], T(T{} - (f.xx + f.yx + f.zx)), T(T{} - (f.xy + f.yy + f.zy)), T(T{} - (f.xz + f.yz + f.zz)), own);
    simd::add_to_columns(columns, pack.nodes[1], f.xx, f.xy, f.xz, own);
    simd::add_to_columns(columns, pack.nodes[2], f.yx, f.yy, f.yz, own);
    simd::add_to_columns(columns, pack.nodes[3], f.zx, f.zy, f.zz, own);
  }

  std::vector<Pack> packs_;
  std::vector<Names> names_;
  std::vector<Corners> stars_;      // empty without stars
  std::vector<T> measured_;
  std::vector<Tangent> tangents_;   // of each since linearise()
  std::vector<Tensor3<T>> cofactors_;   // with stars: V cof F, turned like the gradients
  std::vector<int> last_pack_of_;   // of each particle, while they are filled
};

}  // namespace palpate::detail
