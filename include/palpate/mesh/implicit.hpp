// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/detail/corner_table.hpp>
#include <palpate/mesh/detail/marching.hpp>
#include <palpate/mesh/detail/remesher.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <utility>
#include <vector>

namespace palpate {

/// A smooth function of a point [m], negative inside a body, zero on its surface, positive outside. It need not be a
/// distance, but it must be deterministic and have a gradient on the surface.
template <class Field>
concept ImplicitField = requires(Field const& field, Vector3<double> const& point) {
  { field(point) } -> std::convertible_to<double>;
};

namespace detail {

/// The table as a mesh, vertices numbered ring by ring from the first one and triangles by their smallest vertex: what is
/// near on the surface is near in memory.
template <RealScalar Scalar>
TriangleMesh<Scalar> mesh_in_walking_order(CornerTable const& table) {
  std::vector<int> name(table.points.size(), -1), order;
  order.reserve(table.points.size());
  auto const visit = [&](int v) {
    if (name[static_cast<std::size_t>(v)] >= 0) return;
    name[static_cast<std::size_t>(v)] = static_cast<int>(order.size());
    order.push_back(v);
  };
  std::size_t walked = 0;
  for (int start = 0; start < table.capacity(); ++start) {   // every piece in turn
    visit(start);
    for (; walked < order.size(); ++walked) table.around(order[walked], [&](int side) { visit(table.to(side)); });
  }
  std::vector<std::array<int, 3>> triangles;
  triangles.reserve(static_cast<std::size_t>(table.size()) / 3);
  for (int h = 0; h < table.size(); h += 3) {
    std::array<int, 3> t{name[static_cast<std::size_t>(table.from(h))], name[static_cast<std::size_t>(table.to(h))],
                         name[static_cast<std::size_t>(table.apex(h))]};
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    triangles.push_back(t);
  }
  std::sort(triangles.begin(), triangles.end());

  TriangleMesh<Scalar> mesh;
  mesh.points.resize(3, table.capacity());
  mesh.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
  for (std::size_t i = 0; i < order.size(); ++i)
    mesh.points.col(static_cast<Eigen::Index>(i)) = table.at(order[i]).template cast<Scalar>();
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (int c = 0; c < 3; ++c)
      mesh.triangles(c, static_cast<Eigen::Index>(t)) = triangles[t][static_cast<std::size_t>(c)];
  return mesh;
}

}  // namespace detail

/// The closed surface field = 0 inside a box with exactly `vertices` vertices, so 2·vertices − 4 triangles when it is one
/// piece without handles: manifold, outward, the triangles nearly equilateral and of one size.
/// Units      metres; box in the same frame as the field.
/// Invariant  vertices ≥ 12; field > 0 on the border of the box, < 0 somewhere inside.
/// Cost       some 200 evaluations of the field per vertex; the same input gives the same bytes.
/// Limits     Details thinner than about two edges are lost: ask for more vertices. The topology is the field's own.
template <RealScalar Scalar, ImplicitField Field>
TriangleMesh<Scalar> make_implicit(Field const& field, Eigen::AlignedBox<double, 3> const& box, int vertices) {
  if (vertices < 12 || vertices > 10'000'000)
    throw InvalidArgument(detail::message("an implicit surface of ", vertices, " vertices; give 12 … 10000000"));
  if (box.isEmpty() || !is_finite(box.min()) || !is_finite(box.max()))
    throw InvalidArgument("the box of the implicit surface is empty or not finite; give its two corners in metres");

  Vector3<double> const size = box.sizes();
  double const wanted = std::sqrt(size.x() * size.y() + size.y() * size.z() + size.z() * size.x()) /
                        std::sqrt(static_cast<double>(vertices));
  double const side = std::clamp(wanted, std::cbrt(size.prod() / 1e6), size.minCoeff() / 24);
  detail::Soup soup = detail::march(field, box, side);
  detail::Remesher remesher(detail::CornerTable(std::move(soup.points), soup.triangles), field, size.maxCoeff());
  detail::CornerTable const& table = remesher.run(vertices, 12);
  if (!remesher.faces_outward())
    throw InvalidArgument(detail::message("a surface of ", vertices,
                                          " vertices is too coarse for this shape and folds over; ask for more vertices"));
  return detail::mesh_in_walking_order<Scalar>(table);
}

}  // namespace palpate
