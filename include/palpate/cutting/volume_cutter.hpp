// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/pseudo_normal.hpp>
#include <palpate/body/concept.hpp>
#include <palpate/body/shape_of.hpp>
#include <palpate/body/touch.hpp>
#include <palpate/collision/detail/box.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/phase.hpp>
#include <palpate/core/tool_pose.hpp>
#include <palpate/cutting/blade_grip.hpp>
#include <palpate/cutting/concept.hpp>
#include <palpate/cutting/detail/blade_resistance.hpp>
#include <palpate/cutting/detail/blade_sweep.hpp>
#include <palpate/cutting/detail/blade_trail.hpp>
#include <palpate/cutting/detail/removal.hpp>
#include <palpate/cutting/detail/skin_of.hpp>
#include <palpate/cutting/detail/solid_cut.hpp>
#include <palpate/cutting/detail/traced_blade.hpp>
#include <palpate/cutting/volume_cut_options.hpp>
#include <palpate/tissue/concept.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace palpate {

/// Cuts a solid with the edge of a blade, as far as the blade has come.
///
///   VolumeCutter<double> knife;
///   knife.advance(body, {{x, y, -0.01}, {x, y, 0.05}});   // once a tick, then step
///
/// The blade is followed in the undeformed solid: what it sweeps there is the cut, so that the same tetrahedra are cut however the tissue moves. Each edge that it
/// goes through gets a vertex there, and the tetrahedra round the edge are divided in two; all are whole tetrahedra with common faces at any time. Where all
/// corners of a face are on the cut, and it lies between its two sides, it is cut; a vertex splits where the faces cut round it part its tetrahedra. The cut
/// ends, meanwhile, at the last edges that the blade has crossed: beyond them nothing is open. Where parts would only touch along an edge, or in a vertex, the vertex
/// that came to the cut last waits until the blade has gone on; so an edge of the border has two triangles. Where the stroke ends such an edge is divided, and parts.
/// Where that would make a tetrahedron lower than min_height, and where parts would touch in a vertex, the faces stay closed, and are counted as such.
///   case                         tetrahedra after
///   three edges at a corner      4
///   four edges                   6
///   a vertex and two edges       3
///   two vertices and an edge     2
///   three vertices               1, a face opens
///   one edge, so far             2
/// Snapping   a crossing near an end of its edge goes to that end, which stays where it is; nothing else does.
/// Diagonals  edges are divided in the order that the blade comes to them, so it does not matter how finely a way is divided into ticks; at one time, those of
///            larger vertex numbers first, so that a face's diagonal goes to the smaller of the old vertices.
/// Blade      moves straight between two ticks; in a deformed solid it is followed at points half a mean edge apart.
/// Force      with a toughness Gc or a friction φ of the lips the tissue resists the blade: it stays where it is until the tool pulls it with Gc L⊥ + φ L, L the
///            blade's length in tissue and L⊥ its part across the way. So the hand's work is Gc times the area cut or more, but for what is still owed
///            where the blade leaves, and what it cuts by turning; see grip().
/// Debris     where a stroke that has cut ends, pieces with a wound and fewer tetrahedra than `debris`, none of them nailed or held, go as under an Aspirator.
/// Cost       O(tetrahedra near the way of the blade). Memory grows as the body does. With debris, at a stroke's end, O(triangles of wounds · debris²).
/// Errors     InvalidArgument where the blade or what it is pressed with is not finite, where a piece of it has no length or all of it is longer than 4,000 mean
///            edges, and for debris of tissue from which no tetrahedra can be taken; the body stays as it was.
/// Limits     where a blade bends by more than 60 degrees, or its way by more than 120, now and then a tetrahedron at the bend still joins both sides; so it is where
///            two blades pass one place within an edge of each other. A blade that comes back on its way cuts nothing new. Two edges with a gap between them are one
///            blade of three pieces. A blade that begins where another one ended has to come from an edge back, or up to that stays uncut; one that is itself
///            forgotten and comes back there goes over that edge again: after lift(), after a restore without resume(), and where tissue was taken away meanwhile.
/// Source     the sweep in material coordinates is that of \cite zheng2006 for surfaces.
template <RealScalar Scalar>
class VolumeCutter {
  using Vector = Vector3<Scalar>;

