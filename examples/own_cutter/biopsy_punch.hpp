// SPDX-License-Identifier: MIT
// A cutter to copy: see docs/new_cutter.md.
#pragma once

#include <palpate/extend/cutter.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <utility>
#include <vector>

template <palpate::RealScalar Scalar>
struct BiopsyPunchOptions {
  Scalar radius = Scalar(0.003);           // m, of the round blade
  Scalar puncture_depth = Scalar(0.002);   // m below the undisturbed surface, where it goes through
  Scalar snap = Scalar(0.2);               // of a mean edge: a particle as near to the circle is taken to be on it
};

/// A biopsy punch: a tube with a sharp rim. Pressed in deep enough, it goes through at once and frees a round plug.
/// The circle lies on the undeformed surface, about the tool's axis, its z axis, through the touched point. Each edge that it crosses gets a particle on
/// the circle, and each particle on the circle one copy for the plug. Rest area, mass and springs are shared, not changed.
/// Errors     InvalidArgument for a pose that is not finite, a body that can not be cut and one whose mean edge is longer than half the radius.
/// Cost       the tick that goes through: O(m log m) for the m triangles of the plug, and it allocates; the others: as Touch.
/// Limits     the wound is as round as the mesh is fine. The report counts particles and triangles, not the ways through triangles.
template <palpate::RealScalar Scalar>
class BiopsyPunch {
 public:
  using Vector = palpate::Vector3<Scalar>;

  explicit BiopsyPunch(BiopsyPunchOptions<Scalar> const& options) : options_(options) {
    if (!(options.radius > 0) || !(options.puncture_depth > 0) || !(options.snap > 0 && options.snap < Scalar(0.5)))
      throw palpate::InvalidArgument(palpate::detail::message("BiopsyPunch: .radius is ", options.radius, " m, .puncture_depth ", options.puncture_depth,
                                                              " m and .snap ", options.snap, "; all are positive, and .snap is below 0.5"));
  }

  /// One tick: contact, puncture, cut.
  template <class Body>
  void advance(Body& body, palpate::ToolPose<Scalar> const& tool) {
    using palpate::CuttingPhase;
    if (!tool.position.allFinite()) throw palpate::InvalidArgument("BiopsyPunch: the tip is not at a finite place; check the device");
    if (!body.tissue().cuttable()) throw palpate::InvalidArgument("BiopsyPunch: this body can not be cut; give one that is built from a surface");
    if (!(2 * body.mean_edge() < options_.radius))
      throw palpate::InvalidArgument(palpate::detail::message("BiopsyPunch: .radius is ", options_.radius, " m and the mesh has edges of ", body.mean_edge(),
                                                              " m; give a radius above twice that, or a finer mesh"));
    auto const& contact = touch_.update(body, tool.position);
    if (!contact.touching)
      state_ = CuttingPhase::no_contact;
    else if (state_ != CuttingPhase::moving)
      state_ = contact.depth < options_.puncture_depth ? CuttingPhase::indenting : CuttingPhase::moving;
    else
      return;   // it is through
    if (state_ != CuttingPhase::moving) return;
    Vector const touched = contact.point;
    int const particles = body.size(), triangles = body.tissue().surface().triangle_count();
    find_plug(body, tool.orientation * Vector::UnitZ());
    divide_edges(body);
    free_plug(body);
    body.even_masses();
    report_ = {.particles_added = body.size() - particles, .triangles_added = body.tissue().surface().triangle_count() - triangles};
    touch_.restart_from(body, body.nearest_point(touched).triangle, tool.position);
  }

  template <class Body>
  void reset(Body&) {   // optional: ResettableCutter
    touch_.reset();
    state_ = palpate::CuttingPhase::no_contact;
  }

  palpate::SurfaceContact<Scalar> const& contact() const { return touch_.contact(); }
  palpate::CuttingPhase state() const { return state_; }
  palpate::CutReport const& report() const { return report_; }
  Scalar tip_radius() const { return touch_.tip_radius(); }

 private:
  enum class Place : char { outside, inside, on };

