// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/applied_forces.hpp>
#include <palpate/body/balance.hpp>
#include <palpate/body/body_shape.hpp>
#include <palpate/body/body_system.hpp>
#include <palpate/body/moving_set.hpp>
#include <palpate/body/stability.hpp>
#include <palpate/body/truncation.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/execution.hpp>
#include <palpate/region/concept.hpp>
#include <palpate/statics/dynamic_relaxation.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace palpate {

/// A soft body but for its integrator: what acts on it, which of its particles move, where it would rest, how it is saved.
/// Bodies that differ in their integrators alone share it, so that a host with several compiles it once. SoftBody is what a host uses.
/// Units, errors, cost and threads are those of SoftBody.
template <class TissueType, class RegionType, class ExecutionType>
class BodyMotion : public BodyShape<TissueType> {
  using Shape = BodyShape<TissueType>;

 public:
  using Tissue = TissueType;
  using Scalar = typename Tissue::Scalar;
  using Vector = Vector3<Scalar>;
  using Shape::positions, Shape::velocities, Shape::size, Shape::tissue, Shape::triangles;

  Scalar time() const noexcept { return time_; }
  Scalar total_mass() const noexcept {
    Scalar sum = 0;
    for (int i = 0; i < size(); ++i) sum += tissue_.mass(i);
    return sum;
  }
  Vector momentum() const noexcept {   // kg m/s
    Vector sum = Vector::Zero();
    for (int i = 0; i < size(); ++i) sum += tissue_.mass(i) * state_.velocity[i];
    return sum;
  }
  Scalar kinetic_energy() const noexcept {   // J
    Scalar sum = 0;
    for (int i = 0; i < size(); ++i) sum += tissue_.mass(i) / 2 * state_.velocity[i].squaredNorm();
    return sum;
  }
  Scalar potential_energy() const   // J, of the tissue; gravity is not counted
    requires HasPotentialEnergy<Tissue>
  {
    return tissue_.potential_energy(positions());
  }

  // --- what acts on it ----------------------------------------------------------------------------------------------
  /// Adds a force [N] on a particle: constant over the next step, consumed by it. On a nailed or held particle it moves nothing
  /// and counts in reaction().
  void apply_force(int i, Vector const& force) {
    this->check(i);
    require_finite("the force on particle", i, force, "N");
    forces_.add(state_, i, force);
  }

  /// What was applied to a particle since the last step [N].
  Vector applied_force(int i) const {
    this->check(i);
    return state_.applied[i];
  }

  /// A uniform acceleration of every particle [m/s²]. Wakes the whole body; settle() finds the new equilibrium at once.
  void set_gravity(Vector const& gravity) {
    detail::require_finite("gravity", gravity, "m/s²");
    gravity_ = gravity;
    system_.forget();
    moving_.wake();
  }
  Vector gravity() const noexcept { return gravity_; }

  void nail(int i) {
    this->check(i);
    tissue_.nail(i);
    state_.velocity[i].setZero();
    moving_.forget();
  }
  /// Holds a particle where it is; drag() then moves it, release() lets it go with the velocity it was dragged with.
  void hold(int i) {
    this->check(i);
    char& held = state_.held[static_cast<std::size_t>(i)];
    if (held == 0) {
      held = 1;
      held_.push_back(i);
      state_.velocity[i].setZero();
      state_.remembered[i].setZero();
      moving_.forget();
    }
  }
  void drag(int i, Vector const& position, Vector const& velocity = Vector::Zero()) {
    this->check(i);
    require_finite("the position for particle", i, position, "m");
    require_finite("the velocity for particle", i, velocity, "m/s");
    hold(i);
    state_.position[i] = position;
    state_.velocity[i] = velocity;
    system_.forget();
    tree_is_fitted_ = false;
  }
  void release(int i) {
    this->check(i);
    if (!holds(i)) return;
    state_.held[static_cast<std::size_t>(i)] = 0;
    std::erase(held_, i);
    moving_.add(i);   // it moves until it has relaxed
  }

  /// The force [N] that a nail or hand exerts on a particle to keep it in place: −(springs + weight + force of the last step).
  Vector reaction(int i) const {
    this->check(i);
    return -(tissue_.internal_force(i, positions(), velocities()) + tissue_.mass(i) * gravity_ + state_.load[i]);
  }

