// SPDX-License-Identifier: MIT
// Yardsticks: the force law integrated by quadrature and differentiated numerically; distances to a path by brute force; the work done on a hand.
#include "catch.hpp"

#include "allocation_trap.hpp"
#include "device/message.hpp"

#include <palpate/core/random.hpp>
#include <palpate/device/trajectory.hpp>
#include <palpate/haptics/sampled_wall.hpp>
#include <palpate/training/guidance.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

using namespace palpate;
using palpate_test::message_of;
using palpate_test::unsaid;

namespace {

using Vector = Vector3<double>;
using Points = Matrix3X<double>;

constexpr double tick = 1e-3;   // s

Points points_of(Trajectory<double> const& path, int count = 4000) {
  Points points(3, count + 1);
  for (int i = 0; i <= count; ++i) points.col(i) = path.at(path.duration() * i / count).position;
  return points;
}

Points straight() { return points_of(Trajectory<double>::start({0, 0, 0}).line({0.1, 0, 0}, 1.0)); }
/// Down 2 cm and along 6 cm, as a stroke goes.
Points corner() { return points_of(Trajectory<double>::start({0, 0, 0.02}).line({0, 0, 0}, 1.0).line({0.06, 0, 0}, 1.0)); }
/// A figure of eight that rises: curved, and it crosses itself when seen from above.
Points eight() {
  Points points(3, 4001);
  for (int i = 0; i <= 4000; ++i) {
    double const a = 2 * std::numbers::pi * i / 4000;
    points.col(i) = Vector(0.03 * std::cos(a), 0.03 * std::sin(2 * a), 0.004 * a);
  }
  return points;
}

/// The force law as it is documented.
double law(double distance, GuidanceOptions const& o) {
  double const e = distance - o.dead_band;
  if (e <= 0) return 0;
  return std::min(o.max_force, e < o.fade ? o.stiffness * e * e / (2 * o.fade) : o.stiffness * (e - o.fade / 2));
}
/// Its integral, by the midpoint rule.
double stored(double distance, GuidanceOptions const& o) {
  constexpr int n = 4000;
  double sum = 0;
  for (int i = 0; i < n; ++i) sum += law(distance * (i + 0.5) / n, o);
  return sum * distance / n;
}
double brute_distance(Vector const& x, Points const& points) {
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 0; i + 1 < points.cols(); ++i) {
    Vector const a = points.col(i), way = points.col(i + 1) - a;
    least = std::min(least, (x - a - std::clamp((x - a).dot(way) / way.squaredNorm(), 0.0, 1.0) * way).norm());
  }
  return least;
}

/// A guidance and the hand in it.
struct Held {
  PathGuidance<double> guidance;
  bool begun = false;
  Vector last = Vector::Zero();

  Held(Points const& points, GuidanceOptions const& options, double spacing = 5e-4) : guidance(GuidePath<double>(points, spacing), options) {}

  Vector at(Vector const& x) {
    Vector const velocity = begun ? Vector((x - last) / tick) : Vector(Vector::Zero());
    Vector const force = guidance(ToolMotion<double>{x, velocity, tick, begun});
    begun = true;
    last = x;
    return force;
  }
  /// Rests there until nothing changes.
  Vector settle(Vector const& x) {
    Vector force = at(x);
    for (int i = 0; i < 2000; ++i) force = at(x);
    return force;
  }
};

/// A smooth random closed path of the hand about the middle of a box: a sum of sines.
struct Loop {
  std::vector<Vector> in, out;
  Vector middle;

  Loop(std::uint64_t seed, Vector const& about, double size) : middle(about) {
    Random random(Seed{seed});
    for (int k = 1; k <= 4; ++k) {
      auto const any = [&]() -> Vector { return Vector(random.normal(), random.normal(), random.normal()) * size / k; };
      in.push_back(any());
      out.push_back(any());
    }
  }
  /// t from 0 to 1 goes round once.
  Vector at(double t) const {
    Vector x = middle;
    for (std::size_t k = 0; k < in.size(); ++k) {
      double const a = 2 * std::numbers::pi * double(k + 1) * t;
      x += std::sin(a) * in[k] + (1 - std::cos(a)) * out[k];
    }
    return x;
  }
};

struct Work {
  double done = 0.0;        // J, on the hand
  double sampling = 0.0;    // J, ½ k Σ |Δx|²
  double worst = -1.0;      // J, the most by which the promise was broken in a tick; at most rounding
};

