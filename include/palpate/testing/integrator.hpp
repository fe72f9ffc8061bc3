// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/padded_view.hpp>
#include <palpate/integrator/concept.hpp>
#include <palpate/integrator/measured_stability.hpp>
#include <palpate/testing/violations.hpp>

#include <cmath>
#include <limits>
#include <utility>

namespace palpate::testing {

/// Two particles that pull at each other and at their homes, with damping: a System to try integrators on.
///   a = −κ x − β |x|² x − γ v + λ (x′ − x) + μ (v′ − v) + g,  x′, v′ the other particle
/// Nothing in it is special: not linear, not symmetric, damped by itself and by the other, under a constant force. As a body it hands out views of padded
/// columns; scratch() is NaN at the start of each step.
class TwoParticles {
 public:
  using Scalar = double;
  using Matrix = Matrix3X<double>;

  TwoParticles() {
    for (Padded* columns : {&x_, &v_, &memory_}) columns->setZero();
    for (Padded& columns : scratch_) columns.setZero();
    positions() << 0.3, -0.2, 0.1, 0.4, -0.5, 0.2;
    velocities() << -0.4, 0.6, 0.8, -0.1, 0.3, -0.7;
  }

  StridedView<double> positions() { return view(x_); }
  StridedView<double> velocities() { return view(v_); }
  template <class X, class V>
  Matrix acceleration(Eigen::MatrixBase<X> const& x, Eigen::MatrixBase<V> const& v) const {
    Matrix const at = x.template topRows<3>(), speed = v.template topRows<3>();
    Matrix a(3, 2);
    for (int i = 0; i < 2; ++i)
      a.col(i) = -4.0 * at.col(i) - 1.5 * at.col(i).squaredNorm() * at.col(i) - 0.6 * speed.col(i) +
                 3.0 * (at.col(1 - i) - at.col(i)) + 0.5 * (speed.col(1 - i) - speed.col(i)) + Vector3<double>(0.2, -0.3, -1.0 - i);
    return a;
  }
  template <class X, class V, class Out>
  void acceleration(Eigen::MatrixBase<X> const& x, Eigen::MatrixBase<V> const& v, Out&& out) const {
    out.template topRows<3>() = acceleration(x, v);
  }
  /// C as it is; of K the same for every direction, so not quite the derivative of the forces: an integrator has to stand that.
  void linearise() { at_ = positions(); }
  template <class D, class Out>
  void multiply_tangent(double m, double c, double k, D const& d, Out&& out) const {
    for (int i = 0; i < 2; ++i)
      out.col(i) = (m + 1.1 * c + k * own_stiffness(i)) * d.col(i) - (0.5 * c + 3.0 * k) * d.col(1 - i);
  }
  template <class Out>
  void tangent_diagonal(double m, double c, double k, Out&& out) const {
    for (int i = 0; i < 2; ++i) out.col(i).setConstant(m + 1.1 * c + k * own_stiffness(i));
  }
  StridedView<double> scratch(int k) { return view(scratch_[k]); }
  StridedView<double> previous_acceleration() { return view(memory_); }
  bool remembers() const { return remembers_; }

  template <Integrator I>
  void advance(I const& integrator, double h) {
    for (Padded& columns : scratch_) view(columns).setConstant(std::numeric_limits<double>::quiet_NaN());
    integrator.step(*this, h);
    remembers_ = true;
  }

  /// The end of a second, from many steps of the midpoint rule, extrapolated five times: good to 1e-13.
  static Matrix reference_positions() {
    constexpr int rows = 6;
    Matrix table[rows];
    for (int row = 0; row < rows; ++row) {
      int const steps = 32 << row;
      double const h = 1.0 / steps;
      TwoParticles p;
      Matrix last_x = p.positions(), last_v = p.velocities();
      Matrix x = last_x + h * last_v, v = last_v + h * p.acceleration(last_x, last_v);
      for (int k = 1; k < steps; ++k) {
        Matrix next_x = last_x + 2 * h * v, next_v = last_v + 2 * h * p.acceleration(x, v);
        last_x = std::exchange(x, next_x);
        last_v = std::exchange(v, next_v);
      }
      table[row] = (last_x + x + h * v) / 2;
      for (int k = row - 1; k >= 0; --k) table[k] = (table[k + 1] + (table[k + 1] - table[k]) / (std::pow(4.0, row - k) - 1)).eval();
    }
    return table[0];
  }

 private:
  using Padded = palpate::Matrix<double, 4, 2>;
  static StridedView<double> view(Padded& columns) { return {columns.data(), 3, 2}; }
  double own_stiffness(int i) const { return 7.0 + 1.5 * at_.col(i).squaredNorm(); }

