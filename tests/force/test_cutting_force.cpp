// SPDX-License-Identifier: MIT
#include <palpate/core/random.hpp>
#include <palpate/force/cutting_force.hpp>
#include <palpate/force/exponential_contact.hpp>
#include <palpate/force/hunt_crossley_contact.hpp>
#include <palpate/force/liver.hpp>
#include <palpate/force/noise.hpp>
#include <palpate/force/organ_force.hpp>
#include <palpate/force/polynomial_contact.hpp>
#include <palpate/force/tissue_reaction.hpp>

#include "allocation_trap.hpp"
#include "catch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>
#include <vector>

using namespace palpate;

namespace {

template <RealScalar S>
ToolContact<S> cut_from(S previous, S depth) {
  return {.phase = CuttingPhase::moving, .depth = depth, .previous_depth = previous};
}

// The least that each kind of part must offer.
struct LeastCurve {
  double operator()(double) noexcept { return 1.0; }
};
struct LeastModel {
  Vector3<double> operator()(ToolContact<double> const&) noexcept { return {1.0, 0.0, 0.0}; }
};
struct LeastNoise {
  Vector3<double> draw(Vector3<double> const& force) noexcept { return 0.5 * force; }
};

}  // namespace

static_assert(ForceModel<CuttingForce<NetworkCurve<Network<double, 2, 5, 1>>>, double>);
static_assert(ForceModel<CuttingForce<NetworkCurve<Network<float, 2, 5, 1>>>, float>);
static_assert(ForceModel<CuttingForce<>, double>);
static_assert(ForceModel<CuttingForce<LeastCurve, LeastModel, LeastNoise>, double>);
static_assert(std::is_same_v<CuttingForce<OrganForce<float>, TissueReaction>::Scalar, float>);
static_assert(std::is_same_v<CuttingForce<TissueReaction, WhiteGaussianNoise<float>>::Scalar, float>);
static_assert(std::is_same_v<CuttingForce<LeastCurve>::Scalar, double>);

// Yardstick: the parts' own formulas, added here by hand.
TEMPLATE_TEST_CASE("the cutting force is spring before the puncture, curve and organ after it", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const curve = liver_hysteresis<S>();
  CuttingForce force(curve, OrganForce<S>{.coefficient = S(2), .wall_normal = {S(1), S(0), S(0)}});
  STATIC_REQUIRE(std::is_same_v<typename decltype(force)::Scalar, S>);
  double const tight = 100 * double(std::numeric_limits<S>::epsilon());

  ToolContact<S> contact{.phase = CuttingPhase::no_contact, .depth = S(0.01), .velocity = {S(1), S(0), S(0)}};
  CHECK(force(contact).norm() == S(0));

  contact.phase = CuttingPhase::indenting;
  contact.normal = {S(0), S(0.6), S(0.8)};
  CHECK(double((force(contact) - S(3.0 / 0.018 * 0.01) * contact.normal).norm()) < tight);

  contact.phase = CuttingPhase::moving;   // going deeper
  contact.depth = S(0.012);
  contact.previous_depth = S(0.011);
  contact.velocity = {S(0.02), S(0), S(-0.01)};
  Vector3<S> const organ(S(-2 * 0.012 * 0.02), S(0), S(0));
  for (int tick = 0; tick < 5; ++tick) force(contact);   // the drop at the puncture
  CHECK(double((force(contact) - curve(S(0.012), Phase::loading) * contact.normal - organ).norm()) < tight);
  CHECK(force(contact).dot(contact.normal) > S(0));

  contact.previous_depth = S(0.013);   // coming back
  CHECK(double((force(contact) - curve(S(0.012), Phase::unloading) * contact.normal - organ).norm()) < tight);
  contact.previous_depth = S(0.012);   // resting: not larger than before
  CHECK(double((force(contact) - curve(S(0.012), Phase::unloading) * contact.normal - organ).norm()) < tight);
}

