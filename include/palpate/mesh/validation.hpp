// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/detail/close_points.hpp>
#include <palpate/mesh/detail/simplices.hpp>
#include <palpate/mesh/detail/surface_sides.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

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
  overlap,                    ///< tetrahedron, the earlier tetrahedron: both lie on the same side of the face that they share
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
    case MeshDefectKind::overlap:
      return message("tetrahedra ", d.other, " and ", d.index, " lie on the same side of the face that they share, so they overlap; move the vertex back that",
                     " has gone through it, or mesh anew there");
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

/// What a mesh must be. Always: indices in range, coordinates finite, no element without area or volume, none twice, at most two
/// triangles at an edge, in one sense, one fan of triangles at a vertex.
struct MeshRequirements {
  bool closed = false;           ///< a surface without border that faces outward
  bool distinct_points = true;   ///< no two vertices at one place; false for a mesh that was cut: the lips lie on each other
  bool no_unused_points = true;
  double tolerance = 1e-5;       ///< of the median side for two points at one place, of its longest side for a flat element
};

namespace detail {

template <RealScalar Scalar, int Corners>
struct ElementChecks {
  std::vector<MeshDefect> defects;
  std::vector<char> sound;     ///< per element: safe to read, and part of the topology
  std::vector<char> upright;   ///< per tetrahedron: its volume is above 0
};

/// What triangles and tetrahedra have in common: points, indices, repeated corners, unused and doubled vertices.
template <RealScalar Scalar, int Corners>
ElementChecks<Scalar, Corners> check_elements(Matrix<Scalar, 3, Dynamic> const& points,
                                              Matrix<int, Corners, Dynamic> const& elements, MeshRequirements const& wanted) {
  using Kind = MeshDefectKind;
  ElementChecks<Scalar, Corners> result;
  auto& defects = result.defects;
  if (elements.cols() == 0) defects.push_back({Kind::empty, -1, -1, 0, Corners});
  int const vertices = static_cast<int>(points.cols());
  std::vector<char> finite(static_cast<std::size_t>(vertices), 1), used(finite.size(), 0);
  for (int v = 0; v < vertices; ++v)
    for (int k = 0; k < 3; ++k)
      if (!std::isfinite(points(k, v)) && std::exchange(finite[static_cast<std::size_t>(v)], char{0}))
        defects.push_back({Kind::not_finite, v, k, static_cast<double>(points(k, v)), Corners});

  result.sound.assign(static_cast<std::size_t>(elements.cols()), 1);
  result.upright.assign(Corners == 4 ? result.sound.size() : 0, 0);
  for (int e = 0; e < static_cast<int>(elements.cols()); ++e) {
    char& sound = result.sound[static_cast<std::size_t>(e)];
    for (int c = 0; c < Corners && sound; ++c)
      if (int const v = elements(c, e); v < 0 || v >= vertices) {
        defects.push_back({Kind::vertex_out_of_range, e, v, static_cast<double>(vertices), Corners});
        sound = 0;
      }
    if (!sound) {
      for (int c = 0; c < Corners; ++c)
        if (int const v = elements(c, e); v >= 0 && v < vertices) used[static_cast<std::size_t>(v)] = 1;
      continue;
    }
    for (int c = 0; c < Corners; ++c) used[static_cast<std::size_t>(elements(c, e))] = 1;
    for (int c = 0; c < Corners && sound; ++c)
      for (int d = 0; d < c && sound; ++d)
        if (elements(c, e) == elements(d, e)) {
          defects.push_back({Kind::repeated_corner, e, elements(c, e), 0, Corners});
          sound = 0;
        }
    if (!sound) continue;
    Vector3<double> p[Corners];
    bool readable = true;
    for (int c = 0; c < Corners; ++c) {
      p[c] = points.col(elements(c, e)).template cast<double>();
      readable = readable && finite[static_cast<std::size_t>(elements(c, e))];
    }
    if (!readable) continue;
    if constexpr (Corners == 3) {
      if (double const flat = flatness(p[0], p[1], p[2]); flat <= wanted.tolerance)
        defects.push_back({Kind::no_area, e, -1, flat, 3});
    } else {
      double const flat = flatness(p[0], p[1], p[2], p[3]);
      if (!(std::abs(flat) > wanted.tolerance)) {   // NaN where a length overflows
        defects.push_back({Kind::no_volume, e, -1, flat, 4});
      } else if (flat < 0) {
        Vector3<double> const u = p[1] - p[0], v = p[2] - p[0], w = p[3] - p[0];
        defects.push_back({Kind::inverted, e, -1, u.cross(v).dot(w) / 6, 4});
      } else {
        result.upright[static_cast<std::size_t>(e)] = 1;
      }
    }
  }
  if (wanted.no_unused_points)
    for (int v = 0; v < vertices; ++v)
      if (!used[static_cast<std::size_t>(v)]) defects.push_back({Kind::unused_vertex, v, -1, 0, Corners});
  if (wanted.distinct_points) {
    auto const first = first_close_point(points, wanted.tolerance * median_side(points, elements));
    for (int v = 0; v < vertices; ++v)
      if (int const f = first[static_cast<std::size_t>(v)]; f != v)
        defects.push_back({Kind::duplicate_vertex, v, f,
                           (points.col(v).template cast<double>() - points.col(f).template cast<double>()).norm(), Corners});
  }
  auto const same = first_with_same_corners(elements, [&](int e) { return result.sound[static_cast<std::size_t>(e)] != 0; });
  for (int e = 0; e < static_cast<int>(elements.cols()); ++e)
    if (int const f = same[static_cast<std::size_t>(e)]; f >= 0 && f != e) {
      defects.push_back({Kind::duplicate_element, e, f, 0, Corners});
      result.sound[static_cast<std::size_t>(e)] = 0;
    }
  return result;
}

/// The pieces of a surface, of the triangles in `sound`; named by their smallest vertex, in that order.
template <RealScalar Scalar>
std::vector<Piece> pieces_of(TriangleMesh<Scalar> const& mesh, std::vector<char> const& sound) {
  DisjointSets joined(static_cast<std::size_t>(mesh.points.cols()));
  for (int t = 0; t < static_cast<int>(mesh.triangles.cols()); ++t)
    if (sound[static_cast<std::size_t>(t)])
      for (int c = 1; c < 3; ++c) joined.join(mesh.triangles(0, t), mesh.triangles(c, t));
  std::vector<int> slot(static_cast<std::size_t>(mesh.points.cols()), -1);
  std::vector<Piece> pieces;
  for (int t = 0; t < static_cast<int>(mesh.triangles.cols()); ++t) {
    if (!sound[static_cast<std::size_t>(t)]) continue;
    int const root = joined.find(mesh.triangles(0, t));
    int& s = slot[static_cast<std::size_t>(root)];
    if (s < 0) {
      s = static_cast<int>(pieces.size());
      pieces.emplace_back(root, mesh, root);
    }
    pieces[static_cast<std::size_t>(s)].add(mesh, t);
  }
  std::sort(pieces.begin(), pieces.end(), [](Piece const& a, Piece const& b) { return a.name < b.name; });
  return pieces;
}

inline Piece const& largest_of(std::vector<Piece> const& pieces) {
  return *std::max_element(pieces.begin(), pieces.end(), [](Piece const& a, Piece const& b) { return a.volume < b.volume; });
}

[[noreturn]] inline void throw_defects(std::vector<MeshDefect> const& defects, std::string_view name) {
  constexpr std::size_t shown = 3;
  std::string text = message(name, " has ", defects.size(), defects.size() == 1 ? " defect" : " defects");
  for (std::size_t i = 0; i < std::min(shown, defects.size()); ++i)
    text += message(i == 0 ? ": " : "; ", "(", i + 1, ") ", to_string(defects[i]));
  if (defects.size() > shown) text += message("; and ", defects.size() - shown, " more, `validate` lists them");
  throw InvalidMesh(text);
}

}  // namespace detail

