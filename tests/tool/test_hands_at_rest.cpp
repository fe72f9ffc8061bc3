// SPDX-License-Identifier: MIT
// Three hands at one organ, two hooks and a scalpel: what examples/retraction shows, and that hands at rest feel no vibration: above 30 Hz at most 0.02 N rms, and
// 2 % of the mean. Yardsticks: sines, whose root mean square is known, for the filter; points of the undeformed solid, for what a hook holds.
#include "catch.hpp"

#include "../../examples/retraction/scene.hpp"
#include "../../examples/retraction/vibration.hpp"

#include <palpate/simulator/tick.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <vector>

using namespace palpate;

namespace {

/// A force of sines, of so many Hz and N, at 1 kHz for a second and a bit.
std::vector<Tick> sines(std::vector<std::array<double, 2>> const& parts, std::size_t count = 1100) {
  std::vector<Tick> ticks(count);
  for (std::size_t k = 0; k < count; ++k) {
    ticks[k].time = 1e-3 * static_cast<double>(k);
    ticks[k].force = {0.7, -0.3, 1.1};   // N, what is held
    for (auto const& [hertz, size] : parts) {
      double const phase = 2 * std::numbers::pi * hertz * ticks[k].time;
      ticks[k].force += size * Vector3<double>(0.6 * std::sin(phase), 0.0, 0.8 * std::sin(phase));
    }
  }
  return ticks;
}

/// Where a hook holds the tissue, in the undeformed solid [m].
Vector3<double> held_point(Hook<double> const& hook, retraction::Body const& body) {
  Vector3<double> point = Vector3<double>::Zero();
  auto const corners = body.tissue().surface().corners(hook.held().triangle);
  for (std::size_t k = 0; k < 3; ++k) point += hook.held().barycentric[static_cast<int>(k)] * body.tissue().rest_position(corners[k]);
  return point;
}

}  // namespace

TEST_CASE("What a force holds above 30 Hz is told from what it holds below", "[tool][hands]") {
  auto const rms = [](std::vector<std::array<double, 2>> const& parts) { return retraction::rms_above(sines(parts), 30.0, 1000.0); };
  CHECK(rms({}) < 1e-14);
  CHECK(rms({{40.0, 0.05}}) == Approx(0.05 / std::numbers::sqrt2).epsilon(1e-9));
  CHECK(rms({{20.0, 0.05}}) < 1e-14);   // whole periods
  CHECK(rms({{20.0, 0.5}, {40.0, 0.03}, {250.0, 0.04}}) == Approx(0.05 / std::numbers::sqrt2).epsilon(1e-9));
  CHECK(retraction::rms_above(sines({{500.0 / 1.1, 0.05}}), 30.0, 1000.0) == Approx(0.05 / std::numbers::sqrt2).epsilon(1e-9));
}

TEST_CASE("Two hooks draw an organ apart while a scalpel cuts it, and hands at rest feel no vibration", "[tool][hands]") {
  using namespace retraction;
  Plan const plan{.hook_in = 0.3, .draw_in = 0.3, .touch_in = 0.2, .cut_in = 0.8, .settle = 0.3, .rest = 1.05};
  Organ const organ(plan);
  CHECK(organ.solid.tetrahedra.cols() >= 3000);
  CHECK(organ.solid.tetrahedra.cols() <= 3800);
  auto simulator = make_simulator(plan, organ);
  auto const points = [&] { return std::array{held_point(simulator.tool<0>(), simulator.body()), held_point(simulator.tool<1>(), simulator.body())}; };
  auto const hold = [&] { return simulator.tool<0>().hooked() && simulator.tool<1>().hooked(); };

  simulator.run(plan.drawn());
  REQUIRE(hold());
  auto const held = points();
  bool held_on = true;
  std::array<std::vector<Tick>, 3> felt;
  simulator.run(plan.end() - plan.drawn(), [&](std::span<Tick const> ticks) {
    held_on = held_on && hold();
    if (ticks[0].time >= plan.at_rest())
      for (std::size_t k = 0; k < 3; ++k) felt[k].push_back(ticks[k]);
  });
  CHECK(held_on);
  auto const now = points();
  for (std::size_t k = 0; k < 2; ++k) CHECK((now[k] - held[k]).norm() < 1e-9);   // the same piece of tissue, whatever was cut beside it

  double low = 1, high = -1;   // m, of the wound, undeformed
  auto const& tissue = simulator.body().tissue();
  for (int t = 0; t < tissue.surface().triangle_count(); ++t)
    if (tissue.is_wound(t))
      for (int const corner : tissue.surface().corners(t)) low = std::min(low, tissue.rest_position(corner).x()), high = std::max(high, tissue.rest_position(corner).x());
  CHECK(high - low > 0.02);
  CHECK(simulator.tool<2>().area() > 2e-4);
  CHECK(simulator.tool<2>().state() == CuttingPhase::moving);   // it is in the tissue still
  CHECK(simulator.statistics<0>().body_counts.diverged == 0);

  for (std::size_t k = 0; k < 3; ++k) {
    REQUIRE(felt[k].size() >= 1000);
    Vector3<double> mean = Vector3<double>::Zero(), still = felt[k].front().tip;
    for (Tick const& tick : felt[k]) {
      mean += tick.force / static_cast<double>(felt[k].size());
      REQUIRE(tick.tip == still);   // the hand rests
    }
    double const trembles = rms_above(felt[k], 30.0, 1000.0);
    CAPTURE(k, mean.transpose(), trembles);
    CHECK(mean.norm() > 0.2);
    CHECK(trembles <= 0.02);
    CHECK(trembles <= 0.02 * mean.norm());
  }
}