  /// Room for this many particles and triangles: up to there neither stepping nor cutting allocates.
  void reserve(int particle_count, int triangle_count) {
    Shape::reserve(particle_count, triangle_count);
    system_.reserve(tissue_, particle_count, triangle_count);
    moving_.reserve(particle_count);
    forces_.reserve(particle_count);
    modal_estimate_.reserve(particle_count);
    held_.reserve(2 * static_cast<std::size_t>(particle_count));
  }

  // --- how it moves -------------------------------------------------------------------------------------------------
  /// Applies a constraint on positions, such as MaximumElongation, to the particles that the last step moved; it reports what it found.
  /// What it moves gets the velocity that goes with it, Δx/h of that step. Others count as fixed. Allocates nothing.
  template <class Constraint>
  auto correct(Constraint const& constraint) noexcept {
    Scalar const per_second = last_step_ > 0 ? 1 / last_step_ : Scalar(0);
    auto const report = constraint.correct(
        tissue_, moving_.particles(),
        [&](int i) { return i < size() && moving_.contains(i) && is_free(i) ? 1 / tissue_.mass(i) : Scalar(0); }, positions(),
        [&](int i, Vector const& shift) {
          state_.position[i] += shift;
          state_.velocity[i] += per_second * shift;
        });
    system_.forget();
    tree_is_fitted_ = false;
    return report;
  }

  /// What the cut-off of the region costs [m]: an estimate of the largest error of a position, against the whole body, where the zone
  /// rests; from the force that its border holds back. 0 where all that is pulled moves. See palpate::truncation_error.
  Scalar truncation_error() const noexcept { return palpate::truncation_error(view(), moving_.border()); }

  /// Whether the body's fastest mode has become so fast since stable_step() was asked that half of its margin is gone: the stable step
  /// falls while a wound opens under pre-tension, also without an edit. Cheap, one product for each bound: ask it every few
  /// steps while the body moves, and stable_step() when it is so. It sees a mode that grows out of the last fastest one at once,
  /// another after some questions.
  bool stable_step_fell() {
    if (!modes_are_known_) return true;
    ModalBounds<Scalar> const now = modal_estimate_.follow(tissue_, positions(), [&](int i) { return is_free(i); });
    Scalar const most = HasStiffnessProduct<Tissue> ? Scalar(1.025 / 1.05) : Scalar(1);
    return now.squared_frequency > most * known_modes_.squared_frequency || now.decay_rate > most * known_modes_.decay_rate;
  }
  /// Above its modes for certain, from Gershgorin's row sums; see row_bounds.
  ModalBounds<Scalar> guaranteed_modal_bounds() const {
    return row_bounds(tissue_, positions(), [&](int i) { return is_free(i); });
  }
  /// The body's fastest modes where it is now; see ModalEstimate.
  ModalBounds<Scalar> modal_bounds() {
    return modal_estimate_(tissue_, positions(), [&](int i) { return is_free(i); });
  }

  // --- where it rests -----------------------------------------------------------------------------------------------
  /// Moves the body to its equilibrium under pre-tension, gravity and what is held, at rest, and makes that the home shape that
  /// depth is counted from. Balance is when no force over its particle's stiffness is above `tolerance` mean edges; 0: 1e-8, or what the
  /// digits allow. Throws Error when the solver does not get there, and leaves the body as it was.
  void settle() { settle(DynamicRelaxation{}); }
  void settle(Scalar tolerance) { settle(DynamicRelaxation{}, tolerance); }
  template <EquilibriumSolver<Tissue> Solver>
  Equilibrium<Scalar> settle(Solver const& solver, Scalar tolerance = 0) {
    auto const found = find_balance(solver, tolerance, false, true);
    require_balance(found, mean_edge_, "the body does not settle", "lower link_prestrain or gravity, or raise the home stiffness");
    moving_.restart(false);
    state_.home.view() = state_.position.view();
    home_gravity_ = gravity_;
    home_revision_ = revision();
    this->set_normals();
    return found;
  }
  template <class Other>
    requires(!EquilibriumSolver<Other, Tissue> && !std::convertible_to<Other, Scalar>)
  Equilibrium<Scalar> settle(Other const&, Scalar = 0) {
    return (void(detail::SolverSentences<Other, Tissue>{}), Equilibrium<Scalar>{});
  }

