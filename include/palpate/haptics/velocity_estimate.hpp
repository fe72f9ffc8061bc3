// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/force/concept.hpp>

#include <algorithm>
#include <array>
#include <cstddef>

namespace palpate {

/// The velocity of a tip [m/s] from its positions [m], one a servo tick. Beyond the syntax: no allocation; the first position gives zero; a
/// position that is no number gives zero and begins anew, as `reset()` does.
template <class T, class Scalar>
concept VelocityEstimator = RealScalar<Scalar> && requires(T& estimator, Vector3<Scalar> const& position) {
  { estimator(position) } noexcept -> detail::Vector3Of<Scalar>;
  { estimator.reset() } noexcept;
};

/// Refinement: an estimator that takes over what a session's device is: `begin_session(period, quantum)`, T [s] between two positions and Δ [m] of rounded
/// ones, 0 where it is not known.
template <class T>
concept AdaptsToDevice = requires(T& estimator) { estimator.begin_session(0.001, 55e-6); };

struct VelocityOptions {
  double period = 0.001;   ///< T [s], between two positions
};

struct AdaptiveVelocityOptions {
  double period = 0.001;     ///< T [s], between two positions
  double quantum = 55e-6;    ///< Δ [m], of rounded positions, else twice the largest error: so far they may lie off a line through two of them
};

namespace detail {

/// The last positions, the newest first.
template <RealScalar S, int Capacity>
class LastPositions {
 public:
  LastPositions() { at_.fill(Vector3<S>::Zero()); }

  void push(Vector3<S> const& position) noexcept {
    newest_ = newest_ == 0 ? Capacity - 1 : newest_ - 1;
    at_[static_cast<std::size_t>(newest_)] = position;
    count_ = std::min(count_ + 1, Capacity);
  }
  Vector3<S> const& operator[](int ago) const noexcept {
    int const i = newest_ + ago;
    return at_[static_cast<std::size_t>(i < Capacity ? i : i - Capacity)];
  }
  int count() const noexcept { return count_; }
  void clear() noexcept { count_ = 0; }

  /// By how much they move in a tick: slope of the straight line that fits the newest `count` ones best, by least squares.
  ///   Σ (n − 1 − 2 i) x_i · 6 / (n (n² − 1)),   i ticks ago, n positions
  Vector3<S> slope(int count) const noexcept {
    if (count < 2) return Vector3<S>::Zero();
    Vector3<S> sum = Vector3<S>::Zero();
    for (int i = 0; 2 * i < count - 1; ++i) sum += S(count - 1 - 2 * i) * ((*this)[i] - (*this)[count - 1 - i]);
    return S(6) / (S(count) * (S(count) * S(count) - S(1))) * sum;
  }

 private:
  std::array<Vector3<S>, static_cast<std::size_t>(Capacity)> at_{};
  int newest_ = 0, count_ = 0;
};

/// What estimators from a window of positions share: the period T [s] between two of them.
template <RealScalar S, int Capacity>
class PositionWindow {
 public:
  using Scalar = S;

  PositionWindow(char const* who, double period) : who_(who) { begin_session(period, 0.0); }

  void begin_session(double period, double) {
    OptionCheck{who_, true}(period > 0.0, ".period", period, " s", "give that of the servo, 0.001 for most");
    period_ = period;
    reset();
  }
  void reset() noexcept { last_.clear(); }

 protected:
  /// False for a position that is no number: then there are none.
  bool take(Vector3<S> const& position) noexcept {
    if (is_finite(position))
      last_.push(position);
    else
      reset();
    return last_.count() > 0;
  }

  LastPositions<S, Capacity> last_;
  double period_ = 0.0;

 private:
  char const* who_;
};

}  // namespace detail

/// The way over the last `Span` ticks by their time.
///   v = (x − x₋ₛ) / (Span · T)
/// Units      SI.
/// Invariant  Exact at constant velocity, Span T/2 late at constant acceleration. An error of up to ±e of each position makes up to 2 e/(Span T),
///            and no estimate from as many ticks is sure to be nearer: steps of 55 µm make 55 mm/s over one tick, 3.7 mm/s over 15.
/// Cost       noexcept, no allocation: allowed in the servo tick. While there are fewer positions, over those.
template <RealScalar S, int Span = 1>
class BackwardDifference : public detail::PositionWindow<S, Span + 1> {
  static_assert(Span >= 1, "palpate::BackwardDifference: give a span of one tick or more.");
  using Window = detail::PositionWindow<S, Span + 1>;
  using Window::last_;

 public:
  explicit BackwardDifference(VelocityOptions const& options = {}) : Window("BackwardDifference", options.period) {}

