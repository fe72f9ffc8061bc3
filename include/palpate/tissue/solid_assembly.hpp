// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/padded_columns.hpp>
#include <palpate/tissue/assembled_particles.hpp>
#include <palpate/tissue/pressure_stars.hpp>
#include <palpate/tissue/tetrahedron_packs.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <type_traits>
#include <vector>

namespace palpate {

/// The damping of a solid after Rayleigh: C = α M + β K, K the positive semidefinite tangent where the body is.
template <RealScalar Scalar>
struct RayleighDamping {
  Scalar alpha{};   ///< 1/s: drag against the world
  Scalar beta{};    ///< s: inside
};

/// The tetrahedra that act on a chosen set of particles: forces, tangent, energy.
/// Order      packs of tetrahedra in the order of their first chosen particle: a particle's force is one sum, however many blocks there are.
/// Pressure   with stars two passes: volumes, then forces. The border holds the nodes of all tetrahedra of the stars that are needed.
/// Shapes     positions, velocities, forces: 3 × particles().size(), one column per local particle, or 4 × with the fourth row 0.
/// Cost       O(tetrahedra). Only build(), and linearise() for a larger set than before, allocate.
template <RealScalar Scalar, class Law>
class SolidAssembly : public AssembledParticles<Scalar> {
  using Base = AssembledParticles<Scalar>;
  using typename Base::ConstPadded, typename Base::Padded;
  using Base::at, Base::first_of, Base::inverse_mass, Base::max_blocks, Base::own;
  using Packs = detail::TetrahedronPacks<Scalar, Law>;

 public:
  static constexpr bool fast_tangent = true;
  using Element = LinearTetrahedron<Scalar, Law>;
  using Base::blocks, Base::moving, Base::particles;

  /// f += internal forces at (x, v) in the first `moving()` columns; the border's columns are overwritten with partial sums.
  template <class X, class V, class F>
  void add_forces(X const& x, V const& v, F& f) const noexcept {
    if constexpr (is_padded<X> && is_padded<V> && is_padded<F>) {
      add_forces(x.data(), v.data(), f.data(), OneAfterTheOther{});
    } else {
      auto const copied = [](PaddedColumns<Scalar>& to, auto const& from) {
        to.view() = from;
        return std::as_const(to).padded_view().data();
      };
      Scalar const *const px = copied(x_, x), *const pv = copied(v_, v);
      f_.set_zero();
      add_forces(px, pv, f_.padded_view().data(), OneAfterTheOther{});
      f += f_.view();
    }
  }

  /// inverse mass · (internal force at (x, v) + pushes) + gravity of the `moving()` particles [m/s²]; see MassSpringAssembly for the arguments. `before` is
  /// called for all of them first, `after_of(block)` when all forces are known.
  template <class Run, std::size_t Count, class Before, class AfterOf>
  void accelerate(Scalar const* x, Scalar const* v, Vector3<Scalar> const& gravity, std::span<ColumnForce<Scalar> const> pushes, Scalar* force,
                  Run const& run, std::array<Scalar const*, Count> const& /*columns*/, Before const& before, AfterOf const& after_of) const {
    run(blocks(), [&](int b) { before(first_of(b), first_of(b + 1)); });
    add_forces(x, v, force, run);
    this->accelerate_by(Padded(force, 4, this->force_columns()), gravity, pushes, run, after_of);
  }

