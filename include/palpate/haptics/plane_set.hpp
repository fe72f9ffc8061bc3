// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace palpate {

/// A plane that must not be passed: n·x ≥ d. The normal has length one and points to where the tool may be.
template <RealScalar S>
struct ContactPlane {
  Vector3<S> normal = Vector3<S>::UnitZ();
  S offset = S(0);   ///< d [m]

  S distance(Vector3<S> const& point) const noexcept { return normal.dot(point) - offset; }
};

/// Result of a projection on a `PlaneSet`: the nearest point in front of all its planes.
template <RealScalar S>
struct PlaneProjection {
  Vector3<S> point = Vector3<S>::Zero();
  std::array<int, 3> active{-1, -1, -1};   ///< the planes that hold it, the first `count` of them
  std::array<S, 3> multiplier{};           ///< m, how far each of them pushes: point = p + Σ multiplier · normal
  int count = 0;                           ///< 0: the point was in front of all planes already
};

/// A small convex feasible set: up to eight half-spaces from the tissue around the tip, and the projection onto it (active-set quadratic
/// program by enumeration). A wall, an edge, a corner, or the convex side of a curve.
///   project(p):  minimise ½|x − p|² subject to nᵢ·x ≥ dᵢ
/// At the minimum at most three planes push: λ ≥ 0, x = p + Σ λᵢ nᵢ. All sets of one, two and three planes are solved, (N Nᵀ) λ = d − N
/// p; the one without negative λ and without a violated plane is taken. The residual x − p is 1-Lipschitz in p, so a spring from p to x
/// has no step, also where the active planes change.
/// Source     \cite zilles1995, with the conditions of Karush, Kuhn and Tucker checked for all sets at once, instead of one constraint a
///            tick.
/// Invariant  Normals have length one, offsets are finite; checked by `add`.
/// Cost       At most 7 small systems for 3 planes, 92 for 8; noexcept, no allocation: allowed in the servo tick.
/// Limits     Nearly parallel planes (determinant of their 2 × 2 or 3 × 3 system below 1e-9) count one by one. Where no point is in front
///            of all planes, the result is the candidate that violates them least: finite, but with steps.
template <RealScalar S>
class PlaneSet {
 public:
  static constexpr int capacity = 8;

  /// Adds a plane. Throws `InvalidArgument` for a normal that has not length one, an offset that is not finite, and the ninth.
  void add(ContactPlane<S> const& plane) {
    if (try_add(plane)) return;
    if (count_ == capacity) throw InvalidArgument(detail::message("PlaneSet: there are ", capacity, " planes already; keep the nearest ones"));
    if (std::isfinite(plane.offset))
      throw InvalidArgument(detail::message("PlaneSet: the normal is (", plane.normal.x(), ", ", plane.normal.y(), ", ", plane.normal.z(), "); give one of length one"));
    throw InvalidArgument(detail::message("PlaneSet: the offset is ", plane.offset, " m; give a finite number"));
  }
  /// The same without an exception, for the servo tick: returns false and adds nothing where `add` would throw.
  bool try_add(ContactPlane<S> const& plane) noexcept {
    bool const unit = is_finite(plane.normal) && std::abs(plane.normal.norm() - S(1)) < S(1e-4);
    if (count_ == capacity || !unit || !std::isfinite(plane.offset)) return false;
    planes_[static_cast<std::size_t>(count_++)] = plane;
    return true;
  }
  void clear() noexcept { count_ = 0; }
  int count() const noexcept { return count_; }
  ContactPlane<S> const& operator[](int k) const noexcept { return planes_[static_cast<std::size_t>(k)]; }

  PlaneProjection<S> project(Vector3<S> const& p) const noexcept {
    PlaneProjection<S> best{.point = p};
    S least = worst(p);
    if (!(least > S(0))) return best;   // in front of all, or no number
    least = std::numeric_limits<S>::infinity();
    S const scale = reach(p);
    std::array<int, 3> chosen{};
    for (int size = 1; size <= std::min(3, count_); ++size) {
      for_each_set(size, chosen, [&] {
        PlaneProjection<S> candidate{.point = p};
        if (!solve(p, chosen, size, candidate)) return false;
        S const behind = worst(candidate.point);
        if (behind < least) least = behind, best = candidate;
        return !(behind > tolerance * scale);
      });
      if (!(least > tolerance * scale)) break;
    }
    return best;
  }

 private:
  static constexpr S tolerance = std::numeric_limits<S>::epsilon() * S(64);

  /// The largest violation: by how far p is behind the plane that it is farthest behind.
  S worst(Vector3<S> const& p) const noexcept {
    S most = S(0);
    for (int k = 0; k < count_; ++k) most = std::max(most, -(*this)[k].distance(p));
    return most;
  }
  /// The size of the numbers that are subtracted from each other.
  S reach(Vector3<S> const& p) const noexcept {
    S most = p.cwiseAbs().maxCoeff();
    for (int k = 0; k < count_; ++k) most = std::max(most, std::abs((*this)[k].offset));
    return most;
  }

  /// Calls visit for every set of so many planes, in `chosen`, of which the first `given` are chosen, until it returns true.
  template <class Visit>
  bool for_each_set(int size, std::array<int, 3>& chosen, Visit const& visit, int given = 0) const {
    if (given == size || given == 3) return visit();   // never more than three, which gcc can not see
    auto const place = static_cast<std::size_t>(given);
    for (chosen[place] = given > 0 ? chosen[place - 1] + 1 : 0; chosen[place] < count_; ++chosen[place])
      if (for_each_set(size, chosen, visit, given + 1)) return true;
    return false;
  }

  /// The point nearest to p on all of these planes; false where they do not push towards it, or have no point in common. In double: where planes are
  /// nearly parallel, float has no digits left.
  bool solve(Vector3<S> const& p, std::array<int, 3> const& chosen, int size, PlaneProjection<S>& result) const noexcept {
    std::array<Vector3<double>, 3> normal, gram{Vector3<double>::UnitX(), Vector3<double>::UnitY(), Vector3<double>::UnitZ()};
    Vector3<double> lack = Vector3<double>::Zero(), point = p.template cast<double>();
    for (std::size_t i = 0; i < static_cast<std::size_t>(size); ++i) {
      ContactPlane<S> const& plane = (*this)[chosen[i]];
      normal[i] = plane.normal.template cast<double>();
      normal[i] /= normal[i].norm();
      auto const row = static_cast<Eigen::Index>(i);
      lack[row] = double(plane.offset) - normal[i].dot(point);
      for (std::size_t k = 0; k < i; ++k) gram[i][static_cast<Eigen::Index>(k)] = gram[k][row] = normal[i].dot(normal[k]);
    }
    Vector3<double> lambda = lack;
    if (size > 1) {   // by Cramer's rule
      Vector3<double> const across = gram[1].cross(gram[2]);
      double const determinant = gram[0].dot(across);
      if (!(determinant > 1e-9)) return false;
      lambda = Vector3<double>(lack.dot(across), gram[0].dot(lack.cross(gram[2])), gram[0].dot(gram[1].cross(lack))) / determinant;
    }
    for (std::size_t i = 0; i < static_cast<std::size_t>(size); ++i) {
      double const push = lambda[static_cast<Eigen::Index>(i)];
      if (push < 0.0) return false;   // it would pull
      result.active[i] = chosen[i];
      result.multiplier[i] = S(push);
      point += push * normal[i];
    }
    result.point = point.template cast<S>();
    result.count = size;
    return true;
  }

  std::array<ContactPlane<S>, capacity> planes_{};
  int count_ = 0;
};

}  // namespace palpate
