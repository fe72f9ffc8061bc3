// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/soft_body.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/material/presets.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/implicit.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/thigh.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/statics/newton_raphson.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/volume/embedded_surface.hpp>
#include <palpate/volume/fill.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace echography {

using Vector = palpate::Vector3<double>;
using Mesh = palpate::TriangleMesh<double>;

/// What lies where at rest, in metres: a thigh of the size that make_thigh has, with a bone round its middle and a vein above that.
namespace anatomy {

constexpr double fat = 0.010, bone = 0.0125, vein = 0.0055;   // thickness below the skin, radii
constexpr double across = -0.006, above = 0.041;              // the vein beside and above the middle of the bone

inline double middle(double z) { return 0.015 - z * z / 1.5; }   // of the thigh, along y
inline double under_skin(Vector const& p) { return 0.0675 + 0.085 * p.z() - std::hypot(p.x(), p.y() - middle(p.z())); }
/// Distance from a line along the thigh that ends at z = ±end, less a radius.
inline double outside(Vector const& p, double x, double up, double end, double radius) {
  return Vector(p.x() - x, p.y() - middle(p.z()) - up, std::max(0.0, std::abs(p.z()) - end)).norm() - radius;
}
inline double outside_vein(Vector const& p) { return outside(p, across, above, 0.09, vein); }
inline double outside_bone(Vector const& p) { return outside(p, 0, 0, 0.10, bone); }

}  // namespace anatomy

/// Adds a surface to others, turned inside out.
inline void append_inward(Mesh& all, Mesh const& more) {
  auto const points = all.points.cols(), triangles = all.triangles.cols();
  all.points.conservativeResize(3, points + more.points.cols()), all.triangles.conservativeResize(3, triangles + more.triangles.cols());
  all.points.rightCols(more.points.cols()) = more.points;
  all.triangles.rightCols(more.triangles.cols()) = more.triangles.array() + static_cast<int>(points);
  all.triangles.row(1).tail(more.triangles.cols()).swap(all.triangles.row(2).tail(more.triangles.cols()));
}

/// A thigh under the flat face of a linear array probe: a nearly incompressible solid of two layers, fat and muscle, round two cavities. The wall of one, the
/// bone, is nailed; the other is a vein whose blood gives way. The tetrahedra are small under the probe and large far away: they fill the thigh drawn together,
/// u = r asinh((p − c)/(s r)), and are drawn apart again.
class Thigh {
  using Tissue = palpate::FiniteElements<double, palpate::StableNeoHookean<double>>;

 public:
  static constexpr double half_width = 0.0215, half_thickness = 0.0085;   // of the face, m

  Mesh skin = palpate::make_thigh<double>({.vertices = 2000});
  Mesh vein = palpate::make_implicit<double>(anatomy::outside_vein, {Vector(-0.03, 0, -0.12), Vector(0.03, 0.08, 0.12)}, 2000);
  Mesh bone = palpate::make_implicit<double>(anatomy::outside_bone, {Vector(-0.03, -0.03, -0.13), Vector(0.03, 0.045, 0.13)}, 800);
  palpate::TetrahedralMesh<double> mesh = filled();

  Thigh() : border_(palpate::surface(mesh)), body_(tissue()), lumen_(vein, mesh) {
    std::vector<char> on_border(static_cast<std::size_t>(mesh.points.cols()), 0);
    for (int const i : border_.triangles.reshaped()) on_border[static_cast<std::size_t>(i)] = 1;
    auto const below = [](auto const& p) { return p.y() > 0.06 && std::abs(p.x()) < half_width && std::abs(p.z()) < half_thickness; };
    for (int const i : palpate::vertices_where(mesh, below))
      if (on_border[static_cast<std::size_t>(i)]) under_probe_.push_back(i), top_ = std::max(top_, mesh.points(1, i));
    face_ = top_;
  }

  /// Brings the face of the probe to `depth` [m] below where it touches. Skin that it meets sticks to it.
  void press(double depth) {
    face_ = top_ - depth;
    palpate::NewtonRaphson<> newton;
    newton.inner.tolerance = 1e-2, newton.tangent = palpate::Tangent::modified;
    for (bool meets_more = true; meets_more;) {
      meets_more = false;
      for (int const i : under_probe_) {
        Vector const p = body_.positions().col(i);
        if (!body_.is_held(i) && p.y() <= face_) continue;
        meets_more = meets_more || !body_.is_held(i);
        body_.drag(i, {p.x(), face_, p.z()});
      }
      body_.solve_statics(newton, 3e-5);
    }
    lumen_.update(body_.positions());
  }

