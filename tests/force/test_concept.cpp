// SPDX-License-Identifier: MIT
#include <palpate/force/concept.hpp>

#include "catch.hpp"

#include <string_view>

using namespace palpate;

namespace {

// The least that satisfies each concept, and one mistake each.
struct Curve {
  float operator()(float) noexcept { return 0.0f; }
};
struct Hysteresis {
  double operator()(double, Phase) noexcept { return 0.0; }
};
struct Throwing {
  double operator()(double) { return 0.0; }
};
struct Model {
  Vector3<double> operator()(ToolContact<double> const&) noexcept { return {0.0, 0.0, 0.0}; }
};
struct ScalarModel {
  double operator()(ToolContact<double> const&) noexcept { return 0.0; }
};
struct Noise {
  Vector3<double> draw(Vector3<double> const&) noexcept { return {0.0, 0.0, 0.0}; }
};

}  // namespace

static_assert(DepthCurve<Curve, float> && ForceCurve<Curve, float> && !HysteresisCurve<Curve, float>);
static_assert(HysteresisCurve<Hysteresis, double> && ForceCurve<Hysteresis, double> && !DepthCurve<Hysteresis, double>);
static_assert(!ForceCurve<Throwing, double>);
static_assert(ForceModel<Model, double> && !ForceModel<Model, float> && !ForceCurve<Model, double>);
static_assert(!ForceModel<ScalarModel, double> && !ForceModel<Curve, float>);
static_assert(ForceNoise<Noise, double> && !ForceNoise<Model, double> && !ForceNoise<Noise, float>);

TEST_CASE("a contact starts outside the tissue, at rest") {
  ToolContact<double> const contact;
  CHECK(contact.phase == CuttingPhase::no_contact);
  CHECK(contact.depth == 0.0);
  CHECK(contact.previous_depth == 0.0);
  CHECK(contact.normal == Vector3<double>(0, 0, 1));
  CHECK(contact.velocity.norm() == 0.0);
  CHECK(contact.tissue_force.norm() == 0.0);
}

TEST_CASE("the branches have names") {
  CHECK(std::string_view(to_string(Phase::loading)) == "loading");
  CHECK(std::string_view(to_string(Phase::unloading)) == "unloading");
}