  Vector3<S> operator()(Vector3<S> const& position) noexcept {
    int const span = Window::take(position) ? last_.count() - 1 : 0;
    return span > 0 ? Vector3<S>((last_[0] - last_[span]) / S(span * Window::period_)) : Vector3<S>(Vector3<S>::Zero());
  }
};

/// The slope of the straight line that fits the last `Samples` positions best.
///   v = Σ (n − 1 − 2 i) x_i · 6 / (n (n² − 1) T),   i ticks ago, n = Samples
/// Units      SI.
/// Source     \cite savitzky1964, of degree one.
/// Invariant  Exact at constant velocity, (n − 1) T/2 late at constant acceleration. Errors of ±e of each position make up to 3 e n/((n² − 1) T),
///            or 3 e/(n T) where n is odd; independent ones of deviation σ make σ √12/(T √(n (n² − 1))), from n = 4 on less than a difference over
///            the same time does.
/// Cost       n/2 products; noexcept, no allocation: allowed in the servo tick. While there are fewer positions, from those.
template <RealScalar S, int Samples = 16>
class WindowedVelocity : public detail::PositionWindow<S, Samples> {
  static_assert(Samples >= 2, "palpate::WindowedVelocity: a line needs two positions or more.");
  using Window = detail::PositionWindow<S, Samples>;

 public:
  explicit WindowedVelocity(VelocityOptions const& options = {}) : Window("WindowedVelocity", options.period) {}

  Vector3<S> operator()(Vector3<S> const& position) noexcept {
    return Window::take(position) ? Vector3<S>(Window::last_.slope(Window::last_.count()) / S(Window::period_)) : Vector3<S>(Vector3<S>::Zero());
  }
};

/// The slope over as many of the last positions as lie on one straight line, but for their error: the window is long at rest and at constant
/// velocity, where noise would be felt, and short where the velocity changes, where lateness would be.
///   n < Samples, up to the first that would not do:   |x_i − (x_0 + (x_n − x_0) i/n)| ≤ Δ on each axis,   0 < i < n;   v = slope of the best fit of x_0 … x_n
/// Units      SI.
/// Source     \cite janabi2000, with one window for all axes, so that the direction is right. There Δ bounds the error; twice it does here, so that
///            errors alone never shorten the window.
/// Invariant  Δ, T > 0, finite; checked at set-up. Errors of ±Δ/2 leave the window whole at constant velocity. At an acceleration a it is
///            about √(8 Δ/a) long, and v half of that late.
/// Cost       Up to Samples²/2 comparisons where the whole window fits, 0.4 µs for 16; noexcept, no allocation: allowed in the servo tick.
template <RealScalar S, int Samples = 16>
class AdaptiveWindowVelocity : public detail::PositionWindow<S, Samples> {
  static_assert(Samples >= 2, "palpate::AdaptiveWindowVelocity: a line needs two positions or more.");
  using Window = detail::PositionWindow<S, Samples>;
  using Window::last_;

 public:
  explicit AdaptiveWindowVelocity(AdaptiveVelocityOptions const& options = {})
      : Window("AdaptiveWindowVelocity", options.period), quantum_(options.quantum), stated_(options.quantum) {
    detail::OptionCheck{"AdaptiveWindowVelocity", true}(quantum_ > 0.0, ".quantum", quantum_, " m", "give the device's resolution, 55e-6 for many");
  }

  Vector3<S> operator()(Vector3<S> const& position) noexcept {
    window_ = Window::take(position) ? std::min(last_.count() - 1, 1) : 0;
    while (window_ + 1 < last_.count() && is_straight(window_ + 1)) ++window_;
    return last_.slope(window_ + 1) / S(Window::period_);
  }

  /// A step that is not known leaves that of the options.
  void begin_session(double period, double quantum) {
    double const stated = stated_;
    *this = AdaptiveWindowVelocity({.period = period, .quantum = quantum > 0.0 ? quantum : stated});
    stated_ = stated;
  }

  /// Over how many ticks the last estimate went: from 1 to Samples − 1, 0 before there was one.
  int window() const noexcept { return window_; }
  void reset() noexcept {
    Window::reset();
    window_ = 0;
  }

 private:
  bool is_straight(int n) const noexcept {
    S const most = S(quantum_) * S(1.001);   // positions are rounded themselves
    Vector3<S> const step = (last_[n] - last_[0]) / S(n);
    for (int i = 1; i < n; ++i)
      if (!((last_[i] - last_[0] - S(i) * step).cwiseAbs().maxCoeff() <= most)) return false;
    return true;
  }

  double quantum_, stated_;   // in this session; of the options
  int window_ = 0;
};

}  // namespace palpate