/// Everything that is wrong with a surface, points first, then elements, then how they are joined; empty when it is sound.
/// Never reads outside the arrays, whatever the mesh holds. One cause gives one defect where that can be told.
/// Cost       O(m log m) for m triangles, some 100 bytes of scratch memory per triangle; 1 s for a million.
/// Limits     Does not look for triangles that pass through each other.
template <RealScalar Scalar>
std::vector<MeshDefect> validate(TriangleMesh<Scalar> const& mesh, MeshRequirements const& wanted = {}) {
  using Kind = MeshDefectKind;
  auto checks = detail::check_elements(mesh.points, mesh.triangles, wanted);
  auto& defects = checks.defects;
  auto const sides = detail::sorted_sides(mesh.triangles, [&](int t) { return checks.sound[static_cast<std::size_t>(t)] != 0; });

  // Corners of one vertex are in one fan when a chain of shared edges joins them.
  detail::DisjointSets fans(3 * static_cast<std::size_t>(mesh.triangles.cols()));
  detail::DisjointSets holes(static_cast<std::size_t>(mesh.points.cols()));
  std::vector<std::pair<int, int>> border;
  bool oriented = true;
  detail::for_each_edge(sides, [&](detail::Side const* first, detail::Side const* last) {
    int const a = detail::key_first(first->edge), b = detail::key_second(first->edge);
    auto const corner_at = [&](detail::Side const& s, bool smaller) {
      return s.rising == smaller ? s.corner : s.corner / 3 * 3 + (s.corner + 1) % 3;
    };
    for (auto const* s = first + 1; s < last; ++s) {
      fans.join(corner_at(*first, true), corner_at(*s, true));
      fans.join(corner_at(*first, false), corner_at(*s, false));
    }
    if (last - first == 1) {
      border.emplace_back(a, b);
      holes.join(a, b);
    } else if (last - first > 2) {
      defects.push_back({Kind::non_manifold_edge, a, b, static_cast<double>(last - first), 3});
      oriented = false;
    } else if (first[0].rising == first[1].rising) {
      defects.push_back({Kind::inconsistent_orientation, a, b, 0, 3});
      oriented = false;
    }
  });

  std::vector<int> fan_count(static_cast<std::size_t>(mesh.points.cols()), 0);
  for (auto const& side : sides)
    if (fans.find(side.corner) == side.corner)
      ++fan_count[static_cast<std::size_t>(mesh.triangles(side.corner % 3, side.corner / 3))];
  for (int v = 0; v < static_cast<int>(fan_count.size()); ++v)
    if (int const n = fan_count[static_cast<std::size_t>(v)]; n > 1)
      defects.push_back({Kind::non_manifold_vertex, v, -1, static_cast<double>(n), 3});
  if (!wanted.closed) return std::move(checks.defects);

  std::vector<int> length(static_cast<std::size_t>(mesh.points.cols()), 0);
  for (auto const& edge : border) ++length[static_cast<std::size_t>(holes.find(edge.first))];
  for (int v = 0; v < static_cast<int>(length.size()); ++v)
    if (int const n = length[static_cast<std::size_t>(v)]; n > 0)
      defects.push_back({Kind::open_border, v, -1, static_cast<double>(n), 3});
  if (!border.empty() || !oriented || sides.empty() || !is_finite(mesh.points)) return std::move(checks.defects);
  auto const pieces = detail::pieces_of(mesh, checks.sound);
  for (auto const& piece : pieces)
    if (detail::faces_inward(piece, detail::largest_of(pieces)))
      defects.push_back({Kind::inward, piece.name, -1, piece.volume, 3});
  return std::move(checks.defects);
}

