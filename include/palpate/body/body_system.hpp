// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/divergence.hpp>
#include <palpate/body/particle_state.hpp>
#include <palpate/core/flush_denormals.hpp>
#include <palpate/core/padded_columns.hpp>
#include <palpate/core/serial.hpp>
#include <palpate/core/simd.hpp>
#include <palpate/integrator/concept.hpp>
#include <palpate/integrator/solve_report.hpp>
#include <palpate/tissue/column_force.hpp>
#include <palpate/tissue/concept.hpp>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace palpate {

/// The moving particles of a body as an integrator sees them (concept `System`): columns 0 … n−1, with the particles that hold the
/// border of the moving set behind them.
/// Where all of the body moves, the columns are the body's own; else they are gathered, stay from step to step, and are handed back
/// after each.
/// Layout     a fourth row of zeros stands under each column, so that it is one or two registers; padded_view() shows it.
/// Cost       acceleration is O(elements of the moving set); nothing is allocated once the largest set has been seen. What this class
///            handed out is used where it is; another x or v is copied first.
/// Threads    one; with an Execution other than Serial, as that says, where a body has more than one block.
template <TissueModel Tissue, class Execution = Serial>
class BodySystem {
 public:
  using Scalar = typename Tissue::Scalar;
  using Matrix = Matrix3X<Scalar>;
  using State = ParticleState<Scalar>;
  using Layout = typename detail::LayoutOf<Tissue>::type;

  static constexpr bool damps_by_tangent = DampsByTangent<Tissue>;

  StridedView<Scalar> positions() noexcept { return now(x_, &State::position).view(moving_); }
  StridedView<Scalar> velocities() noexcept { return now(v_, &State::velocity).view(moving_); }
  StridedView<Scalar> previous_acceleration() noexcept { return now(memory_, &State::remembered).view(moving_); }
  bool remembers() const noexcept { return remembers_; }

  StridedView<Scalar> scratch(int k) noexcept {   // sized on demand: most integrators use few; with room for the border, see multiply_tangent()
    auto& columns = scratch_[static_cast<std::size_t>(k)];
    if (columns.size() != all_) columns.resize(all_);
    return columns.view(moving_);
  }

  template <class X, class V>
  Matrix acceleration(Eigen::MatrixBase<X> const& x, Eigen::MatrixBase<V> const& v) {
    Matrix out(3, moving_);
    acceleration(x, v, out);
    return out;
  }

  template <class X, class V, class Out>
  void acceleration(Eigen::MatrixBase<X> const& x, Eigen::MatrixBase<V> const& v, Out&& out) {
    PaddedView<Scalar> const at = with_border(x.derived(), border_x_), speed = with_border(v.derived(), border_v_);
    auto&& result = padded_view(out);
    auto const store = [&result](int i, auto const& a) {
      if constexpr (int{std::remove_cvref_t<decltype(result)>::RowsAtCompileTime} == 4)
        simd::store(result.data() + 4 * static_cast<std::ptrdiff_t>(i), a);
      else
        for (int k = 0; k < static_cast<int>(sizeof(a) / sizeof(Scalar)); ++k)
          if (k % 4 < 3) result(k % 4, i + k / 4) = a[k];
    };
    accelerate(at, speed, std::array<Scalar const*, 2>{at.data(), speed.data()}, [](int, int) {}, [&](int) { return store; });
  }

