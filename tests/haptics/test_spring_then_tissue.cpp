// SPDX-License-Identifier: MIT
#include <palpate/core/random.hpp>
#include <palpate/force/cutting_force.hpp>
#include <palpate/haptics/spring_then_tissue.hpp>

#include "allocation_trap.hpp"
#include "catch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

using namespace palpate;

namespace {

using Vector = Vector3<double>;

/// Pressing along z at a depth and speed, with a tissue that pushes back.
template <class S = double>
ToolContact<S> pressing(double depth, double speed, double tissue) {
  return {.phase = CuttingPhase::indenting, .depth = S(depth), .velocity = {S(speed), S(0), S(0)}, .tissue_force = {S(0), S(0), S(tissue)}};
}
constexpr double resting = 0.0, moving = 0.1;

}  // namespace

// Yardstick: Hooke's law.
TEMPLATE_TEST_CASE("the first touch is a spring, until the tissue's force is there", "[haptics]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  SpringThenTissue<S> model({.stiffness = 500.0});
  for (int k = 1; k < 300; ++k) {
    double const depth = 0.004 + 0.003 * std::sin(0.05 * k);
    auto contact = pressing<S>(depth, k % 100 < 50 ? resting : moving, 0.0);
    contact.normal = {S(0.6), S(0), S(0.8)};
    CHECK((model(contact) - S(500 * depth) * contact.normal).norm() < S(400) * std::numeric_limits<S>::epsilon());
    CHECK(model.tissue_share() == S(0));
  }
  CHECK(double(model.elastic_energy()) == Approx(250 * std::pow(double(model.elongation()), 2)));
  CHECK(model(pressing<S>(0.0, moving, 0.0)).norm() == S(0));
}

// Yardsticks: w = 1 − e^(−t/τ_a); moving, K d; at rest then F_t + (K d − F_t) e^(−t/τ_f).
TEST_CASE("the tissue comes in beside the spring, and a tool that rests feels the tissue alone") {
  double const depth = 0.006, tissue = 1.2;   // K d = 3 N
  SpringThenTissue<double> model({.stiffness = 500.0, .arrival = 0.05, .fading = 0.2});
  CHECK(model(pressing(depth, moving, 0.0)).z() == Approx(3.0));
  for (int k = 1; k <= 2000; ++k) {
    Vector const force = model(pressing(depth, moving, tissue));
    CHECK(model.tissue_share() == Approx(1 - std::exp(-k * 1e-3 / 0.05)).epsilon(1e-12));
    CHECK(force.z() == Approx(3.0).epsilon(1e-12));   // stiff for who moves on, but not both in full
  }
  double last = 3.0;
  for (int k = 1; k <= 4000; ++k) {
    double const force = model(pressing(depth, resting, tissue)).z();
    CHECK(force == Approx(tissue + (3.0 - tissue) * std::exp(-k * 1e-3 / 0.2)).epsilon(1e-9));
    CHECK(force <= last);
    last = force;
  }
  CHECK(last == Approx(tissue).epsilon(1e-6));

  // A spring that fades at once leaves the mean of both, by share.
  SpringThenTissue<double> quick({.stiffness = 500.0, .arrival = 0.05, .fading = 1e-9});
  for (int k = 1; k <= 300; ++k) {
    double const share = 1 - std::exp(-k * 1e-3 / 0.05);
    CHECK(quick(pressing(depth, resting, tissue)).z() == Approx((1 - share) * 3.0 + share * tissue).epsilon(1e-9));
  }
  // Between v₀ and 2 v₀ it fades at half the rate.
  SpringThenTissue<double> slow({.stiffness = 500.0, .arrival = 1e-9, .fading = 0.2, .rest_speed = 0.004});
  for (int k = 0; k < 100; ++k) slow(pressing(depth, 0.006, 1e-6));
  CHECK(slow.elongation() == Approx(depth * std::exp(-0.5 * 100e-3 / 0.2)).epsilon(1e-6));
}