  /// Takes the tangent of every tetrahedron at x, positive semidefinite, for the two below.
  template <class X>
  void linearise(X const& x, Scalar const* /*inverse_mass*/) {
    static_assert(is_padded<X>);
    press(OneAfterTheOther{}, pressure_, Scalar(1), [&](Packs& packs) { packs.measure_volumes(x.data()); });
    if (!rows_.empty()) rows_.set_zero();
    for (int b = 0; b < blocks(); ++b) packs_[at(b)].linearise(x.data(), pressure_.data(), rows_);
    if (has_halo()) packs_[halo].linearise(x.data(), pressure_.data(), rows_);
    if (!rows_.empty()) rows_.mirror();
  }
  /// out = (mass M + damping C + stiffness K) d, and the diagonal of that matrix, with stars nearly: 4 × particles().size(), contiguous, the fourth row 0;
  /// d is zero in the border's columns, out's border columns are overwritten with partial sums.
  void multiply_tangent(Scalar mass, Scalar damping, Scalar stiffness, Scalar const* d, Scalar* out) const noexcept {
    this->multiply_mass(mass + damping * damping_.alpha, d, out);
    Scalar const factor = stiffness + damping * damping_.beta;
    if (factor == 0) return;
    press(OneAfterTheOther{}, rate_, Scalar(0), [&](Packs& packs) { packs.measure_changes(d); });
    for (int b = 0; b < blocks(); ++b) packs_[at(b)].add_product(factor, d, rate_.data(), out);
    if (!rows_.empty()) rows_.add_product(factor, d, out);
  }
  void tangent_diagonal(Scalar mass, Scalar damping, Scalar stiffness, Scalar* out) const noexcept {
    this->mass_diagonal(mass + damping * damping_.alpha, out);
    for (int b = 0; b < blocks(); ++b) packs_[at(b)].add_diagonal(stiffness + damping * damping_.beta, weight_.data(), out);
    if (!rows_.empty()) rows_.add_diagonal(stiffness + damping * damping_.beta, out);
  }

  /// The energy of the tetrahedra and stars that act on the chosen particles, at x: 4 × particles().size() [J].
  Scalar energy(Scalar const* x) const noexcept {
    Scalar sum = 0;
    for (int b = 0; b < blocks(); ++b) sum += packs_[at(b)].energy(x);
    press(OneAfterTheOther{}, pressure_, Scalar(1), [&](Packs& packs) { packs.measure_volumes(x); });
    for (std::size_t s = 0; s < pressure_.size(); ++s) sum += 2 * pressure_[s] * pressure_[s] / bulk_[s] * volume_[s];   // p = κ (J̄ − 1), of which a quarter is kept
    return sum;
  }
  /// What rounding makes of that: some digits of what the tetrahedra would store if each were stretched to twice its size.
  Scalar energy_rounding() const noexcept { return energy_rounding_; }
  /// The lowest J of the tetrahedra that act on the chosen particles, and its number in the tissue.
  detail::LowestDeterminant<Scalar> lowest_determinant(Scalar const* x) const noexcept {
    detail::LowestDeterminant<Scalar> found;
    for (int b = 0; b < blocks(); ++b)
      if (auto const one = packs_[at(b)].lowest(x); !(one.value >= found.value)) found = one;
    return found;
  }

