// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/fitting/measurements.hpp>
#include <palpate/force/exponential_contact.hpp>
#include <palpate/force/hunt_crossley_contact.hpp>
#include <palpate/force/indentation_spring.hpp>
#include <palpate/force/polynomial_contact.hpp>

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

/// A coefficient that a model looks for.
struct ModelParameter {
  std::string name;
  std::string unit;    ///< "" for a pure number
  double lower = 0.0;  ///< it is not below this
};

/// What can be fitted to measurements with `fit`: a formula with parameters, and the force model that it becomes.
///   name(), parameters()       what it is called, and what it looks for
///   takes(measurements)        the measurements that it stands for
///   start(measurements)        parameters to start from
///   force(p, m)                its force at a measurement's depth, speed and phase [N]
///   gradient(p, m, g)          the derivative of that by each parameter
///   law(p, depths)             the force model; depths is what was measured
template <class Model>
concept FittedModel = requires(Model const& model, std::span<Measurement const> measurements, Measurement const& m, Eigen::VectorXd const& p,
                               Eigen::Ref<Eigen::RowVectorXd> g, MeasuredRange const& depths) {
  { model.name() } -> std::convertible_to<std::string_view>;
  { model.parameters() } -> std::convertible_to<std::vector<ModelParameter>>;
  { model.takes(measurements) } -> std::convertible_to<std::vector<Measurement>>;
  { model.start(measurements) } -> std::convertible_to<Eigen::VectorXd>;
  { model.force(p, m) } -> std::convertible_to<double>;
  model.gradient(p, m, g);
  model.law(p, depths);
};

/// A model with a `tip_depth` [m] that is given, not fitted: a preset keeps it beside the coefficients.
template <class Model>
concept HasTipDepth = FittedModel<Model> && std::same_as<decltype(Model::tip_depth), double>;

namespace detail {

/// The measurements of tissue that resists a tool it is not punctured by: those before the puncture; those of a test without one, else.
/// On the way in alone, unless the law knows of speed.
inline std::vector<Measurement> contact_measurements(std::span<Measurement const> measurements, bool on_the_way_back) {
  bool const punctures = std::any_of(measurements.begin(), measurements.end(), [](auto const& m) { return m.phase == MeasuredPhase::indenting; });
  std::vector<Measurement> taken;
  for (Measurement const& m : measurements)
    if (punctures ? m.phase == MeasuredPhase::indenting : on_the_way_back || m.phase == MeasuredPhase::loading) taken.push_back(m);
  return taken;
}

/// The slope of the line through the origin nearest to values over depths.
template <class Value>
double slope_over_depth(std::span<Measurement const> measurements, Value const& value) {
  double product = 0.0, square = 0.0;
  for (Measurement const& m : measurements) product += m.depth * value(m), square += m.depth * m.depth;
  return square > 0.0 ? product / square : 0.0;
}

}  // namespace detail

/// F = k d. Becomes an `IndentationSpring`.
struct LinearModel {
  std::string_view name() const noexcept { return "linear"; }
  std::vector<ModelParameter> parameters() const { return {{"k", "N/m"}}; }
  std::vector<Measurement> takes(std::span<Measurement const> measurements) const { return detail::contact_measurements(measurements, false); }
  Eigen::VectorXd start(std::span<Measurement const>) const { return Eigen::VectorXd::Zero(1); }
  double force(Eigen::VectorXd const& p, Measurement const& m) const noexcept { return p[0] * m.depth; }
  void gradient(Eigen::VectorXd const&, Measurement const& m, Eigen::Ref<Eigen::RowVectorXd> g) const noexcept { g[0] = m.depth; }
  IndentationSpring<double> law(Eigen::VectorXd const& p, MeasuredRange const&) const noexcept { return {.stiffness = p[0]}; }
};

/// F = k₁ d + k₂ d² + k₃ d³, no coefficient negative. Becomes a `PolynomialContact`.
struct PolynomialModel {
  std::string_view name() const noexcept { return "polynomial"; }
  std::vector<ModelParameter> parameters() const { return {{"k1", "N/m"}, {"k2", "N/m^2"}, {"k3", "N/m^3"}}; }
  std::vector<Measurement> takes(std::span<Measurement const> measurements) const { return detail::contact_measurements(measurements, false); }
  Eigen::VectorXd start(std::span<Measurement const>) const { return Eigen::VectorXd::Zero(3); }
  double force(Eigen::VectorXd const& p, Measurement const& m) const noexcept { return m.depth * (p[0] + m.depth * (p[1] + m.depth * p[2])); }
  void gradient(Eigen::VectorXd const&, Measurement const& m, Eigen::Ref<Eigen::RowVectorXd> g) const noexcept {
    double power = 1.0;
    for (Eigen::Index k = 0; k < 3; ++k) g[k] = power *= m.depth;
  }
  PolynomialContact<double> law(Eigen::VectorXd const& p, MeasuredRange const&) const noexcept { return {.linear = p[0], .quadratic = p[1], .cubic = p[2]}; }
};

