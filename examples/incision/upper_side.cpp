// SPDX-License-Identifier: MIT
#include "upper_side.hpp"

#include <palpate/core/error.hpp>
#include <palpate/mesh/normals.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>

namespace incision {

namespace {

constexpr double nothing = -std::numeric_limits<double>::infinity();

/// The surface seen from above: in a grid of cells, the highest point and the smooth normal there.
class View {
 public:
  View(TriangleMesh<double> const& mesh, Vector const& up)
      : mesh_(mesh), normals_(palpate::vertex_normals(mesh)) {
    axes_.row(2) = up.normalized().transpose();
    axes_.row(0) = Vector(axes_.row(2)).unitOrthogonal().transpose();
    axes_.row(1) = Vector(axes_.row(2)).cross(Vector(axes_.row(0))).transpose();
    local_ = axes_ * mesh.points;
    low_ = local_.rowwise().minCoeff();
    high_ = local_.rowwise().maxCoeff();
    cell_ = std::max(high_.x() - low_.x(), high_.y() - low_.y()) / cells;
    height_.assign(cells * cells, nothing);
    normal_.assign(cells * cells, Vector::Zero());
    for (int t = 0; t < mesh.triangles.cols(); ++t) draw(t);
  }

  struct Hit {
    double height = nothing;
    Vector normal = Vector::Zero();   // in view axes
  };

  /// Within a cell: for searching.
  Hit look(double x, double y) const {
    int const i = int((x - low_.x()) / cell_), j = int((y - low_.y()) / cell_);
    if (x < low_.x() || y < low_.y() || i >= cells || j >= cells) return {};
    auto const at = static_cast<std::size_t>(j * cells + i);
    return {height_[at], normal_[at]};
  }

  /// Exactly: for the path.
  Hit cast(double x, double y) const {
    Hit best;
    for (int t = 0; t < mesh_.triangles.cols(); ++t)
      if (auto const weights = weights_at(t, x, y)) take_higher(t, *weights, best.height, best.normal);
    return best;
  }

  Vector world(double x, double y, double z) const { return axes_.transpose() * Vector(x, y, z); }
  Vector low() const { return low_; }
  Vector high() const { return high_; }

 private:
  static constexpr int cells = 128;

  std::optional<Vector> weights_at(int t, double x, double y) const {
    Eigen::Matrix2d edges;
    Eigen::Vector2d const a = local_.col(mesh_.triangles(0, t)).head<2>();
    edges.col(0) = local_.col(mesh_.triangles(1, t)).head<2>() - a;
    edges.col(1) = local_.col(mesh_.triangles(2, t)).head<2>() - a;
    double const det = edges.determinant();
    if (!(det > 0.0)) return std::nullopt;   // looks down, or is seen from its edge
    Eigen::Vector2d const d = Eigen::Vector2d(x, y) - a;
    double const u = (d.x() * edges(1, 1) - d.y() * edges(0, 1)) / det, v = (edges(0, 0) * d.y() - edges(1, 0) * d.x()) / det;
    if (u < -1e-12 || v < -1e-12 || u + v > 1.0 + 1e-12) return std::nullopt;
    return Vector(1.0 - u - v, u, v);
  }

  void take_higher(int t, Vector const& weights, double& height, Vector& normal) const {
    double z = 0.0;
    Vector n = Vector::Zero();
    for (int k = 0; k < 3; ++k) {
      z += weights[k] * local_(2, mesh_.triangles(k, t));
      n += weights[k] * normals_.col(mesh_.triangles(k, t));
    }
    if (z <= height) return;
    height = z;
    normal = (axes_ * n).normalized();
  }

  void draw(int t) {
    Eigen::Matrix3d corners;
    for (int k = 0; k < 3; ++k) corners.col(k) = local_.col(mesh_.triangles(k, t));
    auto const first = [&](int axis) { return std::max(0, int((corners.row(axis).minCoeff() - low_[axis]) / cell_ - 0.5)); };
    auto const last = [&](int axis) { return std::min(cells - 1, int((corners.row(axis).maxCoeff() - low_[axis]) / cell_ + 0.5)); };
    for (int j = first(1); j <= last(1); ++j)
      for (int i = first(0); i <= last(0); ++i)
        if (auto const weights = weights_at(t, low_.x() + (i + 0.5) * cell_, low_.y() + (j + 0.5) * cell_)) {
          auto const at = static_cast<std::size_t>(j * cells + i);
          take_higher(t, *weights, height_[at], normal_[at]);
        }
  }