TEST_CASE("the order of the parts does not matter") {
  auto const curve = liver_hysteresis<double>();
  OrganForce<double> const organ{.coefficient = 5.0};
  WhiteGaussianNoise<double> const noise({.snr_db = 10.0, .seed = 3});
  CuttingForce a(curve, organ, noise);
  CuttingForce b(noise, organ, curve);
  for (int i = 0; i < 100; ++i) {
    auto contact = cut_from(0.010, 0.010 + 1e-5 * i);
    contact.velocity = {0.1, 0.0, 0.0};
    CHECK((a(contact) - b(contact)).norm() < 1e-15);
  }
}

// The published pair crosses twice: unloading exceeds loading below 1.8 mm and beyond 22.83 mm.
TEMPLATE_TEST_CASE("coming back never pushes harder than going in, and nothing pushes at the surface", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  CuttingForce force(liver_hysteresis<S>(), CurveJoin<S>{.reversal_depth = S(0)});
  S last_in = S(0);
  S last_back = S(0);
  for (int i = 0; i <= 30000; ++i) {
    S const depth = S(i) * S(1e-6);
    S const in = force(cut_from<S>(depth - S(1e-5), depth)).z();
    S const back = force(cut_from<S>(depth + S(1e-5), depth)).z();
    REQUIRE(back <= in);
    REQUIRE(back >= S(0));
    // No step: 1 µm changes the force by less than its steepest slope, 513 N/m beyond the range for loading.
    REQUIRE(std::abs(in - last_in) < S(600e-6));
    REQUIRE(std::abs(back - last_back) < S(850e-6));
    last_in = in;
    last_back = back;
  }
  CHECK(force(cut_from<S>(S(-1), S(0))).norm() == S(0));
  CHECK(force(cut_from<S>(S(1), S(0))).norm() == S(0));
  CHECK(force(cut_from<S>(S(0), S(-0.001))).norm() == S(0));
}

TEST_CASE("below the fade depth the published curve is unchanged") {
  auto const curve = liver_hysteresis<double>();
  CuttingForce force(curve, CurveJoin<double>{.reversal_depth = 0.0});
  for (int i = 0; i <= 2083; ++i) {
    double const depth = 0.002 + i * 1e-5;
    REQUIRE(force(cut_from(depth - 1e-4, depth)).z() == curve(depth, Phase::loading));
    REQUIRE(force(cut_from(depth + 1e-4, depth)).z() == std::min(curve(depth, Phase::loading), curve(depth, Phase::unloading)));
  }
  // Yardstick: s(1/2) = 1/2 for the cubic s(t) = t² (3 − 2t).
  CHECK(force(cut_from(0.0009, 0.001)).z() == Approx(0.5 * curve(0.001, Phase::loading)).epsilon(1e-12));
  CuttingForce sudden(curve, CurveJoin<double>{.fade_depth = 0.0});
  CHECK(sudden(cut_from(0.0, 1e-9)).z() == curve(1e-9, Phase::loading));
}

TEST_CASE("with a reversal depth the force changes over from loading to unloading without a step") {
  auto const curve = liver_hysteresis<double>();
  CuttingForce force(curve);
  double const tick = 1e-5;
  double depth = 0.0195;
  double last = force(cut_from(depth - tick, depth)).z();
  CHECK(last == curve(depth, Phase::loading));
  auto const go = [&](double to) {
    double largest = 0;
    while (std::abs(to - depth) > tick / 2) {
      double const next = depth + (to > depth ? tick : -tick);
      double const now = force(cut_from(depth, next)).z();
      largest = std::max(largest, std::abs(now - last));
      depth = next;
      last = now;
    }
    return largest;
  };
  CHECK(go(0.0202) < 0.01);
  CHECK(last == Approx(curve(depth, Phase::loading)).epsilon(1e-12));
  CHECK(go(0.0197) < 0.01);                          // halfway over; the loop is 0.30 N wide here
  double const halfway = (curve(depth, Phase::loading) + curve(depth, Phase::unloading)) / 2;
  CHECK(last == Approx(halfway).epsilon(1e-9));
  CHECK(force(cut_from(depth, depth)).z() == last);   // at rest nothing changes
  CHECK(go(0.0190) < 0.01);
  CHECK(last == Approx(curve(depth, Phase::unloading)).epsilon(1e-12));

  // The next stroke starts on the loading curve.
  force(ToolContact<double>{});
  CHECK(force(cut_from(depth, depth)).z() == curve(depth, Phase::loading));
}