/// Carries the hand round the loop in so many ticks; the force of each tick lasts until the next.
Work carry(Held& held, Loop const& loop, int ticks, int rounds) {
  Work work;
  Vector x = loop.at(0), force = held.at(x);
  double const k = held.guidance.options().stiffness;
  for (int i = 1; i <= ticks * rounds; ++i) {
    Vector const next = loop.at(double(i % ticks) / ticks);
    double const before = held.guidance.energy(), done = force.dot(next - x), sampling = 0.5 * k * (next - x).squaredNorm();
    force = held.at(next);
    x = next;
    work.done += done;
    work.sampling += sampling;
    work.worst = std::max(work.worst, done - (before - held.guidance.energy() + sampling));
  }
  return work;
}

}  // namespace

TEMPLATE_TEST_CASE("off a straight path the force is the law, towards the path", "[training][guidance]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  GuidanceOptions const options{.stiffness = 800.0, .dead_band = 0.0015, .fade = 0.002, .max_force = 2.5};
  for (double const off : {0.0, 0.001, 0.0015, 0.002, 0.003, 0.0035, 0.005, 0.0056, 0.006, 0.02}) {
    PathGuidance<S> guidance(GuidePath<S>(straight()), options);
    Vector3<S> const x = Vector(0.05, 0.6 * off, -0.8 * off).cast<S>();
    Vector3<S> force = guidance({.tip = x});
    CHECK(force.isZero(0));   // it begins at zero
    for (int i = 0; i < 700; ++i) force = guidance({.tip = x, .continues = true});
    Vector const expected = -law(off, options) * Vector(0, 0.6, -0.8);
    CHECK((force.template cast<double>() - expected).norm() < (std::is_same_v<S, float> ? 2e-4 : 1e-9));
    CHECK(guidance.deviation() == Approx(off).margin(1e-7));
    CHECK(guidance.energy() == Approx(stored(off, options)).epsilon(1e-4).margin(1e-9));
  }
}

TEST_CASE("the force is the gradient of an energy that is a function of the distance alone", "[training][guidance]") {
  // Yardstick: distances by brute force over the same path, the law by quadrature, central differences. The path is round.
  GuidanceOptions const options{.stiffness = 600.0, .dead_band = 0.001, .fade = 0.001, .max_force = 2.0};
  Random random(Seed{21});
  Points const path = eight();
  int outside = 0;
  for (int round = 0; round < 40; ++round) {
    auto const i = static_cast<Eigen::Index>(random.below(4001));
    Vector const x = path.col(i) + 0.003 * Vector(random.normal(), random.normal(), random.normal());
    Held held(path, options, 1e-5);
    Vector const force = held.settle(x);
    constexpr double h = 1e-6;
    Vector gradient;
    for (int axis = 0; axis < 3; ++axis) {
      Vector const step = h * Vector::Unit(axis);
      gradient(axis) = (stored(brute_distance(x + step, path), options) - stored(brute_distance(x - step, path), options)) / (2 * h);
    }
    CHECK((force + gradient).norm() < 5e-3);
    CHECK(held.guidance.deviation() == Approx(brute_distance(x, path)).margin(1e-6));
    outside += force.norm() > 0.1;
  }
  CHECK(outside > 15);
}

TEST_CASE("no closed path of the hand takes more out of the guidance than sampling adds", "[training][guidance][passivity]") {
  // Work on the hand <= energy before - energy after + 1/2 k sum |dx|^2, at every tick of every path: corners, places that change, deep outside.
  GuidanceOptions const options{.stiffness = 700.0, .dead_band = 0.0005, .fade = 0.001, .max_force = 1.5, .look = 0.02};
  std::vector<std::pair<Points, Vector>> const paths{{straight(), {0.05, 0, 0}}, {corner(), {0.005, 0, 0.004}}, {eight(), {0, 0, 0.01}}};
  for (auto const& [points, about] : paths)
    for (std::uint64_t seed = 1; seed <= 12; ++seed)
      for (bool const backward : {true, false}) {
        GuidanceOptions once = options;
        once.backward = backward;
        once.change_time = seed % 2 == 0 ? 0.05 : 0.5;   // slow enough for the hand to turn back meanwhile
        Held held(points, once);
        Loop const loop(seed, about, seed % 3 == 0 ? 0.02 : 0.005);
        held.settle(loop.at(0));
        Work const work = carry(held, loop, 1500, 3);
        CHECK(work.worst < 1e-12);
        CHECK(work.done < work.sampling + stored(0.1, options));
      }
}

