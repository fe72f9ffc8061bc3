// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>

#include <string>

namespace palpate {

/// What can be wrong with a mesh. Behind each: what `index`, `other` and `value` of the defect hold.
enum class MeshDefectKind {
  empty,                      ///< no element at all
  not_finite,                 ///< vertex, axis 0 … 2, the coordinate
  vertex_out_of_range,        ///< element, the vertex it names, number of points
  repeated_corner,            ///< element, the vertex it names twice
  no_area,                    ///< triangle, –, height over its longest side divided by that side
  no_volume,                  ///< tetrahedron, –, six times the volume divided by its longest side cubed
  inverted,                   ///< tetrahedron, –, signed volume [m³]
  unused_vertex,              ///< vertex
  duplicate_vertex,           ///< vertex, the earlier vertex, distance [m]
  duplicate_element,          ///< element, the earlier element
  non_manifold_edge,          ///< vertex, vertex, number of triangles at the edge
  non_manifold_face,          ///< tetrahedron, tetrahedron, number of tetrahedra at the face
  inconsistent_orientation,   ///< vertex, vertex: the edge whose two triangles face opposite ways
  non_manifold_vertex,        ///< vertex, –, number of separate fans of triangles
  open_border,                ///< smallest vertex of a hole, –, number of its edges
  inward                      ///< smallest vertex of a closed piece, –, signed volume [m³]
};

/// One thing that is wrong with a mesh, and where.
struct MeshDefect {
  MeshDefectKind kind;
  int index = -1;
  int other = -1;
  double value = 0;
  int corners = 3;   ///< of an element: 3 in a surface, 4 in a volume
};

/// A sentence: what is wrong, where, which value, what to do.
inline std::string to_string(MeshDefect const& d) {
  using detail::message;
  char const* const element = d.corners == 4 ? "tetrahedron" : "triangle";
  auto const count = [&] { return static_cast<long long>(d.value); };   // not for coordinates: they may be NaN
  switch (d.kind) {
    case MeshDefectKind::empty:
      return message("the mesh has no ", element, "; give it at least one (was the file read to its end?)");
    case MeshDefectKind::not_finite:
      return message("vertex ", d.index, " has the coordinate ", d.other == 0 ? "x" : d.other == 1 ? "y" : "z", " = ", d.value,
                     "; correct it at the source, a position can not be guessed");
    case MeshDefectKind::vertex_out_of_range:
      return message(element, " ", d.index, " names vertex ", d.other, " but the mesh has ", count(),
                     " points, counted from 0; correct the index or drop the ", element);
    case MeshDefectKind::repeated_corner:
      return message(element, " ", d.index, " names vertex ", d.other, " more than once; `repair` drops it");
    case MeshDefectKind::no_area:
      return message("triangle ", d.index, " has no area (height over longest side: ", d.value, "); `repair` removes it");
    case MeshDefectKind::no_volume:
      return message("tetrahedron ", d.index, " has no volume (6 V / longest side cubed: ", d.value, "); `repair` drops it");
    case MeshDefectKind::inverted:
      return message("tetrahedron ", d.index, " is inside out (volume ", d.value, " m³); `repair` swaps two corners");
    case MeshDefectKind::unused_vertex:
      return message("vertex ", d.index, " belongs to no ", element, ", it would have no mass; `repair` drops it");
    case MeshDefectKind::duplicate_vertex:
      return message("vertex ", d.index, " lies on vertex ", d.other, " (", d.value, " m apart); `repair` merges them");
    case MeshDefectKind::duplicate_element:
      return message(element, " ", d.index, " has the same corners as ", element, " ", d.other, "; `repair` drops it");
    case MeshDefectKind::non_manifold_edge:
      return message("edge ", d.index, "–", d.other, " belongs to ", count(),
                     " triangles where a surface has one or two; take the extra sheet away in a mesh editor");
    case MeshDefectKind::non_manifold_face:
      return message("a face of tetrahedron ", d.index, " belongs to ", count(), " tetrahedra, ", d.other,
                     " among them, where a volume has one or two; correct the overlap at the source");
    case MeshDefectKind::inconsistent_orientation:
      return message("the two triangles at edge ", d.index, "–", d.other, " face opposite ways; `repair` turns one side");
    case MeshDefectKind::non_manifold_vertex:
      return message("vertex ", d.index, " joins ", count(),
                     " separate fans of triangles; give each fan a vertex of its own in a mesh editor");
    case MeshDefectKind::open_border:
      return message("the surface has a hole with a border of ", count(), " edges through vertex ", d.index,
                     " where it must be closed; fill it in a mesh editor");
    case MeshDefectKind::inward:
      return message("the piece with vertex ", d.index, " faces inward (signed volume ", d.value, " m³); `repair` turns it");
  }
  return "unknown defect";
}

}  // namespace palpate
