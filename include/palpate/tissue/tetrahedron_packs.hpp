// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/huge_page_vector.hpp>
#include <palpate/core/simd.hpp>
#include <palpate/core/simd_columns.hpp>
#include <palpate/core/tensor3.hpp>
#include <palpate/material/concept.hpp>
#include <palpate/material/semidefinite_tangent.hpp>
#include <palpate/material/with_pressure.hpp>
#include <palpate/tissue/concept.hpp>
#include <palpate/tissue/linear_tetrahedron.hpp>
#include <palpate/tissue/stiffness_rows.hpp>
#include <palpate/tissue/tetrahedron_tangent.hpp>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstring>
#include <iterator>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace palpate::detail {

/// Whether the tangent of a law is known without eigenvalues of 9 × 9 matrices, and under nodal pressure, where it can have that, too.
template <class T, class Law>
inline constexpr bool has_known_tangents = has_known_tangent<T, Law>;
template <class T, class Law>
  requires HasBulkModulus<Law, T>
inline constexpr bool has_known_tangents<T, Law> = has_known_tangent<T, Law> && has_known_tangent<T, WithPressure<T, Law>>;

/// What tetrahedra of a law are computed in: as many numbers at once as a register holds, where the law is one of such packs and its tangents are known;
/// else one.
template <class Scalar, class Law>
struct PackOfLaw {
  using Number = Scalar;
  using type = Law;
};
template <class Scalar, class Law>
  requires(IsLawOfNumbers<Law, Scalar, simd::Lanes<Scalar>> && has_known_tangents<simd::Lanes<Scalar>, typename LawOver<Law, simd::Lanes<Scalar>>::type>)
struct PackOfLaw<Scalar, Law> {
  using Number = simd::Lanes<Scalar>;
  using type = typename LawOver<Law, Number>::type;
};

/// Whether the tangents of a law are known in the frames of its principal stretches, under nodal pressure, too.
template <class T, class Law>
inline constexpr bool has_principal_tangents = std::derived_from<SemidefiniteTangent<T, Law>, PrincipalTangent<T>>;
template <class T, class Law>
  requires HasBulkModulus<Law, T>
