// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>

#include <cmath>

namespace palpate {

struct SampledMassOptions {
  double mass = 0.075;      ///< m [kg], apparent at the tip
  double damping = 0.1;     ///< b [N·s/m], of the mechanics
  double stiffness = 0.0;   ///< k [N/m], of a spring to a place that may move; 0: none
  double rate = 1000.0;     ///< Hz, ticks a second
};

/// A mass with damper and spring under zero-order hold, a force held for a tick as a servo holds it: exact discretisation by the matrix
/// exponential.
///   m ẍ + b ẋ + k (x − r) = F,   F and r constant within a tick
///   (x, v)⁺ = Φ (x − r, v) + (r, 0) + Γ F,   Φ = e^(A T),   Γ = ∫ e^(A s) ds (0, 1/m),   A = (0 1; −k/m −b/m)
/// Units      SI; the axes are alike and independent.
/// Source     zero-order hold, \cite franklin1998 ch. 4. Integration by small steps would shift the stiffness at which a wall becomes
///            unstable.
/// Invariant  m > 0, b ≥ 0, k ≥ 0, rate > 0, all finite; checked at set-up. Exact to rounding for every tick length.
/// Cost       Four products a component; noexcept, no allocation: allowed in the servo tick.
template <RealScalar S>
class SampledMass {
 public:
  using Scalar = S;

  explicit SampledMass(SampledMassOptions const& options = {}) : options_(options) {
    detail::OptionCheck const require{"SampledMass", true};
    require.positive(".mass", options.mass, " kg");
    require.not_negative(".damping", options.damping, " N·s/m");
    require.not_negative(".stiffness", options.stiffness, " N/m");
    require(options.rate > 0.0, ".rate", options.rate, " Hz", "give the rate of the servo, 1000 for most");
    discretise();
  }

  /// One tick on, under a force [N], with the spring's other end at `rest`.
  void step(Vector3<S>& position, Vector3<S>& velocity, Vector3<S> const& force, Vector3<S> const& rest = Vector3<S>::Zero()) const noexcept {
    Vector3<S> const x = options_.stiffness > 0.0 ? Vector3<S>(position - rest) : position;
    Vector3<S> const next = x_of_x_ * x + x_of_v_ * velocity + x_of_force_ * force;
    velocity = v_of_x_ * x + v_of_v_ * velocity + v_of_force_ * force;
    position = options_.stiffness > 0.0 ? Vector3<S>(next + rest) : next;
  }

  SampledMassOptions const& options() const noexcept { return options_; }

 private:
  /// The exponential of (A B; 0 0) T by scaling and squaring of its series.
  void discretise() {
    using Rows = std::array<std::array<double, 3>, 2>;   // the third is zero
    auto const each = [](Rows& rows, auto const& change) {
      for (auto& row : rows)
        for (double& number : row) change(number);
    };
    auto const product = [](Rows const& a, Rows const& b) {
      Rows ab{};
      for (std::size_t i = 0; i < 2; ++i)
        for (std::size_t j = 0; j < 3; ++j) ab[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j];
      return ab;
    };
    Rows step{{{0.0, 1.0, 0.0}, {-options_.stiffness / options_.mass, -options_.damping / options_.mass, 1.0 / options_.mass}}};
    double largest = 0.0;
    bool finite = true;
    each(step, [&](double& number) {
      number /= options_.rate;
      finite = finite && std::isfinite(number);
      largest = std::max(largest, std::abs(number));
    });
    if (!finite)
      throw InvalidArgument(detail::message("SampledMass: stiffness and damping over a mass of ", options_.mass, " kg are too large to compute; give a larger mass"));
    int squarings = 0;
    for (; largest > 0.125; largest /= 2.0) ++squarings;
    each(step, [&](double& number) { number = std::ldexp(number, -squarings); });
    Rows rest{}, term{{{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}}};   // rest: e^step − 1, what it differs from one is kept to the last digit
    for (int k = 1; k <= 16; ++k) {
      term = product(term, step);
      each(term, [&](double& number) { number /= k; });
      for (std::size_t i = 0; i < 6; ++i) rest[i / 3][i % 3] += term[i / 3][i % 3];
    }
    for (int k = 0; k < squarings; ++k) {
      Rows const square = product(rest, rest);
      for (std::size_t i = 0; i < 6; ++i) rest[i / 3][i % 3] = 2.0 * rest[i / 3][i % 3] + square[i / 3][i % 3];
    }
    x_of_x_ = S(1.0 + rest[0][0]), x_of_v_ = S(rest[0][1]), x_of_force_ = S(rest[0][2]);
    v_of_x_ = S(rest[1][0]), v_of_v_ = S(1.0 + rest[1][1]), v_of_force_ = S(rest[1][2]);
  }

  SampledMassOptions options_;
  S x_of_x_ = S(1), x_of_v_ = S(0), x_of_force_ = S(0);
  S v_of_x_ = S(0), v_of_v_ = S(1), v_of_force_ = S(0);
};

}  // namespace palpate
