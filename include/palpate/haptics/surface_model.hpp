// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/haptics/plane_set.hpp>
#include <palpate/haptics/surface_patch.hpp>

#include <cstdint>

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

}  // namespace palpate
