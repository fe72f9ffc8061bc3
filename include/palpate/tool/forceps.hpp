// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/tool/blunt_tool.hpp>
#include <palpate/tool/grasp.hpp>

#include <array>
#include <cstddef>
#include <utility>

namespace palpate {

template <RealScalar Scalar>
struct ForcepsOptions {
  ForcepsShape shape = {};
  Scalar friction = Scalar(0.3);       ///< Coulomb, of jaws and shaft outside the grip
  GraspOptions<Scalar> grasp = {};
  Scalar grasp_below = Scalar(0.6);    ///< of the opening: jaws that close to less take hold
  Scalar release_above = Scalar(0.7);  ///< of the opening: jaws that open to more let go
};

/// Surgical forceps: jaws that close on tissue hold it, to be lifted, drawn and turned.
///   Forceps<double> forceps({.grasp = {.clamp_force = 2}});
///   Simulator simulator(device, std::move(body), forceps, TissueReaction{});
/// Jaws and shaft push like a blunt tool's; the jaws close and open with the pose's `opening`: a device's gripper, or a button, see ServoOptions::grip.
/// What lies between them when they close is held; see Grasp for the law, and for when it slips. Jaws that have closed on nothing, or lost what they held,
/// take hold again once they have been opened.
/// Units      m, N; world frame. The jaws close along the tool's x axis; see ForcepsShape.
/// Source     \cite bielser2002
/// Limits     A device's gripper gets no force of its own. Only particles of the surface are held.
template <RealScalar Scalar>
class Forceps {
 public:
  using Vector = Vector3<Scalar>;

  explicit Forceps(ForcepsOptions<Scalar> const& options = {})
      : options_(checked(options)), tool_(make_forceps_shape<Scalar>(options.shape), {.friction = options.friction}), grasp_(options.grasp) {}

  template <class Body>
  void advance(Body& body, ToolPose<Scalar> const& tool) {
    tool_.advance(body, tool);
    grasp_.advance(body, rods().pose());
    Scalar const opening = rods().pose().opening;
    if (opening > options_.release_above) grasp_.release(), was_open_ = true;
    if (was_open_ && opening < options_.grasp_below) {
      was_open_ = false;
      grasp_.take(body, rods().pose(), {rods().shape().rods[0].at(opening), rods().shape().rods[1].at(opening)});
    }
    show(body);
  }
  template <class Body>
  Vector press(Body& body, Scalar share, Scalar h) {
    force_.setZero(), moment_.setZero();
    if (!rods().is_placed()) return force_;
    auto const poses = rods().template step_poses<Body>(share);
    auto const& surface = body.tissue().surface();
    tool_.press(body, share, h, nullptr, [&](int rod, int triangle) {
      if (rod > 1 || !grasp_.holds_any()) return false;
      auto const corners = surface.corners(triangle);
      return grasp_.holds(corners[0]) || grasp_.holds(corners[1]) || grasp_.holds(corners[2]);
    });
    force_ = tool_.force(), moment_ = tool_.moment();
    grasp_.press(body, poses, h, force_, moment_);
    return force_;
  }
  template <class Body>
  void reset(Body& body) noexcept {
    grasp_.release();
    was_open_ = false;
    force_.setZero(), moment_.setZero();
    tool_.reset(body);
  }

  /// What it holds.
  Grasp<Scalar> const& grasp() const noexcept { return grasp_; }

  SurfaceContact<Scalar> const& contact() const noexcept { return tool_.contact(); }
  CuttingPhase state() const noexcept { return grasp_.holds_any() ? CuttingPhase::indenting : tool_.state(); }
  CutReport const& report() const noexcept { return tool_.report(); }
  Scalar tip_radius() const noexcept { return tool_.tip_radius(); }
  Vector const& haptic_point() const noexcept { return tool_.haptic_point(); }
  /// Of the last step: the tissue's force on the tool [N], and its moment about the tool's origin [N m].
  Vector const& force() const noexcept { return force_; }
  Vector const& moment() const noexcept { return moment_; }
  RodContact<Scalar> const& rods() const noexcept { return tool_.rods(); }
  ForcepsOptions<Scalar> const& options() const noexcept { return options_; }

 private:
  static ForcepsOptions<Scalar> const& checked(ForcepsOptions<Scalar> const& options) {
    detail::OptionCheck const check{"ForcepsOptions"};
    check.not_negative(".friction", static_cast<double>(options.friction));
    check(options.grasp_below > 0 && options.grasp_below < 1, ".grasp_below", static_cast<double>(options.grasp_below), "give a share of the opening, above 0 and below 1");
    check(options.release_above > options.grasp_below && options.release_above < 1, ".release_above", static_cast<double>(options.release_above),
          "give a share of the opening, above .grasp_below and below 1");
    check(options.shape.opening > 2 * options.shape.radius, ".shape.opening", options.shape.opening, " m", "give more than twice .shape.radius, where closed jaws touch");
    return options;
  }

  /// What is held, and nearest to the tip, is what stands for all.
  template <class Body>
  void show(Body const& body) {
    if (!grasp_.holds_any()) return;
    auto const held = grasp_.particles();
    auto const nearest = std::min_element(held.begin(), held.end(), [](auto const& a, auto const& b) { return a.place.squaredNorm() < b.place.squaredNorm(); });
    auto const& surface = body.tissue().surface();
    int const triangle = surface.triangles_at(nearest->particle).front();
    Vector weights = Vector::Zero();
    weights[surface.corner_of(triangle, nearest->particle)] = 1;
    tool_.show(body, 0, triangle, weights, RodContact<Scalar>::placed(rods().pose(), grasp_.place(static_cast<std::size_t>(nearest - held.begin()))));
  }

  ForcepsOptions<Scalar> options_;
  BluntTool<Scalar> tool_;
  Grasp<Scalar> grasp_;
  Vector force_ = Vector::Zero(), moment_ = Vector::Zero();
  bool was_open_ = true;   // since it last took hold
};

}  // namespace palpate