 public:
  using Options = VolumeCutOptions<Scalar>;
  using Segment = BladeSegment<Scalar>;
  using Report = VolumeCutReport;

  VolumeCutter() : VolumeCutter(Options{}) {}
  explicit VolumeCutter(Options const& options) : options_(options), touch_(options.tip_radius), resistance_(of_resistance(options)) { options_.validate(); }

  /// One tick of a tool that presses, punctures and cuts; `force` is what it presses the tissue with [N], for puncture_force. The edge turns with the tool. It
  /// punctures with its tip, or comes in between the lips of an open wound; then it cuts until its tip is out, and no part of the edge in the tissue or between lips.
  /// An edge that reaches on beyond the tip comes out with it.
  /// Throws InvalidArgument for a pose or a force that is not finite; then nothing has changed.
  template <class Body>
  void advance(Body& body, ToolPose<Scalar> const& tool, Scalar force = 0) {
    if constexpr (can_cut<Body>()) {
      detail::require_pose("VolumeCutter", tool);
      if (!std::isfinite(force))
        throw InvalidArgument(
            detail::message("VolumeCutter: the tick was not taken: the tool presses with ", force, " N; give a finite force, or 0 where it is not known"));
      use(detail::shape_of(body), tool, force);
    }
  }
  /// The same for the tip [m] of a tool that is not turned.
  template <class Body>
  void advance(Body& body, detail::TipPosition<Scalar> const& tip, Scalar force = 0) {
    advance(body, tip.pose(), force);
  }

  /// One tick: the blade is here now, and the tissue as it is.
  template <class Body>
  void advance(Body& body, Segment const& blade) {
    std::array const ends{blade.from, blade.to};
    advance(body, std::span<Vector const>(ends));
  }
  /// The same of a blade of several straight pieces, from point to point [m, world]; their number stays while it cuts.
  template <class Body>
  void advance(Body& body, std::span<Vector const> blade) {
    if constexpr (can_cut<Body>()) {
      require_sound(body, blade);
      detail::require_pieces("the tick was not taken: the blade", blade, "m");
      cut(detail::shape_of(body), blade, options_.puncture_depth);
    }
  }

  /// The blade is taken away: what it has cut is opened as far as that goes, and it may come back anywhere.
  template <class Body>
  void lift(Body& body) {
    if constexpr (CuttableSolid<typename detail::TissueOf<Body>::type>) {   // of another body advance() speaks
      if (!was_restored(body)) {
        auto& shape = detail::shape_of(body);
        if (waits_) go(shape, 0, options_.puncture_depth);
        end_stroke(shape);
      }
      forget();
    }
  }
  /// The body was restored to how it was when this cutter was copied: the stroke goes on from there.
  ///   auto const saved = body.save(); auto const knife_then = knife;  …  body.restore(saved), knife = knife_then, knife.resume(body);
  template <class Body>
  void resume(Body const& body) {
    body.tissue().topology();              // throws for a surface
    restorations_ = body.restorations();   // a stroke that was to be forgotten then still is
    touch_.resume(body);
  }
  /// The same as lift(); a tool has to come from outside again.
  template <class Body>
  void reset(Body& body) {
    lift(body);
    trail_.clear();
    touch_.reset();
    last_blade_.clear();
    front_.reset(), asked_at_.reset();
    state_ = CuttingPhase::no_contact;
  }

  /// Whether it is in the tissue, and has cut it.
  bool is_cutting() const noexcept { return cut_.has_cut(); }
  /// The cut has not come to where the blade was: so much is not cut in one tick, see max_tetrahedra.
  bool is_behind() const noexcept { return is_behind_; }
  Report const& report() const noexcept { return cut_.report(); }
  /// What has gone as debris since it was made.
  RemovedTissue const& debris() const noexcept { return removed_; }
  Options const& options() const noexcept { return options_; }

