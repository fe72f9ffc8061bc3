// SPDX-License-Identifier: MIT
#include <palpate/force/tissue_reaction.hpp>

#include "catch.hpp"

#include <limits>

using namespace palpate;

static_assert(ForceModel<TissueReaction, float> && ForceModel<TissueReaction, double>);
static_assert(ForceModel<NoForce, float> && ForceModel<NoForce, double>);
static_assert(!ForceCurve<TissueReaction, double>);

TEMPLATE_TEST_CASE("tight coupling hands the tissue's reaction to the hand", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  ToolContact<S> contact{.phase = CuttingPhase::indenting, .depth = S(0.01), .tissue_force = {S(1), S(-2), S(3)}};
  CHECK(TissueReaction{}(contact) == contact.tissue_force);
  CHECK(TissueReaction{.scale = 0.5}(contact) == S(0.5) * contact.tissue_force);
  contact.phase = CuttingPhase::moving;
  CHECK(TissueReaction{}(contact) == contact.tissue_force);
  CHECK(NoForce{}(contact).norm() == S(0));
  contact.phase = CuttingPhase::no_contact;
  CHECK(TissueReaction{}(contact).norm() == S(0));
}

TEST_CASE("a scale that is not finite is refused") {
  CHECK_THROWS_WITH(TissueReaction{.scale = std::numeric_limits<double>::infinity()}.validate(), says(".scale is inf", "finite"));
}
