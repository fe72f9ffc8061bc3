// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/core/simd_columns.hpp>
#include <palpate/core/tensor3.hpp>
#include <palpate/material/concept.hpp>
#include <palpate/material/principal_tangent.hpp>
#include <palpate/tissue/element.hpp>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

namespace palpate {

namespace detail {

/// −V P g for the three nodes whose gradients are the rows of `gradients`, as the rows of a tensor.
template <class T>
[[gnu::always_inline]] inline Tensor3<T> nodal_forces(Tensor3<T> const& P, Tensor3<T> const& gradients, T const& volume) noexcept {
  return (T{} - volume) * (gradients * transpose(P));
}

template <class T, class Law>
class TetrahedronPacks;

}  // namespace detail

/// A tetrahedron of constant strain, total Lagrangian: what does not change is computed as it is made. With ∇N_a the gradients of the shape functions of
/// nodes 1 … 3 at rest and V the volume there, F = Σ_a (x_a − x_0) ⊗ ∇N_a, and the force on node a is −V P(F) ∇N_a; node 0 takes what is left.
/// Source     \cite bonet2008 ch. 9.
template <RealScalar Scalar, MaterialLaw<Scalar> Law>
class LinearTetrahedron {
 public:
  static constexpr int nodes = 4;
  static constexpr bool has_semidefinite_change = HasSemidefiniteStressChange<Law, Scalar> || IsIsotropicLaw<Law>;
  using Columns = NodeColumns<Scalar, 4>;

  /// Its nodes at rest [m], (x₁ − x₀) × (x₂ − x₀) · (x₃ − x₀) > 0; density in kg/m³.
  LinearTetrahedron(Columns const& rest, Law const& law, Scalar density) : law_(law), density_(density) {
    Tensor3<Scalar> const edges = rows(rest), cof = cofactor(edges);
    Scalar const six_volumes = determinant(edges, cof);
    volume_ = six_volumes / 6;
    gradients_ = (1 / six_volumes) * cof;
  }

  Scalar volume() const noexcept { return volume_; }
  Scalar mass() const noexcept { return density_ * volume_; }
  Law const& law() const noexcept { return law_; }
  /// ∇N of nodes 1, 2, 3 [1/m], in rows.
  Tensor3<Scalar> const& gradients() const noexcept { return gradients_; }

  Tensor3<Scalar> deformation_gradient(Columns const& x) const noexcept { return transpose(rows(x)) * gradients_; }
  Scalar energy(Columns const& x) const noexcept { return volume_ * law_.energy(deformation_gradient(x)); }
  Columns force(Columns const& x) const noexcept { return columns(detail::nodal_forces(law_.stress(deformation_gradient(x)), gradients_, volume_)); }
  NodeMatrix<Scalar, 4> stiffness(Columns const& x) const noexcept {
    Tensor3<Scalar> const F = deformation_gradient(x);
    return matrix([&](Tensor3<Scalar> const& dF) { return law_.stress_change(F, dF); });
  }
  NodeMatrix<Scalar, 4> semidefinite_stiffness(Columns const& x) const noexcept {
    if constexpr (has_semidefinite_change)
      return with_semidefinite_change(x, [&](auto const& change) { return matrix(change); });
    else
      return detail::semidefinite_part<Scalar, 12>(stiffness(x));
  }
  /// That without the matrix; it has no damping.
  Columns stiffness_product(Columns const& x, Columns const& d) const noexcept
    requires has_semidefinite_change
  {
    return with_semidefinite_change(x, [&](auto const& change) { return Columns(-columns(detail::nodal_forces(change(deformation_gradient(d)), gradients_, volume_))); });
  }
  Columns force(Columns const& x, Columns const& /*v*/) const noexcept { return force(x); }
  Columns damping_product(Columns const& /*x*/, Columns const& /*v*/) const noexcept { return Columns::Zero(); }

  using Packs = detail::TetrahedronPacks<Scalar, Law>;

 private:
  template <class Use>
  auto with_semidefinite_change(Columns const& x, Use const& use) const noexcept {
    Tensor3<Scalar> const F = deformation_gradient(x);
    if constexpr (HasSemidefiniteStressChange<Law, Scalar>) {
      return use([&](Tensor3<Scalar> const& dF) { return law_.semidefinite_stress_change(F, dF); });
    } else {
      detail::PrincipalTangent<Scalar> const tangent(law_, F);
      return use([&](Tensor3<Scalar> const& dF) { return tangent.stress_change(dF); });
    }
  }

