// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/phase.hpp>
#include <palpate/haptics/facet_planes.hpp>
#include <palpate/haptics/local_model.hpp>
#include <palpate/haptics/surface_fit.hpp>

#include <cstddef>

namespace palpate {

struct SurfaceSensorOptions {
  int rings = 1;              ///< so many edges around the touched triangle the surface is fitted to
  double approach = 0.005;    ///< m in front of the surface, from which on it is sent
};

/// Makes the local surface model around a tool, once a tick of the body: a plane, a ball or facets, in contact or on approach. While the
/// touched triangle stays and nothing is cut, plane and ball follow the vertices by the pseudo-inverse; otherwise they are fitted again.
/// Cost       O(vertices near), whatever the size of the body; before contact also a search of the body's tree. No allocation.
/// Limits     While a tool cuts there is no surface that it could not enter: the model is empty.
template <RealScalar Scalar>
class SurfaceSensor {
 public:
  explicit SurfaceSensor(SurfaceKind kind = SurfaceKind::none, SurfaceSensorOptions const& options = {})
      : kind_(kind), approach_(static_cast<Scalar>(options.approach)), fit_({.rings = options.rings, .curved = kind == SurfaceKind::ball}) {
    detail::OptionCheck{"SurfaceSensor"}.not_negative(".approach", options.approach, " m");
  }

  SurfaceKind kind() const noexcept { return kind_; }

  /// The surface near a tip, for a tool that is in this phase with this contact; `stiffness` [N/m] is that of the contact.
  template <class Body, class Contact>
  SurfaceModel<Scalar> const& look(Body& body, Contact const& contact, CuttingPhase phase, Vector3<Scalar> const& tip, Scalar radius, Scalar stiffness) {
    if (kind_ == SurfaceKind::none) return model_;
    ++model_.sequence;
    way_ = looked_ && is_finite(tip) ? Vector3<Scalar>(tip - tip_) : Vector3<Scalar>(Vector3<Scalar>::Zero());
    tip_ = tip;
    looked_ = is_finite(tip);
    model_.patch.stiffness = 0;
    model_.planes.clear();
    if (phase == CuttingPhase::moving || !is_finite(tip)) return model_;
    if (phase == CuttingPhase::indenting && contact.touching && !contact.off_surface)
      see(body, contact.triangle, contact.barycentric, tip, radius, stiffness, contact.normal);
    else if (phase == CuttingPhase::no_contact && approach_ > Scalar(0))
      approach(body, tip, radius, stiffness);
    return model_;
  }

 private:
  template <class Body>
  void approach(Body& body, Vector3<Scalar> const& tip, Scalar radius, Scalar stiffness) {
    auto const nearest = body.nearest_point(tip);
    if (!nearest.found() || !((nearest.point - tip).norm() <= approach_ + radius)) return;
    see(body, nearest.triangle, nearest.barycentric, tip, radius, stiffness, Vector3<Scalar>::Zero());
    bool const is_outside = model_.patch.distance(tip) > Scalar(0) && model_.planes.project(tip).count == 0;   // of the folds beside it too
    if (!is_outside) model_.patch.stiffness = 0, model_.planes.clear();   // it has to come from outside
  }

  /// `pressed`: the direction of the contact, against which the tissue is pressed, as of the contact's own gap; zero where nothing touches.
  template <class Body>
  void see(Body const& body, int triangle, Vector3<Scalar> const& barycentric, Vector3<Scalar> const& tip, Scalar radius, Scalar stiffness, Vector3<Scalar> const& pressed) {
    bool const same = triangle == triangle_ && body.topology_revision() == revision_ && barycentric == barycentric_;
    if (same)
      fit_.follow(body);
    else
      fit_.fit(body, triangle, barycentric);
    triangle_ = triangle, barycentric_ = barycentric, revision_ = body.topology_revision();
    model_.patch = fit_.patch();
    auto const corners = body.tissue().surface().corners(triangle);
    model_.patch.point.setZero();   // a fit levels out the dent that the tool makes: at the touched point itself the surface is where it is
    for (std::size_t k = 0; k < 3; ++k) model_.patch.point += barycentric[static_cast<Eigen::Index>(k)] * body.positions().col(corners[k]);
    model_.patch = model_.patch.offset_by(radius, pressed);
    model_.patch.stiffness = stiffness;
    if (kind_ == SurfaceKind::facets) model_.planes = facet_planes(body, triangle, tip, radius, Vector3<Scalar>(tip + Scalar(2) * way_), pressed);
  }

  SurfaceKind kind_;
  Scalar approach_;
  SurfaceFit<Scalar> fit_;
  SurfaceModel<Scalar> model_{};
  Vector3<Scalar> tip_ = Vector3<Scalar>::Zero(), way_ = Vector3<Scalar>::Zero();   // at the last look, and since the one before
  bool looked_ = false;
  int triangle_ = -1;
  Vector3<Scalar> barycentric_ = Vector3<Scalar>::Zero();
  std::size_t revision_ = 0;
};

}  // namespace palpate
