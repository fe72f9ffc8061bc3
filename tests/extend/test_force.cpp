// SPDX-License-Identifier: MIT
// A force of one's own needs palpate/extend/force.hpp and nothing else. Yardstick: the battery's laws, and mistakes that break one each.
#include <palpate/extend/force.hpp>

#include "catch.hpp"

#include <palpate/force/cutting_force.hpp>
#include <palpate/force/liver.hpp>
#include <palpate/force/noise.hpp>
#include <palpate/force/tissue_reaction.hpp>

#include <cmath>
#include <limits>

/// A soft wall with viscosity, F = (k d + b d d′) n while the tool indents: the damper grows with the depth, so that the force begins at zero.
struct SoftWall {
  double stiffness = 200;   // N/m
  double damping = 100;     // N·s/m²

  template <palpate::RealScalar S>
  palpate::Vector3<S> operator()(palpate::ToolContact<S> const& contact) const noexcept {
    if (contact.phase != palpate::CuttingPhase::indenting || !(contact.depth > 0)) return palpate::Vector3<S>::Zero();
    S const deeper = -contact.velocity.dot(contact.normal);   // m/s
    S const force = contact.depth * (static_cast<S>(stiffness) + static_cast<S>(damping) * deeper);
    return force > 0 ? palpate::Vector3<S>(force * contact.normal) : palpate::Vector3<S>::Zero();   // a wall does not hold on
  }

  void validate() const {   // optional
    if (!(stiffness > 0) || !(damping >= 0)) throw palpate::InvalidArgument("SoftWall: give a positive .stiffness and a .damping of at least 0");
  }
};
static_assert(palpate::ForceModel<SoftWall, double> && palpate::ForceModel<SoftWall, float> && palpate::Validatable<SoftWall>);

static_assert(!palpate::Resettable<SoftWall> && !palpate::HasOverlay<SoftWall, double> && !palpate::SurfaceForce<SoftWall, double> && !palpate::LimitsStiffness<SoftWall>);

using namespace palpate;

TEMPLATE_TEST_CASE("a force of one's own keeps the laws of forces", "", PALPATE_TEST_SCALARS) {
  CHECK(testing::to_text(testing::check_force<TestType>(SoftWall{})) == "");
  CHECK(testing::to_text(testing::check_force<TestType>(testing::ForceArchetype<TestType>{})) == "");
}

TEMPLATE_TEST_CASE("the forces of the library keep the laws of forces", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  CHECK(testing::to_text(testing::check_force<S>(NoForce{})) == "");
  CHECK(testing::to_text(testing::check_force<S>(TissueReaction{})) == "");
  CHECK(testing::to_text(testing::check_force<S>(CuttingForce(liver_hysteresis<S>()))) == "");
  CuttingForce const noisy(liver_hysteresis<S>(), OrganForce<S>{.coefficient = 1, .wall_normal = {1, 0, 0}}, WhiteGaussianNoise<S>({.snr_db = 30, .seed = 7}));
  CHECK(testing::to_text(testing::check_force<S>(noisy, {.turns = false})) == "");
  CHECK_THAT(testing::to_text(testing::check_force<S>(noisy)), says("does not turn with the contact", "turns = false"));
}

namespace {

using Vector = Vector3<double>;
using Contact = ToolContact<double>;

struct Sticks {
  Vector operator()(Contact const& contact) const noexcept { return Vector::UnitZ() + 0 * contact.normal; }
};
struct Pulls {
  Vector operator()(Contact const& contact) const noexcept { return contact.phase == CuttingPhase::no_contact ? Vector::Zero() : Vector(-contact.depth * contact.normal); }
};
struct Overflows {
  Vector operator()(Contact const& contact) const noexcept { return std::exp(contact.depth > 0 ? 1000 * contact.depth : -std::numeric_limits<double>::infinity()) * contact.normal; }
};
struct Shares {
  int* calls;
  Vector operator()(Contact const& contact) const noexcept { return contact.phase == CuttingPhase::no_contact ? Vector::Zero() : Vector(++*calls * contact.normal); }
};
struct Remembers {
  int calls = 0;
  Vector operator()(Contact const& contact) noexcept { return contact.phase == CuttingPhase::no_contact ? Vector::Zero() : Vector(++calls * contact.normal); }
  void reset() noexcept {}
};
struct RestartsElsewhere {
  int begins = 0;
  Vector3<double> operator()(ToolContact<double> const& contact) noexcept {
    return contact.phase == CuttingPhase::no_contact ? Vector3<double>::Zero() : Vector3<double>((100 + begins) * std::max(contact.depth, 0.0) * contact.normal);
  }
  void reset() noexcept { begins = 1; }
};
struct Restarts : Remembers {
  void reset() noexcept { calls = 0; }
};

}  // namespace

TEST_CASE("a force that is wrong is told so") {
  int calls = 0;
  CHECK_THAT(testing::to_text(testing::check_force(Sticks{})), says("1 N without contact"));
  CHECK_THAT(testing::to_text(testing::check_force(Pulls{})), says("m deep is pulled in with"));
  CHECK_THAT(testing::to_text(testing::check_force(Overflows{})), says("the force is not finite 1 m deep"));
  CHECK_THAT(testing::to_text(testing::check_force(Shares{&calls})), says("a copy of the model answers the same contacts with other forces"));
  CHECK_THAT(testing::to_text(testing::check_force(Remembers{})), says("after reset() the model does not answer as one that has felt nothing"));
  CHECK_THAT(testing::to_text(testing::check_force(RestartsElsewhere{})), says("after reset() the model does not answer as one that has felt nothing"));
  CHECK(testing::to_text(testing::check_force(Restarts{})) == "");
}