  /// Moves the body to where it would come to rest if the forces applied so far stayed: at rest, and the forces are consumed as by a step.
  /// The home shape stays, so a later step without the forces begins the way back to it. Tolerance and errors as for settle().
  template <EquilibriumSolver<Tissue> Solver = DynamicRelaxation>
  Equilibrium<Scalar> solve_statics(Solver const& solver = {}, Scalar tolerance = 0) {
    auto const found = find_balance(solver, tolerance, true, true);
    require_balance(found, mean_edge_, "no equilibrium was found", "lower the forces, nail the body or raise the home stiffness, or give the solver more iterations");
    take_as_stepped();
    return found;
  }
  template <class Other>
    requires(!EquilibriumSolver<Other, Tissue>)
  Equilibrium<Scalar> solve_statics(Other const&, Scalar = 0) {
    return (void(detail::SolverSentences<Other, Tissue>{}), Equilibrium<Scalar>{});
  }

  /// The same, with what the solver reached in its budget, in balance or not: a static step of a simulation that shows every one.
  /// A solver that leaves the finite numbers leaves the body where it was.
  template <EquilibriumSolver<Tissue> Solver>
  Equilibrium<Scalar> relax(Solver const& solver, Scalar tolerance = 0) {
    auto const found = find_balance(solver, tolerance, true, false);
    take_as_stepped();
    return found;
  }
  template <class Other>
    requires(!EquilibriumSolver<Other, Tissue>)
  Equilibrium<Scalar> relax(Other const&, Scalar = 0) {
    return (void(detail::SolverSentences<Other, Tissue>{}), Equilibrium<Scalar>{});
  }

  /// Back to the home shape at rest: no forces, nothing held, time 0. Cuts and nails stay; restore(save()) undoes those as well.
  void reset() {
    state_.position.view() = state_.home.view();
    for (auto* columns : {&state_.velocity, &state_.remembered, &state_.applied, &state_.load}) columns->view().setZero();
    state_.held.assign(state_.held.size(), 0);
    held_.clear(), forces_.clear();
    if constexpr (HasHistory<Tissue>) {
      tissue_.forget();
      system_.take_history(tissue_);
    }
    moving_.restart(gravity_ != home_gravity_ || revision() != home_revision_);   // else the home shape is in balance
    remembers_ = tree_is_fitted_ = modes_are_known_ = false;
    time_ = last_step_ = 0, looks_ = 0;
  }

  /// Everything that makes the body's future: positions, velocities, forces, tissue with its cuts, time.
  struct State {
    Tissue tissue;
    ParticleState<Scalar> particles;
    std::vector<int> held, forced, disturbed;   // the last: by edits that no step has seen yet,
    std::size_t evened;                         // of which so many were looked at by even_masses()
    typename MovingSet<Tissue, RegionType>::State moving;
    Vector gravity, home_gravity;
    std::size_t home_revision;
    bool remembers;
    Scalar time, last_step;
    std::vector<SolidEdit<Scalar>> solid_edits;
    std::size_t numbering;
    typename BodySystem<Tissue, ExecutionType>::Layout layout;
    ModalSearch<Scalar> search;      // of explicit bodies' fastest modes,
    typename detail::LayoutOf<Tissue>::type search_layout;
    ModalBounds<Scalar> modes;       // and what it found last,
    std::size_t modes_of;            // at this revision
    bool modes_are_known;
    int looks;                   // the part of the elements that an explicit step looked at last
    SurfaceTree<Scalar> tree;   // edits have shaped it: another one is searched in another order
    bool tree_is_fitted;
    Scalar mean_edge, bound, offset;   // of the undisturbed body: what counts as near, small and far
  };
  /// While a cut is in progress the wound is saved as if it ended where the blade is.
  State save() const {
    if constexpr (CuttableTissue<Tissue>)
      if (!temporaries_.empty()) {
        BodyMotion cut = *this;
        cut.make_all_permanent();
        return cut.save();
      }
    auto const forced = forces_.forced();
    return {tissue_,  state_,        held_,          {forced.begin(), forced.end()}, disturbed_, this->evened_, moving_.save(),
            gravity_, home_gravity_, home_revision_, remembers_, time_, last_step_, this->solid_edits_, this->numbering_, system_.layout(),
            modal_estimate_.search(), modal_estimate_.layout(), known_modes_, modes_of_, modes_are_known_, looks_, this->tree_, tree_is_fitted_, mean_edge_, bound_, offset_};
  }
  void restore(State const& saved) {
    tissue_ = saved.tissue;
    state_ = saved.particles;
    held_ = saved.held;
    forces_.restore(state_, saved.forced);
    mean_edge_ = saved.mean_edge, bound_ = saved.bound, offset_ = saved.offset;
    moving_.set_scale(mean_edge_, offset_);
    moving_.restore(saved.moving);
    system_.restore(saved.layout);
    modal_estimate_.set_order(moving_.order());
    modal_estimate_.resume(saved.search, saved.search_layout);
    known_modes_ = saved.modes, modes_of_ = saved.modes_of, modes_are_known_ = saved.modes_are_known;
    looks_ = saved.looks;
    gravity_ = saved.gravity, home_gravity_ = saved.home_gravity, home_revision_ = saved.home_revision;
    remembers_ = saved.remembers, time_ = saved.time, last_step_ = saved.last_step;
    this->solid_edits_ = saved.solid_edits, this->numbering_ = saved.numbering;
    disturbed_ = saved.disturbed, this->evened_ = saved.evened;
    temporaries_.clear(), this->kept_.clear();
    this->take_tree(saved.tree, saved.tree_is_fitted);
    this->changes_.forget(0, 0);   // all is new
    ++topology_revision_;
    ++restorations_;
  }