// Yardstick: dissipation by definition, the work ∮ F dd of the hand over closed ways; and the bound |ΔF| ≤ (steepest slope + widest loop / reversal
// depth) |Δd|, both of the published weights: 850 N/m at the end of the range, 0.302 N.
TEMPLATE_TEST_CASE("tremor, reloading and reversals within the loop: no step, and every closed way in depth takes energy", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  Random random(Seed{5});
  CuttingForce force(liver_hysteresis<S>());
  for (int way = 0; way < 200; ++way) {
    force.reset();
    std::vector<S> corners{random.uniform(S(0), S(0.0228))};
    S const reach = way % 2 == 0 ? S(0.02) : S(0.0015);   // over the loop, and within what a reversal takes
    for (int k = 0; k < 8; ++k) corners.push_back(std::clamp(corners[0] + random.uniform(-reach, reach), S(0), S(0.0228)));
    corners.push_back(corners[0]);
    S depth = corners[0], last = force(cut_from<S>(S(0), depth)).z();
    double work = 0, distance = 0;
    auto const pass = [&] {
      for (S const corner : corners) {
        int const ticks = std::max(1, static_cast<int>(std::ceil(std::abs(corner - depth) / S(2e-5))));
        S const from = depth;
        for (int t = 1; t <= ticks; ++t) {
          S const next = t == ticks ? corner : from + (corner - from) * S(t) / S(ticks);
          S const now = force(cut_from<S>(depth, next)).z();
          REQUIRE(std::abs(now - last) <= S(850 + 302) * std::abs(next - depth) + S(1e-6));
          work += double(now + last) / 2 * double(next - depth);
          distance += std::abs(double(next - depth));
          depth = next, last = now;
        }
      }
    };
    pass();   // a first round, after which the state of the loop is one of the way itself
    work = distance = 0;
    pass();
    REQUIRE(work >= -1e-6 * 0.9 * distance);   // the trapezium's error; 0.9 N is the largest force
  }
}

// Yardstick: the work of the hand over a whole contact, −Σ F·Δx: touch, puncture, and out again while the force at the puncture has not passed. And no
// force is left at the surface.
TEMPLATE_TEST_CASE("a tool that is pulled back at once after the puncture gets no more than it has put in", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const contact_work = [](auto force, S punctured, S speed) {
    S depth = S(0), last = S(0);
    double work = 0;
    auto const go = [&](CuttingPhase phase, S to) {
      S const way = to > depth ? speed * S(0.001) : -speed * S(0.001);
      while (depth != to) {
        S const next = std::abs(to - depth) < std::abs(way) ? to : depth + way;
        S const now = force(ToolContact<S>{.phase = phase, .depth = next, .previous_depth = depth, .velocity = {S(0), S(0), -way * S(1000)}}).z();
        work += double(last + now) / 2 * double(next - depth);
        depth = next, last = now;
      }
    };
    go(CuttingPhase::indenting, punctured);
    go(CuttingPhase::moving, punctured + S(1e-5));
    go(CuttingPhase::moving, S(0));
    CHECK(std::abs(last) < S(1e-6));
    return work;
  };
  for (S const punctured : {S(0.002), S(0.005), S(0.018)})
    for (S const speed : {S(0.05), S(0.3), S(1)}) {
      CAPTURE(punctured, speed);
      CHECK(contact_work(CuttingForce(liver_hysteresis<S>()), punctured, speed) > -1e-5);
      CHECK(contact_work(CuttingForce(liver_hysteresis<S>(), ExponentialContact<S>{.scale = S(0.001), .rate = S(1500), .largest_depth = S(0.004)}), punctured, speed) > -1e-5);
      CHECK(contact_work(CuttingForce(PolynomialContact<S>{.cubic = S(1e6)}, CurveJoin<S>{.puncture_time = S(0.1)}), punctured, speed) > -1e-5);
      CHECK(contact_work(CuttingForce(HuntCrossleyContact<S>{.stiffness = S(900), .damping = S(3)}), punctured, speed) > -1e-5);
    }
  // A curve f that is above F_p g(d) = k d near the surface: the hand gets back at most the larger of the two, f²/(2k) more than k d takes.
  auto const flat = [](S) noexcept { return S(0.45); };
  double least = 0;
  for (S const speed : {S(0.05), S(0.1), S(0.2), S(0.5)}) {
    double const work = contact_work(CuttingForce(IndentationSpring<S>{.stiffness = S(100)}, flat, CurveJoin<S>{.puncture_time = S(0.1)}), S(0.01), speed);
    CHECK(work > -0.45 * 0.45 / (2 * 100));
    least = std::min(least, work);
  }
  CHECK(least < -1e-4);   // although from 10 mm on f alone gives back less than k d has taken
}