  palpate::Matrix3X<double> positions() const { return body_.positions(); }
  double face() const { return face_; }
  /// N, down.
  double force() const {
    double sum = 0;
    for (int const i : under_probe_)
      if (body_.is_held(i)) sum -= body_.reaction(i).y();
    return sum;
  }
  /// Of the flesh at rest that it has lost.
  double volume_lost() const { return 1 - palpate::volume(Mesh{body_.positions(), border_.triangles}) / palpate::volume(border_); }

  Mesh vein_wall() const { return lumen_.mesh(); }
  /// The wall of the vein in the plane z = 0, from one point to the next.
  using Outline = std::vector<std::pair<Vector, Vector>>;
  Outline outline() const {
    Outline sides;
    Mesh const wall = vein_wall();
    for (auto const& corners : wall.triangles.colwise()) {
      Vector ends[2];
      int crossings = 0;
      for (int k = 0; k < 3; ++k) {
        Vector const a = wall.points.col(corners[k]), b = wall.points.col(corners[(k + 1) % 3]);
        if ((a.z() < 0) != (b.z() < 0)) ends[a.z() < 0] = a + (b - a) * (a.z() / (a.z() - b.z())), ++crossings;
      }
      if (crossings == 2) sides.emplace_back(ends[0], ends[1]);
    }
    return sides;
  }

 private:
  static constexpr double edge = 0.006;   // of the lattice where it is finest, m
  static Vector centre() { return {0, 0.066, 0}; }
  static Eigen::Array3d reach() { return {0.014, 0.015, 0.018}; }
  static Eigen::Array3d scale() { return {1.0, 0.7, 1.7}; }
  static Vector drawn_together(Vector const& p) { return reach() * ((p - centre()).array() / (scale() * reach())).asinh(); }
  static Vector drawn_apart(Vector const& u) { return centre() + Vector(scale() * reach() * (u.array() / reach()).sinh()); }

  palpate::TetrahedralMesh<double> filled() const {
    Mesh walls = skin;
    append_inward(walls, vein), append_inward(walls, bone);
    for (auto p : walls.points.colwise()) p = drawn_together(p);
    auto solid = palpate::fill(walls, {.edge = edge}).mesh;
    for (auto p : solid.points.colwise()) p = drawn_apart(p);
    return solid;
  }

  Tissue tissue() const {
    using palpate::muscle_material, palpate::fat_material;
    Tissue made(mesh, {.density = muscle_material.density, .material = muscle_material, .pressure = palpate::Pressure::nodal});
    std::vector<int> outer;
    for (int t = 0; t < mesh.tetrahedra.cols(); ++t) {
      Vector middle = Vector::Zero();
      for (int const i : mesh.tetrahedra.col(t)) middle += mesh.points.col(i) / 4;
      if (anatomy::under_skin(middle) < anatomy::fat) outer.push_back(t);
    }
    made.set_material(outer, fat_material, fat_material.density);
    made.nail(palpate::thigh_bone(mesh, anatomy::bone + 0.001));
    return made;
  }

  Mesh border_;
  decltype(palpate::SoftBody(std::declval<Tissue>())) body_;
  palpate::EmbeddedSurface<double> lumen_;
  std::vector<int> under_probe_;
  double top_ = 0, face_ = 0;
};

/// From wall to wall on the vertical line at x, less than nothing where the walls have crossed; of the part above y alone.
inline double opening(Thigh::Outline const& outline, double x, double y = -1) {
  double sum = 0;
  for (auto const& [a, b] : outline)
    if ((a.x() < x) != (b.x() < x))
      if (double const at = a.y() + (b.y() - a.y()) * (x - a.x()) / (b.x() - a.x()); at > y) sum += a.x() > b.x() ? at : -at;
  return sum;
}

inline double area(Thigh::Outline const& outline) {
  double twice = 0;
  for (auto const& [a, b] : outline) twice += a.x() * b.y() - a.y() * b.x();
  return twice / 2;
}

}  // namespace echography