 protected:
  using Shape::disturbed_, Shape::holds, Shape::is_free, Shape::mean_edge_, Shape::restorations_, Shape::state_, Shape::temporaries_, Shape::tissue_,
      Shape::topology_revision_, Shape::tree_is_fitted_;

  BodyMotion(Tissue matter, RegionType region, ExecutionType execution)
      : Shape(std::move(matter)), system_(std::move(execution)), moving_(std::move(region)) {
    auto const [low, high] = low_and_high(positions());
    bound_ = 1000 * Vector(high - low).norm();
    offset_ = std::max(Vector(low.cwiseAbs()).maxCoeff(), Vector(high.cwiseAbs()).maxCoeff());
    moving_.set_scale(mean_edge_, offset_);
    moving_.find_order(tissue_);
    modal_estimate_.set_order(moving_.order());
    reserve(size(), tissue_.surface().triangle_count());
    home_revision_ = revision();
    if constexpr (HasPrestrain<Tissue>)
      if (tissue_.link_prestrain() > 0) settle();
  }

  static void require_finite(std::string_view what, int i, Vector const& value, std::string_view unit) {
    if (!is_finite(value)) detail::require_finite(detail::message(what, " ", i), value, unit);
  }

  static void require_duration(std::string_view what, Scalar h) {
    if (!(h >= 0) || !std::isfinite(h))
      throw InvalidArgument(detail::message(what, " of ", h, " s; it must be finite and not negative"));
  }

  /// The stable step for these modes was asked for after the last edit of the tissue.
  bool knows_modes() const noexcept { return modes_are_known_ && modes_of_ == revision(); }
  ModalBounds<Scalar> const& known_modes() const noexcept { return known_modes_; }
  ModalBounds<Scalar> const& find_modes() {
    known_modes_ = modal_bounds();
    modes_are_known_ = true;
    modes_of_ = revision();
    return known_modes_;
  }

  /// The acceleration [m/s²] of a free particle after so long a way at the present velocities.
  Vector acceleration_after(int i, Scalar drift) const {
    return gravity_ + (tissue_.internal_force(i, Drifted{state_, drift}, velocities()) + state_.applied[i]) / tissue_.mass(i);
  }