// Yardstick: Σ ΔF·v Δt, the noise taken as the difference to the same force without it.
TEST_CASE("what the noise gives the hand is booked apart") {
  CuttingForce quiet(liver_hysteresis<double>());
  CuttingForce force(liver_hysteresis<double>(), WhiteGaussianNoise<double>({.snr_db = 20.0, .seed = 3}));
  CHECK(force.noise_energy() == 0.0);
  double energy = 0, depth = 0.005;
  for (int k = 0; k < 2000; ++k) {
    double const next = 0.012 + 0.007 * std::cos(0.01 * k + 3.14);
    auto contact = cut_from(depth, next);
    contact.velocity = {0.0, 0.0, (depth - next) / contact.seconds};
    energy += (force(contact) - quiet(contact)).dot(contact.velocity) * contact.seconds;
    depth = next;
  }
  CHECK(std::abs(energy) > 1e-9);
  CHECK(force.noise_energy() == Approx(energy).epsilon(1e-9));
  CHECK(quiet.noise_energy() == 0.0);
  force.reset();
  CHECK(force.noise_energy() == 0.0);
}

TEST_CASE("at the puncture the force drops over its time, by the smooth step, and not at once") {
  // Yardstick: spring 167 N/m · 10 mm before, the published curve after, s(t) = t² (3 − 2t) by hand at each millisecond.
  double const before = 0.01 * 3.0 / 0.018, after = liver_loading<double>()(0.01);
  CuttingForce force(liver_loading<double>());
  ToolContact<double> contact{.phase = CuttingPhase::indenting, .depth = 0.01, .previous_depth = 0.0099};
  CHECK(force(contact).z() == Approx(before));
  contact.phase = CuttingPhase::moving;
  double last = before;
  for (int ms = 1; ms <= 8; ++ms) {
    CAPTURE(ms);
    double const t = std::min(1.0, ms / 5.0), share = 1 - t * t * (3 - 2 * t);
    double const now = force(contact).z();
    CHECK(now == Approx(share * before + (1 - share) * after));
    CHECK(last - now <= 0.2965 * (before - after));   // the steepest of the five
    last = now;
  }
  CHECK(last == Approx(after));
  // Ten times as many ticks in as many milliseconds; then lifted in the middle of it: nothing is left in the next contact.
  contact.phase = CuttingPhase::indenting;
  force(contact);
  contact.phase = CuttingPhase::moving, contact.seconds = 1e-4;
  for (int tick = 1; tick < 25; ++tick) force(contact);
  CHECK(force(contact).z() == Approx((before + after) / 2));
  force(ToolContact<double>{});
  CHECK(force(contact).z() == Approx(after));
  contact.seconds = std::numeric_limits<double>::quiet_NaN();
  CHECK(force(contact).z() == Approx(after));
  CuttingForce sudden(liver_loading<double>(), CurveJoin<double>{.puncture_time = 0.0});
  contact.phase = CuttingPhase::indenting;
  sudden(contact);
  contact.phase = CuttingPhase::moving;
  CHECK(sudden(contact).z() == Approx(after));
}