// Yardstick: by hand.
TEST_CASE("after a rest the spring comes back for what the tool moves on, and lets go where it is drawn back") {
  SpringThenTissue<double> model({.stiffness = 500.0, .arrival = 0.01, .fading = 0.05});
  for (int k = 0; k < 5000; ++k) model(pressing(0.005, resting, 0.8));
  CHECK(model(pressing(0.005, moving, 0.8)).z() == Approx(0.8));
  CHECK(model(pressing(0.006, moving, 0.8)).z() == Approx(0.8 + 0.5));
  CHECK(model(pressing(0.007, moving, 0.8)).z() == Approx(0.8 + 1.0));
  CHECK(model(pressing(0.0065, moving, 0.8)).z() == Approx(0.8 + 0.75));
  CHECK(model(pressing(0.005, moving, 0.8)).z() == Approx(0.8));
  CHECK(model(pressing(0.004, moving, 0.8)).z() == Approx(0.8));   // it never pulls
  CHECK(model(pressing(0.020, moving, 0.8)).z() == Approx(0.8 + 0.016 * 500));
  CHECK(model(pressing(0.021, moving, 0.8)).z() == Approx(0.8 + 0.017 * 500));
  for (double d = 0.021; d > 0.003; d -= 1e-4) model(pressing(d, moving, 0.8));
  CHECK(model(pressing(0.003, moving, 4.0)).z() == Approx(4.0));   // a tissue that pushes more than K d leaves no spring
  CHECK(model.elongation() == 0.0);
}

// Yardstick: the rules of the header, on motions and tissue forces drawn at random.
TEST_CASE("never both at full strength, and no step but those of what it is given") {
  Random random(Seed{11});
  double const stiffness = 400.0, arrival = 0.03, fading = 0.1, h = 1e-3;
  for (int set = 0; set < 200; ++set) {
    SpringThenTissue<double> model({.stiffness = stiffness, .arrival = arrival, .fading = fading});
    double depth = 0.001, tissue = 0.0, held = 0.0, last = 0.0, last_tissue = 0.0, last_depth = 0.0, way = 0.0;
    Vector aside = Vector::Zero();
    int const every = 1 + static_cast<int>(random.uniform(0.0, 20.0)), first = static_cast<int>(random.uniform(0.0, 300.0));
    for (int k = 0; k < 1000; ++k) {
      if (k % 50 == 0) way = random.uniform(0.0, 1.0) < 0.4 ? 0.0 : 1e-4 * random.normal();
      depth = std::clamp(depth + way, 1e-6, 0.01);
      tissue = 300.0 * (1 + 0.5 * std::sin(0.1 * set)) * depth + 0.05 * random.normal();
      if (k >= first && k % every == 0) {
        held = tissue;
        aside = 0.02 * Vector(random.normal(), random.normal(), 0);
      }
      auto contact = pressing(depth, way / h, held);
      contact.tissue_force += aside;
      double const before = model.elongation(), share = model.tissue_share();
      Vector const force = model(contact);
      double const now = force.z();
      CHECK(now <= std::max(stiffness * depth, held) + 1e-12);
      if (held >= 0) CHECK(now >= -1e-12);
      CHECK((Vector(force.x(), force.y(), 0) - model.tissue_share() * aside).norm() < 1e-12);
      CHECK(std::abs(now - last) <= stiffness * std::abs(depth - last_depth) + h / fading * stiffness * (before + std::abs(depth - last_depth)) +
                                        share * std::abs(held - last_tissue) + h / arrival * std::abs(held) + 1e-12);
      CHECK(model.tissue_share() >= share);
      last = now, last_tissue = held, last_depth = depth;
    }
  }
}