  /// Gathers the tetrahedra of `tissue` that act on the particles in `chosen`; asks it for size(), mass(i), list() and elements_at(i), its stars, damping, and
  /// assembles_stiffness().
  template <class Tissue>
  void build(Tissue const& tissue, std::span<int const> chosen) {
    auto const& list = tissue.list();
    PressureStars<Scalar> const& stars = tissue.stars();
    this->choose(tissue, chosen);
    damping_ = tissue.damping();
    for (int const e : names_) place_[at(e)] = -1;
    place_.resize(list.elements.size(), -1);
    nodes_.clear(), elements_.clear(), names_.clear(), first_.clear();
    auto const gather = [&](int e, int block) {
      if (place_[at(e)] >= 0) return;
      place_[at(e)] = static_cast<int>(names_.size());
      names_.push_back(e), elements_.push_back(list.elements[at(e)]), first_.push_back(block);
      auto& own_nodes = nodes_.emplace_back(list.nodes[at(e)]);
      for (int& node : own_nodes) node = this->local(node);
    };
    for (int i = 0; i < moving(); ++i)
      for (int const e : tissue.elements_at(chosen[at(i)])) gather(e, this->block_of(i));
    int const acting = static_cast<int>(names_.size());
    auto const one = Tensor3<Scalar>::identity();
    energy_rounding_ = 0;
    for (Element const& element : elements_) energy_rounding_ += element.volume() * trace(element.law().stress_change(one, one));
    energy_rounding_ *= 4 * std::numeric_limits<Scalar>::epsilon();
    choose_stars(stars, acting, gather);

    x_.resize(this->force_columns()), v_.resize(this->force_columns()), f_.resize(this->force_columns());
    auto const name = [&](int e) { return names_[at(e)]; };
    auto const fill = [&](int b, auto const& some, auto const& counts, auto const& columns) {
      auto const which = [&](int k) { return some[at(k)]; };
      packs_[at(b)].fill(this->force_columns(), nodes_, elements_, static_cast<int>(some.size()), which, name, counts, columns.first, columns.first + columns.count);
    };
    for (int b = 0; b < blocks(); ++b) {
      of_block_.clear();
      for (int e = 0; e < acting; ++e)
        if (auto const& n = nodes_[at(e)]; blocks() == 1 || std::any_of(n.begin(), n.end(), own(b))) of_block_.push_back(e);
      fill(b, of_block_, [&](int e) { return first_[at(e)] == b; }, own(b));
      place_stars(stars, at(b));
    }
    fill(halo, of_halo_, [](int) { return false; }, own(0));
    place_stars(stars, halo);
    rows_.clear();
    if (!tissue.assembles_stiffness()) return;
    rows_.build(moving(), std::span(nodes_).first(at(acting)));
    for (auto& packs : packs_) packs.find_places(rows_);
  }
  /// Takes what the tissue's elements remember, where they do.
  template <class Tissue>
  void take_history(Tissue const& tissue) noexcept
    requires HasFadedStress<Law>
  {
    for (int b = 0; b < blocks(); ++b) packs_[at(b)].take_faded(tissue.list().elements);
  }
  /// Memory for sets of up to so many particles.
  template <class Tissue>
  void reserve(Tissue const& tissue, int count, int /*triangles*/) {
    std::size_t const elements = tissue.list().elements.size(), stars = static_cast<std::size_t>(tissue.stars().size());
    Base::reserve(count);
    for (auto* columns : {&x_, &v_, &f_}) columns->reserve(count);
    for (auto* some : {&place_, &names_, &first_, &of_block_, &of_halo_, &slot_}) some->reserve(elements);
    nodes_.reserve(elements), elements_.reserve(elements);
    for (auto& packs : packs_)
      if (&packs == packs_.data() || count >= 2 * Base::min_block_size) packs.reserve(at(count), elements, tissue.assembles_stiffness());
    if (tissue.assembles_stiffness()) rows_.build(tissue.size(), tissue.list().nodes), rows_.clear();
    if (stars > 0) packs_[halo].reserve(at(count), elements, tissue.assembles_stiffness()), star_place_.reserve(stars), chosen_stars_.reserve(stars);
    for (auto* values : {&pressure_, &rate_, &bulk_, &volume_, &weight_}) values->reserve(stars);
  }

 private:
  static constexpr std::size_t halo = Base::max_blocks;   // of tetrahedra that are only measured

  struct OneAfterTheOther {
    template <class Walk>
    void operator()(int n, Walk const& walk) const {
      for (int k = 0; k < n; ++k) walk(k);
    }
  };
  /// The stars whose volume a block sums up: where each of their tetrahedra is measured.
  struct Sums {
    std::vector<int> star, ends, slots;
  };

  template <class X>
  static constexpr bool is_padded = int{std::remove_cvref_t<X>::OuterStrideAtCompileTime} == 4 || int{std::remove_cvref_t<X>::RowsAtCompileTime} == 4;
  bool has_halo() const noexcept { return !of_halo_.empty(); }

  template <class Run>
  void add_forces(Scalar const* x, Scalar const* v, Scalar* f, Run const& run) const noexcept {
    press(run, pressure_, Scalar(1), [&](Packs& packs) { packs.measure_volumes(x); });
    if (damping_.beta != 0) press(run, rate_, Scalar(0), [&](Packs& packs) { packs.measure_growth(x, v); });
    run(blocks(), [&](int b) {
      packs_[at(b)].add_forces(x, v, damping_.beta, pressure_.data(), rate_.data(), f);
      if (damping_.alpha == 0) return;
      ConstPadded const velocities(v, 4, this->force_columns());
      Padded forces(f, 4, this->force_columns());
      for (int i = first_of(b); i < first_of(b + 1); ++i) forces.col(i) -= damping_.alpha / inverse_mass(i) * velocities.col(i);
    });
  }

