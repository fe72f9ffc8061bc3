// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/phase.hpp>
#include <palpate/haptics/plane_set.hpp>
#include <palpate/haptics/surface_patch.hpp>

#include <cstddef>
#include <cstdint>
#include <limits>

namespace palpate {

/// Which local surface model a surface force asks for.
enum class SurfaceKind {
  none,    ///< it does not ask
  plane,   ///< one plane, fitted to the vertices around the touched point
  ball,    ///< a ball or a hollow one: follows a curved surface between two updates
  facets   ///< up to three planes, the touched facet and those that fold towards the tool: for edges and corners
};

/// The present surface near the tool, for a servo that is faster than the body: part of the local model. Already offset by the tool's
/// radius.
///   Sent from the approach on, before the first contact; a stiffness of 0 means no surface.
/// Units      m, N/m; world frame.
template <RealScalar Scalar>
struct SurfaceModel {
  SurfacePatch<Scalar> patch{};
  PlaneSet<Scalar> planes{};
  std::uint64_t sequence = 0;   ///< rises with every model; 0: none was made

  Scalar stiffness() const noexcept { return patch.stiffness; }
};

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
  Vector3<Scalar> tissue_moment = Vector3<Scalar>::Zero();  // N m, on the tool, about its origin; of a tool that tells it
  double cut_area = 0;            ///< m², by the cutter so far, where it counts that
  SurfaceModel<Scalar> surface{};   ///< for a force that answers to the surface as it is now; see SurfaceForce

  /// How deep a tip is below the plane; 0 without contact and above it.
  Scalar depth(Vector3<Scalar> const& tip) const noexcept {
    if (phase == CuttingPhase::no_contact) return 0;
    Scalar const below = tip_radius - (tip - home_point).dot(normal);
    return below > 0 ? below : Scalar(0);
  }
};

}  // namespace palpate