  // --- of a tool --------------------------------------------------------------------------------------------------------
  CuttingPhase state() const noexcept { return state_; }
  SurfaceContact<Scalar> const& contact() const noexcept { return touch_.contact(); }
  Scalar tip_radius() const noexcept { return touch_.tip_radius(); }
  /// What of the tissue resists the blade, for the coupling to the hand; nothing without toughness and friction.
  std::optional<BladeGrip<Scalar>> grip() const noexcept {
    return resistance_.holds() && !leaves_ ? std::optional(resistance_.grip()) : std::nullopt;
  }
  /// What the tissue has resisted the tool with, through that grip, since the last tick, in the mean [N]: the hand's work is counted by that, or by the spring of
  /// the grip where it is not told.
  void resisted(Vector const& force) {
    detail::require_finite("VolumeCutter: the force that the tissue resists with", force, "N");
    resistance_.felt(-force.template cast<double>());
  }
  /// m², cut since it was made: of the faces cut, undeformed.
  double area() const noexcept { return cut_.area(); }

 private:
  static typename detail::BladeResistance<Scalar>::Options of_resistance(Options const& options) noexcept {
    return {.toughness = static_cast<double>(options.toughness), .friction = static_cast<double>(options.lip_friction), .stiffness = static_cast<double>(options.blade_stiffness)};
  }

  template <class Body>
  static consteval bool can_cut() {
    if constexpr (detail::can_act_on<Body>()) {
      constexpr bool is_solid = CuttableSolid<typename detail::TissueOf<Body>::type>, is_of_scalar = std::same_as<Scalar, typename Body::Scalar>;
      static_assert(is_solid, "VolumeCutter: this tissue is no solid that can be cut; FiniteElements is. ProgressiveCutter cuts surfaces.");
      static_assert(is_of_scalar, "VolumeCutter: the cutter computes in another scalar than the body; advance(body, tool) takes a body of its own.");
      return is_solid && is_of_scalar;
    }
    return false;
  }

  template <class Body>
  void require_sound(Body const& body, std::span<Vector const> blade) const {
    if constexpr (!RemovableSolid<typename Body::Tissue>)
      if (options_.debris > 0)
        throw InvalidArgument(detail::message("VolumeCutter: debris is ", options_.debris, ", and from this tissue no tetrahedra can be taken; give 0, or take FiniteElements"));
    if (blade.size() < 2) throw InvalidArgument(detail::message("VolumeCutter: a blade of ", blade.size(), " points; it takes at least two"));
    for (std::size_t k = 0; k < blade.size(); ++k)
      if (!is_finite(blade[k])) detail::require_finite(detail::message("VolumeCutter: the tick was not taken: point ", k, " of the blade"), blade[k], "m");
    Scalar const edge = body.mean_edge(), length = length_of(blade);
    if (!(length <= 4000 * edge))
      throw InvalidArgument(detail::message("VolumeCutter: the blade is ", length, " m long, more than 4000 edges of ", edge, " m; is it in m?"));
  }

  template <class Body>
  bool was_restored(Body const& body) const {   // throws for a surface
    return restorations_ != body.restorations() || numbering_ != body.numbering() || body.size() < size_ || body.tissue().topology().tetrahedron_count() < tetrahedra_;
  }
  void forget() noexcept {
    cut_.forget();
    resistance_.let_go();
    punctured_ = is_behind_ = waits_ = leaves_ = goes_on_ = false;
    traced_.clear();
  }

  static Scalar length_of(std::span<Vector const> blade) noexcept {
    Scalar length = 0;
    for (std::size_t k = 1; k < blade.size(); ++k) length += (blade[k] - blade[k - 1]).norm();
    return length;
  }
  /// At a share: k + u on the piece from point k to the next.
  static Vector3<double> point_of(std::span<Vector const> blade, double share) noexcept {
    std::size_t const k = std::min(static_cast<std::size_t>(share), blade.size() - 2);
    double const u = share - static_cast<double>(k);
    return (1 - u) * blade[k].template cast<double>() + u * blade[k + 1].template cast<double>();
  }

