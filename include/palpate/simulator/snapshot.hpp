// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/core/phase.hpp>
#include <palpate/core/tool_pose.hpp>
#include <palpate/core/triple_buffer.hpp>
#include <palpate/tissue/concept.hpp>

#include <cstddef>
#include <span>
#include <type_traits>
#include <vector>

namespace palpate {

/// A tool as a renderer wants it.
template <RealScalar Scalar>
struct ToolSnapshot {
  ToolPose<Scalar> pose{};
  CuttingPhase phase = CuttingPhase::no_contact;
};

template <RealScalar Scalar>
struct BodySnapshot;

/// What draws itself into a snapshot: several bodies.
template <class B>
concept DrawsItself = requires(B const& seen, BodySnapshot<typename B::Scalar>& to) { seen.draw(to); };

/// Where a body of a scene is in a snapshot of all of them.
struct BodyRange {
  std::ptrdiff_t first_point = 0, points = 0, first_triangle = 0, triangles = 0;
};

/// The body as a renderer wants it. `topology_revision` differs from the last snapshot's when triangles changed; while it is the
/// same, only points moved.
/// Shapes     points 3 × n [m], triangles 3 × m.
template <RealScalar Scalar>
struct BodySnapshot {
  double time = 0.0;                 // s of simulated time
  std::size_t topology_revision = 0;
  Matrix3X<Scalar> points;
  Matrix<int, 3, Dynamic> triangles;
  std::vector<char> is_wound;        // of each triangle of a solid or of cubes, whether a cut has made it; of a surface none
  Vector3<Scalar> tip = Vector3<Scalar>::Zero();
  CuttingPhase phase = CuttingPhase::no_contact;
  std::vector<ToolSnapshot<Scalar>> tools;   // of a simulator of several, in their places; tip and phase are those of the first
  std::vector<BodyRange> bodies;             // of a scene, in their order; of one body none

  /// Takes points, and triangles where they have changed.
  template <class Body>
  void draw(Body const& body) {
    auto const had = points.cols();
    body.draw_columns(body.positions(), points);
    if (triangles.cols() == 0 || topology_revision != body.topology_revision() || points.cols() != had) {   // or another body is in its place
      body.draw_triangles(triangles);
      if constexpr (TellsWounds<std::remove_cvref_t<decltype(body.tissue())>>) {
        is_wound.assign(static_cast<std::size_t>(triangles.cols()), 0);
        for (int t = 0; t < body.tissue().surface().triangle_count(); ++t) is_wound[static_cast<std::size_t>(t)] = body.tissue().is_wound(t);
      }
    }
    topology_revision = body.topology_revision();
  }
  /// A scene draws itself: one body behind the other.
  template <DrawsItself Body>
  void draw(Body const& body) {
    body.draw(*this);
  }
};

/// Hands snapshots from the thread that steps the body to one thread that draws. Neither waits for the other.
/// Cost       publish copies the points, and the triangles when they changed; it allocates only when there are others to draw.
template <RealScalar Scalar>
class SnapshotChannel {
 public:
  template <class Body>
  void publish(Body const& body, double time, Vector3<Scalar> const& tip, CuttingPhase phase, std::span<ToolSnapshot<Scalar> const> tools = {}) {
    BodySnapshot<Scalar>& next = buffer_.back();
    next.time = time;
    next.draw(body);
    next.tip = tip;
    next.phase = phase;
    next.tools.assign(tools.begin(), tools.end());
    buffer_.publish();
  }

  /// For the drawing thread: takes the newest snapshot; false if there was none since the last call.
  bool fetch() noexcept { return buffer_.fetch(); }
  /// The snapshot taken last; it stays as it is until the next fetch().
  BodySnapshot<Scalar> const& latest() const noexcept { return buffer_.front(); }

 private:
  TripleBuffer<BodySnapshot<Scalar>> buffer_;
};

}  // namespace palpate
