// SPDX-License-Identifier: MIT
#include <palpate/force/indentation_spring.hpp>

#include "catch.hpp"

#include <limits>

using namespace palpate;

static_assert(ForceModel<IndentationSpring<float>, float> && ForceModel<IndentationSpring<double>, double>);

// Yardstick: the thesis's liver datum, 3 N at 18 mm.
TEMPLATE_TEST_CASE("the default spring reaches 3 N at 18 mm and acts while indenting only", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  IndentationSpring<S> const spring;
  ToolContact<S> contact{.phase = CuttingPhase::indenting, .depth = S(0.018), .normal = {S(0), S(0.6), S(0.8)}};
  CHECK(double(spring.stiffness) == Approx(167).margin(0.4));
  CHECK(double(spring(contact).norm()) == Approx(3.0).epsilon(1e-6));
  CHECK(double(spring(contact).dot(contact.normal)) == Approx(3.0).epsilon(1e-6));
  contact.depth = S(-0.001);
  CHECK(spring(contact).norm() == S(0));
  contact.depth = S(0.018);
  contact.phase = CuttingPhase::moving;
  CHECK(spring(contact).norm() == S(0));
  contact.phase = CuttingPhase::no_contact;
  CHECK(spring(contact).norm() == S(0));
}

TEST_CASE("a spring that pulls in is refused") {
  CHECK_THROWS_WITH((IndentationSpring<double>{.stiffness = -1.0}.validate()), says(".stiffness is -1 N/m", "zero or more"));
  CHECK_THROWS_AS((IndentationSpring<double>{.stiffness = std::numeric_limits<double>::infinity()}.validate()), InvalidArgument);
  CHECK_NOTHROW((IndentationSpring<double>{.stiffness = 0.0}.validate()));
}