  /// A whole step of an integrator with FusedStep: see palpate::step_by_parts. In a body of more than one block no copy is kept: a
  /// particle that would leave the bound stays, and where there is one, the step is undone.
  template <class Parts>
  void step_by_parts(Parts const& parts) {
    Scalar* const x = now(x_, &State::position).padded_view().data();
    Scalar* const v = now(v_, &State::velocity).padded_view().data();
    Scalar* const m = now(memory_, &State::remembered).padded_view().data();
    Scalar *const kept_x = x_.padded_view().data(), *const kept_v = v_.padded_view().data(), *const kept_m = memory_.padded_view().data();
    diverged_.assign(static_cast<std::size_t>(blocks()), {});
    accelerate(
        PaddedView<Scalar>(x, 4, all_), PaddedView<Scalar>(m, 4, all_), std::array<Scalar const*, 3>{x, v, m},
        [=, keeps = keeps_](int first, int end) {
          std::ptrdiff_t k = 4 * static_cast<std::ptrdiff_t>(first);
          std::ptrdiff_t const last = 4 * static_cast<std::ptrdiff_t>(end);
          auto const start = [=]<class Columns>(std::type_identity<Columns>, std::ptrdiff_t at) {
            Columns x_i, v_i, m_i;
            simd::load(x_i, x + at), simd::load(v_i, v + at), simd::load(m_i, m + at);
            if (keeps) simd::store(kept_x + at, x_i), simd::store(kept_v + at, v_i), simd::store(kept_m + at, m_i);
            parts.before(x_i, std::as_const(v_i), m_i);
            simd::store(x + at, x_i), simd::store(m + at, m_i);
          };
          constexpr int several = 4 * simd::columns_in_register<Scalar>;
          if constexpr (several > 4)
            for (; k + several <= last; k += several) start(std::type_identity<simd::Pack<Scalar, several>>{}, k);
          for (; k < last; k += 4) start(std::type_identity<Four>{}, k);
        },
        [&, bound = bound_](int block) {
          Divergence<Scalar>* const found = &diverged_[static_cast<std::size_t>(block)];
          return [=]<class Columns>(int i, Columns const& accelerations) {
            std::ptrdiff_t const k = 4 * static_cast<std::ptrdiff_t>(i);
            Columns x_i, v_i, a_i = accelerations;
            simd::load(x_i, x + k), simd::load(v_i, v + k);
            parts.after(x_i, v_i, a_i);
            if (simd::all_below(Columns(x_i * x_i + (v_i - v_i)), bound * bound)) [[likely]] {   // v − v is NaN where v is not finite
              simd::store(x + k, x_i), simd::store(v + k, v_i), simd::store(m + k, a_i);
              return;
            }
            std::array<Scalar, sizeof(Columns) / sizeof(Scalar)> each;
            simd::store(each.data(), accelerations);
            for (int one = 0; 4 * one < static_cast<int>(each.size()); ++one)
              after_or_stay(parts, i + one, x + k + 4 * one, v + k + 4 * one, m + k + 4 * one, each.data() + 4 * one, bound, *found);
          };
        });
    for (Divergence<Scalar> const& found : diverged_)
      if (found.particle >= 0 && (diverged_one_.particle < 0 || found.particle < diverged_one_.particle)) diverged_one_ = found;
    if (diverged_one_.particle >= 0 && direct_ != nullptr && !keeps_) undo(parts, x, v, m);
  }

