// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/closest_point.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/haptics/local_model.hpp>
#include <palpate/haptics/surface_fit.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

namespace palpate {

/// A copy of the triangles around a point of a body, with their velocities: what the fast side of a server needs between two ticks of the body.
/// Shapes     at most `max_vertices` vertices, numbered anew, ring by ring from the touched triangle, and the triangles between them.
/// Cost       `capture` O(vertices²), tens of microseconds; plain storage: copying it allocates nothing.
template <RealScalar S>
class LocalSurface {
 public:
  using Scalar = S;
  static constexpr int max_vertices = 96, max_triangles = 192;
  using Columns = Eigen::Matrix<S, 3, Eigen::Dynamic, Eigen::ColMajor, 3, max_vertices>;

  /// Copies what is around a triangle of the body.
  template <class Body>
  void capture(Body const& body, int triangle) noexcept {
    clear();
    auto const& surface = body.tissue().surface();
    if (triangle < 0 || triangle >= surface.triangle_count()) return;
    vertex_count_ = 0;
    for (int const v : surface.corners(triangle)) static_cast<void>(local(v));
    for (int k = 0; k < vertex_count_; ++k)   // grows as it goes: breadth first
      for (int const t : surface.triangles_at(source_[at(k)])) {
        auto const c = surface.corners(t);
        std::array<int, 3> corners{};
        int place = 0;
        for (int const v : c) corners[at(place++)] = local(v);
        if (*std::min_element(corners.begin(), corners.end()) != k || triangle_count_ == max_triangles) continue;   // no room for a corner; or it was there before
        corners_[at(triangle_count_++)] = corners;
      }
    positions_.resize(3, vertex_count_), velocities_.resize(3, vertex_count_);
    for (int k = 0; k < vertex_count_; ++k) {
      positions_.col(k) = body.positions().col(source_[at(k)]);
      velocities_.col(k) = body.velocities().col(source_[at(k)]);
    }
    link();
  }
  void clear() noexcept {
    vertex_count_ = triangle_count_ = 0;
    positions_.resize(3, 0), velocities_.resize(3, 0);
  }
  bool is_empty() const noexcept { return triangle_count_ == 0; }

  /// Where it is so many seconds later if every vertex goes on as it does.
  void advance(S seconds) noexcept { positions_ += seconds * velocities_; }

  // --- as a body that a SurfaceFit is fitted to ---------------------------------------------------------------------------
  Columns const& positions() const noexcept { return positions_; }
  Columns const& velocities() const noexcept { return velocities_; }
  LocalSurface const& tissue() const noexcept { return *this; }
  LocalSurface const& surface() const noexcept { return *this; }
  int triangle_count() const noexcept { return triangle_count_; }
  std::array<int, 3> const& corners(int t) const noexcept { return corners_[at(t)]; }
  std::span<int const> triangles_at(int v) const noexcept { return {star_.data() + first_[at(v)], at(first_[at(v + 1)] - first_[at(v)])}; }
  int corner_of(int t, int v) const noexcept {
    auto const& c = corners(t);
    return static_cast<int>(std::find(c.begin(), c.end(), v) - c.begin());
  }

  /// The nearest triangle and the barycentric coordinates of the nearest point on it; -1 where it is empty.
  struct Nearest {
    int triangle = -1;
    Vector3<S> barycentric = Vector3<S>::Zero();
  };
  Nearest nearest(Vector3<S> const& p) const noexcept {
    Nearest best;
    S least = std::numeric_limits<S>::infinity();
    for (int t = 0; t < triangle_count_; ++t) {
      auto const& c = corners(t);
      auto const here = closest_point_on_triangle<S>(p, positions_.col(c[0]), positions_.col(c[1]), positions_.col(c[2]));
      if (here.squared_distance < least) least = here.squared_distance, best = {t, here.barycentric};
    }
    return best;
  }

 private:
  static std::size_t at(int k) noexcept { return static_cast<std::size_t>(k); }
  /// Its number here; a new one while there is room, else -1.
  int local(int v) noexcept {
    auto const end = source_.begin() + vertex_count_;
    if (auto const found = std::find(source_.begin(), end, v); found != end) return static_cast<int>(found - source_.begin());
    if (vertex_count_ == max_vertices) return -1;
    source_[at(vertex_count_)] = v;
    return vertex_count_++;
  }
  /// Which triangles meet at each vertex.
  void link() noexcept {
    first_.fill(0);
    for (int t = 0; t < triangle_count_; ++t)
      for (int const v : corners(t)) ++first_[at(v + 1)];
    for (int v = 0; v < vertex_count_; ++v) first_[at(v + 1)] += first_[at(v)];
    auto next = first_;
    for (int t = 0; t < triangle_count_; ++t)
      for (int const v : corners(t)) star_[at(next[at(v)]++)] = t;
  }

  std::array<int, max_vertices> source_{};   // their numbers in the body
  Columns positions_{3, 0}, velocities_{3, 0};
  std::array<std::array<int, 3>, max_triangles> corners_{};
  std::array<int, max_vertices + 1> first_{};
  std::array<int, 3 * max_triangles> star_{};
  int vertex_count_ = 0, triangle_count_ = 0;
};

/// The surface near a moving tool at the fast rate of a server, out of what its slow side captured: the captured triangles go on with their velocities, and plane
/// or ball are fitted anew where the newest tip is nearest to them.
/// Cost       some 10 µs for a full LocalSurface; noexcept, no allocation.
template <RealScalar S>
class SurfaceTracker {
 public:
  explicit SurfaceTracker(SurfaceKind kind = SurfaceKind::ball) : fit_({.curved = kind != SurfaceKind::plane}) {}

  /// For a tip of this radius [m], so many seconds after the capture; the patch is offset by the radius, see SurfacePatch::offset_by for `pressed`, and has this
  /// stiffness [N/m].
  SurfacePatch<S> look(LocalSurface<S> const& captured, Vector3<S> const& tip, S radius, S stiffness, S age, Vector3<S> const& pressed = Vector3<S>::Zero()) noexcept {
    SurfacePatch<S> none;
    if (captured.is_empty() || !(stiffness > S(0)) || !is_finite(tip)) return none;
    near_ = captured;
    if (std::isfinite(age)) near_.advance(std::max(age, S(0)));
    auto const nearest = near_.nearest(Vector3<S>(tip - radius * pressed));
    if (nearest.triangle < 0) return none;
    fit_.fit(near_, nearest.triangle, nearest.barycentric);
    SurfacePatch<S> patch = fit_.patch();
    patch.point.setZero();   // a fit levels out the dent that the tool makes: at the nearest point itself the surface is where it is
    auto const& corners = near_.corners(nearest.triangle);
    for (int k = 0; k < 3; ++k) patch.point += nearest.barycentric[k] * near_.positions().col(corners[static_cast<std::size_t>(k)]);
    patch = patch.offset_by(radius, pressed);
    patch.stiffness = stiffness;
    return patch.valid() ? patch : none;
  }

 private:
  LocalSurface<S> near_{};
  SurfaceFit<S> fit_;
};

}  // namespace palpate