  /// x₁ − x₀, x₂ − x₀, x₃ − x₀ in rows.
  static Tensor3<Scalar> rows(Columns const& x) noexcept {
    return {x(0, 1) - x(0, 0), x(1, 1) - x(1, 0), x(2, 1) - x(2, 0), x(0, 2) - x(0, 0), x(1, 2) - x(1, 0), x(2, 2) - x(2, 0),
            x(0, 3) - x(0, 0), x(1, 3) - x(1, 0), x(2, 3) - x(2, 0)};
  }
  static Columns columns(Tensor3<Scalar> const& f) noexcept {
    Columns all;
    all << -(f.xx + f.yx + f.zx), f.xx, f.yx, f.zx, -(f.xy + f.yy + f.zy), f.xy, f.yy, f.zy, -(f.xz + f.yz + f.zz), f.xz, f.yz, f.zz;
    return all;
  }
  template <class Change>
  NodeMatrix<Scalar, 4> matrix(Change const& stress_change) const noexcept {
    NodeMatrix<Scalar, 4> all;
    for (int k = 0; k < 12; ++k) {
      Columns move = Columns::Zero();
      move(k % 3, k / 3) = 1;
      Columns const pull = columns(detail::nodal_forces(stress_change(deformation_gradient(move)), gradients_, volume_));
      for (int j = 0; j < 12; ++j) all(j, k) = -pull(j % 3, j / 3);
    }
    return all;
  }

  Law law_;
  Scalar density_, volume_;
  Tensor3<Scalar> gradients_;
};

namespace detail {

/// Such tetrahedra as many at once as a register holds: their forces, and the products with their tangent where the law states a semidefinite one.
/// Columns    4 × n, contiguous, the fourth row 0.
template <class Scalar, class Law>
class TetrahedronPacks {
  static constexpr bool is_packed = IsLawOfNumbers<Law, Scalar, simd::Lanes<Scalar>>;

  template <bool packed, class = void>
  struct Numbers {
    using Type = Scalar;
    using LawType = Law;
  };
  template <class Any>
  struct Numbers<true, Any> {
    using Type = simd::Lanes<Scalar>;
    using LawType = typename LawOver<Law, simd::Lanes<Scalar>>::type;
  };
  using T = typename Numbers<is_packed>::Type;
  using PackLaw = typename Numbers<is_packed>::LawType;
  static constexpr int lanes = is_packed ? simd::lanes<Scalar> : 1;
  static constexpr int window = 12 * lanes;   // of elements that a pack is chosen from

 public:
  static constexpr bool has_tangent = HasSemidefiniteStressChange<PackLaw, T> || IsIsotropicLaw<PackLaw>;

  void reserve(std::size_t particles, std::size_t elements) {
    packs_.reserve((elements + lanes - 1) / lanes), tangents_.reserve(has_tangent ? packs_.capacity() : 0), last_pack_of_.reserve(particles);
  }