/// Everything that is wrong with a volume; `closed` means nothing here.
/// Limits     Tetrahedra that overlap are found where they share a face, of parts that pass through each other none.
template <RealScalar Scalar>
std::vector<MeshDefect> validate(TetrahedralMesh<Scalar> const& mesh, MeshRequirements const& wanted = {}) {
  auto checks = detail::check_elements(mesh.points, mesh.tetrahedra, wanted);
  detail::for_each_face(mesh.tetrahedra, [&](int t) { return checks.sound[static_cast<std::size_t>(t)] != 0; }, [&](auto const* first, auto const* last) {
    auto const tetrahedron = [](auto const& face) { return static_cast<int>(face.second / 4); };
    int const a = tetrahedron(first[0]), b = tetrahedron(last[-1]);
    if (last - first > 2)
      checks.defects.push_back({MeshDefectKind::non_manifold_face, a, tetrahedron(first[1]), static_cast<double>(last - first), 4});
    else if (a != b && checks.upright[static_cast<std::size_t>(a)] && checks.upright[static_cast<std::size_t>(b)] &&
             detail::rises(mesh.tetrahedra, first[0].second) == detail::rises(mesh.tetrahedra, first[1].second))
      checks.defects.push_back({MeshDefectKind::overlap, b, a, 0, 4});
  });
  return std::move(checks.defects);
}

/// Throws `InvalidMesh` with the first defects and their number, unless the mesh is as wanted. `name` opens the text.
template <detail::SimplexMesh Mesh>
void require_valid(Mesh const& mesh, MeshRequirements const& wanted = {}, std::string_view name = "mesh") {
  if (auto const defects = validate(mesh, wanted); !defects.empty()) detail::throw_defects(defects, name);
}

}  // namespace palpate