TEST_CASE("what sampling adds falls with the length of a tick, and nothing else is left", "[training][guidance][passivity]") {
  // Once round a loop, and all is as it was: the work on the hand is at most half of k times the sum of squares, which is as 1/n.
  GuidanceOptions const options{.stiffness = 700.0, .dead_band = 0.0005, .fade = 0.001, .max_force = 1.5};
  for (std::uint64_t seed = 31; seed <= 34; ++seed) {
    double last = 0;
    for (int const ticks : {1000, 4000, 16000}) {
      Held held(straight(), options);
      Loop const loop(seed, {0.05, 0, 0}, 0.004);
      held.settle(loop.at(0));
      carry(held, loop, ticks, 1);   // the place has slid to where it will be
      Work const work = carry(held, loop, ticks, 1);
      CHECK(work.done > 0.0);   // an explicit sampler always adds some: the force is that of the place left behind
      CHECK(work.done < work.sampling);
      if (ticks > 1000) CHECK(work.done == Approx(last / 4).epsilon(0.05));
      last = work.done;
    }
    CHECK(last < 1e-4);
  }
}

TEST_CASE("a hand with damping loses energy in every tick, up to the stiffness that is said", "[training][guidance][passivity]") {
  // Yardstick: Colgate and Schenkel's bound; a mass with damping b whose movement under a force held for a tick is solved exactly.
  auto const largest_gain = [](double mass, double b, double stiffness) {
    Held held(straight(), {.stiffness = stiffness, .dead_band = 0.0, .fade = 1e-5, .max_force = 100.0});
    Vector x(0.05, 0.004, 0), v(0.01, 0, 0.1);
    held.settle(x);
    double gain = -1.0, energy = held.guidance.energy() + 0.5 * mass * v.squaredNorm();
    Vector force = held.at(x);
    for (int i = 0; i < 3000; ++i) {
      double const decay = std::exp(-b / mass * tick);
      Vector const drift = force / b;   // the velocity it would reach
      x += drift * tick + (v - drift) * (mass / b) * (1 - decay);
      v = drift + (v - drift) * decay;
      force = held.at(x);
      double const now = held.guidance.energy() + 0.5 * mass * v.squaredNorm();
      gain = std::max(gain, now - energy);
      energy = now;
    }
    return gain;
  };
  for (double const mass : {0.02, 0.1, 0.3})
    for (double const b : {0.5, 2.0, 8.0}) CHECK(largest_gain(mass, b, passive_wall(b, 0.0, tick)) < 1e-12);
  CHECK(largest_gain(0.1, 0.5, 20 * passive_wall(0.5, 0.0, tick)) > 1e-6);   // the bound is not empty
}

TEST_CASE("the force makes no step: arming, corners, changes of place, disarming", "[training][guidance]") {
  GuidanceOptions const options{.stiffness = 700.0, .dead_band = 0.0005, .fade = 0.001, .max_force = 1.5};
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Held held(corner(), options);
    Loop const loop(seed, {0.006, 0, 0.004}, 0.006);
    Vector x = loop.at(0), force = held.at(x);
    CHECK(force.isZero(0));
    double over = -1.0, largest = 0.0;
    for (int i = 1; i <= 9000; ++i) {
      if (i % 2000 == 1500) held.guidance.disarm();
      if (i % 2000 == 100) held.guidance.arm();   // also half-way through the fading
      if (i % 2000 == 1600 && seed % 2 == 0) held.guidance.arm();
      Vector const next = loop.at(i / 3000.0), answer = held.at(next);
      double const allowed = options.stiffness * ((next - x).norm() + options.slide_speed * tick) +
                             options.max_force * tick * (2 / options.change_time + 1.5 / options.arm_time);
      over = std::max(over, (answer - force).norm() - allowed);
      largest = std::max(largest, answer.norm());
      x = next, force = answer;
    }
    CHECK(over < 1e-12);
    CHECK(largest <= options.max_force * (1 + 1e-12));
    CHECK(largest > 0.5);
  }
}

