// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/tool_pose.hpp>
#include <palpate/cutting/concept.hpp>
#include <palpate/testing/cut_invariants.hpp>
#include <palpate/testing/cut_motion.hpp>
#include <palpate/testing/violations.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace palpate::testing {

struct CutterChecks {
  std::vector<Vector3<double>> way = {};   ///< m, corners of the tip's way; the first and the last are outside the tissue
  int ticks = 50;                          ///< from one corner to the next; the body takes a step after each
  bool moves_vertices = false;             ///< see CutChecks: area and first moment may change
};

/// Draws a cutter along a way through a copy of a body. What has to hold:
///   every tick     CutInvariants (mesh, pieces, area, mass, links, search) and CutMotion; contact() is a point of the surface, its normal a unit vector;
///                  a copy of cutter and body does the same to the bit
///   every corner   a tool that stands still stops changing the body, within `ticks` ticks and to rounding; a pose that is not finite changes nothing, whether it throws
///                  Error or not; reset, where it has one, leaves a body that keeps the invariants, and no contact
///   at the end     no contact; where there was one puncture, report() counts the particles and triangles that the body has more
/// Errors     InvalidArgument for a way of fewer than two corners or less than one tick.
/// Cost       every tick O(size of the body): take a small one.
template <class C, class Body>
  requires Cutter<C, Body>
Violations check_cutter(C const& cutter, Body const& body, CutterChecks const& checks) {
  using palpate::detail::message;
  using Scalar = typename Body::Scalar;
  if (checks.way.size() < 2 || checks.ticks < 1)
    throw InvalidArgument(message("CutterChecks: .way has ", checks.way.size(), " corners and .ticks is ", checks.ticks, "; give at least 2 corners and 1 tick"));
  auto const same = [](Body const& a, Body const& b, Scalar share = 0) {   // of the positions, that they may differ by
    return a.size() == b.size() && a.triangles().cols() == b.triangles().cols() && a.triangles() == b.triangles() &&
           (a.positions() - b.positions()).norm() <= share * a.positions().norm() && a.velocities() == b.velocities();
  };
  Violations found;
  int tick = 0, punctures = 0;
  auto const tell = [&](auto const&... parts) { found.push_back(message("tick ", tick, ": ", parts...)); };
  auto const tell_all = [&](Violations const& all) {
    for (auto const& one : all) tell(one);
  };
  C tool = cutter, twin = cutter;
  Body cut = body, again = body;
  CutInvariants<Body> const invariants(body, {.moves_vertices = checks.moves_vertices});
  Scalar const h = std::min(body.guaranteed_stable_step() / 2, Scalar(1e-3));
  ToolPose<Scalar> pose;
  auto const advance = [&] {
    CutMotion<Body> const motion(cut);
    bool const moving = tool.state() == CuttingPhase::moving;
    tool.advance(cut, pose), twin.advance(again, pose);
    punctures += !moving && tool.state() == CuttingPhase::moving ? 1 : 0;
    tell_all(motion.check(cut)), tell_all(invariants.check(cut));
    if (!same(cut, again)) tell("a copy of the cutter does something else to a copy of the body");
    auto const& at = tool.contact();
    if (at.touching && (at.triangle < 0 || at.triangle >= cut.triangles().cols() || !(std::abs(at.barycentric.sum() - 1) < Scalar(1e-4)) ||
                        !(std::abs(at.normal.norm() - 1) < Scalar(1e-4)) || !std::isfinite(at.depth)))
      tell("contact() is no point of the surface: triangle ", at.triangle, " of ", cut.triangles().cols(), ", weights that sum up to ", at.barycentric.sum(),
           ", a normal of length ", at.normal.norm(), ", depth ", at.depth, " m");
    return found.empty();
  };

  if (Scalar const r = tool.tip_radius(); !(r >= 0) || !std::isfinite(r)) tell("tip_radius() is ", r, " m; it must be finite and not negative");
  for (std::size_t corner = 0; corner < checks.way.size(); ++corner) {
    for (int k = corner == 0 ? checks.ticks : 1; k <= checks.ticks; ++k, ++tick) {
      Vector3<double> const to = checks.way[corner], from = corner == 0 ? to : checks.way[corner - 1];
      pose.position = (from + (to - from) * k / checks.ticks).template cast<Scalar>();
      if (!advance()) return found;
      if (corner == 0 && (tool.state() != CuttingPhase::no_contact || !same(cut, body))) tell("outside the tissue the tool touches or changes it");
      cut.step(h), again.step(h);
    }
    int still = 0;
    for (bool changed = true; changed && still < checks.ticks; ++still) {
      Body const before = cut;
      if (!advance()) return found;
      changed = !same(before, cut, 64 * std::numeric_limits<Scalar>::epsilon());
      if (changed && still + 1 == checks.ticks) tell("a tool that stands still goes on changing the body");
    }
    Body other = cut;
    C lost = tool;
    ToolPose<Scalar> nowhere = pose;
    nowhere.position.x() = std::numeric_limits<Scalar>::quiet_NaN();
    try {
      lost.advance(other, nowhere);
    } catch (Error const&) {
    }
    if (!same(cut, other) || lost.state() != tool.state()) tell("a pose that is not finite changes body or state");
    if constexpr (ResettableCutter<C, Body>) {
      other = cut, lost = tool;
      lost.reset(other);
      tell_all(invariants.check(other));
      if (lost.state() != CuttingPhase::no_contact || lost.contact().touching) tell("after reset() the tool still touches");
    }
    if (!found.empty()) return found;
  }
  if (tool.state() != CuttingPhase::no_contact) tell("the way ends outside the tissue, but the state is \"", to_string(tool.state()), "\"");
  auto const particles = cut.size() - body.size();
  auto const triangles = cut.triangles().cols() - body.triangles().cols();
  if (CutReport const& report = tool.report(); punctures == 1 && (report.particles_added != particles || report.triangles_added != triangles))
    tell("report() counts ", report.particles_added, " particles and ", report.triangles_added, " triangles; the body has ", particles, " and ", triangles, " more");
  return found;
}

/// For what is no cutter of this body: says why.
template <class C, class Body>
Violations check_cutter(C const&, Body const&, CutterChecks const&) {
  static_assert(sizeof(palpate::detail::CutterSentences<C, Body>) > 0);
  return {};
}

}  // namespace palpate::testing
