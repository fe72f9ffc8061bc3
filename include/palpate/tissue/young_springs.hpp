// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/material/isotropic.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace palpate {

/// How stiff the springs of a network are that is to have Young's modulus E.
///   van_gelder   k = E Σ V/L² over the tetrahedra at an edge of length L, of a surface E h Σ A/L² over its triangles.
///   lloyd        k = 2√2/25 E Σ l, of a surface √3/4 E h each triangle: l the edge of a regular tetrahedron of the same volume. Where triangles are
///                regular the two are the same; of regular tetrahedra van_gelder is 1/(6√2), 4 % more.
enum class YoungSprings { van_gelder, lloyd };

/// Gives each link of a body that was made of tetrahedra the stiffness that `formula` says; dampers stay. Of a surface: `thickness` h [m] of the sheet.
/// A network of springs has one Poisson's ratio: 1/4, of a sheet 1/3. What else is asked for it can not have.
/// Units      young [Pa].
/// Source     \cite vangelder1998, \cite lloyd2007. The first is what an even spread of directions gives: ½ Σ k L² ⟨(n·ε n)²⟩ is the energy of Hooke's law.
/// Errors     InvalidArgument for a modulus or a thickness that is not positive. Springs must not have been cut.
/// Limits     regular meshes have stiff and soft directions, and on irregular ones springs part the load unevenly: docs/models.md has the measured error.
template <RealScalar Scalar>
void set_young(MassSpring<Scalar>& tissue, Scalar young, YoungSprings formula = YoungSprings::van_gelder, Scalar thickness = 0) {
  detail::require_young("Young's modulus of springs", young);
  auto const& links = tissue.links();
  std::vector<Scalar> stiffness(static_cast<std::size_t>(links.size()), Scalar(0));
  auto const rest = [&](int i) { return Vector3<Scalar>(tissue.rest_position(i)); };
  auto const add = [&](auto const& corners, Scalar scale, Scalar regular) {   // k = scale/L², or that of a regular one
    for (std::size_t a = 0; a < corners.size(); ++a)
      for (std::size_t b = 0; b < a; ++b) {
        int const link = links.find(corners[a], corners[b]);
        if (link < 0) continue;
        Scalar const squared = Vector3<Scalar>(rest(corners[a]) - rest(corners[b])).squaredNorm();
        stiffness[static_cast<std::size_t>(link)] += formula == YoungSprings::lloyd ? regular : scale / squared;
      }
  };
  if (tissue.solid().tetrahedron_count() > 0) {
    auto const& solid = tissue.solid();
    for (int t = 0; t < solid.tetrahedron_count(); ++t) {
      auto const corners = solid.corners(t);
      Vector3<Scalar> const o = rest(corners[0]);
      Scalar const volume = Vector3<Scalar>(rest(corners[1]) - o).cross(Vector3<Scalar>(rest(corners[2]) - o)).dot(Vector3<Scalar>(rest(corners[3]) - o)) / 6;
      add(corners, young * volume, Scalar(2 * std::numbers::sqrt2 / 25) * young * std::cbrt(Scalar(6 * std::numbers::sqrt2) * volume));
    }
  } else {
    detail::require_positive("the thickness of a sheet of springs", thickness, "m");
    for (int t = 0; t < tissue.surface().triangle_count(); ++t) {
      auto const corners = tissue.surface().corners(t);
      Vector3<Scalar> const o = rest(corners[0]);
      Scalar const area = Vector3<Scalar>(rest(corners[1]) - o).cross(Vector3<Scalar>(rest(corners[2]) - o)).norm() / 2;
      add(corners, young * thickness * area, Scalar(std::numbers::sqrt3 / 4) * young * thickness);
    }
  }
  for (int link = 0; link < links.size(); ++link) {
    auto law = links[link].law;
    law.stiffness = stiffness[static_cast<std::size_t>(link)];
    tissue.set_link(link, law);
  }
}

}  // namespace palpate
