// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/force/concept.hpp>
#include <palpate/force/curve.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace palpate {

/// How `check_curve` looks.
template <RealScalar S>
struct CurveCheck {
  int depths = 2001;   ///< evenly spaced over the range, both ends included
  S tolerance = S(0);  ///< N; less does not count. 0: what rounding makes, 64 ε of the largest force
};

/// A force that should not be there, or the largest of its kind, and where. Size 0: there is none.
template <RealScalar S>
struct CurveFinding {
  S size = S(0);    ///< N
  S depth = S(0);   ///< m
};

/// From low to high along loading and back along unloading. Energy 0: no such cycle returns more than it takes.
template <RealScalar S>
struct CurveCycle {
  S energy = S(0);   ///< J, returned beyond what was taken
  S low = S(0);      ///< m
  S high = S(0);     ///< m
};

/// What is known of a force curve, at the depths that were looked at. A curve without hysteresis has unloading = loading.
template <RealScalar S>
struct CurveReport {
  DepthRange<S> range{};
  int depths = 0;
  bool has_hysteresis = false;
  CurveFinding<S> loading_fall{};     ///< the most that loading lies below what it was at a smaller depth
  CurveFinding<S> unloading_fall{};   ///< the same of unloading
  CurveFinding<S> below_zero{};       ///< the strongest pull into the tissue, on either branch
  CurveFinding<S> excess{};           ///< the most that unloading exceeds loading
  CurveFinding<S> widest{};           ///< the most that loading exceeds unloading
  CurveCycle<S> gain{};               ///< the cycle that returns the most beyond what it takes
  S taken = S(0);                     ///< J, from the range's low end to its high end along loading
  S lost = S(0);                      ///< J, of that, on the way back along unloading; negative where the range as a whole gains
  S gap_low = S(0);                   ///< N, loading − unloading at the low end
  S gap_high = S(0);                  ///< N, the same at the high end
  std::vector<DepthRange<S>> meets{};   ///< m, where loading and unloading are one: low = high where they cross

  bool is_monotone() const noexcept { return !(loading_fall.size > S(0)) && !(unloading_fall.size > S(0)); }
  /// No closed way over the range, from any depth and with any number of turns, returns more energy than it takes: each is a sum of
  /// cycles between two depths.
  bool is_passive() const noexcept { return !(gain.energy > S(0)); }
};

namespace detail {

/// The place where a straight line from (x0, y0) to (x1, y1), of different signs, is zero.
inline double zero_between(double x0, double y0, double x1, double y1) noexcept { return x0 + (x1 - x0) * (y0 / (y0 - y1)); }

/// Loading and unloading of a curve at evenly spaced depths.
struct CurveSamples {
  std::vector<double> depth, loading, unloading;

  double gap(std::size_t k) const noexcept { return loading[k] - unloading[k]; }

  /// How far values fall below the largest before, and where that is most.
  template <RealScalar S>
  CurveFinding<S> fall(std::vector<double> const& values, double tolerance) const {
    double highest = values.front(), size = 0.0;
    std::size_t at = 0;
    for (std::size_t k = 0; k < values.size(); ++k) {
      highest = std::max(highest, values[k]);
      if (highest - values[k] > size) size = highest - values[at = k];
    }
    return size > tolerance ? CurveFinding<S>{static_cast<S>(size), static_cast<S>(depth[at])} : CurveFinding<S>{};
  }

  /// The largest of `size(k)`.
  template <RealScalar S, class Size>
  CurveFinding<S> largest(double tolerance, Size size) const {
    std::size_t at = 0;
    for (std::size_t k = 1; k < depth.size(); ++k)
      if (size(k) > size(at)) at = k;
    return size(at) > tolerance ? CurveFinding<S>{static_cast<S>(size(at)), static_cast<S>(depth[at])} : CurveFinding<S>{};
  }

