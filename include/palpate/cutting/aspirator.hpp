// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/body/shape_of.hpp>
#include <palpate/body/touch.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/phase.hpp>
#include <palpate/core/tool_pose.hpp>
#include <palpate/cutting/concept.hpp>
#include <palpate/cutting/detail/border_rule.hpp>
#include <palpate/cutting/detail/removal.hpp>
#include <palpate/mesh/tetrahedral_adjacency.hpp>
#include <palpate/tissue/concept.hpp>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

namespace palpate {

/// How an Aspirator takes tissue away.
template <RealScalar Scalar>
struct AspiratorOptions {
  Scalar tip_radius = Scalar(0.003);   ///< m, of the ball that the tip is
  Scalar reach = 0;                    ///< m, from the middle of the ball: so far it takes tetrahedra; 0: as far as the ball
  int max_tetrahedra = 10;            ///< that a tick takes away
  Scalar max_volume = std::numeric_limits<Scalar>::infinity();   ///< m³, undeformed: a tick ends once it has taken so much; a rate times a tick's length
  int debris = 0;                      ///< a piece that comes free, of fewer tetrahedra than that, goes too; 0: none does

  void validate() const {
    detail::require_positive("Aspirator: the tip radius", tip_radius, "m");
    if (!(reach == 0 || reach >= tip_radius) || !std::isfinite(reach))
      throw InvalidArgument(detail::message("Aspirator: the reach is ", reach, " m; it must be at least the tip radius of ", tip_radius, " m, or 0"));
    if (max_tetrahedra < 1) throw InvalidArgument(detail::message("Aspirator: max_tetrahedra is ", max_tetrahedra, "; it must be at least 1"));
    if (!(max_volume > 0)) throw InvalidArgument(detail::message("Aspirator: max_volume is ", max_volume, " m3; it must be positive"));
    if (debris < 0) throw InvalidArgument(detail::message("Aspirator: debris is ", debris, "; it must not be negative"));
  }
};

/// What has been taken away since the tool was made, or reset.
struct AspiratorReport : CutReport, RemovedTissue {
  int vertices_split = 0;   ///< where what is left hangs together at a vertex alone
  int refused = 0;          ///< in the last tick: tetrahedra in reach that have to stay, since the border would be no manifold
};

/// Takes the tetrahedra away that its tip reaches, from the border inwards: an aspirator, or cautery.
///
///   Aspirator<double> tool({.tip_radius = 0.004, .reach = 0.006, .debris = 10});
///   tool.advance(body, tip), body.step(0.01);   // once a tick
///
/// Where the ball touches the body it begins, and goes on until nothing goes any more: tetrahedra with a face on the border and their middle within reach,
/// nearest first.
/// Rule       the border stays a manifold, along edges and at vertices. A tetrahedron whose loss would break that goes together with those round the vertices
///            where it would, if all of them are in reach; else it stays. A vertex at which alone two parts hang together splits.
/// Mass       goes with the tetrahedra, each with its share of its corners' masses. Velocities of what stays are as they were, nothing is pushed.
///            A particle that no tetrahedron holds any more keeps its number: it weighs nothing, is nailed, and no triangle has it.
/// Numbers    of tetrahedra and triangles change, see BodyShape::remove_tetrahedron; body.changes() and body.solid_edits() tell how.
/// Cost       O(border triangles in reach), and the square of how many tetrahedra a tick takes away; and for the step after it
///            O(moving tetrahedra), whose assembly is made anew.
/// Errors     InvalidArgument for a tip that is not finite; the body stays as it was.
/// Limits     the last tetrahedron of a body stays. A VolumeCutter whose blade is in the body meanwhile forgets its stroke, and goes over its last edge again.
template <RealScalar Scalar>
class Aspirator {
  using Vector = Vector3<Scalar>;

 public:
  using Options = AspiratorOptions<Scalar>;
  using Report = AspiratorReport;

  Aspirator() : Aspirator(Options{}) {}
  explicit Aspirator(Options const& options) : options_(options), touch_((options.validate(), options.tip_radius)) {
    if (options_.reach == 0) options_.reach = options_.tip_radius;
  }

  template <class Body>
  void advance(Body& body, ToolPose<Scalar> const& tool) {
    if constexpr (detail::can_act_on<Body>()) {
      constexpr bool is_solid = RemovableSolid<typename detail::TissueOf<Body>::type>, is_of_scalar = std::same_as<Scalar, typename Body::Scalar>;
      static_assert(is_solid, "Aspirator: this tissue is no solid from which tetrahedra can be taken; FiniteElements is.");
      static_assert(is_of_scalar, "Aspirator: the cutter computes in another scalar than the body; advance(body, tool) takes a body of its own.");
      if constexpr (is_solid && is_of_scalar) {
        detail::require_finite("Aspirator: the tip", tool.position, "m");
        use(detail::shape_of(body), tool.position);
      }
    }
  }
  /// The same for the tip [m] alone.
  template <class Body>
  void advance(Body& body, detail::TipPosition<Scalar> const& tip) {
    advance(body, tip.pose());
  }

  /// Forgets the contact, so that the tip has to come from outside again, and begins to count anew.
  template <class Body>
  void reset(Body&) noexcept {
    touch_.reset();
    report_ = {};
    goes_on_ = false;
    state_ = CuttingPhase::no_contact;
  }

  SurfaceContact<Scalar> const& contact() const noexcept { return touch_.contact(); }
  /// moving: it touches, and has taken tissue away in this tick.
  CuttingPhase state() const noexcept { return state_; }
  Report const& report() const noexcept { return report_; }
  Scalar tip_radius() const noexcept { return touch_.tip_radius(); }
  Options const& options() const noexcept { return options_; }

