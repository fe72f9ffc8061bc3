// SPDX-License-Identifier: MIT
// Yardsticks: paths whose distance is known without aligning anything; the warping of short paths by trying every chain of pairs.
#include "catch.hpp"

#include "device/message.hpp"

#include <palpate/core/random.hpp>
#include <palpate/training/alignment.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

using namespace palpate;
using palpate_test::message_of;
using palpate_test::unsaid;

namespace {

using Path = Matrix3X<double>;

/// `shape(t)` for n evenly spaced t from 0 to 1.
template <class Shape>
Path path(Eigen::Index n, Shape shape) {
  Path points(3, n);
  for (Eigen::Index i = 0; i < n; ++i) points.col(i) = shape(static_cast<double>(i) / static_cast<double>(n - 1));
  return points;
}

Vector3<double> reach(double t) { return {0.1 * t * t * (3 - 2 * t), 0, 0}; }
Vector3<double> loop(double t) {
  double const a = 2 * std::numbers::pi * t;
  return {0.03 * std::cos(a), 0.03 * std::sin(2 * a), 0.01 * t};
}

double largest(Alignment const& alignment) { return *std::max_element(alignment.distance.begin(), alignment.distance.end()); }
double mean(Alignment const& alignment) {
  return std::accumulate(alignment.distance.begin(), alignment.distance.end(), 0.0) / static_cast<double>(alignment.distance.size());
}
double rms(Alignment const& alignment) {
  double squares = 0;
  for (double const d : alignment.distance) squares += d * d;
  return std::sqrt(squares / static_cast<double>(alignment.distance.size()));
}

/// The least sum of weighted distances over all monotone chains of pairs, by trying them all.
double min_cost(Path const& a, Path const& b, Eigen::Index i, Eigen::Index j) {
  double const here = (a.col(i) - b.col(j)).norm();
  if (i == 0 && j == 0) return 2 * here;
  double best = std::numeric_limits<double>::infinity();
  if (i > 0) best = std::min(best, min_cost(a, b, i - 1, j));
  if (j > 0) best = std::min(best, min_cost(a, b, i, j - 1));
  if (i > 0 && j > 0) best = std::min(best, min_cost(a, b, i - 1, j - 1) + here);
  return best + here;
}

}  // namespace

TEST_CASE("a path and itself are aligned tick by tick, and exactly", "[training][alignment]") {
  // Also with rests, where every tick is as near as the next.
  auto const with_rests = [](double t) { return loop(t < 0.3 ? 0.0 : t < 0.6 ? (t - 0.3) / 0.6 : t < 0.8 ? 0.5 : (t - 0.8) * 2.5 + 0.5); };
  for (Eigen::Index const n : {2, 3, 50, 2000, 2001, 7003, 49000}) {
    Path const points = path(n, with_rests);
    Alignment const alignment = align(points, points);
    CHECK(largest(alignment) == 0.0);
    CHECK(alignment.missed == 0.0);
    CHECK_FALSE(alignment.band_reached);
    bool in_order = true;
    for (std::size_t i = 0; i < alignment.partner.size(); ++i) in_order = in_order && alignment.partner[i] == static_cast<double>(i);
    CHECK(in_order);
  }
}

TEST_CASE("a shifted line is as far away as the shift, whatever the pace", "[training][alignment]") {
  Path const expert = path(3000, reach);
  for (double const shift : {1e-4, 0.004, 0.02}) {
    Path const same_pace = path(3000, [&](double t) -> Vector3<double> { return reach(t) + Vector3<double>(0, 0.6 * shift, -0.8 * shift); });
    Path const other_pace = path(4100, [&](double t) -> Vector3<double> { return Vector3<double>(0.1 * t, shift, 0); });
    for (Path const* const trainee : {&same_pace, &other_pace}) {
      Alignment const alignment = align(*trainee, expert);
      CHECK(mean(alignment) == Approx(shift).epsilon(1e-9));
      CHECK(largest(alignment) == Approx(shift).epsilon(1e-9));
      CHECK(alignment.missed == Approx(shift).epsilon(1e-9));
      CHECK_FALSE(alignment.band_reached);
    }
  }
}

TEST_CASE("a delay costs nothing while it is within the band", "[training][alignment]") {
  // Yardstick: the path itself. It closes and crosses itself, so the nearest point anywhere would say nothing about time.
  Path const expert = path(4000, loop);
  for (double const delay : {0.05, 0.15}) {
    Path const late = path(4000, [&](double t) { return loop(std::max(0.0, t - delay) / (1 - delay)); });
    Alignment const alignment = align(late, expert);
    // The chords of the expert's ticks: at most |x″| h² / 8, where |x″| is at most √17 · 4 π² · 0.03 m.
    CHECK(largest(alignment) < 4.9 / (3999.0 * 3999.0) / 8);
    CHECK(alignment.missed < 1e-6);
    double off = 0.0;
    for (std::size_t i = 0; i < alignment.partner.size(); ++i) {
      double const t = static_cast<double>(i) / 3999.0;
      off = std::max(off, std::abs(alignment.partner[i] - 3999.0 * std::max(0.0, t - delay) / (1 - delay)));
    }
    CHECK(off < 4.0);   // ticks, two samples
  }
  Path const too_late = path(4000, [&](double t) { return loop(std::max(0.0, t - 0.6) / 0.4); });
  Alignment const alignment = align(too_late, expert, {.band = 0.1});
  CHECK(alignment.band_reached);
  CHECK(largest(alignment) > 0.005);
}

