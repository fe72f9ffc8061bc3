// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/body/touch.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/phase.hpp>
#include <palpate/core/tool_pose.hpp>
#include <palpate/core/units.hpp>
#include <palpate/cutting/concept.hpp>
#include <palpate/cutting/detail/skin_of.hpp>

#include <cmath>
#include <concepts>
#include <cstddef>
#include <vector>

namespace palpate {

/// How a CubeCutter cuts.
template <RealScalar Scalar>
struct CubeCutOptions {
  /// m, the cutting edge in the tool's frame, from point to point; the tool's tip is the origin.
  std::vector<Vector3<Scalar>> edge = {Vector3<Scalar>::Zero(), Vector3<Scalar>(0, 0, Scalar(0.03))};
  Scalar puncture_depth = 0;   ///< m: how deep below the skin the tip has to be before it cuts
  Scalar tip_radius = 0;       ///< m, of the ball that the tip is while it presses

  void validate() const {
    if (edge.size() < 2) throw InvalidArgument(detail::message("CubeCutter: an edge of ", edge.size(), " points; it takes at least two"));
    Scalar length = 0;
    for (std::size_t k = 0; k < edge.size(); ++k) length += (edge[k] - edge[k > 0 ? k - 1 : 0]).norm();
    detail::require_positive("CubeCutter: the length of the edge", length, "m");
    detail::require_non_negative("CubeCutter: the puncture depth", puncture_depth, "m");
    require_length("CubeCutter: the puncture depth", static_cast<double>(puncture_depth), puncture_depth_range);
  }
};

struct CubeCutReport : CutReport {
  int faces_opened = 0;   ///< between two cubes
};

/// Cuts a body of cubes with the edge of a blade: it opens the faces between cubes whose middles the blade comes between. See Cubes.
///
///   CubeCutter<double> knife({.edge = {{0, 0, 0}, {0, 0, 0.03}}});
///   knife.advance(body, tip), body.step(1e-3);   // once a tick
///
/// The tip presses until it is `puncture_depth` below the skin. Then the blade cuts, also where it rests and tissue moves over it, until the tip has left.
/// Blade      moves straight between two ticks, and so does each cube.
/// Errors     InvalidArgument for options, and for a pose that is not finite; then nothing has changed.
/// Cost       in contact O(cubes); a tick that opens faces as Cubes::cut().
/// Limits     a cut is where faces of cubes are: within half a cube of the blade. After a restore the tip has to come from outside again; report() and area() go on
///            counting. A blade that cuts is not resisted.
/// Source     \cite haaland.
template <RealScalar Scalar>
class CubeCutter {
  using Vector = Vector3<Scalar>;

 public:
  using Options = CubeCutOptions<Scalar>;

  CubeCutter() : CubeCutter(Options{}) {}
  explicit CubeCutter(Options const& options) : options_((options.validate(), options)), touch_(options.tip_radius) {}

  template <class Body>
  void advance(Body& body, ToolPose<Scalar> const& tool) {
    constexpr bool is_of_scalar = std::same_as<Scalar, typename Body::Scalar>, is_of_cubes = CuttableCubes<Body>;
    static_assert(is_of_scalar, "CubeCutter: the cutter computes in another scalar than the body; advance(body, tool) takes a body of its own.");
    static_assert(is_of_cubes, "CubeCutter: this body is not made of cubes; Cubes is. VolumeCutter cuts tetrahedra, ProgressiveCutter surfaces.");
    if constexpr (is_of_scalar && is_of_cubes) use(body, tool);
  }
  /// The same for the tip [m] of a tool that is not turned.
  template <class Body>
  void advance(Body& body, detail::TipPosition<Scalar> const& tip) {
    advance(body, tip.pose());
  }

  /// The blade is taken away: the tip has to come from outside again.
  template <class Body>
  void reset(Body&) noexcept {
    touch_.reset();
    last_blade_.clear(), middles_.clear();
    state_ = CuttingPhase::no_contact;
  }

  SurfaceContact<Scalar> const& contact() const noexcept { return touch_.contact(); }
  CuttingPhase state() const noexcept { return state_; }
  CubeCutReport const& report() const noexcept { return report_; }
  Scalar tip_radius() const noexcept { return touch_.tip_radius(); }
  Options const& options() const noexcept { return options_; }
  /// m², cut since it was made: of the faces opened, undeformed.
  double area() const noexcept { return area_; }

 private:
  template <class Body>
  void use(Body& body, ToolPose<Scalar> const& tool) {
    detail::require_pose("CubeCutter", tool);
    if (touch_.was_restored(body)) reset(body);
    blade_.clear();
    for (Vector const& point : options_.edge) blade_.push_back(tool.position + tool.orientation * point);
    detail::SkinOf<Body> skin(body, state_ == CuttingPhase::moving);
    bool const was_cutting = state_ == CuttingPhase::moving, is_touching = touch_.update(skin, tool.position, was_cutting).touching;
    bool const cuts = is_touching && (was_cutting || !(contact().depth < options_.puncture_depth));
    if (cuts && !was_cutting) report_ = {};
    state_ = cuts ? CuttingPhase::moving : is_touching ? CuttingPhase::indenting : CuttingPhase::no_contact;
    if ((cuts || was_cutting) && !last_blade_.empty() && sweep(body) && cuts) touch_.update(skin, tool.position, true);   // triangles have other numbers
    last_blade_.assign(blade_.begin(), blade_.end());
    middles_.clear(), middles_.reserve(static_cast<std::size_t>(body.cubes()));
    for (int c = 0; is_touching && c < body.cubes(); ++c) middles_.push_back(body.middle(c));
  }
  /// From where the blade was to where it is. Whether it opened anything.
  template <class Body>
  bool sweep(Body& body) {
    auto const moved = [&](int cube) {
      return middles_.empty() ? Vector(Vector::Zero()) : Vector(body.middle(cube) - middles_[static_cast<std::size_t>(cube)]);
    };
    int const particles = body.size(), triangles = body.tissue().surface().triangle_count();
    int opened = 0;
    for (std::size_t k = 1; k < blade_.size(); ++k) opened += body.cut(last_blade_[k - 1], last_blade_[k], blade_[k - 1], blade_[k], moved);
    report_.faces_opened += opened;
    report_.particles_added += body.size() - particles, report_.triangles_added += body.tissue().surface().triangle_count() - triangles;
    area_ += opened * static_cast<double>(body.mean_edge()) * static_cast<double>(body.mean_edge());
    return opened > 0;
  }

  Options options_;
  Touch<Scalar> touch_;
  CuttingPhase state_ = CuttingPhase::no_contact;
  CubeCutReport report_;
  double area_ = 0;                             // m²
  std::vector<Vector> blade_, last_blade_;      // m, world, now and in the last tick
  std::vector<Vector> middles_;                 // m, of cubes in the last tick, while it touches
};

}  // namespace palpate