  /// The particles within the circle that hang together with the touched triangle, those on the circle beside them, and the edges that cross it.
  template <class Body>
  void find_plug(Body const& body, Vector const& axis) {
    auto const& tissue = body.tissue();
    auto const& contact = touch_.contact();
    auto const touched = tissue.surface().corners(contact.triangle);
    axis_ = axis, centre_.setZero();
    for (std::size_t k = 0; k < 3; ++k) centre_ += contact.barycentric[static_cast<int>(k)] * tissue.rest_position(touched[k]);
    place_.assign(static_cast<std::size_t>(body.size()), Place::outside);
    plug_.clear(), rim_.clear(), crossing_.clear();
    auto const visit = [&](int p) {
      auto& place = place_[static_cast<std::size_t>(p)];
      if (place != Place::outside) return place;
      Scalar const beyond = across(tissue.rest_position(p)).norm() - options_.radius, snap = options_.snap * body.mean_edge();
      place = beyond < -snap ? Place::inside : beyond > snap ? Place::outside : Place::on;
      if (place == Place::inside) plug_.push_back(p);
      if (place == Place::on) rim_.push_back(p);
      return place;
    };
    for (int const p : touched) visit(p);
    for (std::size_t k = 0; k < plug_.size(); ++k) {   // it grows
      int const p = plug_[k];
      for (int const t : tissue.surface().triangles_at(p))
        for (int const q : tissue.surface().corners(t))
          if (visit(q) == Place::outside) crossing_.push_back({p, q});
    }
    std::sort(crossing_.begin(), crossing_.end());
    crossing_.erase(std::unique(crossing_.begin(), crossing_.end()), crossing_.end());
  }

  /// A particle where an edge crosses the circle: |a + s (b − a)| = radius, all across the axis.
  template <class Body>
  void divide_edges(Body& body) {
    for (auto const& [p, q] : crossing_) {
      Vector const a = across(body.tissue().rest_position(p)), way = across(body.tissue().rest_position(q)) - a;
      Scalar const half = a.dot(way), square = way.squaredNorm();
      Scalar const s = (std::sqrt(half * half + square * (options_.radius * options_.radius - a.squaredNorm())) - half) / square;
      rim_.push_back(body.insert_on_edge(p, q, s));
    }
    place_.resize(static_cast<std::size_t>(body.size()), Place::on);
  }

  /// Parts the triangles at each particle of the circle into fans, those of the plug and those around it, and gives each but one a copy.
  template <class Body>
  void free_plug(Body& body) {
    auto const& surface = body.tissue().surface();
    auto const is_inside = [&](int t) {
      return std::ranges::any_of(surface.corners(t), [&](int p) { return p < static_cast<int>(place_.size()) && place_[static_cast<std::size_t>(p)] == Place::inside; });
    };
    auto const share_edge = [&](int t, int u) { return std::ranges::count_if(surface.corners(t), [&](int p) { return surface.corner_of(u, p) >= 0; }) == 2; };
    std::vector<int> fan;
    for (int const p : rim_)
      while (true) {
        fan.assign(1, surface.triangles_at(p)[0]);
        for (std::size_t k = 0; k < fan.size(); ++k)
          for (int const t : surface.triangles_at(p))
            if (is_inside(t) == is_inside(fan[k]) && share_edge(t, fan[k]) && std::ranges::find(fan, t) == fan.end()) fan.push_back(t);
        if (fan.size() == surface.triangles_at(p).size()) break;
        body.split_particle(p, fan);
      }
  }

  /// From the punch's axis to a point, square to the axis [m].
  Vector across(Vector const& point) const { return point - centre_ - (point - centre_).dot(axis_) * axis_; }

  BiopsyPunchOptions<Scalar> options_;
  palpate::Touch<Scalar> touch_;
  palpate::CuttingPhase state_ = palpate::CuttingPhase::no_contact;
  palpate::CutReport report_;
  Vector centre_ = Vector::Zero(), axis_ = Vector::UnitZ();   // m, undeformed
  std::vector<Place> place_;                                  // of each particle
  std::vector<int> plug_, rim_;                               // particles inside, and on the circle
  std::vector<std::array<int, 2>> crossing_;                  // edges from inside to outside
};
