// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/surface_tree.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/components.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/repair.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/volume/detail/manifold_border.hpp>
#include <palpate/volume/detail/stuffed_lattice.hpp>
#include <palpate/volume/winding_number.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

namespace palpate {

struct FillOptions {
  double edge = 0;   ///< m, the lattice constant a: inside, edges are a and 0.866 a long, twelve tetrahedra to a³
};

/// A solid, and what became of the surface that it was made of.
template <RealScalar Scalar>
struct Filling {
  TetrahedralMesh<Scalar> mesh;
  double smallest_dihedral = 0, largest_dihedral = 0;   ///< degrees
  double volume = 0, surface_volume = 0;                ///< m³; of the surface after repair, which means little where that is open
  double skin_to_surface = 0;                           ///< m, from the vertices of the border to the surface, the largest
  double surface_to_skin = 0;                           ///< m, from the vertices of the surface to the border: sharp corners, parts that are lost, stray sheets
  int pieces = 0, surface_pieces = 0;                   ///< of the solid; of the border and of the surface each wall is one
  int border_pieces = 0;
  int euler = 0, surface_euler = 0;                     ///< Euler characteristic of the border and of the surface
  int open_edges = 0;                                   ///< of the surface: 0 where it is closed
  int removed = 0;                                      ///< tetrahedra that touched others in an edge or a vertex only
  RepairReport repair;                                  ///< what had to be done to the surface

