// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/integrator/concept.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {

namespace detail {

/// Three copies of an oscillator x″ = −κ x − γ x′, one a row, started at x = 1, at v = 1, and with a remembered acceleration of 1. After
/// a step the rows are the columns of the integrator's amplification matrix.
template <RealScalar S>
class OscillatorSystem {
 public:
  using Scalar = S;
  using Matrix = Matrix3X<Scalar>;

  OscillatorSystem(Scalar stiffness, Scalar damping) : stiffness_(stiffness), damping_(damping) {
    x_ = Vector3<Scalar>::Unit(0);
    v_ = Vector3<Scalar>::Unit(1);
    memory_ = Vector3<Scalar>::Unit(2);
    fallback_ = memory_;
  }

  Matrix& positions() { return x_; }
  Matrix& velocities() { return v_; }
  template <class X, class V>
  Matrix acceleration(X const& x, V const& v) const {
    return -stiffness_ * x - damping_ * v;
  }
  template <class X, class V>
  void acceleration(X const& x, V const& v, Matrix& out) const {
    out = -stiffness_ * x - damping_ * v;
  }
  void linearise() {}
  template <class D, class Out>
  void multiply_tangent(Scalar m, Scalar c, Scalar k, D const& d, Out&& out) const {
    out = (m + c * damping_ + k * stiffness_) * d;
  }
  template <class Out>
  void tangent_diagonal(Scalar m, Scalar c, Scalar k, Out&& out) const {
    out.setConstant(m + c * damping_ + k * stiffness_);
  }
  Matrix& scratch(int k) {
    scratch_[k].resize(3, 1);
    return scratch_[k];
  }
  Matrix& previous_acceleration() { return memory_; }
  bool remembers() const { return true; }

  /// Column j: what basis state j = (x, v, a₋) became.
  palpate::Matrix<Scalar, 3, 3> amplification() const {
    palpate::Matrix<Scalar, 3, 3> a;
    bool const wrote_memory = memory_ != fallback_;
    for (int j = 0; j < 3; ++j) a.col(j) = Vector3<Scalar>(x_(j, 0), v_(j, 0), wrote_memory ? memory_(j, 0) : Scalar(0));
    return a;
  }

 private:
  Scalar stiffness_, damping_;
  Matrix x_, v_, memory_, fallback_;
  Matrix scratch_[12];
};

}  // namespace detail

/// Spectral radius of the integrator's amplification matrix on x″ = −κ x − γ x′ (κ [1/s²], γ [1/s]) with step h [s]:
/// at most 1 where it is stable. By repeated squaring: ‖Aᴺ‖^(1/N), N = 2⁵², so that a modulus of 1 shows to 1e-14.
template <Integrator I>
double amplification(I const& integrator, double stiffness, double damping, double h) {
  // Velocities in units of 1/h and accelerations in 1/h², so that the entries are of one size.
  detail::OscillatorSystem<double> system(stiffness * h * h, damping * h);
  integrator.step(system, 1.0);
  Matrix<double, 3, 3> a = system.amplification();
  double log_growth = 0.0, steps = 1.0;
  for (int k = 0; k < 52; ++k) {
    double const size = a.cwiseAbs().maxCoeff();
    if (!(size > 0)) return 0.0;
    if (!std::isfinite(size)) return std::numeric_limits<double>::infinity();
    a /= size;
    log_growth += std::log(size) / steps;
    a = (a * a).eval();
    steps *= 2;
  }
  return std::exp(log_growth);
}

/// The largest step [s] at which no mode within the bounds grows, measured on single oscillators; for an integrator that states none.
/// Sampled modes: κ from the largest down to 10⁻⁴ of it, γ least, largest and between. A growth below 1e-9 a step counts as none.
/// 0 where no step above a thousandth of the fastest mode's time is stable.
template <Integrator I>
double measured_stable_step(I const& integrator, ModalBounds<double> const& modes) {
  double const fastest = std::max(std::sqrt(modes.squared_frequency), modes.decay_rate);
  if (!(fastest > 0)) return std::numeric_limits<double>::infinity();
  auto const stable = [&](double h) {
    for (double const share : {1.0, 0.5, 0.2, 0.05, 1e-2, 1e-4})
      for (double const damping : {modes.min_decay_rate, std::sqrt(modes.min_decay_rate * modes.decay_rate), modes.decay_rate})
        if (amplification(integrator, share * modes.squared_frequency, damping, h) > 1.0 + 1e-9) return false;
    return true;
  };
  double low = 0.0, high = 8.0 / fastest;
  for (int k = 0; k < 24; ++k) {
    double const middle = (low + high) / 2;
    (stable(middle) ? low : high) = middle;
  }
  return low < 1e-3 / fastest ? 0.0 : low;
}

}  // namespace palpate