// Yardstick: the formula of docs/forces.md, "Joins", with each law's work W in closed form; the code sums it tick by tick.
TEST_CASE("the force after the puncture is that of docs/forces.md, also where the tool comes back") {
  auto const curve = liver_loading<double>();
  constexpr double d_p = 0.01, time = 0.05, tick = 0.001;
  auto const smooth = [](double t) { return t <= 0 ? 0.0 : t >= 1 ? 1.0 : t * t * (3 - 2 * t); };
  // Presses to d_p in `ticks` ticks, punctures, goes 0.5 mm deeper and comes back out.
  auto const agrees = [&](auto law, double f_p, double n, int ticks) {
    CAPTURE(f_p, n);
    CuttingForce force(curve, law, CurveJoin<double>{.puncture_time = time});
    for (int k = 1; k <= ticks; ++k)
      force(ToolContact<double>{.phase = CuttingPhase::indenting, .depth = d_p * k / ticks, .previous_depth = d_p * (k - 1) / ticks, .seconds = tick});
    double depth = d_p;
    for (int k = 1; k <= 45; ++k) {
      double const next = k <= 5 ? depth + 1e-4 : depth - 3e-4;
      double const now = force(ToolContact<double>{.phase = CuttingPhase::moving, .depth = next, .previous_depth = depth, .seconds = tick}).z();
      depth = next;
      double const g = depth > 0 ? std::pow(std::min(1.0, depth / d_p), n) : 0.0;
      double const after = depth > 0 ? smooth(depth / 0.002) * curve(depth) : 0.0;
      CAPTURE(k, depth);
      CHECK(now == Approx(f_p * g + smooth(k * tick / time) * (after - f_p * g)).epsilon(1e-5).margin(1e-9));
    }
    CHECK(depth < 0);
  };
  agrees(IndentationSpring<double>{.stiffness = 200.0}, 2.0, 1.0, 2000);
  agrees(PolynomialContact<double>{.quadratic = 2e4}, 2.0, 2.0, 2000);
  agrees(PolynomialContact<double>{.cubic = 2e6}, 2.0, 3.0, 2000);
  double const a = 0.02, b = 500.0, f_p = a * std::expm1(b * d_p), work = a * (std::expm1(b * d_p) / b - d_p);
  agrees(ExponentialContact<double>{.scale = a, .rate = b}, f_p, f_p * d_p / work - 1, 2000);
  agrees(PolynomialContact<double>{.cubic = 2e6}, 2.0, 1.0, 1);   // one tick: the trapezium has W = F_p d_p / 2
  // The work is F_p d_p / 200, as the force rises in the last two-hundredth of the way: n is at its upper bound.
  agrees(ExponentialContact<double>{.scale = 2 / std::expm1(200.0), .rate = 200.0 / d_p, .largest_depth = d_p}, 2.0, 63.0, 2000);
}

TEST_CASE("noise acts after the puncture only, with the asked ratio, and is the same in every run") {
  auto const curve = liver_hysteresis<double>();
  CuttingForce quiet(curve);
  CuttingForce force(curve, WhiteGaussianNoise<double>({.snr_db = 30.0, .seed = 7}));
  ToolContact<double> before{.phase = CuttingPhase::indenting, .depth = 0.005, .previous_depth = 0.004};
  for (int i = 0; i < 10; ++i) CHECK(force(before) == quiet(before));
  CHECK(force(ToolContact<double>{}).norm() == 0.0);
  CHECK(quiet(ToolContact<double>{}).norm() == 0.0);

  auto const contact = cut_from(0.011, 0.012);
  double const signal = quiet(contact).z();
  double disturbance = 0;
  constexpr int n = 100000;
  double const first = force(contact).z();
  for (int i = 0; i < n; ++i) disturbance += std::pow(force(contact).z() - signal, 2) / n;
  CHECK(20 * std::log10(signal) - 10 * std::log10(disturbance) == Approx(30.0).margin(0.2));
  force.reset();
  CHECK(force(contact).z() == first);
}

TEST_CASE("noise is relative to the sum of all noiseless parts") {
  CuttingForce force(LeastNoise{}, LeastCurve{}, LeastModel{}, LeastNoise{}, CurveJoin<double>{.fade_depth = 0.0});
  // Curve 1 N along z and model 1 N along x, each noise adds half of their sum.
  CHECK((force(cut_from(0.0, 0.01)) - Vector3<double>(2.0, 0.0, 2.0)).norm() < 1e-15);
}