  /// Takes the tangent of what acts on the moving set, at positions(); the two below are of that one.
  void linearise()
    requires HasTangentOperator<Tissue>
  {
    if (std::exchange(foreseen_h_, Scalar(0)) > 0) return;   // a forecast has
    if constexpr (HasTangentOnCores<Tissue>)
      assembly_.linearise(now(x_, &State::position).padded_view(), inverse_mass_.data(), flushed());
    else
      assembly_.linearise(now(x_, &State::position).padded_view(), inverse_mass_.data());
    if (all_ == moving_) return;
    direction_.resize(all_), product_.resize(all_);
    direction_.padded_view().rightCols(all_ - moving_).setZero();   // the border does not move
  }
  /// What is forecast for steps of h seconds is in scratch(), the tangent with it, until the state changes: then the next linearise() has it. Else false.
  bool foresees(Scalar h) const noexcept { return foreseen_h_ > 0 && foreseen_h_ == h; }
  void foresee(Scalar h) noexcept { foreseen_h_ = h; }
  /// By what forces have changed since the begin() before [N]: add(column, by).
  template <class Add>
  void changes_of_pushes(Add const& add) const {
    for (auto const& push : told_) add(push.column, Vector3<Scalar>(-push.force));
    for (auto const& push : pushes_) add(push.column, push.force);
  }
  template <class D, class Out>
  void multiply_tangent(Scalar mass, Scalar damping, Scalar stiffness, D const& d, Out&& out)
    requires HasTangentOperator<Tissue>
  {
    if constexpr (is_padded<D> && is_padded<Out>)
      if (all_ == moving_ || (is_scratch(d) && is_scratch(out))) {
        PaddedView<Scalar>(const_cast<Scalar*>(d.data()), 4, all_).rightCols(all_ - moving_).setZero();   // the border does not move
        return multiply(mass, damping, stiffness, d.data(), out.data());
      }
    if (all_ == moving_) direction_.resize(moving_), product_.resize(moving_);
    if constexpr (int{D::RowsAtCompileTime} == 4)
      direction_.padded_view().leftCols(moving_) = d;
    else
      direction_.view(moving_) = d;
    multiply(mass, damping, stiffness, direction_.padded_view().data(), product_.padded_view().data());
    hand_out(out);
  }
  /// Where the tangent can be multiplied in float: columns of those, and a product.
  PaddedView<float> float_scratch(int k)
    requires HasFloatTangent<Tissue>
  {
    auto& columns = floats_[static_cast<std::size_t>(k)];
    if (columns.size() != all_) columns.resize(all_);
    return PaddedView<float>(columns.padded_view().data(), 4, moving_);
  }
  void multiply_tangent(Scalar mass, Scalar damping, Scalar stiffness, PaddedView<float> const& d, PaddedView<float>& out)
    requires HasFloatTangent<Tissue>
  {
    PaddedView<float>(const_cast<float*>(d.data()), 4, all_).rightCols(all_ - moving_).setZero();   // the border does not move
    multiply(mass, damping, stiffness, d.data(), out.data());
  }
  template <class Out>
  void tangent_diagonal(Scalar mass, Scalar damping, Scalar stiffness, Out&& out)
    requires HasTangentOperator<Tissue>
  {
    product_.resize(all_);
    assembly_.tangent_diagonal(mass, damping, stiffness, product_.padded_view().data());
    hand_out(out);
  }

  /// The same of some columns alone, at their cost, for an integrator that does not move all of them at once; d is zero in the others, whose out stays.
  void acceleration_of(std::span<int const> some, PaddedView<Scalar> const& x, PaddedView<Scalar> const& v, PaddedView<Scalar> out)
    requires HasForcesOfSome<Tissue>
  {
    PaddedView<Scalar> const at = with_border(x, border_x_), speed = with_border(v, border_v_);
    assembly_.accelerate_some(some, at.data(), speed.data(), gravity_, std::span<ColumnForce<Scalar> const>(pushes_), out.data(), flushed());
  }
  void multiply_tangent_of(std::span<int const> some, Scalar mass, Scalar damping, Scalar stiffness, PaddedView<Scalar> const& d, PaddedView<Scalar> out)
    requires HasForcesOfSome<Tissue>
  {
    assembly_.multiply_some(some, mass, damping, stiffness, d.data(), out.data(), flushed());
  }
  void tangent_diagonal_of(std::span<int const> some, Scalar mass, Scalar damping, Scalar stiffness, PaddedView<Scalar> out)
    requires HasForcesOfSome<Tissue>
  {
    assembly_.diagonal_of_some(some, mass, damping, stiffness, out.data());
  }
  std::vector<int>& list() noexcept { return list_; }