  /// Whether pieces, handles and cavities of the surface are those of the border. False where parts thinner than an edge were lost or grew together, and
  /// where an open surface was closed.
  bool same_topology() const noexcept { return euler == surface_euler && border_pieces == surface_pieces; }
};

/// One line for a log.
template <RealScalar Scalar>
std::string to_string(Filling<Scalar> const& filling) {
  using detail::message;
  std::string text = message(filling.mesh.tetrahedra.cols(), " tetrahedra, ", filling.mesh.points.cols(), " vertices; dihedral angles ",
                             std::round(10 * filling.smallest_dihedral) / 10, " to ", std::round(10 * filling.largest_dihedral) / 10, " degrees; volume ",
                             static_cast<float>(1e6 * filling.volume), " of ", static_cast<float>(1e6 * filling.surface_volume), " ml; skin at most ",
                             static_cast<float>(1e3 * std::max(filling.skin_to_surface, filling.surface_to_skin)), " mm off");
  if (filling.open_edges > 0) text += message("; the surface is open at ", filling.open_edges, " edges");
  if (!filling.same_topology())
    text += message("; parts were lost, closed or joined: ", filling.surface_pieces, " walls of Euler characteristic ", filling.surface_euler, " became ",
                    filling.border_pieces, " of ", filling.euler);
  return text;
}

namespace detail {

/// How many walls a surface has, of the vertices in use.
template <RealScalar Scalar>
int walls(TriangleMesh<Scalar> const& surface) {
  return static_cast<int>(connected_components(surface).size());
}

/// The largest distance from the vertices that `of` uses to `to`.
inline double farthest_vertex(TriangleMesh<double> const& of, TriangleMesh<double> const& to) {
  SurfaceTree<double> const tree(to);
  double most = 0;
  int hint = -1;
  std::vector<char> done(static_cast<std::size_t>(of.points.cols()), 0);
  for (int const v : of.triangles.reshaped()) {
    if (std::exchange(done[static_cast<std::size_t>(v)], char{1})) continue;
    auto const nearest = tree.nearest(to.points, of.points.col(v), hint);
    hint = nearest.triangle;
    most = std::max(most, nearest.distance);
  }
  return most;
}

}  // namespace detail

/// A solid from its skin, by isosurface stuffing: a regular lattice inside, warped and cut at the surface, so that no dihedral angle is below 10.6 or above
/// 164.8 degrees, whatever the surface looks like. What is inside is what the surface goes round (winding number above ½): holes, doubled triangles and stray sheets do
/// little harm, walls that face inward are repaired first. A closed surface within another that faces
/// inward, out of the material, is the wall of a cavity; one that faces outward is filled over.
///
///   auto const solid = fill(read_mesh("liver.stl", metres_per("mm")), {.edge = 0.006});
///   FiniteElements<double, StableNeoHookean<double>> tissue(solid.mesh, {.density = 1060, .material = {.young = 5e3, .poisson = 0.45}});
///
/// Units      m; angles in degrees.
/// Source     \cite labelle2007, see StuffedLattice for where we differ; \cite jacobson2013 for what is inside.
/// Errors     InvalidArgument: an edge that is not positive or so small that the lattice would have more than 5 · 10⁷ vertices. InvalidMesh: no triangles, corners
///            that are no points, not finite or a million times as far off as the others; nothing inside, for the surface is open or thinner than the edge all over.
/// Invariant  positive volumes; the border is a closed surface. The same input gives the same bytes.
/// Cost       O(L³/a³) lattice vertices, each O(log m); an organ of 16,000 tetrahedra takes some 0.3 s.
/// Limits     sharp corners and parts thinner than an edge are rounded or lost: `same_topology` and the distances tell. Volume and distance are off by O(a²).
template <RealScalar Scalar>
Filling<Scalar> fill(TriangleMesh<Scalar> const& skin, FillOptions const& options) {
  detail::require_positive("the edge of the lattice", options.edge, "m");
  if (skin.triangles.cols() == 0) throw InvalidMesh("the surface has no triangles, so nothing is inside; was the file read to its end?");
  detail::check_corners(skin);
  Filling<Scalar> filling;
  TriangleMesh<double> surface{skin.points.template cast<double>(), skin.triangles};
  filling.repair = palpate::repair(surface);
  for (auto const& defect : filling.repair.left)
    if (defect.kind == MeshDefectKind::not_finite) throw InvalidMesh("the surface can not be filled: " + to_string(defect));
  if (surface.triangles.cols() == 0) throw InvalidMesh("the surface has no triangle with an area, so nothing is inside; was the file read to its end?");

  auto const box = bounding_box(surface);
  Vector3<double> const middle = box.center();
  for (int const v : skin.triangles.reshaped())   // triangles there are so narrow that they were dropped
    if (Vector3<double> const p = skin.points.col(v).template cast<double>(); !((p - middle).norm() <= 1e6 * box.sizes().norm()))
      throw InvalidMesh(detail::message("vertex ", v, " is at (", p[0], ", ", p[1], ", ", p[2], ") m, a million times as far off as the others are; correct it"));
  std::array<int, 3> cubes;
  double vertices = 2;
  for (int k = 0; k < 3; ++k) {
    double const count = 2 * std::ceil(box.sizes()[k] / 2 / options.edge + 1);   // with the middle of the box on a vertex and room around
    vertices *= count + 1;
    cubes[static_cast<std::size_t>(k)] = static_cast<int>(std::min(count, 1e6));
  }
  constexpr double most = 5e7;
  if (vertices > most)
    throw InvalidArgument(detail::message("an edge of ", options.edge, " m makes a lattice of ", vertices, " vertices in a box of ", box.sizes()[0], " x ", box.sizes()[1], " x ",
                                          box.sizes()[2], " m, at most ", most, " are possible; give an edge above ", options.edge * std::cbrt(vertices / most),
                                          " m, or the surface in metres (it may be in millimetres)"));
  WindingNumber const winding(surface);
  SurfaceTree<double> const tree(surface);
  double const sense = palpate::volume(surface) < 0 ? -1 : 1;
  int hint = -1;
  auto const signed_distance = [&](Vector3<double> const& p) {
    auto const nearest = tree.nearest(surface.points, p, hint);
    hint = nearest.triangle;
    return sense * winding(p) > 0.5 ? -nearest.distance : nearest.distance;
  };
  Vector3<double> const corner = middle - options.edge / 2 * Vector3<double>(cubes[0], cubes[1], cubes[2]);
  TetrahedralMesh<double> mesh = detail::StuffedLattice(corner, options.edge, cubes).fill(signed_distance);
  filling.removed = detail::make_border_manifold(mesh);
  filling.open_edges = static_cast<int>(boundary_edges(surface).size());
  if (mesh.tetrahedra.cols() == 0) {
    bool const is_open = filling.open_edges > 0;
    throw InvalidMesh(detail::message("nothing is inside the surface at an edge of ", options.edge, " m: it is ",
                                      is_open ? detail::message("open (", filling.open_edges, " edges have one triangle) or ") : "",
                                      "thinner than the edge; ", is_open ? "close it or " : "", "give a smaller edge"));
  }
  RepairReport dropped;
  dropped.new_index.resize(static_cast<std::size_t>(mesh.points.cols()));
  std::iota(dropped.new_index.begin(), dropped.new_index.end(), 0);
  detail::drop_unused(mesh, true, dropped);

  auto const border = palpate::surface(mesh);
  filling.volume = palpate::volume(mesh), filling.surface_volume = std::abs(palpate::volume(surface));
  filling.skin_to_surface = detail::farthest_vertex(border, surface), filling.surface_to_skin = detail::farthest_vertex(surface, border);
  filling.pieces = static_cast<int>(connected_components(mesh).size());
  filling.border_pieces = detail::walls(border), filling.surface_pieces = detail::walls(surface);
  filling.euler = euler_characteristic(border), filling.surface_euler = euler_characteristic(surface);
  filling.mesh = {mesh.points.template cast<Scalar>(), mesh.tetrahedra};
  filling.smallest_dihedral = 180;
  for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t) {
    Matrix<double, 3, 4> p;
    for (int c = 0; c < 4; ++c) p.col(c) = filling.mesh.points.col(mesh.tetrahedra(c, t)).template cast<double>();
    auto const [low, high] = detail::dihedral_range(p);
    filling.smallest_dihedral = std::min(filling.smallest_dihedral, low), filling.largest_dihedral = std::max(filling.largest_dihedral, high);
  }
  return filling;
}

}  // namespace palpate