/// F = a (e^(b d) − 1), after Fung. Becomes an `ExponentialContact`.
struct ExponentialModel {
  std::string_view name() const noexcept { return "exponential"; }
  std::vector<ModelParameter> parameters() const { return {{"a", "N"}, {"b", "1/m"}}; }
  std::vector<Measurement> takes(std::span<Measurement const> measurements) const { return detail::contact_measurements(measurements, false); }
  /// b d = 2 at the deepest, and the largest force there.
  Eigen::VectorXd start(std::span<Measurement const> measurements) const {
    double const deepest = std::max(depths_of(measurements).high, std::numeric_limits<double>::min());
    double largest = 0.0;
    for (Measurement const& m : measurements) largest = std::max(largest, m.force);
    return Eigen::Vector2d(largest / std::expm1(2.0), 2.0 / deepest);
  }
  double force(Eigen::VectorXd const& p, Measurement const& m) const noexcept { return p[0] * std::expm1(p[1] * m.depth); }
  void gradient(Eigen::VectorXd const& p, Measurement const& m, Eigen::Ref<Eigen::RowVectorXd> g) const noexcept {
    g[0] = std::expm1(p[1] * m.depth);
    g[1] = p[0] * m.depth * std::exp(p[1] * m.depth);
  }
  /// Beyond the deepest measurement it goes on straight.
  ExponentialContact<double> law(Eigen::VectorXd const& p, MeasuredRange const& depths) const noexcept {
    return {.scale = p[0], .rate = p[1], .largest_depth = depths.high};
  }
};

/// F = max(0, k dⁿ (1 + μ ḋ)), n ≥ 1. Becomes a `HuntCrossleyContact`. Its k has the unit of its own n; two fits with different n have no k in common.
/// Where a test has no puncture, the way back counts too.
struct HuntCrossleyModel {
  std::string_view name() const noexcept { return "hunt-crossley"; }
  std::vector<ModelParameter> parameters() const { return {{"k", "N/m^n"}, {"n", "", 1.0}, {"mu", "s/m"}}; }
  std::vector<Measurement> takes(std::span<Measurement const> measurements) const { return detail::contact_measurements(measurements, true); }
  /// The line through the logarithms of depth and force.
  Eigen::VectorXd start(std::span<Measurement const> measurements) const {
    double count = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
    for (Measurement const& m : measurements) {
      if (!(m.depth > 0.0 && m.force > 0.0)) continue;
      double const u = std::log(m.depth), v = std::log(m.force);
      count += 1.0, x += u, y += v, xx += u * u, xy += u * v;
    }
    double const spread = count * xx - x * x;
    double const n = spread > 0.0 ? std::clamp((count * xy - x * y) / spread, 1.0, 6.0) : 1.5;
    return Eigen::Vector3d(count > 0.0 ? std::exp((y - n * x) / count) : 1.0, n, 0.0);
  }
  double force(Eigen::VectorXd const& p, Measurement const& m) const noexcept {
    return p[0] * std::pow(m.depth, p[1]) * std::max(0.0, 1.0 + p[2] * m.inward_speed());   // a tool that leaves fast is not held
  }
  void gradient(Eigen::VectorXd const& p, Measurement const& m, Eigen::Ref<Eigen::RowVectorXd> g) const noexcept {
    double const power = std::pow(m.depth, p[1]), damped = 1.0 + p[2] * m.inward_speed();
    if (damped < 0.0) {
      g.setZero();
      return;
    }
    g[0] = power * damped;
    g[1] = m.depth > 0.0 ? p[0] * power * std::log(m.depth) * damped : 0.0;
    g[2] = p[0] * power * m.inward_speed();
  }
  HuntCrossleyContact<double> law(Eigen::VectorXd const& p, MeasuredRange const&) const noexcept { return {.stiffness = p[0], .exponent = p[1], .damping = p[2]}; }
};

}  // namespace palpate