  /// quarter[s] = κ/4 (Σ measured/V − rest) of all stars, after measure(packs).
  template <class Run, class Measure>
  void press(Run const& run, std::vector<Scalar>& quarter, Scalar rest, Measure const& measure) const noexcept {
    if (chosen_stars_.empty()) return;
    int const sets = blocks() + (has_halo() ? 1 : 0);
    auto const set = [this](int b) { return b < blocks() ? at(b) : halo; };
    run(sets, [&](int b) { measure(packs_[set(b)]); });
    run(sets, [&](int b) {
      Sums const& sums = sums_[set(b)];
      for (std::size_t s = 0, k = 0; s < sums.star.size(); ++s) {
        Scalar volume = 0;
        for (; k < at(sums.ends[s]); ++k) volume += packs_[set(b)].measured(sums.slots[k]);
        std::size_t const star = at(sums.star[s]);
        quarter[star] = Scalar(0.25) * bulk_[star] * (volume / volume_[star] - rest);
      }
    });
  }

  /// The stars of the acting tetrahedra, and the tetrahedra of those that are not at a chosen particle.
  template <class Gather>
  void choose_stars(PressureStars<Scalar> const& stars, int acting, Gather const& gather) {
    for (int const s : chosen_stars_)
      if (at(s) < star_place_.size()) star_place_[at(s)] = -1;
    star_place_.resize(at(stars.size()), -1);
    chosen_stars_.clear(), of_halo_.clear();
    for (auto* values : {&pressure_, &rate_, &bulk_, &volume_, &weight_}) values->clear();
    for (Sums& sums : sums_) sums.star.clear(), sums.ends.clear(), sums.slots.clear();
    if (stars.empty()) return;
    for (int e = 0; e < acting; ++e)
      for (int const s : stars.at_corners(names_[at(e)])) {
        if (star_place_[at(s)] >= 0) continue;
        star_place_[at(s)] = static_cast<int>(chosen_stars_.size());
        chosen_stars_.push_back(s);
        bulk_.push_back(stars.bulk_modulus(s)), volume_.push_back(stars.volume(s)), weight_.push_back(stars.bulk_modulus(s) / (4 * stars.volume(s)));
        int const node = this->local(stars.node(s));
        sums_[node < moving() ? at(this->block_of(node)) : halo].star.push_back(star_place_[at(s)]);
      }
    pressure_.resize(chosen_stars_.size()), rate_.resize(chosen_stars_.size());
    for (int const s : sums_[halo].star)
      for (int const e : stars.elements(chosen_stars_[at(s)])) {
        gather(e, -1);
        of_halo_.push_back(place_[at(e)]);
      }
    std::sort(of_halo_.begin(), of_halo_.end());
    of_halo_.erase(std::unique(of_halo_.begin(), of_halo_.end()), of_halo_.end());
  }
  void place_stars(PressureStars<Scalar> const& stars, std::size_t b) {
    if (chosen_stars_.empty()) return;
    slot_.assign(names_.size(), -1);
    auto const at_corners = [&](int e) {
      std::array<int, 4> places = stars.at_corners(names_[at(e)]);
      for (int& s : places) s = std::max(0, star_place_[at(s)]);   // of a tetrahedron that is only measured some are not needed
      return places;
    };
    packs_[b].set_stars(at_corners, [&](int e, int slot) { slot_[at(e)] = slot; });
    Sums& sums = sums_[b];
    for (int const s : sums.star) {
      for (int const e : stars.elements(chosen_stars_[at(s)])) sums.slots.push_back(slot_[at(place_[at(e)])]);
      sums.ends.push_back(static_cast<int>(sums.slots.size()));
    }
  }

  RayleighDamping<Scalar> damping_;
  Scalar energy_rounding_ = 0;
  std::vector<int> place_;   // tetrahedron of the tissue → gathered one, −1 outside
  std::vector<std::array<int, 4>> nodes_;   // local
  std::vector<Element> elements_;
  std::vector<int> names_, first_;   // of each gathered one: its number in the tissue, the block of its first chosen particle
  std::vector<int> of_block_, of_halo_, slot_;   // while it is built
  std::vector<int> star_place_, chosen_stars_;   // star of the tissue → here, and back
  std::vector<Scalar> bulk_, volume_, weight_;   // of each chosen star
  std::array<Sums, Base::max_blocks + 1> sums_;
  detail::StiffnessRows<Scalar> rows_;   // empty where it is not assembled
  mutable std::array<Packs, Base::max_blocks + 1> packs_;   // what is measured is kept in them
  mutable std::vector<Scalar> pressure_, rate_;
  mutable PaddedColumns<Scalar> x_, v_, f_;   // of columns that have no fourth row
};

}  // namespace palpate
