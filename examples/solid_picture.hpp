// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <initializer_list>

/// What the programs share that draw a solid and its wounds.
namespace drawing {

/// Skin, and flesh turned inside out with vertices of its own: so a picture shows it in the colour of an inside, sharp along the lips.
inline palpate::TriangleMesh<double> solid_picture(palpate::TriangleMesh<double> const& skin, std::initializer_list<palpate::TriangleMesh<double>> flesh) {
  palpate::TriangleMesh<double> mesh = skin;
  for (palpate::TriangleMesh<double> const& part : flesh) {
    Eigen::Index const points = mesh.points.cols(), triangles = mesh.triangles.cols();
    mesh.points.conservativeResize(3, points + part.points.cols());
    mesh.triangles.conservativeResize(3, triangles + part.triangles.cols());
    mesh.points.rightCols(part.points.cols()) = part.points;
    mesh.triangles.rightCols(part.triangles.cols()) = part.triangles.array() + static_cast<int>(points);
    mesh.triangles.rightCols(part.triangles.cols()).row(1).swap(mesh.triangles.rightCols(part.triangles.cols()).row(2));
  }
  return mesh;
}

/// Those triangles of a border that a cut has made, or those that it has not.
template <class Triangles, class IsWound>
palpate::TriangleMesh<double> border_part(palpate::Matrix3X<double> const& points, Triangles const& triangles, IsWound const& is_wound, bool walls) {
  palpate::TriangleMesh<double> part{points, palpate::Matrix<int, 3, palpate::Dynamic>(3, triangles.cols())};
  Eigen::Index kept = 0;
  for (int t = 0; t < triangles.cols(); ++t)
    if (is_wound(t) == walls) part.triangles.col(kept++) = triangles.col(t);
  part.triangles.conservativeResize(3, kept);
  return part;
}

}  // namespace drawing
