// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/body_motion.hpp>
#include <palpate/body/body_system.hpp>
#include <palpate/body/stability.hpp>
#include <palpate/body/step_report.hpp>
#include <palpate/body/substeps.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/flush_denormals.hpp>
#include <palpate/core/policy.hpp>
#include <palpate/core/serial.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/solve_report.hpp>
#include <palpate/integrator/motion_forecast.hpp>
#include <palpate/region/whole_body.hpp>

#include <limits>
#include <optional>
#include <type_traits>
#include <utility>

namespace palpate {

namespace detail {

/// What makes a soft body together.
template <class Tissue, class I, class R, class E>
concept MakeSoftBody = TissueModel<Tissue> && Integrator<I, typename Tissue::Scalar> && Region<R> && Execution<E> &&
                       (!ImplicitIntegrator<I, typename Tissue::Scalar> || HasTangentOperator<Tissue>);

/// What moves a tissue when the host says nothing: the tissue's own wish, or leapfrog.
template <class Tissue>
struct DefaultIntegratorOf {
  using type = LeapfrogVerlet;
};
template <HasDefaultIntegrator Tissue>
struct DefaultIntegratorOf<Tissue> {
  using type = typename Tissue::DefaultIntegrator;
};
template <class Tissue>
using DefaultIntegrator = typename DefaultIntegratorOf<Tissue>::type;

/// Says, where it is instantiated, what keeps these from it.
template <class Tissue, class I, class R, class E, bool is_tissue = TissueModel<Tissue>>
struct SoftBodySentences : std::conditional_t<IsRefused<Tissue>, std::type_identity<Tissue>, TissueSentences<Tissue>> {};
template <class Tissue, class I, class R, class E>
struct SoftBodySentences<Tissue, I, R, E, true> : IntegratorSentences<I, typename Tissue::Scalar>, RegionSentences<R> {
  static_assert(!ImplicitIntegrator<I, typename Tissue::Scalar> || HasTangentOperator<Tissue>,
                "SoftBody: this integrator is implicit and needs the tangent stiffness of the tissue: take MassSpring with a law that has "
                "tangent_stiffness(elongation, rest_length), or an explicit integrator such as LeapfrogVerlet.");
  static_assert(Execution<E>, "SoftBody: the fourth policy is no Execution; Serial{} and OnCores(2) are.");
};

}  // namespace detail

/// A soft body: tissue, how it moves and which particles are computed, with its state.
///
///   SoftBody body(std::move(tissue), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 2});
///   body.apply_force(body.nearest_vertex(tip), {0, 0, -1});   // N, for the next step
///   body.step(1e-3);                                          // s
///
/// Units      SI; world frame.
/// Shapes     positions(), velocities(): 3 × size(), one column per particle, in the order of the mesh; particles that a cut adds
///            are appended.
/// Errors     InvalidArgument or OutOfRange for a bad index or a value that is not finite; the body is left as it was.
///            A step that would diverge is not taken: the last finite state stays, to rounding where more than 4,096 particles of a
///            whole body move, and the report says which particle.
/// Cost       step: O(moving particles). It allocates only when the moving set outgrows what was reserved.
/// Threads    one thread at a time; queries refit the search tree when the body has moved.
template <class TissueType, class IntegratorType, class RegionType, class ExecutionType = Serial>
class SoftBody : public BodyMotion<TissueType, RegionType, ExecutionType> {
  using Motion = BodyMotion<TissueType, RegionType, ExecutionType>;

 public:
  using Tissue = TissueType;
  using Scalar = typename Tissue::Scalar;
  using Vector = Vector3<Scalar>;

  /// With pre-tension in the tissue the body is settled first: it starts in equilibrium.
  /// Without an integrator and a region: LeapfrogVerlet{}, of elastic solids BackwardEuler{}, and WholeBody{}.
  explicit SoftBody(Tissue matter, IntegratorType integrator = {}, RegionType region = {}, ExecutionType execution = {})
      : Motion(std::move(matter), std::move(region), std::move(execution)), integrator_(std::move(integrator)) {
    if constexpr (Validatable<IntegratorType>) integrator_.validate();
    this->any_step_is_stable_ = any_step_is_stable;
  }

