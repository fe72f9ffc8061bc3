// SPDX-License-Identifier: MIT
#include "organ.hpp"

#include "../organ_file.hpp"

#include <palpate/core/error.hpp>
#include <palpate/core/units.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/organ.hpp>
#include <palpate/mesh/tetrahedra_where.hpp>
#include <palpate/volume/fill.hpp>

#include <algorithm>
#include <cmath>
#include <optional>

namespace palpation {

using palpate::detail::message;

namespace {

/// The highest point of a surface above or below (x, y), with the normal there.
std::optional<Place> top_at(palpate::TriangleMesh<double> const& skin, double x, double y) {
  std::optional<Place> best;
  for (Eigen::Index t = 0; t < skin.triangles.cols(); ++t) {
    Vector const a = skin.points.col(skin.triangles(0, t)), b = skin.points.col(skin.triangles(1, t)), c = skin.points.col(skin.triangles(2, t));
    Vector const n = palpate::triangle_area_vector<double>(a, b, c);
    if (!(n.z() > 0)) continue;
    auto const side = [&](Vector const& p, Vector const& q) { return (q.x() - p.x()) * (y - p.y()) - (q.y() - p.y()) * (x - p.x()); };
    if (side(a, b) < 0 || side(b, c) < 0 || side(c, a) < 0) continue;
    double const z = a.z() - (n.x() * (x - a.x()) + n.y() * (y - a.y())) / n.z();
    if (!best || z > best->point.z()) best = Place{.point = {x, y, z}, .normal = n.normalized()};
  }
  return best;
}

/// What is deeper or wider than the organ is thick presses it flat, and no equilibrium is found.
void check_length(char const* option, double metres, double thickness) {
  palpate::LengthRange const within{.low = 1e-6, .high = thickness};
  if (within.contains(metres)) return;
  throw palpate::InvalidArgument(message(option, " is ", palpate::unlikely_length(metres, "m", within), "; give it in metres, no more than the organ is thick"));
}

}  // namespace

Organ prepare_organ(Options const& options) {
  Organ organ;
  organ.name = options.mesh.empty() ? "the library's liver" : options.mesh.string();
  organ.skin = options.mesh.empty() ? palpate::make_organ<double>() : organ_file::read_organ("palpation", options.mesh, options.unit);
  auto const box = palpate::bounding_box(organ.skin);
  check_length("--depth", options.depth, box.sizes().z());
  check_length("--pad", options.pad, box.sizes().z());
  auto const filling = palpate::fill(organ.skin, {.edge = options.edge});
  if (filling.pieces > 1)
    throw palpate::InvalidMesh(message(organ.name, ": filled with an edge of ", options.edge, " m the organ falls into ", filling.pieces, " pieces; give a smaller --edge"));
  organ.solid = filling.mesh;
  organ.filled = to_string(filling);

  auto const border = palpate::surface(organ.solid);
  auto const normals = palpate::vertex_normals(border);
  for (int i = 0; i < normals.cols(); ++i)
    if (normals.col(i).norm() > 0.5 && normals.col(i).z() < -0.2) organ.held.push_back(i);

  // Along x through the middle, over the half of the length that the organ is roundest in.
  Vector const middle = palpate::centroid(organ.solid);
  double const half = box.sizes().x() / 6;
  for (int k = 0; k < options.places; ++k) {
    double const along = half * (2.0 * k / (options.places - 1) - 1);
    auto place = top_at(border, middle.x() + along, middle.y());
    if (!place) throw palpate::InvalidMesh(message(organ.name, ": the upper side (+z) has no room for a line of ", 2000 * half, " mm along x"));
    place->along = along;
    organ.places.push_back(*place);
  }

  auto const over = *top_at(border, middle.x(), middle.y());
  if (options.nodule.empty()) {
    organ.nodule_radius = 0.008;
    organ.nodule_young = 20 * options.young;
    organ.nodule = over.point - 0.014 * over.normal;
  } else {
    organ.nodule = {options.nodule[0], options.nodule[1], options.nodule[2]};
    organ.nodule_radius = options.nodule[3];
    organ.nodule_young = options.nodule[4];
  }
  organ.hard = palpate::tetrahedra_where(organ.solid, [&](Vector const& centre) { return (centre - organ.nodule).norm() < organ.nodule_radius; });
  if (organ.hard.empty())
    throw palpate::InvalidArgument(message("--nodule: no tetrahedron lies within ", 1000 * organ.nodule_radius, " mm of (", organ.nodule.x(), ", ", organ.nodule.y(), ", ", organ.nodule.z(),
                                           ") m; the organ is between (", box.min().x(), ", ", box.min().y(), ", ", box.min().z(), ") and (", box.max().x(), ", ", box.max().y(), ", ",
                                           box.max().z(), ") m"));
  return organ;
}

}  // namespace palpation