  /// What comes before and after an integrator's step, see SoftBody::take_step. False where nothing moves.
  bool begin_step(Scalar h, bool fused_step) {
    choose_moving();
    return begin_chosen(h, fused_step);
  }
  /// The same for a look ahead. A region that follows the touch chooses when all forces of the tick are there: until then those move that did, and
  /// after an edit nothing is foreseen.
  bool begin_forecast(Scalar h) {
    if constexpr (!RegionType::follows_touch) {
      return begin_step(h, false);
    } else {
      if (!disturbed_.empty()) return false;
      if (!moving_.is_gathered(view())) {
        auto const particles = moving_.particles();
        if (!std::ranges::all_of(particles, [this](int i) { return is_free(i); })) return false;
        system_.choose(tissue_, particles);
        moving_.set_gathered(view());
      }
      return begin_chosen(h, false);
    }
  }
  void undo_step() {
    if (!system_.roll_back(state_)) remembers_ = false;
  }
  void commit_step(Scalar h) {
    system_.commit(state_);
    remembers_ = true;
    last_step_ = h;
    tree_is_fitted_ = false;
  }
  void end_step(Scalar h) {
    time_ += h;
    if constexpr (HasHistory<Tissue>) {
      tissue_.remember(positions(), h);
      system_.take_history(tissue_);
    }
  }

  /// Which of so many parts of the elements is looked at next.
  int next_part(int parts) noexcept { return looks_ = (looks_ + 1) % parts; }

  std::size_t moving_count() const noexcept { return moving_.particles().size(); }
  void consume_forces() { forces_.consume(state_); }
  std::size_t revision() const noexcept { return tissue_.revision(); }

  BodySystem<Tissue, ExecutionType> system_;

 private:
  /// Takes the positions that a solver finds for the free particles, all at rest; with `only_balance`, only when they are balanced.
  template <class Solver>
  Equilibrium<Scalar> find_balance(Solver const& solver, Scalar tolerance, bool with_forces, bool only_balance) {
    Matrix3X<Scalar> x = positions();
    auto const found = palpate::find_balance(solver, view(), moving_.order(), tolerance, mean_edge_, offset_, with_forces, x);
    if (only_balance && !found.converged) return found;
    for (int i = 0; i < size(); ++i) {
      if (!is_free(i)) continue;
      state_.position[i] = x.col(i);
      state_.velocity[i].setZero();
      state_.remembered[i].setZero();
    }
    system_.forget();
    moving_.forget();
    tree_is_fitted_ = modes_are_known_ = false;
    return found;
  }

  void take_as_stepped() noexcept {
    forces_.consume(state_);
    moving_.wake();
  }

  BodyView<Tissue> view() const noexcept {
    return {tissue_, state_, forces_.forced(), held_, gravity_, last_step_, revision()};
  }

  bool begin_chosen(Scalar h, bool fused_step) {
    if (moving_.is_empty() || !(h > 0)) return false;
    Scalar const t = static_cast<Scalar>(time_) + 2 * h, falls = t * t * std::max(gravity_.norm(), Scalar(10));   // what nothing holds may have gone half as far
    system_.begin(state_, forces_.forced(), gravity_, remembers_, bound_ + offset_ + falls, fused_step);
    return true;
  }
  void choose_moving() {
    if (moving_.is_chosen(view())) return;
    if (!disturbed_.empty()) {
      forces_.follow_edits(state_, disturbed_);
      std::erase_if(held_, [this](int i) { return i >= size() || !holds(i); });   // a number that is given out again is another particle
      moving_.follow_edits(tissue_, disturbed_);
      disturbed_.clear();
      this->evened_ = 0;
    }
    if (moving_.choose(view(), state_, !(time_ > 0))) system_.choose(tissue_, moving_.particles());
  }

  /// Positions after a while at the present velocities, as a 3 × n expression.
  struct Drifted {
    ParticleState<Scalar> const& state;
    Scalar time;
    Vector col(int i) const noexcept { return state.position[i] + time * state.velocity[i]; }
  };

  ModalEstimate<Tissue> modal_estimate_;
  MovingSet<Tissue, RegionType> moving_;
  AppliedForces forces_;
  std::vector<int> held_;
  Vector gravity_ = Vector::Zero();
  Vector home_gravity_ = Vector::Zero();   // with this, and tissue of this revision, the home shape is in equilibrium
  std::size_t home_revision_ = 0;
  Scalar bound_ = 0;       // m, a particle farther out has diverged
  Scalar offset_ = 0;      // m, distance of the body from the origin
  Scalar time_ = 0;
  Scalar last_step_ = 0;   // s
  ModalBounds<Scalar> known_modes_;
  std::size_t modes_of_ = 0;   // revision
  int looks_ = 0;
  bool modes_are_known_ = false;
  bool remembers_ = false;
};

}  // namespace palpate
