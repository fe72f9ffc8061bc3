// SPDX-License-Identifier: MIT
#include <palpate/core/random.hpp>
#include <palpate/force/curve_report.hpp>
#include <palpate/force/cutting_force.hpp>
#include <palpate/force/liver.hpp>

#include "catch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

using namespace palpate;

namespace {

/// The thesis's printed table of the 2-5-1 network, typed in a second time: depth in mm.
double printed(double mm, double flag) {
  static double const w_depth[] = {0.1211, 0.3226, -1.2783, -0.6281, -2.4796};
  static double const w_flag[] = {-8.8553, 0.4131, -6.0967, -0.4962, -4.0361};
  static double const w_out[] = {1.4730, 17.1267, -0.0032, -0.0200, 0.0002};
  static double const b[] = {-3.3122, -9.3809, 3.7464, 8.6331, 1.6728};
  double force = 18.6234;
  for (int j = 0; j < 5; ++j) force += w_out[j] * std::tanh(w_depth[j] * mm + w_flag[j] * flag + b[j]);
  return force;
}

/// ∫ (loading − unloading) dd [J] between two depths [mm], from the table, Simpson's rule with steps of half a micrometre.
double printed_loss(double low_mm, double high_mm, bool clipped = false) {
  int const n = 2 * std::max(1, static_cast<int>(std::ceil((high_mm - low_mm) * 1000)));
  double const h = (high_mm - low_mm) / n;
  double sum = 0;
  for (int k = 0; k <= n; ++k) {
    double gap = printed(low_mm + k * h, 0) - printed(low_mm + k * h, 1);
    if (clipped) gap = std::max(gap, 0.0);
    sum += gap * (k == 0 || k == n ? 1 : k % 2 == 1 ? 4 : 2);
  }
  return sum * h / 3 * 1e-3;
}

/// Where the table's branches cross [mm], by bisection.
double printed_crossing(double low, double high) {
  auto const gap = [](double mm) { return printed(mm, 0) - printed(mm, 1); };
  for (int k = 0; k < 60; ++k) {
    double const middle = (low + high) / 2;
    ((gap(middle) > 0) == (gap(low) > 0) ? low : high) = middle;
  }
  return low;
}

}  // namespace

// Yardstick: the printed table, evaluated here at every micrometre.
TEST_CASE("the report of the published hysteresis names its flaw of two millinewtons") {
  auto const report = check_curve(liver_hysteresis<double>(), liver_range<double>(), {.depths = 2284});
  double widest = 0, widest_at = 0, excess = 0, excess_at = 0;
  for (int k = 0; k <= 22830; ++k) {
    double const gap = printed(k * 1e-3, 0) - printed(k * 1e-3, 1);
    if (gap > widest) widest = gap, widest_at = k * 1e-6;
    if (-gap > excess) excess = -gap, excess_at = k * 1e-6;
    if (k > 0) REQUIRE(printed(k * 1e-3, 0) > printed((k - 1) * 1e-3, 0));
    if (k > 0) REQUIRE(printed(k * 1e-3, 1) > printed((k - 1) * 1e-3, 1));
  }
  CHECK(report.is_monotone());
  CHECK(report.has_hysteresis);
  CHECK(report.below_zero.size == 0.0);
  CHECK(report.excess.size == Approx(excess).epsilon(1e-9));
  CHECK(report.excess.size == Approx(0.00205).margin(1e-5));
  CHECK(report.excess.depth == Approx(excess_at).margin(1e-9));
  CHECK(report.widest.size == Approx(widest).epsilon(1e-6));
  CHECK(report.widest.depth == Approx(widest_at).margin(1e-5));

  double const crossing = printed_crossing(1.0, 3.0);
  CHECK(crossing == Approx(1.8).margin(0.05));
  REQUIRE(report.meets.size() == 1);
  CHECK(report.meets[0].low == Approx(crossing * 1e-3).margin(1e-8));
  CHECK(report.meets[0].high == report.meets[0].low);
  CHECK(report.gap_low == Approx(printed(0, 0) - printed(0, 1)).margin(1e-12));
  CHECK(report.gap_high == Approx(printed(22.83, 0) - printed(22.83, 1)).margin(1e-12));

  CHECK_FALSE(report.is_passive());
  CHECK(report.gain.low == 0.0);
  CHECK(report.gain.high == Approx(crossing * 1e-3).margin(1e-5));
  CHECK(report.gain.energy == Approx(-printed_loss(0, crossing)).epsilon(1e-4));
  CHECK(report.lost == Approx(printed_loss(0, 22.83)).epsilon(1e-4));

  // A little beyond, on the tangents, the loop closes: at 22.83 mm.
  auto const longer = check_curve(liver_hysteresis<double>(), DepthRange<double>{0.0, 0.0229});
  REQUIRE(longer.meets.size() == 2);
  CHECK(longer.meets[1].low == Approx(0.02283).margin(5e-6));

  CHECK(to_string(report) ==
        "force curve, 0 … 22.83 mm at 2284 depths\n"
        "  loading rises with depth or rests everywhere\n"
        "  unloading rises with depth or rests everywhere\n"
        "  pushes out of the tissue or is zero everywhere\n"
        "! unloading exceeds loading: up to 0.00205 N, most at 0 mm\n"
        "! a cycle returns more energy than it takes: 0 … 1.81 mm gains 2.284e-06 J, the most of all\n"
        "  whole range: 0.004926 J taken, 0.002268 J of it lost\n"
        "  loop widest: 0.3014 N at 20.22 mm\n"
        "  loading and unloading meet at 1.812 mm; at the ends loading − unloading is -0.00205 and 0.001352 N\n");
}