  /// The energy of the elements that act on the moving particles at x, less the work of gravity and applied forces.
  template <class X>
  Scalar potential(Eigen::MatrixBase<X> const& x)
    requires HasAssemblyEnergy<Tissue>
  {
    PaddedView<Scalar> const at = with_border(x.derived(), border_x_);
    Scalar energy;
    if constexpr (HasTangentOnCores<Tissue>)
      energy = assembly_.energy(at.data(), flushed());
    else
      energy = assembly_.energy(at.data());
    for (int i = 0; i < moving_; ++i)
      energy -= (gravity_[0] * at(0, i) + gravity_[1] * at(1, i) + gravity_[2] * at(2, i)) / inverse_mass_[static_cast<std::size_t>(i)];
    for (auto const& push : pushes_)
      for (int k = 0; k < 3; ++k) energy -= push.force[k] * at(k, push.column);
    return energy;
  }
  Scalar potential_rounding() const noexcept
    requires HasAssemblyEnergy<Tissue>
  {
    return assembly_.energy_rounding();
  }
  void take_history(Tissue const& tissue) noexcept
    requires HasHistory<Tissue>
  {
    assembly_.take_history(tissue);
  }
  /// Of the elements that act on the moving particles, where they are, one of so many parts.
  detail::LowestDeterminant<Scalar> lowest_determinant(int part = 0, int parts = 1) noexcept
    requires HasLowestDeterminant<Tissue>
  {
    auto const as_ours = [](auto const& lowest) {
      return detail::LowestDeterminant<Scalar>{static_cast<int>(lowest.element), static_cast<Scalar>(lowest.value)};
    };
    Scalar const* const x = now(x_, &State::position).padded_view().data();
    if constexpr (detail::LooksAtParts<typename Tissue::Assembly, Scalar>)
      return as_ours(assembly_.lowest_determinant(x, part, parts));
    else
      return part == 0 ? as_ours(assembly_.lowest_determinant(x)) : detail::LowestDeterminant<Scalar>{};
  }
  void take(SolveReport<Scalar> const& report) noexcept { solve_ = report; }
  SolveReport<Scalar> const& solve() const noexcept { return solve_; }

  int moving() const noexcept { return moving_; }
  /// Of a particle of the body, −1 where it does not move.
  int column_of(int particle) const noexcept { return place_[static_cast<std::size_t>(particle)]; }

  explicit BodySystem(Execution run = {}) : run_(std::move(run)) {}

  /// Chooses the moving particles and gathers what acts on them.
  void choose(Tissue const& tissue, std::span<int const> moving) {
    for (int const p : assembly_.particles())
      if (static_cast<std::size_t>(p) < place_.size()) place_[static_cast<std::size_t>(p)] = -1;
    place_.resize(static_cast<std::size_t>(tissue.size()), -1);
    if constexpr (FollowsEdits<Tissue>)
      tissue.follow_edits(moving, assembly_);
    else
      tissue.assemble(moving, assembly_);
    moving_ = static_cast<int>(moving.size());
    all_ = static_cast<int>(assembly_.particles().size());
    for (auto* columns : {&x_, &v_, &memory_, &border_x_, &border_v_}) columns->resize(all_);
    if constexpr (HasFusedForces<Tissue>)
      force_.resize(assembly_.force_columns());
    else
      force_.resize(all_);
    inverse_mass_.resize(static_cast<std::size_t>(moving_));
    is_whole_ = moving_ == tissue.size();
    for (int k = 0; k < moving_; ++k) {
      int const p = moving[static_cast<std::size_t>(k)];
      is_whole_ = is_whole_ && p == k;
      place_[static_cast<std::size_t>(p)] = k;
      inverse_mass_[static_cast<std::size_t>(k)] = 1 / tissue.mass(p);
    }
    is_gathered_ = false, foreseen_h_ = 0;
  }

  /// What of the assembly belongs to what makes the body's future, and it back, with tissue that belongs to it.
  Layout layout() const {
    if constexpr (FollowsEdits<Tissue>)
      return assembly_.layout();
    else
      return {};
  }
  void restore([[maybe_unused]] Layout const& layout) {
    foreseen_h_ = 0;
    std::fill(place_.begin(), place_.end(), -1);   // the assembly will not know whose these were
    if constexpr (FollowsEdits<Tissue>) assembly_.take(layout);
  }

