// SPDX-License-Identifier: MIT
// A tool slides at v over a ball of tissue of radius R, d below its surface, and the surface comes a frame late: what the hand feels when it comes.
// Yardsticks: a plane is off by s²/2R at s from where it touches, so a new one gives a jump of 3 K (v τ)²/2R along the normal and K d v τ/R from its
// turn; the values of both together, computed once by an independent program, in the table.
#include "catch.hpp"

#include <palpate/haptics/passivity.hpp>
#include <palpate/haptics/patch_handover.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>

using namespace palpate;

namespace {

constexpr double slide_stiffness = 500.0, slide_radius = 0.02;

struct Felt {
  double jump = 0;    // N, from a patch and the next one, at the same tip
  double step = 0;    // N, the largest in a tick
  double later = 0;   // N, the same from the third frame on
  double error = 0;   // N, from the ball's own force
};

/// One tick a millisecond; a patch is taken where the tip is now and is there a frame later.
Felt slide(double speed, int frame, bool curved, int blend, double deep = 0.001) {
  PatchHandover<double> handover({.ticks = blend});
  auto const normal = [&](int tick) {
    double const angle = std::max(0, tick) * 0.001 * speed / (slide_radius - deep);
    return Vector3<double>(std::sin(angle), 0, std::cos(angle));
  };
  auto const surface = [&](int tick) {
    return SurfacePatch<double>{.point = slide_radius * normal(tick), .normal = normal(tick), .curvature = curved ? 1 / slide_radius : 0.0,
        .stiffness = slide_stiffness};
  };
  Felt felt;
  SurfacePatch<double> last;
  Vector3<double> force = Vector3<double>::Zero();
  std::uint64_t sequence = 0;
  for (int tick = -5 * frame; tick < 8 * frame; ++tick) {   // it rests until 0
    Vector3<double> const tip = (slide_radius - deep) * normal(tick);
    if (tick % frame == 0) handover.take(surface(tick - frame), ++sequence, tip);
    auto const now = handover(tip);
    Vector3<double> const pulls = now.force(tip);
    if (tick > 0) {
      felt.jump = std::max(felt.jump, (pulls - last.force(tip)).norm());
      felt.step = std::max(felt.step, (pulls - force).norm());
      if (tick > 3 * frame) felt.later = std::max(felt.later, (pulls - force).norm());
      felt.error = std::max(felt.error, (last.force(tip) - slide_stiffness * deep * normal(tick)).norm());
    }
    last = now;
    force = pulls;
  }
  return felt;
}

}  // namespace

TEST_CASE("C4-L1 C4-L3: the jump of a late plane, the step that is left of it with a hand-over, and a ball's are those of the table", "[haptics]") {
  struct Row {
    double speed;
    int rate;
    double jump, blended, ball, error;
  };
  for (Row const& row : {
           Row{0.05, 30, 0.118, 0.0043, 0.0013, 0.175}, Row{0.05, 60, 0.035, 0.0021, 0.0013, 0.058},    //
           Row{0.10, 30, 0.446, 0.0170, 0.0026, 0.627}, Row{0.10, 60, 0.116, 0.0085, 0.0026, 0.174},    //
           Row{0.10, 120, 0.034, 0.0042, 0.0026, 0.057}, Row{0.10, 240, 0.012, 0.0029, 0.0026, 0.023},   //
       }) {
    int const frame = 1000 / row.rate;
    auto const plane = slide(row.speed, frame, false, 1), blended = slide(row.speed, frame, false, frame);
    auto const ball = slide(row.speed, frame, true, frame);
    INFO("v " << row.speed << " m/s, " << row.rate << " Hz: jump " << plane.jump << ", step with a hand-over " << blended.step
              << ", then " << blended.later << ", ball " << ball.step << ", error " << plane.error);
    CHECK(plane.jump == Approx(row.jump).epsilon(0.1));
    CHECK(blended.step == Approx(row.blended).epsilon(0.1));
    CHECK(ball.step == Approx(row.ball).epsilon(0.1));
    CHECK(plane.error == Approx(row.error).epsilon(0.1));
    CHECK(blended.later <= blended.step);
    CHECK(ball.error <= 1e-12);
    CHECK(ball.jump <= 1e-12);
  }
}

TEST_CASE("C4-L2: the jump of a late plane grows with the square of the delay", "[haptics]") {
  auto const order = [](double deep) { return std::log2(slide(0.1, 32, false, 1, deep).jump / slide(0.1, 16, false, 1, deep).jump); };
  CHECK(order(1e-3) == Approx(1.9).margin(0.1));    // the plane's turn is of first order
  CHECK(order(1e-6) == Approx(2.0).margin(0.02));   // without it
  double const way = 0.1 * 0.008;
  CHECK(slide(0.1, 8, false, 1, 1e-6).jump == Approx(3 * slide_stiffness * way * way / (2 * slide_radius)).epsilon(0.02));
}

// Yardstick: the spring's energy, ½ K (d₂² − d₁²) = 0.75 mJ, which comes from nowhere when the surface rises under the tip.
TEST_CASE("C4-L7: a plane that rises under the tip gives the hand energy, which the observer finds, and the step is shared by the ticks", "[haptics]") {
  for (int const ticks : {1, 33}) {
    PatchHandover<double> handover({.ticks = ticks});
    PassivityController<double> observer({.max_damping = 0.0});
    std::uint64_t sequence = 0;
    double largest = 0, height = 0.0005;
    Vector3<double> last = Vector3<double>::Zero();
    auto const tick = [&] {
      Vector3<double> const tip(0, 0, height), force = handover(tip).force(tip);
      observer(tip, force);
      observer.sent(force);
      largest = std::max(largest, (force - last).norm());
      last = force;
    };
    handover.take({.stiffness = 500}, ++sequence, {0, 0, height});
    for (; height > -0.001; height -= 1e-7) tick();
    CHECK(observer.energy() == Approx(0.5 * 500 * 1e-6).epsilon(1e-3));
    handover.take({.point = {0, 0, 0.001}, .stiffness = 500}, ++sequence, {0, 0, height});
    largest = 0;
    for (int k = 0; k < 40; ++k) tick();
    CHECK(largest == Approx(0.5 / ticks).epsilon(5e-3));
    CHECK(last.z() == Approx(1.0).epsilon(1e-3));
    for (; height < 0.0015; height += 1e-7) tick();
    CHECK(observer.energy() == Approx(-0.75e-3).epsilon(1e-3));
  }
}