// Yardstick: all pairs of depths, each cycle integrated by itself.
TEST_CASE("the cycle that gains most is the best of all pairs of depths") {
  Random random(Seed{6});
  for (int round = 0; round < 30; ++round) {
    CAPTURE(round);
    double phase[4], size[4];
    for (int k = 0; k < 4; ++k) phase[k] = random.uniform(0.0, 6.0), size[k] = random.uniform(-1.0, 1.0);
    auto const gap = [&](double d) noexcept {
      double sum = 0;
      for (int k = 0; k < 4; ++k) sum += size[k] * std::sin((k + 1) * 3 * d + phase[k]);
      return sum;
    };
    auto const curve = [&](double d, Phase p) noexcept { return 5 * d + (p == Phase::loading ? gap(d) : 0.0); };
    auto const report = check_curve(curve, DepthRange<double>{1.0, 4.0}, {.depths = 61});
    double best = 0, low = 0, high = 0;
    for (int i = 0; i <= 60; ++i)
      for (int j = i + 1; j <= 60; ++j) {
        double energy = 0;
        for (int k = i; k < j; ++k) energy -= (gap(1 + k * 0.05) + gap(1 + (k + 1) * 0.05)) / 2 * 0.05;
        if (energy > best) best = energy, low = 1 + i * 0.05, high = 1 + j * 0.05;
      }
    CHECK(report.gain.energy == Approx(best).margin(1e-12));
    CHECK(report.is_passive() == !(best > 0));
    if (best > 0) CHECK(report.gain.low == Approx(low));
    if (best > 0) CHECK(report.gain.high == Approx(high));
  }
}