inline constexpr bool has_principal_tangents<T, Law> =
    std::derived_from<SemidefiniteTangent<T, Law>, PrincipalTangent<T>> && std::derived_from<SemidefiniteTangent<T, WithPressure<T, Law>>, PrincipalTangent<T>>;

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
  using Floats = simd::Lanes<float>;
  static constexpr bool can_average = HasBulkModulus<PackLaw, T>;

 public:
  using Element = LinearTetrahedron<Scalar, Law>;
  /// Tangents are kept in float besides, twice as many in a register, where numbers are doubles.
  static constexpr bool has_floats = has_floats_beside<T>;
  /// What products are iterated in, and the tangent of a pack of those.
  using Number = std::conditional_t<has_floats, float, Scalar>;
  using Rows = StiffnessRows<Number>;

  /// Which tetrahedra, by name, are in a pack: −1 where there is none.
  struct Names {
    int name[lanes];
    bool counts[lanes];
  };

  void reserve(std::size_t particles, std::size_t elements, bool assembles, bool has_stars) {
    slot_of_.reserve(elements);
    packs_.reserve((elements + lanes - 1) / lanes), tangents_.reserve(packs_.capacity()), floats_.reserve(has_floats ? packs_.capacity() / 2 + 1 : 0), names_.reserve(packs_.capacity()), inside_.reserve(packs_.capacity()), last_pack_of_.reserve(particles);
    if (assembles) places_.reserve(packs_.capacity());
    if (has_stars) stars_.reserve(packs_.capacity()), growths_.reserve(packs_.capacity()), measured_.reserve(lanes * packs_.capacity());
    if (has_stars && has_floats) float_growths_.reserve(floats_.capacity()), float_measured_.reserve(2 * lanes * floats_.capacity());
  }

  /// Holds elements[name(which(k))], k < count, with nodes[which(k)], all below `particles`. Where it can, no two of a pack share a node: the sum at a node
  /// waits for the one before. name(e) is what lowest() calls it; its energy counts where counts(e). What they make is added to columns first … last − 1.
  template <class Which, class Name, class Counts>
  void fill(int particles, std::span<std::array<int, 4> const> nodes, std::span<Element const> elements, int count, Which const& which, Name const& name, Counts const& counts,
            int first_own, int last_own) {
    clear();
    set_own(first_own, last_own);
    if (count == 0) return;   // no memory for none
    slot_of_.resize(elements.size(), -1);
    last_pack_of_.assign(static_cast<std::size_t>(particles), -1);
    std::array<int, window> waiting;
    int waits = 0, next = 0;
    while (next < count || waits > 0) {
      while (next < count && waits < window) waiting[static_cast<std::size_t>(waits++)] = which(next++);
      Pack& pack = packs_.emplace_back();
      Names& names = names_.emplace_back();
      int lane = 0, left = 0;
      auto const take = [&](int e) {
        auto const k = static_cast<std::size_t>(e);
        for (int const i : nodes[k]) last_pack_of_[static_cast<std::size_t>(i)] = static_cast<int>(packs_.size());
        Element const& element = elements[static_cast<std::size_t>(name(e))];
        names.name[lane] = name(e), names.counts[lane] = counts(e);
        slot_of_[static_cast<std::size_t>(name(e))] = static_cast<int>(packs_.size() - 1) * lanes + lane;
        put(pack, lane++, nodes[k], element, element.volume());
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
      for (; lane < lanes; ++lane) {   // the end: nothing more, which is the first again, without volume
        names.name[lane] = -1, names.counts[lane] = false;
        copy_first(pack, lane);
      }
      inside_.push_back(is_inside(pack));
    }
  }
  void clear() noexcept {
    for (Names const& names : names_)
      for (int const e : names.name)
        if (e >= 0) slot_of_[static_cast<std::size_t>(e)] = -1;
    packs_.clear(), names_.clear(), stars_.clear(), inside_.clear(), places_.clear();
  }

  bool empty() const noexcept { return packs_.empty(); }

  // --- after edits; not where tangents are added to rows ----------------------------------------------------------------
  void set_own(int first, int last) noexcept { own_ = {4 * first, 4 * (last - first)}; }
  bool holds(int name) const noexcept { return static_cast<std::size_t>(name) < slot_of_.size() && slot_of_[static_cast<std::size_t>(name)] >= 0; }
  /// What one that is held is now.
  void update(int name, std::array<int, 4> const& nodes, Element const& element, bool counts) noexcept {
    auto const k = static_cast<std::size_t>(slot(name) / lanes);
    int const lane = slot(name) % lanes;
    names_[k].counts[lane] = counts;
    put(packs_[k], lane, nodes, element, element.volume());
    for (int other = 1; lane == 0 && other < lanes; ++other)
      if (names_[k].name[other] < 0) copy_first(packs_[k], other);
    inside_[k] = is_inside(packs_[k]);
  }
  /// One more: in one of the last packs, where there is room and no node is shared, or in a new one.
  void add(int name, std::array<int, 4> const& nodes, Element const& element, bool counts, bool has_stars) {
    std::size_t k = packs_.size() - std::min(packs_.size(), std::size_t{12});
    int lane = lanes;
    for (; k < packs_.size(); ++k) {
      lane = static_cast<int>(std::find(names_[k].name, names_[k].name + lanes, -1) - names_[k].name);
      auto const shares = [&](int i) { return std::ranges::any_of(packs_[k].starts, [&](auto const& corner) { return std::ranges::find(corner, 4 * i) != std::end(corner); }); };
      if (lane < lanes && std::none_of(nodes.begin(), nodes.end(), shares)) break;
    }
    if (k == packs_.size()) {
      Names& names = names_.emplace_back();
      std::fill_n(names.name, lanes, -1), std::fill_n(names.counts, lanes, false);
      packs_.emplace_back(), inside_.push_back(false);
      if (has_stars) stars_.emplace_back(), measured_.resize(measured_.size() + lanes);
      lane = 0;
    }
    names_[k].name[lane] = name;
    slot_of_.resize(std::max(slot_of_.size(), static_cast<std::size_t>(name) + 1), -1);
    slot_of_[static_cast<std::size_t>(name)] = static_cast<int>(k) * lanes + lane;
    update(name, nodes, element, counts);
  }
  HugePageVector<Names> const& names() const noexcept { return names_; }
  /// Holds these, in these places; each has to be updated, with stars too.
  void take(HugePageVector<Names> const& names, bool has_stars) {
    clear();
    names_ = names;
    packs_.resize(names.size()), inside_.resize(names.size());
    if (has_stars) stars_.resize(names.size()), measured_.resize(names.size() * lanes);
    for (std::size_t k = 0; k < names.size(); ++k)
      for (int lane = 0; lane < lanes; ++lane) {
        int const e = names[k].name[lane];
        if (e < 0) continue;
        slot_of_.resize(std::max(slot_of_.size(), static_cast<std::size_t>(e) + 1), -1);
        slot_of_[static_cast<std::size_t>(e)] = static_cast<int>(k) * lanes + lane;
      }
  }
  /// What of the stress of these elements, by name, has faded.
  void take_faded(std::span<Element const> elements) noexcept
    requires HasFadedStress<Law>
  {
    for (std::size_t k = 0; k < packs_.size(); ++k)
      for (int lane = 0; lane < lanes; ++lane) set(packs_[k].law.faded, lane, elements[static_cast<std::size_t>(names_[k].name[names_[k].name[lane] < 0 ? 0 : lane])].law().faded);
  }
  /// Their stars: at_corners(name).
  template <class AtCorners>
  void set_stars(AtCorners const& at_corners) {
    measured_.resize(packs_.size() * lanes), stars_.resize(packs_.size());
    for (Names const& names : names_)
      for (int const e : names.name)
        if (e >= 0) set_stars_of(e, at_corners(e));
  }
  /// Of one that is held.
  void set_stars_of(int name, std::array<int, 4> const& at_corners) noexcept {
    auto const p = static_cast<std::size_t>(slot(name) / lanes);
    int const lane = slot(name) % lanes;
    for (std::size_t k = 0; k < 4; ++k) stars_[p].star[k][lane] = at_corners[k];
    for (int other = 1; lane == 0 && other < lanes; ++other)
      for (std::size_t k = 0; names_[p].name[other] < 0 && k < 4; ++k) stars_[p].star[k][other] = at_corners[k];
  }
  std::array<int, 4> stars_of(int name) const noexcept {
    auto const& corners = stars_[static_cast<std::size_t>(slot(name) / lanes)];
    int const lane = slot(name) % lanes;
    return {corners.star[0][lane], corners.star[1][lane], corners.star[2][lane], corners.star[3][lane]};
  }
  /// Where the measure of one that is held is among the measured().
  int slot(int name) const noexcept { return slot_of_[static_cast<std::size_t>(name)]; }
  template <RealScalar N>
  N const* measured() const noexcept {
    if constexpr (std::same_as<N, Scalar>)
      return measured_.data();
    else
      return float_measured_.data();
  }

  /// V J of each at x.
  void measure_volumes(Scalar const* x) noexcept {
    for (std::size_t k = 0; k < packs_.size(); ++k) {
      Tensor3<T> const F = gradient(packs_[k], x);
      keep_measured(k, T(packs_[k].volume * determinant(F, cofactor(F))));
    }
  }
  /// V cof F(x) : dF(v) of each: how fast it grows.
  void measure_growth(Scalar const* x, Scalar const* v) noexcept {
    for (std::size_t k = 0; k < packs_.size(); ++k)
      keep_measured(k, T(packs_[k].volume * double_contraction(cofactor(gradient(packs_[k], x)), gradient(packs_[k], v))));
  }
  /// The same for a change d of the places that linearise() was at.
  void measure_changes(Scalar const* d) noexcept {
    for (std::size_t k = 0; k < growths_.size(); ++k) keep_measured(k, T(double_contraction(growths_[k], edges(packs_[k], d))));
  }
  void measure_changes(float const* d) noexcept
    requires has_floats
  {
    for (std::size_t k = 0; k < float_growths_.size(); ++k) simd::store(float_measured_.data() + 2 * lanes * k, Floats(double_contraction(float_growths_[k], edges(floats_[k], d))));
  }

  /// f += the forces at x, in its own columns, with a quarter of the pressure of each star; and with a share `damping` [s] of the tangent's
  /// at the velocities v.
  void add_forces(Scalar const* x, Scalar const* v, Scalar damping, Scalar const* pressure, Scalar const* pressure_rate, Scalar* f) const noexcept {
    if (damping != 0) return add_damped_forces(x, v, damping, pressure, pressure_rate, f);
    for (std::size_t k = 0; k < packs_.size(); ++k) {
      Pack const& pack = packs_[k];
      prefetch_after(packs_, k);
      scatter(k, nodal_forces(stress(k, gradient(pack, x), pressure), pack.gradients, pack.volume), pack, f);
    }
  }
  /// At particle i the sum of that of `some` tetrahedra of a list of elements and their nodes, each of which it is a corner of: at columns of x and v, by
  /// name, of which nothing but col(j) is asked. pressure_of(e) and rate_of(e) are the stars', where it `averages`.
  template <class List, class X, class V, class PressureOf, class RateOf>
  static Vector3<Scalar> force_at(int i, std::span<int const> some, List const& list, X const& x, V const& v, Scalar damping, bool averages, PressureOf const& pressure_of,
                                  RateOf const& rate_of) noexcept {
    auto const at = [](int k) { return static_cast<std::size_t>(k); };
    Vector3<Scalar> sum = Vector3<Scalar>::Zero();
    for (; !some.empty(); some = some.subspan(std::min(some.size(), std::size_t{lanes}))) {
      Few few{};
      int const count = static_cast<int>(std::min(some.size(), std::size_t{lanes}));
      for (int lane = 0; lane < count; ++lane) {
        int const e = some[at(lane)];
        auto const& nodes = list.nodes[at(e)];
        Element const& element = list.elements[at(e)];
        put(few.pack, lane, {4 * lane, 4 * lane + 1, 4 * lane + 2, 4 * lane + 3}, element, element.volume());
        for (int k = 0; k < 4; ++k) {
          Vector3<Scalar> const place = x.col(nodes[at(k)]), speed = damping != 0 ? Vector3<Scalar>(v.col(nodes[at(k)])) : place;
          std::copy_n(place.data(), 3, &few.x[at(16 * lane + 4 * k)]), std::copy_n(speed.data(), 3, &few.v[at(16 * lane + 4 * k)]);
        }
        if (!averages) continue;
        set(few.pressure, lane, pressure_of(e));
        if (damping != 0) set(few.rate, lane, rate_of(e));
      }
      for (int lane = count; lane < lanes; ++lane) copy_first(few.pack, lane);
      Tensor3<T> const f = forces_of(few, damping, averages);
      for (int lane = 0; lane < count; ++lane) {
        auto const& nodes = list.nodes[at(some[at(lane)])];
        auto const row = [lane](T const& fx, T const& fy, T const& fz) { return Vector3<Scalar>(lane_of(fx, lane), lane_of(fy, lane), lane_of(fz, lane)); };
        Vector3<Scalar> const a = row(f.xx, f.xy, f.xz), b = row(f.yx, f.yy, f.yz), c = row(f.zx, f.zy, f.zz);
        sum += nodes[0] == i ? Vector3<Scalar>(-(a + b + c)) : nodes[1] == i ? a : nodes[2] == i ? b : c;
      }
    }
    return sum;
  }

  /// From now on their tangents are added to these rows, those of their own columns; of packs without stars.
  void find_places(Rows const& rows) {
    places_.resize((packs_.size() + halves - 1) / halves);
    for (std::size_t k = 0; k < halves * places_.size(); ++k)
      for (std::size_t p = 0; p < 16; ++p)
        for (int lane = 0; lane < lanes; ++lane) {
          int* const place = &places_[k / halves].starts[p][static_cast<int>(k % halves) * lanes + lane];
          *place = -1;
          if (k == packs_.size() || names_[k].name[lane] < 0) continue;
          int const i = packs_[k].starts[p / 4][lane], j = packs_[k].starts[p % 4][lane];
          if (own_(i)) *place = rows.start(i / 4, j / 4);
        }
  }
  void linearise(Scalar const* x, Scalar const* pressure, Rows& rows) {
    tangents_.resize(packs_.size());
    std::size_t const pairs = has_floats ? (tangents_.size() + 1) / 2 : 0;
    floats_.resize(pairs);
    if (!stars_.empty()) growths_.resize(packs_.size()), float_growths_.resize(pairs), float_measured_.resize(2 * lanes * pairs);
    TetrahedronTangent<Floats> blocks;   // of what is added to rows
    auto const in_blocks = [&](std::size_t k, [[maybe_unused]] auto const& tangent) -> decltype(auto) {
      if constexpr (is_principal) {
        TetrahedronTangent<T> own;
        set(own, packs_[k], tangent);
        return own;
      } else {
        return (tangents_[k]);
      }
    };
    auto const put = [&](auto& to, std::size_t k, auto const& from) {
      put_half(to, static_cast<int>(k % 2), from);
      if (k % 2 == 0 && k + 1 == packs_.size()) put_half(to, 1, nothing_at<std::remove_cvref_t<decltype(from)>>(packs_[k]));
    };
    auto const keep = [&](std::size_t k, auto const& tangent) {
      set(tangents_[k], packs_[k], tangent);
      if (places_.empty()) {
        if constexpr (has_floats) put(floats_[k / 2], k, tangents_[k]);
      } else if constexpr (has_floats) {
        put(blocks, k, in_blocks(k, tangent));
        if (k % 2 == 1 || k + 1 == packs_.size()) add(blocks, places_[k / 2], rows);
      } else {
        add(in_blocks(k, tangent), places_[k], rows);
      }
    };
    std::array<Tensor3<T>, beside> F;
    for (std::size_t k = 0; k < packs_.size(); k += beside) {
      std::size_t const count = std::min(packs_.size() - k, beside);
      for (std::size_t n = 0; n < beside; ++n) prefetch_after(packs_, k + n), F[n] = gradient(packs_[k + std::min(n, count - 1)], x);
      if (stars_.empty()) {   // without the pressure's part
        tangents_of<SemidefiniteTangent<T, PackLaw>>(F, count, [&](std::size_t n) { return packs_[k + n].law; }, [&](std::size_t n, auto const& tangent) { keep(k + n, tangent); });
      } else if constexpr (can_average) {
        tangents_of<FullTangent>(F, count, [&](std::size_t n) { return law_of(packs_[k + n], of_corners<T>(k + n, pressure)); }, [&](std::size_t n, auto const& tangent) {
          keep(k + n, tangent);
          growths_[k + n] = packs_[k + n].volume * (packs_[k + n].gradients * transpose(cofactor(F[n])));
          if constexpr (has_floats) put_half(float_growths_[(k + n) / 2], static_cast<int>(n % 2), growths_[k + n]);
        });
      }
    }
    if constexpr (has_floats)
      if (tangents_.size() % 2 == 1 && !stars_.empty()) put_half(float_growths_.back(), 1, Tensor3<T>{});
  }
  /// out += factor · K d, in its own columns, with a quarter of the change of pressure of each star.
  void add_product(Scalar factor, Scalar const* d, Scalar const* pressure_change, Scalar* out) const noexcept {
    T const size = T{} + factor;
    for (std::size_t k = 0; k < tangents_.size(); ++k) {
      Tangent const& tangent = tangents_[k];
      prefetch_after(tangents_, k);
      Tensor3<T> pull = tangent * edges(tangent, d);
      if constexpr (can_average)
        if (!stars_.empty()) [[unlikely]]
          pull = pull + of_corners<T>(k, pressure_change) * growths_[k];
      scatter(k, size * pull, tangent, out);
    }
  }
  /// The same in numbers half as wide.
  void add_product(float factor, float const* d, float const* pressure_change, float* out) const noexcept
    requires has_floats
  {
    Floats const size = Floats{} + factor;
    for (std::size_t k = 0; k < floats_.size(); ++k) {
      prefetch_after(floats_, k);
      Tensor3<Floats> pull = floats_[k] * edges(floats_[k], d);
      if constexpr (can_average)
        if (!stars_.empty()) [[unlikely]]
          pull = pull + of_corners<Floats>(k, pressure_change) * float_growths_[k];
      pull = size * pull;
      if (inside_[2 * k] && inside_[std::min(2 * k + 1, inside_.size() - 1)])
        add_to_nodes(pull, floats_[k], out, [](int) { return true; });
      else
        add_to_own_nodes(pull, floats_[k], out);
    }
  }
  /// The diagonal of that; a star's `weight` is κ/(4 V). What the tetrahedra of a star have in common off their own diagonals is left out.
  void add_diagonal(Scalar factor, Scalar const* weight, Scalar* out) const noexcept {
    T const size = T{} + factor;
    for (std::size_t k = 0; k < packs_.size(); ++k) {
      auto [rows, zero] = tangents_[k].diagonal();
      if constexpr (can_average)
        if (!stars_.empty()) {
          Tensor3<T> const& g = growths_[k];
          T const each = of_corners<T>(k, weight), x = g.xx + g.yx + g.zx, y = g.xy + g.yy + g.zy, z = g.xz + g.yz + g.zz;
          rows = rows + each * Tensor3<T>{g.xx * g.xx, g.xy * g.xy, g.xz * g.xz, g.yx * g.yx, g.yy * g.yy, g.yz * g.yz, g.zx * g.zx, g.zy * g.zy, g.zz * g.zz};
          zero = {zero.x + each * x * x, zero.y + each * y * y, zero.z + each * z * z};
        }
      rows = size * rows;
      auto const& starts = packs_[k].starts;
      simd::add_to_columns(out, starts[0], T(size * zero.x), T(size * zero.y), T(size * zero.z), own_);
      simd::add_to_columns(out, starts[1], rows.xx, rows.xy, rows.xz, own_);
      simd::add_to_columns(out, starts[2], rows.yx, rows.yy, rows.yz, own_);
      simd::add_to_columns(out, starts[3], rows.zx, rows.zy, rows.zz, own_);
    }
  }

  /// The energy of those that count, without that of their stars [J].
  Scalar energy(Scalar const* x) const noexcept {
    Scalar sum = 0;
    for (std::size_t k = 0; k < packs_.size(); ++k) {
      prefetch_after(packs_, k);
      Tensor3<T> const F = gradient(packs_[k], x);
      T const each = packs_[k].volume * energy_density(k, F);
      for (int lane = 0; lane < lanes; ++lane)
        if (names_[k].counts[lane]) sum += lane_of(each, lane);
    }
    return sum;
  }
  /// Of one of so many parts.
  LowestDeterminant<Scalar> lowest(Scalar const* x, int part, int parts) const noexcept {
    LowestDeterminant<Scalar> found;
    auto const first_of = [&](int n) { return packs_.size() * static_cast<std::size_t>(n) / static_cast<std::size_t>(parts); };
    for (std::size_t k = first_of(part); k < first_of(part + 1); ++k) {
      prefetch_after(packs_, k);
      Tensor3<T> const F = gradient(packs_[k], x);
      T const J = determinant(F, cofactor(F));
      if (simd::all_below(T(number<T>(static_cast<double>(found.value)) - J), Scalar(0))) continue;
      for (int lane = 0; lane < lanes; ++lane)
        if (!(lane_of(J, lane) >= found.value) && names_[k].name[lane] >= 0) found = {names_[k].name[lane], lane_of(J, lane)};
    }
    return found;
  }

 private:
  struct Pack {
    Tensor3<T> gradients;
    T volume;
    PackLaw law;
    int starts[4][lanes];   // of the nodes' columns
  };
  struct Corners {
    int star[4][lanes];
  };
  static constexpr std::size_t halves = has_floats ? 2 : 1;   // packs in one of those that products are of
  /// Where the block of each two nodes is in the rows, −1 where it is in none.
  struct Places {
    int starts[16][static_cast<int>(halves) * lanes];
  };
  using FullTangent = SemidefiniteTangent<T, WithPressure<T, PackLaw>>;   // with stars
  /// Wide registers compute faster than they are filled; narrow ones do not.
  static constexpr bool is_principal = sizeof(T) >= 32 && has_principal_tangents<T, PackLaw>;
  template <class N>
  using TangentOf = std::conditional_t<is_principal, PrincipalTetrahedronTangent<N>, TetrahedronTangent<N>>;
  using Tangent = TangentOf<T>;
  /// How many packs' tangents are taken beside each other: each of their rotations waits for the one before it.
  static constexpr std::size_t beside = 4;
  /// use(n, tangent) of so many packs, or the first `count`.
  template <class Tangents>
  static void tangents_of(std::array<Tensor3<T>, beside> const& F, std::size_t count, auto const& law, auto const& use) noexcept {
    if constexpr (std::derived_from<Tangents, PrincipalTangent<T>>) {
      auto const stretches = principal_stretches(F);
      for (std::size_t n = 0; n < count; ++n) use(n, Tangents(law(n), F[n], stretches[n]));
    } else {
      for (std::size_t n = 0; n < count; ++n) use(n, Tangents(law(n), F[n]));
    }
  }
  static void set(auto& of, Pack const& pack, auto const& tangent) noexcept {
    of.set(tangent, pack.gradients, pack.volume);
    std::memcpy(of.starts, pack.starts, sizeof(of.starts));
  }
  template <class Kind>
  static Kind nothing_at(Pack const& pack) noexcept {
    Kind none{};
    std::memcpy(none.starts, pack.starts, sizeof(none.starts));
    return none;
  }

  /// Blocks of what may be zero anywhere are added one after the other: all 16 of them, for a row is one block's.
  template <class N>
  static void add(TetrahedronTangent<N> const& t, Places const& places, Rows& rows) noexcept {
    N const minus = number<N>(-1);
    Tensor3<N> const aa = t.aa, bb = t.bb, cc = t.cc;
    Tensor3<N> const oa = minus * ((aa + transpose(t.ab)) + transpose(t.ac)), ob = minus * ((t.ab + bb) + transpose(t.bc)), oc = minus * ((t.ac + t.bc) + cc);
    Tensor3<N> const above[] = {minus * ((oa + ob) + oc), oa, ob, oc, aa, t.ab, t.ac, bb, t.bc, cc};
    constexpr int pairs[] = {0, 1, 2, 3, 5, 6, 7, 10, 11, 15}, mirrored[] = {0, 4, 8, 12, 0, 9, 13, 0, 14, 0};
    constexpr int column = 4 * Rows::beside;
    auto const is_inside = [](int start) { return start >= 0; };
    Number* const to = rows.numbers();
    for (int k = 0; k < 10; ++k) {
      Tensor3<N> const& m = above[k];
      int const* at = places.starts[pairs[k]];
      simd::add_to_columns(to, at, m.xx, m.yx, m.zx, is_inside);
      simd::add_to_columns(to + column, at, m.xy, m.yy, m.zy, is_inside);
      simd::add_to_columns(to + 2 * column, at, m.xz, m.yz, m.zz, is_inside);
      if (mirrored[k] == 0) continue;
      at = places.starts[mirrored[k]];
      simd::add_to_columns(to, at, m.xx, m.xy, m.xz, is_inside);
      simd::add_to_columns(to + column, at, m.yx, m.yy, m.yz, is_inside);
      simd::add_to_columns(to + 2 * column, at, m.zx, m.zy, m.zz, is_inside);
    }
  }

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
  [[gnu::always_inline]] static Tensor3<T> stress_of(Pack const& pack, Tensor3<T> const& F, bool averages, auto const& pressure) noexcept {
    if constexpr (can_average)
      if (averages) return law_of(pack, pressure()).stress(F);
    return pack.law.stress(F);
  }
  [[gnu::always_inline]] Tensor3<T> stress(std::size_t k, Tensor3<T> const& F, Scalar const* pressure) const noexcept {
    return stress_of(packs_[k], F, !stars_.empty(), [&] { return of_corners<T>(k, pressure); });
  }
  T energy_density(std::size_t k, Tensor3<T> const& F) const noexcept {
    if constexpr (can_average)
      if (!stars_.empty()) return law_of(packs_[k], T{}).energy(F);
    return packs_[k].law.energy(F);
  }
  void keep_measured(std::size_t k, T const& numbers) noexcept { simd::store(measured_.data() + lanes * k, numbers); }
  /// The sum over the corners' stars, of so many tetrahedra from k times as many on as N has numbers.
  template <class N>
  N of_corners(std::size_t k, NumberOf<N> const* of_star) const noexcept {
    constexpr std::size_t packs = sizeof(N) / sizeof(NumberOf<N>) / lanes;
    alignas(N) std::array<NumberOf<N>, packs * lanes> sums;
    for (std::size_t p = 0; p < packs; ++p) {
      auto const& corners = stars_[std::min(packs * k + p, stars_.size() - 1)].star;
      for (std::size_t lane = 0; lane < lanes; ++lane)
        sums[p * lanes + lane] = (of_star[corners[0][lane]] + of_star[corners[1][lane]]) + (of_star[corners[2][lane]] + of_star[corners[3][lane]]);
    }
    N all;
    simd::load(all, sums.data());
    return all;
  }
  static bool is_still(Tensor3<T> const& rate) noexcept { return simd::all_below(double_contraction(rate, rate), std::numeric_limits<Scalar>::min()); }
  [[gnu::noinline]] void add_damped_forces(Scalar const* x, Scalar const* v, Scalar damping, Scalar const* pressure, Scalar const* pressure_rate, Scalar* f) const noexcept {
    T const share = number<T>(static_cast<double>(damping));
    std::array<Tensor3<T>, beside> F, rate, damped;
    for (std::size_t k = 0; k < packs_.size(); k += beside) {
      std::size_t const count = std::min(packs_.size() - k, beside);
      for (std::size_t n = 0; n < beside; ++n) {
        Pack const& pack = packs_[k + std::min(n, count - 1)];
        F[n] = gradient(pack, x), rate[n] = gradient(pack, v), damped[n] = Tensor3<T>{};
      }
      auto const damp = [&](std::size_t n, auto const& tangent) { damped[n] = share * tangent.stress_change(rate[n]); };
      if (!std::all_of(rate.begin(), rate.end(), is_still)) {
        if (stars_.empty())
          tangents_of<SemidefiniteTangent<T, PackLaw>>(F, count, [&](std::size_t n) { return packs_[k + n].law; }, damp);
        else if constexpr (can_average)
          tangents_of<FullTangent>(F, count, [&](std::size_t n) { return law_of(packs_[k + n], of_corners<T>(k + n, pressure)); }, damp);
      }
      for (std::size_t n = 0; n < count; ++n) {
        Pack const& pack = packs_[k + n];
        Tensor3<T> P = stress(k + n, F[n], pressure) + damped[n];
        if constexpr (can_average)
          if (!stars_.empty()) P = P + (share * of_corners<T>(k + n, pressure_rate)) * cofactor(F[n]);
        scatter(k + n, nodal_forces(P, pack.gradients, pack.volume), pack, f);
      }
    }
  }
  /// Tetrahedra at a particle, their corners' columns, and what their stars add.
  struct Few {
    Pack pack;
    std::array<Scalar, std::size_t{16} * lanes> x, v;
    T pressure, rate;
  };
  [[gnu::noinline]] static Tensor3<T> forces_of(Few const& few, Scalar damping, bool averages) noexcept {
    Tensor3<T> const F = gradient(few.pack, few.x.data());
    auto const pressure = [&few] { return few.pressure; };
    Tensor3<T> P = stress_of(few.pack, F, averages, pressure);
    if (damping != 0) {
      T const share = number<T>(static_cast<double>(damping));
      if (Tensor3<T> const rate = gradient(few.pack, few.v.data()); !is_still(rate)) {
        if (!averages)
          P = P + share * SemidefiniteTangent<T, PackLaw>(few.pack.law, F).stress_change(rate);
        else if constexpr (can_average)
          P = P + share * FullTangent(law_of(few.pack, few.pressure), F).stress_change(rate);
      }
      if (averages) P = P + (share * few.rate) * cofactor(F);
    }
    return nodal_forces(P, few.pack.gradients, few.pack.volume);
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
    for (std::size_t a = 0; a < 4; ++a) pack.starts[a][lane] = 4 * nodes[a];
  }
  /// Makes a lane the first one, without volume.
  static void copy_first(Pack& pack, int lane) noexcept {
    copy_first(pack.gradients, lane), copy_first(pack.law, lane), set(pack.volume, lane, Scalar(0));
    for (auto& starts : pack.starts) starts[lane] = starts[0];
  }
  template <class Packed>
  static void copy_first(Packed& packed, int lane) noexcept {
    char* const numbers = reinterpret_cast<char*>(&packed);
    for (std::size_t n = 0; n < sizeof(Packed) / sizeof(T); ++n)
      std::memcpy(numbers + (n * lanes + static_cast<std::size_t>(lane)) * sizeof(Scalar), numbers + n * lanes * sizeof(Scalar), sizeof(Scalar));
  }
  /// Asks for what is computed with next, where there is more of it than the nearer caches hold: by itself the processor follows a stream only to the end
  /// of a page. Narrow registers compute longer than they wait.
  template <class Held>
  [[gnu::always_inline]] static void prefetch_after(HugePageVector<Held> const& all, std::size_t k) noexcept {
    constexpr std::size_t ahead = (3000 + sizeof(Held) - 1) / sizeof(Held);
    if constexpr (sizeof(T) >= 32)
      if (all.size() * sizeof(Held) > std::size_t{1} << 19)
        for (std::size_t line = 0; line < sizeof(Held); line += 64) __builtin_prefetch(reinterpret_cast<char const*>(all.data() + k + ahead) + line, 0, 0);
  }
  bool is_inside(Pack const& pack) const noexcept { return std::all_of(&pack.starts[0][0], &pack.starts[0][0] + 4 * lanes, own_); }

  /// x_a − x_0, in rows.
  template <class Held, RealScalar S, class Numbers = std::conditional_t<std::same_as<S, Scalar>, T, Floats>>
  [[gnu::always_inline]] static Tensor3<Numbers> edges(Held const& pack, S const* x) noexcept {
    Numbers ox, oy, oz;
    Tensor3<Numbers> rows;
    simd::load_columns(ox, oy, oz, x, pack.starts[0]);
    simd::load_columns(rows.xx, rows.xy, rows.xz, x, pack.starts[1]);
    simd::load_columns(rows.yx, rows.yy, rows.yz, x, pack.starts[2]);
    simd::load_columns(rows.zx, rows.zy, rows.zz, x, pack.starts[3]);
    return {rows.xx - ox, rows.xy - oy, rows.xz - oz, rows.yx - ox, rows.yy - oy, rows.yz - oz, rows.zx - ox, rows.zy - oy, rows.zz - oz};
  }
  /// Σ_a (x_a − x_0) ⊗ ∇N_a.
  [[gnu::always_inline]] static Tensor3<T> gradient(Pack const& pack, Scalar const* x) noexcept { return transpose(edges(pack, x)) * pack.gradients; }
  [[gnu::always_inline]] void scatter(std::size_t k, Tensor3<T> const& f, auto const& pack, Scalar* columns) const noexcept {
    if (inside_[k])
      add_to_nodes(f, pack, columns, [](int) { return true; });
    else
      add_to_own_nodes(f, pack, columns);
  }
  template <class N>
  [[gnu::noinline]] void add_to_own_nodes(Tensor3<N> const& f, auto const& pack, NumberOf<N>* columns) const noexcept {
    add_to_nodes(f, pack, columns, own_);
  }
  template <class N>
  [[gnu::always_inline]] static void add_to_nodes(Tensor3<N> const& f, auto const& pack, NumberOf<N>* columns, auto const& own) noexcept {
    simd::add_to_columns(columns, pack.starts[0], N(N{} - (f.xx + f.yx + f.zx)), N(N{} - (f.xy + f.yy + f.zy)), N(N{} - (f.xz + f.yz + f.zz)), own);
    simd::add_to_columns(columns, pack.starts[1], f.xx, f.xy, f.xz, own);
    simd::add_to_columns(columns, pack.starts[2], f.yx, f.yy, f.yz, own);
    simd::add_to_columns(columns, pack.starts[3], f.zx, f.zy, f.zz, own);
  }

  /// Whether a column that starts there is its own.
  struct Own {
    int first, count;
    bool operator()(int start) const noexcept { return static_cast<unsigned>(start - first) < static_cast<unsigned>(count); }
  };

  HugePageVector<Pack> packs_;
  Own own_{};
  std::vector<Places> places_;      // empty where the tangent is not assembled
  HugePageVector<char> inside_;      // of each pack: all its nodes are its own
  HugePageVector<Names> names_;
  HugePageVector<int> slot_of_;      // of each tetrahedron by name, −1 where it is not here
  std::vector<Corners> stars_;      // empty without stars
  std::vector<Scalar> measured_;   // of each slot
  HugePageVector<Tangent> tangents_;   // of each since linearise()
  HugePageVector<std::conditional_t<has_floats, TangentOf<Floats>, char>> floats_;   // of two each
  std::vector<Tensor3<T>> growths_;   // with stars: V ∂J/∂x of nodes 1, 2, 3
  std::vector<std::conditional_t<has_floats, Tensor3<Floats>, char>> float_growths_;   // as floats_
  std::vector<float> float_measured_;
  std::vector<int> last_pack_of_;   // of each particle, while they are filled
};

}  // namespace palpate::detail