  Padded x_, v_, memory_, scratch_[12];
  Matrix at_;
  bool remembers_ = false;
};

/// How far from where they should be an integrator leaves TwoParticles after a second with steps h [m].
template <Integrator I>
double measured_error(I const& integrator, double h) {
  TwoParticles system;
  int const steps = static_cast<int>(std::lround(1.0 / h));
  for (int k = 0; k < steps; ++k) system.advance(integrator, 1.0 / steps);
  return (system.positions() - TwoParticles::reference_positions()).norm();
}
/// The order that it shows: log₂ of the ratio of its errors with steps h and h/2.
template <Integrator I>
double measured_order(I const& integrator, double h = 1.0 / 64) {
  return std::log2(measured_error(integrator, h) / measured_error(integrator, h / 2));
}

/// Checks an integrator: nothing of scratch() is used that a step has not written; a step of zero changes no bit; runs
/// from the same state agree to the bit; the error shrinks as h^order, or as h where it states none, damping and the first
/// step included; where it states a stable step, no mode of x″ = −κ x − γ x′ within the bounds grows at 0.999 times that
/// step. A higher order than stated is no violation, nor are 10⁻⁸ m whatever the step: where an order is lost in rounding
/// at 1/128 s, longer steps are looked at.
template <Integrator I>
Violations check_integrator(I const& integrator) {
  using palpate::detail::message;
  Violations found;
  {
    TwoParticles system;
    system.advance(integrator, 0.01);
    Matrix3X<double> const x = system.positions(), v = system.velocities();
    system.advance(integrator, 0.0);
    if (!is_finite(system.positions()) || !is_finite(system.velocities()))
      return {"positions or velocities are not finite after a step; scratch(k) has undefined contents at its start"};
    if (system.positions() != x || system.velocities() != v) found.push_back("a step of zero moves the particles");
    for (int run = 0; run < 2; ++run) {   // one of them after an odd number of steps, one after an even
      TwoParticles again;
      again.advance(integrator, 0.01);
      if (again.positions() == x && again.velocities() == v) continue;
      found.push_back("two runs from the same state differ");
      break;
    }
  }
  if constexpr (StatesOrder<I>) {
    // A high order shows in long steps alone: in short ones the error is rounding's, and the reference's.
    for (int steps = 64; steps > 1; steps /= 2) {
      double const order = measured_order(integrator, 1.0 / steps);
      if (order > I::order - (steps == 64 ? 0.1 : 0.5)) break;
      if (measured_error(integrator, 0.5 / steps) <= 1e-8) continue;
      found.push_back(message("the order is ", int{I::order}, " but the error shrinks as h^", order, " from h = 1/", steps,
                              " s to 1/", 2 * steps, " s"));
      break;
    }
  } else if (double const order = measured_order(integrator);
             !(order > 0.9) && !(measured_error(integrator, 1.0 / 128) <= 1e-8)) {
    found.push_back(message("the error does not shrink with the step: as h^", order, " from h = 1/64 s to 1/128 s"));
  }
  if constexpr (StatesStableStep<I>) {
    for (double const stiffness : {0.0, 1.0, 1e6})
      for (double const damping : {0.0, 0.3, 2.0, 2e3})
        for (double const least : {0.0, 0.5 * damping, damping}) {
          double const h = integrator.stable_step(ModalBounds<double>{stiffness, damping, least});
          if (!(h >= 0)) {
            found.push_back(message("stable_step({", stiffness, ", ", damping, ", ", least, "}) is ", h, " s"));
            continue;
          }
          if (h == 0 || !std::isfinite(h)) continue;
          double worst = 0, worst_stiffness = 0, worst_damping = 0;
          for (double const share : {1.0, 0.7, 0.3, 0.1, 1e-2, 1e-3})
            for (double const gamma : {least, (least + damping) / 2, damping})
              if (double const growth = amplification(integrator, share * stiffness, gamma, 0.999 * h); !(growth <= worst))
                worst = growth, worst_stiffness = share * stiffness, worst_damping = gamma;
          if (!(worst < 1 + 1e-9))
            found.push_back(message("stable_step({", stiffness, ", ", damping, ", ", least, "}) is ", h, " s, but the mode x'' = -",
                                    worst_stiffness, " x - ", worst_damping, " x' grows ", worst, " times a step there"));
        }
  }
  return found;
}

/// For what is no integrator: says why.
template <class I>
Violations check_integrator(I const&) {
  static_assert(sizeof(palpate::detail::IntegratorSentences<I, double>) > 0);
  return {};
}

}  // namespace palpate::testing
