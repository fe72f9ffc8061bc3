// SPDX-License-Identifier: MIT
#include "pointer.hpp"

#include <palpate/mesh/normals.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace viewer {

namespace {

struct Hit {
  double distance = std::numeric_limits<double>::infinity();   // along the ray [m]
  Vector normal = Vector::Zero();
};

/// Where the ray meets the surface first, from outside.
Hit first_hit(Mesh const& mesh, palpate::Matrix3X<double> const& normals, Ray const& ray) {
  Hit hit;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    int const i = mesh.triangles(0, t), j = mesh.triangles(1, t), k = mesh.triangles(2, t);
    Vector const a = mesh.points.col(i), u = mesh.points.col(j) - a, v = mesh.points.col(k) - a, normal = u.cross(v);
    double const towards = normal.dot(ray.direction);
    if (!(towards < 0.0)) continue;   // seen from behind
    double const distance = normal.dot(a - ray.origin) / towards;
    if (!(distance > 0.0) || distance >= hit.distance) continue;
    Vector const p = ray.origin + distance * ray.direction - a;
    double const r = normal.dot(p.cross(v)) / normal.squaredNorm(), s = normal.dot(u.cross(p)) / normal.squaredNorm();
    if (r < 0.0 || s < 0.0 || r + s > 1.0) continue;
    hit = {distance, (1.0 - r - s) * normals.col(i) + r * normals.col(j) + s * normals.col(k)};
  }
  return hit;
}

}  // namespace

void Pointer::set_organ(Mesh home) {
  home_ = std::move(home);
  normals_ = palpate::vertex_normals(home_);
}

void Pointer::aim(Ray const& ray, Vector const& ahead) {
  Hit const hit = first_hit(home_, normals_, ray);
  is_on_organ_ = std::isfinite(hit.distance);
  if (is_on_organ_) normal_ = hit.normal.normalized();
  place_ = ray.origin + (is_on_organ_ ? hit.distance : (place_ - ray.origin).dot(ahead) / ray.direction.dot(ahead)) * ray.direction;
}

void Pointer::turn_wheel(int notches) noexcept {
  if (pressed_)
    depth_ = std::clamp(depth_ + 0.001 * notches, 0.0, 0.025);
  else
    height_ = std::clamp(height_ - 0.002 * notches, 0.0, 0.08);
}

HandTarget Pointer::target() const noexcept { return {place_ + (pressed_ ? -depth_ : height_) * normal_, pressed_}; }

}  // namespace viewer