  // --- a tool -----------------------------------------------------------------------------------------------------------
  template <class Body>
  void use(Body& body, ToolPose<Scalar> const& tool, Scalar force) {
    blade_.clear();
    for (Vector const& point : options_.edge) blade_.push_back(tool.position + tool.orientation * point);
    require_sound(body, blade_);
    if (touch_.was_restored(body)) reset(body);
    auto const touch = [&] {
      bool const cuts = state_ == CuttingPhase::moving;
      detail::SkinOf<Body> skin(body, cuts);
      if (touch_.update(skin, tool.position, cuts, [&] { return (touch_.contact().depth > 0 || ends_at_tip()) && is_edge_in(body); }).touching) return;
      if (cuts) left_at_.assign(blade_.begin(), blade_.end()), leaves_ = true;
      state_ = CuttingPhase::no_contact;
    };
    touch();
    int const taken = removed_.tetrahedra;
    bool const left = leaves_;
    if (leaves_) {   // the rest of the way out of the tissue, to where it was then, in this tick and the next ones
      cut(body, std::span<Vector const>(left_at_), Scalar(0));
      if (!is_behind_) lift(body);
      if (removed_.tetrahedra != taken) touch();   // what it touches again may be gone
    }
    bool const enters = state_ != CuttingPhase::moving && !leaves_;   // the last cut is done
    bool const is_through_wound = enters && !left && comes_through_wound(body, tool.position);
    if (SurfaceContact<Scalar> const& contact = touch_.contact(); contact.touching && state_ != CuttingPhase::moving) {
      state_ = CuttingPhase::indenting;
      if (enters && (is_through_wound || !(contact.depth < options_.puncture_depth) || force >= options_.puncture_force)) {
        state_ = CuttingPhase::moving;
        if (!last_blade_.empty()) cut(body, std::span<Vector const>(last_blade_), Scalar(0));   // from where it was in the last tick: from outside
      }
    }
    last_blade_.assign(blade_.begin(), blade_.end());
    if (state_ != CuttingPhase::moving) return;
    cut(body, std::span<Vector const>(blade_), Scalar(0));
    if (removed_.tetrahedra != taken) touch();   // what it touched may be gone
  }

  /// Whether the edge has an end, and not a point between its ends, next to the tip: one that reaches beyond it leaves the tissue with it.
  bool ends_at_tip() const noexcept {
    std::vector<Vector> const& edge = options_.edge;
    Scalar nearest = std::numeric_limits<Scalar>::infinity();
    for (std::size_t k = 1; k < edge.size(); ++k) {
      Vector const piece = edge[k] - edge[k - 1];
      nearest = std::min(nearest, Vector(edge[k - 1] + std::clamp(-edge[k - 1].dot(piece) / piece.squaredNorm(), Scalar(0), Scalar(1)) * piece).norm());
    }
    return std::min(edge.front().norm(), edge.back().norm()) <= nearest + length_of(edge) / 1000 + touch_.tip_radius();
  }
  /// Whether any of the edge is in the tissue, or between the lips of a wound.
  template <class Body>
  bool is_edge_in(Body& body) {
    std::span<Vector const> const blade(blade_);
    return traced_.would_be_inside(body, blade) || traced_.would_be_between_lips(body, blade, body.mean_edge() * 3 / 2);
  }
  /// Whether the tip has come in between the lips of a wound that is there, as deep as it would have to press, or an edge; then the skin is touched that it was
  /// in front of last.
  template <class Body>
  bool comes_through_wound(Body& body, Vector const& tip) {
    int const near = touch_.nearest_triangle();
    if (near >= 0 && near < body.tissue().surface().triangle_count() && !body.tissue().is_wound(near)) {
      if (!touch_.contact().touching) front_ = detail::facet_normal(body, near);
      return false;
    }
    detail::SkinOf<Body> skin(body, true);
    if (!traced_.is_between_lips(body, tip, body.mean_edge())) {
      if (asked_at_ && (tip - *asked_at_).norm() < body.mean_edge() / 4) return false;
      asked_at_ = tip;
      auto const over = skin.nearest_point(tip);
      if (!over.found()) return false;
      bool on_border = false;
      if (Vector const normal = detail::pseudo_normal(skin, over.triangle, over.barycentric, on_border); (tip - over.point).dot(normal) > 0) front_ = normal;
      return false;
    }
    if (!front_) return false;
    auto const over = skin.nearest_point_facing(*front_, tip);
    SurfaceContact<Scalar> contact;
    if (over.found()) contact.place(skin, over.triangle, over.barycentric, tip, touch_.tip_radius());
    if (!(contact.depth > std::min(options_.puncture_depth, body.mean_edge()) && (tip - contact.point).dot(contact.normal) < 0)) return false;
    touch_.begin_at(skin, over, tip);
    return true;
  }