  /// Room for sets up to this size, so that choosing them does not allocate.
  void reserve([[maybe_unused]] Tissue const& tissue, int particles, [[maybe_unused]] int triangles) {
    for (auto* columns : {&x_, &v_, &border_x_, &border_v_, &force_, &memory_, &direction_, &product_}) columns->reserve(particles);
    inverse_mass_.reserve(static_cast<std::size_t>(particles));
    for (auto& columns : scratch_) columns.reserve(particles);
    for (auto& columns : floats_) columns.reserve(particles);
    place_.reserve(static_cast<std::size_t>(particles)), pushes_.reserve(2 * static_cast<std::size_t>(particles)), told_.reserve(2 * static_cast<std::size_t>(particles)), diverged_.reserve(16);
    list_.reserve(static_cast<std::size_t>(particles));
    if constexpr (ReservesMemory<Tissue>) assembly_.reserve(tissue, particles, triangles);
    if constexpr (HasFusedForces<Tissue>) force_.reserve(Tissue::Assembly::max_force_columns(particles));
  }

  /// What is gathered is void: the state was changed from outside.
  void forget() noexcept { is_gathered_ = false, foreseen_h_ = 0; }

  /// Makes ready for a step that stays within `bound` [m] of the origin, with the forces [N] on the particles in `forced`. `fused_step`: the step
  /// will be one step_by_parts.
  void begin(State& state, std::span<int const> forced, Vector3<Scalar> const& gravity, bool remembers, Scalar bound, bool fused_step) {
    remembers_ = remembers;
    gravity_ = gravity;
    bound_ = bound;
    fused_step_ = fused_step;
    diverged_one_ = {};
    solve_ = {};
    direct_ = is_whole_ ? &state : nullptr;
    keeps_ = direct_ != nullptr && (!fused_step || blocks() == 1);
    if (direct_ == nullptr)
      gather(state);
    else if (!fused_step)
      x_.padded_view() = state.position.padded_view(), v_.padded_view() = state.velocity.padded_view(), memory_.padded_view() = state.remembered.padded_view();
    told_.swap(pushes_), pushes_.clear();
    for (int const p : forced)
      if (int const k = place_[static_cast<std::size_t>(p)]; k >= 0) pushes_.push_back({k, state.applied[p]});
    auto const by_column = [](ColumnForce<Scalar> const& a, ColumnForce<Scalar> const& b) { return a.column < b.column; };
    if (!std::is_sorted(pushes_.begin(), pushes_.end(), by_column)) std::sort(pushes_.begin(), pushes_.end(), by_column);
    auto const same = [](ColumnForce<Scalar> const& a, ColumnForce<Scalar> const& b) { return a.column == b.column; };   // a particle may be listed twice
    pushes_.erase(std::unique(pushes_.begin(), pushes_.end(), same), pushes_.end());
  }

  /// The step counts: hands its state back.
  void commit(State& state) noexcept {
    foreseen_h_ = 0;
    if (direct_ != nullptr) return;
    auto const particles = assembly_.particles();
    for (int i = 0, count = 1; i < moving_; i += count, count = 1) {
      int const p = particles[static_cast<std::size_t>(i)];
      while (i + count < moving_ && particles[static_cast<std::size_t>(i + count)] == p + count) ++count;   // neighbours in the body, mostly
      copy(x_, i, count, state.position, p), copy(v_, i, count, state.velocity, p), copy(memory_, i, count, state.remembered, p);
    }
  }
  /// It does not: the state is as before. Where it is so to rounding only, because no copy was kept, what the integrator remembered is lost:
  /// false.
  bool roll_back(State& state) noexcept {
    is_gathered_ = false, foreseen_h_ = 0;
    if (keeps_) {
      state.position.padded_view() = x_.padded_view(), state.velocity.padded_view() = v_.padded_view(), state.remembered.padded_view() = memory_.padded_view();
    } else if (direct_ != nullptr) {
      state.remembered.set_zero();
      return false;
    }
    return true;
  }

  /// The first particle [of the body] that the step has taken, or would have, out of the bound or to a velocity that is not finite.
  Divergence<Scalar> find_diverged() noexcept {
    Divergence<Scalar> found = fused_step_ ? diverged_one_ : palpate::find_diverged<Scalar>(positions(), velocities(), bound_);
    if (found.particle >= 0) found.particle = assembly_.particles()[static_cast<std::size_t>(found.particle)];
    return found;
  }