 private:
  struct Reached {
    Scalar distance;
    int tetrahedron;
    bool operator<(Reached const& other) const noexcept { return std::pair(distance, tetrahedron) < std::pair(other.distance, other.tetrahedron); }
  };

  template <class Body>
  void use(Body& body, Vector const& tip) {
    bool const went_on = goes_on_ && !touch_.was_restored(body);
    goes_on_ = touch_.update(body, tip).touching || went_on;
    report_.refused = 0;
    if (goes_on_) choose(body, tip);
    goes_on_ = goes_on_ && taken_.size() > 0;
    state_ = !contact().touching ? CuttingPhase::no_contact : goes_on_ ? CuttingPhase::moving : CuttingPhase::indenting;
    if (!goes_on_) return;
    int const triangles = body.tissue().surface().triangle_count();
    split(body, taken_.take(body, report_));
    body.finish_edits();
    report_.triangles_added += body.tissue().surface().triangle_count() - triangles;
    touch_.update(body, tip);   // what it touched may be gone: where it touches now
  }

  // --- what goes --------------------------------------------------------------------------------------------------------
  template <class Body>
  static Scalar distance(Body const& body, int t, Vector const& tip) {
    Vector sum = Vector::Zero();
    for (int const v : body.tissue().topology().corners(t)) sum += body.positions().col(v);
    return (sum / 4 - tip).norm();
  }
  /// From the border inwards: what lies behind a tetrahedron that goes is at the border then.
  template <class Body>
  void choose(Body& body, Vector const& tip) {
    auto const& solid = body.tissue().topology();
    taken_.clear(), waiting_.clear();
    auto const offer = [&](int t) {
      Scalar const far = distance(body, t, tip);
      if (far <= options_.reach && !taken_.has(t) && std::none_of(waiting_.begin(), waiting_.end(), [&](Reached const& one) { return one.tetrahedron == t; }))
        waiting_.push_back({far, t});
    };
    Vector const around = Vector::Constant(options_.reach + body.mean_edge());
    body.visit_triangles_in_box(tip - around, tip + around, [&](int triangle) { offer(solid.border_face(triangle).tetrahedron); });
    double sum = 0;
    auto const most = static_cast<std::size_t>(std::min(options_.max_tetrahedra, solid.tetrahedron_count() - 1));
    for (bool goes_on = true; goes_on && taken_.size() < most && sum < static_cast<double>(options_.max_volume);) {
      goes_on = false;
      std::sort(waiting_.begin(), waiting_.end());
      for (Reached const& next : waiting_) {
        if (taken_.has(next.tetrahedron) || !find_set(body, tip, next.tetrahedron, most - taken_.size())) continue;
        for (int const t : set_) {
          taken_.add(t), sum += detail::Removal::volume(body, t);
          for (int k = 0; k < 4; ++k)
            if (int const beyond = solid.neighbour(t, k); beyond >= 0) behind_.push_back(beyond);
        }
        goes_on = true;
        break;
      }
      std::erase_if(waiting_, [&](Reached const& one) { return taken_.has(one.tetrahedron); });
      for (int const t : std::exchange(behind_, {})) offer(t);
    }
    if (taken_.size() < most && sum < static_cast<double>(options_.max_volume)) report_.refused = static_cast<int>(waiting_.size());
  }
  /// What has to go with a tetrahedron so that the border stays a manifold; false where that is out of reach, or too much for the tick.
  template <class Body>
  bool find_set(Body const& body, Vector const& tip, int first, std::size_t most) {
    auto const& solid = body.tissue().topology();
    auto const goes = [&](int t) { return std::find(set_.begin(), set_.end(), t) != set_.end() || taken_.has(t); };
    set_.assign(1, first);
    for (std::size_t before = 0; set_.size() <= most && before < set_.size();) {
      before = set_.size();
      bool is_sound = true;
      for (std::size_t n = 0; n < before; ++n)
        for (int const v : solid.corners(set_[n])) {
          if (rule_.copies(solid, v, goes) >= 0) continue;
          is_sound = false;
          for (int const t : solid.tetrahedra_at(v))
            if (!goes(t)) {
              if (!(distance(body, t, tip) <= options_.reach)) return false;
              set_.push_back(t);
            }
        }
      if (is_sound) return true;
    }
    return false;
  }

  // --- how --------------------------------------------------------------------------------------------------------------
  /// Splits vertices at which alone parts hang together, and takes what came free.
  template <class Body>
  void split(Body& body, std::vector<int>& corners) {
    auto const& solid = body.tissue().topology();
    for (std::size_t n = 0, count = corners.size(); n < count; ++n) {
      solid.fans_at(corners[n], fans_);
      for (int k = 1; k < fans_.size(); ++k) {
        corners.push_back(body.split_vertex(corners[n], fans_[k]));
        ++report_.vertices_split, ++report_.particles_added;
      }
    }
    if (options_.debris < 2) return;
    taken_.clear();
    for (int const v : corners)
      for (int const t : solid.tetrahedra_at(v)) taken_.add_debris(body, t, options_.debris, report_);
    taken_.take(body, report_);
  }

  Options options_;
  Touch<Scalar> touch_;
  CuttingPhase state_ = CuttingPhase::no_contact;
  bool goes_on_ = false;
  Report report_;
  detail::BorderRule rule_;
  TetrahedronFans fans_;
  std::vector<Reached> waiting_;   // at the border and in reach
  detail::Removal taken_;
  std::vector<int> set_, behind_;
};

}  // namespace palpate
