// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/contact/contact_options.hpp>
#include <palpate/contact/contact_regions.hpp>
#include <palpate/contact/free_motion.hpp>
#include <palpate/core/error.hpp>

#include <array>
#include <concepts>
#include <cstddef>
#include <span>
#include <utility>

namespace palpate {

/// The contact of two bodies, of any tissue: where they are in one another they press, and rub.
///
///   BodyContact contact(liver, kidney, {.friction = 0.4});
///   contact.apply(liver, kidney, 1e-3), liver.step(1e-3), kidney.step(1e-3);   // each tick
///
/// Pressure   of a region, a volume V that the bodies have in common, at the end of the step,
///              p = k min(1, (d + (h + τ) ḋ)/δ),   0 ≤ p,   d = V/A,   A = |Σ ∂V/∂x_i| over one side,   f_i = −p ∂V/∂x_i.
///            k is `pressure`, δ `depth`, τ `settling`. Deep in one another the force is −k ∂V/∂x; a body that rests is in by δ times the share of k that
///            bears it. V and its gradient are exact, see SurfaceIntersection: the forces on both sides balance, and so do their moments.
/// Moment     where a region is deeper at one side, its pressure is p + (k/δ) s·(x − c), as far as p < k: of that only the moment about c acts, (k/δ)(1 − d/δ) M × n with
///            M = ∫ (x − c) dV, on both sides as rigid motions take it, at the end of the step too. So a face that lies flat on another does not lean until it is out.
/// Friction   a spring along the surface, and one against spinning, as stiff as the region is across: k A/δ. It sticks up to friction · p A, and
///            2/3 of that times the region's radius; then its anchor is dragged along. So nothing creeps. Each side moves as the rigid motion that fits its vertices best, by area, says,
///            and takes force and moment about one point: these balance too.
/// Stability  pressures and frictions of all regions are found together, each with what the bodies give way to it, as at the end of the step: any k is stable. Explicit
///            bodies give way as 1/m says, implicit ones as their whole stiffness does.
/// Several    contacts at one body: before the first apply() of a step tell all others to expect() what they did in the last one. Each then counts with all of
///            them, whatever their order. A Scene does that. Without it stacks of implicit bodies slide, or fall through, at steps of 5 to 10 ms; with it stiff
///            ones, of three bodies of 100 kPa, still do, and want 2 ms.
/// Units      m, N, Pa, s; world frame.
/// Errors     InvalidArgument for options, for a step that is not positive, and for one body twice; InvalidMesh for a body whose surface is open as the contact is made.
/// Cost       that of SurfaceIntersection, and O(vertices that it moves) a sweep, at most 30; of an implicit body, while it is touched, a solution as a step takes, and
///            six more for each region. Allocates until its memory has the size that is needed, and after edits.
/// Limits     both surfaces are closed, and do not cross themselves. A body that is in the other without crossing its skin is not seen. The pressure's energy is exact
///            while A stays: where a region grows as it is pressed and shrinks as it is let go, on other ways, that is what is not; the damping is to be more than
///            that. Bodies come to rest where k/δ is at most some 2 E/l, E the softer one's modulus and l its edge; stiffer contacts tremble.
/// Source     \cite deformable_survey, tissue–tissue collision: from the contour inwards, non-linear penalty, friction. Ours: the exact volume and its gradient, the end
///            of the step, stick springs.
template <SimulatedBody First, SimulatedBody Second>
class BodyContact {
  static_assert(SearchableBody<First> && SearchableBody<Second>, "BodyContact: a body needs visit_triangles_in_box; see SearchableBody.");
  static_assert(std::same_as<typename First::Scalar, typename Second::Scalar>, "BodyContact: both bodies compute in one scalar.");

 public:
  using Scalar = typename First::Scalar;
  using Vector = Vector3<Scalar>;
  using Options = BodyContactOptions<Scalar>;
  using Region = ContactRegion<Scalar>;
  using State = ContactState<Scalar>;

  BodyContact(First const& first, Second const& second, Options const& options = {}) : regions_((options.validate(), options), false) {
    detail::require_closed("BodyContact", "the first body", first), detail::require_closed("BodyContact", "the second body", second);
    reset(first, second);
  }

  Options const& options() const noexcept { return regions_.options(); }
  std::span<Region const> regions() const noexcept { return regions_.regions(); }
  /// Of the last apply(), on the first body [N]; on the second one the opposite acts.
  Vector force() const noexcept {
    Vector sum = Vector::Zero();
    for (Region const& one : regions()) sum += one.force();
    return sum;
  }
  SurfaceIntersection<Scalar> const& intersection() const noexcept { return regions_.intersection(); }

  /// Adds the forces of the last step to both bodies, for other contacts to count with; apply() takes them back.
  void expect(First& first, Second& second) {
    if (is_expected_ || restorations_ != std::array{first.restorations(), second.restorations()}) return;
    regions_.push_last(0, first, Scalar(1)), regions_.push_last(1, second, Scalar(1));
    is_expected_ = true;
  }
  /// Adds the contact's forces to both bodies for their next step of h seconds.
  void apply(First& first, Second& second, Scalar h) {
    detail::require_positive("BodyContact: a step", h, "s");
    if (static_cast<void const*>(&first) == static_cast<void const*>(&second)) throw InvalidArgument("BodyContact: both are one body; SelfContact is for that");
    if (restorations_ != std::array{first.restorations(), second.restorations()}) reset(first, second);
    if (std::exchange(is_expected_, false)) regions_.push_last(0, first, Scalar(-1)), regions_.push_last(1, second, Scalar(-1));
    regions_.begin();
    regions_.intersection().find(detail::BodySkin(first), detail::BodySkin(second));
    regions_.take_intersection();
    regions_.gather(0, first, first_motion_, h), regions_.gather(1, second, second_motion_, h);
    regions_.prepare();
    regions_.respond(0, first_motion_), regions_.respond(1, second_motion_);
    regions_.solve(h);
    regions_.push(0, first), regions_.push(1, second);
  }

  /// Where friction sticks; to be restored after both bodies were.
  State save() const { return regions_.save(); }
  void restore(State const& state, First const& first, Second const& second) { reset(first, second), regions_.restore(state); }
  /// Forgets where it sticks.
  void reset(First const& first, Second const& second) {
    restorations_ = {first.restorations(), second.restorations()};
    regions_.forget(), is_expected_ = false;
  }

 private:
  detail::ContactRegions<Scalar> regions_;
  detail::FreeMotion<First> first_motion_;
  detail::FreeMotion<Second> second_motion_;
  std::array<std::size_t, 2> restorations_{};
  bool is_expected_ = false;
};

template <SimulatedBody First, SimulatedBody Second>
BodyContact(First const&, Second const&, BodyContactOptions<typename First::Scalar> const&) -> BodyContact<First, Second>;

}  // namespace palpate