  // --- the blade ------------------------------------------------------------------------------------------------------
  template <class Body>
  void cut(Body& body, std::span<Vector const> blade, Scalar puncture_depth) {
    if (was_restored(body) || pieces_ != blade.size()) forget();
    restorations_ = body.restorations(), numbering_ = body.numbering(), pieces_ = blade.size();
    follow(body, blade, puncture_depth);
    size_ = body.size(), tetrahedra_ = body.tissue().topology().tetrahedron_count();
  }
  /// From where it was in the tissue, which may have moved, to where it is now.
  template <class Body>
  void follow(Body& body, std::span<Vector const> blade, Scalar puncture_depth) {
    double const edge = static_cast<double>(body.mean_edge());
    if (traced_.empty()) {
      if (!is_far_away(body, blade)) arrive(body, blade, puncture_depth);
      return;
    }
    from_.clear(), to_.clear();
    for (detail::BladeSample const& sample : traced_.samples()) {
      from_.push_back(detail::TracedBlade<Scalar>::now(body, sample));
      to_.push_back(point_of(blade, sample.share));
    }
    target_.assign(blade.begin(), blade.end());
    if (resistance_.resists() && !leaves_) {
      Vector3<double> const behind = resistance_.stays_behind(traced_.samples(), from_, to_, cut_.area(), edge);
      for (Vector& point : target_) point -= behind.template cast<Scalar>();
      for (Vector3<double>& point : to_) point -= behind;
    }
    double way = 0;
    for (std::size_t i = 0; i < from_.size(); ++i) way = std::max(way, (to_[i] - from_[i]).norm());
    waits_ = way < edge / (resistance_.resists() ? 512 : 32);   // small ones, or what holds the blade lets go in jerks
    if (!waits_) {
      resistance_.moved();
      go(body, way, puncture_depth);
    }
    if (resistance_.resists()) resistance_.hold(body, traced_.samples(), [&](double share) { return point_of(blade, share); });
  }
  template <class Body>
  static bool is_far_away(Body& body, std::span<Vector const> blade) {
    Vector low = blade[0], high = blade[0];
    for (Vector const& point : blade) low = low.cwiseMin(point), high = high.cwiseMax(point);
    Vector const middle = (low + high) / 2;
    auto const near = body.nearest_point(middle);
    if (near.found() && !(near.distance > (high - low).norm() / 2 + body.mean_edge())) return false;
    bool on_border = false;
    return !near.found() || (middle - near.point).dot(detail::pseudo_normal(body, near.triangle, near.barycentric, on_border)) > 0;
  }