  /// Forces of a step are those of the time force_time · h after its begin.
  static constexpr double force_time = [] {
    if constexpr (HasForceTime<IntegratorType>) return static_cast<double>(IntegratorType::force_time);
    return 0.0;
  }();

  static constexpr bool any_step_is_stable = StepsOfAnySize<IntegratorType>;

  /// The acceleration [m/s²] that springs, gravity and the forces applied so far will give a particle in the next step of h seconds,
  /// as the integrator will see it; zero for one that is nailed or held. What a contact has to work against.
  Vector predicted_acceleration(int i, Scalar h) const {
    this->check(i);
    if (!this->is_free(i)) return Vector::Zero();
    return this->acceleration_after(i, static_cast<Scalar>(force_time) * h);
  }

  /// What the next step of h seconds will do, and how the body gives way in it; nothing where nothing moves. Of a body whose integrator states its end_weight().
  /// In a zone of influence the particles move that moved in the step before; see MotionForecast::moves. Right after an edit nothing is foreseen there.
  auto forecast(Scalar h)
    requires StatesEndWeight<IntegratorType, Scalar>
  {
    using Forecast = MotionForecast<BodySystem<Tissue, ExecutionType>>;
    FlushDenormals const flush;
    return this->begin_forecast(h) ? std::optional(Forecast(this->system_, h, static_cast<Scalar>(integrator_.end_weight()))) : std::optional<Forecast>();
  }

  // --- how it moves -------------------------------------------------------------------------------------------------
  /// Advances by h seconds, 0 ≤ h. The step is taken as asked, also above stable_step(); the report tells. After an edit of the tissue the
  /// first step finds the stable step anew, unless the host has asked for it.
  StepReport<Scalar> step(Scalar h) {
    this->require_duration("a step", h);
    if (!knows_stable_step()) stable_step();
    StepReport<Scalar> const report = take_step(h);
    this->consume_forces();
    return report;
  }

  /// Advances by a duration [s] in the fewest equal steps not above stable_step(), which is found anew after an edit of the tissue.
  /// Forces applied before act through all of them. Where that would be more than `substeps.most` steps, those are taken, each a
  /// stable one: the body falls behind, as the report and time() tell, it does not diverge. Where no step is stable, the duration is
  /// split into `substeps.most` and the report says above_stable_step. What has to happen between the steps, like correct(), needs a loop
  /// of one's own: split_duration() says how many.
  StepReport<Scalar> advance(Scalar duration, Substeps const& substeps = {}) {
    this->require_duration("a duration", duration);
    if (substeps.most < 1) throw InvalidArgument(detail::message("at most ", substeps.most, " substeps; it must be at least 1"));
    if (!knows_stable_step()) stable_step();
    EqualSteps<Scalar> const steps = split_duration(duration, known_stable_step_, substeps.most);
    StepReport<Scalar> report;
    for (int k = 1; k <= steps.count && report; ++k) {
      StepReport<Scalar> const last = report;
      report = take_step(steps.each);
      report.steps = k;
      if (report && !ImplicitIntegrator<IntegratorType, Scalar> && last.element >= 0 && !(report.determinant <= last.determinant))
        report.element = last.element, report.determinant = last.determinant;
    }
    if (report && known_stable_step_ > 0) report.status = steps.capped ? StepStatus::behind : StepStatus::ok;
    this->consume_forces();
    return report;
  }

  /// Back to the state of then, to the byte, and what follows is the same to the byte.
  void restore(typename Motion::State const& saved) {
    Motion::restore(saved);
    if constexpr (!StepsOfAnySize<IntegratorType>)
      known_stable_step_ = this->knows_modes() ? palpate::stable_step(integrator_, this->known_modes()) : Scalar(0);
  }