// Yardstick: the work of the hand over contacts that begin and end at depth zero, by the trapezoidal rule in steps of a few micrometres. A tissue
// that is stiffer than the spring gives no more than what it holds beyond it.
TEST_CASE("over a whole contact it gives nothing, with an elastic tissue no stiffer than the spring") {
  Random random(Seed{12});
  double const stiffness = 500.0, h = 1e-4;
  auto const least = [&](double ratio, bool bounded) {
    double smallest = 0;
    for (int set = 0; set < 400; ++set) {
      SpringThenTissue<double> model({.stiffness = stiffness, .arrival = 0.01, .fading = 0.02, .rest_speed = 0.005});
      double depth = 0, last = 0, work = 0, way = 0, deepest = 0;
      int const first = static_cast<int>(random.uniform(0.0, 1500.0)), end = 4000;
      for (int k = 0; k < end + 2100; ++k) {
        if (k % 100 == 0) {
          double const kind = random.uniform(0.0, 1.0);   // at rest, slowly, quickly
          way = kind < 0.3 ? 0.0 : kind < 0.6 ? 0.004 * h * random.normal() : 0.08 * h * random.normal();
        }
        double next = std::clamp(depth + way, 0.0, 0.01);
        if (k >= end) next = std::max(depth - 0.05 * h, 0.0);
        double const force = model(pressing(next, (next - depth) / h, k < first ? 0.0 : ratio * stiffness * next + 1e-12)).z();
        work += (force + last) / 2 * (next - depth);
        depth = next, last = force, deepest = std::max(deepest, depth);
      }
      CHECK(depth == 0);
      double const allowed = bounded ? (ratio - 1) * stiffness / 2 * deepest * deepest : 0.0;
      smallest = std::min(smallest, work + allowed);
    }
    return smallest;
  };
  for (double const ratio : {0.1, 0.3, 0.6, 1.0}) {
    CAPTURE(ratio);
    CHECK(least(ratio, false) > -1e-8);   // of some 10 mJ that go in and out
  }
  CHECK(least(2.0, true) > -1e-8);
  CHECK(least(2.0, false) < -1e-4);
}

// Yardstick: the sum of the parts; inside a CuttingForce it takes the place of the default spring.
TEST_CASE("it is a law before the puncture, and forgets the contact where that ends") {
  SpringThenTissue<double> alone({.stiffness = 500.0});
  CuttingForce whole(SpringThenTissue<double>({.stiffness = 500.0}));
  for (int k = 1; k < 100; ++k) {
    auto const contact = pressing(5e-5 * k, 0.05, 0.01 * k);
    CHECK(alone(contact) == whole(contact));
  }
  CHECK(alone.tissue_share() > 0);
  auto over = pressing(0.004, 0.05, 1.0);
  over.phase = CuttingPhase::no_contact;
  CHECK(alone(over) == Vector::Zero());
  CHECK(alone.tissue_share() == 0);
  CHECK(alone(pressing(0.001, 0.05, 0.0)).z() == Approx(0.5));
  over.phase = CuttingPhase::moving;
  CHECK(alone(over) == Vector::Zero());
}

TEST_CASE("malformed options of the first touch are refused, what is no number is not felt, and a tick allocates nothing") {
  double const nan = std::numeric_limits<double>::quiet_NaN();
  using Model = SpringThenTissue<double>;
  CHECK_THROWS_WITH(Model({.stiffness = 0.0}), says(".stiffness is 0 N/m", "above zero"));
  CHECK_THROWS_AS(Model({.arrival = nan}), InvalidArgument);
  CHECK_THROWS_AS(Model({.fading = -1.0}), InvalidArgument);
  CHECK_THROWS_AS(Model({.rest_speed = 0.0}), InvalidArgument);
  Model model({.stiffness = 500.0});
  model(pressing(0.002, moving, 0.0));
  for (auto const& broken : {pressing(nan, moving, 0.5), pressing(0.002, nan, 0.5), pressing(0.002, moving, nan)})
    CHECK(model(broken) == Vector::Zero());
  auto odd = pressing(0.002, moving, 0.5);
  odd.seconds = nan;
  CHECK(model(odd).allFinite());
  CHECK(model(pressing(0.002, moving, 0.5)).z() == Approx(1.0));
  palpate_test::AllocationCount const allocations;
  for (int k = 0; k < 100; ++k) model(pressing(1e-5 * k, moving, 0.1));
  long const counted = allocations.count();
  CHECK(counted == 0);
}