  template <RealScalar S>
  std::vector<DepthRange<S>> meets(double tolerance) const {
    std::vector<DepthRange<S>> found;
    auto const sign = [&](std::size_t k) { return gap(k) > tolerance ? 1 : gap(k) < -tolerance ? -1 : 0; };
    for (std::size_t k = 0; k < depth.size(); ++k) {
      if (sign(k) == 0) {
        if (k > 0 && sign(k - 1) == 0)
          found.back().high = static_cast<S>(depth[k]);
        else
          found.push_back({static_cast<S>(depth[k]), static_cast<S>(depth[k])});
      } else if (k > 0 && sign(k - 1) == -sign(k)) {
        S const at = static_cast<S>(zero_between(depth[k - 1], gap(k - 1), depth[k], gap(k)));
        found.push_back({at, at});
      }
    }
    return found;
  }
};

}  // namespace detail

/// Looks at a force curve before a hand feels it: does it rise with depth, push out everywhere, give back no more than it took?
///   energy    of a cycle low → high → low:  ∫ (loading − unloading) dd by the trapezoid rule over the depths between. The cycle that
///             gains most is found among all pairs of depths: the largest rise of the running integral G of unloading − loading,
///             max (G(high) − G(low)) over low < high, one pass with the least G so far.
///   falls     of each branch: the most below the largest value at a smaller depth.
///   meeting   where loading − unloading changes its sign, between two depths on the straight line.
///
///   std::puts(to_string(check_curve(liver_hysteresis<double>())).c_str());
///
/// Units      [m], [N], [J]
/// Invariant  Throws `InvalidArgument` for a range without extent, fewer than 3 depths, or a force that is not finite.
/// Cost       Offline: one evaluation of each branch a depth; allocates.
/// Limits     What lies between two depths is not seen; an energy errs by the square of their distance.
template <class Curve, RealScalar S>
  requires ForceCurve<Curve, S>
CurveReport<S> check_curve(Curve curve, DepthRange<S> range, std::type_identity_t<CurveCheck<S>> const& options = {}) {
  range.validate("check_curve");
  detail::OptionCheck const require{"CurveCheck"};
  require(options.depths >= 3, ".depths", options.depths, "give three or more");
  require.not_negative(".tolerance", options.tolerance, " N");

  std::size_t const count = static_cast<std::size_t>(options.depths);
  detail::CurveSamples samples;
  double largest = 0.0;
  for (std::size_t k = 0; k < count; ++k) {
    double const share = double(k) / double(count - 1);
    S const depth = k + 1 == count ? range.high : static_cast<S>(double(range.low) + (double(range.high) - double(range.low)) * share);
    samples.depth.push_back(double(depth));
    for (Phase const phase : {Phase::loading, Phase::unloading}) {
      S const force = detail::evaluate_curve<S>(curve, depth, phase);
      if (!std::isfinite(force))
        throw InvalidArgument(detail::message("check_curve: the curve is ", force, " N at ", depth, " m, ", to_string(phase),
                                              "; a force curve is finite at every depth"));
      (phase == Phase::loading ? samples.loading : samples.unloading).push_back(double(force));
      largest = std::max(largest, std::abs(double(force)));
    }
  }
  double const tolerance = options.tolerance > S(0) ? double(options.tolerance) : 64 * double(std::numeric_limits<S>::epsilon()) * largest;

  CurveReport<S> report{.range = range, .depths = options.depths, .has_hysteresis = HysteresisCurve<Curve, S>};
  report.loading_fall = samples.fall<S>(samples.loading, tolerance);
  report.unloading_fall = samples.fall<S>(samples.unloading, tolerance);
  report.below_zero = samples.largest<S>(tolerance, [&](std::size_t k) { return -std::min(samples.loading[k], samples.unloading[k]); });
  report.excess = samples.largest<S>(tolerance, [&](std::size_t k) { return -samples.gap(k); });
  report.widest = samples.largest<S>(tolerance, [&](std::size_t k) { return samples.gap(k); });
  report.gap_low = static_cast<S>(samples.gap(0));
  report.gap_high = static_cast<S>(samples.gap(count - 1));
  if (report.has_hysteresis) report.meets = samples.meets<S>(tolerance);

  double taken = 0.0, returned = 0.0, least = 0.0, gain = 0.0;   // returned: G, beyond what was taken, from the low end on
  double low = samples.depth.front();
  for (std::size_t k = 1; k < count; ++k) {
    double const half = (samples.depth[k] - samples.depth[k - 1]) / 2;
    taken += half * (samples.loading[k] + samples.loading[k - 1]);
    returned -= half * (samples.gap(k) + samples.gap(k - 1));
    if (returned - least > gain && returned - least > tolerance * (samples.depth[k] - low)) {
      gain = returned - least;
      report.gain = {static_cast<S>(gain), static_cast<S>(low), static_cast<S>(samples.depth[k])};
    }
    if (returned < least) {
      least = returned;
      low = samples.depth[k];
    }
  }
  report.taken = static_cast<S>(taken);
  report.lost = static_cast<S>(-returned);
  return report;
}

