// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/policy.hpp>
#include <palpate/force/concept.hpp>
#include <palpate/haptics/concept.hpp>
#include <palpate/testing/violations.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <numbers>
#include <vector>

namespace palpate::testing {

struct ForceChecks {
  double depth = 0.01;      ///< m, how deep the tool goes
  double speed = 0.05;      ///< m/s, along the surface
  bool turns = true;        ///< force turns with contact; false for noise and for what has a direction of its own in the world
  bool pushes_out = true;   ///< a tool that indents and stands still is never pulled in
};

/// Feels a force model that has felt nothing yet: in from outside, 200 ticks of indenting, 200 of moving along the surface, and out. What has to hold:
///   zero where there is no contact; finite for these contacts and for finite ones that make no sense, 1 m deep at 10 m/s;
///   a copy of the model answers the same to the bit, and so does the model after reset(), where it has one;
///   with `turns` and `pushes_out` what they say, to 1e-9 (double) or 1e-4 (float) of the largest force.
template <RealScalar Scalar = double, class Model>
  requires ForceModel<Model, Scalar>
Violations check_force(Model const& model, ForceChecks const& checks = {}) {
  using palpate::detail::message;
  using Vector = Vector3<Scalar>;
  using Contact = ToolContact<Scalar>;
  Matrix<Scalar, 3, 3> const turn = Eigen::AngleAxis<Scalar>(Scalar(0.7), Vector(1, -2, Scalar(0.5)).normalized()).toRotationMatrix();
  Vector const normal = Vector(1, 2, 3).normalized(), along = Vector(2, -1, 0).normalized();
  std::vector<Contact> session;
  for (int k = 0; k <= 500; ++k) {   // outside, indenting, moving, outside
    auto const depth_at = [&](int tick) { return static_cast<Scalar>(checks.depth * std::sin(std::numbers::pi * (tick - 50) / 400)); };
    Contact c{.depth = depth_at(k), .previous_depth = depth_at(k - 1), .normal = normal};
    c.phase = k < 50 || k > 450 ? CuttingPhase::no_contact : k < 250 ? CuttingPhase::indenting : CuttingPhase::moving;
    c.velocity = (c.previous_depth - c.depth) / c.seconds * normal + (c.phase == CuttingPhase::moving ? static_cast<Scalar>(checks.speed) : Scalar(0)) * along;
    if (c.phase == CuttingPhase::indenting) c.tissue_force = 100 * c.depth * normal;
    session.push_back(c);
  }
  auto const forces = [&](Model& felt, bool turned) {
    std::vector<Vector> all;
    for (Contact c : session) {
      if (turned) c.normal = turn * c.normal, c.velocity = turn * c.velocity, c.tissue_force = turn * c.tissue_force;
      all.push_back(felt(c));
    }
    return all;
  };
  Violations found;
  Model first = model, second = model, third = model, fourth = model;
  auto const felt = forces(first, false), turned = forces(third, true);
  Scalar largest = 0;
  for (std::size_t k = 0; k < felt.size(); ++k) {
    if (!is_finite(felt[k])) return {message("tick ", k, ": the force is not finite")};
    if (session[k].phase == CuttingPhase::no_contact && !is_zero(felt[k])) return {message("tick ", k, ": ", felt[k].norm(), " N without contact; it must be zero")};
    largest = std::max(largest, felt[k].norm());
  }
  if (forces(second, false) != felt) found.push_back("a copy of the model answers the same contacts with other forces");
  if constexpr (Resettable<Model>) {
    second.reset(), fourth.reset();
    if (forces(second, false) != felt || forces(fourth, false) != felt) found.push_back("after reset() the model does not answer as one that has felt nothing");
  }
  Scalar const tolerance = largest * (std::same_as<Scalar, float> ? Scalar(1e-4) : Scalar(1e-9));
  for (std::size_t k = 0; checks.turns && k < felt.size(); ++k)
    if (!((turned[k] - turn * felt[k]).norm() <= tolerance)) {
      found.push_back(message("tick ", k, ": the force does not turn with the contact; for noise, or a direction of its own in the world, say turns = false"));
      break;
    }
  for (int k = 1; k <= 20; ++k)
    for (CuttingPhase const phase : {CuttingPhase::indenting, CuttingPhase::moving}) {
      Model fresh = model;
      Contact still{.phase = phase, .depth = static_cast<Scalar>(checks.depth * k / 20), .normal = normal};
      still.previous_depth = still.depth, still.tissue_force = 100 * still.depth * normal;
      if (Scalar const out = normal.dot(fresh(still)); checks.pushes_out && phase == CuttingPhase::indenting && !(out >= -tolerance))
        found.push_back(message("a tool that stands still ", still.depth, " m deep is pulled in with ", -out, " N"));
      still.depth *= Scalar(1 / checks.depth), still.velocity = Vector(-10, 3, k % 2 == 0 ? 10 : -10);
      if (!is_finite(fresh(still))) found.push_back(message("the force is not finite ", still.depth, " m deep at ", still.velocity.norm(), " m/s"));
    }
  return found;
}

/// For what is no force model: says why.
template <RealScalar Scalar = double, class Model>
Violations check_force(Model const&, ForceChecks const& = {}) {
  static_assert(sizeof(palpate::detail::ForceSentences<Model, Scalar>) > 0);
  static_assert(!RendersForce<Model, Scalar>, "palpate: check_force feels a ForceModel; a force that answers to the surface is tested on a body.");
  return {};
}

}  // namespace palpate::testing
