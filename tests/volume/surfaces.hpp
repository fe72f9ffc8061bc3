// SPDX-License-Identifier: MIT
#pragma once

#include "mesh/meshes.hpp"

#include <palpate/mesh/heart.hpp>
#include <palpate/mesh/implicit.hpp>
#include <palpate/mesh/organ.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace palpate_test {

inline palpate::TriangleMesh<double> moved(palpate::TriangleMesh<double> mesh, palpate::Vector3<double> const& by) {
  mesh.points.colwise() += by;
  return mesh;
}
inline palpate::TriangleMesh<double> turned_over(palpate::TriangleMesh<double> mesh) {
  mesh.triangles.row(1).swap(mesh.triangles.row(2));
  return mesh;
}
inline palpate::TriangleMesh<double> both(palpate::TriangleMesh<double> const& a, palpate::TriangleMesh<double> const& b) {
  palpate::TriangleMesh<double> all;
  all.points.resize(3, a.points.cols() + b.points.cols());
  all.points << a.points, b.points;
  all.triangles.resize(3, a.triangles.cols() + b.triangles.cols());
  all.triangles << a.triangles, (b.triangles.array() + static_cast<int>(a.points.cols())).matrix();
  return all;
}
/// The triangles for which keep(t) holds.
template <class Keep>
palpate::TriangleMesh<double> only(palpate::TriangleMesh<double> mesh, Keep const& keep) {
  Eigen::Index kept = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t)
    if (keep(static_cast<int>(t))) mesh.triangles.col(kept++) = mesh.triangles.col(t).eval();
  mesh.triangles.conservativeResize(Eigen::NoChange, kept);
  return mesh;
}
/// A box of 12 triangles, outward.
inline palpate::TriangleMesh<double> box(palpate::Vector3<double> const& size) {
  palpate::TriangleMesh<double> mesh;
  mesh.points.resize(3, 8);
  for (int i = 0; i < 8; ++i) mesh.points.col(i) << (i & 1) * size.x(), (i >> 1 & 1) * size.y(), (i >> 2) * size.z();
  mesh.triangles.resize(3, 12);
  mesh.triangles << 0, 0, 4, 4, 0, 0, 2, 2, 0, 0, 1, 1,  //
                    2, 3, 5, 7, 1, 5, 6, 7, 4, 6, 3, 7,  //
                    3, 1, 7, 6, 5, 4, 7, 3, 6, 2, 7, 5;
  return mesh;
}
inline palpate::TriangleMesh<double> as_soup(palpate::TriangleMesh<double> const& mesh) {   // as an STL file has it
  palpate::TriangleMesh<double> soup;
  soup.points.resize(3, 3 * mesh.triangles.cols());
  soup.triangles.resize(3, mesh.triangles.cols());
  for (int t = 0; t < static_cast<int>(mesh.triangles.cols()); ++t)
    for (int c = 0; c < 3; ++c) soup.points.col(3 * t + c) = mesh.points.col(mesh.triangles(c, t)), soup.triangles(c, t) = 3 * t + c;
  return soup;
}
/// Holes, doubled and turned triangles, a stray sheet.
inline palpate::TriangleMesh<double> dirty_scan() {
  auto const whole = palpate::make_organ<double>();
  auto scan = only(whole, [](int t) { return t % 97 != 5 && t % 97 != 6; });
  auto const again = only(whole, [](int t) { return t % 50 == 7; });
  palpate::TriangleMesh<double> sheet;
  sheet.points.resize(3, 3);
  sheet.points << 0.0, 0.02, 0.0, 0.0, 0.0, 0.02, 0.06, 0.07, 0.06;
  sheet.triangles.resize(3, 1);
  sheet.triangles << 0, 1, 2;
  scan = both(both(scan, again), sheet);
  for (Eigen::Index t = 0; t < scan.triangles.cols(); t += 31) std::swap(scan.triangles(0, t), scan.triangles(1, t));
  return as_soup(scan);
}

struct NamedSurface {
  std::string name;
  palpate::TriangleMesh<double> mesh;
  double edge;      // m, to fill with
  bool whole;       // its topology survives
};

/// Ten kinds of surfaces.
inline std::vector<NamedSurface> surfaces() {
  using palpate::make_sphere;
  auto const sphere = make_sphere<double>(0.03, 6);
  auto spiky = make_sphere<double>(0.03, 8);
  for (Eigen::Index i = 0; i < spiky.points.cols(); ++i) {
    palpate::Vector3<double> const n = spiky.points.col(i) / 0.03;
    spiky.points.col(i) *= 1 + 0.4 * std::pow(std::max({std::abs(n.x()), std::abs(n.y()), std::abs(n.z())}), 20);
  }
  return {{"sphere", sphere, 0.006, true},
          {"torus", torus<double>(48, 24, 0.03, 0.01), 0.005, true},
          {"shell with a cavity", both(sphere, turned_over(make_sphere<double>(0.015, 4))), 0.005, true},
          {"organ", palpate::make_organ<double>(), 0.01, true},
          {"heart", palpate::make_heart<double>(), 0.008, true},
          {"dirty scan", dirty_scan(), 0.01, false},
          {"box", box({0.05, 0.03, 0.02}), 0.006, true},
          {"two balls", both(sphere, moved(sphere, {0.08, 0.01, 0})), 0.006, true},
          {"a plate thinner than an edge", box({0.05, 0.05, 0.0045}), 0.006, true},
          {"ball with spikes", spiky, 0.004, true}};
}

}  // namespace palpate_test