 private:
  using Four = simd::Pack<Scalar, 4>;
  using Narrow = typename PaddedColumns<Scalar>::ConstView;
  static Narrow narrow(PaddedView<Scalar> const& columns) noexcept { return Narrow(columns.data(), 3, columns.cols()); }

  /// What an integrator does to a particle after the forces; one that it would take out of the bound moves on without acceleration, and is noted.
  template <class Parts>
  [[gnu::noinline]] static void after_or_stay(Parts const& parts, int i, Scalar* x, Scalar* v, Scalar* m, Scalar const* acceleration,
                                              Scalar bound, Divergence<Scalar>& found) noexcept {
    Four x_i, v_i, a_i;
    simd::load(x_i, x), simd::load(v_i, v), simd::load(a_i, acceleration);
    parts.after(x_i, v_i, a_i);
    if (!simd::all_below(Four(x_i * x_i + (v_i - v_i)), bound * bound)) {
      if (found.particle < 0 || i < found.particle) found = {i, diverged_value<Scalar>(x_i, v_i, bound)};
      simd::load(x_i, x), simd::load(v_i, v);
      a_i = Four{};
      parts.after(x_i, v_i, a_i);
    }
    simd::store(x, x_i), simd::store(v, v_i), simd::store(m, a_i);
  }

  static void copy(PaddedColumns<Scalar> const& from, int first, int count, PaddedColumns<Scalar>& to, int place) noexcept {
    std::copy_n(from.padded_view().data() + 4 * static_cast<std::ptrdiff_t>(first), 4 * count, to.padded_view().data() + 4 * static_cast<std::ptrdiff_t>(place));
  }

  template <class D>
  static constexpr bool is_padded = std::same_as<std::remove_cvref_t<D>, StridedView<Scalar>> || std::same_as<std::remove_cvref_t<D>, PaddedView<Scalar>>;

  PaddedColumns<Scalar>& now(PaddedColumns<Scalar>& gathered, PaddedColumns<Scalar> State::*own) noexcept {
    return direct_ != nullptr ? direct_->*own : gathered;
  }

  template <class Parts>
  void undo(Parts const& parts, Scalar* x, Scalar* v, Scalar const* m) const noexcept {
    for (std::ptrdiff_t k = 0; k < 4 * static_cast<std::ptrdiff_t>(moving_); k += 4) {
      Four x_i, v_i, a_i;
      simd::load(x_i, x + k), simd::load(v_i, v + k), simd::load(a_i, m + k);
      parts.undo(x_i, v_i, a_i);
      simd::store(x + k, x_i), simd::store(v + k, v_i);
    }
  }

  /// The state of the moving set and its border, where that has changed. The memory's border is that of the velocities: an integrator may
  /// leave the velocities it asks forces for there.
  void gather(State const& state) {
    if (is_gathered_) return;
    for (auto* columns : {&x_, &v_, &memory_, &border_x_, &border_v_}) columns->set_zero();   // a step that diverged leaves none
    auto const particles = assembly_.particles();
    for (int k = 0; k < all_; ++k) {
      int const p = particles[static_cast<std::size_t>(k)];
      border_x_[k] = x_[k] = state.position[p];
      border_v_[k] = v_[k] = state.velocity[p];
      memory_[k] = k < moving_ ? state.remembered[p] : state.velocity[p];
    }
    is_gathered_ = true;
  }