TEST_CASE("the indentation spring and the coupling are replaceable") {
  ToolContact<double> contact{.phase = CuttingPhase::indenting, .depth = 0.01, .tissue_force = {0.1, 0.2, 0.3}};
  CuttingForce stiff(liver_loading<double>(), IndentationSpring<double>{.stiffness = 500.0});
  CHECK(stiff(contact).z() == Approx(5.0));
  CuttingForce tight(TissueReaction{}, IndentationSpring<double>{.stiffness = 0.0});
  CHECK(tight(contact) == contact.tissue_force);
  CuttingForce plain(liver_loading<double>());
  CHECK(plain(contact).z() == Approx(0.01 * 3.0 / 0.018));
  contact.phase = CuttingPhase::moving;
  for (int tick = 0; tick < 5; ++tick) plain(contact);
  CHECK(plain(contact).z() == Approx(liver_loading<double>()(0.01)));
  CHECK(CuttingForce()(contact).norm() == 0.0);
}

TEST_CASE("functions of one's own are parts") {
  auto const line = [](double depth) noexcept { return 10.0 * depth; };
  auto const side = [](ToolContact<double> const& contact) noexcept { return Vector3<double>(contact.depth, 0.0, 0.0); };
  CuttingForce force(line, side, scaled(liver_hysteresis<double>(), 2.0));
  auto const f = force(cut_from(0.009, 0.010));
  CHECK(f.x() == Approx(0.010));
  CHECK(f.z() == Approx(0.1 + 2.0 * liver_hysteresis<double>()(0.010, Phase::loading)));
}

TEST_CASE("a contact that is not finite gives zero force and leaves no trace") {
  double const nan = std::numeric_limits<double>::quiet_NaN();
  CuttingForce force(liver_hysteresis<double>(), OrganForce<double>{.coefficient = 2.0}, CurveJoin<double>{.reversal_depth = 1e-3});
  auto const good = cut_from(0.011, 0.012);
  Vector3<double> const expected = force(good);
  for (int i = 0; i < 5; ++i) {
    auto bad = good;
    if (i == 0) bad.depth = nan;
    if (i == 1) bad.previous_depth = nan;
    if (i == 2) bad.normal.z() = nan;
    if (i == 3) bad.velocity.x() = std::numeric_limits<double>::infinity();
    if (i == 4) bad.depth = std::numeric_limits<double>::infinity();
    CAPTURE(i);
    CHECK(force(bad).allFinite());
    CHECK(force(good) == expected);
  }
}

TEST_CASE("a cutting force checks its parts") {
  auto const curve = liver_hysteresis<double>();
  CHECK_THROWS_WITH(CuttingForce(curve, OrganForce<double>{.wall_normal = {0.0, 0.0, 0.0}}), says(".wall_normal is (0, 0, 0)", "other than zero"));
  CHECK_THROWS_AS(CuttingForce(curve, IndentationSpring<double>{.stiffness = -5.0}), InvalidArgument);
  CHECK_THROWS_AS(CuttingForce(curve, TissueReaction{.scale = std::nan("")}), InvalidArgument);
  CHECK_THROWS_WITH(CuttingForce(curve, CurveJoin<double>{.fade_depth = -0.001}), says(".fade_depth is -0.001 m", "zero or more"));
  CHECK_THROWS_AS(CuttingForce(curve, CurveJoin<double>{.reversal_depth = std::nan("")}), InvalidArgument);
  CHECK_THROWS_AS(CuttingForce(curve, CurveJoin<double>{.puncture_time = -1.0}), InvalidArgument);
}

TEST_CASE("a tick of the cutting force allocates nothing") {
  CuttingForce force(liver_hysteresis<double>(), OrganForce<double>{.coefficient = 2.0}, OrganFriction<double>{},
                     WhiteGaussianNoise<double>({.snr_db = 30.0, .seed = 7}));
  STATIC_REQUIRE(noexcept(force(std::declval<ToolContact<double> const&>())));
  REQUIRE(palpate_test::trap_works());
  palpate_test::AllocationCount const allocations;
  Vector3<double> sum = Vector3<double>::Zero();
  for (int i = 0; i < 1000; ++i) {
    auto contact = cut_from(1e-5 * i, 1e-5 * (i + 1));
    contact.phase = i < 300 ? CuttingPhase::indenting : CuttingPhase::moving;
    sum += force(contact);
  }
  long const count = allocations.count();
  CHECK(count == 0);
  CHECK(sum.allFinite());
}