TEST_CASE("a hand that cuts a corner is not held back by the leg behind", "[training][guidance]") {
  // The tip stays 2 mm above the second leg: the first leg, at its height, stays the nearest place of its neighbourhood for ever.
  GuidanceOptions const options{.stiffness = 500.0, .dead_band = 0.0005, .fade = 0.0005, .max_force = 3.0};
  Held held(corner(), options);
  Vector force = Vector::Zero();
  for (int i = 0; i <= 600; ++i) force = held.at({0, 0, 0.02 - 0.018 * i / 600.0});
  for (int i = 0; i <= 1000; ++i) force = held.at({0.03 * i / 1000.0, 0, 0.002});
  CHECK(held.guidance.progress() == Approx((0.02 + 0.03) / 0.08).margin(0.01));
  CHECK(force.z() == Approx(-law(0.002, options)).epsilon(0.02));
  CHECK(std::abs(force.x()) < 1e-6);
}

TEST_CASE("a path that comes back beside itself is followed leg by leg", "[training][guidance]") {
  // Two legs of 6 cm, 3 mm apart; the hand strays to where the second leg is nearer.
  Points const hairpin = points_of(Trajectory<double>::start({0, 0, 0}).line({0.06, 0, 0}, 1.0).line({0.06, 0.003, 0}, 0.1).line({0, 0.003, 0}, 1.0));
  Held held(hairpin, {.look = 0.01});
  for (int i = 0; i <= 500; ++i) held.at({0.04 * i / 500.0, 0, 0});
  for (int i = 0; i <= 500; ++i) held.at({0.04, 0.0025 * i / 500.0, 0});
  CHECK(held.guidance.progress() == Approx(0.04 / 0.123).margin(0.01));
  CHECK(held.guidance.deviation() == Approx(0.0025).epsilon(0.01));
}

TEST_CASE("a path that is only gone forward holds its place when the hand goes back", "[training][guidance]") {
  Held held(straight(), {.max_force = 10.0, .backward = false});
  held.settle({0.02, 0, 0});
  for (int i = 0; i <= 500; ++i) held.at({0.02 + 0.04 * i / 500.0, 0, 0});
  CHECK(held.guidance.place().x() == Approx(0.06).margin(1e-9));
  Vector force = Vector::Zero();
  for (int i = 0; i <= 500; ++i) force = held.at({0.06 - 0.01 * i / 500.0, 0, 0});
  CHECK(held.guidance.place().x() == Approx(0.06).margin(1e-9));
  CHECK(force.x() == Approx(law(0.01, {.max_force = 10.0})).epsilon(1e-6));
}

TEST_CASE("arming gives at most the energy of the place, disarming lets go", "[training][guidance]") {
  GuidanceOptions const options{.stiffness = 500.0, .arm_time = 0.3, .armed = false};
  Held held(straight(), options);
  Vector const x(0.05, 0.004, 0);
  for (int i = 0; i < 50; ++i) CHECK(held.at(x).isZero(0));
  held.guidance.arm();
  double last = 0.0;
  for (int i = 0; i <= 300; ++i) {
    double const force = held.at(x).norm();
    CHECK(force >= last);
    CHECK(held.guidance.energy() <= stored(0.004, options) * (1 + 1e-6));
    last = force;
  }
  CHECK(last == Approx(law(0.004, options)).epsilon(1e-6));
  held.guidance.disarm();
  for (int i = 0; i < 300; ++i) {
    double const force = held.at(x).norm();
    CHECK(force <= last);
    last = force;
  }
  CHECK(held.at(x).isZero(0));
  CHECK(held.guidance.energy() == 0.0);
  // After a gap in which the hand felt nothing it begins at zero again.
  held.guidance.arm();
  CHECK(held.settle(x).norm() > 1.0);
  held.begun = false;
  CHECK(held.at(x).isZero(0));
}

TEST_CASE("damping only takes, and the sum stays below the largest force", "[training][guidance]") {
  GuidanceOptions options{.stiffness = 700.0, .dead_band = 0.0005, .fade = 0.001, .max_force = 1.5};
  Held plain(eight(), options);
  options.damping = 5.0;
  Held damped(eight(), options);
  Loop const loop(4, {0, 0, 0.01}, 0.01);
  plain.settle(loop.at(0));
  damped.settle(loop.at(0));
  double worst = -1.0, largest = 0.0, taken = 0.0;
  for (int i = 1; i <= 6000; ++i) {
    Vector const x = loop.at(i / 2000.0);
    Vector const velocity = (x - damped.last) / tick, force = damped.at(x);
    double const power = (force - plain.at(x)).dot(velocity);
    worst = std::max(worst, power);
    taken -= power * tick;
    largest = std::max(largest, force.norm());
  }
  CHECK(worst < 1e-12);
  CHECK(taken > 1e-4);
  CHECK(largest <= 1.5 * (1 + 1e-12));
}

