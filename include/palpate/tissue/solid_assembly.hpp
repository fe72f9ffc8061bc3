// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/growing_lists.hpp>
#include <palpate/core/huge_page_vector.hpp>
#include <palpate/core/padded_columns.hpp>
#include <palpate/core/serial.hpp>
#include <palpate/tissue/assembled_particles.hpp>
#include <palpate/tissue/pressure_stars.hpp>
#include <palpate/tissue/tetrahedron_packs.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <numeric>
#include <span>
#include <type_traits>
#include <utility>
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
/// Cost       O(tetrahedra); follow() that of what was edited. Only these two, and linearise() for a larger set than before, allocate.
template <RealScalar Scalar, class Law>
class SolidAssembly : public AssembledParticles<Scalar> {
  using Base = AssembledParticles<Scalar>;
  using typename Base::ConstPadded, typename Base::Padded;
  using Base::at, Base::first_of, Base::inverse_mass, Base::max_blocks, Base::own;
  using Packs = detail::TetrahedronPacks<Scalar, Law>;

 public:
  static constexpr bool fast_tangent = true, damps_by_tangent = true;
  using Element = LinearTetrahedron<Scalar, Law>;
  using Base::blocks, Base::moving, Base::particles;

  /// f += internal forces at (x, v) in the first `moving()` columns; the border's columns are overwritten with partial sums.
  template <class X, class V, class F>
  void add_forces(X const& x, V const& v, F& f) const noexcept {
    if constexpr (is_padded<X> && is_padded<V> && is_padded<F>) {
      add_forces(x.data(), v.data(), f.data(), Serial{});
    } else {
      auto const copied = [](PaddedColumns<Scalar>& to, auto const& from) {
        to.view() = from;
        return std::as_const(to).padded_view().data();
      };
      Scalar const *const px = copied(x_, x), *const pv = copied(v_, v);
      f_.set_zero();
      add_forces(px, pv, f_.padded_view().data(), Serial{});
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

  /// Takes the tangent of every tetrahedron at x, positive semidefinite, for the two below. What `run` does at once is a block's, its rows too.
  template <class X, class Run = Serial>
  void linearise(X const& x, Scalar const* /*inverse_mass*/, Run const& run = {}) {
    static_assert(is_padded<X>);
    press(run, pressure_, Scalar(1), [&](Packs& packs) { packs.measure_volumes(x.data()); });
    if (!rows_.empty()) rows_.set_zero();
    run(blocks(), [&](int b) { packs_[at(b)].linearise(x.data(), pressure_.data(), rows_); });
    if (has_halo()) packs_[halo].linearise(x.data(), pressure_.data(), rows_);
  }
  /// out = (mass M + damping C + stiffness K) d, and the diagonal of that matrix, with stars nearly: 4 × particles().size(), contiguous, the fourth row 0;
  /// d is zero in the border's columns, out's border columns are overwritten with partial sums.
  template <class Run = Serial>
  void multiply_tangent(Scalar mass, Scalar damping, Scalar stiffness, Scalar const* d, Scalar* out, Run const& run = {}) const {
    this->multiply_mass(mass + damping * damping_.alpha, d, out);
    Scalar const factor = stiffness + damping * damping_.beta;
    if (factor == 0) return;
    press(run, rate_, Scalar(0), [&](Packs& packs) { packs.measure_changes(d); });
    run(blocks(), [&](int b) {
      if constexpr (!Packs::has_floats)
        if (!rows_.empty()) return rows_.add_product(factor, d, out, first_of(b), first_of(b + 1));
      packs_[at(b)].add_product(factor, d, rate_.data(), out);
    });
  }
  /// That with numbers half as wide and twice as many at once.
  template <class Run = Serial>
    requires Packs::has_floats
  void multiply_tangent(Scalar mass, Scalar damping, Scalar stiffness, float const* d, float* out, Run const& run = {}) const {
    this->multiply_mass(mass + damping * damping_.alpha, d, out);
    float const factor = static_cast<float>(stiffness + damping * damping_.beta);
    if (factor == 0) return;
    press(run, float_rate_, Scalar(0), [&](Packs& packs) { packs.measure_changes(d); });
    run(blocks(), [&](int b) {
      if (!rows_.empty()) return rows_.add_product(factor, d, out, first_of(b), first_of(b + 1));
      packs_[at(b)].add_product(factor, d, float_rate_.data(), out);
    });
  }
  void tangent_diagonal(Scalar mass, Scalar damping, Scalar stiffness, Scalar* out) const noexcept {
    this->mass_diagonal(mass + damping * damping_.alpha, out);
    for (int b = 0; b < blocks(); ++b) packs_[at(b)].add_diagonal(stiffness + damping * damping_.beta, weight_.data(), out);
  }

  /// The energy of the tetrahedra and stars that act on the chosen particles, at x: 4 × particles().size() [J].
  template <class Run = Serial>
  Scalar energy(Scalar const* x, Run const& run = {}) const {
    std::array<Scalar, std::size_t{Base::max_blocks}> of_block{};
    run(blocks(), [&](int b) { of_block[at(b)] = packs_[at(b)].energy(x); });
    Scalar sum = std::accumulate(of_block.begin(), of_block.end(), Scalar(0));
    press(run, pressure_, Scalar(1), [&](Packs& packs) { packs.measure_volumes(x); });
    for (std::size_t s = 0; s < pressure_.size(); ++s) sum += 2 * pressure_[s] * pressure_[s] / bulk_[s] * volume_[s];   // p = κ (J̄ − 1), of which a quarter is kept
    return sum;
  }
  /// What rounding makes of that: some digits of what the tetrahedra would store if each were stretched to twice its size.
  Scalar energy_rounding() const noexcept { return energy_rounding_; }
  /// The lowest J of the tetrahedra that act on the chosen particles, and its number in the tissue; of one of so many parts of them.
  detail::LowestDeterminant<Scalar> lowest_determinant(Scalar const* x, int part = 0, int parts = 1) const noexcept {
    detail::LowestDeterminant<Scalar> found;
    for (int b = 0; b < blocks(); ++b)
      if (auto const one = packs_[at(b)].lowest(x, part, parts); !(one.value >= found.value)) found = one;
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
    nodes_.clear(), names_.clear(), first_.clear(), at_border_.clear();
    auto const gather = [&](int e, int block) {
      if (place_[at(e)] >= 0) return;
      place_[at(e)] = static_cast<int>(names_.size());
      names_.push_back(e), first_.push_back(block);
      auto& own_nodes = nodes_.emplace_back(list.nodes[at(e)]);
      for (int& node : own_nodes) node = this->local(node);
      note_border(e, own_nodes);
    };
    for (int i = 0; i < moving(); ++i)
      for (int const e : tissue.elements_at(chosen[at(i)])) gather(e, this->block_of(i));
    int const acting = static_cast<int>(names_.size());
    auto const one = Tensor3<Scalar>::identity();
    energy_rounding_ = 0;
    for (int const e : names_) energy_rounding_ += list.elements[at(e)].volume() * trace(list.elements[at(e)].law().stress_change(one, one));
    energy_rounding_ *= 4 * std::numeric_limits<Scalar>::epsilon();
    choose_stars(stars, acting, gather);

    size_columns();
    auto const name = [&](int e) { return names_[at(e)]; };
    auto const fill = [&](int b, auto const& some, auto const& counts, auto const& columns) {
      auto const which = [&](int k) { return some[at(k)]; };
      packs_[at(b)].fill(this->force_columns(), nodes_, list.elements, static_cast<int>(some.size()), which, name, counts, columns.first, columns.first + columns.count);
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
    seen_ = tissue.edits().end(), gathered_from_ = list.size();
    is_taken_ = false;
    has_stars_ = !stars.empty();
    bool const assembles = tissue.assembles_stiffness() && !has_stars_;
    follows_ = !assembles;
    for (std::size_t b = at(blocks()); b < halo; ++b) packs_[b].clear();
    if (!assembles) return;
    rows_.build(moving(), nodes_);
    for (int b = 0; b < blocks(); ++b) packs_[at(b)].find_places(rows_);
  }
  /// The same for tissue that it was built of, or a copy of it, after edits: where the particles are those that were chosen, with new ones behind them, only
  /// what was edited is gathered, and else all; where the stiffness is in rows always all.
  /// Order      a tetrahedron stays in its pack, new ones go to the end: sums depend on what was edited when. layout() brings them to another body.
  /// Cost       O(edited tetrahedra + tetrahedra at the border), and a look at the number of each particle.
  template <class Tissue>
  void follow(Tissue const& tissue, std::span<int const> chosen) {
    if (!follows_ || has_stars_ == tissue.stars().empty() || !tissue.edits().knows(seen_) || !this->can_grow_to(chosen)) return build(tissue, chosen);
    auto const& list = tissue.list();
    PressureStars<Scalar> const& stars = tissue.stars();
    bool const has_grown = static_cast<int>(chosen.size()) > moving();
    this->grow_to(tissue, chosen);
    damping_ = tissue.damping();
    for (int b = 0; b < blocks(); ++b) packs_[at(b)].set_own(own(b).first, own(b).first + own(b).count);
    if (is_taken_) {
      for (int e = 0; e < gathered_from_; ++e)
        if (std::any_of(packs_.begin(), packs_.end(), [e](Packs const& packs) { return packs.holds(e); })) place(tissue, e, false);
    } else if (has_grown) {
      for (std::size_t k = 0, border = at_border_.size(); k < border; ++k) place(tissue, at_border_[k], false);   // some are listed twice
    }
    bool const was_taken = std::exchange(is_taken_, false);
    auto const edited = tissue.edits().since(seen_);
    edited_.assign(edited.begin(), edited.end());
    std::sort(edited_.begin(), edited_.end());
    edited_.erase(std::unique(edited_.begin(), edited_.end()), edited_.end());
    while (!edited_.empty() && edited_.back() >= gathered_from_) edited_.pop_back();
    for (int e = gathered_from_; e < list.size(); ++e) edited_.push_back(e);
    for (int const e : edited_) place(tissue, e, true);
    if (has_stars_) follow_stars(list, stars, was_taken);
    seen_ = tissue.edits().end(), gathered_from_ = list.size();
    size_columns();
  }

  /// Which tetrahedron is where: what makes the order of sums. Without particles where it is always built anew.
  struct Layout {
    Base particles;
    std::array<HugePageVector<typename Packs::Names>, std::size_t{Base::max_blocks} + 1> packs;
    std::vector<int> stars;
    std::size_t seen = 0;
    int gathered_from = 0;
    Scalar energy_rounding = 0;
  };
  Layout layout() const {
    if (!follows_) return {};
    Layout made{*this, {}, chosen_stars_, seen_, gathered_from_, energy_rounding_};
    for (std::size_t b = 0; b < packs_.size(); ++b) made.packs[b] = packs_[b].names();
    return made;
  }
  /// From now on it follows as the assembly did whose layout it is; follow() comes next.
  void take(Layout const& layout) {
    for (int const e : names_) place_[at(e)] = -1;
    names_.clear(), at_border_.clear(), rows_.clear();
    clear_stars();
    static_cast<Base&>(*this) = layout.particles;
    chosen_stars_ = layout.stars;
    has_stars_ = !chosen_stars_.empty();
    for (std::size_t b = 0; b < packs_.size(); ++b) packs_[b].take(layout.packs[b], has_stars_);
    seen_ = layout.seen, gathered_from_ = layout.gathered_from, energy_rounding_ = layout.energy_rounding;
    follows_ = is_taken_ = moving() > 0;
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
    std::size_t const more = 6 * at(std::max(0, count - tissue.size()));   // that cuts may make
    std::size_t const elements = tissue.list().elements.size() + more, stars = tissue.stars().empty() ? 0 : static_cast<std::size_t>(tissue.stars().size()) + more / 6;
    Base::reserve(count);
    for (auto* columns : {&x_, &v_, &f_}) columns->reserve(count);
    for (auto* some : {&place_, &names_, &first_, &of_block_, &of_halo_, &at_border_}) some->reserve(elements);
    edited_.reserve(2 * more);
    nodes_.reserve(elements);
    bool const assembles = tissue.assembles_stiffness() && stars == 0;
    for (auto& packs : packs_)
      if (&packs == packs_.data() || count >= 2 * Base::min_block_size) packs.reserve(at(count), elements, assembles, stars > 0);
    if (assembles) rows_.build(tissue.size(), tissue.list().nodes), rows_.clear();
    if (stars > 0) {
      packs_[halo].reserve(at(count), elements, false, true);
      for (auto* some : {&star_place_, &chosen_stars_, &sum_of_}) some->reserve(stars);
      for (Sums* sums : {&sums_[0], &sums_[halo]}) sums->star.reserve(stars), sums->slots.reserve(stars, sums->slots.items() + 4 * elements + 128 * more / 6);
      slot_.reserve(256);
    }
    for (auto* values : {&pressure_, &rate_, &bulk_, &volume_, &weight_}) values->reserve(stars);
    float_rate_.reserve(stars);
  }

 private:
  static constexpr std::size_t halo = Base::max_blocks;   // of tetrahedra that are only measured

  /// The stars whose volume a block sums up: where each of their tetrahedra is measured.
  struct Sums {
    std::vector<int> star;
    GrowingLists<int> slots;
  };

  void size_columns() {
    for (auto* columns : {&x_, &v_, &f_}) columns->resize(this->force_columns());
  }
  void note_border(int e, std::array<int, 4> const& nodes) {
    if (std::any_of(nodes.begin(), nodes.end(), [this](int i) { return i >= moving(); })) at_border_.push_back(e);
  }
  /// Writes a tetrahedron where it is, and `everywhere` it acts besides.
  template <class Tissue>
  void place(Tissue const& tissue, int e, bool everywhere) {
    auto const& list = tissue.list();
    std::array<int, 4> nodes = list.nodes[at(e)];
    int first = moving();   // of those that are chosen
    for (int const node : nodes)
      if (int const i = this->known(node); i >= 0) first = std::min(first, i);
    bool const acts = first < moving();
    if (!acts && std::none_of(packs_.begin(), packs_.end(), [e](Packs const& packs) { return packs.holds(e); })) return;
    for (int& node : nodes) node = this->local(node), this->weigh(tissue, node);
    if (everywhere || is_taken_) note_border(e, nodes);
    if (packs_[halo].holds(e)) packs_[halo].update(e, nodes, list.elements[at(e)], false);
    for (int b = 0; b < blocks(); ++b) {
      bool const counts = acts && this->block_of(first) == b;
      if (packs_[at(b)].holds(e))
        packs_[at(b)].update(e, nodes, list.elements[at(e)], counts);
      else if (everywhere && acts && (blocks() == 1 || std::any_of(nodes.begin(), nodes.end(), own(b))))
        packs_[at(b)].add(e, nodes, list.elements[at(e)], counts, has_stars_);
    }
  }

  template <class X>
  static constexpr bool is_padded = int{std::remove_cvref_t<X>::OuterStrideAtCompileTime} == 4 || int{std::remove_cvref_t<X>::RowsAtCompileTime} == 4;
  bool has_halo() const noexcept { return !packs_[halo].empty(); }

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

  /// quarter[s] = κ/4V (Σ measured − rest V) of all stars, after measure(packs).
  template <class Run, RealScalar N, class Measure>
  void press(Run const& run, std::vector<N>& quarter, Scalar rest, Measure const& measure) const noexcept {
    if (chosen_stars_.empty()) return;
    int const sets = blocks() + (has_halo() ? 1 : 0);
    auto const set = [this](int b) { return b < blocks() ? at(b) : halo; };
    run(sets, [&](int b) { measure(packs_[set(b)]); });
    run(sets, [&](int b) {
      Sums const& sums = sums_[set(b)];
      N const* const measured = packs_[set(b)].template measured<N>();
      for (std::size_t s = 0; s < sums.star.size(); ++s) {
        N volume = 0, other = 0;   // two sums, as one would wait for itself
        auto const slots = sums.slots[static_cast<int>(s)];
        for (std::size_t k = 0; k + 1 < slots.size(); k += 2) volume += measured[slots[k]], other += measured[slots[k + 1]];
        if (slots.size() % 2 == 1) volume += measured[slots.back()];
        std::size_t const star = at(sums.star[s]);
        quarter[star] = static_cast<N>(weight_[star] * (volume + other - rest * volume_[star]));
      }
    });
  }

  void clear_stars() noexcept {
    for (int const s : chosen_stars_)
      if (at(s) < star_place_.size()) star_place_[at(s)] = -1;
    chosen_stars_.clear(), of_halo_.clear(), sum_of_.clear();
    for (auto* values : {&pressure_, &rate_, &bulk_, &volume_, &weight_}) values->clear();
    float_rate_.clear();
    for (Sums& sums : sums_) sums.star.clear(), sums.slots.clear();
  }
  /// What a chosen one is here, behind those that are known.
  void add_star(PressureStars<Scalar> const& stars, int s) {
    star_place_[at(s)] = static_cast<int>(sum_of_.size());
    bulk_.push_back(stars.bulk_modulus(s)), volume_.push_back(0), weight_.push_back(0), pressure_.push_back(0), rate_.push_back(0), float_rate_.push_back(0);
    Sums& sums = sums_[set_of(stars, s)];
    sum_of_.push_back(static_cast<int>(sums.star.size()));
    sums.star.push_back(star_place_[at(s)]);
  }
  std::size_t set_of(PressureStars<Scalar> const& stars, int s) {
    int const node = this->local(stars.node(s));
    return node < moving() ? at(this->block_of(node)) : halo;
  }
  /// What it weighs, and where its tetrahedra are measured.
  void sum_star(PressureStars<Scalar> const& stars, std::size_t place) {
    int const s = chosen_stars_[place];
    volume_[place] = stars.volume(s), weight_[place] = stars.elements(s).empty() ? Scalar(0) : stars.stiffness(s);   // none, where a cut has left none of it
    std::size_t const set = set_of(stars, s);
    slot_.clear();
    for (int const e : stars.elements(s)) slot_.push_back(packs_[set].slot(e));
    sums_[set].slots.set(sum_of_[place], slot_);
  }
  std::array<int, 4> places_at_corners(PressureStars<Scalar> const& stars, int e) const noexcept {
    std::array<int, 4> places = stars.at_corners(e);
    for (int& s : places) s = std::max(0, star_place_[at(s)]);   // of a tetrahedron that is only measured some are not needed
    return places;
  }

  /// Stars of what was edited, or of all.
  template <class List>
  void follow_stars(List const& list, PressureStars<Scalar> const& stars, bool all) {
    star_place_.resize(at(stars.size()), -1);
    HugePageVector<int>& touched = of_halo_;
    touched.clear();
    if (all)
      for (int const s : chosen_stars_) touched.push_back(static_cast<int>(sum_of_.size())), add_star(stars, s);
    auto const acts = [&](int e) { return std::any_of(packs_.begin(), packs_.end() - 1, [e](Packs const& packs) { return packs.holds(e); }); };
    std::size_t const known = chosen_stars_.size();
    for (int const e : edited_)
      if (acts(e))
        for (int const s : stars.at_corners(e))
          if (star_place_[at(s)] < 0) chosen_stars_.push_back(s), add_star(stars, s);
    for (int const e : edited_)
      for (Packs& packs : packs_)
        if (packs.holds(e)) {
          if (e < gathered_from_ && !all)
            for (int const place : packs.stars_of(e)) touched.push_back(place);   // those that it was in
          for (int const s : stars.at_corners(e))
            if (star_place_[at(s)] >= 0) touched.push_back(star_place_[at(s)]);
        }
    std::sort(touched.begin(), touched.end());
    touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
    for (int const place : touched)
      if (int const s = chosen_stars_[at(place)]; set_of(stars, s) == halo)
        for (int const e : stars.elements(s)) {
          if (packs_[halo].holds(e)) continue;
          std::array<int, 4> nodes = list.nodes[at(e)];
          for (int& node : nodes) node = this->local(node);
          note_border(e, nodes);
          packs_[halo].add(e, nodes, list.elements[at(e)], false, true);
          packs_[halo].set_stars_of(e, places_at_corners(stars, e));
        }
    auto const set_stars = [&](int e) {
      for (Packs& packs : packs_)
        if (packs.holds(e)) packs.set_stars_of(e, places_at_corners(stars, e));
    };
    if (all)
      for (int e = 0; e < gathered_from_; ++e) set_stars(e);
    for (int const e : edited_) set_stars(e);
    for (std::size_t place = known; place < chosen_stars_.size(); ++place)   // those that were measured already did not know of it
      for (int const e : stars.elements(chosen_stars_[place])) set_stars(e);
    for (int const place : touched) sum_star(stars, at(place));
  }

  /// The stars of the acting tetrahedra, and the tetrahedra of those that are not at a chosen particle.
  template <class Gather>
  void choose_stars(PressureStars<Scalar> const& stars, int acting, Gather const& gather) {
    clear_stars();
    star_place_.resize(at(stars.size()), -1);
    if (stars.empty()) return;
    for (int e = 0; e < acting; ++e)
      for (int const s : stars.at_corners(names_[at(e)]))
        if (star_place_[at(s)] < 0) chosen_stars_.push_back(s), add_star(stars, s);
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
    packs_[b].set_stars([&](int e) { return places_at_corners(stars, e); });
    for (int const place : sums_[b].star) sum_star(stars, at(place));
  }

  RayleighDamping<Scalar> damping_;
  Scalar energy_rounding_ = 0;
  HugePageVector<int> place_;   // tetrahedron of the tissue → gathered one, −1 outside
  HugePageVector<std::array<int, 4>> nodes_;   // local
  HugePageVector<int> names_, first_;   // of each gathered one: its number in the tissue, the block of its first chosen particle
  HugePageVector<int> of_block_, of_halo_;   // while it is built
  HugePageVector<int> at_border_, edited_;   // tetrahedra with a node that is not chosen; those that are edited, while it follows
  std::size_t seen_ = 0;      // of the tissue's edits
  int gathered_from_ = 0;     // of so many tetrahedra
  bool follows_ = false;      // whether it can
  bool is_taken_ = false;     // it has a layout, and nothing in it yet
  bool has_stars_ = false;
  std::vector<int> star_place_, chosen_stars_;   // star of the tissue → here, and back
  std::vector<int> sum_of_, slot_;   // of each chosen star: its place in the sums of its set; those of one, while it is set
  std::vector<Scalar> bulk_, volume_, weight_;   // of each chosen star
  std::array<Sums, Base::max_blocks + 1> sums_;
  typename Packs::Rows rows_;   // empty where it is not assembled, and with stars
  mutable std::array<Packs, Base::max_blocks + 1> packs_;   // what is measured is kept in them
  mutable std::vector<Scalar> pressure_, rate_;
  mutable std::vector<float> float_rate_;
  mutable PaddedColumns<Scalar> x_, v_, f_;   // of columns that have no fourth row
};

}  // namespace palpate