  TriangleMesh<double> const& mesh_;
  palpate::Matrix3X<double> normals_, local_;
  Eigen::Matrix3d axes_;
  Vector low_, high_;
  double cell_ = 1.0;
  std::vector<double> height_;
  std::vector<Vector> normal_;
};

/// How well a line from `a` by `way` suits: the least agreement of the normals beside it with their mean; less for a hollow, for a
/// side that does not look up and for the outline's neighbourhood. Below 0: it leaves the surface.
double score_of(View const& view, Eigen::Vector2d const& a, Eigen::Vector2d const& way) {
  constexpr int along = 16;
  double const length = way.norm();
  Eigen::Vector2d const beside(-way.y() / length, way.x() / length);
  std::vector<Vector> normals;
  Vector mean = Vector::Zero();
  std::array<double, 3> heights{};
  for (int i = -2; i <= along + 2; ++i)
    for (double const offset : {-0.3, 0.0, 0.3}) {
      Eigen::Vector2d const p = a + way * (double(i) / along) + beside * (offset * length);
      View::Hit const hit = view.look(p.x(), p.y());
      if (hit.height == nothing) return -1.0;
      if (offset == 0.0 && i == 0) heights[0] = hit.height;
      if (offset == 0.0 && i == along / 2) heights[1] = hit.height;
      if (offset == 0.0 && i == along) heights[2] = hit.height;
      normals.push_back(hit.normal);
      mean += hit.normal;
    }
  mean.normalize();
  double least = 1.0;
  for (Vector const& n : normals) least = std::min(least, n.dot(mean));
  double const sag = (heights[0] + heights[2]) / 2 - heights[1];
  Eigen::Vector2d const middle = a + way / 2, centre = ((view.low() + view.high()) / 2).head<2>();
  double const off_centre = (middle - centre).norm() / (view.high() - view.low()).head<2>().norm();
  return least * (0.6 + 0.4 * mean.z()) - std::max(0.0, sag / length) * 4.0 - 0.3 * off_centre;
}

}  // namespace

double stroke_length(TriangleMesh<double> const& mesh) {
  Vector const extent = mesh.points.rowwise().maxCoeff() - mesh.points.rowwise().minCoeff();
  return std::min(0.06, extent.maxCoeff() / 3.0);
}

SurfaceLine smoothest_line(TriangleMesh<double> const& mesh, Vector const& up, double length) {
  View const view(mesh, up);
  constexpr int places = 24, directions = 12, samples = 60;
  SurfaceLine best;
  Eigen::Vector2d from = Eigen::Vector2d::Zero(), way = from;
  for (int direction = 0; direction < directions; ++direction) {
    double const angle = std::numbers::pi * direction / directions;
    Eigen::Vector2d const d = length * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    for (int j = 0; j < places; ++j)
      for (int i = 0; i < places; ++i) {
        Eigen::Vector2d const share((i + 0.5) / places, (j + 0.5) / places);
        Eigen::Vector2d const middle = view.low().head<2>() + share.cwiseProduct((view.high() - view.low()).head<2>());
        double const score = score_of(view, middle - d / 2, d);
        if (score > best.score) {
          best.score = score;
          from = middle - d / 2;
          way = d;
        }
      }
  }
  if (best.score < 0.0) return best;
  for (int i = 0; i <= samples; ++i) {
    Eigen::Vector2d const p = from + way * (double(i) / samples);
    View::Hit const hit = view.cast(p.x(), p.y());
    if (hit.height == nothing) continue;
    best.points.push_back(view.world(p.x(), p.y(), hit.height));
    best.normals.push_back(view.world(hit.normal.x(), hit.normal.y(), hit.normal.z()));
  }
  return best;
}

Vector upper_direction(TriangleMesh<double> const& mesh, std::string const& name) {
  auto const axis = [](int index, double sign) {
    Vector up = Vector::Zero();
    up[index] = sign;
    return up;
  };
  if (name != "auto") return axis(name.back() - 'x', name.front() == '-' ? -1.0 : 1.0);
  Vector const extent = mesh.points.rowwise().maxCoeff() - mesh.points.rowwise().minCoeff();
  int flattest = 2;
  for (int const index : {1, 0})
    if (extent[index] < extent[flattest]) flattest = index;
  double const length = stroke_length(mesh);
  double const above = smoothest_line(mesh, axis(flattest, 1.0), length).score;
  double const below = smoothest_line(mesh, axis(flattest, -1.0), length).score;
  return axis(flattest, below > above ? -1.0 : 1.0);
}

}  // namespace incision