// Yardstick: closed forms. Loading 2 d, unloading 2 d − sin(π d): on 0 … 3 the gap sin(π d) is negative from 1 to 2, ∫ = 2/π a hump.
TEST_CASE("findings of a curve with a loop of sines have their closed forms") {
  auto const curve = [](double d, Phase p) noexcept { return 2 * d - (p == Phase::unloading ? std::sin(std::numbers::pi * d) : 0.0); };
  auto const report = check_curve(curve, DepthRange<double>{0.0, 3.0}, {.depths = 3001, .tolerance = 1e-9});
  CHECK(report.loading_fall.size == 0.0);
  // Unloading falls while π cos(π d) > 2, up to the place where cos(π d) = 2/π again, first from d = 2 − acos(2/π)/π on.
  double const turn = std::acos(2 / std::numbers::pi) / std::numbers::pi;
  auto const unloading = [](double d) { return 2 * d - std::sin(std::numbers::pi * d); };
  CHECK(report.unloading_fall.size == Approx(unloading(2 - turn) - unloading(2 + turn)).epsilon(1e-5));
  CHECK(report.unloading_fall.depth == Approx(2 + turn).margin(1e-3));
  CHECK(report.below_zero.size == Approx(-unloading(turn)).epsilon(1e-5));
  CHECK(report.below_zero.depth == Approx(turn).margin(1e-3));
  CHECK(report.excess.size == Approx(1.0).epsilon(1e-6));
  CHECK(report.excess.depth == Approx(1.5));
  CHECK(report.widest.size == Approx(1.0).epsilon(1e-6));
  CHECK(report.gain.energy == Approx(2 / std::numbers::pi).epsilon(1e-5));
  CHECK(report.gain.low == Approx(1.0).margin(1e-3));
  CHECK(report.gain.high == Approx(2.0).margin(1e-3));
  CHECK(report.taken == Approx(9.0));
  CHECK(report.lost == Approx(2 / std::numbers::pi).epsilon(1e-5));
  REQUIRE(report.meets.size() == 4);
  for (int k = 0; k <= 3; ++k) CHECK(report.meets[std::size_t(k)].low == Approx(k).margin(1e-9));
}

// Yardstick: max(0, d − 1) and half of it: one until 1, apart from there on, and passive.
TEST_CASE("a loop that opens late is closed over a range, and half of loading is passive") {
  auto const curve = [](double d, Phase p) noexcept { return std::max(0.0, d - 1) * (p == Phase::loading ? 1.0 : 0.5); };
  auto const report = check_curve(curve, DepthRange<double>{0.0, 2.0}, {.depths = 201});
  CHECK(report.is_passive());
  CHECK(report.is_monotone());
  CHECK(report.excess.size == 0.0);
  CHECK(report.taken == Approx(0.5));
  CHECK(report.lost == Approx(0.25));
  REQUIRE(report.meets.size() == 1);
  CHECK(report.meets[0].low == 0.0);
  CHECK(report.meets[0].high == Approx(1.0));
  CHECK(to_string(report) ==
        "force curve, 0 … 2000 mm at 201 depths\n"
        "  loading rises with depth or rests everywhere\n"
        "  unloading rises with depth or rests everywhere\n"
        "  pushes out of the tissue or is zero everywhere\n"
        "  unloading never exceeds loading\n"
        "  no cycle returns more energy than it takes\n"
        "  whole range: 0.5 J taken, 0.25 J of it lost\n"
        "  loop widest: 0.5 N at 2000 mm\n"
        "  loading and unloading meet from 0 to 1000 mm; at the ends loading − unloading is 0 and 0.5 N\n");
}

TEMPLATE_TEST_CASE("a curve of depth alone is passive, and rounding is no flaw", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const loading = check_curve(liver_loading<S>());
  CHECK_FALSE(loading.has_hysteresis);
  CHECK(loading.is_passive());
  CHECK(loading.is_monotone());
  CHECK(loading.meets.empty());
  CHECK(loading.lost == S(0));
  auto const both = check_curve(liver_hysteresis<S>());
  CHECK(both.is_monotone());
  CHECK(double(both.excess.size) == Approx(0.00205).margin(2e-5));
  CHECK(both.meets.size() == 1);

  // Yardstick: a parabola upside down falls from 1 to 0 on 1 … 2.
  auto const hill = [](S d) noexcept { return d * (S(2) - d); };
  auto const report = check_curve(hill, DepthRange<S>{S(0), S(2)});
  CHECK(double(report.loading_fall.size) == Approx(1.0));
  CHECK(double(report.loading_fall.depth) == Approx(2.0));
  CHECK(to_string(report) ==
        "force curve, 0 … 2000 mm at 2001 depths, no hysteresis\n"
        "! the curve falls: up to 1 N below a smaller depth, most at 2000 mm\n"
        "  pushes out of the tissue or is zero everywhere\n"
        "  returns all energy: there is one branch\n");
}

