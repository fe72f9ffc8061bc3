// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/phase.hpp>
#include <palpate/haptics/surface_model.hpp>

#include <cstddef>
#include <limits>

namespace palpate {

/// Local model of the body for the servo, between two body steps: the plane of the undisturbed surface at the touched point, the phase of
/// the stroke and the tissue's reaction. It has no memory; it travels through a TripleBuffer.
///   depth(p) = r − (p − home point)·n
/// Units      m, N; world frame.
template <RealScalar Scalar>
struct LocalModel {
  CuttingPhase phase = CuttingPhase::no_contact;
  bool diverged = false;   ///< the body has diverged, and the hand must feel nothing
  bool valid = true;       ///< false: the body has not answered yet, and nothing arms
  std::size_t restorations = 0;   ///< of the body: when it changes, what was touched before is gone
  double time = std::numeric_limits<double>::quiet_NaN();   ///< s, of the tip that it was made for; not a number: of now
  Vector3<Scalar> home_point = Vector3<Scalar>::Zero();
  Vector3<Scalar> normal = Vector3<Scalar>::UnitZ();
  Scalar tip_radius = 0;
  Vector3<Scalar> tissue_force = Vector3<Scalar>::Zero();   // on the tool
  SurfaceModel<Scalar> surface{};   ///< for a force that answers to the surface as it is now; see SurfaceForce

  /// How deep a tip is below the plane; 0 without contact and above it.
  Scalar depth(Vector3<Scalar> const& tip) const noexcept {
    if (phase == CuttingPhase::no_contact) return 0;
    Scalar const below = tip_radius - (tip - home_point).dot(normal);
    return below > 0 ? below : Scalar(0);
  }
};

}  // namespace palpate