  /// The largest step [s] that the integrator stands where the body is now, damping included; see ModalEstimate. 0: none.
  /// Sharp: power iteration finds the fastest mode and raises it by 5 %, so it is some 2.5 % below the limit.
  Scalar stable_step() {
    if constexpr (StepsOfAnySize<IntegratorType>) return known_stable_step_ = std::numeric_limits<Scalar>::infinity();
    return known_stable_step_ = palpate::stable_step(integrator_, this->find_modes());
  }
  /// A smaller one that is certain: from Gershgorin's row sums; see row_bounds for what it guarantees. One pass over the springs.
  Scalar guaranteed_stable_step() const {
    if constexpr (StepsOfAnySize<IntegratorType>) return std::numeric_limits<Scalar>::infinity();
    return palpate::stable_step(integrator_, this->guaranteed_modal_bounds());
  }

  /// How an implicit integrator's steps were solved, of all so far; of explicit ones nothing.
  SolveStatistics<Scalar> const& solve_statistics() const noexcept { return solved_; }

 private:
  /// One step; the forces applied stay.
  StepReport<Scalar> take_step(Scalar h) {
    FlushDenormals const flush;
    bool const moves = this->begin_step(h, FusedStep<IntegratorType>);
    StepReport<Scalar> report;
    report.moving = static_cast<int>(this->moving_count());
    report.stable_step = known_stable_step_;
    if (h > known_stable_step_) report.status = StepStatus::above_stable_step;
    if (moves) {
      auto& system = this->system_;
      try {
        integrator_.step(system, h);
      } catch (...) {   // one of the host's
        this->undo_step();
        throw;
      }
      if (auto const diverged = system.find_diverged(); diverged.particle >= 0) {
        this->undo_step();
        report.status = StepStatus::diverged;
        report.particle = diverged.particle;
        report.value = diverged.value;
        if constexpr (HasLowestDeterminant<Tissue>)
          note_inverted(report, this->tissue_.lowest_determinant(this->positions()), std::numeric_limits<Scalar>::infinity());
        report.stable_step = stable_step();
        return report;
      }
      this->commit_step(h);
      if constexpr (ImplicitIntegrator<IntegratorType, Scalar>) {
        solved_.add(report.solve = system.solve());
        if constexpr (HasLowestDeterminant<Tissue>) note_inverted(report, system.lowest_determinant(), Scalar(0));
      } else if constexpr (HasLowestDeterminant<Tissue>) {
        note_inverted(report, system.lowest_determinant(this->next_part(looks), looks), Scalar(0));
      }
    }
    this->end_step(h);
    return report;
  }

  static constexpr int looks = 32;   // explicit steps, in which each element is looked at once

  bool knows_stable_step() const noexcept { return StepsOfAnySize<IntegratorType> ? known_stable_step_ > 0 : this->knows_modes(); }
  static void note_inverted(StepReport<Scalar>& report, auto const& lowest, Scalar most) noexcept {
    if (!(lowest.value > most)) report.element = lowest.element, report.determinant = lowest.value;
  }

  IntegratorType integrator_;
  SolveStatistics<Scalar> solved_;
  Scalar known_stable_step_ = 0;   // s
};

/// Policies that make no soft body: what is wrong, in a sentence each, and nothing that could fail besides.
template <class TissueType, class IntegratorType, class RegionType, class ExecutionType>
  requires(!detail::MakeSoftBody<TissueType, IntegratorType, RegionType, ExecutionType>)
class SoftBody<TissueType, IntegratorType, RegionType, ExecutionType> : detail::SoftBodySentences<TissueType, IntegratorType, RegionType, ExecutionType> {
 public:
  using Refused = void;
  using Tissue = TissueType;
  using Scalar = double;

  explicit SoftBody(auto&&...) {}
};

template <class Tissue>
SoftBody(Tissue) -> SoftBody<Tissue, detail::DefaultIntegrator<Tissue>, WholeBody>;
template <class Tissue, class IntegratorType>
SoftBody(Tissue, IntegratorType) -> SoftBody<Tissue, IntegratorType, WholeBody>;
template <class Tissue, class IntegratorType, class RegionType>
SoftBody(Tissue, IntegratorType, RegionType) -> SoftBody<Tissue, IntegratorType, RegionType>;

}  // namespace palpate
