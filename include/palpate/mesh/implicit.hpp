// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/detail/corner_table.hpp>
#include <palpate/mesh/detail/remesher.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

namespace palpate::detail {

struct Soup {
  std::vector<Vector3<double>> points;
  std::vector<std::array<int, 3>> triangles;
};

/// The surface field = 0 inside a box, by marching tetrahedra on cubes of the given side: closed, manifold, facing the
/// positive side. Its triangles are uneven; `Remesher` evens them. The field is sampled once per grid point.
/// Throws `InvalidArgument` when the field is nowhere negative or the surface reaches the box.
template <class Field>
Soup march(Field const& field, Eigen::AlignedBox<double, 3> const& box, double side) {
  std::array<std::int64_t, 3> n;
  for (int k = 0; k < 3; ++k)
    n[static_cast<std::size_t>(k)] = static_cast<std::int64_t>(box.sizes()[k] / side) + 2;
  auto const place = [&](std::int64_t i, std::int64_t j, std::int64_t k) { return (k * n[1] + j) * n[0] + i; };
  auto const position = [&](std::int64_t p) {
    return Vector3<double>(box.min() + side * Vector3<double>(static_cast<double>(p % n[0]),
                                                              static_cast<double>(p / n[0] % n[1]),
                                                              static_cast<double>(p / n[0] / n[1])));
  };
  std::vector<double> value(static_cast<std::size_t>(n[0] * n[1] * n[2]));
  bool anything = false;
  for (std::int64_t k = 0; k < n[2]; ++k)
    for (std::int64_t j = 0; j < n[1]; ++j)
      for (std::int64_t i = 0; i < n[0]; ++i) {
        std::int64_t const p = place(i, j, k);
        double const f = field(position(p));
        value[static_cast<std::size_t>(p)] = f;
        if (!(f < 0)) continue;
        anything = true;
        if (i == 0 || j == 0 || k == 0 || i + 1 == n[0] || j + 1 == n[1] || k + 1 == n[2])
          throw InvalidArgument("the implicit surface reaches the border of its box; give a larger box");
      }
  if (!anything)
    throw InvalidArgument("the implicit field is nowhere negative in its box: no surface; check its sign and the box");

  // Six tetrahedra per cube around its long diagonal: 0 → one axis → two axes → 7. Neighbouring cubes agree.
  static constexpr int orders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  static constexpr bool even[6] = {true, false, false, true, true, false};
  static constexpr int behind[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};   // outward face opposite a corner
  std::array<std::int64_t, 3> const stride{1, n[0], n[0] * n[1]};
  Soup soup;
  std::unordered_map<std::uint64_t, int> made;
  for (std::int64_t k = 0; k + 1 < n[2]; ++k)
    for (std::int64_t j = 0; j + 1 < n[1]; ++j)
      for (std::int64_t i = 0; i + 1 < n[0]; ++i) {
        std::int64_t const base = place(i, j, k);
        int inside = 0;
        for (int c = 0; c < 8; ++c)
          inside += value[static_cast<std::size_t>(base + (c & 1) + (c >> 1 & 1) * n[0] + (c >> 2) * stride[2])] < 0;
        if (inside == 0 || inside == 8) continue;
        for (int s = 0; s < 6; ++s) {
          std::array<std::int64_t, 4> corner{base, 0, 0, 0};
          for (std::size_t c = 1; c < 4; ++c)
            corner[c] = corner[c - 1] + stride[static_cast<std::size_t>(orders[s][c - 1])];
          if (!even[s]) std::swap(corner[1], corner[2]);
          auto const at = [&](int c) { return value[static_cast<std::size_t>(corner[static_cast<std::size_t>(c)])]; };
          // The crossing of the edge between corner a (inside) and b, in tenths that keep clear of the ends.
          auto const crossing = [&](int a, int b) {
            std::int64_t const p = corner[static_cast<std::size_t>(a)], q = corner[static_cast<std::size_t>(b)];
            std::uint64_t const low = static_cast<std::uint64_t>(std::min(p, q));
            std::int64_t const apart = std::max(p, q) - std::min(p, q);   // one of seven directions in the cube
            std::uint64_t const direction = static_cast<std::uint64_t>(
                apart / stride[2] * 4 + apart % stride[2] / n[0] * 2 + apart % n[0]);
            auto const [found, fresh] = made.try_emplace(low * 8 + direction, static_cast<int>(soup.points.size()));
            if (fresh) {
              double const t = std::clamp(at(a) / (at(a) - at(b)), 0.1, 0.9);
              soup.points.push_back(position(p) + t * (position(q) - position(p)));
            }
            return found->second;
          };
          int in[4], out[4], ins = 0, outs = 0;
          for (int c = 0; c < 4; ++c)
            if (at(c) < 0) in[ins++] = c;
            else out[outs++] = c;
          if (ins == 1 || ins == 3) {
            int const lone = ins == 1 ? in[0] : out[0];
            int v[3];
            for (int c = 0; c < 3; ++c) {
              int const other = behind[lone][c];
              v[c] = ins == 1 ? crossing(lone, other) : crossing(other, lone);
            }
            if (ins == 3) std::swap(v[1], v[2]);
            soup.triangles.push_back({v[0], v[1], v[2]});
          } else if (ins == 2) {
            // in and out are in rising order: (in, out) is an even permutation of the corners unless it is 02|13 or 13|02.
            if ((in[0] == 0 && in[1] == 2) || (in[0] == 1 && in[1] == 3)) std::swap(out[0], out[1]);
            int const a = crossing(in[0], out[0]), b = crossing(in[0], out[1]), c = crossing(in[1], out[1]),
                      d = crossing(in[1], out[0]);
            soup.triangles.push_back({a, b, c});
            soup.triangles.push_back({a, c, d});
          }
        }
      }
  return soup;
}

}  // namespace palpate::detail

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