  /// Over what is left of the way, edge by half edge, until it is too much for one tick.
  template <class Body>
  void go(Body& body, double way, Scalar puncture_depth) {
    double const edge = static_cast<double>(body.mean_edge());
    int const parts = way < 1000 * edge ? 1 + static_cast<int>(2 * way / edge) : 1, made = body.tissue().topology().tetrahedron_count();
    is_behind_ = waits_ = false;
    ahead_.setZero();
    for (std::size_t i = 0; i < from_.size(); ++i) ahead_ += to_[i] - from_[i];
    ahead_ = ahead_.stableNormalized();
    if (goes_on_ && punctured_) {   // from where the stroke was an edge back: what it has cut of the tetrahedra here is forgotten
      goes_on_ = false;
      trail_.place_behind(body, traced_.samples(), begin_);
      end_.assign(from_.begin(), from_.end());
      sweep(body);
    }
    begin_.assign(from_.begin(), from_.end());
    for (int k = 1; k <= parts && !is_behind_; ++k) {
      double const share = static_cast<double>(k) / parts;
      end_.clear();
      for (std::size_t i = 0; i < from_.size(); ++i) end_.push_back(k < parts ? Vector3<double>((1 - share) * from_[i] + share * to_[i]) : to_[i]);
      if (punctured_) sweep(body);
      begin_.swap(end_);
      is_behind_ = k < parts && body.tissue().topology().tetrahedron_count() - made >= options_.max_tetrahedra;
      if (k == parts) break;
      traced_.put(body, begin_);
      at_.assign(begin_.begin(), begin_.end());
    }
    if (is_behind_) return;
    double const inside = traced_.length_inside();
    arrive(body, target_, puncture_depth);
    if (inside > 0 && traced_.is_inside()) cut_.has_moved(way, std::max(inside, traced_.length_inside()), edge);
    if (trail_.goes_by(way, edge) && !traced_.empty()) cut_.leave_behind(body, trail_.here(), 2 * edge);
  }
  /// It is here now: where it is in the tissue, and whether it has left it.
  template <class Body>
  void arrive(Body& body, std::span<Vector const> blade, Scalar puncture_depth) {
    bool const begins = traced_.empty();
    find(body, blade);
    if (traced_.is_inside()) {
      if (begins) goes_on_ = trail_.is_here(body, traced_.samples());
      trail_.put(body, traced_.samples());
      punctured_ = punctured_ || !(puncture_depth > 0);
      for (detail::BladeSample const& sample : traced_.samples())
        if (!punctured_ && sample.is_inside())
          punctured_ = !(body.nearest_point(detail::TracedBlade<Scalar>::now(body, sample).template cast<Scalar>()).distance < puncture_depth);
      return;
    }
    if (!begins && punctured_ && cut_.has_cut()) {   // what lies where it ends, for rounding a bit ahead, is of this stroke: another would leave a bridge there
      begin_.assign(at_.begin(), at_.end()), end_.clear();
      for (Vector3<double> const& point : begin_) end_.push_back(point + 1e-3 * static_cast<double>(body.mean_edge()) * ahead_);
      sweep(body);
      find(body, blade);
    }
    if (end_stroke(body)) find(body, blade);   // tetrahedra have other numbers now
    trail_.clear();
    punctured_ = !(puncture_depth > 0);
    if (is_far_away(body, blade)) forget();
  }
  template <class Body>
  void find(Body& body, std::span<Vector const> blade) {
    traced_.trace(body, blade);
    at_.clear();
    for (detail::BladeSample const& sample : traced_.samples()) at_.push_back(detail::TracedBlade<Scalar>::now(body, sample));
  }
  /// Returns whether debris has gone.
  template <class Body>
  bool end_stroke(Body& body) {
    bool const clears = cut_.has_cut() && options_.debris > 1;
    cut_.end(body);
    if constexpr (RemovableSolid<typename Body::Tissue>) {
      removal_.clear();
      for (int t = 0; clears && t < body.tissue().surface().triangle_count(); ++t)
        if (body.tissue().is_wound(t)) removal_.add_debris(body, body.tissue().topology().border_face(t).tetrahedron, options_.debris, removed_);
      if (removal_.size() == 0) return false;
      removal_.take(body, removed_);
      body.finish_edits();
      numbering_ = body.numbering();
      return true;
    }
    return false;
  }

