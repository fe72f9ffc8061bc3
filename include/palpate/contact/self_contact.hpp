// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/collision/near_triangles.hpp>
#include <palpate/contact/contact_options.hpp>
#include <palpate/contact/contact_regions.hpp>
#include <palpate/contact/cut_lips.hpp>
#include <palpate/contact/free_motion.hpp>
#include <palpate/core/error.hpp>
#include <palpate/tissue/concept.hpp>

#include <cstddef>
#include <span>
#include <type_traits>
#include <utility>

namespace palpate {

/// The contact of a body with itself, where it is folded: it presses and rubs as BodyContact has it.
///
///   SelfContact contact(gut, {.friction = 0.1});
///   contact.apply(gut, 1e-3), gut.step(1e-3);   // each tick
///
/// Regions    of the volume in which the surface is in itself. Each has two sheets, told apart by the contour between them: what of the surface is inside is on one
///            side of it or the other.
/// Rest shape a region presses where triangles cross whose corners are at least `apart` from each other there. So what lies on itself in the rest shape does not, unless
///            it was shifted along itself by more than a triangle; what it has in common then does not throw it apart, what is added to it presses.
/// Cuts       the lips of a fresh cut lie on each other and do not press. Where they have been parted by `parted` mean edges for `parted_for` seconds they do when they
///            come together again: by the volume between a face and its twin, up to the front of the cut. See CutLips.
/// Units      m, N, Pa, s; world frame.
/// Errors     InvalidArgument for options, and for a step that is not positive; InvalidMesh for a body whose surface is open as the contact is made.
/// Cost       O(triangles) while nothing meets, and a search now and then, see NearTriangles; then that of BodyContact. Allocates until its memory has the size that is
///            needed, and after edits.
/// Limits     a fold that is pinched, so that its two sheets hang together inside or the contour between them ends at a vertex, does not press: intersection().folds()
///            counts these. A fold that is pressed until it is pinched lets go. Triangles with a vertex in common do not meet. Parts that went through each other
///            wholly, without crossing now, are not seen.
/// Source     \cite deformable_survey, from the contour inwards; the rest distance is the usual criterion for what may touch.
template <SimulatedBody Body>
class SelfContact {
  static_assert(SearchableBody<Body>, "SelfContact: the body needs visit_triangles_in_box; see SearchableBody.");
  static_assert(detail::HasRestPosition<std::remove_cvref_t<decltype(std::declval<Body const&>().tissue())>>, "SelfContact: the body's tissue has no rest_position(i).");

 public:
  using Scalar = typename Body::Scalar;
  using Vector = Vector3<Scalar>;
  using Options = SelfContactOptions<Scalar>;
  using Region = ContactRegion<Scalar>;
  using State = ContactState<Scalar>;

  explicit SelfContact(Body const& body, Options const& options = {}) : options_((options.validate(), options)), regions_(options.of_bodies(), true) {
    detail::require_closed("SelfContact", "the body", body);
    if (!(options_.apart > 0)) options_.apart = body.mean_edge() / 1000;
    reset(body);
  }

  Options const& options() const noexcept { return options_; }
  std::span<Region const> regions() const noexcept { return regions_.regions(); }
  SurfaceIntersection<Scalar> const& intersection() const noexcept { return regions_.intersection(); }

  /// Adds the forces of the last step, for other contacts to count with; apply() takes them back. See BodyContact.
  void expect(Body& body) {
    if (is_expected_ || restorations_ != body.restorations()) return;
    regions_.push_last(0, body, Scalar(1));
    is_expected_ = true;
  }
  /// Adds the contact's forces to the body for its next step of h seconds.
  void apply(Body& body, Scalar h) {
    detail::require_positive("SelfContact: a step", h, "s");
    if (restorations_ != body.restorations()) reset(body);
    if (std::exchange(is_expected_, false)) regions_.push_last(0, body, Scalar(-1));
    detail::BodySkin skin(body);
    if (edits_ != body.topology_revision()) near_.forget(), lips_.read(body), edits_ = body.topology_revision();
    lips_.part(body, options_.parted, options_.parted_for, h);
    near_.follow(skin, body.mean_edge() / 2);
    regions_.begin();
    regions_.intersection().find_own(skin, near_, [&](int a, int b) { return are_apart(body, a, b); });
    regions_.take_intersection();
    lips_.press(body, regions_.shapes());
    regions_.gather(0, body, motion_, h);
    regions_.prepare();
    regions_.respond(0, motion_);
    regions_.solve(h);
    regions_.push(0, body);
  }

  /// Where friction sticks, and which lips were parted; to be restored after the body was.
  State save() const {
    State state = regions_.save();
    state.parted.assign(lips_.parted().begin(), lips_.parted().end());
    return state;
  }
  void restore(State const& state, Body const& body) { begin(body, state.parted), regions_.restore(state); }
  /// Forgets where it sticks, and which lips were parted.
  void reset(Body const& body) { begin(body, {}); }
  /// Forgets where it sticks alone; of a body that was restored, all.
  void part(Body const& body) {
    if (restorations_ != body.restorations()) return reset(body);
    regions_.forget(), is_expected_ = false;
  }

 private:
  void begin(Body const& body, std::span<PartedVertex<Scalar> const> parted) {
    restorations_ = body.restorations(), edits_ = body.topology_revision();
    regions_.forget(), is_expected_ = false, near_.forget(), lips_.know(parted), lips_.read(body);
  }
  bool are_apart(Body const& body, int a, int b) const {
    for (int const i : body.tissue().surface().corners(a))
      for (int const j : body.tissue().surface().corners(b))
        if ((Vector(body.tissue().rest_position(i)) - Vector(body.tissue().rest_position(j))).squaredNorm() < options_.apart * options_.apart) return false;
    return true;
  }

  Options options_;
  detail::ContactRegions<Scalar> regions_;
  NearTriangles<Scalar> near_;
  detail::CutLips<Scalar> lips_;
  detail::FreeMotion<Body> motion_;
  std::size_t restorations_ = 0, edits_ = 0;
  bool is_expected_ = false;
};

}  // namespace palpate