TEST_CASE("guidance in the servo tick allocates nothing and throws nothing", "[training][guidance][realtime]") {
  REQUIRE(palpate_test::trap_works());
  static_assert(noexcept(std::declval<PathGuidance<double>&>()(std::declval<ToolMotion<double> const&>())));
  static_assert(noexcept(std::declval<PathGuidance<double>&>().arm()));
  Held held(eight(), {});
  Loop const loop(2, {0, 0, 0.01}, 0.02);
  double sum = 0.0;
  palpate_test::AllocationCount const allocations;
  for (int i = 0; i < 5000; ++i) sum += held.at(loop.at(i / 1000.0)).norm();
  long const count = allocations.count();
  CHECK(count == 0);
  CHECK(sum > 0);
}

TEST_CASE("a guide path keeps the shape and leaves out rests", "[training][guidance]") {
  Recording recording;
  auto const path = Trajectory<double>::start({0, 0, 0}).hold(0.2).line({0.03, 0, 0}, 0.5).hold(0.3).line({0.03, 0.04, 0}, 0.5, Pace::minimum_jerk);
  for (int i = 0; i <= 1500; ++i) recording.append({.tip = path.at(i / 1000.0).position});
  GuidePath<double> const guide(recording, 0.001);
  CHECK(guide.length() == Approx(0.07).epsilon(0.01));   // the corner may be cut by less than the spacing
  CHECK(guide.pieces() <= 70);
  double off = 0.0;
  for (Tick const& one : recording.ticks()) {
    auto const place = guide.nearest(one.tip);
    off = std::max(off, (guide.point(place) - one.tip).norm());
  }
  CHECK(off < 0.001);
  CHECK(guide.point(guide.nearest({9, 9, 0})) == Vector(0.03, 0.04, 0));
  CHECK(guide.arc(guide.nearest({-1, 0, 0})) == 0.0);
}

TEST_CASE("options and paths that make no sense are refused", "[training][guidance]") {
  auto const said = [](GuidanceOptions const& options) { return message_of([&] { PathGuidance<double>(GuidePath<double>(straight()), options); }); };
  CHECK(said({}) == "(no exception)");
  CHECK(unsaid(said({.stiffness = 0.0}), "PathGuidance: .stiffness is 0 N/m; give a positive, finite number") == "");
  CHECK(unsaid(said({.damping = -1.0}), ".damping is -1 N s/m; give a finite number, zero or more") == "");
  CHECK(unsaid(said({.dead_band = std::numeric_limits<double>::quiet_NaN()}), ".dead_band is nan m") == "");
  CHECK(unsaid(said({.fade = 0.0}), ".fade is 0 m") == "");
  CHECK(unsaid(said({.max_force = std::numeric_limits<double>::infinity()}), ".max_force is inf N") == "");
  CHECK(unsaid(said({.look = -1.0}), ".look is -1 m") == "");
  CHECK(unsaid(said({.slide_speed = 0.0}), ".slide_speed is 0 m/s") == "");
  CHECK(unsaid(said({.change_time = 0.0}), ".change_time is 0 s") == "");
  CHECK(unsaid(said({.arm_time = 0.0}), ".arm_time is 0 s") == "");
  CHECK(unsaid(message_of([] { GuidePath<double>(straight(), -1.0); }), "GuidePath: the spacing is -1 m") == "");
  CHECK(unsaid(message_of([] { GuidePath<double>(Points(Points::Zero(3, 10))); }), "the path is 0 m long with 10 points") == "");
  CHECK(unsaid(message_of([] {
                 GuidePath<double>(points_of(Trajectory<double>::start({0, 0, 0}).line({1, 0, 0}, 1.0), 30'000), 1e-5);
               }),
               "there are 30000 pieces; give a larger spacing") == "");
  Points broken = straight();
  broken(0, 7) = std::numeric_limits<double>::quiet_NaN();
  CHECK(unsaid(message_of([&] { GuidePath<double> const path(broken); }), "point 7 is not finite") == "");
}