  template <class Body>
  void sweep(Body& body) {
    Scalar const edge = body.mean_edge();
    // It begins a bit before, so that what lies where the last one ended is not missed: for rounding, and in the air because what is near may have moved otherwise
    // than what has carried the blade there.
    times_.assign(begin_.size(), -1e-3);
    for (std::size_t i = 0; i < begin_.size(); ++i) {
      Vector3<double> const ahead = end_[i] - begin_[i];
      if (double const way = ahead.norm(); way > 0 && !traced_.samples()[i].is_inside())
        times_[i] -= std::min(1000.0, (static_cast<double>(edge) / 50 + (begin_[i] - at_[i]).norm()) / way);
      begin_[i] += times_[i] * ahead;
    }
    detail::BladeSweep const swept(begin_, times_, end_, swept_);
    // Where what is swept meets a part of the solid, one of its points is in it, or it goes through its border.
    starts_.clear();
    for (detail::BladeSample const& sample : traced_.samples()) starts_.push_back(sample.tetrahedron);
    detail::Box<Scalar> box;
    for (detail::SweptQuadrilateral const& q : swept.quadrilaterals()) {
      box.add(q.low.template cast<Scalar>()), box.add(q.high.template cast<Scalar>());
      if (&q != &swept.quadrilaterals().back() && (box.high - box.low).maxCoeff() < edge) continue;
      Vector const margin = Vector::Constant(Scalar(1e-3) * edge);
      box.low -= margin, box.high += margin;
      body.visit_triangles_in_box(box.low, box.high, [&](int triangle) {   // and some beside it, others in a tree that is made anew
        auto const c = body.tissue().surface().corners(triangle);
        detail::Box<Scalar> own;
        own.add(body.positions().col(c[0]), body.positions().col(c[1]), body.positions().col(c[2]));
        if (own.overlaps(box)) starts_.push_back(body.tissue().topology().border_face(triangle).tetrahedron);
      });
      box = {};
    }
    double const mean = static_cast<double>(edge), share = static_cast<double>(options_.snap), least = static_cast<double>(options_.min_snap) * mean;
    cut_.sweep(body, swept, starts_,
               {.share = share, .distance = least, .height = static_cast<double>(options_.min_height) * mean, .thickness = 2 * std::max(share * mean, least)});
  }

  Options options_;
  Touch<Scalar> touch_;
  CuttingPhase state_ = CuttingPhase::no_contact;
  detail::SolidCut<Scalar> cut_;
  detail::Removal removal_;
  RemovedTissue removed_;
  detail::BladeResistance<Scalar> resistance_;
  std::optional<Vector> front_, asked_at_;   // an outward normal of the skin that the tip was in front of last, and where [m] that was asked beside a wound
  std::vector<Vector> blade_, last_blade_, left_at_, target_;   // of a tool: now, in the last tick, and when it was first out of the tissue
  detail::TracedBlade<Scalar> traced_;   // where it was at the end of the last sweep
  detail::BladeTrail<Scalar> trail_;
  Vector3<double> ahead_ = Vector3<double>::Zero();   // which way it went last
  std::vector<Vector3<double>> at_;      // its samples: where they were then,
  std::vector<Vector3<double>> from_, to_, begin_, end_;   // where they are carried to by now, where they have to go, and a part of that way
  std::size_t pieces_ = 0, restorations_ = 0, numbering_ = 0;
  int size_ = 0, tetrahedra_ = 0;   // of the body, after the last tick
  bool punctured_ = false, is_behind_ = false;
  bool leaves_ = false;           // the tool is out of the tissue: nothing holds its edge back in there
  bool goes_on_ = false;          // a stroke that is forgotten ended here
  bool waits_ = false;            // the way since the last sweep is too short to be worth one
  std::vector<double> times_;
  std::vector<detail::SweptQuadrilateral> swept_;
  std::vector<int> starts_;
};

}  // namespace palpate
