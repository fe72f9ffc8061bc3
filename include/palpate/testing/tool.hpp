// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/random.hpp>
#include <palpate/core/tool_pose.hpp>
#include <palpate/cutting/concept.hpp>
#include <palpate/testing/violations.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace palpate::testing {

struct ToolChecks {
  int motions = 20;          ///< random ones, each from a place outside to a pose in the body's box, and back
  int ticks = 20;            ///< of each way
  std::uint64_t seed = 1;
};

/// Moves a tool that presses the tissue itself on a copy of a body, at random: where to, how turned, how wide open. What has to hold:
///   every step     press() returns the opposite of all forces that it has applied, and moment(), where the tool has one, their moment about its origin; all is
///                  finite; a copy of tool and body does the same to the bit; contact() is a point of the surface
///   every motion   a pose that is not finite does no harm, whether it throws Error or not; after reset(), where it has one, there is neither contact nor force; after the body
///                  is restored under it contact() is a point of that, and without contact there is no force
/// Errors     InvalidArgument for a body with particles that are nailed or held, whose forces nobody can see, for less than one motion or tick.
/// Cost       every step O(size of the body): take a small one.
template <class C, class Body>
  requires PressesTissue<C, Body>
Violations check_tool(C const& made, Body const& body, ToolChecks const& checks = {}) {
  using palpate::detail::message;
  using Scalar = typename Body::Scalar;
  using Vector = Vector3<Scalar>;
  if (checks.motions < 1 || checks.ticks < 1)
    throw InvalidArgument(message("ToolChecks: .motions is ", checks.motions, " and .ticks is ", checks.ticks, "; give at least 1 of each"));
  for (int i = 0; i < body.size(); ++i)
    if (body.tissue().nailed(i) || body.is_held(i)) throw InvalidArgument(message("check_tool: particle ", i, " is nailed or held; give a body that nothing holds"));
  Violations found;
  int tick = 0;
  auto const tell = [&](auto const&... parts) { found.push_back(message("tick ", tick, ": ", parts...)); };
  Random random{Seed{checks.seed}};
  Scalar const h = std::min(body.guaranteed_stable_step() / 2, Scalar(1e-3)), tolerance = 1000 * std::sqrt(static_cast<Scalar>(body.size())) * std::numeric_limits<Scalar>::epsilon();
  Vector const low = body.positions().rowwise().minCoeff(), high = body.positions().rowwise().maxCoeff();
  Scalar const size = (high - low).norm();

  C tool = made, twin = made;
  Body tissue = body, again = body;
  ToolPose<Scalar> pose;
  auto const check_contact = [&](C const& each, Body const& on) {
    auto const& at = each.contact();
    if (at.touching && (at.triangle < 0 || at.triangle >= on.triangles().cols() || !(std::abs(at.barycentric.sum() - 1) < Scalar(1e-4)) ||
                        !(std::abs(at.normal.norm() - 1) < Scalar(1e-4)) || !std::isfinite(at.depth)))
      tell("contact() is no point of the surface: triangle ", at.triangle, " of ", on.triangles().cols(), ", weights that sum up to ", at.barycentric.sum());
  };
  /// One tick, of one step. False once a law is broken.
  auto const advance = [&] {
    tool.advance(tissue, pose), twin.advance(again, pose);
    check_contact(tool, tissue);
    Matrix3X<Scalar> before(3, tissue.size());
    for (int i = 0; i < tissue.size(); ++i) before.col(i) = tissue.predicted_acceleration(i, h);
    Vector const force = tool.press(tissue, Scalar(1), h);
    bool const same = twin.press(again, Scalar(1), h) == force;
    Vector sum = Vector::Zero(), moment = Vector::Zero();
    Scalar largest = 0;   // N, of what rounds
    for (int i = 0; i < tissue.size(); ++i) {
      Scalar const mass = tissue.tissue().mass(i);
      Vector const after = tissue.predicted_acceleration(i, h), applied = mass * (after - before.col(i));
      sum += applied, moment += (Vector(tissue.positions().col(i)) - pose.position).cross(applied);
      largest += mass * (after.norm() + before.col(i).norm());
    }
    if (!is_finite(force)) tell("press() returns ", force.x(), ", ", force.y(), ", ", force.z(), " N; it must be finite");
    if (!((force + sum).norm() <= tolerance * largest)) tell("press() returns a force that is not opposite to what it has applied: off by ", (force + sum).norm(), " N");
    if constexpr (TellsMoment<C, Body>)
      if (!((tool.moment() + moment).norm() <= tolerance * largest * size)) tell("moment() is not that of what was applied, about the tool's origin: off by ", (tool.moment() + moment).norm(), " N m");
    if (!is_finite(tool.haptic_point())) tell("haptic_point() is not finite");
    if (!tissue.step(h)) tell("the body's step diverges under its forces");
    again.step(h);
    if (!same || tissue.positions() != again.positions()) tell("a copy of the tool does something else to a copy of the body");
    ++tick;
    return found.empty();
  };
  auto const touches = [&](auto const& each) { return each.state() != CuttingPhase::no_contact || each.contact().touching; };
  auto const any = [&](Vector const& from, Vector const& to) {
    Vector at;
    for (int k = 0; k < 3; ++k) at[k] = random.uniform(from[k], to[k]);
    return at;
  };

  for (int motion = 0; motion < checks.motions; ++motion) {
    tissue = body, again = body, tool = made, twin = made;
    Vector const outside = high + Vector::Constant(size) + any(Vector::Zero(), Vector::Constant(size)), inside = any(low, high);
    Eigen::Quaternion<Scalar> turned;
    for (int k = 0; k < 4; ++k) turned.coeffs()[k] = random.uniform(Scalar(-1), Scalar(1));
    pose.orientation = turned.normalized(), pose.opening = random.uniform(Scalar(0), Scalar(1));
    for (int k = 0; k <= 2 * checks.ticks; ++k) {
      Scalar const way = Scalar(checks.ticks - std::abs(k - checks.ticks)) / Scalar(checks.ticks);
      pose.position = outside + way * (inside - outside);
      if (!advance()) return found;
      if (k != checks.ticks) continue;
      for (int rest = 0; rest < 3; ++rest)
        if (!advance()) return found;
      C lost = tool;
      Body other = tissue;
      ToolPose<Scalar> nowhere = pose;
      nowhere.position.y() = std::numeric_limits<Scalar>::quiet_NaN();
      try {
        lost.advance(other, nowhere);
      } catch (Error const&) {
      }
      if (!is_finite(lost.press(other, Scalar(1), h))) tell("after a pose that is not finite the force is not finite");
      if constexpr (ResettableCutter<C, Body>) {
        lost = tool, other = tissue;
        lost.reset(other);
        if constexpr (TellsMoment<C, Body>)
          if (!is_zero(Vector(lost.moment()))) tell("after reset() moment() is not zero");
        if (touches(lost) || !is_zero(lost.press(other, Scalar(1), h))) tell("after reset() the tool still touches");
      }
      lost = tool, other = tissue;
      other.restore(body.save());
      lost.advance(other, pose);
      check_contact(lost, other);
      if (lost.press(other, Scalar(1), h).norm() > 0 && !touches(lost)) tell("after the body is restored under it the tool presses, and there is no contact");
      if (!found.empty()) return found;
    }
  }
  return found;
}

/// For what is no tool of this body: says why.
template <class C, class Body>
Violations check_tool(C const&, Body const&, ToolChecks const& = {}) {
  static_assert(sizeof(palpate::detail::CutterSentences<C, Body>) > 0);
  static_assert(!Cutter<C, Body>, "palpate: the tool does not press; declare: template <class Body> Vector3<Scalar> press(Body& body, Scalar share, Scalar h), which applies its "
                                  "forces and returns the force on the tool, and Vector3<Scalar> const& haptic_point() const.");
  return {};
}

}  // namespace palpate::testing