  /// Holds elements[which(k)], k < count, with their nodes, all below `particles`. Where it can, no two of a pack share a node: the sum at a node waits for
  /// the one before.
  template <class Which>
  void fill(int particles, std::span<std::array<int, 4> const> nodes, std::span<LinearTetrahedron<Scalar, Law> const> elements, int count, Which const& which) {
    packs_.clear();
    last_pack_of_.assign(static_cast<std::size_t>(particles), -1);
    std::array<int, window> waiting;
    int waits = 0, next = 0;
    while (next < count || waits > 0) {
      while (next < count && waits < window) waiting[static_cast<std::size_t>(waits++)] = which(next++);
      Pack& pack = packs_.emplace_back();
      int lane = 0, left = 0, last = 0;
      auto const take = [&](int e) {
        for (int const i : nodes[static_cast<std::size_t>(e)]) last_pack_of_[static_cast<std::size_t>(i)] = static_cast<int>(packs_.size());
        put(pack, lane++, nodes[static_cast<std::size_t>(e)], elements[static_cast<std::size_t>(e)], elements[static_cast<std::size_t>(e)].volume());
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
      while (lane < lanes) put(pack, lane++, nodes[static_cast<std::size_t>(last)], elements[static_cast<std::size_t>(last)], Scalar(0));   // the end: nothing more
    }
  }

  /// f += the forces at x, in the columns where own(column).
  template <class Own>
  void add_forces(Scalar const* x, Scalar* f, Own const& own) const noexcept {
    for (Pack const& pack : packs_) scatter(nodal_forces(pack.law.stress(gradient(pack, pack.gradients, x)), pack.gradients, pack.volume), pack, f, own);
  }

  void linearise(Scalar const* x) {
    tangents_.clear();
    if constexpr (has_tangent)
      for (Pack const& pack : packs_) tangents_.emplace_back(pack.law, gradient(pack, pack.gradients, x), pack.gradients);
  }
  /// out += factor · K d, and the diagonal of factor · K, in the columns where own(column).
  template <class Own>
  void add_product(Scalar factor, Scalar const* d, Scalar* out, Own const& own) const noexcept {
    if constexpr (has_tangent)
      for (std::size_t k = 0; k < packs_.size(); ++k) {
        Pack const& pack = packs_[k];
        Tangent const& tangent = tangents_[k];
        T const size = pack.volume * (T{} - factor);
        scatter(nodal_forces(tangent.stress_change(pack.law, gradient(pack, tangent.gradients, d)), tangent.gradients, size), pack, out, own);
      }
  }
  template <class Own>
  void add_diagonal(Scalar factor, Scalar* out, Own const& own) const noexcept {
    if constexpr (has_tangent)
      for (std::size_t k = 0; k < packs_.size(); ++k) {
        Pack const& pack = packs_[k];
        Tensor3<T> const& g = tangents_[k].gradients;
        T const zero{}, size = pack.volume * (zero + factor);
        auto const add = [&](int a, T const& x, T const& y, T const& z) {   // (x, y, z) the gradient of node a
          auto const entry = [&](Tensor3<T> const& dF) { return T(size * double_contraction(tangents_[k].stress_change(pack.law, dF), dF)); };
          simd::add_to_columns(out, pack.nodes[a], entry({x, y, z, zero, zero, zero, zero, zero, zero}), entry({zero, zero, zero, x, y, z, zero, zero, zero}),
                               entry({zero, zero, zero, zero, zero, zero, x, y, z}), own);
        };
        add(0, zero - (g.xx + g.yx + g.zx), zero - (g.xy + g.yy + g.zy), zero - (g.xz + g.yz + g.zz));
        add(1, g.xx, g.xy, g.xz), add(2, g.yx, g.yy, g.yz), add(3, g.zx, g.zy, g.zz);
      }
  }

 private:
  struct Pack {
    Tensor3<T> gradients;
    T volume;
    PackLaw law;
    int nodes[4][lanes];
  };

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

  static void put(Pack& pack, int lane, std::array<int, 4> const& nodes, LinearTetrahedron<Scalar, Law> const& element, Scalar volume) noexcept {
    set(pack.gradients, lane, element.gradients()), set(pack.law, lane, element.law()), set(pack.volume, lane, volume);
    for (std::size_t a = 0; a < 4; ++a) pack.nodes[a][lane] = nodes[a];
  }

  /// What products are made of, and the gradients that they take: of a principal tangent turned by V.
  struct StatedTangent {
    Tensor3<T> F, gradients;
    StatedTangent(PackLaw const&, Tensor3<T> const& at, Tensor3<T> const& g) noexcept : F(at), gradients(g) {}
    Tensor3<T> stress_change(PackLaw const& law, Tensor3<T> const& dF) const noexcept { return law.semidefinite_stress_change(F, dF); }
  };
  struct TurnedTangent {
    PrincipalTangent<T> principal;
    Tensor3<T> gradients;
    TurnedTangent(PackLaw const& law, Tensor3<T> const& F, Tensor3<T> const& g) noexcept : principal(law, F), gradients(g * principal.V) {}
    Tensor3<T> stress_change(PackLaw const&, Tensor3<T> const& dF) const noexcept { return principal.U * principal.in_frames(transpose(principal.U) * dF); }
  };
  using Tangent = std::conditional_t<HasSemidefiniteStressChange<PackLaw, T>, StatedTangent, TurnedTangent>;

  /// Σ_a (x_a − x_0) ⊗ ∇N_a.
  static Tensor3<T> gradient(Pack const& pack, Tensor3<T> const& gradients, Scalar const* x) noexcept {
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
  static void scatter(Tensor3<T> const& f, Pack const& pack, Scalar* columns, Own const& own) noexcept {
    simd::add_to_columns(columns, pack.nodes[0], T(T{} - (f.xx + f.yx + f.zx)), T(T{} - (f.xy + f.yy + f.zy)), T(T{} - (f.xz + f.yz + f.zz)), own);
    simd::add_to_columns(columns, pack.nodes[1], f.xx, f.xy, f.xz, own);
    simd::add_to_columns(columns, pack.nodes[2], f.yx, f.yy, f.yz, own);
    simd::add_to_columns(columns, pack.nodes[3], f.zx, f.zy, f.zz, own);
  }

  std::vector<Pack> packs_;
  std::vector<Tangent> tangents_;   // of each since linearise()
  std::vector<int> last_pack_of_;   // of each particle, while they are filled
};

}  // namespace detail

}  // namespace palpate