  auto flushed() const noexcept {
    return [this](int n, auto const& walk) {
      run_(n, [&walk](int k) {
        FlushDenormals const flush;   // in whichever thread
        walk(k);
      });
    };
  }
  template <RealScalar Number>
  void multiply(Scalar mass, Scalar damping, Scalar stiffness, Number const* d, Number* out) {
    if constexpr (HasTangentOnCores<Tissue>)
      assembly_.multiply_tangent(mass, damping, stiffness, d, out, flushed());
    else
      assembly_.multiply_tangent(mass, damping, stiffness, d, out);
  }
  template <std::size_t Count, class Before, class AfterOf>
  void accelerate(PaddedView<Scalar> const& x, PaddedView<Scalar> const& v, std::array<Scalar const*, Count> const& columns, Before const& before,
                  AfterOf const& after_of) {
    if constexpr (HasFusedForces<Tissue>) {
      assembly_.accelerate(x.data(), v.data(), gravity_, std::span<ColumnForce<Scalar> const>(pushes_), force_.padded_view().data(), flushed(), columns, before,
                           after_of);
    } else {
      before(0, moving_);
      auto force = force_.view();
      assembly_.add_forces(narrow(x), narrow(v), force);
      for (auto const& push : pushes_) force.col(push.column) += push.force;
      auto after = after_of(0);
      for (int i = 0; i < moving_; ++i) {
        Vector3<Scalar> const a = inverse_mass_[static_cast<std::size_t>(i)] * force.col(i) + gravity_;
        after(i, Four{a[0], a[1], a[2], Scalar(0)});
      }
      force_.set_zero();
    }
  }
  int blocks() const noexcept {
    if constexpr (HasFusedForces<Tissue>)
      return assembly_.blocks();
    else
      return 1;
  }

  /// Whether columns are those of a scratch(), which have room for the border behind them.
  template <class C>
  bool is_scratch(C const& columns) const noexcept {
    return std::any_of(scratch_.begin(), scratch_.end(), [&](auto const& one) { return one.size() == all_ && one.padded_view().data() == columns.data(); });
  }
  template <class Out>
  void hand_out(Out&& out) {
    if constexpr (int{std::remove_cvref_t<Out>::RowsAtCompileTime} == 4)
      out = product_.padded_view().leftCols(moving_);
    else
      out = product_.view(moving_);
  }

  /// x and behind it the border: where both lie so in memory already, or copied into `buffer`, which holds the border.
  template <class X>
  PaddedView<Scalar> with_border(X const& x, PaddedColumns<Scalar>& buffer) noexcept {
    if constexpr (is_padded<X>)
      if (all_ == moving_ || x.data() == x_.padded_view().data() || x.data() == v_.padded_view().data() || x.data() == memory_.padded_view().data())
        return PaddedView<Scalar>(const_cast<Scalar*>(x.data()), 4, all_);
    if constexpr (int{X::RowsAtCompileTime} == 4)
      buffer.padded_view().leftCols(moving_) = x;
    else
      buffer.view(moving_) = x;
    return buffer.padded_view();
  }

  typename Tissue::Assembly assembly_;
  int moving_ = 0;
  int all_ = 0;                    // with the border
  bool remembers_ = false;
  bool is_gathered_ = false;
  bool is_whole_ = false;          // the moving set is all particles in the body's order
  bool fused_step_ = false;
  bool keeps_ = false;             // a copy of the state before the step
  State* direct_ = nullptr;        // during a step of the whole body: its state
  Vector3<Scalar> gravity_ = Vector3<Scalar>::Zero();
  Scalar bound_ = 0;
  Scalar foreseen_h_ = 0;          // s
  Execution run_;
  PaddedColumns<Scalar> x_, v_, memory_;                    // moving set, then border; or the whole body before the step
  PaddedColumns<Scalar> border_x_, border_v_, force_;       // as x_, force_ with windows behind; it is zero between calls
  PaddedColumns<Scalar> direction_, product_;               // as x_: of multiply_tangent
  std::array<PaddedColumns<Scalar>, 12> scratch_;
  std::array<PaddedColumns<float>, HasFloatTangent<Tissue> ? 6 : 0> floats_;   // as scratch_
  std::vector<Scalar> inverse_mass_;      // 1/kg, moving set
  std::vector<int> place_;                // particle of the body → column, −1 outside the moving set
  std::vector<int> list_;                 // an integrator's
  std::vector<ColumnForce<Scalar>> pushes_, told_;   // in the order of their columns; those of the begin() before
  std::vector<Divergence<Scalar>> diverged_;   // the first of each block, its column
  Divergence<Scalar> diverged_one_;
  SolveReport<Scalar> solve_;
};

}  // namespace palpate