TEST_CASE("a tremor of amplitude a is a / √2 away in the mean square, 2 a / π in the mean", "[training][alignment]") {
  constexpr double a = 0.001;
  Path const expert = path(10'000, [](double t) -> Vector3<double> { return {0.1 * t, 0, 0}; });
  Path const tremor = path(10'000, [&](double t) -> Vector3<double> { return {0.1 * t, 0, a * std::sin(2 * std::numbers::pi * 100 * t)}; });
  Alignment const alignment = align(tremor, expert);   // 10 s of 10 Hz
  CHECK(rms(alignment) == Approx(a / std::numbers::sqrt2).epsilon(1e-3));
  CHECK(mean(alignment) == Approx(2 * a / std::numbers::pi).epsilon(1e-3));
  CHECK(largest(alignment) == Approx(a).epsilon(1e-3));
  // By arc length the same tremor would be out of place: its path is 0.4 m longer over 0.1 m.
}

TEST_CASE("what was left out is missed", "[training][alignment]") {
  // The detour of the expert goes 2 cm aside; the trainee goes straight.
  auto const detour = [](double t) -> Vector3<double> { return {0.1 * t, 0.02 * std::max(0.0, 1 - std::abs(t - 0.5) / 0.1), 0}; };
  Path const expert = path(2500, detour), straight = path(2500, [](double t) -> Vector3<double> { return {0.1 * t, 0, 0}; });
  CHECK(align(straight, expert).missed == Approx(0.02).epsilon(3e-3));
  Path const half_way = path(2500, [](double t) -> Vector3<double> { return {0.05 * t, 0, 0}; });
  Alignment const alignment = align(half_way, straight, {.band = 1.0});
  CHECK(alignment.missed == Approx(0.05).epsilon(1e-9));
  CHECK(largest(alignment) < 1e-9);   // what it did was on the way
  CHECK(align(half_way, straight).band_reached);   // and, with a narrow band, too late
}

TEST_CASE("the warping is the cheapest of all", "[training][alignment]") {
  Random random(Seed{17});
  for (int round = 0; round < 60; ++round) {
    auto const n = static_cast<Eigen::Index>(2 + random.below(6)), m = static_cast<Eigen::Index>(2 + random.below(6));
    Path a(3, n), b(3, m);
    for (auto* points : {&a, &b})
      for (double& x : points->reshaped()) x = random.uniform();
    detail::Samples const rows(static_cast<std::size_t>(n), 100), columns(static_cast<std::size_t>(m), 100);
    detail::Warp const warp = detail::warp_in_band(a, rows, b, columns, 1.0);
    // The cost of the chain that the rows tell: its pairs are all from first to last column of each row.
    double cost = 0;
    for (Eigen::Index i = 0; i < n; ++i)
      for (auto j = warp.first_column[static_cast<std::size_t>(i)]; j <= warp.last_column[static_cast<std::size_t>(i)]; ++j) {
        auto const row = static_cast<std::size_t>(i);
        bool const both = j == warp.first_column[row] && (i == 0 || j > warp.last_column[row - 1]);   // how the chain came here
        cost += (both ? 2 : 1) * (a.col(i) - b.col(static_cast<Eigen::Index>(j))).norm();
      }
    CHECK(cost == Approx(min_cost(a, b, n - 1, m - 1)).epsilon(1e-12));
    CHECK(warp.first_column.front() == 0);
    CHECK(warp.last_column.back() == static_cast<std::size_t>(m - 1));
    for (std::size_t i = 1; i < warp.first_column.size(); ++i) {
      CHECK(warp.first_column[i] >= warp.last_column[i - 1]);
      CHECK(warp.first_column[i] <= warp.last_column[i - 1] + 1);
    }
  }
}

TEST_CASE("samples are evenly spaced and end with the last point", "[training][alignment]") {
  for (std::size_t const points : {2u, 3u, 10u, 1999u, 2000u, 2001u, 60000u})
    for (std::size_t const most : {2u, 3u, 7u, 2000u}) {
      detail::Samples const samples(points, most);
      CHECK(samples.count() <= most);
      CHECK(samples.count() >= 2);
      CHECK(samples.at(0) == 0);
      CHECK(samples.at(samples.count() - 1) == points - 1);
      bool good = true;
      for (std::size_t k = 0; k + 1 < samples.count(); ++k) good = good && samples.at(k) < samples.at(k + 1);
      for (std::size_t i = 0; i < points; ++i) good = good && samples.at(samples.before(i)) <= i && i <= samples.at(samples.before(i) + 1);
      CHECK(good);
    }
}

TEST_CASE("paths that can not be aligned are refused", "[training][alignment]") {
  Path const good = path(10, reach);
  Path bad = good;
  bad(1, 4) = std::numeric_limits<double>::infinity();
  CHECK(unsaid(message_of([&] { align(good, bad); }), "align: point 4 is not finite") == "");
  CHECK(unsaid(message_of([&] { align(good.leftCols(1), good); }), "a path has 1 points") == "");
  CHECK(unsaid(message_of([&] { align(good, good, {.samples = 1}); }), ".samples is 1") == "");
  CHECK(unsaid(message_of([&] { align(good, good, {.samples = 1'000'000}); }), ".samples is 1000000; give 2 to 10000") == "");
  CHECK(unsaid(message_of([&] { align(good, good, {.band = 0.0}); }), ".band is 0") == "");
  CHECK(unsaid(message_of([&] { align(good, good, {.band = 1.5}); }), ".band is 1.5") == "");
}