// Yardstick: the work that the printed table gives for unloading clipped at loading, faded here by its own formula.
TEST_CASE("a cutting force with the published hysteresis returns no energy, whatever the way") {
  auto const fade = [](double depth) { return depth >= 0.002 ? 1.0 : depth * depth / 4e-6 * (3 - depth / 0.001); };
  Random random(Seed{12});
  for (int round = 0; round < 40; ++round) {
    CAPTURE(round);
    // A closed way of 10 turns, in steps of 2 µm, over the whole range or over the first two millimetres, where the flaw is.
    double const deepest = round % 2 == 0 ? 0.02283 : 0.002;
    std::vector<int> turns;
    for (int k = 0; k < 10; ++k) turns.push_back(static_cast<int>(random.uniform(0.0, deepest) / 2e-6));
    turns.push_back(turns.front());
    CuttingForce force(liver_hysteresis<double>(), CurveJoin<double>{.reversal_depth = 0.0, .puncture_time = 0.0});
    auto const felt = [&](double before, double depth) {
      return force({.phase = CuttingPhase::moving, .depth = depth, .previous_depth = before}).z();
    };
    double lost = 0, expected = 0;
    int last = turns.front();
    for (int const turn : turns) {
      int const way = turn > last ? 1 : -1;
      double const flag = way > 0 ? 0 : 1;
      // The forces along this way at both ends of each step, as a tick that moves on in the same direction gives them.
      for (int k = last; k != turn; k += way) {
        double const a = k * 2e-6, b = (k + way) * 2e-6;
        double const at_a = felt(a - way * 1e-6, a), at_b = felt(a, b);
        double const table_a = flag == 0 ? printed(a * 1e3, 0) : std::min(printed(a * 1e3, 0), printed(a * 1e3, 1));
        double const table_b = flag == 0 ? printed(b * 1e3, 0) : std::min(printed(b * 1e3, 0), printed(b * 1e3, 1));
        lost += (at_a + at_b) / 2 * (b - a);
        expected += (fade(a) * table_a + fade(b) * table_b) / 2 * (b - a);
        if (way < 0) REQUIRE(at_b <= fade(b) * printed(b * 1e3, 0) + 1e-12);
      }
      last = turn;
    }
    CHECK(lost >= -1e-15);
    CHECK(lost == Approx(expected).margin(1e-14));
  }

  // The whole range once, against Simpson's rule from where fading ends.
  double lost = 0;
  CuttingForce force(liver_hysteresis<double>(), CurveJoin<double>{.reversal_depth = 0.0, .puncture_time = 0.0});
  for (int k = 1000; k < 11415; ++k)
    for (int const way : {1, -1}) {
      auto const felt = [&](double from, double to) {
        return force({.phase = CuttingPhase::moving, .depth = to, .previous_depth = from}).z();
      };
      double const low = k * 2e-6, high = low + 2e-6;
      lost += way * 2e-6 * (way > 0 ? felt(low - 1e-6, low) + felt(low, high) : felt(high + 1e-6, high) + felt(high, low)) / 2;
    }
  CHECK(lost == Approx(printed_loss(2.0, 22.83, true)).epsilon(1e-6));
}

TEST_CASE("a check that can not be made says why") {
  auto const line = [](double d) noexcept { return d; };
  CHECK_THROWS_WITH(check_curve(line, DepthRange<double>{0.02, 0.01}), says("the depth range is 0.02 … 0.01 m", "the lower one first"));
  CHECK_THROWS_WITH(check_curve(line, DepthRange<double>{0.0, 1.0}, {.depths = 2}), says(".depths is 2", "three or more"));
  CHECK_THROWS_WITH(check_curve(line, DepthRange<double>{0.0, 1.0}, {.tolerance = -1.0}), says(".tolerance is -1 N", "zero or more"));
  auto const broken = [](double d, Phase p) noexcept { return p == Phase::unloading && d > 0.7 ? std::nan("") : d; };
  CHECK_THROWS_WITH(check_curve(broken, DepthRange<double>{0.0, 1.0}, {.depths = 11}), says("nan N at 0.8 m", "finite"));
}