/// A curve that says from where to where it is good.
template <class Curve>
concept StatesRange = requires(Curve const& curve) { curve.range().low; };

/// The same over the range that the curve says it is good for.
template <StatesRange Curve>
auto check_curve(Curve curve) {
  auto const range = curve.range();
  return check_curve(std::move(curve), range);
}

/// Some lines for a person, depths in mm; what is wrong is marked with an exclamation mark.
template <RealScalar S>
std::string to_string(CurveReport<S> const& report) {
  auto const number = [](S value, double factor = 1.0) {
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", double(value) * factor);
    return std::string(text);
  };
  auto const mm = [&](S depth) { return number(depth, 1e3) + " mm"; };
  auto const fall = [&](char const* branch, CurveFinding<S> const& finding) {
    if (!(finding.size > S(0))) return detail::message("  ", branch, " rises with depth or rests everywhere\n");
    return detail::message("! ", branch, " falls: up to ", number(finding.size), " N below a smaller depth, most at ", mm(finding.depth), "\n");
  };
  std::string text = detail::message("force curve, ", number(report.range.low, 1e3), " … ", mm(report.range.high), " at ", report.depths, " depths",
                                     report.has_hysteresis ? "" : ", no hysteresis", "\n");
  text += fall(report.has_hysteresis ? "loading" : "the curve", report.loading_fall);
  if (report.has_hysteresis) text += fall("unloading", report.unloading_fall);
  text += report.below_zero.size > S(0)
              ? detail::message("! pulls into the tissue: up to ", number(report.below_zero.size), " N, most at ", mm(report.below_zero.depth), "\n")
              : std::string("  pushes out of the tissue or is zero everywhere\n");
  if (!report.has_hysteresis) return text + "  returns all energy: there is one branch\n";

  text += report.excess.size > S(0)
              ? detail::message("! unloading exceeds loading: up to ", number(report.excess.size), " N, most at ", mm(report.excess.depth), "\n")
              : std::string("  unloading never exceeds loading\n");
  text += report.is_passive() ? std::string("  no cycle returns more energy than it takes\n")
                              : detail::message("! a cycle returns more energy than it takes: ", number(report.gain.low, 1e3), " … ",
                                                mm(report.gain.high), " gains ", number(report.gain.energy), " J, the most of all\n");
  text += detail::message("  whole range: ", number(report.taken), " J taken, ", number(report.lost), " J of it lost\n");
  text += report.widest.size > S(0) ? detail::message("  loop widest: ", number(report.widest.size), " N at ", mm(report.widest.depth), "\n")
                                    : std::string("  no loop is open\n");
  text += "  loading and unloading meet";
  if (report.meets.empty()) text += " nowhere";
  for (std::size_t k = 0; k < report.meets.size(); ++k) {
    auto const& meet = report.meets[k];
    text += k == 0 ? "" : ",";
    text += meet.low < meet.high ? detail::message(" from ", number(meet.low, 1e3), " to ", mm(meet.high)) : detail::message(" at ", mm(meet.low));
  }
  return text + detail::message("; at the ends loading − unloading is ", number(report.gap_low), " and ", number(report.gap_high), " N\n");
}

}  // namespace palpate
